# amaranth: UnusedElaboratable=no
"""Proofs about interpolators, which are made of proven units: all pixels of a span leave, in order.

The parts are proved in other files. A stub replaces each `PipelinedUnit`: it has the same streams and
control, takes 1 to 3 cycles, and passes on a word. The word is a tag of the span and the pixel's position in
the span. Accumulators, recurrence and highlight cosine keep their control, and take words of few bits from
pixel to pixel. Accumulators replace the normaliser and the quadratic evaluator.
"""

import itertools
from collections.abc import Callable, Iterator
from functools import partial
from operator import itemgetter
from typing import NamedTuple

import pytest
from amaranth.hdl import Cat, Mux, Signal, Value
from amaranth.lib import stream

import blysk.hdl.cosines.highlight_cosine
import blysk.hdl.methods.angular_interpolator
import blysk.hdl.methods.bisection_interpolator
import blysk.hdl.methods.interpolator
import blysk.hdl.methods.linear_interpolator
import blysk.hdl.methods.quadratic_interpolator
import blysk.hdl.methods.recurrence_interpolator
import blysk.hdl.normals.difference_accumulator
from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.methods.quotient_interpolator import QuotientInterpolator
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.methods.angular_interpolator import AngularInterpolatorUnit
from blysk.hdl.methods.bisection_interpolator import BisectionInterpolatorUnit
from blysk.hdl.methods.chord_spans import ChordSpansUnit
from blysk.hdl.methods.interpolator import NormalInterpolatorUnit
from blysk.hdl.methods.linear_interpolator import LinearInterpolatorUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.hdl.methods.quadratic_interpolator import QuadraticInterpolatorUnit
from blysk.hdl.methods.quotient_interpolator import QuotientInterpolatorUnit
from blysk.hdl.methods.recurrence_interpolator import RecurrenceInterpolatorUnit
from blysk.hdl.methods.renormalise_interpolator import RenormaliseInterpolatorUnit

from .interpolator_stubs import (
    INTERVAL,
    LENGTH_BITS,
    WORD_BITS,
    constant_coefficient,
    cosine,
    first_value,
    itself,
    left,
    light_difference,
    light_start,
    line_start,
    line_vector,
    normal,
    phase,
    replace_parts,
    start,
    tag,
    value,
    vector_line,
    vector_start,
    word,
)
from .prover import Harness
from .rules import answers, follows, pixels_follow, stays, taken

pytestmark = pytest.mark.prove


@pytest.fixture(autouse=True)
def stubs(monkeypatch):
    """Replace the parts of interpolators by short parts."""
    replace_parts(monkeypatch)


class Stretch(NamedTuple):
    """The part of a unit from one stream to another, with functions that find the word of each beat."""

    source: stream.Interface
    sink: stream.Interface
    find: Callable
    found: Callable
    capacity: int
    also: Callable | None = None
    """A further claim on a span that came and a span that leaves."""
    pieces: Callable | None = None
    """Number of spans that leave for one that comes. ``also`` then gets the number of the span, too."""

    def follow(self, harness: Harness, *, exact: bool = True) -> Signal:
        """Claim that beats leave in order and once each. The result is the number of beats inside."""
        source, sink, find, found, capacity, also, pieces = self
        if pieces is not None:

            def piece_of(span, place, last, piece):
                return also(span, place, piece)

            count = pieces(source.payload)
            return pixels_follow(harness, source, sink, count, capacity, piece_of if exact else None)

        if has_length(source) and not has_length(sink):

            def pixel_of(span, place, last, pixel):
                return word(found(pixel)) == Cat(place, tag(find(span)))

            length = source.payload.length[:LENGTH_BITS]
            return pixels_follow(harness, source, sink, length, capacity, pixel_of if exact else None)

        def same(came, leaves):
            if has_length(source):
                further = also(came, leaves) if also else 1
                return (tag(find(came)) == tag(found(leaves))) & (came.length == leaves.length) & further
            return word(find(came)) == word(found(leaves))

        return follows(harness, source, sink, capacity, same if exact else None)


def has_length(channel: stream.Interface) -> bool:
    """Whether the stream has spans, and not pixels."""
    return "length" in getattr(channel.payload.shape(), "members", {})


