"""Packing against Amaranth's own constants of the same layouts."""

import enum

import numpy as np
import pytest
from amaranth.hdl import Shape, ShapeCastable, signed, unsigned
from amaranth.lib import data
from hypothesis import given, settings
from hypothesis import strategies as st

from blysk.hdl.core.fixed import SQ, UQ
from blysk.sim.engines.beats import dtype_of, pack, unpack, word_count

LEAVES = st.one_of(st.integers(0, 64).map(unsigned), st.integers(1, 64).map(signed))
LAYOUTS = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.dictionaries(st.sampled_from("abcdef"), inner, min_size=1, max_size=4).map(data.StructLayout),
        st.tuples(inner, st.integers(1, 3)).map(lambda pair: data.ArrayLayout(*pair)),
    ),
    max_leaves=8,
)


def codes(shape):
    """A strategy for one beat's value: nested dicts and lists of integers, as `Layout.const` takes them."""
    if isinstance(shape, data.StructLayout):
        return st.fixed_dictionaries({name: codes(member) for name, member in shape.members.items()})
    if isinstance(shape, data.ArrayLayout):
        return st.lists(codes(shape.elem_shape), min_size=shape.length, max_size=shape.length)
    half = (1 << shape.width) // 2
    return st.integers(-half, half - 1) if shape.signed else st.integers(0, (1 << shape.width) - 1)


def fill(array, value):
    """Assign nested dicts and lists to a structured scalar."""
    if isinstance(value, dict):
        for name, inner in value.items():
            if isinstance(inner, (dict, list)):
                fill(array[name], inner)
            else:
                array[name] = inner
    else:
        for index, inner in enumerate(value):
            if isinstance(inner, (dict, list)):
                fill(array[index], inner)
            else:
                array[index] = inner


def bits(shape, value):
    """Amaranth's bit pattern of a beat."""
    if isinstance(shape, data.Layout):
        return shape.const(value).as_bits()
    return value & ((1 << shape.width) - 1)


@settings(deadline=None, derandomize=True)
@given(st.data())
def test_equals_amaranth(draw):
    layout = draw.draw(LAYOUTS)
    values = draw.draw(st.lists(codes(layout), max_size=5))
    beats = np.zeros(len(values), dtype=dtype_of(layout))
    fill(beats, values)

    words = pack(layout, beats)
    assert words.dtype == np.uint32
    assert words.shape == (len(values), -(-Shape.cast(layout).width // 32))
    packed = [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in words]
    assert packed == [bits(layout, value) for value in values]

    back = unpack(layout, words)
    assert back.dtype == beats.dtype
    np.testing.assert_array_equal(back, beats)


def test_unpack_ignores_bits_over_the_width():
    layout = data.StructLayout({"a": 3, "b": signed(4)})
    garbage = np.array([[0xFFFFFF80 | 0b1000_101]], dtype=np.uint32)
    assert unpack(layout, garbage).tolist() == [(5, -8)]


@pytest.mark.parametrize(
    ("shape", "dtype"),
    [
        (unsigned(1), "u1"),
        (unsigned(8), "u1"),
        (unsigned(9), "u2"),
        (signed(16), "i2"),
        (signed(17), "i4"),
        (unsigned(33), "u8"),
        (signed(63), "i8"),
        (SQ(1, 17), "i4"),
        (UQ(0, 8), "u1"),
    ],
)
def test_leaf_types(shape, dtype):
    assert dtype_of(shape) == np.dtype(dtype)


class Colour(enum.Enum):
    RED = 0
    BLUE = 5


class Nested(data.Struct):
    colour: Colour
    normal: data.ArrayLayout(SQ(1, 17), 3)


def test_nested_types_and_shape_castables():
    layout = data.StructLayout(
        {"x": 12, "inner": Nested, "grid": data.ArrayLayout(data.ArrayLayout(5, 2), 3)}
    )
    dtype = np.dtype(
        [("x", "u2"), ("inner", [("colour", "u1"), ("normal", "i4", (3,))]), ("grid", "u1", (3, 2))]
    )
    assert dtype_of(layout) == dtype
    mapping = {
        "x": [1, 4095],
        "inner": {"colour": [5, 0], "normal": [[-131072, 0, 131071], [1, 2, 3]]},
        "grid": np.arange(12).reshape(2, 3, 2),
    }
    words = pack(layout, mapping)
    beats = unpack(layout, words)
    assert beats["inner"]["normal"].tolist() == mapping["inner"]["normal"]
    np.testing.assert_array_equal(beats["grid"], mapping["grid"])
    np.testing.assert_array_equal(pack(layout, beats), words)
    # Written out: x = 4095, colour = 0, the normals' 18 bits, then the grid's 5 bits each.
    expected, offset = 0, 0
    for value, width in [(4095, 12), (0, 3), (1, 18), (2, 18), (3, 18), *((k, 5) for k in range(6, 12))]:
        expected |= value << offset
        offset += width
    assert offset == Shape.cast(layout).width
    assert word_count(layout) == 4
    assert int.from_bytes(words[1].astype("<u4").tobytes(), "little") == expected


LAYOUT = data.StructLayout({"x": 4, "n": data.ArrayLayout(signed(3), 2)})


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int64, np.uint64])
def test_out_of_range_codes_are_named(kind):
    good = {"x": np.array([15, 0, 0], dtype=kind), "n": np.array([[3, 0], [0, 0], [0, 3]], dtype=kind)}
    assert pack(LAYOUT, good).tolist() == [[0b000_011_1111], [0], [0b011_000_0000]]
    with pytest.raises(ValueError, match=r"^x of beat 1 is 16, outside 0 to 15$"):
        pack(LAYOUT, good | {"x": np.array([0, 16, 17], dtype=kind)})
    with pytest.raises(ValueError, match=r"^n\[1\] of beat 2 is 4, outside -4 to 3$"):
        pack(LAYOUT, good | {"n": np.array([[0, 0], [0, 0], [0, 4]], dtype=kind)})


