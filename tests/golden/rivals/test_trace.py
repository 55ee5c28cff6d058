"""Counts of parts, and of bits that switch, against counts bit by bit."""

import numpy as np
import pytest

from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.rivals.trace import Trace, ones, tiles


@pytest.mark.parametrize("format", [SQ(5, 4), UQ(2, 7), SQ(3, 60)])
def test_ones_are_those_of_the_binary_text(format):
    codes = np.random.default_rng(1).integers(format.min_code, format.max_code, (40, 2), dtype=np.int64)
    low = [bin(code & (1 << format.width) - 1).count("1") for code in codes.ravel().tolist()]
    assert ones(codes, format).ravel().tolist() == low


def test_parts_and_switched_bits_of_a_small_datapath():
    a = Fixed(SQ(1, 17), np.array([[3, -1], [-4, 5], [0, 7]]))
    b = Fixed(UQ(0, 20), np.array([[9], [12], [1 << 19]]))
    trace = Trace()
    result = trace.product(a, b)
    np.testing.assert_array_equal(result.codes, a.codes * b.codes)
    assert trace.multipliers == {"pixel": 4}
    assert trace.register_bits == 2 * 38
    partial = [
        [[(x >> i & 1) & (y >> j & 1) for i in range(18) for j in range(20)] for x in row]
        for row, y in zip(a.codes.tolist(), b.codes[:, 0].tolist(), strict=True)
    ]
    bits = [[[x >> i & 1 for i in range(38)] for x in row] for row in result.codes.tolist()]
    switched = sum(int(np.abs(np.diff(np.array(of), axis=0)).sum()) for of in (partial, bits))
    assert trace.switched_a_pixel == switched / 3
    trace.added(result, "span")
    trace.read(100, result)
    assert trace.adder_bits == {"span": 76}
    assert (trace.memory_bits, trace.register_bits) == (200, 4 * 38)


def test_operands_over_18_bits_take_several_multipliers():
    assert [tiles(UQ(0, bits)) for bits in (1, 18, 19, 36, 37)] == [1, 1, 2, 2, 3]


def test_products_of_spans_and_triangles_share_multipliers():
    word = Fixed(UQ(0, 17), np.ones((2, 1), dtype=np.int64))
    trace = Trace()
    for rate, count in (("pixel", 11), ("span", 13), ("triangle", 9)):
        for _ in range(count):
            trace.product(word, word, rate)
    assert (trace.multipliers_at(), trace.multipliers_at(1)) == (11 + 5 + 2, 11 + 13 + 2)
