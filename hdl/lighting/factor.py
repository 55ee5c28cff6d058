"""Factor unit: the specular term of a light that fades, times the light's factor."""

from typing import ClassVar

from amaranth.hdl import Signal
from amaranth.lib import data

from blysk.golden.lighting.factor import Factor
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["FactorUnit"]


class FactorUnit(PipelinedUnit):
    """Product ``a S`` of a specular term S and a factor a. `Factor` is the bit-accurate model.

    The diffuse term passes beside the product. The latency is 2 cycles (operands, product), the initiation
    interval 1. There is one multiplier of 17 by 17 bits, with registers before and after. Without a factor
    the unit only delays the terms, and has no multiplier.

    Parameters
    ----------
    model : Factor
        Bit-accurate model.
    has_factor : bool
        Whether there is a factor.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse": ..., "specular": ..., "factor": ...})))`
        Terms and factor, ``UQ(0, 17)`` each; ``factor`` only with ``has_factor``.
    o : :py:`Out(stream.Signature(StructLayout({"diffuse": ..., "specular": ...})))`
        Terms, ``UQ(0, 17)``.

    Source: docs/theory/chord.md#local-lights.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "factor_operand": "a",
        "diffuse(_operand)?": "D",
        "specular_operand": "S",
        "product": "a·S",
    }

    def __init__(self, model: Factor | None = None, *, has_factor: bool = True):
        self.model = model or Factor()
        self.has_factor = has_factor
        word = FixedShape(Factor.FORMAT)
        terms = dict.fromkeys(("diffuse", "specular"), word)
        operands = terms | ({"factor": word} if has_factor else {})
        super().__init__(data.StructLayout(operands), data.StructLayout(terms), latency=2)

    def datapath(self, m, operands):
        """Registers of the operands and of the product. The product is cut after its register."""
        diffuse, specular = (
            self.register(m, operands[name], f"{name}_operand") for name in ("diffuse", "specular")
        )
        if self.has_factor:
            specular = specular * self.register(m, operands.factor, "factor_operand")
        result = Signal(self.o.payload.shape())
        product = self.register(m, specular, "product").truncate(Factor.FORMAT.fraction_bits)
        m.d.comb += [
            result.diffuse.eq(self.register(m, diffuse, "diffuse")),
            result.specular.eq(product),
        ]
        return result
