"""Views are copied, or chosen between, only if fields, widths, signs and fixed-point formats are equal."""

import ast

import pytest
from amaranth.hdl import Module, Signal, Value, signed, unsigned
from amaranth.lib import data, enum
from amaranth.sim import Simulator

from blysk.hdl.core.fixed import SQ, UQ, FixedShape
from blysk.hdl.core.views import choose, copy, copy_fields, require_same_shape

from ...sources import tree
from ...test_house import PROJECT


def struct(**fields):
    return data.StructLayout(fields)


class Color(enum.Enum, shape=2):
    RED = 0
    GREEN = 1


class Size(enum.Enum, shape=2):
    SMALL = 0
    LARGE = 1


EQUAL = [
    lambda: unsigned(5),
    lambda: signed(3),
    lambda: SQ(1, 17),
    lambda: UQ(-1, 18),
    lambda: Color,
    lambda: data.ArrayLayout(SQ(1, 17), 3),
    lambda: struct(a=SQ(1, 17), b=data.ArrayLayout(struct(c=unsigned(2), d=UQ(0, 4)), 2)),
    lambda: struct(),
    lambda: data.UnionLayout({"a": unsigned(3), "b": signed(4)}),
]

# Two shapes, of equal width if possible, and the end of the message.
DIFFERENT = [
    (SQ(1, 17), SQ(2, 16), "payload is SQ(1, 17) on one side, SQ(2, 16) on the other"),
    (SQ(1, 17), UQ(1, 17), "payload is SQ(1, 17) on one side, UQ(1, 17) on the other"),
    (SQ(1, 17), signed(18), "payload is SQ(1, 17) on one side, signed(18) on the other"),
    (unsigned(18), UQ(1, 17), "payload is unsigned(18) on one side, UQ(1, 17) on the other"),
    (unsigned(4), signed(4), "payload is unsigned(4) on one side, signed(4) on the other"),
    (unsigned(4), unsigned(5), "payload is unsigned(4) on one side, unsigned(5) on the other"),
    (
        struct(a=SQ(1, 7), b=SQ(1, 7)),
        struct(a=SQ(1, 7), b=SQ(2, 6)),
        "payload.b is SQ(1, 7) on one side, SQ(2, 6) on the other",
    ),
    (
        struct(a=unsigned(4)),
        struct(b=unsigned(4)),
        "payload has fields ['a'] on one side, ['b'] on the other",
    ),
    (
        struct(a=unsigned(4), b=unsigned(4)),
        struct(b=unsigned(4), a=unsigned(4)),
        "payload has fields ['a', 'b'] on one side, ['b', 'a'] on the other",
    ),
    (
        data.ArrayLayout(unsigned(6), 2),
        data.ArrayLayout(unsigned(4), 3),
        "payload has 2 elements on one side, 3 on the other",
    ),
    (
        struct(n=data.ArrayLayout(struct(x=SQ(1, 3)), 2)),
        struct(n=data.ArrayLayout(struct(x=SQ(0, 4)), 2)),
        "payload.n[].x is SQ(1, 3) on one side, SQ(0, 4) on the other",
    ),
]


@pytest.mark.parametrize("make", EQUAL)
def test_equal_shapes_are_accepted(make):
    require_same_shape(make(), make())


@pytest.mark.parametrize(("a", "b", "message"), DIFFERENT, ids=[str(k) for k in range(len(DIFFERENT))])
def test_different_shapes_are_refused(a, b, message):
    with pytest.raises(TypeError) as error:
        require_same_shape(a, b)
    assert str(error.value) == message
    with pytest.raises(TypeError):
        require_same_shape(b, a)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (struct(a=unsigned(4)), unsigned(4)),
        (struct(a=unsigned(4)), data.ArrayLayout(unsigned(4), 1)),
        (data.ArrayLayout(unsigned(2), 2), unsigned(4)),
        (data.UnionLayout({"a": unsigned(3)}), data.UnionLayout({"b": unsigned(3)})),
    ],
)
def test_kinds_are_told_apart(a, b):
    """A structure is not a number and not an array, even with the same number of bits."""
    for one, other in ((a, b), (b, a)):
        with pytest.raises(TypeError, match=r"on one side, .* on the other$"):
            require_same_shape(one, other)


@pytest.mark.parametrize(("a", "b", "message"), DIFFERENT, ids=[str(k) for k in range(len(DIFFERENT))])
def test_copies_of_other_shapes_are_refused(a, b, message):
    target, source = Signal(b), Signal(a)
    with pytest.raises(TypeError) as error:
        copy(target, source, "payload")
    assert str(error.value) == message
    with pytest.raises(TypeError):
        choose(Signal(), source, target)
    with pytest.raises(TypeError, match=r"^word"):
        copy_fields({"word": target}, {"word": source})


def test_bits_that_are_views_carry_every_field():
    shape = struct(a=SQ(1, 3), b=data.ArrayLayout(unsigned(2), 2))
    first, second, third, part = (Signal(shape, name=name) for name in ("first", "second", "third", "part"))
    condition = Signal()
    m = Module()
    m.d.comb += [copy(third, choose(condition, first, second)), *copy_fields(part, first, ["b"])]

    async def bench(context):
        for which, code in ((1, 0b1010_0110), (0, 0b0101_1001)):
            context.set(condition, which)
            context.set(Value.cast(first if which else second), code)
            assert context.get(Value.cast(third)) == code
        assert context.get(Value.cast(part)) == 0b1010 << 4
        assert isinstance(choose(condition, first.a, second.a).shape(), FixedShape)

    simulator = Simulator(m)
    simulator.add_testbench(bench)
    simulator.run()


def test_copies_of_views_are_checked_everywhere():
    """No file of hdl removes the shapes on both sides of an assignment, because `copy` compares them."""

    def cast(node):
        return isinstance(node, ast.Call) and ast.unparse(node.func) == "Value.cast"

    found = [
        str(path.relative_to(PROJECT))
        for path in sorted((PROJECT / "hdl").rglob("*.py"))
        for node in ast.walk(tree(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "eq"
        and cast(node.func.value)
        and all(cast(argument) for argument in node.args)
    ]
    assert found == ["hdl/core/views.py"]
