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


@pytest.mark.long
def test_two_pixels_a_cycle():
    """The model of two lanes of shading is within 1 % of the simulation, for long and for short spans."""
    size, lanes = (320, 240), 2
    renderer = Renderer(design().built(top="render", lanes=lanes, setups=4))
    simulator = TriangleSimulator(renderer, size)
    for triangles in (200, 3000):
        frame = simulator.render(scene("teapot", size=size, triangles=triangles))
        sent = frame.sent.triangles, frame.sent.frame
        cycles = triangle_cycles(renderer.geometry, *sent, setups=4, lanes=lanes)
        assert abs(cycles - frame.cycles) < 0.01 * frame.cycles
