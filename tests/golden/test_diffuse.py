"""Diffuse twin against the exact cosine."""

import numpy as np
import pytest

from golden.diffuse import Diffuse
from golden.fixed import SQ, Fixed
from golden.unit_vector import ONE_SQUARED

UNIT = Diffuse()
FORMAT = UNIT.OPERAND_FORMAT


def compute(codes):
    return UNIT.compute(Fixed(FORMAT, codes))


def test_error():
    """2^-18, of all results about every rounding point; and 2^-17 more from the largest number on."""
    middles = (np.arange(2**17) << 17) + 2**16
    codes = (middles[:, np.newaxis] + [-(2**16), -1, 0, 1]).ravel()
    cosine = codes * 2.0**-34
    error = np.abs(compute(codes).values - cosine)
    below = cosine < 1 - 2.0**-17
    assert error[below].max() == 2.0**-18
    assert error[~below].max() <= 2.0**-17
    assert 1 - compute([2**34]).values == [2.0**-17]
    # Two unit vectors reach (1 - 2^-17)^2 and no more: within the bound of the rounding.
    peak = ONE_SQUARED.codes.item()
    assert abs(compute([peak]).values[0] - ONE_SQUARED.values) <= 2.0**-18


def test_rises_with_the_cosine():
    codes = np.unique(np.r_[np.linspace(-(2**34), 2**34, 300_001).astype(int), np.arange(-(2**18), 2**18)])
    assert (np.diff(compute(codes).codes) >= 0).all()


def test_ends_and_terminator():
    """Nothing from behind, at the terminator itself neither; the smallest positive cosine is not dark."""
    codes = [FORMAT.min_code, -(2**34), -(2**16), -1, 0, 1, 2**16 - 1, 2**16, 2**34, FORMAT.max_code]
    largest = 2**17 - 1
    np.testing.assert_array_equal(compute(codes).codes, [0, 0, 0, 0, 0, 0, 0, 1, largest, largest])
    np.testing.assert_array_equal(UNIT.dark(Fixed(FORMAT, codes)), [True] * 5 + [False] * 5)


def test_other_operands_are_refused():
    with pytest.raises(ValueError, match=r"^operand must be SQ\(4, 34\), not SQ\(1, 17\)$"):
        UNIT.compute(Fixed(SQ(1, 17), [0]))
