"""Bisection unit ([T] figure 2.6): a dot product and one shared multiplier."""

from amaranth.hdl import Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from golden.bisection import Bisection
from golden.unit_vector import COMPONENT, ONE_SQUARED

from .dot_product import DotProductUnit
from .fixed import FixedShape, FixedValue
from .middle_normal import normal_shape
from .stream import PipelinedUnit

__all__ = ["BisectionUnit", "coefficient", "multiplier_turns"]

FIRST_ISSUE = 9
"""Age at which u or r is ready for the multiplier."""


def coefficient(parameters: Bisection, power: int, first_step: Value) -> FixedValue:
    """Coefficient of a power of the factor's polynomial, or of that of the first step."""
    codes = []
    for which in (False, True):
        constant, rest = parameters.polynomial(which)
        number = rest[power - 1] if power else constant
        codes.append(Const(number.codes.item(), signed(number.format.width)))
    narrow, wide = codes
    return FixedValue(number.format, narrow if parameters.max_angle == 45 else Mux(first_step, wide, narrow))


def multiplier_turns(steps: int) -> list[int]:
    """Ages at which a beat has the multiplier: for every Horner step, then for every component.

    A turn is as soon as its operand is there, and on a clock of the interval that no other turn has. A sum
    takes 3 clocks: operands, product, sum.
    """
    interval = steps + 3
    turns: list[int] = []
    earliest = FIRST_ISSUE
    for turn in range(interval):
        while any((earliest - age) % interval == 0 for age in turns):
            earliest += 1
        turns.append(earliest)
        earliest += 3 if turn < steps else 1
    return turns


