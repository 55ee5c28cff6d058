"""Arccos unit ([T] 3.3, table 3.1)."""

from typing import ClassVar, Literal

import numpy as np
from amaranth.hdl import Array, Cat, Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.cosines.arccos import Arccos
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["ArccosUnit"]


class ArccosUnit(PipelinedUnit):
    """Arccosine in radians: ``c0 + x (c1 + c2 x)``, in five segments. For x < 0 it is ``pi - arccos(-x)``.

    `Arccos`, the bit-accurate model of both forms, has tables, formats and error bounds.

    *Sequential*, as published: c0 is loaded into the accumulator and ``c2 x`` into a register. Then
    ``(c2 x) x`` and ``c1 x`` are added. The latency is 15 cycles, the initiation interval 4. There is one
    multiplier of 18 x 17 bits.

    *Pipelined*: Horner's order. The results are equal to the bit, because ``c1 + c2 x`` is exact. The latency
    is 14 cycles, the initiation interval 1. There are two multipliers of 18 x 17 bits.

    Parameters
    ----------
    model : Arccos
        Bit-accurate model, with the table.
    form : str
        ``"pipelined"`` or ``"sequential"``.

    Members
    -------
    i : :py:`In(stream.Signature(SQ(2, 16)))`
        Cosine.
    o : :py:`Out(stream.Signature(StructLayout({"angle": UQ(2, 16), "outside": 1})))`
        Angle in radians. ``outside``: the cosine was outside [-1, 1] and has been clamped.

    Raises
    ------
    ValueError
        If the form is unknown.

    Source: docs/theory/interpolation.md#arccos; [T] 3.3, table 3.1.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "product_5": "c_2·x",
        "scaled_6": "c_2·x",
        "slope_7": "c_1 + c_2·x",
        "product_8": "x·(c_1 + c_2·x)",
        "aligned_9": "x·(c_1 + c_2·x)",
        r"total_1\d": "c_0 + x·(c_1 + c_2·x)",
        "magnitude": "|x|",
        r"x_\d+": "|x|",
        r"c(\d)_\d+": r"c_\1",
        r"angle\w*": "arccos x",
    }

    def __init__(
        self, model: Arccos | None = None, *, form: Literal["pipelined", "sequential"] = "pipelined"
    ):
        if form not in ("pipelined", "sequential"):
            raise ValueError(f"form must be 'pipelined' or 'sequential', not {form!r}")
        self.model = model or Arccos()
        self.form = form
        pipelined = form == "pipelined"
        super().__init__(
            FixedShape(Arccos.OPERAND_FORMAT),
            data.StructLayout({"angle": FixedShape(Arccos.RESULT_FORMAT), "outside": unsigned(1)}),
            latency=14 if pipelined else 15,
            initiation_interval=1 if pipelined else 4,
        )

    def datapath(self, m, operands):
        """Describe the registers from the magnitude of x to the saturation of the angle."""
        p, register = self.model, self.register
        code = Value.cast(operands)
        negative = register(m, code[-1], "negative_1")
        magnitude = register(m, Mux(code[-1], -code, code)[:18], "magnitude")
        one = p.MAGNITUDE_FORMAT.code(1)
        negative = register(m, negative, "negative_2")
        outside = register(m, magnitude > one, "outside_2")
        x = register(m, Mux(magnitude > one, one, magnitude)[:17], "x_2")

        negative = register(m, negative, "negative_3")
        outside = register(m, outside, "outside_3")
        segment = register(m, sum(x >= int(bound) for bound in p.bounds), "segment_3")
        x = register(m, x, "x_3")
        if self.form == "pipelined":
            flags, total = self._pipelined(m, x, segment, Cat(negative, outside))
        else:
            flags, total = self._sequential(m, x, segment, Cat(negative, outside))

        pi = FixedValue.constant(p.SUM_FORMAT, np.floor(np.ldexp(np.pi, 32) + 0.5) / 2.0**32)
        signed_angle = Mux(flags[0], Value.cast(pi) - total, total)[: p.SUM_FORMAT.width]
        exact = register(m, signed_angle, "angle_exact")
        rounded = register(m, FixedValue(p.SUM_FORMAT, exact).round_half_up(16), "angle_rounded")
        angle = register(m, rounded.saturate(p.RESULT_FORMAT), "angle")
        outside = flags[1]
        for stage in range(3):
            outside = register(m, outside, f"outside_late_{stage}")
        result = Signal(self.o.payload.shape())
        m.d.comb += [result.angle.eq(angle), result.outside.eq(outside)]
        return result

    def _coefficients(self, segment):
        """Words ``c0, c1, c2`` of a segment, to be read into registers."""
        return [
            Array(Const(int(code), signed(width)) for code in column)[segment]
            for column, width in zip(
                self.model.codes.T, (self.model.CONSTANT_FORMAT.width, 18, 18), strict=True
            )
        ]

    def _aligned(self, product, segment):
        """Product of a segment's word and x with 32 fraction bits."""
        shifts = self.model.integer_bits - 2
        return Array((product << int(shift))[: self.model.SUM_FORMAT.width].as_signed() for shift in shifts)[
            segment
        ]

    def _pipelined(self, m, x, segment, flags):
        register = self.register
        c0, c1, c2 = (
            register(m, word, f"c{power}_4") for power, word in enumerate(self._coefficients(segment))
        )
        carried = {"x": x, "segment": segment, "flags": flags, "c0": c0, "c1": c1}

        def carry(stage, *names):
            for name in names:
                carried[name] = register(m, carried[name], f"{name}_{stage}")

        carry(4, "x", "segment", "flags")
        product = register(m, c2 * carried["x"], "product_5")
        carry(5, "x", "segment", "flags", "c0", "c1")
        scaled = register(m, _rounded(product), "scaled_6")
        carry(6, "x", "segment", "flags", "c0", "c1")
        slope = register(m, (scaled + carried["c1"])[:18].as_signed(), "slope_7")
        carry(7, "x", "segment", "flags", "c0")
        product = register(m, slope * carried["x"], "product_8")
        carry(8, "segment", "flags", "c0")
        # A register follows the shift, and another register follows the sum.
        aligned = register(m, self._aligned(product, carried["segment"]), "aligned_9")
        carry(9, "flags", "c0")
        total = register(m, (aligned + (carried["c0"] << 16))[:43].as_signed(), "total_10")
        carry(10, "flags")
        total = register(m, total, "total_11")
        carry(11, "flags")
        return carried["flags"], total

    def _sequential(self, m, x, segment, flags):
        """Words are ready at stage 5, on which ``c2 x`` starts.

        ``c1 x`` starts at stage 6, and ``(c2 x) x`` at stage 8. The sum is ready at stage 12.
        """
        at, register = self.at, self.register
        c0, c1, c2 = (
            register(m, word, f"c{power}", when=at(4))
            for power, word in enumerate(self._coefficients(segment))
        )
        x = register(m, x, "x_held", when=at(4))
        segment = register(m, segment, "segment_held", when=at(4))
        segment_late = register(m, segment, "segment_late", when=at(8))
        flags = register(m, flags, "flags_held", when=at(4))
        flags = register(m, flags, "flags_late", when=at(8))
        word, operand = Signal(signed(18)), Signal(17)
        product = register(m, word * operand, "product")
        scaled = register(m, _rounded(product), "scaled", when=at(7))
        for stage, factor in ((5, c2), (6, c1), (8, scaled)):
            with m.If(at(stage)):
                m.d.sync += [word.eq(factor), operand.eq(x)]
        aligned = register(m, self._aligned(product, Mux(at(8), segment, segment_late)), "aligned")
        total = Signal(signed(43))
        with m.If(at(8)):
            m.d.sync += total.eq(c0 << 16)
        with m.If(at(9) | at(11)):
            m.d.sync += total.eq(total + aligned)
        return flags, total


def _rounded(product):
    """Product of a word and x, rounded half up to the format of the word."""
    return ((product >> 16) + product[15])[:18].as_signed()
