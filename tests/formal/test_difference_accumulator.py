"""Proofs of the accumulator: a span's pixels, all and in order, as exact sums that never wrap."""

import pytest
from amaranth.hdl import Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.methods.chord_spans import ChordAccumulatorUnit
from blysk.hdl.normals import difference_accumulator
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit, DifferenceAccumulatorUnit

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

# The words of a normal's component, cut from 44 bits to 5 and from 18 to 3: as there, the sum and the
# differences have an integer bit more than the result.
FORMATS = DifferenceAccumulator(SQ(1, 2), SQ(2, 3), SQ(2, 3), SQ(1, 2))
LENGTH_BITS = 3


class Narrow(AccumulatorUnit):
    """One quadratic of narrow words."""

    def __init__(self):
        words = {name: FixedShape(FORMATS.difference_format) for name in ("first", "second")}
        start = {"start": FixedShape(FORMATS.start_format), "length": unsigned(LENGTH_BITS)}
        super().__init__(data.StructLayout(start | words), FixedShape(FORMATS.result_format))

    def quadratics(self, values):
        span = self.span
        yield "value", FORMATS, (span.start, span.first, span.second), values


def of_pixels():
    """Pixels are counted; those of a chosen span are exact sums, as long as these stay in the domain."""
    unit = Narrow()
    h = Harness(unit)
    span = unit.i.payload
    stays(h, unit.o)
    # Three spans inside at most: what waits, the values, what the sums stand at, and what they take in.
    owed = pixels_follow(h, unit.i, unit.o, span.length, 3 + (1 << LENGTH_BITS) - 1)
    answers(h, owed.any(), taken(unit.o), unit.latency - 1, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, (1 << LENGTH_BITS) - 1, unit.o.ready)
    return h


def test_pixels_are_as_many_as_asked_for(prove):
    """Inductive, lengths 0 to 7: what waits stays, as many values leave as the lengths say, no deadlock.

    While the output is ready, the first value leaves 3 cycles after its span was taken, then one every clock,
    and a span is taken at the latest when the one before it has had a clock for each pixel.
    """
    prove(of_pixels())


def fits(code, format):
    """Whether a code is one of a format."""
    return (code >= format.min_code) & (code <= format.max_code)


def of_sums(unit):
    """Exact sums in words that cannot wrap move beside those of the unit; what they would give leaves.

    The domain: at every pixel of a span the exact value is in the format of the sum. Where the differences
    have fewer bits, every one from a pixel to the next is in theirs.
    """
    h = Harness(unit)
    m, length, comes = h.m, unit.i.payload.length, taken(unit.i)
    waits, entered, active, present, valid = stays(h, unit.o), Signal(), Signal(), Signal(), Signal()
    # Pixels left of the span that was accepted last, and of that whose words the sums have.
    left, at = Signal(len(length)), Signal(len(length))
    m.d.comb += active.eq(left.any())
    with m.If(comes):
        m.d.sync += left.eq(length)
    with m.Elif(~waits & active):
        m.d.sync += left.eq(left - 1)
    with m.If(~waits):
        m.d.sync += [entered.eq(comes), at.eq(left), present.eq(active), valid.eq(present)]
    load = entered & ~waits
    h.claim(unit.o.valid == (valid | waits))
    h.claim((h.register("active") == active) & (h.register("present") == present))
    h.claim(present == at.any())
    h.claim(h.register("accepted") == entered)
    h.claim(~active | (h.register("remaining") == left))
    h.claim(h.register("ends") == (left <= 1))
    if "words" not in unit.signature.members:
        kept = Signal.like(Value.cast(unit.i.payload), name="kept")
        with m.If(comes):
            m.d.sync += kept.eq(Value.cast(unit.i.payload))
        h.claim(~entered | (Value.cast(unit.span) == kept))
    for name, p, operands, found in unit.quadratics(unit.o.payload):
        width = p.format.width + 2 * len(length)
        exact, change, bend = (
            Signal(signed(width), name=f"{name}_{word}") for word in ("exact", "change", "bend")
        )
        start, first, second = (Value.cast(operand) for operand in operands)
        shift = p.format.fraction_bits - p.start_format.fraction_bits
        cut = p.format.fraction_bits - p.result_format.fraction_bits
        # ``chord-local`` adds the half of a step, where it would take a sum to begin with, to the result.
        half = 1 << (cut - 1)
        late = half if "words" in unit.signature.members and shift < cut else 0
        with m.If(load):
            m.d.sync += [
                exact.eq((start << shift) + half - late),
                change.eq(first),
                bend.eq(second),
            ]
        with m.Elif(~waits):
            m.d.sync += [exact.eq(exact + change), change.eq(change + bend)]
        h.assume(~present | fits(exact, p.format))
        if p.difference_format.width < p.format.width:
            h.assume((at <= 1) | fits(change, p.difference_format))
        words = (name, exact), (f"{name}_difference", change), (f"{name}_second_difference", bend)
        for register, model in words:
            code = Value.cast(h.register(register))
            h.claim(~present | (code.as_unsigned() == model[: len(code)]))
        rounded, result = (exact + late) >> cut, p.result_format
        value = Signal(signed(width), name=f"{name}_value")
        with m.If(~waits):
            raised = Mux(rounded < result.min_code, result.min_code, rounded)
            m.d.sync += value.eq(Mux(raised > result.max_code, result.max_code, raised))
        h.claim(~valid | waits | (Value.cast(found) == value))
    return h


SUMS = {
    "normal": DifferenceAccumulatorUnit,
    "chord-local": lambda: ChordAccumulatorUnit(),
}


@pytest.mark.parametrize("name", SUMS)
def test_sums_are_exact(prove, name):
    """Inductive, all formats and lengths as built: the values that leave are the exact sums, cut and clamped.

    So no sum wraps as long as the exact values of a span's pixels fit its format. Differences of a normal may
    be any: these may wrap, and do no harm. Those of ``chord-local``, two bits shorter than the sums, must
    fit theirs.
    """
    prove(of_sums(SUMS[name]()))


BUGS = {
    "a bit too few": (
        "difference + second_difference).wrap(p.difference_format)",
        "difference).wrap(p.difference_format)",
    ),
    "no half step": ("self.begin(p, start).wrap(p.format)", "start.extend(p.format)"),
    "wraps": (".saturate(p.result_format)", ".wrap(p.result_format)"),
    "sums while it is stalled": ("m.Elif(advance)", "m.Else()"),
    "a cycle late": ("valid.eq(present)", "valid.eq(present & ~ends)"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Injected in `AccumulatorUnit`, each refutes the claim of exact sums."""
    inject(AccumulatorUnit, "elaborate", *BUGS[bug])
    refute(of_sums(DifferenceAccumulatorUnit()), 10)


def test_bug_of_the_skid_buffer_is_found(refute, inject):
    """A value that is dropped while it waits refutes the count of pixels."""
    inject(difference_accumulator, "skid_buffer", "Mux(held, spare, Value.cast(payload))", "payload")
    refute(of_pixels(), 20)
