"""Adaptive normaliser: bisection, choice of the number of levels, linear interpolators ([T] figure 2.7)."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.number.fixed import SQ
from blysk.golden.number.reciprocal import RECIPROCAL_FORMAT
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.multiplier import SteppedMultiplier
from blysk.hdl.core.reciprocal import reciprocal_codes
from blysk.hdl.core.shapes import normal_shape, span_normals_shape
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.normals.bisection import BisectionUnit

__all__ = ["AdaptiveNormaliserUnit"]

SEGMENT_CYCLES = 14
"""Cycles that the preparation of a segment takes. Then the next segment is prepared."""


class AdaptiveNormaliserUnit(wiring.Component):
    """Normals of a span, on straight lines over ``2^k`` arcs. k is as small as the threshold allows.

    `AdaptiveNormaliser`, the bit-accurate model, has formats, choice of k and error bounds.

    Three parts work at the same time, each on another span.

    1. The first part bisects, level by level (`BisectionUnit`), and counts the levels.
    2. The second part computes start, step and length of every segment, and puts them into a FIFO. A segment
       takes 14 cycles, or 3 cycles without a pixel.
    3. The last part gives a normal in every cycle, from a span's first to its last, unless the output waits.
       It begins a span when the FIFO has all segments of the span.

    `preparation` is the number of cycles from a span to its first normal, if all parts are free. It is 63 for
    k = 0, 77 for k = 1, 142 for k = 2. Spans with at most `interval` pixels follow each other in `interval`
    cycles. These are 33 for k = 0, 42 for k = 1, 70 for k = 2. For a span of one or two pixels k is 0. For a
    span of three pixels k is at most 1. A span of length 0 takes one cycle and gives nothing.

    The unit has three multipliers: two in the bisection unit, and one for the square of q and for the
    segments. A memory of ``2^(depth + 2)`` words of 54 bits holds the segment ends of two spans. A FIFO of
    ``2^(depth + 1)`` words holds the segments. A table of 2048 words of 17 bits holds the reciprocals.

    Parameters
    ----------
    model : AdaptiveNormaliser
        Bit-accurate model, with threshold and factor.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Unit normals, three components ``SQ(1, 17)`` each, and the number of pixels.
    o : :py:`Out(stream.Signature(StructLayout({"normal", "out_of_range": 1, "last": 1})))`
        Normals, three components ``SQ(1, 17)``. ``out_of_range``: the span is wider than the bisection's
        ``max_angle``. ``last``: the normal is the last of its span.

    Source: docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7.
    """

    def __init__(self, model: AdaptiveNormaliser | None = None):
        self.model = model or AdaptiveNormaliser()
        self._bisection = BisectionUnit(self.model.bisection)
        super().__init__(
            {
                "i": In(stream.Signature(span_normals_shape(AdaptiveNormaliser.LENGTH_BITS))),
                "o": Out(
                    stream.Signature(
                        data.StructLayout(
                            {"normal": normal_shape(), "out_of_range": unsigned(1), "last": unsigned(1)}
                        )
                    )
                ),
            }
        )

    def preparation(self, levels: int) -> int:
        """Cycles from a span to its first normal, if the span has at least ``2^levels + 1`` pixels.

        A span of one pixel takes 50 cycles. Its single segment takes one cycle more through the FIFO than
        the segments of longer spans.
        """
        return self.counting(levels) + 2 + SEGMENT_CYCLES * ((1 << levels) + 1)

    def interval(self, levels: int) -> int:
        """Cycles from a span to the next, if both spans have ``levels`` levels and ``2^levels + 1`` pixels.

        The slower of the first two parts decides. Between spans of different levels the first part may wait
        up to 6 cycles for the multiplier.
        """
        return max(self.counting(levels), SEGMENT_CYCLES * ((1 << levels) + 1))

    def counting(self, levels: int) -> int:
        """Cycles of a span in the first part, which counts its levels."""
        latency, interval = self._bisection.latency, self._bisection.initiation_interval
        bisected = sum(latency + 4 + interval * ((1 << level) - 1) for level in range(1, levels))
        return latency + 6 + bisected

    def elaborate(self, platform):
        """The three parts, which make levels, segments and normals, and the FIFO of segments."""
        p = self.model
        m = Module()
        segment_shape = data.StructLayout(
            {
                "start": data.ArrayLayout(FixedShape(p.ACCUMULATOR_FORMAT), 3),
                "step": data.ArrayLayout(FixedShape(p.STEP_FORMAT), 3),
                "count": unsigned(p.LENGTH_BITS),
                "last": unsigned(1),
                "out_of_range": unsigned(1),
            }
        )
        depth = 1 << (p.depth + 1)
        m.submodules.segments = fifo = SyncFIFOBuffered(width=segment_shape.as_shape().width, depth=depth)
        begun = Signal(name="begun")
        r, s = _Levels(p, self.i.payload.shape()), _Segments(p)
        ready_spans = Signal(range(depth + 1))
        m.d.sync += ready_spans.eq(ready_spans + s.through - begun)
        m.submodules.ends = ends = Memory(shape=normal_shape(), depth=4 << p.depth, init=[])
        multiplier = SteppedMultiplier(m, s.step)
        # The segments are described first, and reserve their steps of the multiplier. Levels use the free
        # steps.
        self._divide(m, r, s, ends, multiplier, fifo, segment_shape)
        self._count(m, r, s, ends, multiplier)
        self._back(m, fifo, segment_shape, ready_spans, begun)
        return m

    def _count(self, m, r, s, ends, multiplier):
        """Bisect, count the levels, and pass the span on."""
        read, write = ends.read_port(), ends.write_port()
        address = Signal(self.model.depth + 1, name="write_address")
        m.d.comb += write.addr.eq(Cat(address, r.bank))
        self._reciprocal(m, r)
        m.submodules.bisection = self._bisection
        self._store_ends(m, r, address, write)
        with m.FSM():
            with m.State("idle"):
                self._begin(m, r)
            with m.State("store left"):
                m.d.comb += write.en.eq(1)
                m.next = "store right"
            with m.State("store right"):
                m.d.comb += [write.en.eq(1), r.right_end.eq(1)]
                m.next = "drain"
            with m.State("bisect"):
                self._bisect(m, r, read)
            with m.State("drain"), m.If(r.level_done):
                self._next_level(m, r, s)
            with m.State("error"):
                self._count_levels(m, r, s, multiplier)
            with m.State("counted"):
                self._hand_on(m, r, s)

    def _reciprocal(self, m, r: "_Levels") -> None:
        """Find the reciprocal of m - 1 and its shift for the length m, before the first bisection ends."""
        bits = self.model.LENGTH_BITS
        position = Signal(range(bits))
        below_top = Signal(range(bits))
        m.d.sync += [
            r.steps.eq(Mux(r.span.length <= 1, 1, r.span.length - 1)),
            position.eq(0),
            below_top.eq(bits - 1),
        ]
        for bit in range(bits):
            with m.If(r.steps[bit]):
                m.d.sync += [position.eq(bit), below_top.eq(bits - 1 - bit)]
        address = Signal(bits - 1)
        m.d.sync += address.eq((r.steps << below_top)[: bits - 1])
        m.submodules.reciprocals = table = Memory(
            shape=RECIPROCAL_FORMAT.width, depth=1 << (bits - 1), init=reciprocal_codes(bits)
        )
        table_port = table.read_port()
        m.d.comb += table_port.addr.eq(address)
        m.d.sync += [
            r.reciprocal.eq(FixedValue(RECIPROCAL_FORMAT, table_port.data)),
            r.shift.eq(position + address.any()),
        ]

    def _store_ends(self, m, r: "_Levels", address, write) -> None:
        """Write ends of segments into their memory: first the span's ends, then the bisection's results."""
        whole, bisection = 1 << self.model.depth, self._bisection
        m.d.comb += [
            bisection.o.ready.eq(1),
            r.next_index.eq(r.index + (r.half << 1)),
        ]
        with m.If(bisection.o.valid):
            m.d.comb += [
                address.eq(r.write_index),
                copy(write.data, bisection.o.payload.normal_middle),
                write.en.eq(1),
                r.level_done.eq(r.write_index + r.half == whole),
            ]
            m.d.sync += r.write_index.eq(r.write_index + (r.half << 1))
        with m.Else():
            left, right = (Value.cast(end) for end in (r.span.normal_left, r.span.normal_right))
            m.d.comb += [
                address.eq(Mux(r.right_end, whole, 0)),
                write.data.eq(Mux(r.right_end, right, left)),
            ]

    def _begin(self, m, r: "_Levels") -> None:
        """Take a span, and give its ends to the bisection on the same cycle."""
        whole, bisection = 1 << self.model.depth, self._bisection
        m.d.comb += [
            self.i.ready.eq(bisection.i.ready),
            copy(bisection.i.payload.normal_a, self.i.payload.normal_left),
            copy(bisection.i.payload.normal_b, self.i.payload.normal_right),
            bisection.i.valid.eq(self.i.valid & (self.i.payload.length != 0)),
        ]
        m.d.sync += [
            copy(r.span, self.i.payload),
            r.half.eq(whole >> 1),
            r.write_index.eq(whole >> 1),
            r.level.eq(1),
        ]
        with m.If(bisection.i.valid & bisection.i.ready):
            m.next = "store left"

    def _bisect(self, m, r: "_Levels", read) -> None:
        """Send all pairs of neighbouring ends of a level into the bisection, from the second level on."""
        bisection, bits = self._bisection, self.model.depth + 1
        m.d.comb += [
            read.addr.eq(Cat(Mux(r.step == 0, r.index, r.next_index)[:bits], r.bank)),
            copy(bisection.i.payload.normal_a, r.end_a),
            copy(bisection.i.payload.normal_b, r.end_b),
        ]
        with m.If(r.step != 3):
            m.d.sync += r.step.eq(r.step + 1)
        with m.If(r.step == 1):
            m.d.sync += copy(r.end_a, read.data)
        with m.If(r.step == 2):
            m.d.sync += copy(r.end_b, read.data)
        with m.If(r.step == 3):
            m.d.comb += bisection.i.valid.eq(1)
            with m.If(bisection.i.ready):
                m.d.sync += [r.step.eq(0), r.index.eq(r.next_index)]
                with m.If(r.next_index == 1 << self.model.depth):
                    m.next = "drain"

    def _next_level(self, m, r: "_Levels", s: "_Segments") -> None:
        """When the results of a level are stored, begin the next level, or end the bisection of the span."""
        result = self._bisection.o.payload
        m.d.sync += [
            r.half.eq(r.half >> 1),
            r.write_index.eq(r.half >> 1),
            r.index.eq(0),
            r.level.eq(r.level + 1),
            r.step.eq(0),
        ]
        with m.If(r.level == 1):
            m.d.sync += [
                r.one_minus_cosine.eq(result.one_minus_cosine),
                r.out_of_range.eq(result.out_of_range),
            ]
            m.next = "error"
        with m.Elif(r.level == r.levels):
            self._hand_on(m, r, s)
        with m.Else():
            m.next = "bisect"

    def _count_levels(self, m, r: "_Levels", s: "_Segments", multiplier: SteppedMultiplier) -> None:
        """Number of levels, from ``q + q^2`` and its limits. q is a quarter of ``one_minus_cosine``."""
        p = self.model
        with m.If(r.step != 0):
            m.d.sync += r.step.eq(r.step + 1)
        with m.Elif(multiplier.free):
            operand = r.one_minus_cosine.saturate(COMPONENT)
            multiplier.load(operand, operand)
            m.d.sync += r.step.eq(1)
        sagitta = Signal(FixedShape(p.SAGITTA_FORMAT))
        quarter = r.one_minus_cosine.scale(-2).extend(SQ(1, 20))
        square = multiplier.product.scale(-4).truncate(20)
        m.d.sync += sagitta.eq((quarter + square).saturate(p.SAGITTA_FORMAT))
        with m.If(r.step == 3):
            m.d.sync += r.levels.eq(0)
            for k, code in enumerate(p.limits.codes.tolist()):
                # A span of one or two pixels needs no level. A span of three pixels needs the first at most.
                with m.If((sagitta.as_value() > code) & ~r.out_of_range & (r.steps > min(k + 1, 2))):
                    m.d.sync += r.levels.eq(k + 1)
        with m.If(r.step == 4):
            m.d.sync += r.step.eq(0)
            with m.If(r.levels > 1):
                m.next = "bisect"
            with m.Else():
                self._hand_on(m, r, s)

    @staticmethod
    def _hand_on(m, r: "_Levels", s: "_Segments") -> None:
        """A span whose ends are stored goes on to its segments as soon as the span before is finished."""
        m.d.comb += r.counted.eq(1)
        m.next = "counted"
        with m.If(s.free):
            m.next = "idle"

    def _divide(self, m, r, s, ends, multiplier, fifo, segment_shape):
        """Put the segments of a span into the FIFO, one after the other."""
        read = ends.read_port()
        m.d.comb += s.free.eq(~s.busy | s.through)
        with m.If(s.busy):
            m.d.sync += s.step.eq(s.step + 1)
        self._prepare_segment(m, s, multiplier)
        self._end_segment(m, s, read, fifo)
        self._hand_over(m, s, fifo, segment_shape)
        with m.If(r.counted & s.free):
            m.d.sync += [
                s.busy.eq(1),
                s.index.eq(0),
                s.offset.eq(0),
                s.bank.eq(r.bank),
                s.steps.eq(r.steps),
                s.reciprocal.eq(r.reciprocal),
                s.shift.eq(r.shift),
                s.levels.eq(r.levels),
                s.spacing.eq((1 << self.model.depth) >> r.levels),
                s.amount.eq(Mux(r.shift > r.levels, r.shift - 1 - r.levels, 0)),
                copy(s.left, r.span.normal_left),
                s.remaining.eq(r.span.length),
                s.out_of_range.eq(r.out_of_range),
                r.bank.eq(~r.bank),
            ]

    def _prepare_segment(self, m, s: "_Segments", multiplier: SteppedMultiplier) -> None:
        """Pixels, start and step of a segment."""
        p, product = self.model, multiplier.product
        multiplier.issue(2, FixedValue(COMPONENT, Cat(s.offset, Const(0, 18 - len(s.offset)))), s.reciprocal)
        whole_pixels = s.available >> s.levels
        # 2^levels - 1 is added, so that the shift rounds up.
        m.d.sync += [
            s.available.eq(s.steps - s.offset + (((1 << s.levels) - 1)[: p.depth + 1])),
            s.count.eq(Mux(whole_pixels < s.remaining, whole_pixels, s.remaining)),
            s.last.eq(whole_pixels >= s.remaining),
            s.advance.eq(s.count << s.levels),
            s.next_offset.eq(s.offset + s.advance - s.steps),
        ]
        with m.If(s.step == 4):
            m.d.sync += s.phi.as_value().eq(Cat(Const(0, 1), Value.cast(product)) >> s.shift)
        half_step = FixedValue.constant(p.ACCUMULATOR_FORMAT, p.half_step.values.item())
        for c in range(3):
            with m.If(s.step == 2):
                m.d.sync += s.difference[c].eq((s.right[c] - s.left[c]).saturate(COMPONENT))
            multiplier.issue(5 + c, s.difference[c], s.phi)
            multiplier.issue(8 + c, s.difference[c], s.reciprocal)
            with m.If(s.step == 7 + c):
                total = s.left[c] + product.truncate(32) + half_step
                m.d.sync += s.start[c].eq(total.wrap(p.ACCUMULATOR_FORMAT))
            with m.If(s.step == 10 + c):
                shifted = FixedValue(SQ(2, 34), Value.cast(product) >> s.amount)
                m.d.sync += s.slope[c].eq(shifted.truncate(32).wrap(p.STEP_FORMAT))

    def _end_segment(self, m, s: "_Segments", read, fifo) -> None:
        """Take the right end of a segment.

        Put the segment into the FIFO if it has a pixel. Go on to the next segment.
        """
        whole = 1 << self.model.depth
        following = Signal(self.model.depth + 2)
        m.d.comb += [
            following.eq(s.index + s.spacing),
            read.addr.eq(Cat(Mux(s.index == whole, s.index, following)[: len(s.index)], s.bank)),
        ]
        with m.If(s.step == 1):
            m.d.sync += copy(s.right, read.data)
        moved = [copy(s.left, s.right), s.index.eq(following), s.step.eq(0)]
        with m.If((s.step == 2) & (s.offset >= s.steps)):
            # No pixel lies in this segment.
            m.d.sync += [s.offset.eq(s.offset - s.steps), *moved]
        with m.If(s.step == SEGMENT_CYCLES - 1):
            m.d.sync += s.step.eq(s.step)
            m.d.comb += fifo.w_en.eq(1)
            with m.If(fifo.w_rdy):
                m.d.sync += [s.remaining.eq(s.remaining - s.count), s.offset.eq(s.next_offset), *moved]
                with m.If(s.last):
                    m.d.comb += s.through.eq(1)
                    m.d.sync += s.busy.eq(0)

    @staticmethod
    def _hand_over(m, s: "_Segments", fifo, segment_shape) -> None:
        """Drive the fields of a segment at the input of the FIFO."""
        segment = Signal(segment_shape)
        m.d.comb += [
            segment.count.eq(s.count),
            segment.last.eq(s.last),
            segment.out_of_range.eq(s.out_of_range),
            *copy_fields(segment.start, s.start, range(3)),
            *copy_fields(segment.step, s.slope, range(3)),
            fifo.w_data.eq(segment.as_value()),
        ]

    def _back(self, m, fifo, segment_shape, ready_spans, begun):
        """Interpolate, with an accumulating adder for each component."""
        p = self.model
        segment = data.View(segment_shape, fifo.r_data)
        inside, out_of_range = Signal(name="inside"), Signal(name="span_out_of_range")
        valid = Signal(name="pixel_valid")
        advance, load = Signal(name="back_advance"), Signal(name="load")
        may_take = fifo.r_rdy & (inside | (ready_spans != 0))
        active, ends = count_down(m, may_take, segment.count, advance)
        pixel = Signal(self.o.payload.shape())
        last, wide = Signal(name="pixel_last"), Signal(name="pixel_out_of_range")
        m.d.comb += [
            pixel.last.eq(last),
            pixel.out_of_range.eq(wide),
            advance.eq(skid_buffer(m, self.o, valid, pixel)),
            load.eq(advance & ends & may_take),
            begun.eq(load & ~inside),
            fifo.r_en.eq(load),
        ]
        with m.If(advance):
            m.d.sync += [
                valid.eq(active),
                wide.eq(out_of_range),
                last.eq(active & ends & ~inside),
            ]
        with m.If(load):
            m.d.sync += [inside.eq(~segment.last), out_of_range.eq(segment.out_of_range)]
        for c in range(3):
            normal = Signal(FixedShape(p.ACCUMULATOR_FORMAT), name=f"normal_{c}")
            slope = Signal(FixedShape(p.STEP_FORMAT), name=f"step_{c}")
            with m.If(load):
                m.d.sync += [normal.eq(segment.start[c]), slope.eq(segment.step[c])]
            with m.Elif(advance):
                m.d.sync += normal.eq((normal + slope).wrap(p.ACCUMULATOR_FORMAT))
            result = Signal(FixedShape(COMPONENT), name=f"pixel_{c}")
            with m.If(advance):
                m.d.sync += result.eq(normal.truncate(COMPONENT.fraction_bits).saturate(COMPONENT))
            m.d.comb += pixel.normal[c].eq(result)


class _Levels:
    """Registers and wires of the part that counts a span's levels."""

    def __init__(self, model: AdaptiveNormaliser, span_shape: data.StructLayout):
        p, bits, depth = model, model.LENGTH_BITS, model.depth
        self.span = Signal(span_shape)
        self.step = Signal(3)
        # Half of the memory of ends, in which the span's ends are.
        self.bank = Signal()
        # Words of the reciprocal of m - 1.
        self.steps = Signal(bits)
        self.reciprocal = Signal(FixedShape(COMPONENT))
        self.shift = Signal(range(bits + 1))
        # Words of the bisection. ``half`` is the distance of a middle from its two ends.
        self.half = Signal(depth + 1)
        self.index = Signal(depth + 1)
        self.write_index = Signal(depth + 1)
        self.next_index = Signal(depth + 2)
        self.level = Signal(range(depth + 2))
        self.levels = Signal(range(depth + 1))
        self.out_of_range = Signal()
        self.one_minus_cosine = Signal(FixedShape(p.bisection.ANGLE_FORMAT))
        self.end_a = Signal(normal_shape())
        self.end_b = Signal(normal_shape())
        self.right_end = Signal()
        self.level_done = Signal()
        self.counted = Signal()


