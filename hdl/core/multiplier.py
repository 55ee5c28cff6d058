"""A multiplier that the steps of a sequential unit share."""

from amaranth.hdl import Cat, Module, Signal, Value

from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.fixed import FixedShape, FixedValue

__all__ = ["SteppedMultiplier"]


class SteppedMultiplier:
    """Multiplier, shared by the steps of a sequence, with registers for its operands and its product.

    One cycle after a step its operands are in their registers. Two cycles after the step the exact product is
    in its register. Between steps the operands stay.

    Parameters
    ----------
    m : Module
        Module that gets the registers ``factor`` and ``operand``, ``SQ(1, 17)``, and ``product``,
        ``SQ(2, 34)``.
    step : Value
        Number of the step.
    """

    def __init__(self, m: Module, step: Value):
        self._m, self._step = m, step
        self._taken: list[int] = []
        self._factor = Signal(FixedShape(COMPONENT), name="factor")
        self._operand = Signal(FixedShape(COMPONENT), name="operand")
        exact = self._factor * self._operand
        self.product: FixedValue = Signal(exact.shape(), name="product")
        m.d.sync += self.product.eq(exact)

    def issue(self, at: int, factor: FixedValue, operand: FixedValue) -> None:
        """Give two operands at a step, in the open state or condition of the module."""
        self._taken.append(at)
        with self._m.If(self._step == at):
            self.load(factor, operand)

    def load(self, factor: FixedValue, operand: FixedValue) -> None:
        """Give two operands at any step, in the open state or condition of the module."""
        self._m.d.sync += [self._factor.eq(factor), self._operand.eq(operand)]

    @property
    def free(self) -> Value:
        """Whether the present step issues no operands. Then other operands can be loaded on this cycle."""
        return ~Cat(self._step == at for at in self._taken).any()
