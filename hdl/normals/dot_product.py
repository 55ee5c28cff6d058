"""Dot-product unit ([T] figure 2.5): three multipliers and an adder tree."""

from typing import ClassVar

from amaranth.lib import data

from blysk.golden.normals.dot_product import DotProduct
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.pipelined_unit import PipelinedUnit

__all__ = ["DotProductUnit"]


class DotProductUnit(PipelinedUnit):
    """Exact dot product ``a0 b0 + a1 b1 + a2 b2``.

    The sum keeps every bit (``SQ(4, 34)`` for unit vectors), without rounding or overflow.

    The latency is 3 cycles (products, first sum, second sum), the initiation interval 1. The unit has three
    multipliers.

    Parameters
    ----------
    model : DotProduct
        Bit-accurate model, with the number formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"a": ..., "b": ...})))`
        Two vectors of three components.
    o : :py:`Out(stream.Signature(FixedShape))`
        Their dot product.

    Source: docs/theory/interpolation.md#dot-product; [T] figure 2.5.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        r"product_(\d)": r"a_\1·b_\1",
        "partial_sum": "a_0·b_0 + a_1·b_1",
        "last_product": "a_2·b_2",
        "sum": "a·b",
    }

    def __init__(self, model: DotProduct | None = None):
        self.model = model or DotProduct()
        super().__init__(
            data.StructLayout(
                {
                    "a": data.ArrayLayout(FixedShape(self.model.a_format), 3),
                    "b": data.ArrayLayout(FixedShape(self.model.b_format), 3),
                }
            ),
            FixedShape(self.model.result_format),
            latency=3,
        )

    def datapath(self, m, operands):
        """Three products, then the sum of two products, then the sum of all three."""
        products = [
            self.register(m, operands.a[axis] * operands.b[axis], f"product_{axis}") for axis in range(3)
        ]
        partial = self.register(m, products[0] + products[1], "partial_sum")
        last = self.register(m, products[2], "last_product")
        return self.register(m, partial + last, "sum")
