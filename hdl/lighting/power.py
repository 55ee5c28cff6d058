"""Exact power unit: Blinn's highlight by square and multiply."""

from functools import reduce
from operator import or_
from typing import ClassVar, Literal

from amaranth.hdl import Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.lighting.power import Power
from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.lighting.specular import highlight_shape, one_minus

__all__ = ["PowerUnit"]


class PowerUnit(PipelinedUnit):
    """Specular term ``max(cos gamma, 0)^n``, or 0 for a dark beat. The ports are those of `SpecularUnit`.

    The bit-accurate model `Power` has method, formats and error bound.

    The pipelined form has an initiation interval of 1 and 18 multipliers. Its latency is 32 cycles:
    difference from 1, saturation, and three for each bit of the exponent. The sequential form has one
    multiplier for nine squares and ten products. Its latency is 44 cycles, its initiation interval 42. All
    multipliers have 17 by 17 bits.

    Parameters
    ----------
    model : Power
        Bit-accurate model: kind of operand.
    form : str
        ``"pipelined"`` or ``"sequential"``.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"operand": ..., "dark": 1})))`
        ``cos gamma`` in ``SQ(4, 34)`` or ``1 - cos gamma`` in ``UQ(1, 25)``. ``dark``: the light is behind
        the surface, or the span has no highlight. The term is then 0.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Specular term.
    constants : :py:`In(StructLayout({"exponent": 10}))`
        Exponent, 1 to 1000, constant while beats are inside.

    Raises
    ------
    ValueError
        If the form is unknown.

    Source: docs/theory/units.md#exact-power; [B] 3.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "one_minus_cosine": "u",
        "x_0": "u",
        r"x_(\d+)": r"x_\1 = 1 − (1 − u)^(2^\1)",
        "s_1": "s_1 = n_0·x_0",
        r"s_(\d+)": r"s_\1, of \1 bits of n",
        r"x_(\d+)_product": r"x_\1²",
        r"x_(\d+)_sum": r"2·x_\1",
        r"x_(\d+)_difference": r"2·x_\1 − x_\1²",
        r"s_(\d+)_product": r"s_\1·x_\1",
        r"s_(\d+)_sum": r"s_\1 + x_\1",
        r"s_(\d+)_difference": r"s_\1 + x_\1 − s_\1·x_\1",
        "s_(kept|late)_0": "x_0",
        r"([xs])_(\d+)_(kept|late)": r"\1_\2",
        "factor_0": "s or x",
        "factor_1": "x",
        "product": "s·x or x²",
        "total": "s + x − s·x",
    }

    def __init__(self, model: Power | None = None, *, form: Literal["pipelined", "sequential"] = "pipelined"):
        if form not in ("pipelined", "sequential"):
            raise ValueError(f"form must be 'pipelined' or 'sequential', not {form!r}")
        self.model = p = model or Power()
        self.form = form
        super().__init__(
            highlight_shape(p),
            FixedShape(p.RESULT_FORMAT),
            latency=32 if form == "pipelined" else 44,
            initiation_interval=1 if form == "pipelined" else 42,
            constants=data.StructLayout({"exponent": unsigned(p.EXPONENT_BITS)}),
        )

    def datapath(self, m, operands):
        """Complement of the cosine in two cycles, then the bits of the exponent, lowest first."""
        p, register = self.model, self.register
        complement = one_minus(p, operands.operand).extend(SQ(5, 34))
        complement = register(m, complement, "one_minus_cosine")
        dark = register(m, operands.dark, "dark")
        start = Mux(dark, p.COMPLEMENT_FORMAT.max_code, Value.cast(complement.saturate(p.COMPLEMENT_FORMAT)))
        start = FixedValue(p.COMPLEMENT_FORMAT, start[: p.COMPLEMENT_FORMAT.width])
        s = self._pipelined(m, start) if self.form == "pipelined" else self._sequential(m, start)
        return FixedValue(p.RESULT_FORMAT, ~Value.cast(s)[17:])

    def _pipelined(self, m, start):
        """A bit takes three cycles: product, difference, saturation. Squares and products are in parallel."""
        p, register = self.model, self.register
        format = p.COMPLEMENT_FORMAT
        x = register(m, start, "x_0")
        s = None
        for bit in range(p.EXPONENT_BITS):
            is_set = self.constants.exponent[bit]
            if s is None:
                # s is 0 before the first bit, so the first step needs no product.
                kept = register(m, x, "s_kept_0")
                kept = register(m, kept, "s_late_0")
                next_s = register(m, FixedValue(format, Mux(is_set, Value.cast(kept), 0)[:34]), "s_1")
            else:
                both, kept = self._products(m, s, x, f"s_{bit}")
                taken = Mux(is_set, Value.cast(both.saturate(format)), Value.cast(kept))
                next_s = register(m, FixedValue(format, taken[:34]), f"s_{bit + 1}")
            if bit < p.EXPONENT_BITS - 1:
                square, _ = self._products(m, x, x, f"x_{bit}")
                x = register(m, square.saturate(format), f"x_{bit + 1}")
            s = next_s
        return s

    _SUM = UQ(1, 34)
    """Format of ``p + q - p q``: at least 0, and at most slightly above 1, because factors are cut."""

    def _products(self, m, p, q, name):
        """``p + q - p q`` two cycles later, registered, and ``p`` at the same stage."""
        register = self.register
        product = register(m, p.truncate(17) * q.truncate(17), f"{name}_product")
        total = register(m, p + q, f"{name}_sum")
        kept = register(m, p, f"{name}_kept")
        difference = register(m, (total - product).wrap(self._SUM), f"{name}_difference")
        return difference, register(m, kept, f"{name}_late")

    def _sequential(self, m, start):
        """The square of bit j starts at stage 3 + 4j, its product at 4 + 4j. Both end four cycles later."""
        p, at, register = self.model, self.at, self.register
        format = p.COMPLEMENT_FORMAT
        bits = range(p.EXPONENT_BITS)
        x, s = (Signal(FixedShape(format), name=name) for name in "xs")

        def any_at(stages):
            return reduce(or_, (at(stage) for stage in stages))

        factors = [Signal(FixedShape(p.FACTOR_FORMAT), name=f"factor_{k}") for k in range(2)]
        with m.If(any_at(4 + 4 * bit for bit in bits)):
            m.d.sync += factors[0].eq(s.truncate(17))
        with m.Else():
            m.d.sync += factors[0].eq(x.truncate(17))
        m.d.sync += factors[1].eq(x.truncate(17))
        product = register(m, factors[0] * factors[1], "product")
        is_product = any_at(6 + 4 * bit for bit in bits)
        other = FixedValue(format, Mux(is_product, Value.cast(s), Value.cast(x))[:34])
        total = register(m, (x + other - product).wrap(self._SUM), "total").saturate(format)
        with m.If(at(2)):
            m.d.sync += [x.eq(start), s.eq(FixedValue.constant(format, 0))]
        for bit in bits:
            with m.If(at(6 + 4 * bit)):
                m.d.sync += x.eq(total)
            with m.If(at(7 + 4 * bit) & self.constants.exponent[bit]):
                m.d.sync += s.eq(total)
        return s
