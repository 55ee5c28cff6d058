# amaranth: UnusedElaboratable=no
"""Proofs about spans of the quotient method with several lanes: each beat has the words of its own span.

Words have few bits, and the multipliers compute true products, as in the proofs of `QuotientSpansUnit`.
"""

from dataclasses import dataclass

import pytest
from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.number.fixed import SQ
from blysk.hdl.cosines.quotient_lanes import QuotientLanesUnit, lane_words_shape

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken
from .test_quotient_spans import BITS, CYCLES, DEPTH, hold_payload, words_of

pytestmark = pytest.mark.prove

LENGTH_BITS = 3
"""Bits of lengths. The longest span has four beats of two lanes, or two beats of four lanes."""

LONGEST = 4
"""Largest number of beats of a span."""


@dataclass(frozen=True)
class FewBits(QuotientLanes):
    """Formats for words of few bits, as in the proofs of `QuotientSpansUnit`."""

    @property
    def square_format(self):
        """The format of squares has 12 bits."""
        return SQ(-24, 35)


class ShortSpansUnit(wiring.Component):
    """The unit with x and z of `BITS` bits, y = 0, exponents 0 and 1, lines ``x + z``, and little room for
    starts and first differences."""

    def __init__(self, lanes=2, pairs=True):
        self.model = FewBits(lanes=lanes, pairs=pairs)
        vector = data.StructLayout({"x": signed(BITS), "z": signed(BITS)})
        span = {"start": vector, "step": vector, "exponent": 1, "length": LENGTH_BITS}
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout(span))),
                "o": Out(stream.Signature(lane_words_shape(self.model))),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.spans = self.spans = spans = QuotientLanesUnit(self.model, LENGTH_BITS)
        spans.DEPTH, spans.FIRSTS = DEPTH, 2
        given, payload = self.i.payload, spans.i.payload
        for name in ("start", "step"):
            for place, axis in ((0, "x"), (2, "z")):
                m.d.comb += payload[name][place].as_value().eq(given[name][axis])
        if self.model.pairs:
            for line, name in ((payload.line, "start"), (payload.line_step, "step")):
                m.d.comb += line[0].as_value().eq(given[name].x + given[name].z)
        else:
            m.d.comb += [part.as_value().eq(1) for part in spans.constants[0]]
        m.d.comb += [
            payload.exponent.eq(given.exponent),
            payload.length.eq(given.length),
            spans.i.valid.eq(self.i.valid),
            self.i.ready.eq(spans.i.ready),
            self.o.payload.eq(spans.o.payload),
            self.o.valid.eq(spans.o.valid),
            spans.o.ready.eq(self.o.ready),
        ]
        return m


class Single:
    """The second pixel of a pair, as a span of one pixel."""

    def __init__(self, span):
        self.start, self.step, self.exponent = span.step, span.step, span.exponent


def of_spans(lanes=2, pairs=True, *, multiplies=False, shortest=1, longest=6):
    """A harness for spans of up to three beats. An offered span stays until it is accepted."""
    h = Harness(unit := ShortSpansUnit(lanes, pairs), multiplies=multiplies)
    length = unit.i.payload.length
    h.assume((length >= shortest) & (length <= longest))
    hold_payload(h)
    return h


def beats_of(span, lanes):
    """Number of beats of a span."""
    return (span.length + lanes - 1)[lanes.bit_length() - 1 : LENGTH_BITS + 1]


def words_in(lane, words):
    """Whether a lane has the words m, w, l and z of a pixel."""
    m, w, line, z = words
    found = (lane.numerator[0], m), (lane.rest, w), (lane.line[0], line)
    return Cat(
        *(Value.cast(word).as_signed() == exact for word, exact in found), lane.away[0] == (z < 0)
    ).all()


