"""The recurrence method against cosines along the great circle."""

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, quantise, values


def operands_of(interpolator, left, right, length, direction, halfway):
    left, right, direction, halfway = (Fixed(COMPONENT, v) for v in (left, right, direction, halfway))
    return interpolator.compute(left, right, length, direction, halfway)


def errors(interpolator, left, right, length, direction, halfway):
    """Largest error of N·L and of the cosine of H, by span."""
    found = operands_of(interpolator, left, right, length, direction, halfway)
    span, index = pixels_of(length)
    t = index / np.maximum(length[span] - 1, 1)
    normals = interpolator.exact_normals(values(left)[span], values(right)[span], t)
    cosines = normals @ values(direction).T, normals @ values(halfway).T
    off = np.maximum(
        np.abs(found.cosine.values - cosines[0]), np.abs(1 - found.highlight.values - cosines[1])
    ).max(axis=1)
    worst = np.zeros(len(length))
    np.maximum.at(worst, span, off)
    return worst, found


@pytest.mark.parametrize("lights", [1, 2])
def test_operands_keep_the_bound(lights):
    """Spans of all lengths and angles are computed in one call, and each keeps its own bound."""
    rng = np.random.default_rng(1)
    degrees = np.r_[np.zeros(20), 10.0 ** rng.uniform(-4, 0, 100), rng.uniform(0, 90, 280)]
    left, right = (quantise(v) for v in pairs_at(rng, 400, degrees))
    length = rng.integers(1, 60, 400)
    length[::40] = [1, 2, 3, 4, 5, 8, 9, 2049, 4094, 4095]
    direction, halfway = (quantise(pairs_at(rng, lights, 0.0)[0]) for _ in range(2))
    interpolator = RecurrenceInterpolator()
    worst, found = errors(interpolator, left, right, length, direction, halfway)
    assert found.cosine.shape == found.highlight.shape == (length.sum(), lights)
    assert not found.out_of_range.any()
    # The curve follows the lengths of the codes, which are off by up to about 2^-17. So does the angle.
    assert np.all(worst <= interpolator.setup.error(length, np.radians(degrees)) + 2.0**-16)


def test_spans_do_not_depend_on_each_other():
    rng = np.random.default_rng(2)
    left, right = (quantise(v) for v in pairs_at(rng, 40, rng.uniform(0, 100, 40)))
    length = np.r_[rng.integers(1, 40, 38), 500, 1]
    vectors = [quantise(pairs_at(rng, 2, 0.0)[0]) for _ in range(2)]
    whole = operands_of(RecurrenceInterpolator(), left, right, length, *vectors)
    ends = np.cumsum(length)
    for k in range(40):
        one = slice(k, k + 1)
        single = operands_of(RecurrenceInterpolator(), left[one], right[one], length[one], *vectors)
        pixels = slice(ends[k] - length[k], ends[k])
        np.testing.assert_array_equal(single.cosine.codes, whole.cosine.codes[pixels])
        np.testing.assert_array_equal(single.highlight.codes, whole.highlight.codes[pixels])
        assert single.out_of_range == whole.out_of_range[k]


def test_refuses_a_form():
    with pytest.raises(ValueError, match=r"^form must be one of reinsch, direct, not 'sine'$"):
        RecurrenceInterpolator("sine")
