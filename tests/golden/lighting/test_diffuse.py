"""Model of the diffuse unit against the exact cosine."""

import numpy as np
import pytest

from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED

UNIT = Diffuse()
FORMAT = UNIT.operand_format


def compute(codes):
    return UNIT.compute(Fixed(FORMAT, codes))


def test_error():
    """Results about every rounding point are off by at most 2^-18, and by 2^-17 more from the largest number
    on."""
    middles = (np.arange(2**17) << 17) + 2**16
    codes = (middles[:, np.newaxis] + [-(2**16), -1, 0, 1]).ravel()
    cosine = codes * 2.0**-34
    error = np.abs(compute(codes).values - cosine)
    below = cosine < 1 - 2.0**-17
    assert error[below].max() == 2.0**-18
    assert error[~below].max() <= 2.0**-17
    assert 1 - compute([2**34]).values == [2.0**-17]
    # Two unit vectors reach at most (1 - 2^-17)^2, which is within the bound of the rounding.
    peak = ONE_SQUARED.codes.item()
    assert abs(compute([peak]).values[0] - ONE_SQUARED.values) <= 2.0**-18


def test_rises_with_the_cosine():
    codes = np.unique(np.r_[np.linspace(-(2**34), 2**34, 300_001).astype(int), np.arange(-(2**18), 2**18)])
    assert (np.diff(compute(codes).codes) >= 0).all()


def test_stiff_terminator_and_largest_and_smallest_codes():
    """A light from behind gives nothing, and neither does a light at the terminator.

    The smallest positive cosine is not dark.
    """
    codes = [FORMAT.min_code, -(2**34), -(2**16), -1, 0, 1, 2**16 - 1, 2**16, 2**34, FORMAT.max_code]
    largest = 2**17 - 1
    np.testing.assert_array_equal(compute(codes).codes, [0, 0, 0, 0, 0, 0, 0, 1, largest, largest])
    np.testing.assert_array_equal(UNIT.dark(Fixed(FORMAT, codes)), [True] * 5 + [False] * 5)


def test_stiff_terminator_of_a_turning_normal():
    """N turns through a right angle to L in steps of 0.001 degrees. The term begins where the light does."""
    angle = np.radians(90 + np.arange(-1000, 1001) * 1e-3)
    codes = np.rint(ONE_SQUARED.codes * np.cos(angle)).astype(np.int64)
    term = compute(codes)
    assert np.abs(term.values - np.maximum(np.cos(angle), 0)).max() <= 2.0**-18 + 2.0**-16 * np.cos(angle[0])
    assert not term.codes[UNIT.dark(Fixed(FORMAT, codes))].any()
    # Where a pixel is lit but darker than half a step, the term is also 0. So there is no step at the
    # terminator.
    assert np.abs(np.diff(term.codes)).max() <= 3


def test_stiff_normals_of_wrong_length():
    """If N has length 1 +- 1/256 or 0, the term is larger or smaller by this factor, and at most 1.

    There is no other error.
    """
    cosine = np.cos(np.radians(np.linspace(0, 180, 20_001)))
    for length in (0, 1 - 1 / 256, 1 + 1 / 256):
        codes = np.rint(ONE_SQUARED.codes * length * cosine).astype(np.int64)
        ideal = np.clip(length * cosine, 0, 1)
        # The cosine is 2^-16 too small, rounded, and limited to the largest number.
        bound = 2.0**-16 * ideal + 2.0**-18 + 2.0**-17 * (ideal > 1 - 2.0**-17)
        assert (np.abs(compute(codes).values - ideal) <= bound).all()
        assert not compute(codes).codes[cosine < 0].any()


def test_other_operands_are_refused():
    with pytest.raises(ValueError, match=r"^operand must be SQ\(4, 34\), not SQ\(1, 17\)$"):
        UNIT.compute(Fixed(SQ(1, 17), [0]))