class _Segments:
    """Registers and wires of the part that prepares segments. Some are copies from the first part."""

    def __init__(self, model: AdaptiveNormaliser):
        p, bits, depth = model, model.LENGTH_BITS, model.depth
        component = FixedShape(COMPONENT)
        self.busy = Signal()
        # The last segment leaves on this cycle, and the next span may come.
        self.through = Signal()
        self.free = Signal()
        self.step = Signal(range(SEGMENT_CYCLES), name="segment_step")
        self.bank = Signal(name="segment_bank")
        self.steps = Signal(bits, name="segment_steps")
        self.reciprocal = Signal(component, name="segment_reciprocal")
        self.shift = Signal(range(bits + 1), name="segment_shift")
        self.levels = Signal(range(depth + 1), name="segment_levels")
        self.out_of_range = Signal(name="segment_out_of_range")
        self.index = Signal(depth + 1, name="segment_index")
        # ``offset`` is ``phi (m - 1)`` of the segment's first pixel. phi is its position in the segment.
        self.left = Signal(normal_shape())
        self.right = Signal(normal_shape())
        self.difference = [Signal(component, name=f"difference_{c}") for c in range(3)]
        self.spacing = Signal(depth + 1)
        self.remaining = Signal(bits)
        self.offset = Signal(bits + 1)
        self.available = Signal(bits + 2)
        self.count = Signal(bits + 1)
        self.advance = Signal(2 * bits)
        self.next_offset = Signal(bits + 1)
        self.last = Signal()
        self.phi = Signal(component)
        self.amount = Signal(range(bits + 1))
        self.start = [Signal(FixedShape(p.ACCUMULATOR_FORMAT), name=f"start_{c}") for c in range(3)]
        self.slope = [Signal(FixedShape(p.STEP_FORMAT), name=f"slope_{c}") for c in range(3)]
