"""Vector normaliser against float64, within its bounds."""

import numpy as np
import pytest

from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE


def vectors(rng, count):
    """Vectors of all directions and of lengths over 2^-16, along axes and planes, and at the ends of the
    words."""
    v = rng.normal(size=(count, 3)) * 2.0 ** rng.uniform(0, 15, (count, 1))
    v[::5, rng.integers(0, 3)] = 0
    v /= np.abs(v).max(axis=1, keepdims=True)
    v *= 2.0 ** rng.uniform(10.01, 26, (count, 1))
    v = np.clip(np.rint(v), SPAN_NORMAL.min_code, SPAN_NORMAL.max_code).astype(np.int64)
    v[:27] = np.stack(np.meshgrid(*[[SPAN_NORMAL.min_code, 0, SPAN_NORMAL.max_code]] * 3), axis=-1).reshape(
        -1, 3
    )
    return v


def test_bounds():
    """Length and direction are within their bounds."""
    v = vectors(np.random.default_rng(1), 400_000)
    normal, lost = VectorNormaliser().compute(Fixed(SPAN_NORMAL, v), np.zeros(len(v), dtype=bool))
    assert lost.tolist() == [(row == 0).all() for row in v]
    found, exact = normal.codes[~lost] / ONE, v[~lost] / np.linalg.norm(v[~lost], axis=1, keepdims=True)
    length = np.abs(np.linalg.norm(found, axis=1) - 1).max()
    turned = np.linalg.norm(np.cross(found, exact), axis=1).max()
    assert 0.5 * VectorNormaliser.LENGTH_ERROR < length < VectorNormaliser.LENGTH_ERROR
    assert 0.4 * VectorNormaliser.DIRECTION_ERROR < turned < VectorNormaliser.DIRECTION_ERROR


def test_fit_of_the_table():
    """At both ends of a segment the fit leaves at most `FIT` of the factor."""
    p = VectorNormaliser()
    s = (np.arange(1 << 18, 1 << 20) + 0.5) * 2.0**-20
    c0, c1 = (c.values[np.floor(s * 512).astype(int)] for c in p.coefficients)
    u = s - (np.floor(s * 512) + 0.5) / 512
    error = np.abs((c0 - c1 * u) * np.sqrt(s) / (ONE * COMPONENT.step) - 1).max()
    assert 0.5 * p.FIT < error < p.FIT


def test_factor_of_every_square():
    """No word of the factor wraps or saturates, for all rounded squared lengths from 1/4 to 1."""
    p = VectorNormaliser()
    s = np.arange(1 << 18, 1 << 20)
    e = p.factor(Fixed(UQ(0, 22), s << 2))
    assert e.codes.min() > p.FACTOR_FORMAT.min_code
    assert e.codes.max() < p.FACTOR_FORMAT.max_code
    exact = ONE * COMPONENT.step / np.sqrt((s + 0.5) * 2.0**-20) - 1
    assert np.abs(e.values - exact).max() < 2 * p.FIT + 2.0**-20 + 2.0**-18


def test_lost_and_flipped():
    """A vector without direction is flagged.

    Flipped vectors are the negatives, except for the rounding of ties.
    """
    lost = VectorNormaliser().compute(Fixed(SPAN_NORMAL, np.array([[1023, -1024, 5], [1024, 0, 0]])), [0, 0])[
        1
    ]
    assert lost.tolist() == [True, False]
    v = vectors(np.random.default_rng(2), 1000)
    plain, turned = (
        VectorNormaliser().compute(Fixed(SPAN_NORMAL, v), np.full(len(v), flip))[0].codes for flip in (0, 1)
    )
    assert set(np.unique(plain + turned)) <= {0, 1}


def test_refusal():
    """Another format is refused."""
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 26\), not SQ\(1, 17\)$"):
        VectorNormaliser().compute(Fixed(COMPONENT, np.zeros((1, 3), dtype=np.int64)), [False])
