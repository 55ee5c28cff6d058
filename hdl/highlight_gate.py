"""Highlight gate ([T] figure 4.10): which spans can hold a visible highlight."""

from amaranth.hdl import Mux, Signal, Value, signed, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from golden.highlight_gate import HighlightGate

from .dot_product import DotProductUnit
from .fixed import FixedShape, FixedValue
from .stream import PipelinedUnit

__all__ = ["HighlightGateUnit"]


class HighlightGateUnit(PipelinedUnit):
    """Whether a span may be lit; 0 only where every pixel of it has a specular term of 0.

    The comparisons, the formats and the proof are those of `golden.highlight_gate.HighlightGate`, the
    bit-true twin.

    The latency is 18 clocks and the initiation interval 6. Four multipliers: three in a dot product that
    takes ``N_l . N_r``, ``N_l . H`` and ``N_r . H`` in turn, and one of 17 by 17 bits that makes the six
    products of the comparisons, busy on every clock. The PROM holds 1024 words of 17 bits.

    Parameters
    ----------
    parameters : HighlightGate
        Reflection model and width.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left": ..., "normal_right": ...})))`
        Unit normals of the span's ends, three components ``SQ(1, F)`` each.
    o : :py:`Out(stream.Signature(unsigned(1)))`
        Whether the span may be lit.
    constants : :py:`In(StructLayout({"halfway": ..., "exponent": 10}))`
        Unit vector H, and the exponent, 1 to 1000; stay while beats are inside.

    Source: [T] 4.2, figure 4.10.
    """

    def __init__(self, parameters: HighlightGate | None = None):
        self.parameters = p = parameters or HighlightGate()
        normal = data.ArrayLayout(FixedShape(p.component_format), 3)
        super().__init__(
            data.StructLayout({"normal_left": normal, "normal_right": normal}),
            unsigned(1),
            latency=18,
            initiation_interval=6,
            constants=data.StructLayout({"halfway": normal, "exponent": unsigned(p.specular.EXPONENT_BITS)}),
        )

    def datapath(self, m, operands):
        """Ages: dot products 1 to 7, u and the levels to 9, products at 9 to 14, decision at 17."""
        p, at, register = self.parameters, self.at, self.register
        f = p.fraction_bits

        m.submodules.thresholds = prom = Memory(
            shape=f, depth=1 << p.specular.EXPONENT_BITS, init=p.thresholds.codes.tolist()
        )
        port = prom.read_port()
        m.d.comb += port.addr.eq(self.constants.exponent)
        threshold = register(m, port.data, "threshold")

        m.submodules.dot_product = dot = DotProductUnit(p.dot_product)
        m.d.comb += [dot.i.valid.eq(1), dot.o.ready.eq(1)]
        first = Signal(operands.normal_left.shape(), name="first_operand")
        second = Signal(operands.normal_left.shape(), name="second_operand")
        m.d.comb += [dot.i.payload.a.eq(first), dot.i.payload.b.eq(second)]
        for age, a, b in (
            (1, operands.normal_left, operands.normal_right),
            (2, operands.normal_left, self.constants.halfway),
            (3, operands.normal_right, self.constants.halfway),
        ):
            with m.If(at(age)):
                m.d.sync += [first.eq(a), second.eq(b)]

        # The dot products come out at ages 5, 6 and 7.
        angle = p.angle_format
        one = FixedValue.constant(p.one_squared.format, p.one_squared.values.item())
        difference = register(m, one - dot.o.payload, "difference", when=at(5))
        cut = register(m, difference.truncate(angle.fraction_bits).saturate(angle), "cut", when=at(6))
        sum_u = Value.cast(cut) + 3
        u = register(m, Mux(sum_u[f], angle.max_code, sum_u[:f])[:f], "u", when=at(7))
        u_late = register(m, u, "u_late", when=at(13))
        wide = register(m, Value.cast(cut) > p.widest.codes.item(), "wide", when=at(7))
        wide = register(m, wide, "wide_late", when=at(13))
        step = FixedValue.constant(p.level_format, p.level_format.step)
        level = register(m, dot.o.payload.truncate(f) + step, "level").saturate(p.level_format)
        a, b = (register(m, Value.cast(level), name, when=at(age)) for name, age in (("a", 7), ("b", 8)))
        minus = register(m, a - b, "a_minus_b", when=at(9))
        is_negative = minus[-1]
        large = register(m, Mux(is_negative, b, a), "large", when=at(10))
        span = register(m, Mux(is_negative, -minus, minus)[:f], "absolute_difference", when=at(10))

        factors = [Signal(f, name=f"factor_{k}") for k in range(2)]
        product = register(m, factors[0] * factors[1], "product")
        slack = Signal(f)
        issues = [(9, threshold, u), (10, a, b), (11, large, large), (12, large, u), (13, span, span)]
        for age, x, y in [*issues, (14, u_late, slack)]:
            with m.If(at(age)):
                m.d.sync += [factors[0].eq(x), factors[1].eq(y)]

        # w = 2 T - T u - 2 a b, with 2 F + 1 fraction bits.
        partial = Signal(signed(2 * f + 3))
        total = Signal(signed(2 * f + 3))
        with m.If(at(11)):
            m.d.sync += partial.eq((threshold << (f + 2)) - product)
        with m.If(at(12)):
            m.d.sync += total.eq(partial - (product << 2))
        kept = total[f + 2 :]
        exceeded = register(m, kept[-1] | ~kept.any(), "exceeded", when=at(13))
        with m.If(at(13)):
            m.d.sync += slack.eq(kept)

        bright = register(m, product >= (threshold << f), "bright", when=at(13))
        inside = register(m, product > (span << (f + 1)), "inside", when=at(14))
        square = register(m, product, "square", when=at(15))
        reached = register(m, square >= product, "reached", when=at(16))
        return register(m, wide | bright | (inside & (exceeded | reached)), "lit")
