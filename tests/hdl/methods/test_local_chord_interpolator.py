# amaranth: UnusedElaboratable=no
"""The local chord method: RTL against its twin, pixel by pixel and clock by clock."""

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator, SpanValues
from blysk.golden.number.spans import pixels_of
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.sim.engines.beats import dtype_of, pack
from blysk.sim.engines.simulate import simulate

METHOD = LocalChordInterpolator()
VARIANTS = [(1, 4), (2, 4), *(pytest.param(1, interval, marks=pytest.mark.long) for interval in (1, 2, 6))]


def spans(rng, lights, count, longest=24):
    """Curves that fit, one in eight that does not, some at the ends of the ranges."""
    p = LocalChordSetup
    values = []
    for format in (p.DIFFUSE_FORMAT, p.HIGHLIGHT_FORMAT):
        top = format.max_code
        start = rng.uniform(max(format.min_code, -top) * 0.7, top * 0.7, (count, lights, 1))
        size = (
            10.0 ** rng.uniform(-5, -0.5, (count, 1, 1))
            * np.where(np.arange(count) % 8, 1, 20)[:, None, None]
        )
        slope, bend = rng.uniform(-0.3, 0.3, (2, count, lights, 1)) * size * top
        t = np.array([0, 0.5, 1])
        codes = np.clip(np.rint(start + t * (slope + t * bend)), format.min_code, top)
        codes[::40] = rng.choice([format.min_code, top, 0], (len(codes[::40]), lights, 1))
        values.append(codes.astype(np.int64))
    length = rng.integers(1, longest, count, endpoint=True)
    length[:4] = [1, 2, 3, longest]
    return SpanValues(*values), length


def beats_of(unit, values, length):
    beats = np.zeros(len(length), dtype_of(unit.i.payload.shape()))
    for name in unit.i.payload.shape().members["values"].elem_shape.members:
        beats["values"][name] = getattr(values, name)
    beats["length"] = length
    return beats


def expected_of(unit, values, length):
    operands = METHOD.compute_values(values, length)
    expected = np.zeros(
        (len(operands.cosine.codes), unit.lights), dtype_of(unit.o.payload.shape().elem_shape)
    )
    expected["cosine"] = operands.cosine.codes
    if unit.highlights:
        expected["highlight"] = operands.highlight.codes
    return expected, operands.out_of_range


