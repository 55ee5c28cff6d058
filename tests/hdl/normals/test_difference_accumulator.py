"""Forward-difference accumulator: RTL against its twin, pixel by pixel."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.sim.engines.simulate import simulate

FORMAT = DifferenceAccumulator().format


def half_step(rng, shape):
    """Differences of half a step of a normal, give or take a code."""
    half = 1 << FORMAT.fraction_bits - COMPONENT.fraction_bits - 1
    return half * rng.choice([-1, 1], shape) + rng.integers(-1, 2, shape)


def spans(lengths, seed):
    """Spans with differences of every size, the words' ends among them, and their normals by the twin."""
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    start = rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (len(lengths), 3))
    size = 2.0 ** rng.uniform(0, FORMAT.width - 1, (2, len(lengths), 3))
    first, second = (np.trunc(s * rng.choice([-1, 1], s.shape)).astype(np.int64) for s in size)
    first[::17], second[::19] = FORMAT.min_code, FORMAT.max_code
    # The second pixel a code below the border of the rounding, on it, and above.
    first[1::17], second[1::17] = half_step(rng, first[1::17].shape), 0
    span = np.repeat(np.arange(len(lengths)), lengths)
    step = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    normals = DifferenceAccumulator().compute(
        Fixed(COMPONENT, start), Fixed(FORMAT, first), Fixed(FORMAT, second), span, step
    )
    return {"start": start, "first": first, "second": second, "length": lengths}, normals.codes


def test_one_normal_a_clock_without_gaps():
    lengths = np.r_[1, 2, 3, 16, 1, 1, 4095, 0, 5, 0, 0, 1]
    beats, expected = spans(lengths, 1)
    run = simulate(DifferenceAccumulatorUnit(), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    cycles_taken = np.maximum(lengths, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(cycles_taken) - cycles_taken)
    first_pixel = np.repeat(run.input_cycles, lengths) + DifferenceAccumulatorUnit.latency
    step = np.arange(len(expected)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    np.testing.assert_array_equal(run.cycles, first_pixel + step)


@pytest.mark.parametrize("seed", range(3))
def test_equals_twin_under_stalls(seed):
    rng = np.random.default_rng(seed)
    beats, expected = spans(rng.integers(0, 40, 400), seed)
    stalls = {
        "input_stalls": rng.random(997) < 0.5,
        "output_stalls": rng.random(1009) < rng.choice([0.1, 0.5]),
    }
    run = simulate(DifferenceAccumulatorUnit(), beats, count=len(expected), engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats, expected)


def test_every_bit_counts_in_long_spans():
    """What the differences' last bits give shows after thousands of pixels."""
    beats, expected = spans(np.random.default_rng(11).integers(3000, 4096, 40), 11)
    run = simulate(DifferenceAccumulatorUnit(), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


def test_engines_agree():
    rng = np.random.default_rng(5)
    beats, expected = spans(rng.integers(0, 12, 40), 5)
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    slow, fast = (
        simulate(DifferenceAccumulatorUnit(), beats, count=len(expected), engine=engine, **stalls)
        for engine in ("pysim", "auto")
    )
    np.testing.assert_array_equal(slow.beats, expected)
    np.testing.assert_array_equal(fast.beats, expected)
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)


@pytest.mark.parametrize("clock", [1, 2, 3, 30, 58, 59, 60])
@pytest.mark.parametrize("ready", [0, 1])
def test_reset_in_mid_span_leaves_nothing(clock, ready):
    """From the first clock of a span of 60 to its last, with and without a waiting pixel."""
    beats, expected = spans([60, 3], 7)
    unit, reset = DifferenceAccumulatorUnit(), Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    found = []

    def skid_buffer(context, index):
        span = unit.i.payload
        context.set(span.length, beats["length"][index].item())
        for name in ("start", "first", "second"):
            for c in range(3):
                context.set(Value.cast(span[name][c]), beats[name][index, c].item())
        context.set(unit.i.valid, 1)

    async def drive(context):
        skid_buffer(context, 0)
        context.set(unit.o.ready, ready)
        await context.tick()
        context.set(unit.i.valid, 0)
        await context.tick().repeat(clock)
        assert context.get(unit.o.valid)
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        context.set(unit.o.ready, 1)
        for _ in range(70):
            assert not context.get(unit.o.valid)
            assert context.get(unit.i.ready)
            await context.tick()
        skid_buffer(context, 1)
        for _ in range(8):
            await context.tick()
            context.set(unit.i.valid, 0)
            if context.get(unit.o.valid):
                found.append([context.get(Value.cast(unit.o.payload[c])) for c in range(3)])

    simulator.add_testbench(drive)
    simulator.run()
    assert found == expected[60:].tolist()
