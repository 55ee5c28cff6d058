"""Specular unit ([T] figures 3.6 and 3.7): the cosine-quadratic model with its PROM cutoff."""

from amaranth.hdl import Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.fixed import UQ
from golden.specular import Specular
from golden.unit_vector import ONE_SQUARED

from .fixed import FixedShape, FixedValue
from .stream import PipelinedUnit

__all__ = ["SpecularUnit"]


class SpecularUnit(PipelinedUnit):
    """``max(1 - k (1 - cos gamma), 0)^2``, 0 for a light behind the surface.

    Models, formats, the PROM and the error bound are those of `golden.specular.Specular`, the bit-true twin.

    The latency is 7 clocks (one minus, saturation, shift, saturation, product and cutoff, base, square) and
    the initiation interval is 1. Two multipliers work on every beat; in ``cosquad_lin`` and ``cosquad7`` a
    constant one works out the slope once a frame. The PROM holds 1024 words of 17 bits.

    Parameters
    ----------
    parameters : Specular
        Model and kind of operand.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"operand": ..., "dark": 1})))`
        ``cos gamma`` in ``SQ(4, 34)`` or ``1 - cos gamma`` in ``UQ(1, 25)``; whether the light is behind.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Specular term.
    constants : :py:`In(StructLayout({"exponent": 10}))`
        Exponent, 1 to 1000; stays while beats are inside.

    Source: [T] figures 3.6 and 3.7; [C].
    """

    def __init__(self, parameters: Specular | None = None):
        self.parameters = parameters or Specular()
        super().__init__(
            data.StructLayout({"operand": FixedShape(self.parameters.operand_format), "dark": unsigned(1)}),
            FixedShape(self.parameters.RESULT_FORMAT),
            latency=7,
            constants=data.StructLayout({"exponent": unsigned(self.parameters.EXPONENT_BITS)}),
        )

    def datapath(self, m, operands):
        """The slope takes two clocks, as the operand does before it meets the shift."""
        p, register = self.parameters, self.register
        scale, shift, boundary = self._frame_values(m)

        argument = operands.operand
        if p.operand == "cosine":
            one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
            argument = register(m, one - argument, "one_minus_cosine").truncate(25)
            argument = register(m, argument.saturate(p.ARGUMENT_FORMAT), "argument")
        else:
            argument = register(m, register(m, argument, "operand"), "argument")
        shifted = FixedValue(UQ(10, 26), (Value.cast(argument) << shift)[:36])
        shifted = register(m, shifted.truncate(16), "shifted_wide")
        shifted = register(m, shifted.saturate(p.SHIFTED_FORMAT), "shifted")
        dark = operands.dark
        for stage in range(1, 5):
            dark = register(m, dark, f"dark_{stage}")
        lit = register(m, (shifted <= boundary) & ~dark, "lit")
        product = register(m, shifted * scale, "product").truncate(17)
        # Below the boundary the product is under 1, and 1 - 2^-17 - product is its inverse.
        base = register(m, Mux(lit, ~Value.cast(product)[:17], 0), "base")
        base = FixedValue(p.BASE_FORMAT, base)
        return register(m, base * base, "square").truncate(17)

    def _frame_values(self, m):
        """K, s + 1 and the cutoff: registers that follow the exponent two clocks behind."""
        p, register = self.parameters, self.register
        exponent = FixedValue(UQ(p.EXPONENT_BITS, 0), self.constants.exponent)
        a, b = (FixedValue.constant(term.format, term.values.item()) for term in p.slope_terms)
        slope = register(m, ((a * exponent).truncate(18) + b).wrap(p.SLOPE_FORMAT), "slope")
        code = Value.cast(slope)
        scale, shift = Signal(FixedShape(p.SCALE_FORMAT)), Signal(range(11))
        for s in range(-1, 10):
            with m.If(code[s + 17] if s >= 0 else 1):
                m.d.sync += [Value.cast(scale).eq((code << (9 - s))[10:27]), shift.eq(s + 1)]
        m.submodules.boundaries = prom = Memory(
            shape=p.SHIFTED_FORMAT.width, depth=1 << p.EXPONENT_BITS, init=p.boundaries.codes.tolist()
        )
        port = prom.read_port()
        m.d.comb += port.addr.eq(self.constants.exponent)
        return scale, shift, FixedValue(p.SHIFTED_FORMAT, register(m, port.data, "boundary"))
