"""Recurrence unit ([T] figure 3.5): two cosines of equal steps, one product a pixel each."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.fixed import SQ, UQ
from golden.recurrence import Recurrence
from golden.unit_vector import COMPONENT

from .fixed import FixedShape, FixedValue

__all__ = ["RecurrenceUnit"]

_COPIES = ("diffuse", "highlight")


class RecurrenceUnit(wiring.Component):
    """``x(k) = A cos(phase - k d)``, once for the diffuse and once for the highlight term of a span.

    The two copies share the coefficient register and the counter, which marks the last pixel of a span.
    Forms, formats and error bound are those of `golden.recurrence.Recurrence`, the bit-true twin.

    Every pixel needs the one before, so that the registers of the loop cannot be filled with other pixels:
    ``reinsch`` gives a pixel every 4 clocks (product, two stages of shift, sums), ``direct`` every 3
    (product, sum, saturation). A span of m pixels gives its first pixel 3 clocks after it was taken in; the
    next span is taken in ``4 (m - 1) + 1`` (``3 (m - 1) + 1``) clocks after it. A span of length 0 takes one
    clock and gives nothing. Two multipliers, one a copy.

    Parameters
    ----------
    parameters : Recurrence
        Form and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse", "highlight", "coefficient", "shift", "length"})))`
        Of each copy ``first`` and ``second`` in `Recurrence.state_format`: x(0), and x(1) - x(0) in
        ``reinsch``, x(1) in ``direct``. Coefficient; shift, in ``reinsch`` alone; length 0 to 4095.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse", "highlight", "last"})))`
        Both cosines in ``SQ(1, 17)``; whether this is the last pixel of its span.

    Source: [T] 3.3, figure 3.5.
    """

    latency = 3

    def __init__(self, parameters: Recurrence | None = None):
        self.parameters = p = parameters or Recurrence()
        self.clocks_per_pixel = 4 if p.form == "reinsch" else 3
        start = data.StructLayout(dict.fromkeys(("first", "second"), FixedShape(p.state_format)))
        span = {**dict.fromkeys(_COPIES, start), "coefficient": FixedShape(p.coefficient_format)}
        if p.form == "reinsch":
            span["shift"] = unsigned(p.SHIFT_BITS)
        span["length"] = unsigned(p.LENGTH_BITS)
        pixel = {**dict.fromkeys(_COPIES, FixedShape(COMPONENT)), "last": unsigned(1)}
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout(span))),
                "o": Out(stream.Signature(data.StructLayout(pixel))),
            }
        )

    def elaborate(self, platform):
        """Counters, coefficient, the loop of each copy, and two registers for rounding and saturation."""
        m = Module()
        p, span = self.parameters, self.i.payload
        active, after, phase = Signal(), Signal(p.LENGTH_BITS), Signal(range(self.clocks_per_pixel))
        is_first = Signal()
        advance, load = Signal(), Signal()
        m.d.comb += [
            advance.eq(~self.o.valid | self.o.ready),
            self.i.ready.eq(advance & (after == 0)),
            load.eq(self.i.valid & self.i.ready),
        ]
        ends = phase == self.clocks_per_pixel - 1
        rounded_valid, rounded_last = Signal(), Signal()
        coefficient = Signal(FixedShape(p.coefficient_format))
        shift = Signal(p.SHIFT_BITS)
        with m.If(advance):
            m.d.sync += [
                rounded_valid.eq(active & (phase == 0)),
                rounded_last.eq(after == 0),
                self.o.valid.eq(rounded_valid),
                self.o.payload.last.eq(rounded_last),
            ]
            with m.If(load):
                m.d.sync += [
                    active.eq(span.length != 0),
                    after.eq(Mux(span.length == 0, 0, span.length - 1)),
                    is_first.eq(1),
                    coefficient.eq(span.coefficient),
                ]
                if p.form == "reinsch":
                    m.d.sync += shift.eq(span.shift)
            with m.Elif(after == 0):
                m.d.sync += active.eq(0)
            with m.Else():
                m.d.sync += phase.eq(Mux(ends, 0, phase + 1))
                with m.If(ends):
                    m.d.sync += [after.eq(after - 1), is_first.eq(0)]
            for name in _COPIES:
                if p.form == "reinsch":
                    rounded = self._reinsch(m, name, load, ends, is_first, coefficient, shift)
                else:
                    rounded = self._direct(m, name, load, ends, is_first, coefficient)
                register = Signal(rounded.shape(), name=f"{name}_rounded")
                m.d.sync += [register.eq(rounded), self.o.payload[name].eq(register.saturate(COMPONENT))]
        return m

    def _reinsch(self, m, name, load, ends, is_first, coefficient, shift):
        """``D -= K 2^(2-s) x; x += D``, with x + D, for the old D, summed up beforehand."""
        p, start = self.parameters, self.i.payload[name]
        state = p.state_format
        x, difference, total = (
            Signal(FixedShape(state), name=f"{name}_{word}") for word in ("x", "difference", "sum")
        )
        operand = x.truncate(p.fraction_bits)
        product = Signal(FixedShape(operand.format * p.coefficient_format), name=f"{name}_product")
        bend = product.scale(2).extend(p.bend_format)
        coarse, fine = (
            Signal(FixedShape(p.bend_format), name=f"{name}_{word}") for word in ("coarse", "fine")
        )
        fine_shift = FixedValue(p.bend_format, Value.cast(coarse) >> shift[:3])
        step = fine.truncate(state.fraction_bits)
        m.d.sync += [
            product.eq(operand * coefficient),
            coarse.eq(FixedValue(p.bend_format, Value.cast(bend) >> Cat(Const(0, 3), shift[3:]))),
            # The difference from the first value to the second is given.
            Value.cast(fine).eq(Mux(is_first, 0, Value.cast(fine_shift))),
            total.eq((x + difference).wrap(state)),
        ]
        half_step = FixedValue.constant(state, 2.0 ** -(p.fraction_bits + 1))
        with m.If(load):
            m.d.sync += [x.eq((start.first + half_step).wrap(state)), difference.eq(start.second)]
        with m.Elif(ends):
            m.d.sync += [x.eq((total - step).wrap(state)), difference.eq((difference - step).wrap(state))]
        exchange = FixedValue.constant(p.exchange.format, p.exchange.values.item())
        return (x + exchange).truncate(COMPONENT.fraction_bits)

    def _direct(self, m, name, load, ends, is_first, coefficient):
        """``x(k+1) = -(-2 cos d) x(k) - x(k-1)``; for the first pixel the other register holds x(1)."""
        p, start = self.parameters, self.i.payload[name]
        state = p.state_format
        x, other = (Signal(FixedShape(state), name=f"{name}_{word}") for word in ("x", "other"))
        product = Signal(FixedShape(state * p.coefficient_format), name=f"{name}_product")
        half_step = FixedValue.constant(UQ(-state.fraction_bits, state.fraction_bits + 1), state.step / 2)
        base = Signal((half_step - other).shape(), name=f"{name}_base")
        total = Signal((base - product).shape(), name=f"{name}_sum")
        m.d.sync += [product.eq(x * coefficient), base.eq(half_step - other), total.eq(base - product)]
        with m.If(load):
            m.d.sync += [x.eq(start.first), other.eq(start.second)]
        with m.Elif(ends):
            following = total.truncate(state.fraction_bits).saturate(state)
            m.d.sync += [
                Value.cast(x).eq(Mux(is_first, Value.cast(other), Value.cast(following))),
                other.eq(x),
            ]
        bits = COMPONENT.fraction_bits
        value = x.extend(SQ(2, bits)) if state.fraction_bits < bits else x
        return value.round_half_up(bits)
