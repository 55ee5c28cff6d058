"""The span halver, which cuts spans where N/W grows too short for a method that takes vectors."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH, SPAN_NORMAL, SPAN_STEP
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import ATTRIBUTES, MATERIAL_BITS, PIXEL_BITS
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.geometry.span_attributes import whole_spans_shape
from blysk.hdl.geometry.surface_words import (
    STEP_BITS,
    attribute_count,
    halved_surface_shape,
    placement_of,
    surface_start,
)
from blysk.hdl.geometry.triangles import count_events, counters_shape

__all__ = ["SpanHalverUnit", "few_of", "halved_spans_shape", "is_apart", "is_kept", "shorter", "size_of"]

_COMPONENTS = ATTRIBUTES - 1

_SIZES = data.ArrayLayout(data.ArrayLayout(unsigned(SpanHalver.BITS + 1), _COMPONENTS), 2)

_MARKS = data.StructLayout({"shift": 2, "used": 1, "sizes": _SIZES, "same": _COMPONENTS, "few": 3})
"""Marks of a piece: which of the shifts by 4 and by 2 its sizes had, whether they use their first bit, the
sizes at both ends, whether components keep their signs, and the pixels (`few_of`)."""


def halved_spans_shape(surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of a piece: N/W at its first pixel, its step and shift, depth, first pixel, length, flags.

    With ``surface`` there are also words of its attributes, see `halved_surface_shape`.
    """
    words = {
        "start": data.ArrayLayout(FixedShape(SPAN_NORMAL), _COMPONENTS),
        "step": data.ArrayLayout(FixedShape(SPAN_STEP), _COMPONENTS),
        "shift": unsigned(SpanHalver.LARGEST_SHIFT.bit_length()),
    }
    places = {name: unsigned(PIXEL_BITS) for name in ("x", "y", "length")}
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
    flags = {"flip": unsigned(1), "turned": unsigned(1), "material": unsigned(MATERIAL_BITS)}
    return data.StructLayout(words | places | depth | flags | halved_surface_shape(surface))


