"""Chain of bisections towards the left end ([T] 2.1): a dot product, one multiplier and a counter."""

from amaranth.hdl import Module, Mux, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.normals.bisection import coefficient
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["BisectionChainUnit"]


class BisectionChainUnit(wiring.Component):
    """``N_k = (L_k N_l + N_r) / M_k``: the normal at ``psi / 2^k`` from the left end of a span.

    Formats and error statement are those of `BisectionChain`, the bit-true twin.

    Sequential: one span at a time. With s Horner steps of the bisection's factor, a span taken in on one
    clock gives its normal ``17 + k (3 s + 8)`` cycles later (`latency`), and the next is taken in on the
    clock after that at the earliest. Four multipliers: three in the dot product, used once, and one for all
    the rest.

    Parameters
    ----------
    parameters : BisectionChain
        Factor and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "level": 4})))`
        Unit normals, three components ``SQ(1, 17)`` each; k, 1 to 15 (0 counts as 16).
    o : :py:`Out(stream.Signature(StructLayout({"normal", "wide": 1})))`
        The normal, three components ``SQ(1, 17)``; ``out_of_range``: the span is wider than the bisection's
        ``max_angle`` and its normal means nothing.

    Source: [T] 2.1; blocks.md.
    """

    def __init__(self, parameters: BisectionChain | None = None):
        self.parameters = parameters or BisectionChain()
        super().__init__(
            {
                "i": In(
                    stream.Signature(
                        data.StructLayout(
                            {
                                "normal_left": normal_shape(),
                                "normal_right": normal_shape(),
                                "level": unsigned(BisectionChain.LEVEL_BITS),
                            }
                        )
                    )
                ),
                "o": Out(
                    stream.Signature(
                        data.StructLayout({"normal": normal_shape(), "out_of_range": unsigned(1)})
                    )
                ),
            }
        )

    def latency(self, level: int) -> int:
        """Clocks from input to output of a span of that level."""
        return 17 + level * (3 * self.parameters.bisection.steps + 8)

    def elaborate(self, platform):
        """Dot product, then one round of the multiplier a level, then six products."""
        m = Module()
        p, word = self.parameters.bisection, BisectionChain.WEIGHT_FORMAT
        span = Signal(self.i.payload.shape())
        remaining = Signal(BisectionChain.LEVEL_BITS)
        step = Signal(range(3 * p.steps + 8))
        first_round = Signal()
        u, weight_l, weight_m = (
            Signal(FixedShape(word), name=name) for name in ("u", "weight_l", "weight_m")
        )
        angle = Signal(FixedShape(p.ANGLE_FORMAT))
        cosine, narrow_angle, x = (
            Signal(FixedShape(p.OPERAND_FORMAT), name=name) for name in ("cosine", "narrow_angle", "x")
        )
        beyond_narrow, first_step = Signal(), Signal()
        total, e = Signal(FixedShape(p.SUM_FORMAT)), Signal(FixedShape(p.FACTOR_FORMAT))
        a, b = Signal(FixedShape(COMPONENT), name="factor"), Signal(FixedShape(COMPONENT), name="operand")
        exact = a * b
        product = Signal(exact.shape())
        m.d.sync += product.eq(exact)

        m.submodules.dot_product = dot_product = DotProductUnit()
        m.d.comb += [
            dot_product.i.payload.a.eq(span.normal_left),
            dot_product.i.payload.b.eq(span.normal_right),
            dot_product.i.valid.eq(1),
            dot_product.o.ready.eq(1),
        ]
        one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        exact_difference = one - dot_product.o.payload
        difference = Signal(exact_difference.shape())
        rounded_difference = Signal(exact_difference.round_half_up(20).shape())
        m.d.sync += [
            difference.eq(exact_difference),
            rounded_difference.eq(difference.round_half_up(20)),
        ]

        # What a round reads of u, in three stages.
        limits = [FixedValue.constant(p.ANGLE_FORMAT, w.values.item()) for w in (p.widest_narrow, p.widest)]
        one = FixedValue.constant(p.OPERAND_FORMAT, p.ONE.values.item())
        operand = cosine if p.reads_cosine(False) else narrow_angle
        if p.max_angle == 90:
            operand = FixedValue(p.OPERAND_FORMAT, Mux(beyond_narrow, cosine.as_value(), operand.as_value()))
        m.d.sync += [
            angle.eq(u.round_half_up(17).saturate(p.ANGLE_FORMAT)),
            cosine.eq((one - angle).saturate(p.OPERAND_FORMAT)),
            narrow_angle.eq(angle.saturate(p.OPERAND_FORMAT)),
            beyond_narrow.eq(angle > limits[0]),
            x.eq(operand),
            first_step.eq(beyond_narrow),
        ]

        half_l = (weight_l + FixedValue.constant(word, 1)).scale(-1)
        half_m = weight_m.scale(-1)
        aligned = product.scale(-1)

        def issue(at, first, second):
            with m.If(step == at):
                m.d.sync += [a.eq(first), b.eq(second)]

        with m.FSM():
            with m.State("idle"):
                m.d.comb += self.i.ready.eq(1)
                with m.If(self.i.valid):
                    m.d.sync += [
                        span.eq(self.i.payload),
                        remaining.eq(self.i.payload.level),
                        step.eq(0),
                        first_round.eq(1),
                        weight_l.eq(FixedValue.constant(word, 0)),
                        weight_m.eq(FixedValue.constant(word, 1)),
                    ]
                    m.next = "angle"
            with m.State("angle"):
                m.d.sync += step.eq(step + 1)
                with m.If(step == 5):
                    m.d.sync += [u.eq(rounded_difference.saturate(word)), step.eq(0)]
                    m.next = "round"
            with m.State("round"):
                m.d.sync += step.eq(step + 1)
                for turn in range(p.steps):
                    power = p.steps - turn
                    issue(3 + 3 * turn, x, (total if turn else coefficient(p, power, first_step)).scale(1))
                    added = coefficient(p, power - 1, first_step)
                    with m.If(step == 5 + 3 * turn):
                        if power == 1:
                            m.d.sync += e.eq((aligned.round_half_up(19) + added).wrap(p.FACTOR_FORMAT))
                        else:
                            m.d.sync += total.eq((aligned.round_half_up(18) + added).wrap(p.SUM_FORMAT))
                after = 3 + 3 * p.steps
                issue(after, e.scale(2), cosine)
                issue(after + 1, e.scale(2), half_l.truncate(17).saturate(COMPONENT))
                issue(after + 2, e.scale(2), half_m.truncate(17).saturate(COMPONENT))
                with m.If((step == 4) & first_round):
                    m.d.sync += [self.o.payload.out_of_range.eq(angle > limits[1]), first_round.eq(0)]
                with m.If(step == after + 2):
                    narrower = u.scale(-1) - e - product.scale(-2).truncate(21)
                    m.d.sync += u.eq(narrower.round_half_up(20).saturate(word))
                for at, weight, half in ((after + 3, weight_l, half_l), (after + 4, weight_m, half_m)):
                    with m.If(step == at):
                        scaled = half + aligned.truncate(21)
                        m.d.sync += weight.eq(scaled.round_half_up(20).saturate(word))
                with m.If(step == after + 4):
                    m.d.sync += [step.eq(0), remaining.eq(remaining - 1)]
                    with m.If(remaining == 1):
                        m.next = "combine"
            with m.State("combine"):
                m.d.sync += step.eq(step + 1)
                left_term = Signal(exact.shape())
                exact_sum = left_term + product
                combined = Signal(exact_sum.shape())
                rounded = Signal(combined.round_half_up(17).shape())
                m.d.sync += [
                    left_term.eq(product),
                    combined.eq(exact_sum),
                    rounded.eq(combined.round_half_up(17)),
                ]
                for c in range(3):
                    for turn, (weight, normal) in enumerate(
                        ((weight_l, span.normal_left), (weight_m, span.normal_right))
                    ):
                        issue(2 * c + turn, weight.round_half_up(17).saturate(COMPONENT), normal[c])
                    with m.If(step == 2 * c + 5):
                        m.d.sync += self.o.payload.normal[c].eq(rounded.saturate(COMPONENT))
                with m.If(step == 9):
                    m.d.sync += self.o.valid.eq(1)
                    m.next = "done"
            with m.State("done"), m.If(self.o.ready):
                m.d.sync += self.o.valid.eq(0)
                m.next = "idle"
        return m