def test_negative_and_huge_codes():
    with pytest.raises(ValueError, match=r"^x of beat 0 is -1, outside 0 to 15$"):
        pack(LAYOUT, {"x": [-1], "n": [[0, 0]]})
    with pytest.raises(
        ValueError, match=r"^beat of beat 0 is 18446744073709551615, outside -2147483648 to 2147483647$"
    ):
        pack(signed(32), np.array([2**64 - 1], dtype=np.uint64))
    with pytest.raises(ValueError, match=r"^beat must be integer codes, not object$"):
        pack(unsigned(63), [2**70])


def test_wrong_fields():
    for beats, message in (
        ({"x": [1]}, "beat must have the fields x, n, not x"),
        ({"x": [1], "n": [[0, 0]], "y": [1]}, "beat must have the fields x, n, not x, n, y"),
        (np.zeros(3, dtype=np.uint8), "beat must have the fields x, n, not no fields"),
        ({"x": [1.0], "n": [[0, 0]]}, "x must be integer codes, not float64"),
        ({"x": {"y": [1]}, "n": [[0, 0]]}, "x must be integer codes, not a mapping"),
        ({"x": [1], "n": [[0, 0, 0]]}, r"n must be an array of 2 elements a beat"),
        ({"x": [1], "n": [0]}, r"n must be an array of 2 elements a beat"),
        ({"x": [[1]], "n": [[0, 0]]}, r"x must be one integer a beat, not an array of shape \(1, 1\)"),
        ({"x": [1, 2], "n": [[0, 0]]}, "all fields must have equally many beats, not 1 and 2"),
    ):
        with pytest.raises(ValueError, match=f"^{message}$"):
            pack(LAYOUT, beats)
    with pytest.raises(ValueError, match=r"^packed beats must have shape \(count, 1\), not \(3,\)$"):
        unpack(LAYOUT, np.zeros(3, dtype=np.uint32))


def test_wrong_layouts():
    with pytest.raises(ValueError, match=r"^a field may have at most 64 bits, not 65$"):
        dtype_of(data.StructLayout({"a": 65}))
    with pytest.raises(
        TypeError, match=r"^a beat is made of structures, arrays and plain shapes, not UnionLayout$"
    ):
        dtype_of(data.UnionLayout({"a": 3, "b": 4}))


def test_a_shape_castable_of_a_shape_castable():
    class Twice(ShapeCastable):
        def as_shape(self):
            return LAYOUT

        def const(self, init):
            return LAYOUT.const(init)

        def __call__(self, value):
            return LAYOUT(value)

        def from_bits(self, raw):
            return LAYOUT.from_bits(raw)

    assert dtype_of(Twice()) == dtype_of(LAYOUT)
