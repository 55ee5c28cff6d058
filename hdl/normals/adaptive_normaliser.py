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
from blysk.hdl.normals.bisection import BisectionUnit

__all__ = ["AdaptiveNormaliserUnit"]

SEGMENT_CYCLES = 14
"""Cycles from the preparation of a segment to that of the next."""


class AdaptiveNormaliserUnit(wiring.Component):
    """Normals of a span, by straight lines over ``2^k`` arcs, k as small as the threshold allows.

    `AdaptiveNormaliser`, the bit-accurate model, has formats, choice of k and error bounds.

    Two halves work at once. The front prepares a span: it bisects, level by level (`BisectionUnit`), then
    computes start, step and length of every segment, one in 14 cycles (3 for a segment without a pixel), and
    puts them into a FIFO. The back gives a normal in every cycle, from a span's first to its last, unless the
    output waits; it begins a span when the FIFO has all of its segments. `preparation` is the number of
    cycles from a span to its first normal, if the back is free by then: 69 for k = 0, 83 for k = 1, 148 for
    k = 2. The next span is taken in two cycles before that, so spans with that many pixels follow each other
    without a gap. A span of length 0 takes one cycle and gives nothing.

    Three multipliers: two in the bisection unit, and one for the square of q and for the segments. A memory
    of ``2^(depth + 1)`` words of 54 bits holds the segment ends, a FIFO of as many the segments, and a table
    of 2048 words of 17 bits the reciprocals.

    Parameters
    ----------
    parameters : AdaptiveNormaliser
        Bit-accurate model, which knows threshold and factor.

    Members
    -------
    i : :py:`In(stream.Signature(span_normals_shape()))`
        Unit normals, three components ``SQ(1, 17)`` each; pixels.
    o : :py:`Out(stream.Signature(StructLayout({"normal", "out_of_range": 1, "last": 1})))`
        Normals, three components ``SQ(1, 17)``; ``out_of_range``: of a span wider than the bisection's
        ``max_angle``; ``last``: the last of its span.

    Source: docs/theory/interpolation.md#adaptive-normaliser; [T] 2.1, figure 2.7.
    """

    def __init__(self, parameters: AdaptiveNormaliser | None = None):
        self.parameters = parameters or AdaptiveNormaliser()
        self._bisection = BisectionUnit(self.parameters.bisection)
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
        """Cycles from a span to its first normal, if it has at least ``2^levels + 1`` pixels.

        A span of one pixel has a single segment, which takes one cycle more through the FIFO: 56.
        """
        latency, interval = self._bisection.latency, self._bisection.initiation_interval
        further = sum(latency + 4 + interval * ((1 << level) - 1) for level in range(1, levels))
        return latency + 14 + further + SEGMENT_CYCLES * ((1 << levels) + 1)

    def elaborate(self, platform):
        """Front, FIFO, back."""
        p = self.parameters
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
        complete, begun = Signal(name="complete"), Signal(name="begun")
        ready_spans = Signal(range(depth + 1))
        m.d.sync += ready_spans.eq(ready_spans + complete - begun)
        self._front(m, fifo, segment_shape, complete)
        self._back(m, fifo, segment_shape, ready_spans, begun)
        return m

    def _front(self, m, fifo, segment_shape, complete):
        """Bisect, count the levels, prepare the segments."""
        p = self.parameters
        whole = 1 << p.depth
        r = _Front(p, self.i.payload.shape())
        m.submodules.ends = ends = Memory(shape=normal_shape(), depth=2 * whole, init=[])
        read, write = ends.read_port(), ends.write_port()
        self._reciprocal(m, r)
        multiplier = SteppedMultiplier(m, r.step)
        m.submodules.bisection = self._bisection
        self._store_ends(m, r, write)
        self._hand_over(m, r, fifo, segment_shape)
        with m.FSM():
            with m.State("idle"):
                m.d.comb += self.i.ready.eq(1)
                m.d.sync += [
                    r.span.eq(self.i.payload),
                    r.half.eq(whole >> 1),
                    r.index.eq(0),
                    r.write_index.eq(whole >> 1),
                    r.level.eq(1),
                    r.step.eq(0),
                ]
                with m.If(self.i.valid & (self.i.payload.length != 0)):
                    m.next = "load left"
            with m.State("load left"):
                m.d.comb += write.en.eq(1)
                m.next = "load right"
            with m.State("load right"):
                m.d.comb += [write.en.eq(1), r.loading_right.eq(1)]
                m.next = "bisect"
            with m.State("bisect"):
                self._bisect(m, r, read)
            with m.State("drain"), m.If(r.level_done):
                self._next_level(m, r)
            with m.State("error"):
                m.d.sync += r.step.eq(r.step + 1)
                self._count_levels(m, r, multiplier)
            with m.State("segment"):
                m.d.sync += r.step.eq(r.step + 1)
                self._prepare_segment(m, r, multiplier)
                self._end_segment(m, r, read, fifo, complete)

    def _reciprocal(self, m, r: "_Front") -> None:
        """Reciprocal of m - 1 and its shift, long before the first bisection is done."""
        bits = self.parameters.LENGTH_BITS
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

    def _store_ends(self, m, r: "_Front", write) -> None:
        """Ends of segments into their memory: those of the span, then the bisection's results."""
        whole, bisection = 1 << self.parameters.depth, self._bisection
        m.d.comb += [
            bisection.i.payload.normal_a.eq(r.end_a),
            bisection.i.payload.normal_b.eq(r.end_b),
            bisection.o.ready.eq(1),
            r.next_index.eq(r.index + (r.half << 1)),
        ]
        with m.If(bisection.o.valid):
            m.d.comb += [
                write.addr.eq(r.write_index),
                write.data.eq(bisection.o.payload.normal_middle),
                write.en.eq(1),
                r.level_done.eq(r.write_index + r.half == whole),
            ]
            m.d.sync += r.write_index.eq(r.write_index + (r.half << 1))
        with m.Else():
            left, right = (Value.cast(end) for end in (r.span.normal_left, r.span.normal_right))
            m.d.comb += [
                write.addr.eq(Mux(r.loading_right, whole, 0)),
                write.data.eq(Mux(r.loading_right, right, left)),
            ]

    def _bisect(self, m, r: "_Front", read) -> None:
        """Pairs of neighbouring ends of a level into the bisection."""
        bisection = self._bisection
        m.d.comb += read.addr.eq(Mux(r.step == 0, r.index, r.next_index))
        with m.If(r.step != 3):
            m.d.sync += r.step.eq(r.step + 1)
        with m.If(r.step == 1):
            m.d.sync += r.end_a.eq(read.data)
        with m.If(r.step == 2):
            m.d.sync += r.end_b.eq(read.data)
        with m.If(r.step == 3):
            m.d.comb += bisection.i.valid.eq(1)
            with m.If(bisection.i.ready):
                m.d.sync += [r.step.eq(0), r.index.eq(r.next_index)]
                with m.If(r.next_index == 1 << self.parameters.depth):
                    m.next = "drain"

    def _next_level(self, m, r: "_Front") -> None:
        """The results of a level are stored: go on."""
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
            m.next = "segment"
        with m.Else():
            m.next = "bisect"

    def _count_levels(self, m, r: "_Front", multiplier: SteppedMultiplier) -> None:
        """Number of levels, by ``q + q^2`` and its limits."""
        p = self.parameters
        operand = r.one_minus_cosine.saturate(COMPONENT)
        multiplier.issue(0, operand, operand)
        sagitta = Signal(FixedShape(p.SAGITTA_FORMAT))
        quarter = r.one_minus_cosine.scale(-2).extend(SQ(1, 20))
        square = multiplier.product.scale(-4).truncate(20)
        m.d.sync += sagitta.eq((quarter + square).saturate(p.SAGITTA_FORMAT))
        with m.If(r.step == 3):
            m.d.sync += r.levels.eq(0)
            for k, code in enumerate(p.limits.codes.tolist()):
                with m.If((sagitta.as_value() > code) & ~r.out_of_range):
                    m.d.sync += r.levels.eq(k + 1)
        with m.If(r.step == 4):
            m.d.sync += [
                r.step.eq(0),
                r.spacing.eq((1 << p.depth) >> r.levels),
                r.left.eq(r.span.normal_left),
                r.offset.eq(0),
                r.remaining.eq(r.span.length),
                r.amount.eq(Mux(r.shift > r.levels, r.shift - 1 - r.levels, 0)),
            ]
            m.next = "segment"
            with m.If(r.levels > 1):
                m.next = "bisect"

    def _prepare_segment(self, m, r: "_Front", multiplier: SteppedMultiplier) -> None:
        """Pixels, start and step of a segment."""
        p, product = self.parameters, multiplier.product
        multiplier.issue(2, FixedValue(COMPONENT, Cat(r.offset, Const(0, 18 - len(r.offset)))), r.reciprocal)
        whole_pixels = r.available >> r.levels
        # 2^levels - 1 more, so that the shift rounds up.
        m.d.sync += [
            r.available.eq(r.steps - r.offset + (((1 << r.levels) - 1)[: p.depth + 1])),
            r.count.eq(Mux(whole_pixels < r.remaining, whole_pixels, r.remaining)),
            r.last.eq(whole_pixels >= r.remaining),
            r.advance.eq(r.count << r.levels),
            r.next_offset.eq(r.offset + r.advance - r.steps),
        ]
        with m.If(r.step == 4):
            m.d.sync += r.phi.as_value().eq(Cat(Const(0, 1), Value.cast(product)) >> r.shift)
        half_step = FixedValue.constant(p.ACCUMULATOR_FORMAT, p.half_step.values.item())
        for c in range(3):
            with m.If(r.step == 2):
                m.d.sync += r.difference[c].eq((r.right[c] - r.left[c]).saturate(COMPONENT))
            multiplier.issue(5 + c, r.difference[c], r.phi)
            multiplier.issue(8 + c, r.difference[c], r.reciprocal)
            with m.If(r.step == 7 + c):
                total = r.left[c] + product.truncate(32) + half_step
                m.d.sync += r.start[c].eq(total.wrap(p.ACCUMULATOR_FORMAT))
            with m.If(r.step == 10 + c):
                shifted = FixedValue(SQ(2, 34), Value.cast(product) >> r.amount)
                m.d.sync += r.slope[c].eq(shifted.truncate(32).wrap(p.STEP_FORMAT))

    def _end_segment(self, m, r: "_Front", read, fifo, complete) -> None:
        """Right end of a segment; the segment into the FIFO, or none without a pixel; on to the next."""
        whole = 1 << self.parameters.depth
        following = Signal(self.parameters.depth + 2)
        m.d.comb += [
            following.eq(r.index + r.spacing),
            read.addr.eq(Mux(r.index == whole, r.index, following)),
        ]
        with m.If(r.step == 1):
            m.d.sync += r.right.eq(read.data)
        moved = [r.left.eq(r.right), r.index.eq(following), r.step.eq(0)]
        with m.If((r.step == 2) & (r.offset >= r.steps)):
            # No pixel lies in this segment.
            m.d.sync += [r.offset.eq(r.offset - r.steps), *moved]
        with m.If(r.step == SEGMENT_CYCLES - 1):
            m.d.sync += r.step.eq(r.step)
            m.d.comb += fifo.w_en.eq(1)
            with m.If(fifo.w_rdy):
                m.d.sync += [r.remaining.eq(r.remaining - r.count), r.offset.eq(r.next_offset), *moved]
                with m.If(r.last):
                    m.d.comb += complete.eq(1)
                    m.next = "idle"

    @staticmethod
    def _hand_over(m, r: "_Front", fifo, segment_shape) -> None:
        """Fields of a segment at the input of the FIFO."""
        segment = Signal(segment_shape)
        m.d.comb += [
            segment.count.eq(r.count),
            segment.last.eq(r.last),
            segment.out_of_range.eq(r.out_of_range),
            *(segment.start[c].eq(r.start[c]) for c in range(3)),
            *(segment.step[c].eq(r.slope[c]) for c in range(3)),
            fifo.w_data.eq(segment.as_value()),
        ]

    def _back(self, m, fifo, segment_shape, ready_spans, begun):
        """Interpolate: an accumulating adder a component."""
        p = self.parameters
        segment = data.View(segment_shape, fifo.r_data)
        inside, out_of_range = Signal(name="inside"), Signal(name="span_out_of_range")
        valid = Signal(name="pixel_valid")
        advance, load = Signal(name="back_advance"), Signal(name="load")
        given = fifo.r_rdy & (inside | (ready_spans != 0))
        active, ends = count_down(m, given, segment.count, advance)
        pixel = Signal(self.o.payload.shape())
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, pixel)),
            load.eq(advance & ends & given),
            begun.eq(load & ~inside),
            fifo.r_en.eq(load),
        ]
        with m.If(advance):
            m.d.sync += [
                valid.eq(active),
                pixel.out_of_range.eq(out_of_range),
                pixel.last.eq(active & ends & ~inside),
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
            with m.If(advance):
                result = normal.truncate(COMPONENT.fraction_bits).saturate(COMPONENT)
                m.d.sync += pixel.normal[c].eq(result)


class _Front:
    """Registers of the front of an `AdaptiveNormaliserUnit`, and its wires, which its states share."""

    def __init__(self, parameters: AdaptiveNormaliser, span_shape: data.StructLayout):
        p, bits, depth = parameters, parameters.LENGTH_BITS, parameters.depth
        component = FixedShape(COMPONENT)
        self.span = Signal(span_shape)
        self.step = Signal(range(SEGMENT_CYCLES))
        # Of the reciprocal of m - 1.
        self.steps = Signal(bits)
        self.reciprocal = Signal(component)
        self.shift = Signal(range(bits + 1))
        # Of the bisection: ``half`` is the distance of a middle from its two ends.
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
        self.loading_right = Signal()
        self.level_done = Signal()
        # Of segments: ``offset`` is phi (m - 1) of the first pixel.
        self.left = Signal(normal_shape())
        self.right = Signal(normal_shape())
        self.difference = Signal(normal_shape())
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
