"""Highlight-cosine unit: RTL against its twin, pixel by pixel and clock by clock."""

import numpy as np
import pytest

from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import Fixed
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.sim.engines.simulate import simulate


def spans(lengths, seed, parameters=None):
    """Spans with peaks, turning points of the fold and the words' ends among them, and their values."""
    parameters = parameters or HighlightCosine()
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    count = len(lengths)
    phase = rng.integers(-(1 << 39), 1 << 39, count)
    phase[1::4] = rng.normal(size=len(phase[1::4])) * 2.0**35
    phase[2::8] = rng.choice([-(1 << 39), (1 << 39) - 1, -(1 << 38), 1 << 38, -1, 0, 1], len(phase[2::8]))
    step = np.trunc(2.0 ** rng.uniform(0, 39, count)).astype(np.int64)
    step[::17] = rng.choice([0, (1 << 40) - 1, 1 << 38, 1 << 39], len(step[::17]))
    # The second value about a border of what the table is addressed with: of lower bits, only a carry counts.
    bit = rng.integers(0, 15, len(phase[4::8]))
    phase[4::8] = (phase[4::8] >> 15 << 15) + (1 << bit)
    step[4::8] = (1 << bit) + rng.integers(0, 2, len(bit))
    cos_beta = rng.integers(0, (1 << 25) + 1, count)
    cos_beta[3::8] = rng.choice([0, 1 << 25, (1 << 26) - 1, (1 << 26) - 256], len(cos_beta[3::8]))
    span = np.repeat(np.arange(count), lengths)
    index = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    expected = parameters.compute(
        Fixed(parameters.PHASE_FORMAT, phase),
        Fixed(parameters.STEP_FORMAT, step),
        Fixed(parameters.COS_BETA_FORMAT, cos_beta),
        span,
        index,
    )
    return {"phase": phase, "step": step, "cos_beta": cos_beta, "length": lengths}, expected.codes


def test_one_value_a_clock_without_gaps():
    lengths = np.r_[1, 2, 3, 16, 1, 1, 4095, 0, 5, 0, 0, 1]
    beats, expected = spans(lengths, 1)
    run = simulate(HighlightCosineUnit(), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    cycles_taken = np.maximum(lengths, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(cycles_taken) - cycles_taken)
    first_pixel = np.repeat(run.input_cycles, lengths) + HighlightCosineUnit.latency
    step = np.arange(len(expected)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    np.testing.assert_array_equal(run.cycles, first_pixel + step)


def test_every_bit_counts():
    """Of the lengths, too; the last bits of the products are rounded off: each decides once in thousands."""
    powers = 1 << np.arange(12)
    beats, expected = spans(np.r_[powers, powers + 1, np.random.default_rng(9).integers(1, 4, 40_000)], 9)
    run = simulate(HighlightCosineUnit(), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize(
    "parameters",
    [HighlightCosine(), HighlightCosine(interpolated=False), HighlightCosine(address_bits=6)],
    ids=["default", "as_drawn", "small"],
)
def test_equals_twin_under_stalls(parameters):
    unit = HighlightCosineUnit(parameters)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        beats, expected = spans(rng.integers(0, 40, 600), seed, parameters)
        stalls = {
            "input_stalls": rng.random(997) < 0.5,
            "output_stalls": rng.random(1009) < (0.0, 0.1, 0.5)[seed],
        }
        run = simulate(unit, beats, count=len(expected), engine="auto", **stalls)
        np.testing.assert_array_equal(run.beats, expected)


def test_engines_agree():
    rng = np.random.default_rng(5)
    beats, expected = spans(rng.integers(0, 12, 40), 5)
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    slow, fast = (
        simulate(HighlightCosineUnit(), beats, count=len(expected), engine=engine, **stalls)
        for engine in ("pysim", "auto")
    )
    np.testing.assert_array_equal(slow.beats, expected)
    np.testing.assert_array_equal(fast.beats, expected)
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)
