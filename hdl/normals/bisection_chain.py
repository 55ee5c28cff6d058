"""Chain of bisections: repeated halving towards the left end, on a dot product and a multiplier ([T] 2.1)."""

from amaranth.hdl import Module, Mux, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.multiplier import SteppedMultiplier
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.views import copy
from blysk.hdl.normals.bisection import coefficient
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["BisectionChainUnit"]


_ANGLE_STEPS = 6
"""Cycles from a span to the word of its u."""


class BisectionChainUnit(wiring.Component):
    """Normal at ``psi / 2^k`` from the left end of a span: ``N_k = (L_k N_l + N_r) / M_k``.

    `BisectionChain`, the bit-accurate model, has L_k and M_k, formats and error bound.

    The unit is sequential, one span at a time. With s Horner steps of the bisection's factor, a span gives
    its normal ``17 + k (3 s + 8)`` cycles after it was taken in (`latency`). The next span is taken in at
    least one cycle after the normal. The unit has four multipliers: three in the dot product, used once, and
    one for all other products.

    Parameters
    ----------
    model : BisectionChain
        Bit-accurate model, with the factor.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "level": 4})))`
        Unit normals, three components ``SQ(1, 17)`` each; the level k, 1 to 15 (0 counts as 16).
    o : :py:`Out(stream.Signature(StructLayout({"normal", "out_of_range": 1})))`
        The normal, three components ``SQ(1, 17)``. ``out_of_range``: the span is wider than the bisection's
        ``max_angle``. Its normal is then undefined.

    Source: docs/theory/interpolation.md#bisection; [T] 2.1.
    """

    def __init__(self, model: BisectionChain | None = None):
        self.model = model or BisectionChain()
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
        """Cycles from input to output of a span with this ``level``."""
        return 17 + level * (3 * self.model.bisection.steps + 8)

    def elaborate(self, platform):
        """Dot product, then one round of the multiplier for each level, then six products."""
        m = Module()
        registers = _Registers(self.model, self.i.payload.shape())
        span, step = registers.span, registers.step
        first_u = self._first_u(m, registers)
        self._operands(m, registers)
        multiplier = SteppedMultiplier(m, step)
        with m.FSM():
            with m.State("idle"):
                m.d.comb += self.i.ready.eq(1)
                with m.If(self.i.valid):
                    word = registers.u.format
                    m.d.sync += [
                        copy(span, self.i.payload),
                        registers.remaining.eq(self.i.payload.level),
                        step.eq(0),
                        registers.first_round.eq(1),
                        registers.weight_l.eq(FixedValue.constant(word, 0)),
                        registers.weight_m.eq(FixedValue.constant(word, 1)),
                    ]
                    m.next = "angle"
            with m.State("angle"):
                m.d.sync += step.eq(step + 1)
                with m.If(step == _ANGLE_STEPS - 1):
                    m.d.sync += [registers.u.eq(first_u), step.eq(0)]
                    m.next = "round"
            with m.State("round"):
                m.d.sync += step.eq(step + 1)
                self._factor(m, registers, multiplier)
                self._halve(m, registers, multiplier)
            with m.State("combine"):
                m.d.sync += step.eq(step + 1)
                self._combine(m, registers, multiplier)
                with m.If(step == 9):
                    m.d.sync += self.o.valid.eq(1)
                    m.next = "done"
            with m.State("done"), m.If(self.o.ready):
                m.d.sync += self.o.valid.eq(0)
                m.next = "idle"
        return m

    def _first_u(self, m: Module, r: "_Registers") -> FixedValue:
        """``u = 1 - cos psi`` of the span's normals, `_ANGLE_STEPS` - 1 cycles after the normals."""
        m.submodules.dot_product = dot_product = DotProductUnit()
        m.d.comb += [
            copy(dot_product.i.payload.a, r.span.normal_left),
            copy(dot_product.i.payload.b, r.span.normal_right),
            dot_product.i.valid.eq(1),
            dot_product.o.ready.eq(1),
        ]
        one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        exact = one - dot_product.o.payload
        difference = Signal(exact.shape())
        rounded = Signal(exact.round_half_up(20).shape(), name="rounded_difference")
        m.d.sync += [difference.eq(exact), rounded.eq(difference.round_half_up(20))]
        return rounded.saturate(BisectionChain.WEIGHT_FORMAT)

    def _operands(self, m: Module, r: "_Registers") -> None:
        """Words that a round makes of u, in three cycles."""
        p = self.model.bisection
        limit = FixedValue.constant(p.ANGLE_FORMAT, p.widest_narrow.values.item())
        one = FixedValue.constant(p.OPERAND_FORMAT, p.ONE.values.item())
        operand = r.cosine if p.reads_cosine(False) else r.narrow_angle
        if p.max_angle == 90:
            operand = FixedValue(
                p.OPERAND_FORMAT, Mux(r.beyond_narrow, r.cosine.as_value(), operand.as_value())
            )
        m.d.sync += [
            r.angle.eq(r.u.round_half_up(17).saturate(p.ANGLE_FORMAT)),
            r.cosine.eq((one - r.angle).saturate(p.OPERAND_FORMAT)),
            r.narrow_angle.eq(r.angle.saturate(p.OPERAND_FORMAT)),
            r.beyond_narrow.eq(r.angle > limit),
            r.x.eq(operand),
            r.first_step.eq(r.beyond_narrow),
        ]

    def _factor(self, m: Module, r: "_Registers", multiplier: SteppedMultiplier) -> None:
        """``e`` of a round by Horner's form, and whether the span is too wide."""
        p, aligned = self.model.bisection, multiplier.product.scale(-1)
        for done in range(p.steps):
            power = p.steps - done
            factor = r.total if done else coefficient(p, power, r.first_step)
            multiplier.issue(3 + 3 * done, r.x, factor.scale(1))
            added = coefficient(p, power - 1, r.first_step)
            with m.If(r.step == 5 + 3 * done):
                if power == 1:
                    m.d.sync += r.e.eq((aligned.round_half_up(19) + added).wrap(p.FACTOR_FORMAT))
                else:
                    m.d.sync += r.total.eq((aligned.round_half_up(18) + added).wrap(p.SUM_FORMAT))
        limit = FixedValue.constant(p.ANGLE_FORMAT, p.widest.values.item())
        with m.If((r.step == 4) & r.first_round):
            m.d.sync += [self.o.payload.out_of_range.eq(r.angle > limit), r.first_round.eq(0)]

    def _halve(self, m: Module, r: "_Registers", multiplier: SteppedMultiplier) -> None:
        """Next u, l and m of a round. Then the round ends."""
        word, product = r.u.format, multiplier.product
        half_l = (r.weight_l + FixedValue.constant(word, 1)).scale(-1)
        half_m = r.weight_m.scale(-1)
        after = 3 + 3 * self.model.bisection.steps
        multiplier.issue(after, r.e.scale(2), r.cosine)
        multiplier.issue(after + 1, r.e.scale(2), half_l.truncate(17).saturate(COMPONENT))
        multiplier.issue(after + 2, r.e.scale(2), half_m.truncate(17).saturate(COMPONENT))
        with m.If(r.step == after + 2):
            narrower = r.u.scale(-1) - r.e - product.scale(-2).truncate(21)
            m.d.sync += r.u.eq(narrower.round_half_up(20).saturate(word))
        for at, weight, half in ((after + 3, r.weight_l, half_l), (after + 4, r.weight_m, half_m)):
            with m.If(r.step == at):
                scaled = half + product.scale(-1).truncate(21)
                m.d.sync += weight.eq(scaled.round_half_up(20).saturate(word))
        with m.If(r.step == after + 4):
            m.d.sync += [r.step.eq(0), r.remaining.eq(r.remaining - 1)]
            with m.If(r.remaining == 1):
                m.next = "combine"

    def _combine(self, m: Module, r: "_Registers", multiplier: SteppedMultiplier) -> None:
        """Components of ``l N_l + m N_r``, with two products each."""
        product = multiplier.product
        left_term = Signal(product.shape())
        exact_sum = left_term + product
        combined = Signal(exact_sum.shape())
        rounded = Signal(combined.round_half_up(17).shape())
        m.d.sync += [
            left_term.eq(product),
            combined.eq(exact_sum),
            rounded.eq(combined.round_half_up(17)),
        ]
        terms = (r.weight_l, r.span.normal_left), (r.weight_m, r.span.normal_right)
        for c in range(3):
            for index, (weight, normal) in enumerate(terms):
                multiplier.issue(2 * c + index, weight.round_half_up(17).saturate(COMPONENT), normal[c])
            with m.If(r.step == 2 * c + 5):
                m.d.sync += self.o.payload.normal[c].eq(rounded.saturate(COMPONENT))


class _Registers:
    """Registers that the states of a `BisectionChainUnit` share."""

    def __init__(self, model: BisectionChain, span_shape: data.StructLayout):
        p, word = model.bisection, FixedShape(BisectionChain.WEIGHT_FORMAT)
        self.span = Signal(span_shape)
        self.remaining = Signal(BisectionChain.LEVEL_BITS)
        self.step = Signal(range(3 * p.steps + 8))
        self.first_round = Signal()
        self.u = Signal(word)
        self.weight_l = Signal(word)
        self.weight_m = Signal(word)
        self.angle = Signal(FixedShape(p.ANGLE_FORMAT))
        self.cosine = Signal(FixedShape(p.OPERAND_FORMAT))
        self.narrow_angle = Signal(FixedShape(p.OPERAND_FORMAT))
        self.x = Signal(FixedShape(p.OPERAND_FORMAT))
        self.beyond_narrow = Signal()
        self.first_step = Signal()
        self.total = Signal(FixedShape(p.SUM_FORMAT))
        self.e = Signal(FixedShape(p.FACTOR_FORMAT))
