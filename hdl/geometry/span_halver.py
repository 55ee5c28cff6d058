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

__all__ = ["SpanHalverUnit", "halved_spans_shape", "is_apart", "is_kept", "shorter", "size_of"]

_COMPONENTS = ATTRIBUTES - 1


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

    A span, or a piece, is offered on the cycle after it was taken in. While the output is ready, a span is
    taken in on every cycle. A span that does not fit takes two cycles more each time that it is tried again.
    The rest of a span behind a piece takes two cycles more, too. Both ends of an attribute share one adder.
    The unit has no multipliers.

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

    latency = 1

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
        """The piece that is tried, the bits that tell whether it fits, and the next try."""
        m = Module()
        given, result = self.i.payload, self.o.payload
        # ``known``: the bits of the test belong to the piece's ends; ``whole``: the piece reaches to the end
        # of the span.
        valid, known, whole, uncut = (Signal(name=name) for name in ("valid", "known", "whole", "uncut"))
        fits, takes, leaves = (Signal(name=name) for name in ("fits", "takes", "leaves"))
        tag = {
            name: Signal.like(Value.cast(given[name]), name=name, reset_less=True)
            for name in ("y", "right", "flip", "material", *placement_of(self._surface))
        }
        x, left, pixels = (Signal(PIXEL_BITS, name=name, reset_less=True) for name in ("x", "left", "pixels"))
        m.d.comb += [
            self.o.valid.eq(valid & known & fits),
            leaves.eq(self.o.valid & self.o.ready),
            self.i.ready.eq(~valid | (leaves & whole)),
            takes.eq(self.i.valid & self.i.ready),
            self.idle.eq(~valid),
        ]
        retries, rest = Signal(name="retries"), (left - pixels)[:PIXEL_BITS]
        odd = pixels[0]
        m.d.comb += retries.eq(valid & known & ~fits)
        count, moves = attribute_count(self._surface), (takes, leaves, retries)
        ends = [self._attribute(m, k, moves, (fits, odd), given) for k in range(count)]
        marks = self._marks(m, valid & ~known, takes, ends, given)
        m.d.comb += fits.eq(self._fits(marks, pixels))

        with m.If(takes):
            m.d.sync += [
                *(signal.eq(Value.cast(given[name])) for name, signal in tag.items()),
                *(signal.eq(given.length) for signal in (left, pixels)),
                x.eq(given.x),
                *(flag.eq(1) for flag in (valid, known, whole, uncut)),
            ]
        with m.Elif(leaves):
            m.d.sync += [
                valid.eq(~whole),
                known.eq(0),
                whole.eq(1),
                left.eq(rest),
                pixels.eq(rest),
                x.eq(Mux(tag["right"], x, x + pixels)),
            ]
        with m.Elif(retries):
            m.d.sync += [known.eq(0), whole.eq(0), uncut.eq(0), pixels.eq(shorter(pixels))]
        with m.Else():
            m.d.sync += known.eq(1)

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
            result.shift.eq(marks["shift"]),
            result.x.eq(Mux(turned, x + rest, x)),
            result.length.eq(pixels),
            result.turned.eq(turned),
            *(Value.cast(result[name]).eq(word) for name, word in tag.items() if name != "right"),
        ]
        count_events(m, self.status, cut=retries & uncut)
        return m

    @staticmethod
    def _attribute(m: Module, k: int, moves, kind, given) -> tuple[Signal, Signal, Signal]:
        """Registers of an attribute at both ends of the piece, and of its step."""
        (takes, leaves, retries), (fits, odd) = moves, kind
        near, far, last, step = (
            Signal(SPAN_STEP.width, name=f"{name}_{k}", reset_less=True)
            for name in ("near", "far", "last", "step")
        )
        signed_far, signed_near = far.as_signed(), near.as_signed()
        # After a piece the next pixel follows. After a try that does not fit, the end moves to one pixel
        # less, or to the mean of both ends.
        other = Mux(fits, step.as_signed(), Mux(odd, signed_near, ~step.as_signed()))
        total = Signal(SPAN_STEP.width + 1, name=f"total_{k}")
        m.d.comb += total.eq(signed_far + other + (~fits & ~odd))
        with m.If(takes):
            m.d.sync += [
                near.eq(Value.cast(given.near[k])),
                *(signal.eq(Value.cast(given.far[k])) for signal in (far, last)),
                step.eq(Value.cast(given.inward[k])),
            ]
        with m.Elif(leaves):
            m.d.sync += [near.eq(total), far.eq(last)]
        with m.Elif(retries):
            m.d.sync += far.eq(Mux(odd, total >> 1, total))
        return near, far, step

    @staticmethod
    def _marks(m: Module, again, takes, ends, given) -> dict:
        """Registers: the shift, the first bits of the sizes, whether signs are the same."""
        bits, places = SpanHalver.BITS, SpanHalver.LARGEST_SHIFT

        # Each stage is a signal, because an expression that is used twice would be built twice.
        def wire(value, name):
            signal = Signal(Value.cast(value).shape(), name=name)
            m.d.comb += signal.eq(value)
            return signal

        sizes, signs = [], []
        for k in range(_COMPONENTS):
            for end, (held, incoming) in enumerate(
                zip(ends[k][:2], (given.near[k], given.far[k]), strict=True)
            ):
                code = wire(Mux(again, held, Value.cast(incoming).as_unsigned()), f"end_{end}_{k}")
                sizes.append(wire(size_of(code), f"whole_size_{end}_{k}"))
                signs.append(code[-1])
        used = sizes[0][bits:]
        for size in sizes[1:]:
            used = used | size[bits:]
        used = wire(used, "used")
        shift = []
        for step in (4, 2, 1):
            empty = wire(~used[-step:].any(), f"empty_{step}")
            used = wire(Mux(empty, used << step, used)[:places], f"used_{step}")
            sizes = [
                wire(Mux(empty, size << step, size)[: places + bits], f"size_{step}_{k}")
                for k, size in enumerate(sizes)
            ]
            shift.insert(0, empty)
        marks = {
            "shift": Signal(len(shift), name="shift", reset_less=True),
            "sizes": [
                [Signal(bits, name=f"size_{end}_{k}", reset_less=True) for k in range(_COMPONENTS)]
                for end in range(2)
            ],
            "same": [Signal(name=f"same_{k}", reset_less=True) for k in range(_COMPONENTS)],
        }
        with m.If(again | takes):
            m.d.sync += marks["shift"].eq(Cat(shift))
            for k in range(_COMPONENTS):
                m.d.sync += [
                    marks["same"][k].eq(signs[2 * k] == signs[2 * k + 1]),
                    *(marks["sizes"][end][k].eq(sizes[2 * k + end][-bits:]) for end in range(2)),
                ]
        return marks

    def _fits(self, marks: dict, pixels: Value) -> Value:
        """Whether the piece needs no cut."""
        scale = 1 << SpanHalver.BITS
        axis, pair = int(SpanHalver.AXIS * scale), int(SpanHalver.PAIR * scale)
        first, last = marks["sizes"]
        same = marks["same"]
        long = 0
        for k, keeps in enumerate(same):
            long = long | (keeps & (first[k] >= axis) & (last[k] >= axis))
            j = (k + 1) % len(same)
            sums = [end[j] + end[k] >= pair for end in (first, last)]
            long = long | (keeps & same[j] & sums[0] & sums[1])
        large = [first[k][-1] | last[k][-1] for k in range(len(same))]
        steep = Cat(~keeps & size for keeps, size in zip(same, large, strict=True)).any()
        if self.model.rotates:
            steep = Cat(is_apart(*words) for words in zip(same, first, last, strict=True)).any()
        return is_kept(pixels, long, Cat(large).any(), steep)


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


def is_kept(pixels: Value, long: Value, large: Value, steep: Value) -> Value:
    """Whether a piece needs no cut.

    Parameters
    ----------
    pixels : Value
        Number of the piece's pixels.
    long : Value
        Whether a component, or a sum of two, stays long along the piece.
    large : Value
        Whether the first bit of a component is 1 at an end. If it is 1 nowhere, the largest shift is too
        small.
    steep : Value
        Whether a component's ends are too far apart for a piece of two pixels.
    """
    two, one = (~pixels[2:].any() & (pixels[:2] == number) for number in (2, 1))
    return one | ((long | ~large) & ~(two & steep))


def is_apart(keeps: Value, first: Value, last: Value) -> Value:
    """Whether a component's ends are too far apart for a span of two pixels, from the first bits of both."""
    most = int(SpanHalver.STEEP * (1 << SpanHalver.BITS))
    # The first bits of a negative code are the size's first bits minus 1, with the other sign.
    return Mux(keeps, (first - last > most) | (last - first > most), first + last >= most)
