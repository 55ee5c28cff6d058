# amaranth: UnusedElaboratable=no
"""From the mesh to the bits of the lanes: frames equal the model's, and heavy frames lose bands."""

from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.frames.compare import compare_image
from blysk.golden.gpu import Gpu
from blysk.golden.video.band_buffer import RGB565, RGB888, BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode
from blysk.golden.video.draw_unit import Drawing, board_design, turned
from blysk.hdl.gpu import GpuUnit
from blysk.sim.api.scene import scene
from blysk.sim.frames.display import OneClock, show

pytestmark = [pytest.mark.long, pytest.mark.ci]

BACKGROUND = (26, 28, 32)


def gpu(blank, bits=RGB888):
    """A small teapot on a display whose lines have ``blank`` blank pixels, which is the time to draw."""
    mode = DisplayMode(Axis(64, 4, 8, blank), Axis(48, 2, 2, 8))
    given = scene("teapot", triangles=200, size=mode.size, back_faces="cull")
    design = board_design().built(top="render", geometry_style="compact")
    drawing = Drawing.of([given], design, lines=8)
    return Gpu(drawing, BandBuffer(mode, 8, bits, BACKGROUND)), given


def shown(made, frames):
    """Frames of its lanes."""
    top = OneClock(GpuUnit(made), Fraction(1, 2))
    return show(top, made.buffer.mode, frames)


def test_frames_equal_the_models():
    """Frames equal the model's to the bit, are near the exact frame, and no band is late."""
    made, given = gpu(1000)
    found = shown(made, 3)
    np.testing.assert_array_equal(found.frames, made.frames(3))
    assert found.status["late_bands"] == 0
    assert found.status["out_of_range_spans"] == 0
    # The mesh turns.
    assert (found.frames[0] != found.frames[1]).any()
    state = made.drawing.controls.advance(made.drawing.controls.start)
    figures = compare_image(turned(given, state.angle), made.drawing.renderer.design, found.frames[0])
    # Corners move by up to a hundredth of a pixel. Where an edge moves across a pixel's centre, surface or
    # background changes.
    assert figures.total_error.psnr_db > 30


def test_heavy_frames_lose_bands_only():
    """Every band is that of some angle of the motion, or background. Every background band was counted."""
    made, _ = gpu(30, RGB565)
    frames = 6
    found = shown(made, frames)
    buffer, drawing = made.buffer, made.drawing
    bands = found.frames.reshape(frames, buffer.bands, buffer.lines, *found.frames.shape[2:])
    controls, state, drawn = drawing.controls, drawing.controls.start, []
    for _ in range(frames):
        state = controls.advance(state)
        drawn.append(made.frame(state.angle).reshape(bands.shape[1:]))
    empty = buffer.shown(buffer.kept(BACKGROUND))
    late = 0
    for frame in bands:
        for band, lines in enumerate(frame):
            right = [(lines == each[band]).all() for each in drawn]
            is_empty = (lines == empty).all()
            assert any(right) or is_empty
            late += is_empty and not any((each[band] == empty).all() for each in drawn)
    assert late > 0
    assert found.status["late_bands"] >= late
