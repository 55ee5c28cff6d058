"""Bisection unit on shared multipliers: the normal half-way between two others ([T] figure 2.6)."""

from amaranth.hdl import Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.core.dataflow import Dataflow, checked_interval
from blysk.hdl.core.dot import dot
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy_fields

__all__ = ["BisectionUnit", "coefficient"]


def coefficient(model: Bisection, power: int, first_step: Value) -> FixedValue:
    """Coefficient of the factor's polynomial.

    Parameters
    ----------
    model : Bisection
        Bit-accurate model.
    power : int
        Power of the coefficient.
    first_step : Value
        Whether the polynomial is that of the first step, for spans of 45 to 90 degrees. A model without a
        first step ignores it.
    """
    codes = []
    for first in (False, True):
        constant, rest = model.polynomial(first)
        number = rest[power - 1] if power else constant
        codes.append(Const(number.codes.item(), signed(number.format.width)))
    code, first_code = codes
    return FixedValue(number.format, code if model.max_angle == 45 else Mux(first_step, first_code, code))


class BisectionUnit(PipelinedUnit):
    """Normal half-way between two normals: ``N = (N_a + N_b) / sqrt(2 + z)``, ``z = 2 N_a . N_b``.

    `Bisection`, the bit-accurate model, has formats, variants and error bounds. It also has the rule for
    spans that are too wide.

    A beat needs ``s + 6`` multiplications: three of the dot product, s Horner steps, three scalings. With an
    initiation interval I, ``ceil((s + 6) / I)`` multipliers share them (`blysk.hdl.core.dataflow`). The
    results are the same for every I.

    Latency and multipliers by interval:

    ======================== == ===== ===== ===== ===== ===== ===== ===== ===== =====
    variant                  s  1     2     3     4     5     6     7     8     9
    ======================== == ===== ===== ===== ===== ===== ===== ===== ===== =====
    90 degrees               3  23, 9 25, 5 26, 3 24, 3 29, 2 27, 2 25, 2 25, 2 38, 1
    45 degrees, degree 2     2  20, 8 22, 4 23, 3 25, 2 24, 2 23, 2 23, 2 29, 1
    45 degrees, degree 1     1  17, 7 19, 4 20, 3 21, 2 19, 2 20, 2 25, 1
    ======================== == ===== ===== ===== ===== ===== ===== ===== ===== =====

    Parameters
    ----------
    model : Bisection
        Bit-accurate model, with degree, widest span and coefficients.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to ``s + 6``. ``None``: ``s + 3``.

    Raises
    ------
    ValueError
        If ``initiation_interval`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_a": ..., "normal_b": ...})))`
        Unit normals, three components ``SQ(1, 17)`` each.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        ``normal_middle``, three components ``SQ(1, 17)``. ``one_minus_cosine`` of the two normals,
        ``SQ(2, 17)``. ``out_of_range``: the normals are further apart than ``max_angle``. The middle is then
        undefined.

    Source: docs/theory/interpolation.md#bisection; [T] 2.1, figure 2.6.
    """

    def __init__(self, model: Bisection | None = None, *, initiation_interval: int | None = None):
        self.model = model or Bisection()
        steps = self.model.steps
        interval = checked_interval(initiation_interval, steps + 6, steps + 3)
        self._graph = Dataflow(interval, low_latency=True)
        self._words = self._describe()
        super().__init__(
            data.StructLayout({"normal_a": normal_shape(), "normal_b": normal_shape()}),
            data.StructLayout(
                {
                    "normal_middle": normal_shape(),
                    "one_minus_cosine": FixedShape(Bisection.ANGLE_FORMAT),
                    "out_of_range": unsigned(1),
                }
            ),
            latency=max(word.stage for word in self._words.values()),
            initiation_interval=interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        read = {name: value(word, self.latency) for name, word in self._words.items()}
        result = Signal(self.o.payload.shape())
        m.d.comb += [
            *copy_fields(result.normal_middle, read, range(3)),
            *copy_fields(result, read, ("one_minus_cosine", "out_of_range")),
        ]
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        a, b = (
            g.input(name, lambda operands, name=name: operands[name]) for name in ("normal_a", "normal_b")
        )
        squared = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        difference = g.register("difference", lambda cosine: squared - cosine, dot(g, "dot", a, b))
        rounded = g.register("difference_rounded", lambda x: x.round_half_up(17), difference)
        u = g.register("u", lambda x: x.saturate(p.ANGLE_FORMAT), rounded, formula="u = 1 − N_a·N_b")
        limits = [FixedValue.constant(p.ANGLE_FORMAT, w.values.item()) for w in (p.widest_narrow, p.widest)]
        first_step = g.register("first_step", lambda u: u > limits[0], u)
        words = {
            "one_minus_cosine": u,
            "out_of_range": g.register("out_of_range", lambda u: u > limits[1], u),
        }
        one = FixedValue.constant(p.OPERAND_FORMAT, p.ONE.values.item())
        cosine = g.register("cosine", lambda u: one - u, u)
        angle = g.register("angle", lambda u: u.saturate(p.OPERAND_FORMAT), u)

        def operand(first_step, cosine, angle):
            cosine = cosine.saturate(p.OPERAND_FORMAT)
            if p.reads_cosine(False):
                return cosine
            if p.max_angle == 45:
                return angle
            return FixedValue(p.OPERAND_FORMAT, Mux(first_step, cosine.as_value(), angle.as_value()))

        x = g.register("x", operand, first_step, cosine, angle)
        # A multiplier has two signed operands of 18 bits. Wired shifts align them.
        product = g.multiply(
            "product_top",
            x,
            first_step,
            right=lambda first: coefficient(p, p.steps, first).scale(1),
            formula=f"c_{p.steps}·x",
        )
        for power in range(p.steps - 1, 0, -1):

            def total(product, first, power=power):
                added = coefficient(p, power, first)
                return (product.scale(-1).round_half_up(18) + added).wrap(p.SUM_FORMAT)

            word = g.register(
                f"total_{power}", total, product, first_step, formula=f"c_{power} + {product.symbol.text}"
            )
            product = g.multiply(f"product_{power}", x, word, right=lambda total: total.scale(1))

        def factor(product, first):
            added = coefficient(p, 0, first)
            return (product.scale(-1).round_half_up(19) + added).wrap(p.FACTOR_FORMAT)

        e = g.register("e", factor, product, first_step, formula=f"c_0 + {product.symbol.text}")
        for c in range(3):
            half_sum = g.register(f"half_sum_{c}", lambda a, b, c=c: (a[c] + b[c]).scale(-1), a, b)
            product = g.multiply(
                f"scaled_{c}", e, half_sum, lambda e: e.scale(2), lambda half: half.truncate(17)
            )
            middle = g.register(
                f"middle_sum_{c}",
                lambda half, product: half + product.scale(-1).truncate(21),
                half_sum,
                product,
            )
            middle = g.register(f"middle_rounded_{c}", lambda middle: middle.round_half_up(17), middle)
            words[c] = g.register(f"middle_{c}", lambda middle: middle.saturate(p.FORMAT), middle)
        return words
