"""Line setup against float64 and exact integers."""

import numpy as np
import pytest

from blysk.bench.units.normals.line_setup import any_lines
from blysk.bench.units.operands import sphere
from blysk.golden.normals.line_setup import LineSetup, quantise_line
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT

UNIT = LineSetup()
MAX_LENGTH = (1 << LENGTH_BITS) - 1
FORMAT = UNIT.VECTOR_FORMAT
BOUND = UNIT.ERROR / np.sqrt(3)
"""Bound of each component."""


def steps(left, right, length):
    words = (Fixed(FORMAT, np.asarray(codes)) for codes in (left, right))
    return UNIT.compute(*words, np.asarray(length))


def errors(left, right, length, pixel):
    """Distance of a point of the line from the exact point, by component, in units of 1."""
    step = steps(left, right, length)
    assert step.format == UNIT.FORMAT
    t = pixel / np.maximum(length - 1, 1)
    # This is exact: differences have 24 bits, products 53.
    moved = pixel[:, np.newaxis] * step.codes * UNIT.FORMAT.step
    return np.abs(moved - (right - left) * t[:, np.newaxis] * FORMAT.step)


def test_every_length():
    """The last pixel of a span of each length is checked, for lines as long as the words allow and for
    others."""
    rng = np.random.default_rng(1)
    length = np.arange(1, MAX_LENGTH + 1)
    full = np.full((len(length), 3), FORMAT.max_code) * rng.choice([-1, 1], (len(length), 3))
    worst = 0
    for left, right in ((full, -full), any_lines(rng, len(length)), any_lines(rng, len(length))):
        worst = max(worst, errors(left, right, length, np.maximum(length - 1, 1)).max())
    assert BOUND / 2 < worst <= BOUND


@pytest.mark.parametrize("length", [2, 3, 4, 5, 16, 17, 2049, 2050, 4094, 4095])
def test_stiff_lengths(length):
    """Every pixel is checked for spans at the ends of the table of reciprocals."""
    rng = np.random.default_rng(length)
    count = 60_000 // length + 20
    left, right = any_lines(rng, count)
    left, right = (np.repeat(codes, length, axis=0) for codes in (left, right))
    pixel = np.tile(np.arange(length), count)
    worst = errors(left, right, np.full(len(pixel), length), pixel).max()
    assert worst <= BOUND
    if length - 1 & (length - 2) == 0:
        # A power of two divides exactly.
        assert worst <= 2.0**-41 * length


def test_span_of_one_pixel():
    """A span of one pixel counts as two pixels: its step is finite, and no pixel takes it."""
    left, right = any_lines(np.random.default_rng(2), 100)
    np.testing.assert_array_equal(
        steps(left, right, np.ones(100, int)).codes, steps(left, right, np.full(100, 2)).codes
    )
    np.testing.assert_array_equal(steps(left, right, np.full(100, 2)).codes, (right - left) << 18)


def test_equal_ends():
    left, _ = any_lines(np.random.default_rng(3), 4000)
    assert not steps(left, left, np.arange(1, 4001)).codes.any()


def test_words_of_the_ends():
    """The largest differences of both signs are tried at each length.

    No step wraps, and the last point is that of the end.
    """
    low, high = FORMAT.min_code, FORMAT.max_code
    length = np.arange(1, MAX_LENGTH + 1)
    for left, right in ((low, high), (high, low)):
        ends = (np.full((len(length), 3), code) for code in (left, right))
        w = steps(*ends, length).values
        assert (np.sign(w) == np.sign(right - left)).all()
        exact = (right - left) * FORMAT.step / np.maximum(length - 1, 1)[:, np.newaxis]
        assert (np.abs(w / exact - 1) <= 2.0**-24 + 2.0**-31 + 2.0**-41 / np.abs(exact)).all()


def test_quantised_lines():
    """The larger end has length 1, and the other its proportion. Codes are off by at most half a step."""
    rng = np.random.default_rng(4)
    exact = [sphere(rng, 1000) * 10.0 ** rng.uniform(-3, 3, (1000, 1)) for _ in range(2)]
    exact[0][:10] = 0
    codes = quantise_line(*exact)
    lengths = [np.linalg.norm(end, axis=1) for end in codes]
    assert np.abs(np.maximum(*lengths) * FORMAT.step - 1).max() <= 2.0**-21
    assert not codes[0][:10].any()
    largest = np.maximum(*(np.linalg.norm(end, axis=1) for end in exact))[:, np.newaxis]
    for end, found in zip(exact, codes, strict=True):
        assert np.abs(found - end / largest * FORMAT.max_code).max() <= 0.5 + 1e-6
        assert found.min() >= -FORMAT.max_code
        assert found.max() <= FORMAT.max_code


def test_refuses():
    good, zero = Fixed(FORMAT, np.zeros((1, 3), int)), np.zeros((1, 3), int)
    for ends in ((good, Fixed(COMPONENT, zero)), (Fixed(SQ(2, 22), zero), good)):
        with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 22\)$"):
            UNIT.compute(*ends, np.array([2]))
    for length in (0, MAX_LENGTH + 1):
        with pytest.raises(ValueError, match="length"):
            UNIT.compute(good, good, np.array([length]))
