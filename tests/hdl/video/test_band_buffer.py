# amaranth: UnusedElaboratable=no
"""Bands through two clocks: each band is shown as it was drawn last, or as background, at any speed of
drawing."""

import numpy as np
import pytest
from amaranth.hdl import Signal
from amaranth.lib.memory import Memory
from amaranth.sim import Simulator

from blysk.golden.video.band_buffer import RGB565, RGB888, BandBuffer
from blysk.golden.video.display_timing import Axis, DisplayMode, DisplayTiming
from blysk.hdl.video import band_buffer
from blysk.hdl.video.band_buffer import BandBufferUnit

MODE = DisplayMode(Axis(12, 2, 3, 3), Axis(16, 1, 2, 3))
FRAMES = 3


class Drawing:
    """A source of random bands: some are drawn twice, some pixels are outside.

    It keeps the last drawing of each band.
    """

    def __init__(self, model):
        self.model, self.frame, self.asked = model, -1, []
        width, height = model.mode.size
        self.picture = np.empty((height, width, 3), dtype=np.int64)

    def band(self, band):
        """Pixels of a band: x, y, r, g, b."""
        given = self.model
        self.frame += band == 0
        self.asked.append(band)
        rng = np.random.default_rng([self.frame + 1, band])
        width = given.mode.size[0]
        x = rng.integers(0, 1 << (width - 1).bit_length(), given.pixels)
        y = rng.integers(0, given.lines, given.pixels)
        colour = rng.integers(0, 256, (given.pixels, 3))
        lines = self.picture[band * given.lines : (band + 1) * given.lines]
        lines[:] = given.background
        for k in np.flatnonzero(x < width):
            lines[y[k], x[k]] = colour[k]
        return np.c_[x, y, colour].tolist()


def show(model, wait, periods=(1.0, 1.37), frames=FRAMES):
    """Frames that are shown, frames that should be shown, late bands, the buffer's counters, and the
    requested bands.

    ``wait`` gives the cycles that a band takes beside its pixels.
    """
    unit, timing, drawing = BandBufferUnit(model), DisplayTiming(model.mode), Drawing(model)
    simulator = Simulator(unit)
    simulator.add_clock(periods[0] * 1e-6, domain="sync")
    simulator.add_clock(periods[1] * 1e-6, domain="pixel", phase=0.3e-6)
    cycles = timing.compute((frames + 1) * model.mode.cycles)
    found, status, stop = [], {}, Signal()

    async def draw(ctx):
        count = 0
        while True:
            ctx.set(unit.request.ready, 1)
            (band,) = await ctx.tick().sample(unit.request.payload).until(unit.request.valid | stop)
            if ctx.get(stop):
                return
            ctx.set(unit.request.ready, 0)
            pixels = drawing.band(band)
            await ctx.tick().repeat(1 + wait(count))
            count += 1
            for values in pixels:
                ctx.set(unit.pixels.payload, dict(zip("xyrgb", values, strict=True)))
                ctx.set(unit.pixels.valid, 1)
                await ctx.tick().until(unit.pixels.ready | stop)
            ctx.set(unit.pixels.valid, 0)
            ctx.set(unit.done.payload, band)
            ctx.set(unit.done.valid, 1)
            await ctx.tick().until(unit.done.ready | stop)
            ctx.set(unit.done.valid, 0)

    async def watch(ctx):
        names = list(unit.shown.shape().members)
        for k in range(len(cycles["x"])):
            ctx.set(unit.timing, {name: int(values[k]) for name, values in cycles.items()})
            await ctx.tick("pixel")
            found.append([ctx.get(unit.shown[name]) for name in names])
        for name in ("late_bands", "frames"):
            status[name] = ctx.get(unit.status[name])
        ctx.set(stop, 1)

    simulator.add_testbench(draw)
    simulator.add_testbench(watch)
    simulator.run()
    found = dict(zip(unit.shown.shape().members, np.array(found).T, strict=True))
    for name, values in cycles.items():
        np.testing.assert_array_equal(found[name], values)
    colours = np.stack([found[channel] for channel in "rgb"], axis=-1)[cycles["active"]]
    width, height = model.mode.size
    return colours.reshape(-1, height, width, 3), status, drawing


def pictures(model, frames):
    """The frames of a drawing that is fast enough."""
    drawing, result = Drawing(model), []
    for _ in range(frames):
        for band in range(model.bands):
            drawing.band(band)
        result.append(model.compute(drawing.picture))
    return np.array(result)


@pytest.mark.parametrize(
    ("model", "periods"),
    [
        pytest.param(BandBuffer(MODE, 4), (1.0, 3.3), marks=pytest.mark.long),
        (BandBuffer(MODE, 2, RGB565, (10, 200, 77)), (1.0, 2.9)),
        pytest.param(BandBuffer(MODE, 4, RGB888, (255, 1, 128)), (0.37, 1.0), marks=pytest.mark.long),
    ],
)
def test_every_frame_in_time(model, periods):
    """With several clocks, formats and backgrounds."""
    frames, status, _ = show(model, lambda count: count % 7, periods)
    np.testing.assert_array_equal(frames[:FRAMES], pictures(model, FRAMES))
    assert status == {"late_bands": 0, "frames": FRAMES + 1}


def test_what_a_reset_finds_is_never_shown(monkeypatch):
    """Both buffers are cleared before their first bands, whatever they hold."""
    model = BandBuffer(MODE, 4)
    full = [0x5A5A5A] * (2 * model.pixels)
    monkeypatch.setattr(
        band_buffer, "Memory", lambda shape, depth, init: Memory(shape=shape, depth=depth, init=full)
    )
    frames, status, _ = show(model, lambda count: 0, (1.0, 4.0), frames=1)
    np.testing.assert_array_equal(frames[:1], pictures(model, 1))
    assert status["late_bands"] == 0


def is_background(model, frames):
    """Which bands of frames are all background; shape (frames, bands)."""
    empty = model.shown(model.kept(model.background))
    lines = (frames == empty).all((-1, -2)).reshape(len(frames), model.bands, model.lines)
    return lines.all(-1)


@pytest.mark.parametrize(("wait", "left_out"), [(260, True), (1200, False)])
def test_late_bands_are_background_and_counted(wait, left_out):
    """The timing goes on. Every band is a whole drawn band or background, and background bands are counted.

    After a late band the band of the next slot is requested. So some bands are left out, or none if each
    takes that long.
    """
    model = BandBuffer(MODE, 4, RGB888, (3, 2, 1))
    frames, status, drawing = show(model, lambda count: wait, (1.0, 1.4))
    late = is_background(model, frames)
    assert late.any()
    assert late.sum() == status["late_bands"]
    assert (np.diff(drawing.asked) % model.bands > 1).any() == left_out
    # All drawings, by band.
    again, drawn = Drawing(model), {}
    for band in drawing.asked:
        again.band(band)
        lines = slice(band * 4, band * 4 + 4)
        drawn.setdefault(band, []).append(again.picture[lines].copy())
    for frame, is_late in zip(frames, late, strict=True):
        for band in np.flatnonzero(~is_late).tolist():
            found = frame[band * 4 : band * 4 + 4]
            assert any((found == lines).all() for lines in drawn[band])


def test_it_recovers():
    """After one heavy band the frames are whole again."""
    model = BandBuffer(MODE, 4)
    frames, status, _ = show(model, lambda count: 700 * (count == 3), (1.0, 2.4))
    late = is_background(model, frames)
    assert late.sum() == status["late_bands"] > 0
    assert not late[2:].any()