class SpanHalverUnit(wiring.Component):
    """Pieces of spans along which N/W stays long. `SpanHalver` is the bit-accurate model.

    A span waits for a cycle, on which the unit tests it. On the next cycle the span is offered, if it fits.
    ``i.ready`` is a register, so no path leads from the output to the walk along spans. While the output is
    ready, two spans are taken in every three cycles. A span that does not fit takes three cycles more each
    time that it is tried again. The rest of a span behind a piece takes three cycles more, too. Both ends of
    an attribute share one adder. The unit has no multipliers.

    Parameters
    ----------
    model : SpanHalver
        Bit-accurate model.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring.

    Members
    -------
    i : :py:`In(stream.Signature(whole_spans_shape(surface)))`
        Spans of `SpanAttributesUnit` with ``whole``.
    o : :py:`Out(stream.Signature(halved_spans_shape(surface)))`
        Pieces of the spans: N/W at the first pixel, the attributes' step away from the long edge, and the
        number of places by which both are shifted.
    status : :py:`Out(counters_shape("cut"))`
        Number of spans that were cut, since the reset.

    Attributes
    ----------
    idle : Signal
        High while no piece is inside.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    latency = 2

    def __init__(self, model: SpanHalver | None = None, surface: AttributeSpans | None = None):
        self.model, self._surface = model or SpanHalver(), surface
        super().__init__(
            {
                "i": In(stream.Signature(whole_spans_shape(surface))),
                "o": Out(stream.Signature(halved_spans_shape(surface))),
                "status": Out(counters_shape("cut")),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """A span that waits for its test, the piece that is tried, and the next try."""
        m = Module()
        given, result = self.i.payload, self.o.payload
        # ``waits``: a span waits for its test. ``valid``: a piece is inside. ``fits`` and ``misses`` tell the
        # result of its test. ``again`` and ``tried``: the marks, then the test of another piece are due.
        # ``whole``: the piece reaches to the end of the span.
        waits, valid, fits, misses, again, tried, whole, uncut = (
            Signal(name=name)
            for name in ("waits", "valid", "fits", "misses", "again", "tried", "whole", "uncut")
        )
        takes, moves, leaves, stays, retries, fitting = (
            Signal(name=name) for name in ("takes", "moves", "leaves", "stays", "retries", "fitting")
        )
        ready = Signal(name="ready", init=1)
        waiting = Signal(given.shape(), name="waiting", reset_less=True)
        tag = {
            name: Signal.like(Value.cast(given[name]), name=name, reset_less=True)
            for name in ("y", "right", "flip", "material", *placement_of(self._surface))
        }
        x, left, pixels = (Signal(PIXEL_BITS, name=name, reset_less=True) for name in ("x", "left", "pixels"))
        m.d.comb += [
            self.o.valid.eq(fits),
            self.i.ready.eq(ready),
            takes.eq(self.i.valid & ready),
            leaves.eq(fits & self.o.ready),
            stays.eq(valid & ~(leaves & whole)),
            moves.eq(waits & ~stays),
            retries.eq((leaves & ~whole) | misses),
            self.idle.eq(~(waits | valid)),
        ]
        # A span may come if no span waits then, or if the span that waits moves on, because no piece is
        # inside. The marks of another piece take the place of the marks of a span at the input.
        m.d.sync += [
            waits.eq(takes | (waits & stays)),
            ready.eq(~retries & ~((takes | stays) & waits) & ~(takes & stays)),
            again.eq(retries),
            tried.eq(again),
        ]
        with m.If(takes):
            m.d.sync += waiting.eq(given)
        rest, odd = (left - pixels)[:PIXEL_BITS], pixels[0]
        count, kinds = attribute_count(self._surface), (moves, leaves, misses)
        ends = [self._attribute(m, k, kinds, odd, waiting) for k in range(count)]
        marks = self._tested_marks(m, (again, tried), takes, ends, (given, pixels))
        shift = Signal(len(result.shift), name="shift", reset_less=True)
        m.d.comb += fitting.eq(self._fits(m, marks))
        m.d.sync += [
            fits.eq(Mux(moves | tried, fitting, fits & ~leaves)),
            misses.eq((moves | tried) & ~fitting),
        ]
        with m.If(moves | tried):
            m.d.sync += shift.eq(Cat(marks.used, marks.shift))

        with m.If(moves):
            m.d.sync += [
                *(signal.eq(Value.cast(waiting[name])) for name, signal in tag.items()),
                *(signal.eq(waiting.length) for signal in (left, pixels)),
                x.eq(waiting.x),
                *(flag.eq(1) for flag in (valid, whole, uncut)),
            ]
        with m.Elif(leaves):
            m.d.sync += [
                valid.eq(~whole),
                whole.eq(1),
                left.eq(rest),
                pixels.eq(rest),
                x.eq(Mux(tag["right"], x, x + pixels)),
            ]
        with m.Elif(misses):
            m.d.sync += [whole.eq(0), uncut.eq(0), pixels.eq(shorter(pixels))]

        turned = tag["right"]
        steps = []
        for k, (near, far, step) in enumerate(ends[ATTRIBUTES:]):
            m.d.comb += [
                result.surface_start[k].eq(surface_start(Mux(turned, far, near))),
                result.surface_step[k].eq(Mux(turned, -step, step)[:STEP_BITS]),
            ]
        for k, (near, far, step) in enumerate(ends[:ATTRIBUTES]):
            value = FixedValue(SPAN_STEP, Mux(turned, far, near).as_signed())
            if k < _COMPONENTS:
                end = value.truncate(SPAN_NORMAL.fraction_bits).saturate(SPAN_NORMAL)
                m.d.comb += [result.start[k].eq(end), Value.cast(result.step[k]).eq(step)]
            else:
                code = Value.cast(value.saturate(SQ(1, SPAN_STEP.fraction_bits)))
                m.d.comb += Value.cast(result.depth).eq(Cat(code[:-1], ~code[-1]))
                steps.append(Mux(turned, -step, step)[: len(step)])
        m.d.comb += [
            Value.cast(result.depth_step).eq(steps[0]),
            result.shift.eq(Cat(~shift[0], shift[1:])),
            result.x.eq(Mux(turned, x + rest, x)),
            result.length.eq(pixels),
            result.turned.eq(turned),
            *(Value.cast(result[name]).eq(word) for name, word in tag.items() if name != "right"),
        ]
        count_events(m, self.status, cut=misses & uncut)
        return m

    @staticmethod
    def _attribute(m: Module, k: int, kinds, odd, waiting) -> tuple[Signal, Signal, Signal]:
        """Registers of an attribute at both ends of the piece, and of its step."""
        moves, leaves, misses = kinds
        near, far, last, step = (
            Signal(SPAN_STEP.width, name=f"{name}_{k}", reset_less=True)
            for name in ("near", "far", "last", "step")
        )
        signed_far, signed_near = far.as_signed(), near.as_signed()
        # After a piece the next pixel follows. After a try that does not fit, the end moves to one pixel
        # less, or to the mean of both ends.
        other = Mux(misses, Mux(odd, signed_near, ~step.as_signed()), step.as_signed())
        total = Signal(SPAN_STEP.width + 1, name=f"total_{k}")
        m.d.comb += total.eq(signed_far + other + (misses & ~odd))
        with m.If(moves):
            m.d.sync += [
                near.eq(Value.cast(waiting.near[k])),
                *(signal.eq(Value.cast(waiting.far[k])) for signal in (far, last)),
                step.eq(Value.cast(waiting.inward[k])),
            ]
        with m.Elif(leaves):
            m.d.sync += [near.eq(total), far.eq(last)]
        with m.Elif(misses):
            m.d.sync += far.eq(Mux(odd, total >> 1, total))
        return near, far, step

    def _tested_marks(self, m: Module, due, takes, ends, words) -> data.View:
        """Marks of the span or piece that is tested, from registers."""
        (again, tried), (given, pixels) = due, words
        found = self._marks(m, again, ends, given)
        first, later, chosen = (
            Signal(_MARKS, name=name, reset_less=True) for name in ("first", "later", "chosen")
        )
        with m.If(takes):
            m.d.sync += [first.eq(found), first.few.eq(few_of(given.length))]
        with m.If(again):
            m.d.sync += [later.eq(found), later.few.eq(few_of(pixels))]
        m.d.comb += chosen.eq(Mux(tried, later, first))
        return chosen

    @staticmethod
    def _marks(m: Module, again, ends, given) -> data.View:
        """Marks of a piece or of the span at the input, without the pixels."""
        bits = SpanHalver.BITS
        sizes, signs = [], []
        for k in range(_COMPONENTS):
            for end, (held, incoming) in enumerate(
                zip(ends[k][:2], (given.near[k], given.far[k]), strict=True)
            ):
                code = _wire(m, Mux(again, held, Value.cast(incoming).as_unsigned()), f"end_{end}_{k}")
                sizes.append(_wire(m, size_of(code), f"whole_size_{end}_{k}"))
                signs.append(code[-1])
        used = sizes[0][bits:]
        for size in sizes[1:]:
            used = used | size[bits:]
        used, marks = _wire(m, used, "used"), Signal(_MARKS, name="marks")
        for number, step in enumerate((4, 2)):
            empty = _wire(m, ~used[-step:].any(), f"empty_{step}")
            used, *sizes = (
                _wire(m, Mux(empty, word << step, word)[: len(word)], f"shifted_{step}_{k}")
                for k, word in enumerate((used, *sizes))
            )
            m.d.comb += marks.shift[1 - number].eq(empty)
        m.d.comb += [
            marks.used.eq(used[-1]),
            marks.same.eq(Cat(first == last for first, last in zip(signs[::2], signs[1::2], strict=True))),
            *(marks.sizes[k % 2][k // 2].eq(size[-bits - 1 :]) for k, size in enumerate(sizes)),
        ]
        return marks

    def _fits(self, m: Module, marks: data.View) -> Value:
        """Whether the piece needs no cut."""
        bits, scale = SpanHalver.BITS, 1 << SpanHalver.BITS
        axis, pair = int(SpanHalver.AXIS * scale), int(SpanHalver.PAIR * scale)
        first, last = (
            [
                _wire(m, Mux(marks.used, size[1:], size[:-1]), f"size_{end}_{k}")
                for k, size in enumerate(marks.sizes[end][k] for k in range(_COMPONENTS))
            ]
            for end in range(2)
        )
        same = [marks.same[k] for k in range(_COMPONENTS)]
        long = 0
        for k, keeps in enumerate(same):
            long = long | (keeps & (first[k] >= axis) & (last[k] >= axis))
            j = (k + 1) % len(same)
            sums = [end[j] + end[k] >= pair for end in (first, last)]
            long = long | (keeps & same[j] & sums[0] & sums[1])
        large = [a[bits - 1] | b[bits - 1] for a, b in zip(first, last, strict=True)]
        steep = Cat(~keeps & size for keeps, size in zip(same, large, strict=True)).any()
        if self.model.rotates:
            steep = Cat(is_apart(*words) for words in zip(same, first, last, strict=True)).any()
        return is_kept(marks.few, long, Cat(large).any(), steep)


def _wire(m: Module, value: Value, name: str) -> Signal:
    """A signal with a value. An expression that is used twice would be built twice."""
    signal = Signal(Value.cast(value).shape(), name=name)
    m.d.comb += signal.eq(value)
    return signal


def few_of(pixels: Value) -> Value:
    """Three bits of a number of pixels, from which `is_kept` knows 1 and 2."""
    return Cat(pixels[:2], pixels[2:].any())


def size_of(code: Value) -> Value:
    """First bits of the size of a component in ``SPAN_STEP``: `SpanHalver.BITS`, and the bits of the shift.

    The size of a negative code is its complement. Beyond the range all bits are 1.
    """
    top = SPAN_STEP.fraction_bits
    sign, beyond = code[-1], code[-1] ^ code[-2]
    chosen = code[top - SpanHalver.LARGEST_SHIFT - SpanHalver.BITS : top]
    return (chosen ^ sign.replicate(len(chosen))) | beyond.replicate(len(chosen))


def shorter(pixels: Value) -> Value:
    """Pixels of the next piece to try: an even number minus 1, or the larger half of an odd number."""
    odd = pixels[0]
    return (Mux(odd, pixels >> 1, pixels) + Mux(odd, 1, (1 << PIXEL_BITS) - 1))[:PIXEL_BITS]


def is_kept(few: Value, long: Value, large: Value, steep: Value) -> Value:
    """Whether a piece needs no cut.

    Parameters
    ----------
    few : Value
        What `few_of` gives for the number of the piece's pixels.
    long : Value
        Whether a component, or a sum of two, stays long along the piece.
    large : Value
        Whether the first bit of a component is 1 at an end. If it is 1 nowhere, the largest shift is too
        small.
    steep : Value
        Whether a component's ends are too far apart for a piece of two pixels.
    """
    two, one = (~few[2] & (few[:2] == number) for number in (2, 1))
    return one | ((long | ~large) & ~(two & steep))


def is_apart(keeps: Value, first: Value, last: Value) -> Value:
    """Whether a component's ends are too far apart for a span of two pixels, from the first bits of both."""
    most = int(SpanHalver.STEEP * (1 << SpanHalver.BITS))
    # The first bits of a negative code are the size's first bits minus 1, with the other sign.
    return Mux(keeps, (first - last > most) | (last - first > most), first + last >= most)
