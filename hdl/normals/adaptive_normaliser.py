"""Adaptive normaliser ([T] figure 2.7): bisection, an error block and linear interpolators."""

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
from blysk.hdl.core.reciprocal import reciprocal_codes
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.normals.bisection import BisectionUnit

__all__ = ["AdaptiveNormaliserUnit"]

SEGMENT_CLOCKS = 14
"""Clocks from one segment's preparation to the next."""


class AdaptiveNormaliserUnit(wiring.Component):
    """The normals of a span, by straight lines over ``2^k`` arcs, k just large enough.

    Formats, choice of k, exactness of the ends and error bounds are those of
    `AdaptiveNormaliser`, the bit-true twin.

    Two halves work at once. The front prepares a span: it bisects, level by level (`BisectionUnit`), then
    works out start, step and length of every segment, one in 14 cycles (3 for a segment without a pixel), and
    puts them into a FIFO. The back gives one normal a clock from a span's first to its last, unless the
    output waits; it begins a span when all of its segments are there. `preparation` is the number of cycles
    from taking a span in to its first normal, where the back is free by then: 69 for k = 0, 83 for k = 1, 148
    for k = 2. The next span is taken in two cycles before that, so spans of more pixels follow each other
    without a gap. A span of length 0 takes one clock and gives nothing.

    Three multipliers: two in the bisection unit and one for the square of the error block and the segments.
    The segment ends are held in a memory of ``2^(depth + 1)`` words of 54 bits, the segments in a FIFO of as
    many; a table of 2048 words of 17 bits holds the reciprocals.

    Parameters
    ----------
    parameters : AdaptiveNormaliser
        Threshold, factor and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "length": 12})))`
        Unit normals, three components ``SQ(1, 17)`` each; pixels.
    o : :py:`Out(stream.Signature(StructLayout({"normal", "wide": 1, "last": 1})))`
        Normals, three components ``SQ(1, 17)``; ``out_of_range``: of a span wider than the bisection's
        ``max_angle``; ``last``: the last of its span.

    Source: [T] 2.1, figure 2.7.
    """

    def __init__(self, parameters: AdaptiveNormaliser | None = None):
        self.parameters = parameters or AdaptiveNormaliser()
        self._bisection = BisectionUnit(self.parameters.bisection)
        super().__init__(
            {
                "i": In(
                    stream.Signature(
                        data.StructLayout(
                            {
                                "normal_left": normal_shape(),
                                "normal_right": normal_shape(),
                                "length": unsigned(AdaptiveNormaliser.LENGTH_BITS),
                            }
                        )
                    )
                ),
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
        """Clocks from taking a span in to its first normal, if it has at least ``2^levels + 1`` pixels.

        A span of one pixel has a single segment, and the way through the FIFO takes one clock more: 56.
        """
        latency, interval = self._bisection.latency, self._bisection.initiation_interval
        further = sum(latency + 4 + interval * ((1 << level) - 1) for level in range(1, levels))
        return latency + 14 + further + SEGMENT_CLOCKS * ((1 << levels) + 1)

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
        complete, begun = Signal(), Signal()
        ready_spans = Signal(range(depth + 1))
        m.d.sync += ready_spans.eq(ready_spans + complete - begun)
        self._front(m, fifo, segment_shape, complete)
        self._back(m, fifo, segment_shape, ready_spans, begun)
        return m

    def _front(self, m, fifo, segment_shape, complete):
        """Bisect, count the levels, prepare the segments."""
        p = self.parameters
        whole = 1 << p.depth
        span = Signal(self.i.payload.shape())
        step = Signal(range(SEGMENT_CLOCKS))

        m.submodules.ends = ends = Memory(shape=normal_shape(), depth=2 * whole, init=[])
        read, write = ends.read_port(), ends.write_port()
        m.submodules.bisection = bisection = self._bisection
        m.d.comb += bisection.o.ready.eq(1)

        # The reciprocal of m - 1 has the whole first bisection to come.
        bits = p.LENGTH_BITS
        steps = Signal(bits)
        position, below_top = Signal(range(bits)), Signal(range(bits))
        m.d.sync += [
            steps.eq(Mux(span.length <= 1, 1, span.length - 1)),
            position.eq(0),
            below_top.eq(bits - 1),
        ]
        for bit in range(bits):
            with m.If(steps[bit]):
                m.d.sync += [position.eq(bit), below_top.eq(bits - 1 - bit)]
        address = Signal(bits - 1)
        m.d.sync += address.eq((steps << below_top)[: bits - 1])
        m.submodules.reciprocals = table = Memory(
            shape=RECIPROCAL_FORMAT.width, depth=1 << (bits - 1), init=reciprocal_codes(bits)
        )
        table_port = table.read_port()
        m.d.comb += table_port.addr.eq(address)
        reciprocal = Signal(FixedShape(COMPONENT))
        shift = Signal(range(bits + 1))
        m.d.sync += [
            reciprocal.eq(FixedValue(RECIPROCAL_FORMAT, table_port.data)),
            shift.eq(position + address.any()),
        ]

        # The shared multiplier.
        a, b = Signal(FixedShape(COMPONENT), name="factor"), Signal(FixedShape(COMPONENT), name="operand")
        exact = a * b
        product = Signal(exact.shape())
        m.d.sync += product.eq(exact)

        def issue(at, first, second):
            with m.If(step == at):
                m.d.sync += [a.eq(first), b.eq(second)]

        # Bisection, level by level: ``half`` is the distance of a middle from its two ends.
        half = Signal(p.depth + 1)
        place, write_place = Signal(p.depth + 1), Signal(p.depth + 1)
        after_place = Signal(p.depth + 2)
        level, levels = Signal(range(p.depth + 2)), Signal(range(p.depth + 1))
        out_of_range = Signal()
        one_minus_cosine = Signal(FixedShape(p.bisection.ANGLE_FORMAT))
        end_a = Signal(normal_shape())
        end_b = Signal(normal_shape())
        m.d.comb += [
            bisection.i.payload.normal_a.eq(end_a),
            bisection.i.payload.normal_b.eq(end_b),
            after_place.eq(place + (half << 1)),
        ]
        loading_right = Signal()
        level_done = Signal()
        with m.If(bisection.o.valid):
            m.d.comb += [
                write.addr.eq(write_place),
                write.data.eq(bisection.o.payload.normal_middle),
                write.en.eq(1),
                level_done.eq(write_place + half == whole),
            ]
            m.d.sync += write_place.eq(write_place + (half << 1))
        with m.Else():
            m.d.comb += [
                write.addr.eq(Mux(loading_right, whole, 0)),
                write.data.eq(
                    Mux(loading_right, Value.cast(span.normal_right), Value.cast(span.normal_left))
                ),
            ]

        # Segments.
        left, right, difference = (Signal(normal_shape(), name=name) for name in ("left", "right", "change"))
        spacing = Signal(p.depth + 1)
        remaining, offset, available = Signal(bits), Signal(bits + 1), Signal(bits + 2)
        count, advance, next_offset = Signal(bits + 1), Signal(2 * bits), Signal(bits + 1)
        last = Signal()
        phi = Signal(FixedShape(COMPONENT))
        amount = Signal(range(bits + 1))
        start = [Signal(FixedShape(p.ACCUMULATOR_FORMAT), name=f"start_{c}") for c in range(3)]
        slope = [Signal(FixedShape(p.STEP_FORMAT), name=f"slope_{c}") for c in range(3)]
        half_step = FixedValue.constant(p.ACCUMULATOR_FORMAT, p.half_step.values.item())
        segment = Signal(segment_shape)
        m.d.comb += [
            segment.count.eq(count),
            segment.last.eq(last),
            segment.out_of_range.eq(out_of_range),
            *(segment.start[c].eq(start[c]) for c in range(3)),
            *(segment.step[c].eq(slope[c]) for c in range(3)),
            fifo.w_data.eq(segment.as_value()),
        ]

        with m.FSM():
            with m.State("idle"):
                m.d.comb += self.i.ready.eq(1)
                m.d.sync += [
                    span.eq(self.i.payload),
                    half.eq(whole >> 1),
                    place.eq(0),
                    write_place.eq(whole >> 1),
                    level.eq(1),
                    step.eq(0),
                ]
                with m.If(self.i.valid & (self.i.payload.length != 0)):
                    m.next = "load left"
            with m.State("load left"):
                m.d.comb += write.en.eq(1)
                m.next = "load right"
            with m.State("load right"):
                m.d.comb += [write.en.eq(1), loading_right.eq(1)]
                m.next = "bisect"
            with m.State("bisect"):
                m.d.comb += read.addr.eq(Mux(step == 0, place, after_place))
                with m.If(step != 3):
                    m.d.sync += step.eq(step + 1)
                with m.If(step == 1):
                    m.d.sync += end_a.eq(read.data)
                with m.If(step == 2):
                    m.d.sync += end_b.eq(read.data)
                with m.If(step == 3):
                    m.d.comb += bisection.i.valid.eq(1)
                    with m.If(bisection.i.ready):
                        m.d.sync += [step.eq(0), place.eq(after_place)]
                        with m.If(after_place == whole):
                            m.next = "drain"
            with m.State("drain"), m.If(level_done):
                m.d.sync += [
                    half.eq(half >> 1),
                    write_place.eq(half >> 1),
                    place.eq(0),
                    level.eq(level + 1),
                    step.eq(0),
                ]
                with m.If(level == 1):
                    m.d.sync += [
                        one_minus_cosine.eq(bisection.o.payload.one_minus_cosine),
                        out_of_range.eq(bisection.o.payload.out_of_range),
                    ]
                    m.next = "error"
                with m.Elif(level == levels):
                    m.next = "segment"
                with m.Else():
                    m.next = "bisect"
            with m.State("error"):
                m.d.sync += step.eq(step + 1)
                operand = one_minus_cosine.saturate(COMPONENT)
                issue(0, operand, operand)
                sagitta = Signal(FixedShape(p.SAGITTA_FORMAT))
                quarter = one_minus_cosine.scale(-2).extend(SQ(1, 20))
                m.d.sync += sagitta.eq((quarter + product.scale(-4).truncate(20)).saturate(p.SAGITTA_FORMAT))
                with m.If(step == 3):
                    m.d.sync += levels.eq(0)
                    for k, code in enumerate(p.limits.codes.tolist()):
                        with m.If((sagitta.as_value() > code) & ~out_of_range):
                            m.d.sync += levels.eq(k + 1)
                with m.If(step == 4):
                    m.d.sync += [
                        step.eq(0),
                        spacing.eq(whole >> levels),
                        left.eq(span.normal_left),
                        offset.eq(0),
                        remaining.eq(span.length),
                        amount.eq(Mux(shift > levels, shift - 1 - levels, 0)),
                    ]
                    m.next = "segment"
                    with m.If(levels > 1):
                        m.next = "bisect"
            with m.State("segment"):
                following = Signal(p.depth + 2)
                m.d.comb += [
                    following.eq(place + spacing),
                    read.addr.eq(Mux(place == whole, place, following)),
                ]
                m.d.sync += step.eq(step + 1)
                with m.If(step == 1):
                    m.d.sync += right.eq(read.data)
                moved = [left.eq(right), place.eq(following), step.eq(0)]
                with m.If((step == 2) & (offset >= steps)):
                    # No pixel lies in this segment.
                    m.d.sync += [offset.eq(offset - steps), *moved]
                issue(2, FixedValue(COMPONENT, Cat(offset, Const(0, 18 - len(offset)))), reciprocal)
                # 2^levels - 1 more, so that the shift rounds up.
                m.d.sync += [
                    available.eq(steps - offset + (((1 << levels) - 1)[: p.depth + 1])),
                    count.eq(Mux((available >> levels) < remaining, available >> levels, remaining)),
                    last.eq((available >> levels) >= remaining),
                    advance.eq(count << levels),
                    next_offset.eq(offset + advance - steps),
                ]
                with m.If(step == 4):
                    m.d.sync += phi.as_value().eq(Cat(Const(0, 1), Value.cast(product)) >> shift)
                for c in range(3):
                    with m.If(step == 2):
                        m.d.sync += difference[c].eq((right[c] - left[c]).saturate(COMPONENT))
                    issue(5 + c, difference[c], phi)
                    issue(8 + c, difference[c], reciprocal)
                    with m.If(step == 7 + c):
                        total = left[c] + product.truncate(32) + half_step
                        m.d.sync += start[c].eq(total.wrap(p.ACCUMULATOR_FORMAT))
                    with m.If(step == 10 + c):
                        shifted = FixedValue(SQ(2, 34), Value.cast(product) >> amount)
                        m.d.sync += slope[c].eq(shifted.truncate(32).wrap(p.STEP_FORMAT))
                with m.If(step == SEGMENT_CLOCKS - 1):
                    m.d.sync += step.eq(step)
                    m.d.comb += fifo.w_en.eq(1)
                    with m.If(fifo.w_rdy):
                        m.d.sync += [remaining.eq(remaining - count), offset.eq(next_offset), *moved]
                        with m.If(last):
                            m.d.comb += complete.eq(1)
                            m.next = "idle"

    def _back(self, m, fifo, segment_shape, ready_spans, begun):
        """Interpolate: an accumulating adder a component."""
        p = self.parameters
        segment = data.View(segment_shape, fifo.r_data)
        inside, out_of_range, valid = Signal(), Signal(name="span_wide"), Signal(name="pixel_valid")
        advance, load = Signal(name="back_advance"), Signal()
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