def held(*units: PipelinedUnit) -> int:
    """Largest number of beats in some units."""
    return sum(-(-unit.latency // unit.initiation_interval) + 1 for unit in units)


def pixels_held(unit) -> int:
    """Largest number of pixels in a unit: in its registers, one that waits, and the rest of a span."""
    return unit.latency + (1 << LENGTH_BITS) - 1


REGISTERED = 2
"""Largest number of beats in a connection with registers."""


def curve_stretches(unit, source=None, find=left) -> Iterator[Stretch]:
    """Stretches of a method with setup, registers, accumulator and products."""
    setup, accumulator, products = unit._setup, unit._accumulator, unit._products
    yield Stretch(source or unit.i, setup.o, find, start, held(setup))
    yield Stretch(setup.o, accumulator.i, start, start, REGISTERED)
    yield Stretch(accumulator.i, accumulator.o, start, normal, pixels_held(accumulator))
    yield Stretch(accumulator.o, unit.o, normal, cosine, held(products))


def line_stretches(unit) -> Iterator[Stretch]:
    """Stretches of a method with setup, registers, accumulator, renormaliser and products."""
    setup, accumulator, products = unit._setup, unit._accumulator, unit._products
    yield Stretch(unit.i, setup.o, left, start, held(setup))
    yield Stretch(setup.o, accumulator.i, start, line_start, REGISTERED)
    yield Stretch(accumulator.i, accumulator.o, line_start, line_vector, pixels_held(accumulator))
    yield Stretch(accumulator.o, products.i, line_vector, normal, held(unit._renormaliser))
    yield Stretch(products.i, unit.o, normal, cosine, held(products))


def quadratic_stretches(unit) -> Iterator[Stretch]:
    """Stretches of a method with a preparation, lengths beside it, and then a curve."""
    setup = unit._setup
    yield Stretch(unit.i, setup.i, left, constant_coefficient, held(unit._middle, unit._gpq))
    yield from curve_stretches(unit, setup.i, constant_coefficient)


def evaluator_stretches(unit) -> Iterator[Stretch]:
    """Stretches of a method with a preparation and lengths beside it, evaluator and products."""
    evaluator, products = unit._evaluator, unit._products
    capacity = held(unit._middle, unit._gpq)
    yield Stretch(unit.i, evaluator.i, left, constant_coefficient, capacity)
    yield Stretch(evaluator.i, evaluator.o, constant_coefficient, normal, pixels_held(evaluator))
    yield Stretch(evaluator.o, unit.o, normal, cosine, held(products))


def spans_stretches(unit, sink=None) -> Iterator[Stretch]:
    """Stretches of accumulators and a setup, with starts, lengths and decisions beside the setup."""
    capacity = unit.starts_inside * ((1 << LENGTH_BITS) - 1) + pixels_held(unit._accumulator)
    yield Stretch(unit.i, sink or unit.o, value, cosine, capacity)


def words_meet(harness: Harness, unit: ChordSpansUnit) -> None:
    """Claim that the accumulators take the start and the differences of the same span."""
    accumulator = unit._accumulator
    same = tag(light_difference(accumulator.words)) == tag(light_start(accumulator.words))
    harness.claim(~(accumulator.taken & unit._takes_long) | same)


def angular_stretches(unit) -> Iterator[Stretch]:
    """Stretches of setup, registers and cosine, for each chain."""
    for setup, cosines in unit._chains.values():
        yield Stretch(unit.i, setup.o, left, phase, held(setup))
        yield Stretch(setup.o, cosines.i, phase, phase, REGISTERED)
        yield Stretch(cosines.i, cosines.o, phase, itself, pixels_held(cosines))


def recurrence_stretches(unit) -> Iterator[Stretch]:
    """Stretches of the setup, of the recurrence of L of the first light, and of H of the second light."""
    setup = unit._setup
    yield Stretch(unit.i, setup.o, left, partial(first_value, light=0), held(setup))
    for light, copy in enumerate(("diffuse", "highlight")):
        recurrence = unit._recurrences[light]
        source, sink = partial(first_value, light=light, copy=copy), itemgetter(copy)
        first = lambda span, copy=copy: span[copy].first[0]  # noqa: E731
        yield Stretch(setup.o, recurrence.i, source, first, REGISTERED)
        yield Stretch(recurrence.i, recurrence.o, first, sink, pixels_held(recurrence))


def bisection_stretches(unit) -> Iterator[Stretch]:
    """Stretches of normaliser and products."""
    products = unit._products
    yield Stretch(unit.i, products.i, left, normal, pixels_held(unit._normaliser))
    yield Stretch(products.i, unit.o, normal, cosine, held(products))


def quotient_stretches(unit) -> Iterator[Stretch]:
    """Stretches of spans of vectors and of quotients."""
    spans, quotient = unit._spans, unit._quotient
    yield Stretch(unit.i, quotient.i, vector_start, vector_line, pixels_held(spans))
    yield Stretch(quotient.i, unit.o, vector_line, cosine, held(quotient))


OPTIONS = {"setup_interval": INTERVAL, "length_bits": LENGTH_BITS}


def spans_of(lights: int) -> ChordSpansUnit:
    """Stretches of spans of values."""
    options = {"initiation_interval": INTERVAL, "length_bits": LENGTH_BITS}
    return ChordSpansUnit(LocalChordInterpolator(), lights, **options)


UNITS = {
    "linear": (partial(LinearInterpolatorUnit, LinearInterpolator(), 1, **OPTIONS), curve_stretches),
    "renormalise": (
        partial(RenormaliseInterpolatorUnit, RenormaliseInterpolator(), 1, **OPTIONS),
        line_stretches,
    ),
    "quadratic": (
        partial(QuadraticInterpolatorUnit, QuadraticInterpolator(), 1, **OPTIONS),
        quadratic_stretches,
    ),
    "quadratic-eval": (
        partial(QuadraticInterpolatorUnit, QuadraticInterpolator(form="direct"), 1, length_bits=LENGTH_BITS),
        evaluator_stretches,
    ),
    "chord_spans": (partial(spans_of, 1), spans_stretches),
    "angular": (partial(AngularInterpolatorUnit, AngularInterpolator(), 1, **OPTIONS), angular_stretches),
    "recurrence_interpolator": (
        partial(RecurrenceInterpolatorUnit, RecurrenceInterpolator(), 2, **OPTIONS),
        recurrence_stretches,
    ),
    "bisection_interpolator": (
        partial(BisectionInterpolatorUnit, BisectionInterpolator(), 1, length_bits=LENGTH_BITS),
        bisection_stretches,
    ),
    "quotient_interpolator": (
        partial(QuotientInterpolatorUnit, QuotientInterpolator(), 1, length_bits=LENGTH_BITS),
        quotient_stretches,
    ),
}


def marks_of(name: str):
    """Marks of a unit's tests: units of the documents' methods are proved seldom."""
    return [pytest.mark.seldom] * (not name.startswith(("chord", "renormalise")))


def in_step(harness: Harness) -> None:
    """Claim that units side by side are ready in the same cycles, and offer beats in the same cycles."""
    unit = harness.unit
    if isinstance(unit, AngularInterpolatorUnit):
        rows = list(zip(*unit._chains.values(), strict=True))
    elif isinstance(unit, RecurrenceInterpolatorUnit):
        rows = [unit._recurrences]
    else:
        return
    for row in rows:
        for one, other in itertools.pairwise(row):
            harness.claim((one.i.ready == other.i.ready) & (one.o.valid == other.o.valid))
    for last in rows[-1]:
        harness.claim(taken(last.o) == taken(unit.o))


def tells_length(harness: Harness) -> None:
    """Assume that spans of values come with the signals that `of_pairs` claims."""
    unit = harness.unit
    if isinstance(unit, ChordSpansUnit):
        harness.assume(unit.long == (unit.i.payload.length > 1))
        words_meet(harness, unit)


def of_pairs() -> Harness:
    """Claim that only a span of two pixels changes: to two spans of a pixel, with the values at its ends."""
    h = Harness(unit := LocalChordInterpolatorUnit(LocalChordInterpolator(), 1, **OPTIONS))
    given, spans, long = unit.i, unit._spans.i, unit._spans.long
    came, goes, pair = given.payload, spans.payload, given.payload.length == 2
    waits, kept = Signal(name="second_waits"), Signal(WORD_BITS, name="second_value")
    with h.m.If(taken(spans)):
        h.m.d.sync += [waits.eq(taken(given) & pair), kept.eq(word(value(came, 2)))]
    single, starts = (goes.length == 1) & ~long, word(value(goes)) == word(value(came))
    whole = Cat(word(value(goes, k)) == word(value(came, k)) for k in range(3)).all()
    whole &= (goes.length == came.length) & (long == (goes.length > 2))
    second = spans.valid & ~given.ready & single & (word(value(goes)) == kept)
    first = ~given.valid | Mux(pair, single & starts, whole)
    h.claim(Mux(waits, second, first & (spans.valid == given.valid) & (taken(spans) == taken(given))))
    return h


def of_stretch(name: str, place: int) -> Harness:
    """Claims on one stretch of a unit, and the claim that units side by side move in the same cycles."""
    make, stretches = UNITS[name]
    h = Harness(unit := make())
    tells_length(h)
    in_step(h)
    list(stretches(unit))[place].follow(h)
    return h


def of_cycles(name: str, *, exact: bool = False) -> Harness:
    """Claims on spans of a pixel or more, on all stretches. Beats are counted, or followed exactly."""
    make, stretches = UNITS[name]
    h = Harness(unit := make())
    h.assume(unit.i.payload.length != 0)
    tells_length(h)
    in_step(h)
    stays(h, unit.o)
    found = list(stretches(unit))
    # Each stretch begins at the input, or where another stretch ends.
    ends = {id(unit.i), *(id(stretch.sink) for stretch in found)}
    assert len(found) == STRETCHES[name]
    assert all(id(stretch.source) in ends for stretch in found)
    inside = [stretch.follow(h, exact=exact).any() for stretch in found]
    answers(h, Cat(inside).any(), taken(unit.o), unit.latency, unit.o.ready)
    # Beside a FIFO a span may wait for the pixels of another span, and for the interval of its setup.
    patience = (
        (1 << LENGTH_BITS) - 1 + INTERVAL
        if isinstance(unit, ChordSpansUnit | LocalChordInterpolatorUnit)
        else 0
    )
    answers(h, unit.i.valid, unit.i.ready, unit.latency + patience, unit.o.ready)
    return h


STRETCHES = {
    "linear": 4,
    "renormalise": 5,
    "quadratic": 5,
    "quadratic-eval": 3,
    "chord_spans": 1,
    "angular": 6,
    "recurrence_interpolator": 5,
    "bisection_interpolator": 2,
    "quotient_interpolator": 2,
}


BOUNDED = {"chord_spans": 14}
"""Cycles from power-up, for FIFOs beside a setup, which are not decided in time for runs of any length. They
take 15 seconds of a processor; each further cycle more than doubles the time."""

JOINED = (("chord_spans", 0),)
"""The stretches with these FIFOs."""


@pytest.mark.parametrize(
    ("name", "place"),
    [pytest.param(name, k, marks=marks_of(name)) for name, n in STRETCHES.items() for k in range(n)],
)
def test_pixels(prove, name, place):
    """By induction (except `JOINED`): beats of a stretch leave in order and once each, with their own word.

    Spans have 0 to 3 pixels, and setups an interval of 2. No more beats are inside than the units of the
    stretch hold.

    The stretches lead from the input to the output: where one ends, the next begins. So all pixels of a span
    leave in order, each with its position and the tag of its span. Units side by side move in the same cycles
    as the output.
    """
    prove(of_stretch(name, place), BOUNDED[name] if (name, place) in JOINED else None)


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks_of(name)) for name in UNITS])
def test_stability_and_progress(prove, name):
    """By induction (except `BOUNDED`), for spans of 1 to 3 pixels: no beat is stuck, no waiting beat changes.

    While the output is ready, a pixel leaves, or an offered span is taken, within the latency and one cycle.
    If a FIFO stands beside a setup, a span may wait some cycles longer.
    """
    prove(of_cycles(name), BOUNDED.get(name))


