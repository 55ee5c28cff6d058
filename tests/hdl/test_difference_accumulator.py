"""Forward-difference accumulator: RTL against its twin, pixel by pixel."""

import numpy as np
import pytest

from golden.difference_accumulator import DifferenceAccumulator
from golden.fixed import Fixed
from golden.unit_vector import COMPONENT
from hdl.difference_accumulator import DifferenceAccumulatorUnit
from sim.engine import simulate

FORMAT = DifferenceAccumulator.FORMAT


def spans(lengths, seed):
    """Spans with differences of every size, the words' ends among them, and their normals by the twin."""
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    start = rng.integers(COMPONENT.min_code, COMPONENT.max_code + 1, (len(lengths), 3))
    size = 2.0 ** rng.uniform(0, FORMAT.width - 1, (2, len(lengths), 3))
    first, second = (np.trunc(s * rng.choice([-1, 1], s.shape)).astype(np.int64) for s in size)
    first[::17], second[::19] = FORMAT.min_code, FORMAT.max_code
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
    clocks_taken = np.maximum(lengths, 1)
    np.testing.assert_array_equal(run.input_clocks, np.cumsum(clocks_taken) - clocks_taken)
    first_pixel = np.repeat(run.input_clocks, lengths) + DifferenceAccumulatorUnit.latency
    step = np.arange(len(expected)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    np.testing.assert_array_equal(run.clocks, first_pixel + step)


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
    np.testing.assert_array_equal(slow.clocks, fast.clocks)
    np.testing.assert_array_equal(slow.input_clocks, fast.input_clocks)
