"""Reciprocals, and products of halves, within their bounds."""

import numpy as np
import pytest

from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.golden.geometry.wide_product import LOST, halves, wide_product
from blysk.golden.number.fixed import SQ, UQ, Fixed


def test_bound():
    """Each 32nd operand is tried, and all operands near 1 and 2."""
    p = Reciprocal()
    codes = np.r_[
        (1 << 25) + np.arange(0, 1 << 25, 32), (1 << 25) + np.arange(1000), (1 << 26) - np.arange(1, 1000)
    ]
    error = np.abs(p.compute(Fixed(p.FORMAT, codes)).values - 2.0**25 / codes).max()
    assert 0.5 * p.ERROR < error < p.ERROR


def test_one_stays_one():
    """1 / 1 is exact."""
    assert Reciprocal().compute(Fixed(Reciprocal.FORMAT, np.array([1 << 25]))).codes.tolist() == [1 << 25]


def test_refusal():
    """Numbers below 1, and other formats, are refused."""
    for operand in (Fixed(Reciprocal.FORMAT, np.array([5])), Fixed(UQ(1, 19), np.array([1 << 19]))):
        with pytest.raises(ValueError, match=r"^operands must be UQ\(1, 25\), from 1 on$"):
            Reciprocal().compute(operand)


def test_wide_product():
    """Products of signed and unsigned operands are within the rounding, three cuts, and the product that is
    left out."""
    rng = np.random.default_rng(1)
    a = Fixed(SQ(2, 23), rng.integers(-(1 << 24), 1 << 24, 100_000))
    b = Fixed(UQ(1, 25), rng.integers(1 << 24, 1 << 25, 100_000))
    found = wide_product(a, b, 7, 9, 24)
    error = np.abs(found.values - a.values * b.values).max()
    bound = LOST * 2.0**-24 + 2.0 ** (7 + 9 - 23 - 25)
    assert 0.6 * bound < error < bound
    for value, bits in ((a, 7), (b, 9)):
        high, low = halves(value, bits)
        np.testing.assert_array_equal((high + low).values, value.values)