# For each bug: unit whose claims it refutes, text where it is injected, bug, and method if it is not usual.
BUGS = {
    "any span is taken in": ("linear", "setup.i.valid.eq(self.i.valid)", "setup.i.valid.eq(1)"),
    "spans are lost at the input": ("linear", "self.i.ready.eq(setup.i.ready)", "self.i.ready.eq(1)"),
    "vectors are lost": (
        "renormalise",
        "renormaliser.o.ready.eq(normals.ready)",
        "renormaliser.o.ready.eq(1)",
    ),
    "coefficients are lost": ("quadratic", "gpq.o.ready.eq(curve.i.ready)", "gpq.o.ready.eq(1)"),
    "middle normals are lost": ("quadratic", "middle.o.ready.eq(gpq.i.ready)", "middle.o.ready.eq(1)"),
    "a length goes before its span": (
        "quadratic-eval",
        "length.ready.eq(gpq.o.valid & curve.i.ready)",
        "length.ready.eq(curve.i.ready)",
    ),
    "there is no room for a length": ("quadratic", "gpq.latency + 2", "gpq.latency - 3"),
    "a span does not wait for its differences": (
        "chord_spans",
        "joined.valid.eq(lengths.r_rdy & (waits | ~is_long))",
        "joined.valid.eq(lengths.r_rdy)",
    ),
    "differences stay": ("chord_spans", "taken & takes_long", "0", "_keep_words"),
    "starts stay": (
        "chord_spans",
        "kept, entered, taken,",
        "kept, entered, taken & takes_long,",
        "_keep_words",
    ),
    "angles are lost": ("angular", "setup.o.ready.eq(prepared.ready)", "setup.o.ready.eq(1)"),
    "cosines are lost": ("angular", "cosine.o.ready.eq(self.o.ready)", "cosine.o.ready.eq(1)"),
    "one light has a span too many": (
        "recurrence_interpolator",
        "unit.i.valid.eq(prepared.valid)",
        "unit.i.valid.eq(prepared.valid | (light == 1))",
    ),
    "values are lost": (
        "recurrence_interpolator",
        "unit.o.ready.eq(self.o.ready)",
        "unit.o.ready.eq(1)",
    ),
    "normals of lines are lost": (
        "bisection_interpolator",
        "normaliser.o.ready.eq(normals.ready)",
        "normaliser.o.ready.eq(1)",
    ),
    "quotients are lost": (
        "quotient_interpolator",
        "quotient.o.ready.eq(self.o.ready)",
        "quotient.o.ready.eq(1)",
    ),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in an interpolator, refutes one of its claims."""
    name, text, change, *method = BUGS[bug]
    unit = type(UNITS[name][0]())
    usual = "source" if issubclass(unit, NormalInterpolatorUnit) else "elaborate"
    inject(unit, *(method or [usual]), text, change)
    refute(of_cycles(name, exact=True), 30)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=marks_of(name))
        for name in ("linear", "renormalise", "quadratic", "quadratic-eval", "bisection_interpolator")
    ],
)
def test_lost_products_are_found(refute, inject, name):
    """Products that are dropped while they wait are found in all methods that find normals."""
    flag = "self.out_of_range.eq(out_of_range)"
    inject(NormalInterpolatorUnit, "elaborate", flag, f"products.o.ready.eq(1), {flag}")
    refute(of_cycles(name, exact=True), 30)


def test_pairs_are_divided(prove):
    """By induction."""
    prove(of_pairs())


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("second.eq(pair & ~second)", "second.eq(0)"),
        ("self.i.ready.eq(spans.i.ready & ~second)", "self.i.ready.eq(spans.i.ready)"),
        ("copy(given[0], end)", "copy(given[0], values[2])"),
    ],
)
def test_lost_second_pixels_are_found(refute, inject, text, change):
    inject(LocalChordInterpolatorUnit, "elaborate", text, change)
    refute(of_pairs(), 30)


def test_dropped_cosines_are_found(refute, monkeypatch):
    """A beat that is dropped while it waits at the output of the highlight-cosine unit is found."""

    def dropping(m, output, valid, payload):
        advance = skid_buffer(m, output, valid, payload)
        m.d.comb += Value.cast(output.payload).eq(Value.cast(payload))
        return advance

    monkeypatch.setattr(blysk.hdl.cosines.highlight_cosine, "skid_buffer", dropping)
    refute(of_cycles("angular"), 30)
