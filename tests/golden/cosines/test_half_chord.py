"""Half-chord unit: the bit-accurate model against float64."""

import numpy as np
import pytest

from blysk.bench.units.cosines.half_chord import chord_of
from blysk.bench.units.operands import code_pairs_at, component_words, degrees_between
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED

UNIT = HalfChord()


def test_relative_error():
    rng = np.random.default_rng(7)
    largest = ONE_SQUARED.codes * 2
    codes = np.r_[np.arange(1, 5000), largest - np.arange(5000)]
    codes = np.r_[codes, np.trunc(2.0 ** rng.uniform(0, np.log2(largest), 10**5)).astype(np.int64)]
    chord = Fixed(UQ(2, 34), codes)
    angle = np.arcsin(np.sqrt(chord.values / ONE_SQUARED.values) / 2) / np.pi
    for supplement in (False, True):
        exact = 0.5 - angle if supplement else angle
        error = np.abs(UNIT.compute(chord, np.full(len(codes), supplement)).values - exact) - 2.0**-36
        assert np.all(error <= UNIT.RELATIVE_ERROR * angle)
        assert (error / angle).max() > 0.6 * UNIT.RELATIVE_ERROR
    assert UNIT.compute(Fixed(UQ(2, 34), [0, 0]), np.array([False, True])).values.tolist() == [0, 0.5]


@pytest.mark.parametrize("degrees", [0, 1e-4, 1e-2, 1, 45, 89.9, 90, 120, 179, 179.99, 180])
def test_stiff_angles_of_normals(degrees):
    left, right = code_pairs_at(np.random.default_rng(8), 1500, degrees)
    angle = 360 * UNIT.compute(*chord_of(left, right)).values
    exact = degrees_between(left, right)[:, 0]
    # A length is off by at most 2^-18, and a chord between normals of unequal length by their difference.
    lengths = np.abs(np.linalg.norm(left, axis=1) - np.linalg.norm(right, axis=1)) / 2.0**17
    bound = UNIT.RELATIVE_ERROR * np.minimum(exact, 180 - exact) + np.degrees(2 * lengths + 2.0**-17)
    assert np.all(np.abs(angle - exact) <= bound)
    # Each quantised normal is off by less than sqrt 3 steps.
    assert np.abs(angle - degrees).max() <= np.degrees(2 * np.sqrt(3) * 2.0**-17) + bound.max()


def test_keeps_the_digits_that_arccos_loses():
    left, right = code_pairs_at(np.random.default_rng(9), 1500, 1.0)
    cosine = DotProduct().compute(*component_words(left, right)).round_half_up(16)
    by_arccos, _ = Arccos().compute(cosine.wrap(SQ(2, 16)))
    by_chord = UNIT.compute(*chord_of(left, right))
    assert np.abs(np.degrees(by_arccos.values) - 1).max() > 0.2
    assert np.abs(360 * by_chord.values - 1).max() < 0.003


def test_refuses():
    with pytest.raises(ValueError, match=r"operand must be UQ\(2, 34\), not UQ\(3, 34\)"):
        UNIT.compute(Fixed(UQ(3, 34), [0]), np.array([False]))
