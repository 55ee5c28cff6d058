"""Span attributes: N/W and depth at both ends of every span, and of every piece of a wide span."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH, SPAN_NORMAL, SPAN_STEP
from blysk.golden.geometry.triangles import ATTRIBUTES, MATERIAL_BITS, PIXEL_BITS
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.plane_assembler import plane_shape, planes_shape
from blysk.hdl.geometry.scanline_walk import AttributeRing, AttributeTurns, ScanlineWalk
from blysk.hdl.geometry.span_clip import clipped_rows_shape
from blysk.hdl.geometry.surface_words import attribute_count, placement_of
from blysk.hdl.geometry.triangles import count_events, counters_shape

__all__ = [
    "SpanAttributesUnit",
    "pieces_shape",
    "planes_rows_shape",
    "span_words_shape",
    "whole_span_shape",
    "whole_spans_shape",
]

_BITS = GradientSetup.FORMAT.width

_WORDS = ("start", "short", "long", "inward")


def planes_rows_shape(serial: bool = False, surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of a scanline with its triangle's planes, which are read at the triangle's first scanline.

    With ``serial`` the shape has the plane of one attribute, and a scanline comes once for each attribute.
    With texture coordinates a scanline has their base, range and level, too.
    """
    planes = plane_shape() if serial else planes_shape(attribute_count(surface))
    row = data.StructLayout(clipped_rows_shape().members | placement_of(surface))
    return data.StructLayout({"planes": planes, "row": row})


def span_words_shape() -> dict:
    """Members of a piece except its normals."""
    words = {name: unsigned(PIXEL_BITS) for name in ("x", "y", "length")}
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_last": FixedShape(SPAN_DEPTH)}
    rest = {"depth_step": FixedShape(DEPTH_STEP), "flip": unsigned(1), "material": unsigned(MATERIAL_BITS)}
    return words | depth | rest


def pieces_shape() -> data.StructLayout:
    """Shape of `Pieces.beats`: first pixel, length, N/W and depth at both ends, flip and material."""
    normal = data.ArrayLayout(FixedShape(SPAN_NORMAL), 3)
    return data.StructLayout({"left": normal, "right": normal} | span_words_shape())


