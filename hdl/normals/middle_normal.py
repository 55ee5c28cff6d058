"""Middle normal of a span through the h polynomial ([T] 2.2) on shared multipliers."""

from amaranth.hdl import Signal, unsigned
from amaranth.lib import data

from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.hdl.core.dataflow import Dataflow, checked_interval
from blysk.hdl.core.dot import dot
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy_fields

__all__ = ["MiddleNormalUnit"]

_MULTIPLICATIONS = 9
"""Multiplications of a span: three of the dot product, three Horner steps, three scalings by e."""


class MiddleNormalUnit(PipelinedUnit):
    """Middle normal ``N_c = h(r) (N_l + N_r)``, ``h = 1/sqrt(2 (1 + r))`` as a polynomial.

    `MiddleNormal`, the bit-accurate model, has formats, fits, error bound and flag. The default fit is exact
    at angle 0.

    A span needs nine multiplications: three of the dot product, three Horner steps, three scalings. With an
    initiation interval I, ``ceil(9 / I)`` multipliers share them (`blysk.hdl.core.dataflow`). The results are
    the same for every I.

    =========== == == == == == == == == ==
    interval    1  2  3  4  5  6  7  8  9
    =========== == == == == == == == == ==
    latency     26 28 29 28 30 34 30 28 39
    multipliers 9  5  3  3  2  2  2  2  1
    =========== == == == == == == == == ==

    Parameters
    ----------
    model : MiddleNormal
        Bit-accurate model, with the fit of h.
    initiation_interval : int or None
        Cycles from an input to the next, 1 to 9. ``None``: 6.

    Raises
    ------
    ValueError
        If ``initiation_interval`` is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left": ..., "normal_right": ...})))`
        Unit normals of the span's ends, three components ``SQ(1, 17)`` each.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        The same two normals, and ``normal_middle`` in ``SQ(1, 19)``. ``out_of_range``: the span is wider than
        45 degrees. Its middle normal is then undefined.

    Source: docs/theory/interpolation.md#middle-normal; [T] 2.2.
    """

    def __init__(self, model: MiddleNormal | None = None, *, initiation_interval: int | None = None):
        self.model = model or MiddleNormal()
        interval = checked_interval(initiation_interval, _MULTIPLICATIONS, 6)
        self._graph = Dataflow(interval)
        self._words = self._describe()
        ends = {"normal_left": normal_shape(), "normal_right": normal_shape()}
        super().__init__(
            data.StructLayout(ends),
            data.StructLayout(
                {
                    **ends,
                    "normal_middle": data.ArrayLayout(FixedShape(MiddleNormal.FORMAT), 3),
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
            *copy_fields(result, read, ("normal_left", "normal_right", "out_of_range")),
            *copy_fields(result.normal_middle, read, range(3)),
        ]
        return result

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        left, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right")
        )
        cosine = dot(g, "cosine", left, right)
        one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        difference = g.register("difference", lambda cosine: one - cosine, cosine)
        bits = p.ANGLE_FORMAT.fraction_bits
        u = g.register("u", lambda x: x.truncate(bits).saturate(p.ANGLE_FORMAT), difference)
        widest = FixedValue.constant(p.ANGLE_FORMAT, p.widest.values.item())
        out_of_range = g.register("out_of_range", lambda u: u > widest, u)

        # A multiplier has two signed operands of at most 18 bits; wired shifts align them.
        c1, c2, c3 = (FixedValue.constant(p.SUM_FORMAT, value) for value in p.coefficients.values.tolist())
        product = g.multiply("product_3", u, u, right=lambda _: c3)
        for power, c in ((2, c2), (1, c1)):
            rounded = g.register(f"rounded_{power}", lambda product: product.round_half_up(19), product)
            total = g.register(f"total_{power}", lambda x, c=c: (x + c).wrap(p.SUM_FORMAT), rounded)
            product = g.multiply(f"product_{power}", u, total)

        def factor(product):
            e = product.round_half_up(21)
            if constant := p.constant.values.item():
                e = e + FixedValue.constant(p.factor_format, constant)
            return e.saturate(p.factor_format)

        e = g.register("e", factor, product, formula=f"c_0 + {product.symbol.text}")
        words = {"normal_left": left, "normal_right": right, "out_of_range": out_of_range}
        for c in range(3):
            half_sum = g.register(
                f"half_sum_{c}", lambda a, b, c=c: (a[c] + b[c]).scale(-1), left, right, since=e
            )
            product = g.multiply(f"scaled_{c}", e, half_sum, right=_cut)
            middle = g.register(f"middle_sum_{c}", _corrected, half_sum, product)
            words[c] = g.register(f"middle_{c}", lambda middle: middle.saturate(p.FORMAT), middle)
        return words


def _cut(half_sum: FixedValue) -> FixedValue:
    """Operand of a scaling."""
    return half_sum.truncate(17).saturate(COMPONENT)


def _corrected(half_sum: FixedValue, product: FixedValue) -> FixedValue:
    """Half sum plus ``2 e`` times the half sum."""
    return half_sum + product.scale(1).round_half_up(19)