def of_words(lanes=2, pairs=True):
    """Claim that each beat of spans of one to four pixels has the words of this span alone.

    The claim includes the bit of the span, and the lanes without a pixel.
    """
    h = of_spans(lanes, pairs, multiplies=True, longest=4)
    unit, before = h.unit, Signal()
    with h.m.If(taken(unit.o)):
        h.m.d.sync += before.eq(unit.o.payload[0].span)

    def right(span, place, last, beat):
        # Places of pixels are 0 to 3. With four lanes every span is one beat.
        pixels = [Cat(Const(lane, lanes.bit_length() - 1), place)[:2] for lane in range(lanes)]
        found = [words_in(beat[0], words_of(span, pixels[0])), (beat[0].span != before) == (place == 0)]
        for lane in range(1, lanes):
            present, has_words = (
                pixels[lane] < span.length,
                words_in(beat[lane], words_of(span, pixels[lane])),
            )
            if lane == 1 and pairs:
                of_pair = words_in(beat[1], words_of(Single(span), Const(0, 2)))
                has_words = Mux(span.length == 2, of_pair, has_words)
            found += [
                beat[lane].span == present,
                Mux(present, has_words, ~Value.cast(beat[lane]).any()),
            ]
        return Cat(found).all()

    room = unit.spans.spans_inside * 2
    pixels_follow(h, unit.i, unit.o, beats_of(unit.i.payload, lanes), room, right)
    return h


def of_progress(lanes, pairs):
    """Claim that beats leave while the output is ready, at most as many cycles apart as the latency.

    A ready output accepts a span within 14 cycles.
    """
    h = of_spans(lanes, pairs)
    unit = h.unit
    owed = pixels_follow(h, unit.i, unit.o, beats_of(unit.i.payload, lanes), unit.spans.spans_inside * 3)
    answers(h, owed.any(), taken(unit.o), unit.spans.latency, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, 14, unit.o.ready)
    return h


structures = pytest.mark.parametrize(
    ("lanes", "pairs"), [(2, True), (2, False), (4, True)], ids=["2 lanes", "2 lanes, no pairs", "4 lanes"]
)


@structures
def test_words(prove, lanes, pairs):
    """Within `CYCLES`, for spans of 1 to 4 pixels: each beat leaves once and in order, with its span's
    words."""
    prove(of_words(lanes, pairs), CYCLES)


@structures
def test_progress(prove, lanes, pairs):
    """Within `CYCLES`: beats leave without a pause longer than the latency, and spans are accepted."""
    prove(of_progress(lanes, pairs), CYCLES)


@structures
def test_beats_that_wait_stay(prove, lanes, pairs):
    """By induction: a beat that waits does not change."""
    h = of_spans(lanes, pairs)
    stays(h, h.unit.o)
    prove(h)


BUGS = {
    "lane 2 has no second difference": ("_square_steps", "following + kept", "following"),
    "a start does not wait for its differences": (
        "_take",
        "last & (self._ready | ~takes_differences)",
        "last",
    ),
    "first differences wait for no second differences": (
        "_take",
        " & (has_second | self._marks[0])",
        "",
    ),
    "the gap of the first beat is not made": (
        "_square_steps",
        "If(loads | ~self._ready)",
        "If(~self._ready)",
    ),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in the unit, refutes a claim on words."""
    inject(QuotientLanesUnit, *BUGS[bug])
    refute(of_words(4 if bug.startswith("lane 2") else 2), CYCLES + 4)


def of_waiting(lanes, pairs):
    """Claim that second differences do not change while they wait.

    They may be taken in the cycle in which the next ones arrive. First differences wait in a FIFO, which has
    its own proof.
    """
    h = Harness(QuotientLanesUnit(QuotientLanes(lanes=lanes, pairs=pairs), LENGTH_BITS))
    waits, word = h.register("second_waits"), Value.cast(h.register("second"))
    waited, before = Signal(), Signal(len(word))
    h.m.d.sync += [waited.eq(waits), before.eq(word)]
    h.claim(~(waited & waits) | (word == before))
    return h


@structures
def test_differences_that_wait_stay(prove, lanes, pairs):
    """By induction, for the whole unit: no second differences are overwritten before they are taken."""
    prove(of_waiting(lanes, pairs))
