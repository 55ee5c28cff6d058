"""Serial vectors: from spans, attribute by attribute, to pieces with words of the quotient method."""

from itertools import pairwise

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.span_attributes import SPAN_NORMAL, SPAN_STEP
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.geometry.triangles import ATTRIBUTES, PIXEL_BITS
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.core.bits import select
from blysk.hdl.core.ring import Ring, next_turn
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.span_attributes import whole_span_shape
from blysk.hdl.geometry.span_halver import few_of, is_apart, is_kept, shorter, size_of
from blysk.hdl.geometry.surface_words import (
    STEP_BITS,
    attribute_count,
    placement_of,
    surface_count,
    surface_exponent,
    surface_step,
    used_step,
)
from blysk.hdl.geometry.triangles import count_events, counters_shape
from blysk.hdl.geometry.vector_adapter import exponent_of, rounded, shift_of, used_bits, vector_spans_shape

__all__ = ["SerialVectorsUnit"]

_WIDTH = SPAN_STEP.width


class SerialVectorsUnit(wiring.Component):
    """Does the work of `SpanHalverUnit` and `VectorAdapterUnit` on one attribute a cycle, with equal results.

    The n attributes of a span are in rings that turn by one attribute a cycle. n is 4, and more with a
    surface. Rings of more than `RING_REGISTERS` words are memories of look-up tables.

    1. A span comes in n turns. The turns also find the span's shift. They test whether the span fits, with
       the shift of the piece before. If the span's own shift differs, n more turns test again.
    2. n turns find the exponents of the steps.
    3. n turns give the start.
    4. n turns give the step, while the next span, or the rest of this span, comes in.

    Each component of a vector goes through one shifter, a subtraction, another shifter and a rounding. An
    attribute of the surface goes through one shifter.

    A piece takes ``3 n + 1`` cycles, 13 with four attributes. Each time that it does not fit, it takes n + 2
    more cycles. Each time that its shift differs from the shift before, it takes n + 1 more cycles. Steps 3
    and 4 of the next piece begin when this piece has been taken. Steps 1 and 2 go on meanwhile. A span that
    fits is offered at most `latency` cycles after its last attribute was taken. The unit has no multipliers.

    Parameters
    ----------
    rotates : bool
        As in `SpanHalver` and `VectorAdapter`.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring.

    Members
    -------
    i : :py:`In(stream.Signature(whole_span_shape(surface)))`
        Attributes of spans, n beats a span, from a `SpanAttributesUnit` that is serial and ``whole``.
    o : :py:`Out(stream.Signature(vector_spans_shape(surface)))`
        Pieces, as from `VectorAdapterUnit`.
    status : :py:`Out(counters_shape("cut"))`
        Number of spans that were cut, since the reset.

    Attributes
    ----------
    idle : Signal
        High while neither a span nor a piece is inside.

    Source: docs/theory/geometry.md#composition; not in the documents.
    """

    def __init__(self, rotates: bool = False, surface: AttributeSpans | None = None):
        self.rotates, self._surface = rotates, surface
        self._count = attribute_count(surface)
        self.latency = 3 * self._count + 8 + self._final
        super().__init__(
            {
                "i": In(stream.Signature(whole_span_shape(surface))),
                "o": Out(stream.Signature(vector_spans_shape(surface))),
                "status": Out(counters_shape("cut")),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """The rings and their turns, the decisions, the pieces of a span, and the words."""
        m = Module()
        # Steps of four turns each. `settles` is one cycle without a turn. A span that does not fit also takes
        # one cycle without a turn.
        names = "loads", "settles", "repeats", "tests", "starts", "steps", "renews"
        loads, settles, repeats, tests, starts, steps, renews = (
            Signal(name=name, init=name == "loads") for name in names
        )
        place, overlaps = Signal(range(self._count), name="place"), Signal(name="overlaps")
        turns, ends, whole = (Signal(name=name) for name in ("turns", "ends", "whole"))
        fits, agrees = Signal(name="fits"), Signal(name="agrees")
        begins, decides, retries = ~place.any(), Signal(name="decides"), Signal(name="retries")
        # While ``leaving`` is high, a piece has not left yet. The words of the next piece have to wait.
        leaving = Signal(name="leaving")
        comes = loads | (steps & Mux(begins, whole & self.i.valid, overlaps))
        # The last turn of a step waits for nothing but the input. So its path is short.
        comes_last = loads | (steps & overlaps)
        m.d.comb += [
            decides.eq(tests & begins),
            retries.eq(decides & ~fits),
            turns.eq(~settles & ~retries & ~(starts & begins & leaving) & (~comes | self.i.valid)),
            ends.eq(self._is_last(place) & (~comes_last | self.i.valid)),
            self.i.ready.eq(loads | (steps & Mux(begins, whole, overlaps))),
        ]
        with m.If(turns):
            m.d.sync += [place.eq(next_turn(place, self._count)), overlaps.eq(comes)]
        # The rest of a span behind a piece is made in the turns that give the step.
        rest_goes = steps & ~whole
        with m.If(ends | settles | retries):
            m.d.sync += [
                loads.eq(steps & whole & ~comes_last),
                settles.eq(ends & (comes_last | renews | repeats | rest_goes)),
                repeats.eq(settles & ~agrees),
                tests.eq(settles & agrees),
                starts.eq(tests & ~retries),
                steps.eq(starts),
                renews.eq(retries),
            ]

        # The ends of a piece, or of the rest of a span, follow from the ends before.
        odd, renewed = Signal(name="odd"), renews | rest_goes
        heads = self._rings(m, (turns, place), comes, renewed, odd, renews)
        tag, pixels, uncut, words = self._pixels(m, comes_last & ends, retries, steps & ends, (whole, odd))
        kinds = turns & (comes | renewed | repeats), settles
        shift = self._test(m, heads, kinds, place, pixels, (fits, agrees))
        kinds = tests, starts & turns, steps, turns
        self._words(m, heads, kinds, place, shift, tag, words)
        if self._surface is not None:
            self._surface_words(m, heads, kinds, place, tag)
        count_events(m, self.status, cut=retries & uncut)
        with m.If(turns & steps & (place == self._final)):
            m.d.sync += leaving.eq(1)
        with m.Elif(self.o.valid & self.o.ready):
            m.d.sync += leaving.eq(0)
        m.d.comb += self.idle.eq(loads & begins & ~leaving)
        return m

    @property
    def _final(self) -> int:
        """Place of the last attribute in step 4: z of N/W, or with ``surface`` its last word."""
        return ATTRIBUTES - 2 if self._surface is None else self._count - 1

    def _is_last(self, place: Signal):
        return place.all() if 1 << len(place) == self._count else place == self._count - 1

    def _is_component(self, place: Signal):
        return ~place.all() if self._surface is None else place < ATTRIBUTES - 1

    def _rings(self, m: Module, turns, comes, renewed, odd, renews) -> dict[str, Signal]:
        """Rings of the near, far and last ends and of the steps. Returns their first words.

        The last end is the far end of the whole span.
        """
        given, names = self.i.payload, ("near", "far", "last", "step")
        rings = {name: Ring(m, name, _WIDTH, self._count, *turns) for name in names}
        near, far, last, step = (rings[name].first for name in names)
        # After a piece the next pixel follows. After a try that does not fit, the end moves to one pixel
        # less, or to the mean of both ends.
        other = Mux(renews, Mux(odd, near, ~step), step)
        total = Signal(_WIDTH + 1, name="total")
        m.d.comb += total.eq(far.as_signed() + other.as_signed() + (renews & ~odd))
        new_far = Mux(renews, Mux(odd, total[1:], total[:_WIDTH]), last)
        following = {
            "near": (given.near, Mux(renewed & ~renews, total[:_WIDTH], near)),
            "far": (given.far, Mux(renewed, new_far, far)),
            "last": (given.far, last),
            "step": (given.inward, step),
        }
        for name, (new, old) in following.items():
            rings[name].takes(Mux(comes, Value.cast(new), old))
        return {name: ring.first for name, ring in rings.items()} | {
            "new_near": rings["near"].newest,
            "new_far": rings["far"].newest,
        }

    def _pixels(self, m: Module, comes, retries, leaves, flags):
        """The piece's flags and number of pixels, whether the span is uncut, and the words that only pass."""
        (whole, odd), given = flags, self.i.payload
        tag = {
            name: Signal.like(Value.cast(given[name]), name=name, reset_less=True)
            for name in ("y", "right", "flip", "material", *placement_of(self._surface))
        }
        x, left, pixels = (Signal(PIXEL_BITS, name=name, reset_less=True) for name in ("x", "left", "pixels"))
        uncut, rest = Signal(name="uncut"), (left - pixels)[:PIXEL_BITS]
        with m.If(comes):
            m.d.sync += [
                *(signal.eq(Value.cast(given[name])) for name, signal in tag.items()),
                *(signal.eq(given.length) for signal in (left, pixels)),
                *(x.eq(given.x), whole.eq(1), uncut.eq(1)),
            ]
        with m.Elif(retries):
            m.d.sync += [pixels.eq(shorter(pixels)), odd.eq(pixels[0])]
            m.d.sync += [whole.eq(0), uncut.eq(0)]
        with m.Elif(leaves):
            m.d.sync += [left.eq(rest), pixels.eq(rest), whole.eq(1)]
            m.d.sync += x.eq(Mux(tag["right"], x, x + pixels))
        words = {"x": Mux(tag["right"], x + rest, x), "y": tag["y"]}
        return tag, pixels, uncut, words | {"length": pixels, "material": tag["material"]}

    def _test(self, m: Module, heads, kinds, place, pixels, results) -> Signal:
        """Decide whether the piece fits, from the third cycle after its last component on. Returns its shift.

        The test uses the shift of the piece before. If the piece's own shift differs, the piece is tested
        again.
        """
        (comes, settles), is_component, (fits, agrees) = kinds, self._is_component(place), results
        bits, places = SpanHalver.BITS, SpanHalver.LARGEST_SHIFT

        # ``came`` and ``first`` belong to a word that came on the cycle before.
        came, first = Signal(name="came"), Signal(name="came_first")
        used, shift = Signal(places, name="used"), Signal(range(places + 1), name="shift")
        rest, chosen = used, []
        for step in (4, 2, 1):
            empty = ~rest[-step:].any()
            rest = Mux(empty, rest << step, rest)[:places]
            chosen.insert(0, empty)
        m.d.sync += [came.eq(comes & is_component), first.eq(~place.any())]
        sizes = {}
        for end in ("near", "far"):
            word = size_of(heads[f"new_{end}"])
            sizes[end] = Signal(len(word), name=f"whole_size_{end}")
            m.d.comb += sizes[end].eq(word)
        with m.If(came):
            m.d.sync += used.eq(Mux(first, 0, used) | sizes["near"][bits:] | sizes["far"][bits:])
        # The shift stays until the next piece has come.
        m.d.comb += agrees.eq(shift == Cat(chosen))
        with m.If(settles):
            m.d.sync += shift.eq(Cat(chosen))

        # The first bits of a component at both ends, and whether both signs are the same.
        shape = data.StructLayout({"near": bits, "far": bits, "keeps": 1})
        size, before, zeroth = (Signal(shape, name=name) for name in ("size", "size_before", "size_0"))
        tested, begins = Signal(name="tested"), Signal(name="tested_first")
        long, large, steep = (Signal(name=name) for name in ("long", "large", "steep"))
        axis, pair = (int(bound * (1 << bits)) for bound in (SpanHalver.AXIS, SpanHalver.PAIR))

        def both(other):
            sums = [size[end] + other[end] >= pair for end in ("near", "far")]
            return size.keeps & other.keeps & sums[0] & sums[1]

        is_long = size.keeps & (size.near >= axis) & (size.far >= axis)
        is_large = size.near[-1] | size.far[-1]
        is_steep = is_large & ~size.keeps
        if self.rotates:
            is_steep = is_apart(size.keeps, size.near, size.far)
        m.d.sync += [tested.eq(came), begins.eq(first)]
        for end, word in sizes.items():
            windows = [word[places - n :][:bits] for n in range(places + 1)]
            m.d.sync += size[end].eq(select(windows, shift))
        m.d.sync += size.keeps.eq(heads["new_near"][-1] == heads["new_far"][-1])
        with m.If(tested):
            m.d.sync += [
                copy(before, size),
                long.eq(is_long | (~begins & (long | both(before) | both(zeroth)))),
                large.eq(is_large | (~begins & large)),
                steep.eq(is_steep | (~begins & steep)),
            ]
            with m.If(begins):
                m.d.sync += copy(zeroth, size)
        few = Signal(3, name="few")
        m.d.sync += few.eq(few_of(pixels))
        m.d.comb += fits.eq(is_kept(few, long, large, steep))
        return shift

    def _words(self, m: Module, heads, kinds, place, shift, tag, words) -> None:
        """Send each component through the shifts and the rounding.

        Also send the depths and the words that pass unchanged.
        """
        p, is_component = VectorAdapter(self.rotates), self._is_component(place)
        is_depth = ~is_component if self._surface is None else place == ATTRIBUTES - 1
        (tests, starts, steps, turns), right = kinds, tag["right"]
        bits, low = p.STEP_BITS + 1, SPAN_STEP.fraction_bits - SPAN_NORMAL.fraction_bits
        note = data.StructLayout({"finds": 1, "is_start": 1, "gives": 1, "first": 1, "last": 1})
        notes = [Signal(note, name=f"note_{stage}") for stage in range(5)]
        now = notes[0]
        m.d.comb += [
            now.finds.eq(tests & is_component),
            now.is_start.eq(starts & is_component),
            now.gives.eq((starts | (steps & turns)) & is_component),
            now.first.eq(~place.any()),
            now.last.eq(steps & turns & (place == self._final)),
        ]

        def register(value, name):
            signal = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            m.d.sync += signal.eq(value)
            return signal

        m.d.sync += [copy(after, before) for before, after in pairwise(notes)]

        # Two words have the fraction bits of the step: the first pixel's value, which is under 1, and the
        # step modulo 2.
        value, step = Mux(right, heads["far"], heads["near"]), heads["step"]
        beyond, sign = value[-1] ^ value[-2], value[-1]
        value = Cat(Mux(beyond, (~sign).replicate(bits - 1), value[: bits - 1]), sign)
        code = Mux(starts, Cat(Const(0, low), value[low:]), step[:bits])[:bits]
        shift = shift_of(p, shift)
        code, late_shift = register(code, "chosen"), register(shift, "late_shift")
        for k in reversed(range(len(shift))):
            code = Mux(late_shift[k], code << (1 << k), code)[:bits]
        code = register(code.as_signed(), "shifted")
        part = code >> p.margin_shift
        part = Cat(Mux(notes[2].is_start, 0, part[:low]), part[low:]).as_signed()
        small = register((code - part)[:bits].as_signed(), "small")

        # The exponent and the flags stay until the next piece brings its own.
        used, exponent = Signal(p.LARGEST_EXPONENT, name="step_used"), Signal(4, name="exponent")
        with m.If(notes[2].finds):
            found = used_bits(p, [code])
            m.d.sync += used.eq(Mux(notes[2].first, 0, used) | found)
        with m.If(notes[2].is_start):
            m.d.sync += exponent.eq(exponent_of(used))
        code = small
        for k in reversed(range(len(exponent))):
            code = Mux(exponent[k] & ~notes[3].is_start, code << (1 << k), code)[:bits]
        code = register(code.as_signed(), "large")
        flip, step_flip = Signal(name="start_flip"), Signal(name="step_flip")
        word = rounded(code, Mux(notes[4].is_start, flip, step_flip), p.STEP_BITS)

        result = Signal(self.o.payload.shape(), name="result", reset_less=True)
        ring = [Value.cast(result[name][k]) for name in ("start", "step") for k in range(3)]
        with m.If(notes[4].gives):
            m.d.sync += [target.eq(source) for target, source in pairwise([*ring, word])]
        with m.If(now.is_start & now.first):
            m.d.sync += [flip.eq(tag["flip"]), step_flip.eq(tag["flip"] ^ right)]
            m.d.sync += [result[name].eq(word) for name, word in words.items()]
        with m.If(starts & is_depth):
            m.d.sync += Value.cast(result.depth).eq(Cat(value[:-1], ~value[-1]))
        with m.If(steps & is_depth):
            m.d.sync += Value.cast(result.depth_step).eq(Mux(right, -step, step)[: len(step)])
        there = Signal(name="there")
        with m.If(notes[4].last):
            m.d.sync += there.eq(1)
        with m.Elif(self.o.ready):
            m.d.sync += there.eq(0)
        m.d.comb += [
            self.o.valid.eq(there),
            copy(self.o.payload, result),
            self.o.payload.exponent.eq(exponent),
        ]

    def _surface_words(self, m: Module, heads, kinds, place, tag) -> None:
        """Send each attribute of the surface through the shift of its step, in the turns behind the depth."""
        (tests, starts, steps, turns), right = kinds, tag["right"]
        is_surface, result = place >= ATTRIBUTES, self.o.payload.attributes
        start, step = Mux(right, heads["far"], heads["near"]), heads["step"]
        moved = Signal(STEP_BITS, name="surface_moved")
        m.d.comb += moved.eq(Mux(right, -step, step))
        used = Signal(SurfaceWords.LARGEST_EXPONENT, name="surface_used", reset_less=True)
        with m.If(tests & is_surface):
            m.d.sync += used.eq(Mux(place == ATTRIBUTES, 0, used) | used_step(moved))
        found = surface_exponent(used)
        exponent = Signal(len(found), name="surface_exponent", reset_less=True)
        held = {
            name: Signal(shape, name=f"surface_{name}", reset_less=True)
            for name, shape in placement_of(self._surface).items()
        }
        with m.If(starts & turns & ~place.any()):
            m.d.sync += [exponent.eq(found), *(Value.cast(held[name]).eq(tag[name]) for name in held)]
        code, shift = Signal(STEP_BITS, name="surface_code"), Signal(len(found), name="surface_shift")
        gives = Signal(name="surface_gives")
        m.d.sync += [
            code.eq(Mux(starts, start, moved)),
            shift.eq(Mux(starts, 0, exponent)),
            gives.eq((starts | steps) & turns & is_surface),
        ]
        count, word = surface_count(self._surface), surface_step(code, shift)
        ring = [
            Signal(len(word), name=f"surface_{name}_{k}", reset_less=True)
            for name in ("start", "step")
            for k in range(count)
        ]
        with m.If(gives):
            m.d.sync += [target.eq(source) for target, source in pairwise([*ring, word])]
        m.d.comb += [
            Value.cast(result.start).eq(Cat(ring[:count])),
            Value.cast(result.step).eq(Cat(ring[count:])),
            result.exponent.eq(exponent),
            *copy_fields(result, held, held),
        ]
