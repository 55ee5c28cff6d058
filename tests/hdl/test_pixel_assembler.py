"""Pixel assembler: two streams joined into one, under random stalls on all three sides."""

import numpy as np
import pytest
from amaranth.hdl import Module, ResetInserter, Signal
from amaranth.sim import Simulator

from blysk.hdl.pixel_assembler import PixelAssemblerUnit


def drive(lengths, seed=0, shares=(0.0, 0.0, 0.0), reset_at=None):
    """Run the unit in pysim over spans of such lengths.

    ``shares`` of the cycles on which coordinates, colours and the sink are stalled. With ``reset_at``, the
    unit is reset on that cycle, and both streams begin again.

    Returns the pixels with their cycles, the cycles of the coordinates accepted, and the expected pixels.
    """
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    spans, count = len(lengths), int(lengths.sum())
    x, y = rng.integers(0, 4097 - lengths), rng.integers(0, 4096, spans)
    colors = rng.integers(0, 256, (count, 3)).tolist()
    pauses = rng.random((6 * count + 100, 3)) < shares
    span = np.repeat(np.arange(spans), lengths)
    offset = np.arange(count) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    expected = np.column_stack([x[span] + offset, y[span], colors, offset == lengths[span] - 1]).tolist()

    unit, reset = PixelAssemblerUnit(), Signal()
    m = Module()
    m.submodules.unit = ResetInserter(reset)(unit)
    pixels, span_cycles, color_cycles = [], [], []

    async def run(ctx, cycles, stop_when_done):
        span_waits = color_waits = False
        held = None
        for records in (pixels, span_cycles, color_cycles):
            records.clear()
        for clock in range(cycles):
            pause_span, pause_color, pause_sink = (bool(p) for p in pauses[clock % len(pauses)])
            # What is valid stays.
            span_waits = len(span_cycles) < spans and (span_waits or not pause_span)
            color_waits = len(color_cycles) < count and (color_waits or not pause_color)
            span_index, color = len(span_cycles), len(color_cycles)
            ctx.set(unit.coordinates.valid, span_waits)
            ctx.set(
                unit.coordinates.payload,
                {"x": int(x[span_index]), "y": int(y[span_index]), "length": int(lengths[span_index])}
                if span_waits
                else {"x": 4095, "y": 4095, "length": 4095},
            )
            ctx.set(unit.colors.valid, color_waits)
            channels = colors[color] if color_waits else (255, 255, 255)
            ctx.set(unit.colors.payload, dict(zip("rgb", channels, strict=True)))
            ctx.set(unit.o.ready, not pause_sink)
            valid = ctx.get(unit.o.valid)
            pixel = [ctx.get(unit.o.payload[name]) for name in ("x", "y", "r", "g", "b", "last")]
            assert held is None or (valid and pixel == held)
            held = pixel if valid and pause_sink else None
            if valid and not pause_sink:
                pixels.append((clock, pixel))
            if span_waits and ctx.get(unit.coordinates.ready):
                span_cycles.append(clock)
                span_waits = False
            if color_waits and ctx.get(unit.colors.ready):
                color_cycles.append(clock)
                color_waits = False
            await ctx.tick()
            if stop_when_done and len(pixels) == count and clock > pixels[-1][0] + 5:
                return

    async def bench(ctx):
        if reset_at is not None:
            await run(ctx, reset_at, False)
            ctx.set(reset, 1)
            await ctx.tick()
            ctx.set(reset, 0)
        await run(ctx, 20 * count + 200, True)

    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()
    return pixels, span_cycles, color_cycles, expected


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.long) for k in range(3, 8))])
def test_joins_the_streams_under_stalls(seed):
    rng = np.random.default_rng(seed)
    lengths = np.r_[1, 1, 2, 3, rng.integers(1, 12, 20)]
    shares = rng.choice([0.0, 0.1, 0.5, 0.85], 3)
    pixels, span_cycles, color_cycles, expected = drive(lengths, seed, shares)
    assert [pixel for _, pixel in pixels] == expected
    assert len(color_cycles) == len(pixels)
    # Coordinates come before the first colour of their span is accepted, and two are inside at most.
    last = np.cumsum(lengths) - 1
    assert np.all(np.array(span_cycles) + 1 <= np.array(color_cycles)[last - lengths + 1])
    assert np.all(span_cycles[2:] > np.array(color_cycles)[last[:-2]])


def test_one_pixel_a_cycle():
    lengths = [1, 5, 1, 1, 2, 16, 3]
    pixels, _, color_cycles, expected = drive(lengths)
    first = PixelAssemblerUnit.coordinates_latency
    assert [clock for clock, _ in pixels] == list(range(first, sum(lengths) + first))
    assert color_cycles == [clock - PixelAssemblerUnit.latency for clock, _ in pixels]
    assert [pixel for _, pixel in pixels] == expected


@pytest.mark.long
def test_longest_span_reaches_the_last_column():
    pixels, _, _, expected = drive([4095, 1])
    assert [pixel for _, pixel in pixels] == expected
    assert pixels[4094][1][5] == 1


@pytest.mark.parametrize("reset_at", [2, 7, 20, 31])
def test_reset_in_mid_span_leaves_nothing_behind(reset_at):
    """The offset starts again, and a pixel that waited is gone."""
    lengths = [9, 4, 12, 6]
    shares = (0.3, 0.3, 0.5)
    fresh = drive(lengths, 5, shares)
    again = drive(lengths, 5, shares, reset_at)
    assert again == fresh
    assert [pixel for _, pixel in fresh[0]] == fresh[3]
