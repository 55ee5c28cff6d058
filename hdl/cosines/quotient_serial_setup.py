"""Serial setup of the quotient method: one multiplier makes all products of a span."""

import itertools
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream

from blysk.hdl.core.bits import select

__all__ = ["SerialSetup"]


class SerialSetup:
    """The setup of `QuotientSpansUnit` in the compact style, as a part of this unit."""

    def _set_up_serially(self, m: Module, taken: Any, second, first, start: stream.Interface) -> None:
        """Products one after the other, their sums, one shift, and the registers in which sums wait.

        A turn begins while no words of its kind are inside, so that nothing behind the multiplier waits.
        """
        p, span = self.model, self.i.payload
        place = {name: index for index, name in enumerate(p.components)}
        begin, change = (
            {name: vector[at].as_value() for name, at in place.items()} for vector in (span.start, span.step)
        )
        squares = [name for names in p.squares for name in names]
        factors = self._factors()
        sizes = [*map(len, p.squares), *[len(factors) // p.lights] * p.lights]
        lasts = [sum(sizes[: k + 1]) - 1 for k in range(len(sizes))]
        steps = lasts[-1] + 1

        # The turns are second differences, first differences, the start.
        kinds = data.StructLayout({"second": 1, "first": 1, "start": 1})
        note = data.StructLayout({"turn": kinds, "step": range(steps)})
        busy, made = Signal(kinds, name="busy"), Signal(2, name="made")
        step, ends = Signal(range(steps), name="step"), Signal(name="ends")
        is_start = made[1] | ~span.length[1:].any()
        turn = Cat(~made[0] & ~is_start, made[0] & ~is_start, is_start)
        may_go = step.any() | ~(busy.as_value() & turn).any()
        goes = self.i.valid & may_go
        notes = [Signal(note, name=f"note_{stage}") for stage in range(self._SHIFTED)]
        m.d.comb += [
            ends.eq(step == steps - 1),
            # Spans without a pixel are not valid here. A pipeline drops them before.
            self.i.ready.eq(Mux(span.length.any(), may_go & ends & is_start, ~self.begun)),
            self.begun.eq(step.any() | made.any()),
            notes[0].turn.as_value().eq(Mux(goes, turn, 0)),
            notes[0].step.eq(step),
        ]
        m.d.sync += [after.eq(before) for before, after in itertools.pairwise(notes)]
        with m.If(goes):
            m.d.sync += step.eq(Mux(ends, 0, step + 1))
            with m.If(ends):
                m.d.sync += made.eq(Mux(is_start, 0, Cat(1, made[0])))
        multiplied, shifting = notes[2], notes[4]

        def register(value, name):
            result = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            m.d.sync += result.eq(value)
            return result

        left = [Mux(turn[0], change[name], begin[name]) for name in squares]
        left += [Mux(turn[0], later, factor)[:18] if p.highlights else factor for _, factor, later in factors]
        right = [Mux(is_start, begin[name], change[name]) for name in (*squares, *(f[0] for f in factors))]
        a, b = (
            register(select([word.as_unsigned() for word in words], step).as_signed(), name)
            for words, name in ((left, "factor"), (right, "component"))
        )
        product = register(a * b, "product")
        total = Signal(signed(len(product) + 2), name="total", reset_less=True)
        continues = ~Cat(multiplied.step == last + 1 for last in (-1, *lasts[:-1])).any()
        m.d.sync += total.eq(Mux(continues, total, 0) + product)
        # The payload stays for the turn of the start, while the last differences are shifted.
        twice = multiplied.turn.second & (multiplied.step < len(squares))
        exponent = Mux(multiplied.turn.start, 0, span.exponent)
        amount = register(Mux(twice, Cat(Const(0, 1), exponent), exponent)[:5], "amount")
        free, more = p.square_format.fraction_bits - 34, p.LINE_FORMAT.fraction_bits - 34
        shifted = self._shift(register, total, free + 1, amount, "total")

        words, start_waits = Signal(self._start_shape(), name="start_words"), Signal(name="start_waits")
        self._few, length = Signal(3, name="few"), span.length
        m.d.comb += [start.payload.eq(words), start.valid.eq(start_waits)]
        with m.If(taken[2]):
            m.d.sync += start_waits.eq(0)
        with m.If(goes & ends & is_start):
            m.d.sync += [words.length.eq(length), self._few.eq(self._few_of(length))]
            if p.takes_heights:
                m.d.sync += [word.eq(begin[f"z{light}"]) for light, word in enumerate(words.heights)]
        for kind, (word, waits) in enumerate((second, first, (words, start_waits))):
            arrives = shifting.turn.as_value()[kind]
            lows = (0, free + 1 - more) if kind < 2 else (free + 1, free + 1)
            targets = [(target, lows[0]) for target in word.squares]
            targets += [(target, lows[1]) for target in word.lines]
            for last, (target, low) in zip(lasts, targets, strict=True):
                with m.If(arrives & (shifting.step == last)):
                    m.d.sync += target.eq(shifted[low : low + len(target)])
            with m.If(arrives & (shifting.step == steps - 1)):
                m.d.sync += waits.eq(1)
            with m.If(taken[kind]):
                m.d.sync += busy.as_value()[kind].eq(0)
            with m.If(goes & turn[kind]):
                m.d.sync += busy.as_value()[kind].eq(1)

    def _factors(self) -> list[tuple[str, Value, Any]]:
        """For each product of a line: component, factor, and factor in the turn of second differences.

        If z is taken, z times 2^16 comes with the second differences.
        """
        p = self.model
        if not p.highlights:
            return [(f"z{light}", Const(p.ONE, signed(18)), None) for light in range(p.lights)]
        pairs = [zip("xz", self.constants[light], (0, 1 << 16), strict=True) for light in range(p.lights)]
        return [
            (f"{axis}{light}", part.as_value(), later)
            for light, of_light in enumerate(pairs)
            for axis, part, later in of_light
        ]
