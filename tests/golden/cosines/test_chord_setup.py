"""Chord setup: quadratics through three given values, against float64."""

import numpy as np
import pytest

from blysk.bench.units.cosines.chord_setup import any_values, value_at
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.reciprocal import step_words
from blysk.golden.number.unit_vector import ONE

P = ChordSetup()
FORMATS = P.DIFFUSE_FORMAT, P.HIGHLIGHT_FORMAT
SCALE = (ONE / 2**17) ** 2
"""Product of two unit vectors."""


def setup(diffuse, highlight, length, parameters=P):
    """Run the setup for codes of shape (spans, 3) or (spans, lights, 3)."""
    diffuse, highlight = (np.reshape(v, (len(v), -1, 3)) for v in (diffuse, highlight))
    return parameters.compute(Fixed(P.DIFFUSE_FORMAT, diffuse), Fixed(P.HIGHLIGHT_FORMAT, highlight), length)


def at(differences, step):
    """Values of the quadratic at a pixel of each span."""
    return SCALE * value_at(differences, step)


def curves(rng, count, size, low, high):
    """Start, P and G of random quadratics that stay in a range."""
    slope = rng.uniform(-0.49, 0.49, count) * size
    curvature = rng.uniform(-0.12, 0.12, count) * size
    room = np.abs(slope) + np.abs(curvature) + 1e-3
    return rng.uniform(low + room, high - room), slope, curvature


def two_curves(rng, count, size):
    """Quadratics of f and of u, and the codes of their three values."""
    both = curves(rng, count, size, -1, 1), curves(rng, count, size, 0, 2)
    codes = []
    for (start, slope, curvature), format in zip(both, FORMATS, strict=True):
        values = np.stack([start + t * (slope + t * curvature) for t in (0, 0.5, 1)], axis=1)
        codes.append(np.floor(values / format.step + 0.5).astype(np.int64))
    return both, codes


@pytest.mark.parametrize("size", [1e-4, 1e-2, 0.1, 1.0])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095, None])
def test_error(size, length):
    """Errors at random pixels and at the last pixel are within the bounds.

    Where lengths are random, they come near the bounds.
    """
    rng, count = np.random.default_rng(int(1e4 * size)), 10_000
    both, codes = two_curves(rng, count, size)
    length = rng.integers(2, 4096, count) if length is None else np.full(count, length)
    *functions, out_of_range = setup(*codes, length)
    assert not out_of_range.any()
    step = np.where(rng.random(count) < 0.5, length - 1, rng.integers(0, length))
    t = step / np.maximum(length - 1, 1)
    bounds = P.diffuse_error, P.highlight_error
    for differences, (start, slope, curvature), bound in zip(functions, both, bounds, strict=True):
        error = np.abs(at(differences, step) - (start + t * (slope + t * curvature)))
        assert (error <= bound(np.abs(slope), np.abs(curvature))).all()
        if length.min() < length.max():
            assert error.max() > bound(0.49 * size, 0.12 * size) / 8


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_equal_values_stay(length):
    """Equal values give no difference at all, also at the ends of the ranges."""
    rng = np.random.default_rng(length)
    codes = [value[:, 0, :1].repeat(3, axis=1) for value in any_values(rng, 500, 1)]
    for value, format in zip(codes, FORMATS, strict=True):
        value[:2] = [[format.min_code], [format.max_code]]
    *functions, out_of_range = setup(*codes, np.full(500, length))
    assert not out_of_range.any()
    for differences, value, format in zip(functions, codes, FORMATS, strict=True):
        np.testing.assert_array_equal(differences.start.values[:, 0], value[:, 0] * format.step)
        assert not differences.first.codes.any()
        assert not differences.second.codes.any()


