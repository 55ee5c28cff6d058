"""Span attributes: N/W and depth at both ends of every span, and of every piece of a wide span."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, ValueLike, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH, SPAN_NORMAL, SPAN_STEP
from blysk.golden.geometry.triangles import ATTRIBUTES, MATERIAL_BITS, PIXEL_BITS
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.plane_assembler import plane_shape, planes_shape
from blysk.hdl.geometry.span_clip import clipped_rows_shape
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


def planes_rows_shape(serial: bool = False) -> data.StructLayout:
    """Shape of a scanline with its triangle's planes, which are read with the triangle's first scanline.

    With ``serial`` the shape has the plane of one attribute, and a scanline comes once for each attribute.
    """
    planes = plane_shape() if serial else planes_shape()
    return data.StructLayout({"planes": planes, "row": clipped_rows_shape()})


def span_words_shape() -> dict:
    """Members of a piece beside its normals."""
    words = {name: unsigned(PIXEL_BITS) for name in ("x", "y", "length")}
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_last": FixedShape(SPAN_DEPTH)}
    rest = {"depth_step": FixedShape(DEPTH_STEP), "flip": unsigned(1), "material": unsigned(MATERIAL_BITS)}
    return words | depth | rest


def pieces_shape() -> data.StructLayout:
    """Shape of `Pieces.beats`: first pixel, length, N/W and depth at both ends, flip and material."""
    normal = data.ArrayLayout(FixedShape(SPAN_NORMAL), 3)
    return data.StructLayout({"left": normal, "right": normal} | span_words_shape())


def whole_spans_shape() -> data.StructLayout:
    """Shape of `WholeSpans.beats`: attributes at both ends and their step, first pixel, length, flags."""
    words = {name: data.ArrayLayout(FixedShape(SPAN_STEP), ATTRIBUTES) for name in ("near", "far", "inward")}
    places = {name: unsigned(PIXEL_BITS) for name in ("x", "length")}
    return data.StructLayout(words | places | _tag_shape().members)


def whole_span_shape() -> data.StructLayout:
    """Shape of one attribute of `whole_spans_shape`, with the other words of the span."""
    words = {name: FixedShape(SPAN_STEP) for name in ("near", "far", "inward")}
    return data.StructLayout({**whole_spans_shape().members, **words})


class SpanAttributesUnit(wiring.Component):
    """Walks attributes down the long edge and along the spans. `SpanAttributes` is the bit-accurate model.

    A scanline without pixels takes a cycle. Other scanlines take, for every piece of p pixels, as many cycles
    as ``p - 1`` has bits, at least one. For n pixels cut off at the long edge they take as many cycles more
    as n has bits. So a piece never takes more cycles than it has pixels. A span of one or two pixels leaves
    soonest, if it is one piece and no pixel is cut off at the long edge. It is offered `latency` cycles, 3,
    after its scanline was taken in. The unit adds shifted steps, modulo 4, and has no multipliers.

    In the *serial* form one attribute after the other goes through the same adders, and its words through
    rings of registers. A scanline comes four times, each time with another attribute's plane. It takes four
    cycles without pixels, and else four cycles for every two bits of the numbers above. `latency` is 6,
    counted from the fourth time. A piece also waits until the piece before it has been taken.

    With ``whole`` spans are not cut. They leave as the walk finds them, a cycle earlier: `latency` is 2. In
    the serial form they leave attribute by attribute. The first attribute is offered `latency` cycles, 3,
    after its scanline came for the first time.

    Parameters
    ----------
    serial : bool
        Whether the attributes of a scanline come and are computed one after the other.
    whole : bool
        Whether the unit gives whole spans.

    Members
    -------
    i : :py:`In(stream.Signature(planes_rows_shape(serial)))`
        Scanlines. The planes are read with the first scanline of a triangle. This is the first of all
        scanlines, or the scanline after a scanline with ``last``.
    o : :py:`Out(stream.Signature(pieces_shape()))`
        Pieces. With ``whole`` spans, in `whole_spans_shape`, serial in `whole_span_shape`.
    status : :py:`Out(counters_shape("empty", "cut"))`
        Number of triangles without a span, and of spans of more than one piece, since the reset. With
        ``whole`` only the first.

    Attributes
    ----------
    idle : Signal
        No scanline is walked and no piece waits.

    Source: docs/theory/geometry.md#normals; [T] figure 4.10 (normals along the edges).
    """

    def __init__(self, serial: bool = False, whole: bool = False):
        self.serial, self.whole, self.latency = serial, whole, (3 if whole else 6) if serial else 3 - whole
        shape = (whole_span_shape() if serial else whole_spans_shape()) if whole else pieces_shape()
        super().__init__(
            {
                "i": In(stream.Signature(planes_rows_shape(serial))),
                "o": Out(stream.Signature(shape)),
                "status": Out(counters_shape("empty") if whole else counters_shape("empty", "cut")),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """The long edge's values; the walk along a scanline; the pieces' words."""
        m = Module()
        row, planes = self.i.payload.row, self.i.payload.planes
        first, drawn = Signal(name="first", init=1), Signal(name="drawn")
        busy, accept, loads = (Signal(name=name) for name in ("busy", "accept", "loads"))
        mask, tag = Signal(PIXEL_BITS, name="whole_piece"), Signal(_tag_shape(), name="tag")
        pace = _AttributeTurns(m, self.i, busy, self.serial, not self.whole)
        m.d.comb += [accept.eq(pace.accepts), loads.eq(accept & row.covered)]
        with m.If(pace.goes & pace.loads):
            m.d.sync += copy_fields(tag, row, ("y", "right", "flip", "material"))

        # A whole span is the last piece of its own.
        most = Mux(first, _mask(planes.piece), mask)
        if self.whole:
            most = mask = Const((1 << PIXEL_BITS) - 1)
        along = _ScanlineWalk(m, row, tag, most, mask, loads, busy, pace)
        with m.If(pace.goes & pace.takes):
            m.d.sync += [first.eq(row.last), drawn.eq(row.covered | (drawn & ~first))]
            if not self.whole:
                with m.If(first):
                    m.d.sync += [mask.eq(most), along.single.eq(planes.piece == 0)]
                    if self.serial:
                        # The last step of a whole piece takes one bit or two.
                        m.d.sync += along.double.eq(~planes.piece[0] & (planes.piece != 0))
        count = 1 if self.serial else ATTRIBUTES
        found = Signal(self._found_shape(count), name="found")
        for k in range(count):
            plane = {name: planes[name] if self.serial else planes[name][k] for name in _WORDS}
            base, inward = self._down(m, k, accept, first, row.carry, plane, pace)
            near, far = along.values(
                m, f"attribute_{k}", loads, base, Mux(first, _code(plane["inward"]), inward), inward
            )
            with m.If(pace.advance):
                m.d.sync += [found.near[k].eq(near), found.far[k].eq(far), found.step[k].eq(inward)]
        with m.If(pace.goes):
            m.d.sync += busy.eq((pace.loads) | (busy & ~pace.leaves))

        valid = Signal(name="found_valid")
        with m.If(pace.advance):
            m.d.sync += [
                valid.eq(along.emits),
                found.x.eq(along.x),
                found.length.eq(along.pixels + 1),
                copy(found.tag, tag),
                found.ends.eq(pace.ends),
            ]
        self._give(m, pace, along, valid, found)
        m.d.comb += self.idle.eq(~(busy | valid | self.o.valid | pace.lane.any()))
        cuts = {} if self.whole else {"cut": along.cuts}
        empty = pace.goes & pace.takes & row.last & ~row.covered & (first | ~drawn)
        count_events(m, self.status, empty=empty, **cuts)
        return m

    def _give(self, m: Module, pace, along, valid: Signal, found) -> None:
        """What was found, to the output; and whether the walk may advance."""
        if self.whole:
            m.d.comb += [
                self.o.valid.eq(valid),
                pace.advance.eq(~valid | self.o.ready),
                *self._whole(found, self.o.payload),
            ]
            return
        result, result_valid = Signal(self.o.payload.shape(), name="result"), Signal(name="result_valid")
        if self.serial:
            # The words that are found replace the result, which must have been taken by then.
            m.d.comb += [self.o.valid.eq(result_valid), copy(self.o.payload, result)]
            stands = Mux(result_valid, ~self.o.ready, valid & found.ends)
            m.d.comb += pace.advances.eq(Mux(pace.advance, ~(stands & along.gives), self.o.ready))
            with m.If(self.o.ready):
                m.d.sync += result_valid.eq(0)
        else:
            m.d.comb += pace.advance.eq(skid_buffer(m, self.o, result_valid, result))
        with m.If(valid & ~result_valid if self.serial else pace.advance):
            m.d.sync += result_valid.eq(valid & found.ends)
            self._convert(m, valid, found, result)

    @staticmethod
    def _whole(found, result) -> list:
        """A whole span of what was found, or an attribute of it."""
        words = (("near", found.near), ("far", found.far), ("inward", found.step))
        places = copy_fields(result, found, ("x", "length"))
        tag = copy_fields(result, found.tag, _tag_shape().members)
        return [*(Value.cast(result[name]).eq(word) for name, word in words), *places, *tag]

    @staticmethod
    def _found_shape(count: int) -> data.StructLayout:
        words = {name: data.ArrayLayout(unsigned(_BITS), count) for name in ("near", "far", "step")}
        places = {"x": unsigned(PIXEL_BITS), "length": unsigned(PIXEL_BITS)}
        return data.StructLayout(words | places | {"tag": _tag_shape(), "ends": unsigned(1)})

    @staticmethod
    def _down(m: Module, k: int, accept, first, carry, plane, pace) -> tuple[Value, Value]:
        """An attribute's value at the long edge's pixel, and its step along a scanline."""
        short, long, inward, edge = (
            _AttributeRing(m, f"{name}_{k}", pace) for name in ("short", "long", "inward", "edge")
        )
        steps = [
            Mux(first, _code(plane[name]), kept.value) for name, kept in (("short", short), ("long", long))
        ]
        start = Cat(
            Const(0, GradientSetup.FORMAT.fraction_bits - GradientSetup.START_FORMAT.fraction_bits),
            Value.cast(plane["start"]),
        )
        base = Mux(first, start, edge.value)
        with m.If(accept):
            edge.becomes(m, base + Mux(carry, steps[1], steps[0]))
            with m.If(first):
                for name, kept in (("short", short), ("long", long), ("inward", inward)):
                    kept.becomes(m, _code(plane[name]))
        return base, inward.value

    def _convert(self, m: Module, valid: Signal, found, result) -> None:
        """Left and right end from near and far end; components cut, depth made unsigned, all saturated."""
        right, components = found.tag.right, ATTRIBUTES - 1
        for k in range(len(found.near)):
            near, far = (
                FixedValue(GradientSetup.FORMAT, Value.cast(word[k]).as_signed())
                for word in (found.near, found.far)
            )
            left_end, right_end = (
                FixedValue(GradientSetup.FORMAT, Mux(right, Value.cast(a), Value.cast(b)).as_signed())
                for a, b in ((far, near), (near, far))
            )
            for name, depth, value in (("left", "depth", left_end), ("right", "depth_last", right_end)):
                cut = value.truncate(SPAN_NORMAL.fraction_bits).saturate(SPAN_NORMAL)
                if self.serial:
                    words = [Value.cast(word) for word in result[name]]
                    with m.If(valid & ~found.ends):
                        m.d.sync += [
                            word.eq(other)
                            for word, other in zip(words, [*words[1:], Value.cast(cut)], strict=True)
                        ]
                elif k < components:
                    m.d.sync += result[name][k].eq(cut)
                if self.serial or k == components:
                    code = Value.cast(value.saturate(SQ(1, GradientSetup.FORMAT.fraction_bits)))
                    m.d.sync += Value.cast(result[depth]).eq(Cat(code[:-1], ~code[-1]))
        step = Value.cast(found.step[-1])
        m.d.sync += [
            Value.cast(result.depth_step).eq(Mux(right, -step, step)[:_BITS]),
            *copy_fields(result, found, ("x", "length")),
            *copy_fields(result, found.tag, ("y", "flip", "material")),
        ]


class _AttributeTurns:
    """Control of the attributes' turns: all attributes on one cycle, or *serial* one a cycle, four in all.

    In the serial form the first attribute decides for all four whether a scanline comes in. The control of
    the walk moves on with the last attribute, `ends`. With ``ahead`` registers tell whether the walk
    advances.
    """

    def __init__(self, m: Module, rows: stream.Interface, busy: Signal, serial: bool, ahead: bool):
        self.serial, self.given = serial, rows.valid
        ahead &= serial
        self.advance, self.leaves = Signal(name="advance", init=ahead), Signal(name="would_leave")
        self.lane, self.ends, self.steps = Signal(2, name="lane"), Signal(name="ends"), Signal(name="steps")
        # ``accepts``: a scanline comes in, on a step of each attribute; ``goes``: the control moves on;
        # ``takes``: it takes a scanline; ``loads``: it takes one with pixels.
        self.accepts, self.goes, self.takes = (Signal(name=name) for name in ("accepts", "goes", "takes"))
        self.loads, covered = Signal(name="loads_walk"), rows.payload.row.covered
        opens = ~busy | self.leaves
        if not serial:
            moves = ~busy | self.advance
            m.d.comb += [self.ends.eq(1), self.steps.eq(1), rows.ready.eq(opens & moves)]
            m.d.comb += [self.accepts.eq(rows.valid & rows.ready), self.takes.eq(self.accepts)]
            m.d.comb += self.goes.eq(self.accepts | (busy & self.advance))
            m.d.comb += self.loads.eq(self.takes & covered)
            return
        first, taken, moves = self.lane == 0, Signal(name="taken"), Signal(name="moves", init=ahead)
        m.d.comb += [
            rows.ready.eq(Mux(first, opens, taken) & moves),
            self.accepts.eq(Mux(first, rows.valid & opens, taken)),
            self.steps.eq(moves & Mux(first, busy | self.accepts, ~taken | rows.valid)),
            self.ends.eq(self.lane == ATTRIBUTES - 1),
            self.goes.eq(self.ends & moves & (~taken | rows.valid)),
            self.takes.eq(taken),
            self.loads.eq(taken & (has_pixels := Signal(name="has_pixels"))),
        ]
        with m.If(rows.valid):
            m.d.sync += has_pixels.eq(covered)
        if ahead:
            # Whether the output lets the walk advance is known a cycle before.
            stays, advances = Signal(name="stays_busy"), Signal(name="advances")
            self.advances = advances
            m.d.comb += stays.eq(Mux(self.goes, self.loads | (busy & ~self.leaves), busy))
            m.d.sync += [self.advance.eq(advances), moves.eq(~stays | advances)]
        else:
            m.d.comb += moves.eq(~busy | self.advance)
        with m.If(self.steps):
            m.d.sync += [self.lane.eq(self.lane + 1), taken.eq(self.accepts)]

    def late(self, m: Module, value: ValueLike, name: str) -> Value:
        """*Serial*: the value on the step before, from a register; else the value itself."""
        if not self.serial:
            return Value.cast(value)
        register = Signal(len(Value.cast(value)), name=name)
        with m.If(self.steps):
            m.d.sync += register.eq(value)
        return register


class _AttributeRing:
    """A register of one attribute; *serial* a ring with a word of each attribute, moved on by every step.

    A *late* word is replaced one step later, on its way round the ring, by values from
    `_AttributeTurns.late`.
    """

    def __init__(self, m: Module, name: str, pace: _AttributeTurns, late: bool = False):
        self.value = self._next = Signal(_BITS, name=name)
        self._domain = "sync"
        if pace.serial:
            self._next, self._domain = Signal(_BITS, name=f"{name}_next"), "comb"
            stays = pace.late(m, self.value, f"{name}_stays") if late else self.value
            m.d.comb += self._next.eq(stays)
            ring = [self.value, *(Signal(_BITS, name=f"{name}_{k}") for k in range(1, ATTRIBUTES - late))]
            with m.If(pace.steps):
                m.d.sync += [
                    word.eq(other) for word, other in zip(ring, [*ring[1:], self._next], strict=True)
                ]

    def becomes(self, m: Module, value: ValueLike) -> None:
        """Replace the word; a word that is not replaced stays."""
        m.d[self._domain] += self._next.eq(value)


class _ScanlineWalk:
    """Control of the walk along a scanline: first pixels to skip, then pieces, one or two bits a step."""

    def __init__(self, m: Module, row, tag, most: Value, mask: Signal, loads: Signal, busy: Signal, pace):
        # ``left``: pixels of the span that are left, less one; ``bits``: bits of a number still to be walked.
        left, bits = Signal(PIXEL_BITS, name="left"), Signal(PIXEL_BITS, name="bits")
        self.pixels, begin = Signal(PIXEL_BITS, name="pixels"), Signal(PIXEL_BITS, name="begin")
        self.pace = pace
        self.emits, self.gives, self.cuts = (Signal(name=name) for name in ("emits", "gives", "cuts"))
        self.skipping, whole = Signal(name="skipping"), Signal(name="whole")
        self.moves, self.ends = (Signal(name=name) for name in ("moves", "ends"))
        radix = 2 if pace.serial else 1
        self.digit = Signal(radix, name="digit")
        self.single, self.double = Signal(name="single"), Signal(name="double") if pace.serial else Const(0)
        m.d.comb += [
            self.digit.eq(bits[:radix]),
            self.moves.eq(busy if pace.serial else busy & pace.advance),
            self.gives.eq(busy & self.ends & ~self.skipping),
            self.emits.eq(self.gives & pace.advance & pace.steps),
        ]
        # A whole piece that is not the last takes one pixel more than the mask: minus mask, minus 1.
        after = (left + ~mask)[:PIXEL_BITS]
        count = row.length - 1
        if pace.serial:
            # The scanline is there for three cycles before it is taken, and a step takes four cycles: the
            # numbers that follow from both are computed one a cycle, with registers between them.
            def kept(value, name):
                register = Signal.like(value, name=name)
                m.d.sync += register.eq(value)
                return register

            waiting, whole_piece = (Signal(PIXEL_BITS, name=name) for name in ("waiting", "waiting_mask"))
            skip_ends = Signal(name="skip_ends")
            with m.If(pace.given):
                m.d.sync += [waiting.eq(count), whole_piece.eq(most), skip_ends.eq(~row.skip[radix:].any())]
            pixels, more = _piece(waiting, whole_piece)
            count, mine = waiting, (kept(pixels, "waiting_pixels"), kept(more, "waiting_more"))
            after = kept(Mux(self.skipping, left, after), "after")
            pixels, more = _piece(after, mask)
            its = kept(pixels, "next_pixels"), kept(more, "next_more")
            mine_ends, its_ends = (kept(~words[0][radix:].any(), "ends") for words in (mine, its))
            shift_ends = kept(~bits[2 * radix :].any(), "shift_ends")
            with m.If(pace.goes):
                with m.If(pace.loads):
                    m.d.sync += [
                        self.ends.eq(Mux(row.skips, skip_ends, mine_ends)),
                        pace.leaves.eq(~row.skips & mine_ends & ~mine[1]),
                    ]
                with m.Else():
                    m.d.sync += [
                        self.ends.eq(Mux(self.ends, its_ends, shift_ends)),
                        pace.leaves.eq(
                            Mux(self.ends, its_ends & ~its[1], shift_ends & ~self.skipping & ~whole)
                        ),
                    ]
        else:
            mine = _piece(count[:PIXEL_BITS], most)
            its = _piece(Mux(self.skipping, left, after), mask)
            m.d.comb += [
                self.ends.eq(~bits[radix:].any()),
                pace.leaves.eq(self.ends & ~self.skipping & ~whole),
            ]
        first = Signal(name="first_piece")
        m.d.comb += self.cuts.eq(pace.goes & busy & self.ends & ~self.skipping & whole & first)
        with m.If(pace.goes):
            with m.If(pace.loads):
                m.d.sync += [
                    left.eq(count),
                    self.skipping.eq(row.skips),
                    bits.eq(Mux(row.skips, row.skip, mine[0])),
                    self.pixels.eq(mine[0]),
                    whole.eq(mine[1]),
                    first.eq(1),
                ]
            with m.Elif(~self.ends):
                m.d.sync += bits.eq(bits >> radix)
            with m.Else():
                m.d.sync += [bits.eq(its[0]), self.pixels.eq(its[0]), whole.eq(its[1]), self.skipping.eq(0)]
                with m.If(~self.skipping):
                    m.d.sync += [left.eq(after), first.eq(0)]
        slides = self.gives & ~tag.right
        if pace.serial:
            slides = kept(slides, "slides")
        with m.If(pace.goes & (pace.loads | slides)):
            m.d.sync += begin.eq(Mux(pace.loads, row.x, begin + self.pixels + 1))
        self.x = Mux(tag.right, begin + left - self.pixels, begin)[:PIXEL_BITS]

    def values(self, m: Module, name: str, loads, base, inward, kept) -> tuple[Value, Value]:
        """Values of an attribute at the piece's ends; its step is ``inward`` on loading, ``kept`` later."""
        # Chosen behind registers: the sums take a whole cycle.
        nears, totals = (
            _AttributeRing(m, f"{name}_{word}", self.pace, late=True) for word in ("near", "total")
        )
        steps = _AttributeRing(m, f"{name}_step", self.pace)
        near, total, step = nears.value, totals.value, steps.value
        far = (total + sum(Mux(bit, step << k, 0) for k, bit in enumerate(self.digit)))[:_BITS]
        whole = Mux(self.single, step, Mux(self.double, step << 2, step << 1))
        following = (near + whole)[:_BITS]
        with m.If(loads):
            steps.becomes(m, inward)
        with m.Elif(self.moves):
            steps.becomes(m, Mux(self.ends, kept, step << len(self.digit)))
        given = (loads, self.moves, self.ends, self.skipping, base, far, following)
        names = ("loads", "moves", "ends", "skipping", "base", "far", "following")
        loaded, moved, ended, skipped, base, end, following = (
            self.pace.late(m, value, f"{name}_late_{word}") for word, value in zip(names, given, strict=True)
        )
        with m.If(loaded):
            for word in (nears, totals):
                word.becomes(m, base)
        with m.Elif(moved):
            with m.If(~ended):
                totals.becomes(m, end)
            with m.Else():
                for word in (nears, totals):
                    word.becomes(m, Mux(skipped, end, following))
        return near, far


def _tag_shape() -> data.StructLayout:
    return data.StructLayout(
        {
            "y": unsigned(PIXEL_BITS),
            "right": unsigned(1),
            "flip": unsigned(1),
            "material": unsigned(MATERIAL_BITS),
        }
    )


def _code(value) -> Value:
    return Value.cast(value).as_unsigned()


def _mask(piece: Value) -> Value:
    """Pixels of a whole piece, less one: ``2^piece - 1``."""
    return Cat(piece > k for k in range(PIXEL_BITS))


def _piece(left: Value, mask: Value) -> tuple[Value, Value]:
    """Pixels of the next piece, less one, and whether another piece follows it."""
    more = (left & ~mask).any()
    return Mux(more, mask, left), more
