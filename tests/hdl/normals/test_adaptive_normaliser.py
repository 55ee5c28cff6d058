"""Adaptive normaliser: RTL against its twin, pixel by pixel."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.sim.engines.simulate import simulate


def spans(normal_pairs, parameters, angles, lengths, seed=1):
    """Beats of spans, and the normals, flags and levels by the twin."""
    rng = np.random.default_rng(seed)
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(lengths), angles))
    length = np.asarray(lengths)
    normal, out_of_range, levels = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right), length)
    beats = {"normal_left": left, "normal_right": right, "length": length}
    return beats, {"normal": normal.codes, "out_of_range": np.repeat(out_of_range, length)}, levels


def assert_equal(run, expected):
    np.testing.assert_array_equal(run.beats["normal"], expected["normal"])
    np.testing.assert_array_equal(run.beats["out_of_range"], expected["out_of_range"])


@pytest.mark.parametrize(
    "parameters",
    [
        AdaptiveNormaliser(),
        AdaptiveNormaliser(2.0**-14, Bisection(1, 45)),
        AdaptiveNormaliser(1 / 8),
        AdaptiveNormaliser(bisection=Bisection(as_published=True)),
    ],
    ids=str,
)
def test_equals_twin_without_gaps(normal_pairs, parameters):
    rng = np.random.default_rng(2)
    lengths = np.r_[
        1, 2, 3, 16, 4095, 0, 1, 1, 2, 2, 5, 17, 33, 64, 65, 100, 0, 0, 129, rng.integers(0, 80, 120)
    ]
    angles = rng.uniform(0, 95, len(lengths))
    angles[::5] = 10.0 ** rng.uniform(-4, 1, len(angles[::5]))
    angles[4], angles[20:24] = 44, [0, 45, 90, 180]
    beats, expected, levels = spans(normal_pairs, parameters, angles, lengths)
    assert levels.max() == parameters.depth
    assert levels.min() == 0
    unit = AdaptiveNormaliserUnit(parameters)
    count = lengths.sum()
    run = simulate(unit, beats, count=count, engine="auto")
    assert_equal(run, expected)
    # One normal a clock from the first of a span to its last.
    starts = np.cumsum(lengths) - lengths
    step = np.arange(count) - np.repeat(starts, lengths)
    first = run.cycles[np.minimum(starts, count - 1)]
    np.testing.assert_array_equal(run.cycles, np.repeat(first, lengths) + step)


def test_preparation_as_stated(normal_pairs):
    parameters = AdaptiveNormaliser()
    unit = AdaptiveNormaliserUnit(parameters)
    angles = np.r_[1.0, 0.0, 8, 16, 32, 44, 80, 120, 3, 3, 4]
    # As few pixels as there are segments: the back is free before the front is ready again.
    lengths = np.r_[2, 60, 3, 5, 9, 17, 17, 30, 1, 1, 2]
    beats, expected, levels = spans(normal_pairs, parameters, angles, lengths)
    np.testing.assert_array_equal(levels, [0, 0, 1, 2, 3, 4, 4, 0, 0, 0, 0])
    run = simulate(unit, beats, count=lengths.sum(), engine="auto")
    assert_equal(run, expected)
    first = run.cycles[np.cumsum(lengths) - lengths] - run.input_cycles
    stated = np.array([unit.preparation(k) for k in levels.tolist()])
    np.testing.assert_array_equal(first, np.where(lengths == 1, 56, stated))
    assert [unit.preparation(k) for k in range(3)] == [69, 83, 148]
    longer = lengths[:-1] > 1
    taken = np.diff(run.input_cycles)[longer]
    np.testing.assert_array_equal(taken, (stated[:-1] - 2)[longer])


def test_long_spans_follow_without_a_gap(normal_pairs):
    parameters = AdaptiveNormaliser()
    beats, expected, _ = spans(normal_pairs, parameters, [3.0, 5, 44, 20, 2], [1000, 500, 600, 300, 200])
    run = simulate(AdaptiveNormaliserUnit(parameters), beats, count=2600, engine="auto")
    assert_equal(run, expected)
    np.testing.assert_array_equal(np.diff(run.cycles), 1)


def test_equals_twin_under_stalls(normal_pairs):
    rng = np.random.default_rng(7)
    parameters = AdaptiveNormaliser()
    unit = AdaptiveNormaliserUnit(parameters)
    lengths = rng.integers(0, 200, 150)
    angles = np.where(rng.random(150) < 0.5, rng.uniform(0, 95, 150), rng.uniform(0, 4, 150))
    beats, expected, _ = spans(normal_pairs, parameters, angles, lengths)
    for input_share, output_share in ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        run = simulate(unit, beats, count=lengths.sum(), engine="auto", **stalls)
        assert_equal(run, expected)
    few = {name: value[:6] for name, value in beats.items()}
    count = lengths[:6].sum()
    slow, fast = (simulate(unit, few, count=count, engine=engine, **stalls) for engine in ("pysim", "auto"))
    np.testing.assert_array_equal(slow.beats["normal"], expected["normal"][:count])
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)


def test_front_runs_ahead_until_the_fifo_is_full(normal_pairs):
    """While the output waits: spans of one pixel are one segment each."""
    parameters, wait = AdaptiveNormaliser(), 6000
    lengths = np.ones(100, dtype=int)
    beats, expected, _ = spans(normal_pairs, parameters, np.linspace(0, 3, 100), lengths)
    stalls = np.arange(2 * wait) < wait
    run = simulate(AdaptiveNormaliserUnit(), beats, count=100, engine="auto", output_stalls=stalls)
    assert_equal(run, expected)
    # One span more is in the front, and one in the back.
    assert (run.input_cycles < wait).sum() == (2 << parameters.depth) + 2


def test_every_bit_counts(normal_pairs, one_minus_cosines):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    rng = np.random.default_rng(9)
    parameters = AdaptiveNormaliser()
    lengths = np.r_[rng.integers(1, 70, 2000), rng.integers(1000, 4096, 20)]
    angles = np.where(rng.random(2020) < 0.5, rng.uniform(0, 95, 2020), 10.0 ** rng.uniform(-4, 1, 2020))
    beats, expected, _ = spans(normal_pairs, parameters, angles, lengths)
    run = simulate(AdaptiveNormaliserUnit(parameters), beats, count=lengths.sum(), engine="auto")
    assert_equal(run, expected)
    # Of all pairs of ends those up to 90 degrees whose 1 - cosine is at the border of its rounding. The third
    # of five pixels is the normal half-way.
    left, right = (quantise(normals) for normals in normal_pairs(rng, 1500, 90))
    u = one_minus_cosines(left, right)
    first, second = np.nonzero((u < ONE_SQUARED.codes) & (abs(u % (1 << 17) - (1 << 16)) < 4))
    beats = {"normal_left": left[first], "normal_right": right[second], "length": np.full(len(first), 5)}
    normal, *_ = parameters.compute(
        *(Fixed(COMPONENT, beats[name]) for name in ("normal_left", "normal_right")), beats["length"]
    )
    run = simulate(AdaptiveNormaliserUnit(parameters), beats, count=5 * len(first), engine="auto")
    np.testing.assert_array_equal(run.beats["normal"], normal.codes)


@pytest.mark.parametrize("clock", [1, 20, 60, 120, 148, 152, 160, 168])
def test_reset_leaves_nothing(normal_pairs, clock):
    # Two levels: bisection to 80, segments to 150, pixels to 170.
    parameters = AdaptiveNormaliser()
    beats, expected, levels = spans(normal_pairs, parameters, [16.0, 1], [20, 7])
    np.testing.assert_array_equal(levels, [2, 0])
    unit = AdaptiveNormaliserUnit(parameters)
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    seen = []

    async def bench(context):
        def skid_buffer(span):
            context.set(unit.i.valid, 1)
            for name in ("normal_left", "normal_right"):
                code = sum((int(x) & 0x3FFFF) << (18 * c) for c, x in enumerate(beats[name][span]))
                context.set(Value.cast(unit.i.payload[name]), code)
            context.set(unit.i.payload.length, int(beats["length"][span]))

        context.set(unit.o.ready, 1)
        skid_buffer(0)
        await context.tick()
        context.set(unit.i.valid, 0)
        await context.tick().repeat(clock)
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        skid_buffer(1)
        for _ in range(100):
            taken = context.get(unit.i.valid & unit.i.ready)
            if context.get(unit.o.valid):
                seen.append([context.get(unit.o.payload.normal[c].as_value()) for c in range(3)])
            await context.tick()
            if taken:
                context.set(unit.i.valid, 0)

    simulator.add_testbench(bench)
    simulator.run()
    np.testing.assert_array_equal(seen, expected["normal"][20:])
