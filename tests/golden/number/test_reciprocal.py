"""Reciprocals of the steps of a span: every word of the table, and every length."""

import numpy as np
import pytest

from blysk.golden.number.fixed import UQ
from blysk.golden.number.reciprocal import reciprocal_address, reciprocal_table, step_words
from blysk.golden.number.spans import LENGTH_BITS


@pytest.mark.parametrize("bits", [17, 18])
def test_table(bits):
    """Every word is the nearest to 1/f, with a relative error of at most 2^-bits."""
    exact = 1 / (1 + np.arange(2048) / 2048)
    exact[0] = 0.5
    words = reciprocal_table(UQ(0, bits))
    assert words.shape == (2048,)
    off = np.abs(words.values - exact)
    assert 0.9 * 2.0 ** -(bits + 1) < off.max() <= 2.0 ** -(bits + 1)
    assert 2.0 ** -(bits + 2) < (off / exact).max() <= 2.0**-bits
    assert words.codes[0] == 1 << (bits - 1)


def test_steps_of_every_length():
    """dt has a relative error of 2^-17, and dt^2 of ``2^-16 + 2^-17 + 2^-34``.

    Both are exact if m - 1 is a power of two.
    """
    length = np.arange(1, 1 << LENGTH_BITS)
    steps = np.maximum(length - 1, 1)
    address, shift = reciprocal_address(length - 1)
    reciprocal, same_shift, square, square_shift = step_words(length)
    np.testing.assert_array_equal(reciprocal.codes, reciprocal_table().codes[address])
    np.testing.assert_array_equal(shift, same_shift)
    dt = np.abs(2 * reciprocal.values * 2.0**-shift * steps - 1)
    squared = np.abs(4 * square.values * 2.0**-square_shift * steps**2 - 1)
    assert 2.0**-18 < dt.max() <= 2.0**-17
    assert 2.0**-17 < squared.max() <= 2.0**-16 + 2.0**-17 + 2.0**-34
    whole = steps & (steps - 1) == 0
    assert not dt[whole].any()
    assert not squared[whole].any()
    assert (shift.min(), shift.max(), square_shift.max()) == (0, 12, 25)
    # The word is normalised, except for the rounding of a square.
    assert reciprocal.codes.min() == square.codes.min() == 1 << 16
