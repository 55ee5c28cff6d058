"""Difference setup ([T] figure 2.11): first and second difference of a quadratic normal curve."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.difference_setup import DifferenceSetup
from golden.fixed import SQ, UQ
from golden.gpq import GPQ
from golden.unit_vector import COMPONENT

from .fixed import FixedShape, FixedValue
from .middle_normal import normal_shape
from .stream import PipelinedUnit

__all__ = ["DifferenceSetupUnit", "difference_shape"]


def difference_shape() -> data.StructLayout:
    """Shape of a prepared span: start, first and second difference, length in pixels."""
    difference = data.ArrayLayout(FixedShape(DifferenceSetup.FORMAT), 3)
    return data.StructLayout(
        {"start": normal_shape(), "first": difference, "second": difference, "length": unsigned(12)}
    )


class DifferenceSetupUnit(PipelinedUnit):
    """``W_0 = P dt + G dt^2`` and ``2 G dt^2`` with ``dt = 1/(m - 1)``.

    Formats and error bound are those of `golden.difference_setup.DifferenceSetup`, the bit-true twin.

    The latency is 18 clocks and the initiation interval 7. One multiplier: the square of dt, three products
    with P and three with G, one a clock. A table of 2048 words of 17 bits holds the reciprocals.

    Parameters
    ----------
    parameters : DifferenceSetup
        Table and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"g", "p", "q", "length"})))`
        Coefficients in the formats of `GPQ`; length 1 to 4095.
    o : :py:`Out(stream.Signature(difference_shape()))`
        The start ``q``, both differences in ``SQ(2, 42)``, the length.

    Source: [T] figure 2.11.
    """

    def __init__(self, parameters: DifferenceSetup | None = None):
        self.parameters = parameters or DifferenceSetup()
        super().__init__(
            data.StructLayout(
                {
                    "g": data.ArrayLayout(FixedShape(GPQ.G_FORMAT), 3),
                    "p": data.ArrayLayout(FixedShape(GPQ.P_FORMAT), 3),
                    "q": normal_shape(),
                    "length": unsigned(12),
                }
            ),
            difference_shape(),
            latency=18,
            initiation_interval=7,
        )

    def datapath(self, m, operands):
        """Ages: reciprocal 1 to 6, square at 6, P at 7 to 9, G at 10 to 12, then shift, round, add."""
        p = self.parameters
        at, register = self.at, self.register
        bits = p.LENGTH_BITS
        held = register(m, operands, "operands_5", when=at(5))
        late = register(m, held, "operands_12", when=at(12))

        steps = register(m, (operands.length - 1)[:bits], "steps")
        # The leading one of m - 1, and how far it stands from the top; a span of one pixel has none.
        position, below_top = Signal(range(bits)), Signal(range(bits))
        m.d.sync += [position.eq(0), below_top.eq(bits - 1)]
        for bit in range(bits):
            with m.If(steps[bit]):
                m.d.sync += [position.eq(bit), below_top.eq(bits - 1 - bit)]
        steps_held = register(m, steps, "steps_held")
        address = register(m, (steps_held << below_top)[: bits - 1], "address", when=at(3))
        position_held = register(m, position, "position_held", when=at(3))
        m.submodules.reciprocals = table = Memory(
            shape=p.RECIPROCAL_FORMAT.width, depth=1 << (bits - 1), init=p.reciprocals.codes.tolist()
        )
        port = table.read_port()
        m.d.comb += port.addr.eq(address)
        reciprocal = register(m, FixedValue(p.RECIPROCAL_FORMAT, port.data), "reciprocal", when=at(5))
        shift = register(m, position_held + address.any(), "shift", when=at(4))

        factor = Signal(FixedShape(p.RECIPROCAL_FORMAT))
        operand = Signal(FixedShape(COMPONENT))
        product = register(m, operand * factor, "product")
        unsigned_square = FixedValue(UQ(0, 34), Value.cast(product)[:34])
        small = ~Value.cast(unsigned_square)[-1]
        normalised = FixedValue(
            UQ(0, 34), Mux(small, Cat(0, Value.cast(unsigned_square)[:-1]), Value.cast(unsigned_square))
        )
        rounded_square = register(m, normalised.round_half_up(17), "rounded_square", when=at(8))
        square = register(m, rounded_square.saturate(p.RECIPROCAL_FORMAT), "square", when=at(9))
        small_held = register(m, small, "square_shift", when=at(8))
        double_shift = register(m, Cat(small_held, shift), "double_shift", when=at(9))

        issues = [(6, reciprocal, reciprocal.extend(COMPONENT))]
        issues += [(7 + c, reciprocal, held.p[c]) for c in range(3)]
        issues += [(10 + c, square, held.g[c].extend(COMPONENT)) for c in range(3)]
        for age, a, b in issues:
            with m.If(at(age)):
                m.d.sync += [factor.eq(a), operand.eq(b)]

        # The shift for the product of the next clock, then the shift itself in two stages.
        is_first_order = at(8) | at(9) | at(10)
        amount = register(m, Mux(is_first_order, shift + 1, double_shift), "amount")
        scaled = product.scale(2).extend(SQ(3, 43))
        coarse = register(
            m, FixedValue(scaled.format, Value.cast(scaled) >> Cat(Const(0, 3), amount[3:])), "coarse"
        )
        fine_amount = register(m, amount[:3], "fine_amount")
        shifted = register(m, FixedValue(scaled.format, Value.cast(coarse) >> fine_amount), "shifted")
        rounded = register(m, shifted.round_half_up(42).wrap(p.FORMAT), "rounded")
        result = Signal(self.o.payload.shape())
        for c in range(3):
            first_order = register(m, rounded, f"first_order_{c}", when=at(12 + c))
            first = register(m, (first_order + rounded).wrap(p.FORMAT), f"first_{c}", when=at(15 + c))
            second = register(
                m, rounded.scale(1).extend(SQ(3, 42)).wrap(p.FORMAT), f"second_{c}", when=at(15 + c)
            )
            m.d.comb += [result.first[c].eq(first), result.second[c].eq(second)]
        m.d.comb += [result.start.eq(late.q), result.length.eq(late.length)]
        return result