class BisectionUnit(PipelinedUnit):
    """``N = (N_a + N_b) / sqrt(2 + z)`` with ``z = 2 N_a . N_b``, and a flag for spans too wide for it.

    Formats, variants, error bounds and the flag are those of `golden.bisection.Bisection`, the bit-true twin.

    Four multipliers: three in the dot product, and one that does the Horner steps and the three scalings of
    a span in turn, busy on every clock. With s Horner steps the initiation interval is s + 3; the latency
    follows from the turns of the multiplier:

    ========================== == =================== =======
    variant                    s  initiation interval latency
    ========================== == =================== =======
    ``max_angle`` 90           3  6                   28
    ``max_angle`` 45, degree 2 2  5                   23
    ``max_angle`` 45, degree 1 1  4                   20
    ========================== == =================== =======

    Parameters
    ----------
    parameters : Bisection
        Degree, widest span, coefficients and formats.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_a": ..., "normal_b": ...})))`
        Unit normals, three components ``SQ(1, 17)`` each.
    o : :py:`Out(stream.Signature(StructLayout({...})))`
        ``normal_middle``, three components ``SQ(1, 17)``; ``one_minus_cosine`` of the two normals in
        ``SQ(2, 17)``; ``wide``: they are further apart than ``max_angle`` and the result means nothing.

    Source: [T] 2.1, figure 2.6.
    """

    def __init__(self, parameters: Bisection | None = None):
        self.parameters = parameters or Bisection()
        self._turns = multiplier_turns(self.parameters.steps)
        super().__init__(
            data.StructLayout({"normal_a": normal_shape(), "normal_b": normal_shape()}),
            data.StructLayout(
                {
                    "normal_middle": normal_shape(),
                    "one_minus_cosine": FixedShape(Bisection.ANGLE_FORMAT),
                    "wide": unsigned(1),
                }
            ),
            latency=self._turns[-1] + 5,
            initiation_interval=len(self._turns),
        )

    def _held(self, m, value, name: str, first: int, last: int) -> dict:
        """``value``, there from age ``first`` on for an interval, at each age up to ``last``: by copies."""
        ages = {}
        for age in range(first, last + 1):
            if age > first and (age - first) % self.initiation_interval == 0:
                value = self.register(m, value, f"{name}_{age}", when=self.at(age - 1))
            ages[age] = value
        return ages

    def datapath(self, m, operands):
        """Ages: half sums 2, dot product 4, u at 7, x at 9, then the turns of the multiplier."""
        p = self.parameters
        at, register = self.at, self.register
        horner_ages, scaling_ages = self._turns[: p.steps], self._turns[p.steps :]
        m.submodules.dot_product = dot_product = DotProductUnit()
        m.d.comb += [
            dot_product.i.payload.a.eq(operands.normal_a),
            dot_product.i.payload.b.eq(operands.normal_b),
            dot_product.i.valid.eq(1),
            dot_product.o.ready.eq(1),
        ]
        half_sum = []
        for c in range(3):
            half = register(m, (operands.normal_a[c] + operands.normal_b[c]).scale(-1), f"half_sum_{c}")
            half_sum.append(self._held(m, half, f"half_sum_{c}", 2, scaling_ages[c])[scaling_ages[c]])

        one = FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item())
        difference = register(m, one - dot_product.o.payload, "difference")
        rounded = register(m, difference.round_half_up(17), "difference_rounded")
        u = register(m, rounded.saturate(p.ANGLE_FORMAT), "u", when=at(6))
        u_held = self._held(m, u, "u", 7, self.latency)
        one = FixedValue.constant(p.OPERAND_FORMAT, p.ONE.values.item())
        cosine = register(m, one - u, "cosine").saturate(p.OPERAND_FORMAT)
        angle = register(m, u.saturate(p.OPERAND_FORMAT), "angle")
        limits = [FixedValue.constant(p.ANGLE_FORMAT, w.values.item()) for w in (p.widest_narrow, p.widest)]
        beyond_narrow = register(m, u > limits[0], "beyond_narrow")
        wide = register(m, u > limits[1], "wide", when=at(7))
        has_first_step = p.max_angle == 90
        narrow_operand = cosine if p.reads_cosine(False) else angle
        if has_first_step:
            x = FixedValue(p.OPERAND_FORMAT, Mux(beyond_narrow, cosine.as_value(), narrow_operand.as_value()))
        else:
            x = narrow_operand
        last = horner_ages[-1]
        x = self._held(m, register(m, x, "x", when=at(8)), "x", FIRST_ISSUE, last)
        first_step = register(m, beyond_narrow, "first_step", when=at(8))
        first_step = self._held(m, first_step, "first_step", FIRST_ISSUE, last + 2)

        # The shared multiplier takes 18 signed bits twice; wired shifts align what it is given.
        a, b = Signal(FixedShape(COMPONENT), name="factor"), Signal(FixedShape(COMPONENT), name="operand")
        product = register(m, a * b, "product")
        aligned = product.scale(-1)
        total = Signal(FixedShape(p.SUM_FORMAT))
        e = Signal(FixedShape(p.FACTOR_FORMAT))
        for step, age in enumerate(horner_ages):
            power = p.steps - step
            second = total if step else coefficient(p, power, first_step[age])
            added = coefficient(p, power - 1, first_step[age + 2])
            with m.If(at(age)):
                m.d.sync += [a.eq(x[age]), b.eq(second.scale(1))]
            with m.If(at(age + 2)):
                if power == 1:
                    m.d.sync += e.eq((aligned.round_half_up(19) + added).wrap(p.FACTOR_FORMAT))
                else:
                    m.d.sync += total.eq((aligned.round_half_up(18) + added).wrap(p.SUM_FORMAT))

        # e is written anew an interval after it was, and the last scaling may come later than that.
        e_held = self._held(m, e, "e", last + 3, scaling_ages[-1])
        half = Signal(half_sum[0].shape())
        for c, age in enumerate(scaling_ages):
            with m.If(at(age)):
                m.d.sync += [
                    a.eq(e_held[age].scale(2)),
                    b.eq(half_sum[c].truncate(17)),
                    half.eq(half_sum[c]),
                ]
        half_late = register(m, half, "half_late")
        middle_sum = register(m, half_late + aligned.truncate(21), "middle_sum")
        middle_rounded = register(m, middle_sum.round_half_up(17), "middle_rounded")
        result = Signal(self.o.payload.shape())
        for c, age in enumerate(scaling_ages):
            middle = register(m, middle_rounded.saturate(p.FORMAT), f"middle_{c}", when=at(age + 4))
            middle = self._held(m, middle, f"middle_{c}", age + 5, self.latency)[self.latency]
            m.d.comb += result.normal_middle[c].eq(middle)
        m.d.comb += [
            result.one_minus_cosine.eq(u_held[self.latency]),
            result.wide.eq(self._held(m, wide, "wide", 8, self.latency)[self.latency]),
        ]
        return result
