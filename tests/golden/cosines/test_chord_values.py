"""Chord values of a normal, against exact integers and float64."""

from itertools import product

import numpy as np
import pytest

from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED
from blysk.golden.reference.geometry import normalise
from blysk.sim.units.operands import component_words, unit_codes, vectors_near, word_ends

ONE_VALUE = float(ONE_SQUARED.values)


def values(normal, direction, halfway):
    words = ChordValues().compute(*component_words(normal, direction, halfway))
    return (word.codes for word in words)


def test_equals_exact_integers():
    """Dot products and squared differences of Python's integers, rounded half up; ends of words, too."""
    rng = np.random.default_rng(1)
    normals = np.vstack([word_ends(rng, 200, 3), unit_codes(rng, 300)])
    direction, halfway = (np.vstack([word_ends(rng, 2, 3), unit_codes(rng, 2)]) for _ in range(2))
    normals[-4:] = halfway
    found = list(values(normals, direction, halfway))
    saturated = 0
    for index, light in product(range(len(normals)), range(4)):
        normal = normals[index].tolist()
        dot = sum(n * d for n, d in zip(normal, direction[light].tolist(), strict=True))
        # 34 fraction bits to 25; 2^25 does not fit.
        f = min(max(((dot >> 8) + 1) >> 1, -(1 << 25)), (1 << 25) - 1)
        differences = [n - h for n, h in zip(normal, halfway[light].tolist(), strict=True)]
        far = any(not -(1 << 17) <= d < 1 << 17 for d in differences)
        square = sum((d >> far) ** 2 for d in differences) << 2 * far
        saturated += square >= 2 << 35
        # 35 fraction bits to 26.
        u = min((min(square, (1 << 37) - 1) + (1 << 8)) >> 9, (1 << 27) - 1)
        assert (found[0][index, light], found[1][index, light]) == (f, u)
    assert saturated > 10


def test_errors():
    """Within the bounds of the directions' exact values, for u of every size; not far from them."""
    rng = np.random.default_rng(2)
    worst = np.zeros(3)
    for _ in range(40):
        left, right = unit_codes(rng, 4000), unit_codes(rng, 4000)
        light, halfway = unit_codes(rng, 1), vectors_near(rng, left[:1], right[:1])
        near = normalise(halfway / ONE + 10.0 ** rng.uniform(-4, 0, (4000, 1)) * rng.normal(size=(4000, 3)))
        left[::2] = np.rint(near * ONE)[::2].astype(np.int64)
        f, u = (code[:, 0] for code in values(left, light, halfway))
        n, d, h = (normalise(v / ONE) for v in (left, light, halfway))
        exact = np.square(n - h).sum(axis=1) / 2
        error = np.abs(f * 2.0**-25 - ONE_VALUE * (n @ d[0]))
        assert error.max() <= ChordValues.diffuse_error()
        worst[0] = max(worst[0], error.max() / ChordValues.diffuse_error())
        error = np.abs(u * 2.0**-26 - ONE_VALUE * exact)
        bound = np.array([ChordValues.highlight_error(float(value)) for value in exact[:500]])
        assert (error[:500] <= bound).all()
        for index, (low, high) in enumerate(((0, 0.05), (0.05, 2)), 1):
            kept = error[(exact >= low) & (exact < high)]
            assert kept.max() <= ChordValues.highlight_error(high)
            worst[index] = max(worst[index], kept.max() / ChordValues.highlight_error(high))
    assert (worst > 1 / 8).all()


def test_opposite_vectors_saturate():
    """u = 2 has no code; the largest one stands for it. The peak has u = 0, exactly."""
    axis = np.array([[0, 0, ONE], [0, 0, COMPONENT.min_code]])
    _, u = values(axis, axis[:1], axis[:1])
    assert u[:, 0].tolist() == [0, (1 << 27) - 1]
    f, _ = values(axis[1:], axis[1:], axis[1:])
    assert f[0, 0] == (1 << 25) - 1


def test_refuses():
    vector, other = Fixed(COMPONENT, np.array([[0, 0, ONE]])), Fixed(SQ(2, 16), np.array([[0, 0, 1]]))
    for operands in ((other, vector, vector), (vector, other, vector), (vector, vector, other)):
        with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\)$"):
            ChordValues().compute(*operands)
