"""Recurrence unit ([T] figure 3.5): cosines of equally spaced angles, by one product for each pixel."""

from typing import ClassVar

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import choose, copy

__all__ = ["RecurrenceUnit"]

_COPIES = ("diffuse", "highlight")


class RecurrenceUnit(wiring.Component):
    """Cosines ``x(k) = A cos(phase - k d)`` along a span, one for the diffuse and one for the specular term.

    `Recurrence`, the bit-accurate model, has forms, formats and the error bound. Both cosines share the
    register of the coefficient and the counter, which marks the last pixel of a span.

    With ``interleave`` 1 every pixel depends on the pixel before it. So the registers of the loop hold one
    pixel at a time. ``reinsch`` gives a pixel every 4 cycles: product, two stages of shift, sums. ``direct``
    gives a pixel every 3 cycles: product, sum, saturation. After a span of m pixels the next span is accepted
    ``4 (m - 1) + 1`` cycles later, with ``direct`` ``3 (m - 1) + 1`` cycles later.

    With ``interleave`` 4 every pixel depends on the fourth pixel before it. The four phases follow each other
    through the four registers of the loop. So there is a pixel in every cycle. A span takes m cycles, and the
    next span follows without a gap.

    In both cases the first pixel comes 3 cycles after its span is accepted. A span of length 0 takes one
    cycle and has no pixel. There are two multipliers, one for each cosine, by default of 18 x 18 bits.

    Parameters
    ----------
    model : Recurrence
        Bit-accurate model: form and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse", "highlight", "coefficient", "shift", "length"})))`
        For each cosine ``first`` and ``second`` in `Recurrence.state_format`. ``first`` is x(0). ``second``
        is x(1) - x(0) in ``reinsch``, and x(1) in ``direct``. If interleaved, they are arrays of four, see
        `Recurrence.start`. The coefficient, the shift (only in ``reinsch``), and the length, 0 to 4095.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse", "highlight", "last"})))`
        Both cosines in `Recurrence.result_format`. ``last``: the pixel is the last of its span.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.3, figure 3.5.
    """

    latency = 3

    FORMULAS: ClassVar[dict[str, str]] = {
        r"\w+_product": "K·x",
        r"\w+_(coarse|fine)": "K·2^(2 − s)·x",
        r"\w+_sum": "x + D",
        r"\w+_difference": "D",
        r"(\w+)_x": "x",
    }

    def __init__(self, model: Recurrence | None = None):
        self.model = p = model or Recurrence()
        self.cycles_per_pixel = 1 if p.interleave > 1 else {"reinsch": 4, "direct": 3}[p.form]
        word = FixedShape(p.state_format)
        if p.interleave > 1:
            word = data.ArrayLayout(word, p.interleave)
        start = data.StructLayout(dict.fromkeys(("first", "second"), word))
        span = {**dict.fromkeys(_COPIES, start), "coefficient": FixedShape(p.coefficient_format)}
        if p.form == "reinsch":
            span["shift"] = unsigned(p.SHIFT_BITS)
        span["length"] = unsigned(p.LENGTH_BITS)
        pixel = {**dict.fromkeys(_COPIES, FixedShape(p.result_format)), "last": unsigned(1)}
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout(span))),
                "o": Out(stream.Signature(data.StructLayout(pixel))),
            }
        )

    def elaborate(self, platform):
        """Describe counters, coefficient, the loop of each cosine, and registers that round and saturate."""
        m = Module()
        p, span = self.model, self.i.payload
        active, after, phase = Signal(), Signal(p.LENGTH_BITS), Signal(range(self.cycles_per_pixel))
        is_first = Signal()
        rounded_valid, rounded_last, valid = Signal(), Signal(), Signal()
        result = Signal(self.o.payload.shape())
        advance, load = Signal(), Signal()
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, result)),
            self.i.ready.eq(advance & (after == 0)),
            load.eq(self.i.valid & self.i.ready),
        ]
        ends = phase == self.cycles_per_pixel - 1
        # If interleaved: whether the next pixels are the first pixels of their phases.
        starting = Signal(p.interleave - 1)
        starts = load | starting[0] if p.interleave > 1 else load
        coefficient = Signal(FixedShape(p.coefficient_format))
        shift = Signal(p.SHIFT_BITS)
        with m.If(advance):
            m.d.sync += [
                rounded_valid.eq(active & (phase == 0)),
                rounded_last.eq(after == 0),
                valid.eq(rounded_valid),
                result.last.eq(rounded_last),
            ]
            with m.If(load):
                m.d.sync += [
                    active.eq(span.length != 0),
                    after.eq(Mux(span.length == 0, 0, span.length - 1)),
                    coefficient.eq(span.coefficient),
                ]
                if p.form == "reinsch":
                    m.d.sync += shift.eq(span.shift)
            with m.Elif(after == 0):
                m.d.sync += active.eq(0)
            with m.Else():
                m.d.sync += phase.eq(Mux(ends, 0, phase + 1))
                with m.If(ends):
                    m.d.sync += after.eq(after - 1)
            with m.If(starts | ends):
                m.d.sync += is_first.eq(starts)
            if p.interleave > 1:
                m.d.sync += starting.eq(Mux(load, (1 << (p.interleave - 1)) - 1, starting >> 1))
            is_first = self._delayed(m, is_first, 2 if p.form == "reinsch" else 3, "is_first")
            for name in _COPIES:
                start = self._start(m, name, load)
                if p.form == "reinsch":
                    rounded = self._reinsch(m, name, start, starts, ends, is_first, coefficient, shift)
                else:
                    rounded = self._direct(m, name, start, starts, ends, is_first, coefficient)
                register = Signal(rounded.shape(), name=f"{name}_rounded")
                m.d.sync += [
                    register.eq(rounded),
                    result[name].eq(register.saturate(p.result_format)),
                ]
        return m

    def _start(self, m, name, load):
        """First and second value of the next phase: from the input, then from registers that hold them."""
        p, payload = self.model, self.i.payload[name]
        if p.interleave == 1:
            return payload.first, payload.second
        words = []
        for which in ("first", "second"):
            held = [
                Signal(FixedShape(p.state_format), name=f"{name}_{which}_{phase}")
                for phase in range(1, p.interleave)
            ]
            for k, word in enumerate(held):
                following = held[min(k + 1, len(held) - 1)]
                given = payload[which][k + 1]
                m.d.sync += copy(word, choose(load, given, following))
            words.append(choose(load, payload[which][0], held[0]))
        return words

    def _delayed(self, m, value, cycles, name):
        """A value some cycles later.

        If not interleaved, this is the value itself, which is constant during its pixel.
        """
        if self.model.interleave > 1:
            for k in range(cycles):
                value = PipelinedUnit.register(m, value, f"{name}_delayed_{k}")
        return value

    def _reinsch(self, m, name, start, starts, ends, is_first, coefficient, shift):
        """Loop of ``D -= K 2^(2-s) x; x += D``. The sum of x and the old D does not wait for the product."""
        p = self.model
        first, second = start
        state = p.state_format
        x, difference, total = (
            Signal(FixedShape(state), name=f"{name}_{word}") for word in ("x", "difference", "sum")
        )
        operand = x.truncate(p.fraction_bits)
        product = Signal(FixedShape(operand.format * p.coefficient_format), name=f"{name}_product")
        curvature = product.scale(2).extend(p.curvature_format)
        coarse, fine = (
            Signal(FixedShape(p.curvature_format), name=f"{name}_{word}") for word in ("coarse", "fine")
        )
        shifted = FixedValue(p.curvature_format, Value.cast(coarse) >> shift[:3])
        step = fine.truncate(state.fraction_bits)
        m.d.sync += [
            product.eq(operand * coefficient),
            coarse.eq(FixedValue(p.curvature_format, Value.cast(curvature) >> Cat(Const(0, 3), shift[3:]))),
            # D(0) comes from the input, so the first pixel takes no product.
            Value.cast(fine).eq(Mux(is_first, 0, Value.cast(shifted))),
            total.eq((x + difference).wrap(state)),
        ]
        total = self._delayed(m, total, 2, f"{name}_sum")
        before = self._delayed(m, difference, 3, f"{name}_difference")
        half_step = FixedValue.constant(state, 2.0 ** -(p.fraction_bits + 1))
        with m.If(starts):
            m.d.sync += [x.eq((first + half_step).wrap(state)), difference.eq(second)]
        with m.Elif(ends):
            m.d.sync += [x.eq((total - step).wrap(state)), difference.eq((before - step).wrap(state))]
        exchange = FixedValue.constant(p.exchange.format, p.exchange.values.item())
        return (x + exchange).truncate(p.result_format.fraction_bits)

    def _direct(self, m, name, start, starts, ends, is_first, coefficient):
        """Loop of ``x(k+1) = -(-2 cos d) x(k) - x(k-1)``.

        ``other`` is x(k-1), and x(1) at the first pixel.
        """
        p = self.model
        first, second = start
        state = p.state_format
        x, other = (Signal(FixedShape(state), name=f"{name}_{word}") for word in ("x", "other"))
        product = Signal(FixedShape(state * p.coefficient_format), name=f"{name}_product")
        half_step = FixedValue.constant(UQ(-state.fraction_bits, state.fraction_bits + 1), state.step / 2)
        base = Signal((half_step - other).shape(), name=f"{name}_base")
        total = Signal((base - product).shape(), name=f"{name}_sum")
        m.d.sync += [product.eq(x * coefficient), base.eq(half_step - other), total.eq(base - product)]
        following = total.truncate(state.fraction_bits).saturate(state)
        # The loop has three registers, and four phases need a fourth register.
        following = self._delayed(m, following, 1, f"{name}_following")
        given = self._delayed(m, other, 3, f"{name}_other")
        before = self._delayed(m, x, 3, f"{name}_x")
        with m.If(starts):
            m.d.sync += [x.eq(first), other.eq(second)]
        with m.Elif(ends):
            m.d.sync += [
                copy(x, choose(is_first, given, following)),
                other.eq(before),
            ]
        bits = p.result_format.fraction_bits
        value = x.extend(SQ(2, bits)) if state.fraction_bits < bits else x
        return value.round_half_up(bits)
