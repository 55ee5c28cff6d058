"""Middle normal of a span through the h polynomial ([T] 2.2): a dot product and one shared multiplier."""

from amaranth.hdl import Signal, unsigned
from amaranth.lib import data

from golden.fixed import UQ
from golden.middle_normal import MiddleNormal
from golden.unit_vector import COMPONENT, ONE_SQUARED

from .dot_product import DotProductUnit
from .fixed import FixedShape, FixedValue
from .stream import PipelinedUnit

__all__ = ["MiddleNormalUnit", "normal_shape"]


def normal_shape() -> data.ArrayLayout:
    """Shape of a unit normal: three components ``SQ(1, 17)``."""
    return data.ArrayLayout(FixedShape(COMPONENT), 3)


class MiddleNormalUnit(PipelinedUnit):
    """``N_c = h(r) (N_l + N_r)`` with ``h = 1/sqrt(2 (1 + r))`` as a polynomial that is exact at angle 0.

    Formats, error bound and the flag are those of `golden.middle_normal.MiddleNormal`, the bit-true twin.

    The latency is 25 clocks and the initiation interval 6. Four multipliers: three in the dot product, and
    one that does the three Horner steps and the three scalings of a span in turn, busy on every clock.

    Parameters
    ----------
    parameters : MiddleNormal
        Coefficients and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left": ..., "normal_right": ...})))`
        Unit normals of the span's ends, three components ``SQ(1, 17)`` each.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        The same two normals, ``normal_middle`` in ``SQ(1, 19)``, and ``wide``: the span is wider than 45
        degrees and its middle normal not to be trusted.

    Source: [T] 2.2; the fit of numbers.md.
    """

    def __init__(self, parameters: MiddleNormal | None = None):
        self.parameters = parameters or MiddleNormal()
        ends = {"normal_left": normal_shape(), "normal_right": normal_shape()}
        super().__init__(
            data.StructLayout(ends),
            data.StructLayout(
                {
                    **ends,
                    "normal_middle": data.ArrayLayout(FixedShape(MiddleNormal.FORMAT), 3),
                    "wide": unsigned(1),
                }
            ),
            latency=25,
            initiation_interval=6,
        )

    def datapath(self, m, operands):
        """Ages: dot product 1 to 4, u at 6, Horner steps at 6, 10, 14, e at 17, scalings at 17, 19, 21."""
        p = self.parameters
        at, register = self.at, self.register
        m.submodules.dot_product = dot_product = DotProductUnit()
        m.d.comb += [
            dot_product.i.payload.a.eq(operands.normal_left),
            dot_product.i.payload.b.eq(operands.normal_right),
            dot_product.i.valid.eq(1),
            dot_product.o.ready.eq(1),
        ]
        # Normals and u outlive their register by being copied on before the next beat overwrites it.
        ends = [operands]
        for age in (6, 11, 16, 22):
            ends.append(register(m, ends[-1], f"ends_{age}", when=at(age)))
        one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        difference = register(m, one - dot_product.o.payload, "difference")
        u_first = register(
            m, difference.truncate(p.ANGLE_FORMAT.fraction_bits).saturate(p.ANGLE_FORMAT), "u", when=at(5)
        )
        u_last = register(m, u_first, "u_last", when=at(11))
        widest = FixedValue.constant(p.ANGLE_FORMAT, p.widest.values.item())
        wide = register(m, u_first > widest, "wide_7", when=at(7))
        for age in (13, 19):
            wide = register(m, wide, f"wide_{age}", when=at(age))

        c1, c2, c3 = (FixedValue.constant(p.SUM_FORMAT, value) for value in p.coefficients.values.tolist())
        total = Signal(FixedShape(p.SUM_FORMAT))
        e = Signal(FixedShape(p.FACTOR_FORMAT))
        half_sum = [(ends[3].normal_left[c] + ends[3].normal_right[c]).scale(-1) for c in range(3)]
        half_sum_late = (ends[4].normal_left[2] + ends[4].normal_right[2]).scale(-1)

        # The shared multiplier takes 17 unsigned and 18 signed bits; wired shifts align what it is given.
        factor = Signal(FixedShape(UQ(0, 17)))
        operand = Signal(FixedShape(COMPONENT))
        product = register(m, factor * operand, "product")
        horner, scaled = product.scale(-3), product.scale(-3)
        issues = [(6, u_first.scale(1), c3.scale(2)), (10, u_first.scale(1), total.scale(2))]
        issues += [(14, u_last.scale(1), total.scale(2))]
        issues += [(17 + 2 * c, e.scale(4), half_sum[c].truncate(17).saturate(COMPONENT)) for c in range(3)]
        for age, a, b in issues:
            with m.If(at(age)):
                m.d.sync += [factor.eq(a), operand.eq(b)]
        with m.If(at(8)):
            m.d.sync += total.eq((horner.round_half_up(19) + c2).wrap(p.SUM_FORMAT))
        with m.If(at(12)):
            m.d.sync += total.eq((horner.round_half_up(19) + c1).wrap(p.SUM_FORMAT))
        with m.If(at(16)):
            m.d.sync += e.eq(horner.round_half_up(21).saturate(p.FACTOR_FORMAT))
        middle = []
        for c, half in enumerate((half_sum[0], half_sum[1], half_sum_late)):
            total_c = register(m, half + scaled.round_half_up(19), f"middle_sum_{c}", when=at(19 + 2 * c))
            middle.append(register(m, total_c.saturate(p.FORMAT), f"middle_{c}", when=at(20 + 2 * c)))

        result = Signal(self.o.payload.shape())
        m.d.comb += [
            result.normal_left.eq(ends[4].normal_left),
            result.normal_right.eq(ends[4].normal_right),
            result.wide.eq(wide),
            *(result.normal_middle[c].eq(middle[c]) for c in range(3)),
        ]
        return result
