"""Spans of the quotient method with several lanes: words of several neighbouring pixels on every cycle."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream

from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.memory import connect_headed_fifo, connect_wide_fifo
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
    """Words of two or four pixels of a span on a cycle; `QuotientLanes` is the bit-accurate model.

    A beat has the next N pixels of a span. The first beat begins at the span's first pixel, at any column.
    The last beat has the rest, 1 to N pixels. A lane without a pixel has words of 0.

    *Setup.* A span of two pixels is a *pair*: its step is the vector at the second pixel, with any scale of
    its own, and its exponent is not read. So the first differences of a pair are the words of the second
    pixel. There are two multipliers for each squared component. The first of them makes starts. The second
    makes first differences in the same cycle, and second differences in a cycle before. So a span of three
    pixels or more takes two cycles. With two lanes no span takes more cycles than it has beats. Spans bring
    their lines, which then need no multiplier. First differences wait in a FIFO, second differences in
    registers.

    Without pairs a span of two pixels takes two cycles, too. Its words are those of `QuotientSpans`. Each
    line then has two multipliers. They take the step in the first cycle of a span, and the start in the last.

    *Accumulators.* Beat j has the pixels ``N j`` to ``N j + N - 1``. With ``D1`` and ``D2`` of
    `QuotientSpans`, three words of each square change from beat to beat:

    ===================== ======================= ============
    word                  at the first beat       a beat
    ===================== ======================= ============
    f(Nj)                 start                   + the step
    step, f(Nj+N) - f(Nj) N D1 + N (N - 1)/2 D2   + N^2 D2
    gap, f(Nj+1) - f(Nj)  D1                      + N D2
    ===================== ======================= ============

    With a first difference F before the half h of a second difference is added, and b, the last bit of
    ``D2 = 2 h + b``, the first step is ``N F + N^2 h + N (N - 1)/2 b``. So it takes one addition. The step's
    register has N F before. An N-th of this register and h are the first gap. An N-th of it and
    ``(N + 1) h + (N/2 + 1) b`` are the following gaps, without the fraction of an N-th. So gaps have no
    accumulators. Differences are taken as in `QuotientSpansUnit`, with beats in place of pixels.

    With four lanes the gap from lane 1 to lane 2 is the gap and D2. Lane 3 is three of these gaps after lane
    0. So lanes 2 and 3 take one adder and one register of D2 for this gap, and three adders for their words.

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
    i, begun
        Those of `QuotientSpansUnit`.
    constants : :py:`In(line_directions_shape(model))`
        As in `QuotientSpansUnit`. Only if there are highlights and no pairs.
    o : :py:`Out(stream.Signature(lane_words_shape(model)))`
        Words of the pixels.

    Source: docs/theory/quotient.md#lanes.
    """

    _registers = 1

    FIRSTS = 4
    """Largest number of waiting first differences."""

    def __init__(self, model: QuotientLanes | None = None, length_bits: int = LENGTH_BITS):
        super().__init__(model or QuotientLanes(), length_bits)
        self._lane_bits = self.model.lanes.bit_length() - 1
        self.initiation_interval = 2
        self.latency += 1
        self.short_latency += 1

    def _output_shape(self) -> data.Layout:
        return lane_words_shape(self.model)

    @property
    def multipliers(self) -> int:
        """Number of multipliers."""
        p = self.model
        return 2 * (sum(map(len, p.squares)) + p.lights * (p.highlights and not p.brings_lines))

    @property
    def spans_inside(self) -> int:
        """Largest number of spans inside."""
        return super().spans_inside + 1

    # Setup.

    def _few_of(self, last: Value) -> Value:
        """Four or five bits, from the index of the last pixel.

        Whether there are two pixels or more; whether there are at most one, two, three beats; with pairs
        whether the span is a pair.
        """
        beats = Cat(last[self._lane_bits :], Const(0, 2))
        few = ~beats.any(), ~beats[1:].any(), ~beats[2:].any() & ~beats[:2].all()
        return Cat(last.any(), *few, *([last[0] & ~last[1:].any()] if self.model.pairs else []))

    def _set_up(self, m: Module, second, first, start: stream.Interface) -> None:
        """Turns, products, sums and shifts, up to differences and starts that wait."""
        p, span, valid = self.model, self.i.payload, self.i.valid
        moves, begun = Signal(name="moves"), Signal(name="has_begun")
        # A longer span takes a cycle for its second differences, and then the cycle that ends every span.
        is_long = span.length[1:].any()
        is_pair = is_long & ~span.length[0] & ~span.length[2:].any() if p.pairs else Const(0)
        is_second = ~begun & is_long & ~is_pair
        ends = begun | ~is_long | is_pair
        m.d.comb += [self.i.ready.eq(moves & ends), self.begun.eq(begun)]
        with m.If(moves):
            m.d.sync += begun.eq(Mux(begun, ~valid, valid & is_second))
        register, delayed, product = self._stages(m, moves)
        # For each stage three signals tell its words: second difference, first difference, start.
        here = [[valid & is_second, valid & is_long & ends, valid & ends]]
        for stage in range(1, self._SHIFTED):
            held = [Signal(name=f"{name}_at_{stage}") for name in ("second", "first", "start")]
            with m.If(moves):
                m.d.sync += [signal.eq(before) for signal, before in zip(held, here[-1], strict=True)]
            here.append(held)

        begin, step = (
            {name: vector[at].as_value() for at, name in enumerate(p.components)}
            for vector in (span.start, span.step)
        )

        def squares(a: dict[str, Value], b: dict[str, Value], kind: str) -> list[Value]:
            found = []
            for number, names in enumerate(p.squares):
                products = [product(a[name], b[name], f"{kind}_{name}") for name in names]
                found.append(register(sum(products[1:], products[0]), f"{kind}_sum_{number}"))
            return found

        at_sums, at_coarse = here[self._SUMS], here[self._SUMS + 1]
        if p.pairs or not p.highlights:
            starts, changes = self._lines(delayed, (begin, step), is_second)
        else:
            keeps = is_second, at_sums[0], moves & at_sums[0]
            starts, changes = self._made_lines(m, (register, delayed, product), (begin, step), keeps)
        to_start = stream.Signature(start.payload.shape()).create(path=("to_start",))
        m.d.comb += [
            to_start.valid.eq(at_sums[2] & moves),
            to_start.payload.length.eq(delayed((span.length - 1)[: self.length_bits], "length", self._SUMS)),
        ]
        sums, words = (*squares(begin, begin, "start"), *starts), to_start.payload
        for total, word in zip(sums, (*words.squares, *words.lines), strict=True):
            m.d.comb += word.eq(total[: len(word)])
        if p.takes_heights:
            for light, height in enumerate(words.heights):
                m.d.comb += height.eq(delayed(begin[f"z{light}"], f"height_{light}", self._SUMS))
        self._few = connect_headed_fifo(m, "starts", to_start, start, self._few_of(words.length), self.DEPTH)

        # The square of the second vector of a pair is shifted as far as that of the first vector.
        before = self._SUMS - 1
        paired = delayed(is_pair, "paired", before) if p.pairs else Const(0)
        exponent = delayed(span.exponent, "exponent", before)
        doubled = Mux(here[before][0], Cat(Const(0, 1), exponent), exponent)[:5]
        amount = register(Mux(paired, 1, doubled), "amount")
        exponent = register(Mux(paired, 0, exponent), f"exponent_{self._SUMS}")
        # Without pairs the lines have the same operands.
        takes_begin = begun if p.pairs else ~is_second
        operand = {name: Mux(takes_begin, begin[name], step[name]) for name in begin}
        shifted = self._shifted(register, (squares(operand, step, "change"), amount), (changes, exponent))
        # Marks of first differences: whether they are of a pair, and signs of the second vector's z.
        signs, marks = [], []
        if p.pairs:
            marks = [delayed(paired, "paired", self._SHIFTED - 1, self._SUMS)]
            signs = [step[f"z{light}"][-1] for light in range(p.lights)] if p.takes_heights else []
        marks += [delayed(sign, f"sign_{light}", self._SHIFTED - 1) for light, sign in enumerate(signs)]
        # First differences of pairs may come on every cycle, so they wait in a FIFO.
        shape = data.StructLayout({"words": first[0].shape(), "marks": len(marks)})
        made, waiting = (stream.Signature(shape).create(path=(name,)) for name in ("made", "waiting"))
        for word, value in zip(
            (*made.payload.words.squares, *made.payload.words.lines), shifted, strict=True
        ):
            m.d.comb += word.eq(value[: len(word)])
        m.d.comb += [
            made.payload.marks.eq(Cat(marks)),
            made.valid.eq(at_coarse[1] & moves),
            first[0].eq(waiting.payload.words),
            first[1].eq(waiting.valid),
        ]
        connect_wide_fifo(m, "firsts", made, waiting, self.FIRSTS)
        self._firsts, self._marks = waiting, waiting.payload.marks if p.pairs else Const(0)
        waits = (at_coarse[0] & second[1]) | (at_coarse[1] & ~made.ready) | (at_sums[2] & ~to_start.ready)
        m.d.comb += moves.eq(~waits)
        with m.If(moves & at_coarse[0]):
            m.d.sync += second[1].eq(1)
            for target, value in zip((*second[0].squares, *second[0].lines), shifted, strict=True):
                m.d.sync += target.eq(value[: len(target)])

    def _lines(self, delayed: Callable, vectors: Any, is_second: Value) -> tuple[list[Value], list[Value]]:
        """Lines of starts and of differences. With second differences it is z times 2^16, if z is taken."""
        p, span, found = self.model, self.i.payload, []
        for kind, vector in zip(("start", "change"), vectors, strict=True):
            lines = []
            for light in range(p.lights):
                height = vector[f"z{light}"]
                if p.brings_lines:
                    line = (span.line if kind == "start" else span.line_step)[light].as_value()
                    if kind == "change" and p.takes_heights:
                        line = Mux(is_second, height << 16, line)
                else:
                    # The constant is `QuotientSpans.ONE`.
                    line = (height << 17) - (height << 1)
                lines.append(delayed(line, f"{kind}_line_{light}", self._SUMS))
            found.append(lines)
        return found[0], found[1]

    def _made_lines(
        self, m: Module, stages: Any, vectors: Any, seconds: Any
    ) -> tuple[list[Value], list[Value]]:
        """Lines from products, of the step in the first cycle of a span and of the start in the last cycle.

        ``seconds`` has three conditions: words of the span are for second differences; so are the sums; the
        sums move on, too. The line of a step waits, because the last cycle of a span may come later.
        """
        (register, delayed, product), (begin, step) = stages, vectors
        is_second, sums_are_second, keeps = seconds
        starts, changes = [], []
        for light in range(self.model.lights):
            products = [
                product(Mux(~is_second, begin[axis], step[axis]), code.as_value(), f"line_{axis}")
                for axis, code in zip((f"x{light}", f"z{light}"), self.constants[light], strict=True)
            ]
            starts.append(register(products[0] + products[1], f"line_sum_{light}"))
            changes.append(Signal.like(starts[-1], name=f"change_line_{light}", reset_less=True))
            with m.If(keeps):
                m.d.sync += changes[-1].eq(starts[-1])
            if self.model.takes_heights:
                height = delayed(step[f"z{light}"], f"change_height_{light}", self._SUMS)
                changes[-1] = Mux(sums_are_second, height << 16, changes[-1])
        return starts, changes

    def _halved(self, takes_first: Value) -> Value:
        return takes_first & ~self._marks[0]

    # Beats.

    def _take(self, m: Module, advance: Value, takes: Any, waits: Any, start: stream.Interface) -> None:
        """Take words of a span when the span before does not need its own words any more. Count beats."""
        # At most one, at most two, at most three beats of a span are left, counting the beat behind the
        # output registers.
        last, two, three = (Signal(name=name, init=1) for name in ("last", "two_left", "three_left"))
        left, valid, shown = (
            Signal(max(self.length_bits - self._lane_bits, 2), name="left"),
            Signal(name="valid"),
            Signal(name="shown"),
        )
        # Whether second and first differences of the next span were taken, and whether they may be taken.
        has_second, self._ready = Signal(name="has_second"), Signal(name="ready")
        may_second, may_first = Signal(name="may_second", init=1), Signal(name="may_first")
        # Whether the last beat of a span has a pixel in each further lane.
        remain = Signal(self.model.lanes - 1, name="remain")
        takes_differences, one, at_most_two, at_most_three, *pair = self._few
        self._starts_pair = pair[0] if pair else Const(0)
        final = start.payload.length
        place = final[: self._lane_bits]
        starts = takes[2] & takes_differences
        starts_three = starts & ~self._starts_pair
        # A span of one or two beats needs no second differences any more when it starts, and a pair no first
        # differences.
        soon_first = may_first | (starts & self._starts_pair)
        m.d.comb += [
            takes[0].eq(waits[0] & (may_second | (starts_three & at_most_two))),
            takes[1].eq(waits[1] & soon_first & (has_second | self._marks[0])),
            self._firsts.ready.eq(advance & takes[1]),
            takes[2].eq(start.valid & last & (self._ready | ~takes_differences)),
            advance.eq(~shown | self.o.ready),
            self.o.valid.eq(shown),
        ]
        following = [
            Mux(takes[2], one, two),
            Mux(takes[2], at_most_two, three),
            Mux(takes[2], at_most_three, three | (left == 3)),
            takes[0] | (has_second & ~starts_three),
            takes[1] | (self._ready & ~starts),
        ]
        with m.If(advance):
            m.d.sync += [
                shown.eq(valid),
                valid.eq(takes[2] | ~last),
                left.eq(Mux(takes[2], final[self._lane_bits :], left - 1)),
                Cat(last, two, three, has_second, self._ready).eq(Cat(following)),
                may_second.eq(following[2] & ~following[3]),
                may_first.eq(following[1] & ~following[4]),
            ]
            with m.If(takes[2]):
                m.d.sync += remain.eq(Cat(place >= lane for lane in range(1, self.model.lanes)))
        self._present = ~last.replicate(len(remain)) | remain

    def _accumulate(self, m: Module, moves: Any, takes: Any, words: Any, start: stream.Interface) -> None:
        """Accumulators of all lanes, from differences and starts that are taken.

        ``moves`` has three conditions: a beat may leave; the half of a second difference is added; steps of
        squares change.
        """
        p, advance, (second, first) = self.model, moves[0], words
        _, takes_first, takes_start = takes
        is_pair, lanes = Signal(name="pair"), self.o.payload

        def show(lane: int, word: Value, result: Any, name: str) -> None:
            """Show a word of a lane on the output, a cycle later."""
            shown = Signal(len(word), name=f"{name}_of_{lane}", reset_less=True)
            with m.If(advance):
                m.d.sync += shown.eq(word if lane == 0 else Mux(self._present[lane - 1], word, 0))
            m.d.comb += Value.cast(result).eq(shown)

        def accumulate(begin: Value, step: Value, gaps: Any, results: Any, name: str) -> None:
            """Accumulate a word, and show it in all lanes."""
            value, base = (Signal.like(begin, name=word, reset_less=True) for word in (name, f"{name}_base"))
            words = (value, base) if p.pairs else (value,)
            with m.If(advance):
                m.d.sync += [word.eq(Mux(takes_start, begin, value + step)) for word in words]
                # The word of the second lane is its base and the gap. The gap of a pair is the whole word.
                with m.If(takes_start & self._starts_pair):
                    m.d.sync += base.eq(0)
            for lane, word in enumerate((value, *self._further(words[-1], *gaps))):
                show(lane, word[: len(value)], results[lane], name)

        if p.pairs:
            with m.If(advance & takes_start):
                m.d.sync += is_pair.eq(self._starts_pair)
        # On the cycle after first differences were taken, the gap of their first beat is made.
        loads = Signal(name="loads")
        with m.If(advance):
            m.d.sync += loads.eq(takes_first)
        for number, begin in enumerate(start.payload.squares):
            differences = second.squares[number], first.squares[number]
            step, *gaps = self._square_steps(m, number, moves, takes, differences, loads)
            of_light = p.highlights and number < p.lights
            results = [lane.numerator[number] if of_light else lane.rest for lane in lanes]
            begin = Cat(Const(0, p.square_format.fraction_bits - 34), begin)
            accumulate(begin, step, gaps, results, f"square_{number}")
        for light in range(p.lights):
            step, next_step = (
                Signal(signed(p.LINE_FORMAT.width), name=f"{name}_{light}", reset_less=True)
                for name in ("line_step", "next_line_step")
            )
            begin = Cat(Const(0, p.LINE_FORMAT.fraction_bits - 34), start.payload.lines[light]).as_signed()
            with m.If(advance):
                with m.If(takes_first):
                    m.d.sync += next_step.eq(first.lines[light])
                with m.If(takes_start):
                    m.d.sync += step.eq(next_step)
            results = [lane.line[light] for lane in lanes]
            accumulate(begin, step << self._lane_bits, (step, step), results, f"line_{light}")
            if p.takes_heights:
                given = second.lines[light], start.payload.heights[light]
                heights = self._heights(m, light, advance, takes, given, is_pair)
                for number, (lane, away) in enumerate(zip(lanes, heights, strict=True)):
                    show(number, away, lane.away[light], f"away_{light}")
        span = Signal()
        with m.If(advance & takes_start):
            m.d.sync += span.eq(~span)
        show(0, span, lanes[0].span, "span")
        for lane in range(1, p.lanes):
            show(lane, self._present[lane - 1], lanes[lane].span, "span")

    def _square_steps(
        self, m: Module, number: int, moves: Any, takes: Any, differences: Any, loads: Value
    ) -> tuple[Value, Value, Value]:
        """Step of a square from beat to beat, and its gaps from lane 0 to lane 1 and from lane 1 to 2."""
        p, bits, (advance, halves, steps), (second, first) = self.model, self._lane_bits, moves, differences
        takes_second, takes_first, _ = takes
        width = p.square_format.width
        change, whole, gap, gap_change = (
            Signal(width, name=f"{name}_{number}", reset_less=True)
            for name in ("change", "whole", "gap", "gap_change")
        )
        # The step has a few bits more, because the gap is made from a part of it.
        step, late = Signal(width + bits, name=f"step_{number}", reset_less=True), gap
        low = Signal(name=f"low_{number}", reset_less=True)
        doubled = Cat(low, change)[:width]
        # The first step takes N (N - 1)/2 times the last bit of the second difference.
        carries = p.lanes * (p.lanes - 1) // 2
        last_bits = [low & halves if carries >> bit & 1 else Const(0, 1) for bit in range(2 * bits)]
        with m.If(advance):
            # Second differences of a later span may wait in ``change`` while a pair takes its words.
            with m.If(takes_first & ~self._marks[0]):
                m.d.sync += whole.eq(doubled)
            with m.If(takes_second):
                m.d.sync += [change.eq(second[1:]), low.eq(second[0]), whole.eq(0)]
            with m.Elif(halves):
                m.d.sync += change.eq(doubled)
            with m.If(takes_first | halves):
                m.d.sync += gap_change.eq(change + Cat(Const(0, bits - 1), whole) + (low & halves))
            with m.If(takes_first & self._marks[0]):
                m.d.sync += gap_change.eq(0)
            following = step[bits:] + gap_change
            with m.If(loads | ~self._ready):
                m.d.sync += gap.eq(following)
        if p.lanes > 2:
            # The gap from lane 1 to lane 2 has a second difference more. It is kept until the next span.
            kept, late = (
                Signal(width, name=f"{name}_{number}", reset_less=True) for name in ("kept", "late")
            )
            with m.If(advance & takes_first & ~self._marks[0]):
                m.d.sync += kept.eq(doubled)
            with m.If(advance & (loads | ~self._ready)):
                m.d.sync += late.eq(following + kept)
        with m.If(steps | (advance & takes_first)):
            all_lanes = first << bits
            m.d.sync += step.eq(Mux(takes_first, all_lanes, step + Cat(*last_bits, change)))
        return step[:width], gap, late

    def _further(self, base: Value, gap: Value, late: Value) -> list[Value]:
        """Words of the further lanes, from the word of lane 0, the gap to lane 1, and the gap from 1 to 2.

        The gaps are ``D1 + 4 j D2`` and ``D1 + (4 j + 1) D2``. Three times the second is ``3 D1 + (12 j + 3)
        D2``, which is the distance from lane 0 to lane 3.
        """
        second = base + gap
        return [second, second + late, base + late + (late << 1)][: self.model.lanes - 1]

    def _heights(
        self, m: Module, light: int, advance: Value, takes: Any, given: Any, is_pair: Value
    ) -> tuple[Value, ...]:
        """Signs of z of a light, in all lanes."""
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
            if p.pairs:
                with m.If(takes[1]):
                    m.d.sync += next_sign.eq(self._marks[1 + light])
                with m.If(takes[2]):
                    m.d.sync += sign.eq(next_sign)
            with m.If(takes[2]):
                m.d.sync += current.eq(following)
            m.d.sync += height.eq(Mux(takes[2], begin, height + (current << self._lane_bits)))
        second, *others = (word[width - 1] for word in self._further(height, current, current))
        return height[-1], Mux(is_pair, sign, second), *others
