"""Proofs of the accumulator: all pixels of a span leave in order, as exact sums that never wrap."""

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

# The words of a normal's component, with 5 bits in place of 44 and 3 in place of 18. As in the unit, the sum
# and the differences have one integer bit more than the result.
FORMATS = DifferenceAccumulator(SQ(1, 2), SQ(2, 3), SQ(2, 3), SQ(1, 2))
LENGTH_BITS = 3


class Narrow(AccumulatorUnit):
    """One quadratic of short words."""

    def __init__(self):
        words = {name: FixedShape(FORMATS.difference_format) for name in ("first", "second")}
        start = {"start": FixedShape(FORMATS.start_format), "length": unsigned(LENGTH_BITS)}
        super().__init__(data.StructLayout(start | words), FixedShape(FORMATS.result_format))

    def quadratics(self, values):
        span = self.span
        yield "value", FORMATS, (span.start, span.first, span.second), values


def of_pixels():
    """Claim the number of pixels. The pixels of a chosen span are exact sums, if these stay in the domain."""
    unit = Narrow()
    h = Harness(unit)
    span = unit.i.payload
    stays(h, unit.o)
    # At most 3 pixels, and those of a whole span, are inside.
    owed = pixels_follow(h, unit.i, unit.o, span.length, 3 + (1 << LENGTH_BITS) - 1)
    answers(h, owed.any(), taken(unit.o), unit.latency - 1, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, (1 << LENGTH_BITS) - 1, unit.o.ready)
    return h


def test_pixels_are_as_many_as_asked_for(prove):
    """By induction, for lengths 0 to 7: as many values leave as the lengths say, and no beat is stuck.

    While the output is ready, the first value of a span leaves 3 cycles after the span was taken, and then
    one in every cycle. A span is taken as soon as the span before has had a cycle for each of its pixels.
    """
    prove(of_pixels())


def fits(code, format):
    """Whether a code fits a format."""
    return (code >= format.min_code) & (code <= format.max_code)


def of_sums(unit):
    """Exact sums, in words that cannot wrap, move beside the sums of the unit.

    The domain: at every pixel of a span the exact value fits the format of the sum. If the differences have
    fewer bits, every difference from a pixel to the next fits their format, too.
    """
    h = Harness(unit)
    m, length, comes = h.m, unit.i.payload.length, taken(unit.i)
    waits, entered, active, present, valid = stays(h, unit.o), Signal(), Signal(), Signal(), Signal()
    # Pixels left of the span that was accepted last, and of the span whose words the sums hold.
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
        # Where half a step would make the first sum wrap, ``chord-local`` adds it to the result.
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
    """By induction, for all formats and lengths as built: the values are the exact sums, cut and clamped.

    So no sum wraps if the exact values of a span's pixels fit its format. Differences of a normal may be any
    numbers: they may wrap, and do no harm. Differences of ``chord-local`` are two bits shorter than the sums,
    and must fit their format.
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
    """Each bug, injected in `AccumulatorUnit`, refutes the claim of exact sums."""
    inject(AccumulatorUnit, "elaborate", *BUGS[bug])
    refute(of_sums(DifferenceAccumulatorUnit()), 10)


def test_bug_of_the_skid_buffer_is_found(refute, inject):
    """A value that is dropped while it waits refutes the claim on the number of pixels."""
    inject(difference_accumulator, "skid_buffer", "Mux(held, spare, Value.cast(payload))", "payload")
    refute(of_pixels(), 20)
