"""Frames by simulated geometry, shading and depth test, against their bit-accurate models."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.golden.reference.raster import rasterise
from blysk.golden.render import Renderer
from blysk.sim.api.design import design
from blysk.sim.api.scene import scene
from blysk.sim.engines.engine import SimulationError
from blysk.sim.frames.frame import sample_constants
from blysk.sim.frames.triangles import TriangleSimulator, sample_triangles

SIZE = 64, 48


@pytest.fixture(scope="module")
def simulator():
    return TriangleSimulator(Renderer(design()), SIZE)


@pytest.mark.long
@pytest.mark.parametrize(("triangles", "back_faces"), [(200, "flip"), (1000, "cull")])
def test_frame_is_the_model_s(simulator, triangles, back_faces):
    """Picture and counters equal the model's.

    Cycles are at most the larger of setup and pixels of the drawn triangles.

    They are at least one for each pixel, with hidden pixels at the end.
    """
    drawn = scene("teapot", size=SIZE, triangles=triangles, back_faces=back_faces)
    frame, model = simulator.render(drawn), triangle_frame(drawn, simulator.renderer)
    np.testing.assert_array_equal(frame.image, model.image)
    assert {name: frame.counts[name] for name in model.counts} == model.counts
    assert frame.visible == np.count_nonzero(model.owner >= 0)
    assert frame.spans == model.counts["spans"]
    assert frame.pixels == model.counts["pixels"]
    sent = frame.sent.triangles
    spans, _ = simulator.renderer.geometry.compute(sent, frame.sent.frame)
    pixels = np.bincount(spans.triangle, spans.length, len(sent))
    kept, _ = VertexSort(simulator.renderer.geometry.grid).compute(sent, frame.sent.frame)
    assert frame.pixels < frame.cycles < np.maximum(16, pixels)[kept.source].sum() + 600


@pytest.mark.long
@pytest.mark.parametrize(("style", "model"), [("throughput", "blinn"), ("compact", "phong")])
def test_vectors(style, model):
    """With the quotient method picture and counters equal the model's, and no piece misses its tolerance."""
    simulator = TriangleSimulator(Renderer(design(method="quotient", model=model, style=style)), SIZE)
    drawn = scene("teapot", size=SIZE, triangles=200)
    frame, model = simulator.render(drawn), triangle_frame(drawn, simulator.renderer)
    np.testing.assert_array_equal(frame.image, model.image)
    assert {name: frame.counts[name] for name in model.counts} == model.counts
    assert frame.counts["missed_pieces"] == frame.counts["out_of_range_spans"] == 0


@pytest.mark.long
def test_small_triangles_with_two_lanes():
    """Every triangle of the teapot is sent, and a shaded pixel takes at most 1.1 cycles.

    With back faces culled the frame takes at most 98,000 cycles.
    """
    size = 640, 480
    simulator = TriangleSimulator(Renderer(design().built(top="render", setups=2)), size)
    frame = simulator.render(scene("teapot", size=size, triangles=10_000))
    assert len(frame.sent.triangles) == 10_712
    assert frame.pixels <= frame.cycles <= 1.1 * frame.pixels
    culled = simulator.render(scene("teapot", size=size, triangles=10_000, back_faces="cull"))
    assert culled.pixels <= culled.cycles <= 98_000


@pytest.mark.parametrize(("albedo", "row"), [(None, 4), ("colors,nearest", 10)])
def test_a_high_triangle_may_be_silent_for_long(monkeypatch, albedo, row):
    """On a scanline outside of the picture a compact core takes as many cycles as there are attributes."""
    monkeypatch.setattr(TriangleSimulator, "_check", lambda simulator: None)
    renderer = Renderer(design(style="compact", albedo=albedo).built(top="render", style="compact"))
    high = TriangleSimulator(renderer, SIZE)
    triangles = sample_triangles(renderer, SIZE)[:1]
    triangles.x[:], triangles.y[:] = [0, 256, 512], [-2048 * 256, 0, 2047 * 256]
    sent = SceneTriangles(triangles, FrameSettings.centred(*SIZE), np.zeros(1, dtype=int), 0, 0)
    assert row * 4095 + 10_000 < high._longest_silence(sent) < row * 4095 + 12_000


ENDS = [(1, 1), (1, 2), (2, 1), (1, 4095), (4095, 1), (4085, 3), (4086, 3), (3, 4086), (4095, 4095)]


@pytest.mark.parametrize("size", ENDS)
def test_sizes_at_their_ends(size):
    """The triangles that check a new model lie in the grid and show pixels. Scenes cover what they should."""
    renderer = Renderer(design())
    checks = renderer.compute(
        sample_triangles(renderer, size), FrameSettings.centred(*size), sample_constants(renderer.design)
    )
    assert len(checks.x) > 0
    if min(size) <= 3:
        drawn = scene("teapot", size=size, triangles=64)
        owner = triangle_frame(drawn, renderer).owner
        np.testing.assert_array_equal(np.flatnonzero(owner >= 0), np.unique(rasterise(drawn).pixel))


@pytest.mark.long
@pytest.mark.parametrize("size", [(4095, 2), (2, 4095)])
def test_simulated_sizes_at_their_ends(size):
    drawn = scene("teapot", size=size, triangles=64)
    simulator = TriangleSimulator(Renderer(design()), size)
    frame, model = simulator.render(drawn), triangle_frame(drawn, simulator.renderer)
    np.testing.assert_array_equal(frame.image, model.image)
    assert frame.visible > 0


@pytest.mark.long
def test_two_sided(simulator):
    """Back faces of a two-sided material are turned, while others are left out."""
    drawn = scene("teapot", size=SIZE, triangles=200, back_faces="cull")
    mesh = replace(drawn.mesh, faces=drawn.mesh.faces[::2], material=drawn.mesh.material[::2])
    drawn = replace(drawn, mesh=mesh, material=replace(drawn.materials[0], two_sided=True))
    frame, flipped = simulator.render(drawn), simulator.render(replace(drawn, back_faces="flip"))
    np.testing.assert_array_equal(frame.image, triangle_frame(drawn, simulator.renderer).image)
    np.testing.assert_array_equal(frame.image, flipped.image)
    assert frame.counts["culled"] == 0


@pytest.mark.long
def test_an_empty_picture(simulator):
    """No triangle of the mesh is in front of the camera."""
    away = scene("teapot", size=SIZE, triangles=200, position=(0, 0, 9), target=(0, 0, 99))
    frame = simulator.render(away)
    assert frame.cycles == frame.pixels == frame.visible == 0
    assert len(np.unique(frame.image.reshape(-1, 3), axis=0)) == 1


@pytest.mark.long
def test_another_size_is_refused(simulator):
    """The memory of depths has the size of the picture."""
    with pytest.raises(ValueError, match="the scene is 16x12, the memory 64x48"):
        simulator.render(scene("teapot", size=(16, 12), triangles=200))


@pytest.mark.long
def test_a_wrong_model_is_found(monkeypatch):
    """Before a scene's triangles, a simulator checks some triangles of its own."""
    renderer = Renderer(design())
    compute = Renderer.compute

    def wrong(self, *operands):
        drawn = compute(self, *operands)
        drawn.color[-1] ^= 1
        return drawn

    monkeypatch.setattr(Renderer, "compute", wrong)
    with pytest.raises(SimulationError, match="differ from its bit-accurate model"):
        TriangleSimulator(renderer, SIZE)