@pytest.mark.parametrize(("lights", "interval"), VARIANTS)
def test_equals_twin(lights, interval):
    """Every operand; the cycles of every pixel; random stalls on both sides, on both engines."""
    rng = np.random.default_rng(lights + 10 * interval)
    unit = LocalChordInterpolatorUnit(METHOD, lights, setup_interval=interval)
    values, length = spans(rng, lights, 300)
    beats = beats_of(unit, values, length)
    expected, out_of_range = expected_of(unit, values, length)
    assert 10 < np.count_nonzero(out_of_range) < 150
    run = simulate(unit, beats, count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    _, step = pixels_of(length)
    first = np.flatnonzero(step == 0)
    # The first span comes out `latency` after it went in, its pixels on the cycles after.
    assert run.cycles[0] == run.input_cycles[0] + unit.latency
    np.testing.assert_array_equal(np.diff(run.cycles)[step[1:] > 0], 1)
    assert np.all(run.cycles[first] >= run.input_cycles + unit.latency)
    for input_share, output_share in ((0.4, 0.4), (0.9, 0.1), (0.1, 0.9)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        run = simulate(unit, beats, count=len(expected), engine="auto", **stalls)
        np.testing.assert_array_equal(run.beats, expected)
        few = 20
        count = int(length[:few].sum())
        slow, fast = (
            simulate(unit, beats[:few], count=count, engine=engine, **stalls) for engine in ("pysim", "auto")
        )
        np.testing.assert_array_equal(slow.beats, expected[:count])
        np.testing.assert_array_equal(slow.cycles, fast.cycles)
        np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)


def test_long_spans_leave_no_gap():
    """One pixel a clock from the first on, spans of the interval's length and more."""
    rng = np.random.default_rng(5)
    unit = LocalChordInterpolatorUnit(METHOD, 1)
    values, length = spans(rng, 1, 60, 4095)
    length = np.maximum(length, 4)
    expected, _ = expected_of(unit, values, length)
    run = simulate(unit, beats_of(unit, values, length), count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)
    np.testing.assert_array_equal(run.cycles, unit.latency + np.arange(len(expected)))


def test_every_bit_counts():
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    unit = LocalChordInterpolatorUnit(METHOD, 1)
    values, length = spans(np.random.default_rng(9), 1, 8000)
    expected, _ = expected_of(unit, values, length)
    run = simulate(unit, beats_of(unit, values, length), count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


def test_without_highlights():
    rng = np.random.default_rng(6)
    unit = LocalChordInterpolatorUnit(METHOD, 2, setup_interval=2, highlights=False, length_bits=5)
    assert cost_of(unit).multiplier_count == 3
    values, length = spans(rng, 2, 100)
    values = SpanValues(values.diffuse, 0 * values.highlight)
    expected, _ = expected_of(unit, values, length)
    run = simulate(unit, beats_of(unit, values, length), count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


def words_of(unit, beats):
    packed = pack(unit.i.payload.shape(), beats)
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in packed]


def test_wide_is_high_once_a_span():
    """As many cycles as the twin flags spans, while the output waits now and then."""
    rng = np.random.default_rng(7)
    unit = LocalChordInterpolatorUnit(METHOD, 1, setup_interval=2)
    values, length = spans(rng, 1, 60, 6)
    expected, out_of_range = expected_of(unit, values, length)
    words = words_of(unit, beats_of(unit, values, length))
    high = []

    async def bench(context):
        sent = pixels = 0
        while pixels < len(expected):
            context.set(unit.i.valid, sent < len(words))
            context.set(Value.cast(unit.i.payload).as_unsigned(), words[min(sent, len(words) - 1)])
            context.set(unit.o.ready, int(rng.random() < 0.6))
            sent += context.get(unit.i.valid & unit.i.ready)
            pixels += context.get(unit.o.valid & unit.o.ready)
            high.append(context.get(unit.out_of_range))
            await context.tick()

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert 0 < out_of_range.sum() == sum(high) < 60


def test_reset_leaves_nothing_behind(verify_reset):
    """After a reset in mid-span, too."""
    unit = LocalChordInterpolatorUnit(METHOD, 1)
    values, length = spans(np.random.default_rng(8), 1, 12, 6)
    pixels = length[:6].sum()
    found = verify_reset(unit, beats_of(unit, values, length), (1, 9, 18, 30), unit.latency + pixels + 10)
    assert len(found) == pixels
    assert found[0][0] == unit.latency


@pytest.mark.parametrize(("lights", "interval"), VARIANTS)
def test_multipliers(lights, interval):
    """Those of the setup alone."""
    cost = cost_of(LocalChordInterpolatorUnit(METHOD, lights, setup_interval=interval))
    assert cost.multipliers == {(18, 18): -(-(1 + 5 * lights) // interval)}


def test_is_an_interpolator_but_for_its_input():
    """The shell finds what it reads of an interpolator unit."""
    unit = LocalChordInterpolatorUnit(METHOD, 2, setup_interval=3)
    assert (unit.lights, unit.setup_interval, unit.cycles_per_pixel) == (2, 3, 1)
    assert list(type(unit).setup_intervals(METHOD)) == [1, 2, 3, 4, 5, 6]
    theirs = InterpolatorUnit(METHOD, 2)
    assert unit.o.payload.shape() == theirs.o.payload.shape()
    members = unit.i.payload.shape().members
    assert (list(members), members["values"].length) == (["values", "length"], 2)
    assert cost_of(unit).multiplier_count == 4
