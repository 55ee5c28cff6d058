"""Every hardware operation equals its NumPy model, by exhaustion of short words; refusals."""

import operator
from itertools import product

import numpy as np
import pytest
from amaranth.hdl import Module, Signal, Value, signed, unsigned
from amaranth.lib import data
from amaranth.sim import Simulator

from blysk.golden.number import fixed as golden
from blysk.golden.number.fixed import Fixed
from blysk.hdl.core.fixed import SQ, UQ, FixedShape, FixedValue

SMALL = [
    golden.SQ(1, 0),
    golden.SQ(1, 3),
    golden.SQ(3, -1),
    golden.UQ(0, 4),
    golden.UQ(2, 1),
    golden.UQ(-2, 5),
]


def evaluate(expressions, signals, stimuli, output_shape=None):
    """Codes of every expression for every row of stimuli, in Amaranth's simulator."""
    m = Module()
    outputs = []
    for expression in expressions:
        output = Signal(output_shape or expression.shape())
        m.d.comb += output.eq(expression)
        outputs.append(Value.cast(output))
    results = []

    async def bench(ctx):
        for row in stimuli:
            for signal, code in zip(signals, row, strict=True):
                ctx.set(signal, int(code))
            await ctx.delay(1e-6)
            results.append([ctx.get(output) for output in outputs])

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()
    return np.array(results)


@pytest.mark.parametrize(("a", "b"), list(product(SMALL, SMALL)), ids=str)
def test_two_operands(a, b):
    operations = [operator.add, operator.sub, operator.mul, operator.lt, operator.le]
    operations += [operator.gt, operator.ge, operator.eq, operator.ne]
    x, y = Signal(FixedShape(a)), Signal(FixedShape(b))
    stimuli = np.array(
        list(product(range(a.min_code, a.max_code + 1), range(b.min_code, b.max_code + 1))), dtype=np.int64
    )
    expressions = [operation(x, y) for operation in operations]
    results = evaluate(expressions, [x.as_value(), y.as_value()], stimuli)
    left, right = Fixed(a, stimuli[:, 0]), Fixed(b, stimuli[:, 1])
    for column, operation in enumerate(operations):
        expected = operation(left, right)
        if isinstance(expected, Fixed):
            assert expressions[column].format == expected.format
            expected = expected.codes
        np.testing.assert_array_equal(results[:, column], expected, err_msg=operation.__name__)


@pytest.mark.parametrize("format", [*SMALL, golden.SQ(4, 3), golden.UQ(3, 4)], ids=str)
def test_one_operand(format):
    x = Signal(FixedShape(format))
    codes = np.arange(format.min_code, format.max_code + 1)
    numbers = Fixed(format, codes)
    cases = [(-x, -numbers), (x.scale(3), numbers.scale(3)), (x.scale(-2), numbers.scale(-2))]
    for fraction_bits in range(1 - format.integer_bits, format.fraction_bits + 1):
        cases.append((x.truncate(fraction_bits), numbers.truncate(fraction_bits)))
        cases.append((x.round_half_up(fraction_bits), numbers.round_half_up(fraction_bits)))
    for make in (golden.SQ, golden.UQ):
        for width in range(1, format.width + 3):
            target = make(width - format.fraction_bits, format.fraction_bits)
            cases.append((x.saturate(target), numbers.saturate(target)))
            cases.append((x.wrap(target), numbers.wrap(target)))
            if target.holds(format):
                cases.append((x.extend(target), numbers.extend(target)))
    results = evaluate([case[0] for case in cases], [x.as_value()], codes[:, None])
    for column, (expression, expected) in enumerate(cases):
        assert expression.format == expected.format
        np.testing.assert_array_equal(results[:, column], expected.codes, err_msg=f"case {column}")


def test_assignment_extends_exactly():
    x = Signal(SQ(1, 3))
    results = evaluate([x], [x.as_value()], [[code] for code in range(-8, 8)], output_shape=SQ(3, 5))
    assert results[:, 0].tolist() == [4 * code for code in range(-8, 8)]


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: Signal(SQ(1, 3)).eq(Signal(SQ(1, 4))),
            ValueError,
            r"assigning SQ\(1, 4\) to SQ\(1, 3\) would",
        ),
        (lambda: Signal(UQ(1, 3)).eq(Signal(SQ(1, 3))), ValueError, "would lose bits"),
        (lambda: Signal(SQ(1, 3)).eq(Signal(UQ(1, 3))), ValueError, "would lose bits"),
        (lambda: Signal(SQ(1, 3)).eq(Signal(signed(4))), TypeError, "carries no number format"),
        (lambda: Signal(SQ(1, 3)) + 1, TypeError, "1 carries no number format"),
        (lambda: Signal(SQ(1, 3)) == 0, TypeError, "0 carries no number format"),
        (lambda: SQ(1, 3).const(0.3), ValueError, r"0.3 is not a number of SQ\(1, 3\)"),
        (lambda: Signal(SQ(1, 3), init=1), TypeError, r"must be a constant initializer of SQ\(1, 3\)"),
        (lambda: SQ(1, 3)(Signal(unsigned(5))), TypeError, "has 4 bits, not 5"),
        (lambda: Signal(SQ(1, 3)).saturate(golden.SQ(1, 2)), ValueError, "needs equal fraction bits"),
        (lambda: FixedShape("SQ"), TypeError, "format must be a Format"),
    ],
)
def test_refusals(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_shapes_compare_by_format():
    assert SQ(1, 17) == FixedShape(golden.SQ(1, 17))
    assert len({SQ(1, 17), SQ(1, 17), SQ(2, 16), UQ(1, 17)}) == 3
    assert repr(UQ(-1, 18)) == "UQ(-1, 18)"


def test_initial_value_and_layout_field():
    assert Signal(SQ(1, 3), init=-0.5).as_value().init == -4
    view = Signal(data.StructLayout({"normal": data.ArrayLayout(SQ(1, 3), 3)}))
    assert isinstance(view.normal[1], FixedValue)
    assert view.normal[1].format == golden.SQ(1, 3)
    bits = data.StructLayout({"a": SQ(1, 3), "b": UQ(0, 2)}).from_bits(0b110110)
    assert (bits.a.as_value().value, bits.b.as_value().value) == (6, 3)
