"""Recurrence unit: RTL against its twin, pixel by pixel and clock by clock."""

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.number.fixed import SQ, Fixed
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.sim.engines.simulate import simulate

VARIANTS = [
    Recurrence(),
    Recurrence(guard_bits=20),
    Recurrence("reinsch", 24, 20),
    Recurrence("direct"),
    Recurrence(interleave=4),
    Recurrence("reinsch", 24, 20, interleave=4),
    Recurrence("direct", interleave=4),
    Recurrence(interleave=4, result_format=SQ(2, 25)),
    Recurrence("direct", interleave=4, result_format=SQ(2, 25)),
]
FORMS = [Recurrence(), Recurrence("direct"), Recurrence(interleave=4), Recurrence("direct", interleave=4)]
COPIES = ("diffuse", "highlight")


def spans(recurrence, lengths, seed):
    """Cosines and, every third span, words of any size; results of both copies by the twin."""
    rng = np.random.default_rng(seed)
    lengths = np.asarray(lengths)
    count = len(lengths)
    step = np.radians(rng.uniform(0, 89, count)) / np.maximum(lengths - 1, 1)
    coefficient, shift = recurrence.coefficient(step)
    format, any_size = recurrence.coefficient_format, np.arange(0, count, 3)
    coefficient.codes[any_size] = rng.integers(format.min_code, format.max_code + 1, len(any_size))
    if recurrence.form == "reinsch":
        shift[any_size] = rng.integers(0, 64, len(any_size))
    span = np.repeat(np.arange(count), lengths)
    index = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    beats, expected = {"coefficient": coefficient.codes, "length": lengths}, {}
    if recurrence.form == "reinsch":
        beats["shift"] = shift
    format = recurrence.state_format
    for copy in COPIES:
        start = recurrence.start(rng.uniform(-1, 1, count), rng.uniform(-np.pi, np.pi, count), step)
        words = [word.codes.copy() for word in start]
        for word in words:
            word[any_size] = rng.integers(format.min_code, format.max_code + 1, word[any_size].shape)
            word[any_size[::5]] = rng.choice([format.min_code, format.max_code], word[any_size[::5]].shape)
        beats[copy] = dict(zip(("first", "second"), words, strict=True))
        start = (Fixed(format, word) for word in words)
        expected[copy] = recurrence.compute(*start, coefficient, shift, span, index).codes
    expected["last"] = (index == lengths[span] - 1).astype(np.uint8)
    return beats, expected


def assert_equal(run, expected):
    for name, value in expected.items():
        np.testing.assert_array_equal(run.beats[name], value, err_msg=name)


@pytest.mark.parametrize("recurrence", VARIANTS, ids=str)
def test_cycles(recurrence):
    unit = RecurrenceUnit(recurrence)
    lengths = np.r_[1, 2, 3, 16, 1, 1, 400, 0, 5, 0, 0, 1]
    beats, expected = spans(recurrence, lengths, 1)
    run = simulate(unit, beats, count=lengths.sum(), engine="auto")
    assert_equal(run, expected)
    taken = np.where(lengths > 0, unit.cycles_per_pixel * (lengths - 1) + 1, 1)
    np.testing.assert_array_equal(run.input_cycles, np.cumsum(taken) - taken)
    index = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    first = np.repeat(run.input_cycles, lengths) + unit.latency
    np.testing.assert_array_equal(run.cycles, first + unit.cycles_per_pixel * index)


@pytest.mark.parametrize("recurrence", VARIANTS, ids=str)
def test_equals_twin_under_stalls(recurrence):
    rng = np.random.default_rng(2)
    lengths = rng.integers(0, 40, 300)
    beats, expected = spans(recurrence, lengths, 3)
    for input_share, output_share in ((0, 0), (0.4, 0.4), (0.9, 0.1), (0.1, 0.9)):
        stalls = {
            "input_stalls": rng.random(997) < input_share,
            "output_stalls": rng.random(1009) < output_share,
        }
        run = simulate(RecurrenceUnit(recurrence), beats, count=lengths.sum(), engine="auto", **stalls)
        assert_equal(run, expected)


