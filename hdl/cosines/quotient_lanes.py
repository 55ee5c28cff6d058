"""Spans of the quotient method with several lanes: words of several neighbouring pixels on every cycle."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream

from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.cosines.quotient import pixel_words_shape
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit

__all__ = ["QuotientLanesUnit", "lane_words_shape"]


def lane_words_shape(model: QuotientLanes) -> data.ArrayLayout:
    """Shape of a beat: `pixel_words_shape` of each lane.

    In the first lane ``span`` is the bit that alternates from span to span. In a further lane it tells
    whether this lane has a pixel.
    """
    return data.ArrayLayout(pixel_words_shape(model), model.lanes)


class QuotientLanesUnit(QuotientSpansUnit):
    """Words of two pixels of a span on a cycle; `QuotientLanes` is the bit-accurate model.

    A beat has the next two pixels of a span. The first beat begins at the span's first pixel, at any column.
    If a span has an odd number of pixels, the last beat has one pixel. A lane without a pixel has words of 0.

    *Setup.* It is the setup of `QuotientSpansUnit`, with the same multipliers. A span of two pixels is a
    *pair*: its step is the vector at the second pixel, with any scale of its own, and its exponent is not
    read. So the first differences of a pair are the words of the second pixel. A pair takes two cycles, a
    longer span three cycles.

    *Accumulators.* Beat j has the pixels 2 j and 2 j + 1. With ``D1`` and ``D2`` of `QuotientSpans`, three
    words of each square change from beat to beat:

    ===================== ================== ============
    word                  at the first beat  a beat
    ===================== ================== ============
    f(2j)                 start              + the step
    step, f(2j+2) - f(2j) 2 D1 + D2          + 4 D2
    gap, f(2j+1) - f(2j)  D1                 + 2 D2
    ===================== ================== ============

    With a first difference F before the half h of a second difference is added, and b, the last bit of
    ``D2 = 2 h + b``, the first step is ``2 F + 4 h + b``. So it takes one addition. Differences are taken as
    in `QuotientSpansUnit`, with beats in place of pixels. The gap of the next span waits in a register until
    its start is taken, because the gap of the last beat is still needed.

    The first beat of a span is on the output `latency` cycles after an empty unit has accepted the span. For
    a span of one pixel these are `short_latency` cycles. Payloads are registers.

    Parameters
    ----------
    model : QuotientLanes
        Bit-accurate model.
    length_bits : int
        Bits of the length.

    Members
    -------
    i, constants, begun
        Those of `QuotientSpansUnit`.
    o : :py:`Out(stream.Signature(lane_words_shape(model)))`
        Words of the pixels.

    Source: docs/theory/quotient.md#lanes.
    """

    def __init__(self, model: QuotientLanes | None = None, length_bits: int = LENGTH_BITS):
        super().__init__(model or QuotientLanes(), length_bits)
        self.latency += 1
        self.short_latency += 1

    def _output_shape(self) -> data.Layout:
        return lane_words_shape(self.model)

    @property
    def spans_inside(self) -> int:
        """Largest number of spans inside."""
        return super().spans_inside + 1

    # Setup.

    def _turn_of_a_pair(self, m: Module, moves: Value, begun: Value, is_second: Value) -> Value:
        paired, valid = Signal(name="is_pair"), self.i.valid
        with m.If(moves):
            is_pair = self._is_pair(self.i.payload.length)
            m.d.sync += paired.eq(Mux(begun, paired & ~valid, valid & is_pair))
        return paired

    @staticmethod
    def _is_pair(length: Value) -> Value:
        return length[1] & ~length[0] & ~length[2:].any()

    def _counted(self, length: Value) -> Value:
        return (length - 1)[: len(length)]

    def _few_of(self, last: Value) -> Value:
        """Five bits, from the index of the last pixel.

        Whether there are two pixels or more; whether there are at most one, two, three beats; whether the
        span is a pair.
        """
        beats = last[1:]
        few = ~beats.any(), ~beats[1:].any(), ~beats[2:].any() & ~beats[:2].all()
        return Cat(last.any(), *few, last[0] & ~beats.any())

    def _amounts(
        self, m: Module, arrives: Value, delayed: Callable, paired: Value, b: Any, amounts: Any
    ) -> tuple[Value, Value]:
        """Shifts of lines and of squares. Store whether first differences are of a pair, and signs of z."""
        p, before = self.model, self._SUMS - 1
        held = delayed(paired, "paired", before)
        signs = [b[f"z{light}"][-1] for light in range(p.lights)] if p.takes_heights else []
        late = [delayed(held, "paired", self._SHIFTED - 1, before + 1)]
        late += [delayed(sign, f"sign_{light}", self._SHIFTED - 1) for light, sign in enumerate(signs)]
        self._marks = Signal(len(late), name="marks", reset_less=True)
        with m.If(arrives):
            m.d.sync += self._marks.eq(Cat(late))
        # The square of the second vector is shifted as far as that of the first vector.
        return Mux(held, 0, amounts[0]), Mux(held, 1, amounts[1])

    # Beats.

    def _take(self, m: Module, advance: Value, takes: Any, waits: Any, start: stream.Interface) -> None:
        """Take words of a span when the span before does not need its own words any more. Count beats."""
        # At most one, at most two, at most three beats of a span are left, counting the beat behind the
        # output registers.
        last, two, three = (Signal(name=name, init=1) for name in ("last", "two_left", "three_left"))
        left, valid, shown = (
            Signal(self.length_bits - 1, name="left"),
            Signal(name="valid"),
            Signal(name="shown"),
        )
        # Whether second and first differences of the next span were taken, and whether they may be taken.
        has_second, self._ready = Signal(name="has_second"), Signal(name="ready")
        may_second, may_first = Signal(name="may_second", init=1), Signal(name="may_first")
        # Whether the last beat of a span has two pixels.
        even = Signal(name="even")
        takes_differences, one, at_most_two, at_most_three, self._starts_pair = self._few
        m.d.comb += [
            takes[0].eq(waits[0] & may_second),
            takes[1].eq(waits[1] & may_first & (has_second | self._marks[0])),
            takes[2].eq(start.valid & last & (self._ready | ~takes_differences)),
            advance.eq(~shown | self.o.ready),
            self.o.valid.eq(shown),
        ]
        starts = takes[2] & takes_differences
        following = [
            Mux(takes[2], one, two),
            Mux(takes[2], at_most_two, three),
            Mux(takes[2], at_most_three, three | (left == 3)),
            (takes[0] | has_second) & ~(starts & ~self._starts_pair),
            (takes[1] | self._ready) & ~starts,
        ]
        with m.If(advance):
            m.d.sync += [
                shown.eq(valid),
                valid.eq(takes[2] | ~last),
                left.eq(Mux(takes[2], start.payload.length[1:], left - 1)),
                Cat(last, two, three, has_second, self._ready).eq(Cat(following)),
                may_second.eq(following[2] & ~following[3]),
                may_first.eq(following[1] & ~following[4]),
            ]
            with m.If(takes[2]):
                m.d.sync += even.eq(start.payload.length[0])
        self._both = ~last | even

    def _accumulate(self, m: Module, moves: Any, takes: Any, words: Any, start: stream.Interface) -> None:
        """Accumulators of both lanes, from differences and starts that are taken.

        ``moves`` has three conditions: a beat may leave; the half of a second difference is added; steps of
        squares change.
        """
        p, (advance, halves, steps), (second, first) = self.model, moves, words
        takes_second, takes_first, takes_start = takes
        is_pair, lanes = Signal(name="pair"), self.o.payload

        def show(lane: int, word: Value, result: Any, name: str) -> None:
            """Show a word of a lane on the output, a cycle later."""
            shown = Signal(len(word), name=f"{name}_of_{lane}", reset_less=True)
            with m.If(advance):
                m.d.sync += shown.eq(word if lane == 0 else Mux(self._both, word, 0))
            m.d.comb += Value.cast(result).eq(shown)

        def both(value: Value, gap: Value, results: Any, name: str) -> None:
            """Show a word of both lanes. The gap of a pair is the word of its second pixel."""
            show(0, value, results[0], name)
            base = value & (~is_pair).replicate(len(value))
            show(1, (base + gap)[: len(value)], results[1], name)

        with m.If(advance & takes_start):
            m.d.sync += is_pair.eq(self._starts_pair)
        for number in range(len(p.squares)):
            width, free = p.square_format.width, p.square_format.fraction_bits - 34
            names = ("square", "step", "change", "next_gap", "gap", "gap_change")
            value, step, change, next_gap, gap, gap_change = (
                Signal(width, name=f"{name}_{number}", reset_less=True) for name in names
            )
            low = Signal(name=f"low_{number}", reset_less=True)
            given, whole = second.squares[number], Cat(low, change)[:width]
            with m.If(advance):
                with m.If(takes_second):
                    m.d.sync += [change.eq(given[1:]), low.eq(given[0])]
                with m.Elif(halves):
                    m.d.sync += change.eq(whole)
                with m.If(halves):
                    m.d.sync += gap_change.eq(whole)
                half = change & (~self._marks[0]).replicate(width)
                with m.If(takes_first):
                    m.d.sync += next_gap.eq(first.squares[number] + half)
                begin = Cat(Const(0, free), start.payload.squares[number])
                m.d.sync += [
                    value.eq(Mux(takes_start, begin, value + step)),
                    gap.eq(Mux(takes_start, next_gap, gap + (gap_change << 1))),
                ]
            with m.If(steps):
                twice = (first.squares[number] << 1)[:width]
                m.d.sync += step.eq(Mux(takes_first, twice, step + Cat(low & halves, Const(0, 1), change)))
            of_light = p.highlights and number < p.lights
            results = [lane.numerator[number] if of_light else lane.rest for lane in lanes]
            both(value, gap, results, f"square_{number}")
        for light in range(p.lights):
            line, step, next_step = (
                Signal(signed(p.LINE_FORMAT.width), name=f"{name}_{light}", reset_less=True)
                for name in ("line", "line_step", "next_line_step")
            )
            begin = Cat(Const(0, p.LINE_FORMAT.fraction_bits - 34), start.payload.lines[light]).as_signed()
            with m.If(advance):
                m.d.sync += line.eq(Mux(takes_start, begin, line + (step << 1)))
                with m.If(takes_first):
                    m.d.sync += next_step.eq(first.lines[light])
                with m.If(takes_start):
                    m.d.sync += step.eq(next_step)
            both(line, step, [lane.line[light] for lane in lanes], f"line_{light}")
            if p.takes_heights:
                given = second.lines[light], start.payload.heights[light]
                heights = self._heights(m, light, advance, takes, given, is_pair)
                for number, (lane, away) in enumerate(zip(lanes, heights, strict=True)):
                    show(number, away, lane.away[light], f"away_{light}")
        span = Signal()
        with m.If(advance & takes_start):
            m.d.sync += span.eq(~span)
        show(0, span, lanes[0].span, "span")
        show(1, self._both, lanes[1].span, "span")

    def _heights(
        self, m: Module, light: int, advance: Value, takes: Any, given: Any, is_pair: Value
    ) -> tuple[Value, Value]:
        """Signs of z of a light, in both lanes."""
        p, (step, start) = self.model, given
        width = p.HEIGHT_FORMAT.width
        height, current, following = (
            Signal(signed(width), name=f"{name}_{light}", reset_less=True)
            for name in ("height", "height_step", "next_height_step")
        )
        sign, next_sign = (Signal(name=f"{name}_{light}", reset_less=True) for name in ("sign", "next_sign"))
        begin = Cat(Const(0, width - len(start)), start).as_signed()
        # z times 2^16 has the binary point of a line.
        with m.If(advance):
            with m.If(takes[0]):
                m.d.sync += following.eq(step[6 : 6 + width])
            with m.If(takes[1]):
                m.d.sync += next_sign.eq(self._marks[1 + light])
            with m.If(takes[2]):
                m.d.sync += [current.eq(following), sign.eq(next_sign)]
            m.d.sync += height.eq(Mux(takes[2], begin, height + (current << 1)))
        return height[-1], Mux(is_pair, sign, (height + current)[width - 1])
