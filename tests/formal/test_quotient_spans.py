# amaranth: UnusedElaboratable=no
"""Proofs about spans of the quotient method: each pixel has the words of its own span, and none is lost.

Words have few bits, and the multipliers compute true products. If a start meets the differences of another
span, or if differences are overwritten, the words are wrong. Then a claim is refuted.
"""

from dataclasses import dataclass

import pytest
from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.number.fixed import SQ
from blysk.hdl.cosines.quotient import pixel_words_shape
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken

pytestmark = pytest.mark.prove

LENGTH_BITS, BITS = 2, 2
"""Bits of lengths, and of components."""


@dataclass(frozen=True)
class FewBits(QuotientSpans):
    """Formats for words of few bits.

    Squares have one fraction bit more than products, because their differences are halved.
    """

    @property
    def square_format(self):
        """The format of squares has 12 bits."""
        return SQ(-24, 35)


class ShortSpansUnit(wiring.Component):
    """The unit with x and z of `BITS` bits, y = 0, exponents 0 and 1, ``l = x + z``, and room for few
    starts."""

    def __init__(self):
        self.model = FewBits()
        vector = data.StructLayout({"x": signed(BITS), "z": signed(BITS)})
        span = {"start": vector, "step": vector, "exponent": 1, "length": LENGTH_BITS}
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout(span))),
                "o": Out(stream.Signature(pixel_words_shape(self.model))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.spans = self.spans = spans = QuotientSpansUnit(self.model, LENGTH_BITS)
        spans.DEPTH = DEPTH
        given, payload = self.i.payload, spans.i.payload
        for name in ("start", "step"):
            for place, axis in ((0, "x"), (2, "z")):
                m.d.comb += payload[name][place].as_value().eq(given[name][axis])
        m.d.comb += [
            payload.exponent.eq(given.exponent),
            payload.length.eq(given.length),
            spans.i.valid.eq(self.i.valid),
            self.i.ready.eq(spans.i.ready),
            *(part.as_value().eq(1) for part in spans.constants[0]),
            self.o.payload.eq(spans.o.payload),
            self.o.valid.eq(spans.o.valid),
            spans.o.ready.eq(self.o.ready),
        ]
        return m


LONGEST = (1 << LENGTH_BITS) - 1
DEPTH = 4
"""Words of the memory of starts, in place of 16."""


def words_of(span, place):
    """m, w, l and z of a pixel, computed from the vectors of its span alone. Each product has few bits."""
    e = span.exponent

    def shifted(value):
        return Mux(e, value >> 1, value)

    def square(a, d):
        second = Mux(e, (d * d) << 2 >> 2, (d * d) << 2)
        first = shifted((a * d) << 2) + (second >> 1)
        return ((a * a) << 1) + times(first, place) + times(second, pairs(place))

    def line(a, d, bits):
        return (a << bits) + times(shifted(d << bits), place)

    start, step = span.start, span.step
    return (
        square(start.x, step.x),
        square(start.z, step.z),
        line(start.x + start.z, step.x + step.z, 2),
        line(start.z, step.z, 12),
    )


def pairs(place):
    """``place (place - 1)/2``"""
    return Mux(place == 3, 3, place == 2)


def times(value, count):
    """Product of a value and a count of 0 to 3."""
    return Mux(count[0], value, 0) + Mux(count[1], value << 1, 0)


def of_spans(*, multiplies=False, held=True):
    """A harness for spans of 1 to 3 pixels.

    An offered span stays until it is accepted, and the offer may pause.
    """
    h = Harness(unit := ShortSpansUnit(), multiplies=multiplies)
    h.assume(unit.i.payload.length != 0)
    if held:
        hold_payload(h)
    return h


def hold_payload(h):
    """Assume that an offered span stays until it is accepted."""
    source, given = h.unit.i, Value.cast(h.unit.i.payload)
    offered, before = Signal(), Signal.like(given)
    h.m.d.sync += [offered.eq((offered | source.valid) & ~taken(source)), before.eq(given)]
    h.assume(~offered | (given == before))


def of_words(*, held=True):
    """Claim that each pixel of any span has the words of this span alone, and that its bit differs from the
    span before."""
    h = of_spans(multiplies=True, held=held)
    unit, before = h.unit, Signal()
    with h.m.If(taken(unit.o)):
        h.m.d.sync += before.eq(unit.o.payload.span)

    def right(span, place, last, pixel):
        m, w, line, z = words_of(span, place)
        found = (pixel.numerator[0], m), (pixel.rest, w), (pixel.line[0], line)
        same = [Value.cast(word).as_signed() == exact for word, exact in found]
        return Cat(*same, pixel.away[0] == (z < 0), (pixel.span != before) == (place == 0)).all()

    pixels_follow(h, unit.i, unit.o, unit.i.payload.length, unit.spans.spans_inside * LONGEST, right)
    return h


def of_progress():
    """Claim that pixels leave while the output is ready, at most as many cycles apart as the latency."""
    h = of_spans()
    unit = h.unit
    owed = pixels_follow(h, unit.i, unit.o, unit.i.payload.length, unit.spans.spans_inside * LONGEST)
    answers(h, owed.any(), taken(unit.o), unit.spans.latency, unit.o.ready)
    return h


CYCLES = 12
"""Cycles from power-up, for claims that are not decided in time for runs of any length.

Each further cycle doubles the time.
"""


def test_words(prove):
    """Within `CYCLES`, for spans of 1 to 3 pixels: each pixel leaves once and in order, with its span's
    words.

    So no start is taken before its differences, no differences are overwritten, and no start is lost.
    """
    prove(of_words(), CYCLES)


def test_progress(prove):
    """Within `CYCLES`: pixels leave without a pause longer than the latency."""
    prove(of_progress(), CYCLES)


def test_stability_and_admission(prove):
    """By induction: a beat that waits does not change, and a ready output accepts a span within 12 cycles.

    These are the three turns of the span, and three spans of three pixels before it, until the small memory
    has room.
    """
    h = of_spans()
    stays(h, h.unit.o)
    answers(h, h.unit.i.valid, h.unit.i.ready, 12, h.unit.o.ready)
    prove(h)


BUGS = {
    "a start does not wait for its differences": ("_take", "last & (self._ready | ~is_long)", "last"),
    "starts are lost": ("_set_up", " | (at_sums[2] & ~to_start.ready)", ""),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in the unit, refutes a claim on words."""
    inject(QuotientSpansUnit, *BUGS[bug])
    refute(of_words(), CYCLES)


def of_waiting(serial=False):
    """Claim that first and second differences do not change while they wait.

    In spans of 4 pixels and more second differences may wait, too.
    """
    h = Harness(QuotientSpansUnit(length_bits=LENGTH_BITS + 1, serial=serial))
    if serial:
        hold_payload(h)
    for name, words in (("second", "second"), ("first", "first"), *[("start", "start_words")] * serial):
        waits, word = h.register(f"{name}_waits"), Value.cast(h.register(words))
        waited, before = Signal(), Signal(len(word))
        h.m.d.sync += [waited.eq(waits), before.eq(word)]
        h.claim(~(waited & waits) | (word == before))
    return h


@pytest.mark.parametrize("serial", [False, True])
def test_differences_that_wait_stay(prove, serial):
    """By induction, for the whole unit: no differences are overwritten before they are taken.

    A serial setup's start is not overwritten either.
    """
    prove(of_waiting(serial))


def test_overwritten_differences_are_found(refute, inject):
    """The unit has a stall that holds second differences until the first differences before them are taken.

    Without it a claim is refuted.
    """
    inject(QuotientSpansUnit, "_set_up", "(at_coarse[0] & first[1]) | ", "")
    refute(of_waiting(), 30)


def test_an_early_turn_is_found(refute, inject):
    """A turn of the serial setup has to wait until the words of its kind are taken.

    If it does not wait, a claim is refuted.
    """
    inject(
        QuotientSpansUnit,
        "_set_up_serially",
        "may_go = step.any() | ~(busy.as_value() & turn).any()",
        "may_go = 1",
    )
    refute(of_waiting(serial=True), 40)


def test_a_span_that_changes_is_found(refute):
    """A span that changes between its turns refutes the claim. So its source has to hold the payload."""
    refute(of_words(held=False), CYCLES)