@pytest.mark.parametrize("recurrence", FORMS, ids=str)
def test_longest_span(recurrence):
    beats, expected = spans(recurrence, [4095] * 6, 4)
    run = simulate(RecurrenceUnit(recurrence), beats, count=6 * 4095, engine="auto")
    assert_equal(run, expected)


def test_every_bit_counts():
    """Spans of hardly any angle, which go to the border of the result's rounding: one step decides there."""
    rng, recurrence = np.random.default_rng(6), Recurrence()
    count, length = 100, 12
    beats = {"coefficient": np.zeros(count, int), "shift": np.full(count, 63)}
    beats["length"] = np.full(count, length)
    span, index = np.repeat(np.arange(count), length), np.tile(np.arange(length), count)
    expected, format = {}, recurrence.state_format
    cut = format.fraction_bits - recurrence.result_format.fraction_bits
    for copy in COPIES:
        difference = rng.choice([-1, 1], count) << rng.integers(0, 8, count)
        border = rng.integers(-(1 << 17), 1 << 17, count) * (1 << cut) + (1 << (cut - 1))
        first = border - rng.integers(1, length, count) * difference - rng.integers(0, 2, count)
        beats[copy] = {"first": first, "second": difference}
        words = (
            Fixed(format, first),
            Fixed(format, difference),
            Fixed(recurrence.coefficient_format, beats["coefficient"]),
        )
        expected[copy] = recurrence.compute(*words, beats["shift"], span, index).codes
    for stalls in (np.zeros(1, bool), rng.random(1009) < 0.4):
        run = simulate(RecurrenceUnit(), beats, count=len(span), engine="auto", output_stalls=stalls)
        assert_equal(run, expected)


@pytest.mark.parametrize("recurrence", FORMS, ids=str)
def test_engines_agree(recurrence):
    rng = np.random.default_rng(5)
    lengths = rng.integers(0, 8, 30)
    beats, expected = spans(recurrence, lengths, 5)
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    slow, fast = (
        simulate(RecurrenceUnit(recurrence), beats, count=lengths.sum(), engine=engine, **stalls)
        for engine in ("pysim", "auto")
    )
    assert_equal(slow, expected)
    assert_equal(fast, expected)
    np.testing.assert_array_equal(slow.cycles, fast.cycles)
    np.testing.assert_array_equal(slow.input_cycles, fast.input_cycles)


@pytest.mark.parametrize("recurrence", FORMS, ids=str)
@pytest.mark.parametrize("clock", [1, 2, 3, 4, 5, 8])
def test_reset_in_mid_span_leaves_nothing(recurrence, clock):
    unit = RecurrenceUnit(recurrence)
    reset = Signal()
    simulator = Simulator(ResetInserter(reset)(unit))
    simulator.add_clock(1e-6)
    phases = recurrence.interleave
    beats, expected = spans(recurrence, [9, 6], 6)
    found = {name: [] for name in expected}

    def code(value):
        width = recurrence.state_format.width
        return sum((int(word) & ((1 << width) - 1)) << (width * place) for place, word in enumerate(value))

    async def drive(context):
        def skid_buffer(span):
            payload = unit.i.payload
            context.set(unit.i.valid, 1)
            for copy in COPIES:
                for word in ("first", "second"):
                    value = beats[copy][word].reshape(2, phases)[span]
                    context.set(Value.cast(payload[copy][word]), code(value))
            for name in beats.keys() - set(COPIES):
                context.set(Value.cast(payload[name]), int(beats[name][span]))

        context.set(unit.o.ready, 1)
        skid_buffer(0)
        await context.tick()
        context.set(unit.i.valid, 0)
        await context.tick().repeat(clock)
        context.set(reset, 1)
        await context.tick()
        context.set(reset, 0)
        assert not context.get(unit.o.valid)
        assert context.get(unit.i.ready)
        skid_buffer(1)
        for _ in range(40):
            if context.get(unit.o.valid):
                for name, values in found.items():
                    values.append(context.get(Value.cast(unit.o.payload[name])))
            await context.tick()
            context.set(unit.i.valid, 0)

    simulator.add_testbench(drive)
    simulator.run()
    for name, values in found.items():
        np.testing.assert_array_equal(values, expected[name][9:], err_msg=name)
