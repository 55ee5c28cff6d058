"""Coarse depth test, which finds hidden spans by a bound of the depths in each block."""

from operator import and_

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, ValueLike, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.coarse_depth import CoarseDepth
from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import NEEDS_ZEROS
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields

__all__ = ["CoarseDepthUnit", "deep_span_shape"]

# A sum of depths has more bits than a depth or a step, as in the depth test.
_SUM_BITS = 37


def deep_span_shape(x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a span: first pixel, length, depth and its step, and a bit that changes with each picture."""
    place = {"x": unsigned(x_bits), "y": unsigned(y_bits), "length": unsigned(x_bits)}
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
    return data.StructLayout(place | depth | {"picture": unsigned(1)})


class CoarseDepthUnit(wiring.Component):
    """Finds spans that are hidden for their whole length. `CoarseDepth` is the bit-accurate model.

    A span takes a cycle for each of its blocks. The answer for a span of one block is on the output 8 cycles
    after the span was taken in. The word of a block is read, compared and written. Words of the last three
    blocks are not in the memory yet, so they come from registers. Products with a number of pixels are sums
    of shifts, without multipliers.

    A span with another ``picture`` than the span before begins the next picture. It waits until all words of
    the spans before it are written, and `CoarseDepth.swept` words are cleared, one a cycle. After a reset
    ``picture`` counts as 0 and all words are cleared. At power-up the memory is clear. If no span came in
    since then, no word is cleared.

    Parameters
    ----------
    model : CoarseDepth
        Bit-accurate model.
    x_bits, y_bits : int
        Bits of a column (and of a length), and of a scanline.

    Members
    -------
    i : :py:`In(stream.Signature(deep_span_shape(x_bits, y_bits)))`
        Spans of one pixel or more. A span that goes out of the largest picture counts as visible, and changes
        no bound.
    o : :py:`Out(stream.Signature(1))`
        Answers in the order of the spans: 1 if the span is hidden.

    Attributes
    ----------
    idle : Signal
        High while no span is inside and no word is swept.

    Raises
    ------
    ValueError
        If a column or a scanline of the picture needs more bits.

    Source: docs/theory/geometry.md#depth; not in the documents.
    """

    def __init__(self, model: CoarseDepth, x_bits: int = 12, y_bits: int = 12):
        if (model.width - 1) >> x_bits or (model.height - 1) >> y_bits:
            raise ValueError(
                f"a picture of {model.width}x{model.height} has places of more than {x_bits} and "
                f"{y_bits} bits"
            )
        self.model, self.x_bits, self.y_bits = model, x_bits, y_bits
        super().__init__(
            {
                "i": In(stream.Signature(deep_span_shape(x_bits, y_bits))),
                "o": Out(stream.Signature(1)),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """Blocks of a span; depths at both ends of each; the memory's word; comparison; the write."""
        m = Module()
        model, bits = self.model, self.model.block.bit_length() - 1
        valid, answer, advance = Signal(name="valid"), Signal(name="answer"), Signal(name="advance")
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid, answer))
        word = data.StructLayout(
            {
                # The bound, inverted, so that a cleared word is 0.
                "nearness": model.depth_bits,
                "candidate": model.depth_bits,
                "mask": model.block,
                "tag": model.tag_bits,
            }
        )
        m.submodules.words = memory = Memory(shape=word, depth=model.blocks, init=[], attrs=NEEDS_ZEROS)
        read, write = memory.read_port(), memory.write_port()
        tag, empty = Signal(model.tag_bits, name="tag"), Signal(name="empty")
        span, span_valid, swept, sweeping, held = self._pictures(m, tag, empty)
        block, waiting = self._blocks(m, bits, advance, (span, span_valid, held))
        steps, ends, bound = self._bounds(m, bits, advance, block)

        part = Signal(bound.shape(), name="part")
        there = Signal(word, name="there", reset_less=True)
        # Words that were written after the word of the part was read.
        late = data.StructLayout({"valid": 1, "place": range(model.blocks), "word": word})
        written = [Signal(late, name=f"written_{k}") for k in range(3)]
        same = [Signal(name=f"same_{k}") for k in range(3)]
        old, new = Signal(word, name="old"), Signal(word, name="new")
        hidden, so_far = Signal(name="hidden"), Signal(name="so_far", reset_less=True)
        m.d.comb += old.eq(Mux(there.tag == tag, there, 0))
        for k in reversed(range(3)):
            with m.If(same[k]):
                m.d.comb += copy(old, written[k].word)
        limit, mask = ~old.nearness, old.mask | part.mask
        candidate = Mux(part.hi > old.candidate, part.hi, old.candidate)
        m.d.comb += [copy(new, old), new.tag.eq(tag), hidden.eq((part.lo > limit) & (part.begins | so_far))]
        with m.If(part.hi < limit):
            with m.If(mask.all()):
                m.d.comb += [new.nearness.eq(~candidate), new.candidate.eq(0), new.mask.eq(0)]
            with m.Else():
                m.d.comb += [new.candidate.eq(candidate), new.mask.eq(mask)]
        of_part = (part.valid, part.place), *((of.valid, of.place) for of in written[:2])
        with m.If(advance):
            m.d.sync += [
                copy(part, bound),
                copy(there, read.data),
                *(
                    flag.eq(on & (place == bound.place))
                    for flag, (on, place) in zip(same, of_part, strict=True)
                ),
                written[0].eq(Cat(part.valid, part.place, new)),
                copy(written[1], written[0]),
                copy(written[2], written[1]),
                valid.eq(part.valid & part.ends),
                answer.eq(hidden),
                so_far.eq(hidden),
            ]
        m.d.comb += [
            read.addr.eq(ends.place),
            read.en.eq(advance),
            write.addr.eq(Mux(sweeping, swept, written[0].place)),
            write.data.eq(Mux(sweeping, 0, written[0].word)),
            write.en.eq(sweeping | written[0].valid),
            empty.eq(~(waiting | Cat(of.valid for of in (steps, ends, bound, part, *written)).any())),
            self.idle.eq(empty & ~(span_valid | sweeping | self.o.valid)),
        ]
        return m

    def _pictures(self, m: Module, tag: Signal, empty: Signal) -> tuple:
        """The span taken in, whether it must wait for its picture, and the words that are cleared."""
        model = self.model
        shape = {"x": self.x_bits, "last": self.x_bits, "line": range(model.blocks), "picture": 1}
        shape |= {"depth": SPAN_DEPTH.width, "step": DEPTH_STEP.width, "outside": 1}
        span = Signal(data.StructLayout(shape), name="span", reset_less=True)
        span_valid, picture = Signal(name="span_valid"), Signal(name="picture")
        fresh, used = Signal(name="fresh", init=1), Signal(name="used", reset_less=True)
        left, place = Signal(range(model.blocks + 1), name="left"), Signal(range(model.blocks), name="place")
        sweeping, other, held = Signal(name="sweeping"), Signal(name="other"), Signal(name="held")
        m.d.comb += [
            sweeping.eq(left.any()),
            other.eq(span.picture != picture),
            held.eq(fresh | sweeping | other),
        ]
        with m.If(fresh):
            # A reset does not clear the memory.
            m.d.sync += [fresh.eq(0), left.eq(Mux(used, model.blocks, 0))]
        with m.Elif(sweeping):
            m.d.sync += [left.eq(left - 1), place.eq(Mux(place == model.blocks - 1, 0, place + 1))]
        with m.Elif(span_valid & other & empty):
            m.d.sync += [picture.eq(span.picture), tag.eq(tag + 1), left.eq(model.swept)]
        with m.If(span_valid):
            m.d.sync += used.eq(1)
        return span, span_valid, place, sweeping, held

    def _blocks(self, m: Module, bits: int, advance: Signal, given_span: tuple) -> tuple[data.View, Value]:
        """Split spans into blocks, one a cycle. Also returns whether a block is there or will follow."""
        model, incoming = self.model, self.i.payload
        span, span_valid, held = given_span
        step = {"step": DEPTH_STEP.width, "outside": 1}
        ends = {"first": bits, "last": bits, "border": 1, "left": self.x_bits - bits}
        ends |= {"place": range(model.blocks)} | step
        next_shape = ends | {"depth": SPAN_DEPTH.width, "back": _SUM_BITS}
        following = Signal(data.StructLayout(next_shape), name="following", reset_less=True)
        block_shape = {"valid": 1, "begins": 1, "ends": 1} | ends | {"depth": _SUM_BITS}
        block, following_valid = (
            Signal(data.StructLayout(block_shape), name="block"),
            Signal(name="following_valid"),
        )
        taken = ~block.valid | block.ends
        goes = taken | ~following_valid
        accepts = ~span_valid | (goes & ~held)
        m.d.comb += self.i.ready.eq(advance & accepts)
        with m.If(advance & accepts):
            m.d.sync += [
                span_valid.eq(self.i.valid),
                span.x.eq(incoming.x),
                span.last.eq(incoming.x + incoming.length - 1),
                span.line.eq(_times(model.blocks_per_line, incoming.y)),
                span.picture.eq(incoming.picture),
                span.depth.eq(Value.cast(incoming.depth)),
                span.step.eq(Value.cast(incoming.depth_step)),
                span.outside.eq((incoming.x + incoming.length > model.width) | (incoming.y >= model.height)),
            ]
        with m.If(advance & goes):
            m.d.sync += [
                following_valid.eq(span_valid & ~held),
                following.first.eq(span.x[:bits]),
                following.last.eq(span.last[:bits]),
                following.border.eq(span.last == model.width - 1),
                following.left.eq(span.last[bits:] - span.x[bits:]),
                following.place.eq(span.line + span.x[bits:]),
                following.depth.eq(span.depth),
                following.back.eq(_times(span.step.as_signed(), span.x[:bits])),
                following.step.eq(span.step),
                following.outside.eq(span.outside),
            ]
        with m.If(advance & taken):
            m.d.sync += [
                block.valid.eq(following_valid),
                block.begins.eq(1),
                block.ends.eq(~following.left.any()),
                *copy_fields(block, following, ends),
                # The depth where the block begins. The block may begin before the span.
                block.depth.eq(following.depth - following.back),
            ]
        with m.Elif(advance):
            m.d.sync += [
                block.begins.eq(0),
                block.ends.eq(block.left == 1),
                block.first.eq(0),
                block.left.eq(block.left - 1),
                block.place.eq(block.place + 1),
                block.depth.eq(block.depth + (block.step.as_signed() << bits)),
            ]
        return block, following_valid | block.valid

    def _bounds(self, m: Module, bits: int, advance: Signal, block: data.View) -> tuple[data.View, ...]:
        """Three stages: depth changes to both ends of a part, depths there, least and largest depth."""
        model, last = self.model, self.model.block - 1
        common = {"valid": 1, "begins": 1, "ends": 1, "place": range(model.blocks), "mask": model.block}
        copied = ("valid", "begins", "ends", "place", "depth", "outside")
        both = dict.fromkeys(("near", "far"), _SUM_BITS)
        shape = common | {"falls": 1, "outside": 1} | both
        steps = Signal(data.StructLayout(shape | {"depth": _SUM_BITS}), name="steps")
        ends = Signal(data.StructLayout(shape), name="ends")
        bounds = dict.fromkeys(("lo", "hi"), model.depth_bits)
        bound = Signal(data.StructLayout(common | bounds), name="bound")
        slope = block.step.as_signed()
        marked = Mux(block.ends & ~block.border, block.last, last)
        # ``first`` is never beyond the last pixel of a block, and ``marked`` never before pixel 0.
        begun = [block.first <= k for k in range(last)] + [Const(1)]
        not_over = [Const(1)] + [marked >= k for k in range(1, model.block)]
        with m.If(advance):
            m.d.sync += [
                *copy_fields(steps, block, copied),
                steps.mask.eq(Cat(map(and_, begun, not_over))),
                steps.falls.eq(slope < 0),
                steps.near.eq(_times(slope, block.first)),
                steps.far.eq(_times(slope, Mux(block.ends, block.last, last))),
                *copy_fields(ends, steps, (*common, "falls", "outside")),
                *(ends[name].eq(steps.depth + steps[name]) for name in both),
                *copy_fields(bound, ends, common),
                # A span outside the picture is neither behind a bound nor in front of it, so words stay as
                # they are.
                bound.lo.eq(Mux(ends.outside, 0, self._upper(Mux(ends.falls, ends.far, ends.near)))),
                bound.hi.eq(
                    Mux(ends.outside, model.deepest, self._upper(Mux(ends.falls, ends.near, ends.far)))
                ),
            ]
        return steps, ends, bound

    def _upper(self, code: Value) -> Value:
        """Upper bits of a depth, which saturates to 0 and to `DepthTester.FARTHEST`."""
        depth, farthest = code.as_signed() >> SPAN_DEPTH.fraction_bits, DepthTester.FARTHEST
        inside = Mux(depth < 0, 0, Mux(depth > farthest, farthest, depth))
        return inside[DEPTH.width - self.model.depth_bits : DEPTH.width]


def _times(value: ValueLike, count: Value) -> Value:
    """A product as a sum of shifts, one for each 1 of a constant ``value``, or for each bit of ``count``."""
    if isinstance(value, int):
        return sum((count << k for k in range(value.bit_length()) if value >> k & 1), start=Const(0))
    return sum((Mux(count[k], value << k, 0) for k in range(len(count))), start=Const(0))