def whole_spans_shape(surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of `WholeSpans.beats`: attributes at both ends and their step, first pixel, length, flags."""
    count = attribute_count(surface)
    words = {name: data.ArrayLayout(FixedShape(SPAN_STEP), count) for name in ("near", "far", "inward")}
    places = {name: unsigned(PIXEL_BITS) for name in ("x", "length")}
    return data.StructLayout(words | places | _tag_shape(surface).members)


def whole_span_shape(surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of one attribute of `whole_spans_shape`, with the other words of the span."""
    words = {name: FixedShape(SPAN_STEP) for name in ("near", "far", "inward")}
    return data.StructLayout({**whole_spans_shape(surface).members, **words})


class SpanAttributesUnit(wiring.Component):
    """Walks attributes down the long edge and along the spans. `SpanAttributes` is the bit-accurate model.

    A triangle takes a cycle, on which its planes are read before its first scanline is taken in. A scanline
    without pixels takes a cycle. Every piece of p pixels takes as many cycles as ``p - 1`` has
    bits, but at least one. If n pixels are cut off at the long edge, the scanline takes one more cycle for
    each bit of n. So a piece never takes more cycles than it has pixels. The fastest spans have one or two
    pixels in one piece, and no pixel cut off at the long edge. They are offered `latency` cycles, 3, after
    their scanline was taken in. The unit adds shifted steps, modulo 4, and has no multipliers.

    In the *serial* form one attribute after the other goes through the same adders. Its words go through
    rings of registers. A scanline comes four times, each time with another attribute's plane. A scanline
    without pixels takes four cycles. A scanline with pixels takes four cycles for every two bits of ``p - 1``
    and n. `latency` is 6, counted from the fourth time. A piece also waits until the piece before it has been
    taken.

    If ``whole`` is set, spans are not cut. They leave as the walk finds them, and `latency` is 2. In
    the serial form they leave attribute by attribute. The first attribute is offered `latency` cycles, 3,
    after its scanline came for the first time.

    Parameters
    ----------
    serial : bool
        Whether the attributes of a scanline come and are computed one after the other.
    whole : bool
        Whether the unit gives whole spans.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring. Only with ``whole``.

    Members
    -------
    i : :py:`In(stream.Signature(planes_rows_shape(serial, surface)))`
        Scanlines. The planes are read while the first scanline of a triangle is offered. This is the first of
        all scanlines, or the scanline after a scanline with ``last``. In the serial form every scanline comes
        with its planes.
    o : :py:`Out(stream.Signature(pieces_shape()))`
        Pieces, or whole spans in `whole_spans_shape` (if serial, in `whole_span_shape`).
    status : :py:`Out(counters_shape("empty", "cut"))`
        Number of triangles without a span, and number of spans of more than one piece, since the reset. With
        ``whole`` only the number of triangles.

    Attributes
    ----------
    idle : Signal
        High while no scanline is walked and no piece waits.
    reads, due : Signal
        Not in the serial form. On the cycle on which ``reads`` is high, the unit reads the planes of a
        triangle. From then on they may change. ``due`` is high while the next scanline's planes have not been
        read.

    Source: docs/theory/geometry.md#normals; [T] figure 4.10 (normals along the edges).
    """

    def __init__(self, serial: bool = False, whole: bool = False, surface: AttributeSpans | None = None):
        self.serial, self.whole, self.latency = serial, whole, (3 if whole else 6) if serial else 3 - whole
        self._surface = surface
        shape = (whole_span_shape if serial else whole_spans_shape)(surface) if whole else pieces_shape()
        super().__init__(
            {
                "i": In(stream.Signature(planes_rows_shape(serial, surface))),
                "o": Out(stream.Signature(shape)),
                "status": Out(counters_shape("empty") if whole else counters_shape("empty", "cut")),
            }
        )
        self.idle = Signal(name="idle")
        if not serial:
            self.reads, self.due = Signal(name="reads_planes"), Signal(name="due")

    def elaborate(self, platform):
        """The long edge's values, the walk along a scanline, and the pieces' words."""
        m = Module()
        row, planes = self.i.payload.row, self.i.payload.planes
        first, drawn = Signal(name="first", init=1), Signal(name="drawn")
        busy, accept, loads = (Signal(name=name) for name in ("busy", "accept", "loads"))
        flags = _tag_shape(self._surface)
        mask, tag = Signal(PIXEL_BITS, name="whole_piece"), Signal(flags, name="tag")
        attributes = attribute_count(self._surface)
        turns = AttributeTurns(m, self.i, busy, self.serial, not self.whole, attributes)
        m.d.comb += [accept.eq(turns.accepts), loads.eq(accept & row.covered)]
        if not self.serial:
            m.d.comb += [self.reads.eq(turns.reads), self.due.eq(turns.due)]
        with m.If(turns.goes & turns.loads):
            m.d.sync += copy_fields(tag, row, flags.members)

        # A whole span is a single piece, so it is the last piece.
        longest = Mux(first, _mask(planes.piece), mask) if self.serial else mask
        if self.whole:
            longest = mask = Const((1 << PIXEL_BITS) - 1)
        walk = ScanlineWalk(m, row, tag, longest, mask, loads, busy, turns)
        with m.If(turns.goes & turns.takes):
            m.d.sync += [first.eq(row.last), drawn.eq(row.covered | (drawn & ~first))]
            if self.serial and not self.whole:
                with m.If(first):
                    m.d.sync += [mask.eq(longest), walk.single.eq(planes.piece == 0)]
                    # The last step of a whole piece takes one bit or two.
                    m.d.sync += walk.double.eq(~planes.piece[0] & (planes.piece != 0))
        if not (self.serial or self.whole):
            with m.If(turns.reads):
                m.d.sync += [mask.eq(_mask(planes.piece)), walk.single.eq(planes.piece == 0)]
        count = 1 if self.serial else attributes
        walked = Signal(self._walked_shape(count), name="found")
        for k in range(count):
            plane = {name: planes[name] if self.serial else planes[name][k] for name in _WORDS}
            base, inward = self._down(m, k, accept, first, row.carry, plane, turns)
            begin = _code(plane["inward"]) if self.serial else inward
            near, far = walk.values(m, f"attribute_{k}", loads, base, begin, inward, not self.whole)
            with m.If(turns.advance):
                m.d.sync += [walked.near[k].eq(near), walked.far[k].eq(far), walked.step[k].eq(inward)]
        with m.If(turns.goes):
            m.d.sync += busy.eq((turns.loads) | (busy & ~turns.leaves))

        valid = Signal(name="found_valid")
        with m.If(turns.advance):
            m.d.sync += [
                valid.eq(walk.emits),
                walked.x.eq(walk.x),
                walked.length.eq(walk.pixels + 1),
                copy(walked.tag, tag),
                walked.ends.eq(turns.ends),
            ]
        self._give(m, turns, walk, valid, walked)
        m.d.comb += self.idle.eq(~(busy | valid | self.o.valid | turns.lane.any()))
        cuts = {} if self.whole else {"cut": walk.cuts}
        empty = turns.goes & turns.takes & row.last & ~row.covered & (first | ~drawn)
        count_events(m, self.status, empty=empty, **cuts)
        return m

    def _give(self, m: Module, turns, walk, valid: Signal, walked) -> None:
        """Give the pieces of the walk to the output, and drive whether the walk may advance."""
        if self.whole:
            m.d.comb += [
                self.o.valid.eq(valid),
                turns.advance.eq(~valid | self.o.ready),
                *self._whole(walked, self.o.payload),
            ]
            return
        result, result_valid = Signal(self.o.payload.shape(), name="result"), Signal(name="result_valid")
        if self.serial:
            # When the walk's words replace the result, the result must have been taken.
            m.d.comb += [self.o.valid.eq(result_valid), copy(self.o.payload, result)]
            stands = Mux(result_valid, ~self.o.ready, valid & walked.ends)
            m.d.comb += turns.advances.eq(Mux(turns.advance, ~(stands & walk.gives), self.o.ready))
            with m.If(self.o.ready):
                m.d.sync += result_valid.eq(0)
        else:
            m.d.comb += turns.advance.eq(skid_buffer(m, self.o, result_valid, result))
        with m.If(valid & ~result_valid if self.serial else turns.advance):
            m.d.sync += result_valid.eq(valid & walked.ends)
            self._convert(m, valid, walked, result)

    def _whole(self, walked, result) -> list:
        """A whole span from the walk's words, or one attribute of the span."""
        words = (("near", walked.near), ("far", walked.far), ("inward", walked.step))
        places = copy_fields(result, walked, ("x", "length"))
        tag = copy_fields(result, walked.tag, _tag_shape(self._surface).members)
        return [*(Value.cast(result[name]).eq(word) for name, word in words), *places, *tag]

    def _walked_shape(self, count: int) -> data.StructLayout:
        words = {name: data.ArrayLayout(unsigned(_BITS), count) for name in ("near", "far", "step")}
        places = {"x": unsigned(PIXEL_BITS), "length": unsigned(PIXEL_BITS)}
        return data.StructLayout(words | places | {"tag": _tag_shape(self._surface), "ends": unsigned(1)})

    @staticmethod
    def _down(m: Module, k: int, accept, first, carry, plane, turns) -> tuple[Value, Value]:
        """An attribute's value at the long edge's pixel, and its step along a scanline."""
        inward, edge = (AttributeRing(m, f"{name}_{k}", turns) for name in ("inward", "edge"))
        start = Cat(
            Const(0, GradientSetup.FORMAT.fraction_bits - GradientSetup.START_FORMAT.fraction_bits),
            Value.cast(plane["start"]),
        )
        if turns.reads is not None:
            short, long = (AttributeRing(m, f"{name}_{k}", turns) for name in ("short", "long"))
            with m.If(turns.reads):
                edge.becomes(m, start)
                for name, ring in (("short", short), ("long", long), ("inward", inward)):
                    ring.becomes(m, _code(plane[name]))
            with m.Elif(accept):
                edge.becomes(m, edge.value + Mux(carry, long.value, short.value))
            return edge.value, inward.value
        base = Mux(first, start, edge.value)
        with m.If(accept):
            edge.becomes(m, base + Mux(carry, _code(plane["long"]), _code(plane["short"])))
            inward.becomes(m, _code(plane["inward"]))
        return base, inward.value

    def _convert(self, m: Module, valid: Signal, walked, result) -> None:
        """The near and far end become left and right end.

        Components are cut, the depth becomes unsigned, and all values saturate.
        """
        right, components = walked.tag.right, ATTRIBUTES - 1
        for k in range(len(walked.near)):
            near, far = (
                FixedValue(GradientSetup.FORMAT, Value.cast(word[k]).as_signed())
                for word in (walked.near, walked.far)
            )
            left_end, right_end = (
                FixedValue(GradientSetup.FORMAT, Mux(right, Value.cast(a), Value.cast(b)).as_signed())
                for a, b in ((far, near), (near, far))
            )
            for name, depth, value in (("left", "depth", left_end), ("right", "depth_last", right_end)):
                cut = value.truncate(SPAN_NORMAL.fraction_bits).saturate(SPAN_NORMAL)
                if self.serial:
                    words = [Value.cast(word) for word in result[name]]
                    with m.If(valid & ~walked.ends):
                        m.d.sync += [
                            word.eq(other)
                            for word, other in zip(words, [*words[1:], Value.cast(cut)], strict=True)
                        ]
                elif k < components:
                    m.d.sync += result[name][k].eq(cut)
                if self.serial or k == components:
                    code = Value.cast(value.saturate(SQ(1, GradientSetup.FORMAT.fraction_bits)))
                    m.d.sync += Value.cast(result[depth]).eq(Cat(code[:-1], ~code[-1]))
        step = Value.cast(walked.step[-1])
        m.d.sync += [
            Value.cast(result.depth_step).eq(Mux(right, -step, step)[:_BITS]),
            *copy_fields(result, walked, ("x", "length")),
            *copy_fields(result, walked.tag, ("y", "flip", "material")),
        ]


def _tag_shape(surface: AttributeSpans | None) -> data.StructLayout:
    return data.StructLayout(
        {
            "y": unsigned(PIXEL_BITS),
            "right": unsigned(1),
            "flip": unsigned(1),
            "material": unsigned(MATERIAL_BITS),
            **placement_of(surface),
        }
    )


def _code(value) -> Value:
    return Value.cast(value).as_unsigned()


def _mask(piece: Value) -> Value:
    """Pixels of a whole piece, minus 1: ``2^piece - 1``."""
    return Cat(piece > k for k in range(PIXEL_BITS))
