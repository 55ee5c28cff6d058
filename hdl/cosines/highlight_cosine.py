"""Highlight-cosine unit ([T] 3.2): an angle accumulator, a quarter-wave table and a multiplier."""

from typing import ClassVar

from amaranth.hdl import Cat, EnableInserter, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.core.views import choose

__all__ = ["HighlightCosineUnit", "highlight_shape"]


def highlight_shape() -> data.StructLayout:
    """Shape of a prepared span: lambda, ``psi/(m-1)`` and cos beta, and the length m in pixels."""
    return data.StructLayout(
        {
            "phase": FixedShape(HighlightCosine.PHASE_FORMAT),
            "step": FixedShape(HighlightCosine.STEP_FORMAT),
            "cos_beta": FixedShape(HighlightCosine.COS_BETA_FORMAT),
            "length": unsigned(HighlightCosine.LENGTH_BITS),
        }
    )


class HighlightCosineUnit(wiring.Component):
    """Operand ``1 - cos gamma`` of a pixel a cycle, with ``cos gamma(t) = cos beta cos(lambda - t psi)``.

    `HighlightCosine`, the bit-accurate model, defines beta and lambda. It has table, formats and error
    bounds.

    The first value of a span comes 12 cycles after the span is accepted. The stages are accumulator, folding,
    table and its register, rise, sum, operand, product, alignment, rounding, sum, saturation. The values of
    the other pixels come in the following cycles, unless the output is stalled. The next span is accepted
    early enough to leave no gap. A span of length 0 takes one cycle and has no value. The unit has a
    multiplier of 17 x 17 bits. With interpolation it also has a multiplier of 14 x 14 bits.

    Parameters
    ----------
    model : HighlightCosine
        Bit-accurate model, with the table.

    Members
    -------
    i : :py:`In(stream.Signature(highlight_shape()))`
        Spans.
    o : :py:`Out(stream.Signature(UQ(1, 25)))`
        ``1 - cos gamma``.

    Source: docs/theory/interpolation.md#angular-method; [T] 3.2.
    """

    latency = 12

    FORMULAS: ClassVar[dict[str, str]] = {
        "product_8": "v·β",
        "term_10": "v·β",
    }

    def __init__(self, model: HighlightCosine | None = None):
        self.model = model or HighlightCosine()
        super().__init__(
            {
                "i": In(stream.Signature(highlight_shape())),
                "o": Out(stream.Signature(FixedShape(HighlightCosine.RESULT_FORMAT))),
            }
        )

    def elaborate(self, platform):
        """Describe the counter, the accumulator and the stages after it, which share one enable."""
        m = Module()
        phase_format = HighlightCosine.PHASE_FORMAT
        theta, step = Signal(FixedShape(phase_format)), Signal(FixedShape(HighlightCosine.STEP_FORMAT))
        cos_beta = Signal(FixedShape(HighlightCosine.COS_BETA_FORMAT))
        valid = Signal(self.latency - 1)
        advance, load = Signal(), Signal()
        span = self.i.payload
        active, ends = count_down(m, self.i.valid, span.length, advance)
        m.d.comb += [self.i.ready.eq(advance & ends), load.eq(self.i.valid & self.i.ready)]
        with m.If(advance):
            m.d.sync += valid.eq(Cat(active, valid[:-1]))
            with m.If(load):
                m.d.sync += [theta.eq(span.phase), step.eq(span.step), cos_beta.eq(span.cos_beta)]
            with m.Elif(active):
                m.d.sync += theta.eq((theta - step).wrap(phase_format))
        inner = Module()
        result = self._wave(inner, Value.cast(theta).as_unsigned(), cos_beta)
        m.submodules.wave = EnableInserter(advance)(inner)
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid[-1], result))
        return m

    def _wave(self, m, theta, cos_beta):
        """Registers of the stages 2 to 12."""
        p, register = self.model, PipelinedUnit.register
        carried = {"beta": cos_beta}

        def carry(stage):
            for name in carried:
                carried[name] = register(m, carried[name], f"{name}_{stage}")

        # Inverted bits replace the negative, which would need a carry. The error is 2^-40 turns.
        magnitude = Mux(theta[39], ~theta, theta)[:39]
        angle = register(m, Mux(magnitude[38], ~magnitude, magnitude)[:38], "angle_2")
        carried["back"] = magnitude[38]
        carry(2)

        values, rises = p.table
        bits = p.rise_format.width if p.interpolated else 0
        m.submodules.table = table = Memory(
            shape=p.TABLE_VALUE_FORMAT.width + bits,
            depth=1 << p.address_bits,
            init=(values.codes << bits | rises.codes).tolist(),
        )
        port = table.read_port()
        below = 38 - p.address_bits
        m.d.comb += port.addr.eq(angle[below:])
        if p.interpolated:
            carried["fraction"] = angle[below - p.FRACTION_BITS : below]
        carry(3)
        entry = register(m, port.data, "entry_4")
        carry(4)
        carried["value"] = entry[bits:]
        if p.interpolated:
            fraction = FixedValue(UQ(0, p.FRACTION_BITS), carried.pop("fraction"))
            rise = register(m, fraction * FixedValue(p.rise_format, entry[:bits]), "rise_5")
            carry(5)
            v = FixedValue(p.TABLE_VALUE_FORMAT, carried.pop("value"))
            v = register(m, v + rise.round_half_up(22), "v_6").saturate(p.TABLE_VALUE_FORMAT)
        else:
            carry(5)
            v = FixedValue(p.TABLE_VALUE_FORMAT, register(m, carried.pop("value"), "v_6"))
        factor = register(m, carried["beta"].round_half_up(16), "factor_6")
        carry(6)
        carried["near"] = ~Value.cast(v)[17:].any()
        far = v.round_half_up(17).saturate(p.FAR_FORMAT)
        operand = Mux(carried["near"], Value.cast(v)[:17], Value.cast(far))
        operand = FixedValue(p.FAR_FORMAT, register(m, operand, "operand_7"))
        factor = register(m, factor.saturate(p.FACTOR_FORMAT), "factor_7")
        carry(7)
        product = register(m, operand * factor, "product_8")
        carry(8)
        aligned = Mux(carried.pop("near"), Value.cast(product)[12:], Value.cast(product)[7:])
        aligned = FixedValue(UQ(1, 26), register(m, aligned[:27], "aligned_9"))
        one = FixedValue.constant(UQ(1, 25), 1)
        beta = carried.pop("beta")
        minus, plus = (one - beta).extend(SQ(3, 25)), (one + beta).extend(SQ(3, 25))
        base = choose(carried["back"], plus, minus)
        carried["base"] = base
        carry(9)
        term = register(m, aligned.round_half_up(25), "term_10")
        carry(10)
        base = carried["base"]
        added, subtracted = base + term, base - term
        total = Mux(carried["back"], Value.cast(subtracted), Value.cast(added))
        total = FixedValue(added.format, register(m, total, "total_11"))
        return register(m, total.saturate(p.RESULT_FORMAT), "result_12")