@pytest.mark.parametrize("length", [2, 3, 5, 9, 17, 4097 // 2 + 1])
def test_stiff_values_are_met(length):
    """If dt is a power of two, only G (for f also P) is rounded: the error is 2^-23 in the middle, and
    2^-19."""
    _, codes = two_curves(np.random.default_rng(length), 2000, 0.9)
    diffuse, highlight, _ = setup(*codes, np.full(2000, length))
    drift = 2.0**-46 * (length + length**2 / 2)
    for column, step in ((0, 0), (1, (length - 1) // 2), (2, length - 1)):
        if length > 2 or column != 1:
            middle, step = 2.0**-23 if column == 1 else 0, np.full(2000, step)
            error = np.abs(at(highlight, step) - codes[1][:, column] * P.HIGHLIGHT_FORMAT.step)
            assert error.max() <= middle + drift
            error = np.abs(at(diffuse, step) - codes[0][:, column] * P.DIFFUSE_FORMAT.step)
            assert error.max() <= middle + 2.0**-19 * column / 2 + drift


def test_flag():
    """The flag is set exactly if a rounded word leaves its format."""
    count = 20_001
    offset = np.arange(count) - count // 2
    zero, length = np.zeros((count, 3), dtype=np.int64), np.full(count, 5)
    half = 1 << 25

    # For u: P has 26 fraction bits, and its format ends at about 1/2. v_m is in the middle, so G is 0 or half
    # a step.
    end = half + offset
    highlight = np.stack([0 * end, end >> 1, end], axis=1)
    curvature = (2 * (end - 2 * (end >> 1)) / 2.0**26 * 2**20 + 0.5) // 1
    assert not curvature.any()
    _, _, out_of_range = setup(zero, highlight, length)
    np.testing.assert_array_equal(out_of_range, end >= half)
    # In the other direction -1/2 itself fits.
    _, _, out_of_range = setup(zero, highlight[:, ::-1], length)
    np.testing.assert_array_equal(out_of_range, end > half)

    # With equal ends G = 4 (v_l - v_m). It is 1/8 at v_l - v_m = 2^-5, rounded half up to 2^-20.
    bump = (1 << 21) + offset
    for sign in (1, -1):
        highlight = np.stack([half + 0 * bump, half - sign * bump, half + 0 * bump], axis=1)
        _, _, out_of_range = setup(zero, highlight, length)
        curvature = np.floor(sign * 4 * bump / 2.0**26 * 2**20 + 0.5)
        np.testing.assert_array_equal(out_of_range, (curvature >= 2**17) | (curvature < -(2**17)))
        assert 0 < np.count_nonzero(out_of_range) < count

    # For f: P is rounded to 18 fraction bits.
    end = (1 << 24) + offset
    diffuse = np.stack([0 * end, end >> 1, end], axis=1)
    _, _, out_of_range = setup(diffuse, zero, length)
    np.testing.assert_array_equal(out_of_range, np.floor(end / 2.0**25 * 2**18 + 0.5) >= 2**17)
    assert 0 < np.count_nonzero(out_of_range) < count


@pytest.mark.parametrize("curved", [False, True])
def test_stiff_drift_over_4095_pixels(curved):
    """The rounding of the differences makes ``2^-46 (k + k^2/2)`` at pixel k.

    This is the worst of many spans.
    """
    rng, p = np.random.default_rng(46 + curved), P
    count, length = 200_000, np.full(200_000, 4095)
    slopes = rng.integers(-(2**25), 2**25, (count, 1))
    curvatures = rng.integers(-(2**17), 2**17, (count, 1)) * curved
    words = Fixed(p.SLOPE_FORMAT, slopes), Fixed(p.CURVATURE_FORMAT, curvatures)
    differences = p.differences(Fixed(p.HIGHLIGHT_FORMAT, 0 * slopes), *words, *p.steps(length))
    reciprocal, shift, square, square_shift = step_words(np.array([4095]))
    k = 4094
    # Computed in codes of 80 fraction bits, which are exact for the words of dt and dt^2.
    slope_term = slopes[:, 0].astype(object) * int(reciprocal.codes[0]) << 38 - int(shift[0])
    curvature_term = curvatures[:, 0].astype(object) * int(square.codes[0]) << 45 - int(square_shift[0])
    exact = k * slope_term + k**2 * curvature_term
    first, second = (d.codes[:, 0].astype(object) << 34 for d in differences[1:])
    drift = np.abs((k * first + k * (k - 1) // 2 * second - exact).astype(float)) * 2.0**-80
    bound = 2.0**-46 * (k + k**2 / 2) if curved else 2.0**-46 * k
    assert drift.max() <= bound
    assert drift.max() > 0.9 * (bound if curved else bound / 2)


@pytest.mark.parametrize("fraction_bits", [36, 40])
def test_fewer_bits_keep_the_bounds(fraction_bits):
    """Fewer fraction bits keep the bounds in spans of the length that they allow.

    The bounds are hardly larger than with all bits.
    """
    rng, p = np.random.default_rng(fraction_bits), ChordSetup(fraction_bits)
    assert p.longest == {36: 127, 40: 511}[fraction_bits]
    for length in (2, 3, p.longest):
        both, codes = two_curves(rng, 10_000, 1.0)
        *functions, out_of_range = setup(*codes, np.full(10_000, length), p)
        assert not out_of_range.any()
        step = rng.integers(0, length, 10_000)
        t = step / (length - 1)
        bounds = (p.diffuse_error, P.diffuse_error), (p.highlight_error, P.highlight_error)
        for differences, (start, slope, curvature), (bound, full) in zip(
            functions, both, bounds, strict=True
        ):
            error = np.abs(at(differences, step) - (start + t * (slope + t * curvature)))
            sizes = np.abs(slope), np.abs(curvature)
            assert (error <= bound(*sizes)).all()
            assert bound(0.5, 0.125) < 1.1 * full(0.5, 0.125)


@pytest.mark.parametrize("fraction_bits", [34, 37, 48])
def test_refuses_fraction_bits(fraction_bits):
    with pytest.raises(ValueError, match=rf"^fraction_bits must be even and 36 to 46, not {fraction_bits}$"):
        ChordSetup(fraction_bits)


def test_lights_are_independent():
    rng = np.random.default_rng(9)
    shape = (300, 3, 3)
    diffuse = rng.integers(-(1 << 20), 1 << 20, shape)
    highlight = rng.integers(1 << 20, 1 << 22, shape)
    length = rng.integers(1, 4096, 300)
    *together, out_of_range = setup(diffuse, highlight, length)
    flags = np.zeros(300, dtype=bool)
    for light in range(3):
        *alone, flag = setup(diffuse[:, light], highlight[:, light], length)
        flags |= flag
        for both, one in zip(together, alone, strict=True):
            for a, b in zip(both, one, strict=True):
                np.testing.assert_array_equal(a.codes[:, light], b.codes[:, 0])
    np.testing.assert_array_equal(out_of_range, flags)


def test_refuses():
    f, u = (Fixed(format, np.zeros((1, 1, 3), int)) for format in (P.DIFFUSE_FORMAT, P.HIGHLIGHT_FORMAT))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 25\) and UQ\(1, 26\), not UQ\(1, 26\), "):
        P.compute(u, u, np.array([1]))
    for length in (0, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            P.compute(f, u, np.array([length]))


def test_quantise():
    """Codes are the nearest, in units of ONE_SQUARED. The ends of the ranges fit."""
    values = SpanValues.quantise(np.array([[[-1.0, 0.0, 1.0]]]), np.array([[[0.0, 1.0, 2.0]]]))
    one = (2**17 - 1) ** 2 / 2**34
    assert values.diffuse.tolist() == [[[-round(one * 2**25), 0, round(one * 2**25)]]]
    assert values.highlight.tolist() == [[[0, round(one * 2**26), round(2 * one * 2**26)]]]
    with pytest.raises(ValueError, match=r"outside|exceed"):
        SpanValues.quantise(np.zeros((1, 1, 3)), np.full((1, 1, 3), -0.1))
    with pytest.raises(ValueError, match=r"outside|exceed"):
        SpanValues.quantise(np.full((1, 1, 3), 1.1), np.zeros((1, 1, 3)))
