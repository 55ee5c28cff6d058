"""Quadratic evaluators: RTL against its twin, pixel by pixel and clock by clock."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.sim.engines.simulate import simulate

FORMATS = (GPQ.G_FORMAT, GPQ.P_FORMAT, COMPONENT)


def spans(parameters, lengths, seed):
    """Spans with coefficients of every size, the words' ends among them, and their normals by the twin."""
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    count = len(lengths)
    g, p, q = (rng.integers(f.min_code, f.max_code + 1, (count, 3)) for f in FORMATS)
    p[::2], g[::2] = p[::2] // 4, g[::2] // 4
    for offset, pick in ((0, "min_code"), (1, "max_code")):
        for word, format in zip((g, p, q), FORMATS, strict=True):
            word[offset::13] = getattr(format, pick)
    span = np.repeat(np.arange(count), lengths)
    index = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    words = (Fixed(f, word) for f, word in zip(FORMATS, (g, p, q), strict=True))
    normals = parameters.compute(*words, np.maximum(lengths, 1), span, index)
    return {"g": g, "p": p, "q": q, "length": lengths}, normals.codes


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_no_gap_between_spans(form):
    parameters = QuadraticEvaluator(form)
    unit = QuadraticEvaluatorUnit(parameters)
    shortest = 7 if form == "direct" else 4
    rng = np.random.default_rng(1)
    lengths = np.r_[np.full(6, shortest), 4095, shortest, 16, rng.integers(shortest, 40, 300)]
    beats, expected = spans(parameters, lengths, 2)
    run = simulate(unit, beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    assert run.input_cycles[0] == 0
    np.testing.assert_array_equal(run.cycles, unit.latency + unit.cycles_per_pixel * np.arange(len(expected)))


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_stiff_short_spans_come_seven_clocks_apart(form):
    parameters = QuadraticEvaluator(form)
    unit = QuadraticEvaluatorUnit(parameters)
    lengths = np.r_[1, 0, 2, 0, 0, 3, 1, 1, 2]
    beats, expected = spans(parameters, lengths, 3)
    run = simulate(unit, beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    np.testing.assert_array_equal(run.input_cycles, 7 * np.arange(len(lengths)))
    starts = np.repeat(run.input_cycles, lengths) + unit.latency
    index = np.arange(len(expected)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    # The polynomial takes pixels in on every clock (horner: on every second, counted from a pixel inside).
    late = run.cycles - (starts + unit.cycles_per_pixel * index)
    assert np.all((late >= 0) & (late < unit.cycles_per_pixel))


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
@pytest.mark.parametrize("seed", range(2))
def test_equals_twin_under_stalls(form, seed):
    rng = np.random.default_rng(seed)
    parameters = QuadraticEvaluator(form)
    beats, expected = spans(parameters, np.r_[4095, rng.integers(0, 40, 300)], seed)
    for input_share, output_share in ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        run = simulate(
            QuadraticEvaluatorUnit(parameters), beats, count=len(expected), engine="auto", **stalls
        )
        np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_engines_agree(form):
    rng = np.random.default_rng(5)
    parameters = QuadraticEvaluator(form)
    beats, expected = spans(parameters, rng.integers(0, 12, 40), 5)
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    slow, fast = (
        simulate(QuadraticEvaluatorUnit(parameters), beats, count=len(expected), engine=engine, **stalls)
        for engine in ("pysim", "auto")
    )
    np.testing.assert_array_equal(slow.beats, expected)
    np.testing.assert_array_equal(fast.beats, expected)
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_stiff_angles_and_lengths(normal_pairs, form):
    """Normals of every angle, opposite ones too, over every length of the list; and words at their ends."""
    angles = np.repeat([0, 1e-4, 1, 45, 89.9, 90, 90.01, 135, 180], 5)
    lengths = np.tile([1, 2, 3, 16, 4095], 9)
    left, right = normal_pairs(np.random.default_rng(8), len(angles), angles)
    left, right = (Fixed(COMPONENT, quantise(normals)) for normals in (left, right))
    middle, _ = MiddleNormal().compute(left, right)
    real = [word.codes for word in GPQ().compute(left, middle, right)]
    corner = np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1)
    ends = [
        np.where(pick, f.max_code, f.min_code)[:, np.newaxis].repeat(3, 1)
        for f, pick in zip(FORMATS, corner, strict=True)
    ]
    words = [np.vstack([both, one]) for both, one in zip(real, ends, strict=True)]
    lengths = np.r_[lengths, np.full(8, 33)]
    parameters = QuadraticEvaluator(form)
    span = np.repeat(np.arange(len(lengths)), lengths)
    index = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    coefficients = (Fixed(f, word) for f, word in zip(FORMATS, words, strict=True))
    expected = parameters.compute(*coefficients, lengths, span, index).codes
    beats = {**dict(zip("gpq", words, strict=True)), "length": lengths}
    stalls = {"output_stalls": np.random.default_rng(9).random(1009) < 0.2}
    run = simulate(QuadraticEvaluatorUnit(parameters), beats, count=len(expected), engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats, expected)


def test_lengths_over_the_whole_range():
    parameters = QuadraticEvaluator()
    beats, expected = spans(parameters, np.r_[np.arange(40, 4095, 97), 4094, 4095], 6)
    run = simulate(QuadraticEvaluatorUnit(parameters), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


def test_every_bit_counts():
    """Every length, and what the last bits of the products and of the step give, which are rounded off."""
    parameters = QuadraticEvaluator()
    rng = np.random.default_rng(7)
    beats, expected = spans(parameters, np.r_[rng.permutation(4096)[:60], rng.integers(0, 40, 3000)], 7)
    run = simulate(QuadraticEvaluatorUnit(parameters), beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize("form", QUADRATIC_FORMS)
def test_stiff_reset_in_mid_span_leaves_nothing(form):
    unit = QuadraticEvaluatorUnit(QuadraticEvaluator(form))
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    span = unit.i.payload
    found = []

    async def drive(context):
        context.set(unit.o.ready, 1)
        for start, slope, length, cycles in ((0.75, 0.125, 60, 40), (0.25, -0.5, 3, 40)):
            context.set(span.length, length)
            for c in range(3):
                context.set(span.q[c], start)
                context.set(span.p[c], slope)
            context.set(unit.i.valid, 1)
            await context.tick()
            context.set(unit.i.valid, 0)
            for _ in range(cycles):
                if context.get(unit.o.valid) and length == 3:
                    found.append(context.get(Value.cast(unit.o.payload[2])))
                await context.tick()
            context.set(reset, 1)
            await context.tick()
            context.set(reset, 0)
            assert not context.get(unit.o.valid)
            assert context.get(unit.i.ready)

    simulator.add_testbench(drive)
    simulator.run()
    assert found == [2**15, 0, -(2**15)]
