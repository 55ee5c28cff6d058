"""Specular unit ([T] figures 3.6 and 3.7): the cosine-quadratic model with its PROM cutoff, and its kin."""

from amaranth.hdl import Cat, Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.fixed import UQ
from golden.specular import Specular
from golden.unit_vector import ONE_SQUARED

from .fixed import FixedShape, FixedValue
from .stream import PipelinedUnit

__all__ = ["SpecularUnit"]


class SpecularUnit(PipelinedUnit):
    """``max(1 - k (1 - cos gamma), 0)^2`` or a higher power, 0 for a light behind the surface.

    Models, formats, the PROM and the error bound are those of `golden.specular.Specular`, the bit-true twin.

    The latency is 7 clocks (one minus, saturation, shift, saturation, product and cutoff, base, square) and
    the initiation interval is 1. Two multipliers work on every beat; in ``cosquad_lin`` and ``cosquad7`` a
    constant one works out the slope once a frame. The PROM holds 1024 words of 17 bits.

    ``lyon2`` and ``lyon3`` have one and two squarers more, of a clock each; the refitted models a constant
    multiplier for the slope. ``cosquad_q`` has a table of 1024 slopes of 27 bits in its place. ``exp`` has
    for base and square a table of 64 words of 32 bits, a multiplier of 11 by 13 bits and a shift: latency 9.

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
        self.parameters = p = parameters or Specular()
        super().__init__(
            data.StructLayout({"operand": FixedShape(self.parameters.operand_format), "dark": unsigned(1)}),
            FixedShape(self.parameters.RESULT_FORMAT),
            latency=9 if p.model == "exp" else 6 + p.squarings,
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
        product = register(m, shifted * scale, "product")
        if p.model == "exp":
            return self._exponential(m, product.truncate(21).scale(4), lit)
        # Below the boundary the product is under 1, and 1 - 2^-17 - product is its inverse.
        base = register(m, Mux(lit, ~Value.cast(product.truncate(17))[:17], 0), "base")
        base = FixedValue(p.BASE_FORMAT, base)
        for name in ("square", "square_2", "square_3")[: p.squarings]:
            base = register(m, base * base, name).truncate(17)
        return base

    def _exponential(self, m, power, lit):
        """``2^-power``: table, product, difference, shift."""
        p, register = self.parameters, self.register
        code = Value.cast(power)
        start, drop = p.chords
        words = (start.codes | drop.codes << p.VALUE_FORMAT.width).tolist()
        width = p.VALUE_FORMAT.width + p.DROP_FORMAT.width
        m.submodules.chords = table = Memory(shape=width, depth=len(words), init=words)
        port = table.read_port()
        m.d.comb += port.addr.eq(code[11:17])
        start = FixedValue(p.VALUE_FORMAT, port.data[: p.VALUE_FORMAT.width])
        drop = FixedValue(p.DROP_FORMAT, port.data[p.VALUE_FORMAT.width :])
        within = register(m, FixedValue(p.INTERPOLATION_FORMAT, code[:11]), "within")
        descent = register(m, drop * within, "descent")
        start = register(m, start, "start")
        value = register(m, (start - descent.truncate(19)).wrap(p.VALUE_FORMAT), "value")
        control = Cat(code[17:21], lit)
        for stage in range(3):
            control = register(m, control, f"control_{stage}")
        shifted = Mux(control[4], Value.cast(value)[2:] >> control[:4], 0)
        return register(m, FixedValue(p.RESULT_FORMAT, shifted[: p.RESULT_FORMAT.width]), "result")

    def _frame_values(self, m):
        """K, s + 1 and the cutoff: registers that follow the exponent two clocks behind."""
        p, register = self.parameters, self.register
        if p.slope_terms is None:
            m.submodules.slopes = slopes = Memory(
                shape=p.SLOPE_FORMAT.width, depth=1 << p.EXPONENT_BITS, init=p.slopes.codes.tolist()
            )
            port = slopes.read_port()
            m.d.comb += port.addr.eq(self.constants.exponent)
            code = port.data
        else:
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
