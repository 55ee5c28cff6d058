"""Spans of the quotient method: from vectors of spans to m, w, l and z of a pixel on every cycle."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.bits import select
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import HEADED_FIFO_LATENCY, connect_headed_fifo
from blysk.hdl.cosines.quotient import pixel_words_shape
from blysk.hdl.cosines.quotient_serial_setup import SerialSetup

__all__ = ["QuotientSpansUnit", "line_directions_shape", "vectors_shape"]


def vectors_shape(model: QuotientSpans, length_bits: int = LENGTH_BITS) -> data.StructLayout:
    """Shape of a span: components at the first pixel, their step, the step's exponent, and the length.

    If the model's spans bring lines, ``line`` and ``line_step`` follow: l of each light, see `SpanVectors`.

    Parameters
    ----------
    model : QuotientSpans
        The components of a span: lights, highlights, mirror.
    length_bits : int
        Bits of the length.
    """
    vector = data.ArrayLayout(FixedShape(model.COMPONENT_FORMAT), len(model.components))
    exponent = unsigned(model.EXPONENT_FORMAT.width)
    members = {"start": vector, "step": vector, "exponent": exponent, "length": unsigned(length_bits)}
    if model.brings_lines:
        line = data.ArrayLayout(FixedShape(model.EXACT_LINE_FORMAT), model.lights)
        members |= {"line": line, "line_step": line}
    return data.StructLayout(members)


def line_directions_shape(model: QuotientSpans) -> data.ArrayLayout:
    """Shape of ``sin a`` and ``cos a`` of each light."""
    return data.ArrayLayout(data.ArrayLayout(FixedShape(model.COMPONENT_FORMAT), 2), model.lights)


class QuotientSpansUnit(SerialSetup, wiring.Component):
    """Words of every pixel of spans, first pixel first; `QuotientSpans` is the bit-accurate model.

    *Setup.* The multipliers make ``v·v``, ``v·d`` and ``d·d`` of a span's start v and step d in turns, three
    cycles in all. A span of one pixel needs ``v·v`` alone, and one cycle. Every squared component has a
    multiplier, and every l has two. These are 5 multipliers for a light with highlights of N·H, 6 with
    highlights of R·V, and 4 more for each further light. Without highlights there are 3. Differences wait in
    registers behind the shifts, and starts wait in a memory of `DEPTH` words. So the differences of a span
    pass the starts of the spans before it.

    *Serial setup.* One multiplier makes all products of a span one after the other. There are three turns:
    for second differences, for first differences, for the start. Each turn waits until the words of its kind
    from the span before were taken. A turn has P products: two for each line and one for each square. A span
    takes 3 P cycles, or ``P + 6`` if it has one pixel. All sums share one shifter, and a start waits in
    registers.

    *Accumulators.* Second differences are taken while the last three pixels of a span leave. First
    differences are taken with the last two pixels, the start with the last pixel. So spans follow each other
    without a gap. A run of spans takes as many cycles as pixels, if at most a third of the spans have two
    pixels. The first addition takes half of a second difference. So ``D1 = 2 v·d + d·d`` takes no adder.

    The first pixel of a span is on the output `latency` cycles after an empty unit has accepted the span. For
    a span of one pixel these are `short_latency` cycles. Payloads are registers.

    Parameters
    ----------
    model : QuotientSpans
        Bit-accurate model.
    length_bits : int
        Bits of the length.
    serial : bool
        Whether all products share one multiplier.

    Members
    -------
    i : :py:`In(stream.Signature(vectors_shape(model, length_bits)))`
        Spans of length 1 or more. A span is accepted with its last turn, so a span of two pixels or more
        waits. Payload and constants have to stay from the first cycle on which the span is valid. Valid may
        fall.
    o : :py:`Out(stream.Signature(pixel_words_shape(model)))`
        Words of pixels, and a bit that alternates from span to span, 1 in the first span.
    constants : :py:`In(line_directions_shape(model))`
        Only with highlights: ``sin a`` and ``cos a`` of each light, constant while spans are inside.
    begun : :py:`Out(1)`
        Whether words of the offered span were taken already.

    Source: docs/theory/quotient.md#span.
    """

    DEPTH = 16
    """Largest number of waiting starts."""

    _registers = 2
    """Kinds of differences that wait in registers."""

    _SUMS, _SHIFTED = 3, 5
    """Stages of the sums, and of the shifted differences."""

    def __init__(
        self, model: QuotientSpans | None = None, length_bits: int = LENGTH_BITS, serial: bool = False
    ):
        self.model = p = model or QuotientSpans()
        self.length_bits, self.serial = length_bits, serial
        self.latency = self._SHIFTED + (1 if serial else 2)
        self.short_latency = self.latency if serial else self._SUMS + HEADED_FIFO_LATENCY + 1
        self.initiation_interval = 3 * self._products if serial else 3
        members = {
            "i": In(stream.Signature(vectors_shape(p, length_bits))),
            "o": Out(stream.Signature(self._output_shape())),
            "begun": Out(1),
        }
        if p.highlights and not p.brings_lines:
            members["constants"] = In(line_directions_shape(p))
        super().__init__(members)

    @property
    def _products(self) -> int:
        """Products of a turn of the serial setup. Without highlights the lines have a constant factor."""
        p = self.model
        return sum(len(names) for names in p.squares) + p.lights * (2 if p.highlights else 1)

    @property
    def multipliers(self) -> int:
        """Number of multipliers."""
        p = self.model
        return 1 if self.serial else self._products - p.lights * (not p.highlights)

    @property
    def spans_inside(self) -> int:
        """Largest number of spans inside."""
        return 2 if self.serial else self.DEPTH + self._SUMS + 2

    def elaborate(self, platform):
        """Turns of the setup, and the accumulators with the words that they take."""
        m = Module()
        p = self.model
        # Registers of differences that wait, and the FIFO of starts.
        waiting = data.StructLayout(
            {
                "squares": data.ArrayLayout(unsigned(p.square_format.width), len(p.squares)),
                "lines": data.ArrayLayout(signed(p.LINE_FORMAT.width), p.lights),
            }
        )
        second, first = (Signal(waiting, name=name, reset_less=True) for name in ("second", "first"))
        second_waits, first_waits = (Signal(name=f"{name}_waits") for name in ("second", "first"))
        start = stream.Signature(self._start_shape()).create(path=("start",))
        advance = Signal()
        takes_second, takes_first, takes_start = takes = [
            Signal(name=f"takes_{name}") for name in ("second", "first", "start")
        ]
        m.d.comb += start.ready.eq(advance & takes_start)
        taken = advance & takes_second, advance & takes_first, start.ready
        for waits, is_taken in list(zip((second_waits, first_waits), taken, strict=False))[: self._registers]:
            with m.If(is_taken):
                m.d.sync += waits.eq(0)
        if self.serial:
            self._set_up_serially(m, taken, (second, second_waits), (first, first_waits), start)
        else:
            self._set_up(m, (second, second_waits), (first, first_waits), start)
        self._take(m, advance, takes, (second_waits, first_waits), start)
        # On the cycle after the first difference was taken, half of the second difference is added.
        halves, ready = Signal(name="halves"), self._ready
        with m.If(advance):
            m.d.sync += halves.eq(self._halved(takes_first))
        steps = advance & (halves | ~ready)
        self._accumulate(m, (advance, halves, steps), takes, (second, first), start)
        return m

    def _accumulate(self, m: Module, moves: Any, takes: Any, words: Any, start: stream.Interface) -> None:
        """Accumulators of all words, from differences and starts that are taken.

        ``moves`` has three conditions: a pixel may leave; the half of a second difference is added; first
        differences of squares change.
        """
        p, pixel = self.model, self.o.payload
        (advance, halves, steps), (second, first) = moves, words
        takes_second, takes_first, takes_start = takes
        for number in range(len(p.squares)):
            names = (f"{name}_{number}" for name in ("square", "difference", "change"))
            value, difference, change = (
                Signal(p.square_format.width, name=n, reset_less=True) for n in names
            )
            low = Signal(name=f"low_{number}", reset_less=True)
            free = p.square_format.fraction_bits - 34
            with m.If(advance):
                with m.If(takes_second):
                    m.d.sync += [change.eq(second.squares[number][1:]), low.eq(second.squares[number][0])]
                with m.Elif(halves):
                    m.d.sync += change.eq(Cat(low, change))
                begin = Cat(Const(0, free), start.payload.squares[number])
                m.d.sync += value.eq(Mux(takes_start, begin, value + difference))
            with m.If(steps):
                m.d.sync += difference.eq(Mux(takes_first, first.squares[number], difference + change))
            of_light = p.highlights and number < p.lights
            result = pixel.numerator[number] if of_light else pixel.rest
            m.d.comb += Value.cast(result).eq(value)
        for light in range(p.lights):
            line, step = (
                Signal(signed(p.LINE_FORMAT.width), name=f"{name}_{light}", reset_less=True)
                for name in ("line", "line_step")
            )
            begin = Cat(Const(0, p.LINE_FORMAT.fraction_bits - 34), start.payload.lines[light]).as_signed()
            with m.If(advance):
                m.d.sync += line.eq(Mux(takes_start, begin, line + step))
                with m.If(takes_first):
                    m.d.sync += step.eq(first.lines[light])
            m.d.comb += Value.cast(pixel.line[light]).eq(line)
            if p.takes_heights:
                given = second.lines[light], start.payload.heights[light]
                m.d.comb += pixel.away[light].eq(self._height(m, light, advance, takes, given))
        span = Signal()
        with m.If(advance & takes_start):
            m.d.sync += span.eq(~span)
        m.d.comb += pixel.span.eq(span)

    def _output_shape(self) -> data.Layout:
        """Shape of an output beat."""
        return pixel_words_shape(self.model)

    def _start_shape(self) -> data.StructLayout:
        """Shape of a start: sums without the fraction bits of differences, z, and the length."""
        p = self.model
        free = p.square_format.fraction_bits - 34
        members = {
            "squares": data.ArrayLayout(unsigned(p.square_format.width - free), len(p.squares)),
            "lines": data.ArrayLayout(
                signed(p.LINE_FORMAT.width - p.LINE_FORMAT.fraction_bits + 34), p.lights
            ),
            "length": unsigned(self.length_bits),
        }
        if p.takes_heights:
            members["heights"] = data.ArrayLayout(signed(p.COMPONENT_FORMAT.width), p.lights)
        return data.StructLayout(members)

    def _set_up(self, m: Module, second, first, start: stream.Interface) -> None:
        """Turns, products, sums and shifts, up to the registers of differences and the memory of starts."""
        p, span, moves = self.model, self.i.payload, Signal(name="moves")
        place = {name: index for index, name in enumerate(p.components)}
        # The turns are starts, second differences, first differences. Registers hold the turn, because it
        # drives the multiplexers of all operands.
        begun, is_second, ends = (Signal(name=name) for name in ("has_begun", "is_second", "ends"))
        valid, is_long = self.i.valid, span.length[1:].any()
        m.d.comb += [
            ends.eq(Mux(begun, ~is_second, ~is_long)),
            self.i.ready.eq(moves & ends),
            self.begun.eq(begun),
        ]
        # The enable of these registers comes from registers alone. Valid and length come late in a cycle.
        with m.If(moves):
            m.d.sync += [
                begun.eq(Mux(begun, is_second | ~valid, valid & is_long)),
                is_second.eq(Mux(begun, is_second & ~valid, valid & is_long)),
            ]

        register, delayed, product = self._stages(m, moves)
        # For each stage three signals tell the kind of its word: second difference, first difference, start.
        here = [[self.i.valid & turn for turn in (is_second, begun & ~is_second, ~begun)]]
        for stage in range(1, self._SHIFTED):
            held = [Signal(name=f"{name}_at_{stage}") for name in ("second", "first", "start")]
            with m.If(moves):
                m.d.sync += [signal.eq(before) for signal, before in zip(held, here[-1], strict=True)]
            here.append(held)

        begin, step = (
            {name: vector[at].as_value() for name, at in place.items()} for vector in (span.start, span.step)
        )
        a = {name: Mux(is_second, step[name], begin[name]) for name in place}
        b = {name: Mux(begun, step[name], begin[name]) for name in place}
        squares = []
        for number, names in enumerate(p.squares):
            products = [product(a[name], b[name], f"square_{name}") for name in names]
            squares.append(register(sum(products[1:], products[0]), f"sum_{number}"))
        lines = [self._line(register, product, light, b, is_second) for light in range(p.lights)]

        # Starts leave with the sums.
        payload = start.payload
        to_start = stream.Signature(payload.shape()).create(path=("to_start",))
        m.d.comb += [
            to_start.valid.eq(here[self._SUMS][2] & moves),
            to_start.payload.length.eq(delayed(span.length, "length", self._SUMS)),
        ]
        for total, word in zip(
            (*squares, *lines), (*to_start.payload.squares, *to_start.payload.lines), strict=True
        ):
            m.d.comb += word.eq(total[: len(word)])
        if p.takes_heights:
            for light, height in enumerate(to_start.payload.heights):
                m.d.comb += height.eq(delayed(begin[f"z{light}"], f"height_{light}", self._SUMS))
        # The condition on which a start is taken is in a register.
        few = self._few_of(to_start.payload.length)
        self._few = connect_headed_fifo(m, "starts", to_start, start, few, self.DEPTH)

        # Differences are shifted by their exponent. Second differences of squares are shifted by twice the
        # exponent.
        at_sums, at_coarse = here[self._SUMS], here[self._SUMS + 1]
        before = delayed(span.exponent, "exponent", self._SUMS - 1)
        amounts = before, Mux(here[self._SUMS - 1][0], Cat(Const(0, 1), before), before)[:5]
        exponent = register(amounts[0], f"exponent_{self._SUMS}")
        amount = register(amounts[1], "amount")
        shifted = self._shifted(register, (squares, amount), (lines, exponent))
        # Second differences wait until both differences of the span before are taken.
        m.d.comb += moves.eq(~((at_coarse[0] & first[1]) | (at_sums[2] & ~to_start.ready)))
        for which, (word, waits) in enumerate((second, first)):
            with m.If(moves & at_coarse[which]):
                m.d.sync += waits.eq(1)
                for target, value in zip((*word.squares, *word.lines), shifted, strict=True):
                    m.d.sync += target.eq(value[: len(target)])

    @staticmethod
    def _stages(m: Module, moves: Value) -> tuple[Callable, Callable, Callable]:
        """Functions that make a register, a chain of registers, and a product in registers."""

        def register(value, name):
            result = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            with m.If(moves):
                m.d.sync += result.eq(value)
            return result

        def delayed(value, name, last, first=1):
            for stage in range(first, last + 1):
                value = register(value, f"{name}_{stage}")
            return value

        def product(a, b, name):
            return register(register(a, f"{name}_a") * register(b, f"{name}_b"), name)

        return register, delayed, product

    def _halved(self, takes_first: Value) -> Value:
        """Whether half of a second difference is added on the next cycle."""
        return takes_first

    def _shifted(self, register: Callable, squares: Any, lines: Any) -> list[Value]:
        """Differences from sums of products and their shifts."""
        p, ((squares, amount), (lines, exponent)) = self.model, (squares, lines)
        left, more = p.square_format.fraction_bits - 33, p.LINE_FORMAT.fraction_bits - 34
        return [
            *(self._shift(register, total, left, amount, f"square_{k}") for k, total in enumerate(squares)),
            *(self._shift(register, total, more, exponent, f"line_{k}") for k, total in enumerate(lines)),
        ]

    @staticmethod
    def _few_of(length: Value) -> Value:
        """Three bits: whether a span has at least two pixels, at most two pixels, at most three pixels."""
        return Cat(length[1:].any(), ~length[2:].any() & ~length[:2].all(), ~length[2:].any())

    def _line(
        self, register: Callable, product: Callable, light: int, b: dict[str, Value], is_second
    ) -> Value:
        """Sum of the products of l. With second differences it is z times 2^16, if z is taken."""
        p = self.model
        if not p.highlights:
            height = b[f"z{light}"]
            scaled = register(register((height << 17) - (height << 1), f"scaled_{light}"), f"late_{light}")
            return register(scaled, f"line_sum_{light}")
        sine, cosine = (part.as_value() for part in self.constants[light])
        if p.takes_heights:
            # Gates choose here. From a choice of constants Yosys makes resets, which multipliers do not have.
            kept = (~is_second).replicate(len(sine))
            sine, cosine = sine.as_unsigned() & kept, cosine.as_unsigned() & kept
            sine, cosine = sine.as_signed(), Cat(cosine[:16], cosine[16] | is_second, cosine[17]).as_signed()
        x, z = (
            product(b[f"{axis}{light}"], factor, f"line_{axis}{light}")
            for axis, factor in zip("xz", (sine, cosine), strict=True)
        )
        return register(x + z, f"line_sum_{light}")

    def _shift(self, register: Callable, total: Value, left: int, amount: Value, name: str) -> Value:
        """``(total << left) >> amount``, with a register after the coarse shift."""
        word, high = total << left, amount[2:]
        coarse = register(select([word >> (4 * k) for k in range(1 << len(high))], high), f"{name}_coarse")
        low = register(amount[:2], f"{name}_low")
        return select([coarse >> k for k in range(4)], low)

    def _take(self, m: Module, advance: Value, takes: Any, waits: Any, start: stream.Interface) -> None:
        """Take words of a span when the span before does not need its own words any more. Count pixels."""
        # Three bits: at most one, at most two, at most three pixels of a span are left. The pixel on the
        # output counts.
        last, two, three = (Signal(name=name, init=1) for name in ("last", "two_left", "three_left"))
        left, valid = Signal(self.length_bits, name="left"), Signal(name="valid")
        # Whether second and first differences of the next span were taken, and whether they may be taken.
        has_second, self._ready = Signal(name="has_second"), Signal(name="ready")
        may_second, may_first = Signal(name="may_second", init=1), Signal(name="may_first")
        # The span of the waiting start: whether it has at least two pixels, at most two, at most three.
        is_long, at_most_two, at_most_three = self._few
        m.d.comb += [
            takes[0].eq(waits[0] & may_second),
            takes[1].eq(waits[1] & may_first),
            takes[2].eq(start.valid & last & (self._ready | ~is_long)),
            advance.eq(~valid | self.o.ready),
            self.o.valid.eq(valid),
        ]
        starts_long = takes[2] & is_long
        following = [
            Mux(takes[2], ~is_long, two),
            Mux(takes[2], at_most_two, three),
            Mux(takes[2], at_most_three, three | (left == 4)),
            (takes[0] | has_second) & ~starts_long,
            (takes[1] | self._ready) & ~starts_long,
        ]
        with m.If(advance):
            m.d.sync += [
                valid.eq(takes[2] | ~last),
                left.eq(Mux(takes[2], start.payload.length, left - 1)),
                Cat(last, two, three, has_second, self._ready).eq(Cat(following)),
                may_second.eq(following[2] & ~following[3]),
                may_first.eq(following[1] & following[3] & ~following[4]),
            ]

    def _height(self, m: Module, light: int, advance: Value, takes: Any, given: Any) -> Value:
        """Sign of z of a light."""
        p, (step, start) = self.model, given
        width = p.HEIGHT_FORMAT.width
        height, current, following = (
            Signal(signed(width), name=f"{name}_{light}", reset_less=True)
            for name in ("height", "height_step", "next_height_step")
        )
        begin = Cat(Const(0, width - len(start)), start).as_signed()
        # z times 2^16 has the binary point of a line. Both differences may be taken on the same cycle.
        given = Mux(takes[0], step[6 : 6 + width], following)
        with m.If(advance):
            m.d.sync += following.eq(given)
            with m.If(takes[1]):
                m.d.sync += current.eq(given)
            m.d.sync += height.eq(Mux(takes[2], begin, height + current))
        return height[-1]
