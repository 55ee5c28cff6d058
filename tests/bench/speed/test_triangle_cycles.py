"""Cycles of frames of triangles by the cycle model, against the simulation."""

import pytest

from blysk.bench.speed.triangle_cycles import triangle_cycles
from blysk.golden.render import Renderer
from blysk.sim.api.design import design
from blysk.sim.api.scene import scene
from blysk.sim.frames.triangles import TriangleSimulator


@pytest.mark.long
def test_small_triangles():
    """Setup, shading, and runs of dropped triangles set the pace in turns. The model is up to 5 % short."""
    size, lanes = (320, 240), 2
    simulator = TriangleSimulator(Renderer(design().built(top="render", setups=lanes)), size)
    for back_faces in ("cull", "flip"):
        frame = simulator.render(scene("teapot", size=size, triangles=10_000, back_faces=back_faces))
        sent = frame.sent
        cycles = triangle_cycles(simulator.renderer.geometry, sent.triangles, sent.frame, lanes)
        assert 0.95 * frame.cycles < cycles <= frame.cycles
