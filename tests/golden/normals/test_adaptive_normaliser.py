"""Adaptive normaliser: the bit-accurate model against float64."""

import re

import numpy as np
import pytest

from blysk.bench.units.normals.adaptive_normaliser import straight_lines
from blysk.bench.units.operands import code_pairs_at, component_words, pairs_of_length, word_ends
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.curves import interpolate

VARIANTS = [
    AdaptiveNormaliser(t, b) for t in (1 / 8, 2.0**-10, 2.0**-14) for b in (Bisection(), Bisection(1, 45))
]
LENGTHS = np.array([1, 2, 3, 4, 5, 9, 16, 17, 33, 64, 100, 129, 257, 1000, 4095])
SCALE = ONE * COMPONENT.step


def run(parameters, seed, angles, lengths):
    left, right = code_pairs_at(np.random.default_rng(seed), len(lengths), angles)
    result = parameters.compute(*component_words(left, right), lengths)
    return left, right, *pixels_of(lengths), *result


def errors(left, right, span, pixel, normal, levels, lengths):
    """Largest distance of a component from the straight line of its segment, for every pixel."""
    t = pixel / np.maximum(lengths - 1, 1)[span]
    exact = straight_lines(left[span] / ONE, right[span] / ONE, levels[span], t) * SCALE
    return np.abs(normal.values - exact).max(axis=1)


def assert_ends(normal, left, right, lengths):
    """Check that first and last pixels have the spans' own normals."""
    last = np.cumsum(lengths) - 1
    np.testing.assert_array_equal(normal.codes[last - lengths + 1], left)
    np.testing.assert_array_equal(normal.codes[last][lengths > 1], right[lengths > 1])


@pytest.mark.parametrize(
    ("parameters", "low", "high"),
    [(p, 0.01, 44.99) for p in VARIANTS] + [(p, 45.01, 90) for p in VARIANTS[::2]],
    ids=str,
)
def test_error_under_its_bound(parameters, low, high):
    # A span that the unit does not divide still has arithmetic errors.
    lengths = np.tile(LENGTHS, 8)
    angles = np.random.default_rng(1).uniform(low, high, len(lengths))
    left, right, span, pixel, normal, out_of_range, levels = run(parameters, 2, angles, lengths)
    assert not out_of_range.any()
    error = errors(left, right, span, pixel, normal, levels, lengths)
    bounds = np.array([parameters.error(k, low > 1) for k in range(parameters.depth + 1)])
    assert np.all(error <= bounds[levels][span])
    # For every number of levels, the bound is that of the widest span that needs this number.
    assert (error / bounds[levels][span]).max() >= 0.3


@pytest.mark.parametrize("parameters", VARIANTS, ids=str)
def test_length_and_direction_keep_their_word(parameters):
    lengths = np.full(100, 1000)
    angles = np.random.default_rng(3).uniform(0, parameters.bisection.max_angle - 0.01, 100)
    left, right, span, pixel, normal, out_of_range, levels = run(parameters, 4, angles, lengths)
    assert not out_of_range.any()
    vectors = normal.values / SCALE
    length = np.linalg.norm(vectors, axis=1)
    # Three components are off by the arithmetic error, and the code vectors at the ends by their own
    # rounding.
    rounding = np.sqrt(3) * parameters.error(parameters.depth, bool(angles.max() > 45)) + 2.0**-17
    assert length.min() >= 1 - parameters.threshold - 2.0**-19 - rounding
    assert length.max() <= 1 + rounding
    exact = interpolate("slerp", left[span] / ONE, right[span] / ONE, pixel / 999)
    theta = np.radians(angles)[span] / 2.0 ** levels[span]
    assert np.all(theta**2 <= 8.1 * parameters.threshold + 2.0**-15)
    turned = np.linalg.norm(np.cross(vectors, exact), axis=1)
    assert np.all(turned <= 0.017 * theta**3 + 1.1 * rounding)


@pytest.mark.parametrize("threshold", [1 / 8, 2.0**-6, 2.0**-10, 2.0**-14])
def test_levels_are_the_fewest(threshold):
    parameters = AdaptiveNormaliser(threshold)
    angles = np.random.default_rng(5).uniform(0, 89.99, 40_000)
    words = component_words(*code_pairs_at(np.random.default_rng(6), 40_000, angles))
    _, u, out_of_range = parameters.bisection.compute(*words)
    levels = parameters.levels(u, out_of_range)

    def sagitta(k):
        return 1 - np.cos(np.radians(angles) / 2.0 ** (k + 1))

    # The word of u is rounded by 2^-18, and a quarter of this counts in the sagitta. The rounding of two unit
    # vectors to codes adds up to 2^-16 in the same way.
    slack = (2.0**-18 + 2.0**-16) / 4 / 4.0**levels
    assert np.all(sagitta(levels) <= threshold + slack)
    divided = levels > 0
    fewer = np.maximum(levels - 1, 0)
    assert np.all(sagitta(fewer)[divided] * 1.068 + 4 * slack[divided] + 2.0**-20 >= threshold)
    assert (levels.min(), levels.max()) == (0, parameters.depth)


@pytest.mark.parametrize("threshold", [2.0**-10, 2.0**-14])
@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90])
def test_stiff_ends_are_exact(threshold, angle):
    parameters = AdaptiveNormaliser(threshold)
    lengths = np.r_[np.arange(1, 70), 127, 128, 129, 255, 256, 257, 1023, 1024, 1025, 4095]
    left, right, _, _, normal, out_of_range, _ = run(parameters, 7, angle, lengths)
    assert not out_of_range.any()
    assert_ends(normal, left, right, lengths)


def test_stiff_equal_normals_stay():
    axes = np.vstack([np.eye(3), -np.eye(3)]).astype(np.int64) * ONE
    lengths = np.array([1, 2, 3, 16, 4095, 100])
    normal, out_of_range, levels = AdaptiveNormaliser().compute(*component_words(axes, axes), lengths)
    assert not out_of_range.any()
    assert not levels.any()
    np.testing.assert_array_equal(normal.codes, np.repeat(axes, lengths, axis=0))


@pytest.mark.parametrize(
    ("degrees", "miss", "length"), [(1, 0.00015, 1.0003), (10, 0.15, 1.03), (45, 8.2, 1.47)]
)
def test_cost_of_the_published_extrapolation(degrees, miss, length):
    """The published form takes the end on the chord's continuation at the next power of two.

    Here it is then normalised without an error.
    """
    psi = np.radians(degrees)
    steps = np.arange(1, 4095)
    g = 2.0 ** np.ceil(np.log2(steps)) / steps
    end = np.stack([1 - g + g * np.cos(psi), g * np.sin(psi)])
    assert np.linalg.norm(end, axis=0).max() - 1 == pytest.approx(length - 1, rel=0.02)
    # The last pixel lies at 1/g of the way to the new end.
    last = np.degrees(np.arctan2(end[1], end[0])) / g
    assert (degrees - last).max() == pytest.approx(miss, rel=0.03)
    assert np.degrees(np.arctan2(2.0, 1 - 2.0)) == pytest.approx(116.6, abs=0.1)
    # Our unit gives the right end to the bit.
    ends = quantise(np.array([[1.0, 0, 0], [np.cos(psi), np.sin(psi), 0]]))
    length = np.r_[2:100, 513:516, 4095]
    left, right = (np.tile(end, (len(length), 1)) for end in ends)
    normal, _, _ = AdaptiveNormaliser().compute(*component_words(left, right), length)
    assert_ends(normal, left, right, length)


@pytest.mark.parametrize("angle", [90.01, 120, 180])
def test_stiff_spans_out_of_range_are_flagged(angle):
    lengths = np.full(200, 33)
    left, right, _, _, normal, out_of_range, levels = run(AdaptiveNormaliser(), 8, angle, lengths)
    assert out_of_range.all()
    assert not levels.any()
    assert_ends(normal, left, right, lengths)


@pytest.mark.parametrize("threshold", [1 / 8, 2.0**-10, 2.0**-14])
@pytest.mark.parametrize("angle", [1, 44.9, 89.9])
def test_stiff_drift_over_4095_pixels(threshold, angle):
    """A step is cut by less than 2^-32, so a segment of n pixels is too low by less than n 2^-32 at its
    end."""
    parameters, lengths = AdaptiveNormaliser(threshold), np.full(6, 4095)
    left, right, span, pixel, normal, _, levels = run(parameters, 9, angle, lengths)
    error = errors(left, right, span, pixel, normal, levels, lengths).max()
    assert error <= parameters.error(int(levels.max()), angle > 45)
    # A single segment has the longest drift. It keeps within a step of the word and the rounding of its
    # factors.
    if not levels.any():
        assert error <= 2.0**-18 + 2 * np.sin(np.radians(angle) / 2) * 2.0**-16 + 4095 * 2.0**-32


@pytest.mark.parametrize("length", [3, 5, 16, 17, 4095])
@pytest.mark.parametrize("angle", [1, 45, 89])
def test_stiff_peaks(length, angle):
    """With H on a pixel or between two, N.H loses only the sagitta and the rounding."""
    parameters, half = AdaptiveNormaliser(), np.radians(angle) / 2
    ends = quantise(np.array([[[np.cos(half), sign * np.sin(half), 0]] for sign in (-1, 1)]))
    normal, _, levels = parameters.compute(*component_words(*ends), np.array([length]))
    bound = parameters.threshold + 2.0**-19 + 2 * parameters.error(int(levels[0]), angle > 45) + 2.0**-16
    for pixel in ((length - 1) / 2, (length - 1) // 2 + 0.5, 1):
        turn = (2 * pixel / (length - 1) - 1) * half
        found = normal.values @ np.array([np.cos(turn), np.sin(turn), 0])
        ideal = np.cos((2 * np.arange(length) / (length - 1) - 1) * half - turn)
        theta = 2 * half / 2.0 ** levels[0]
        assert np.abs(found - ideal).max() <= bound + 0.017 * theta**3


def test_stiff_normals_of_no_unit_length():
    """Words of any size come out unchanged at both ends, unless they are flagged.

    Nothing fails between the ends.
    """
    rng = np.random.default_rng(10)
    parameters, lengths = AdaptiveNormaliser(), np.resize([2, 3, 16, 100], 300)
    short = pairs_of_length(rng, 300, 5.0, 1 - 1 / 256)
    for ends in (np.zeros((2, 300, 3), np.int64), word_ends(rng, 2, 300, 3), short):
        normal, out_of_range, _ = parameters.compute(*component_words(*ends), lengths)
        assert_ends(normal, *ends, lengths)
    # Every normal between short normals is as short as they are, and shorter by its sagitta.
    assert not out_of_range.any()
    size = np.linalg.norm(normal.values, axis=1)
    assert 1 - 3 / 256 < size.min() < 1 - 1 / 256


@pytest.mark.long
def test_every_length():
    parameters = AdaptiveNormaliser(2.0**-12)
    for low in range(1, 4096, 128):
        lengths = np.arange(low, min(low + 128, 4096))
        angles = np.random.default_rng(low).uniform(0, 90, len(lengths))
        left, right, span, pixel, normal, _, levels = run(parameters, low, angles, lengths)
        assert_ends(normal, left, right, lengths)
        error = errors(left, right, span, pixel, normal, levels, lengths)
        assert error.max() <= parameters.error(parameters.depth, True)


def test_refuses():
    for threshold in (0.0, 2.0**-15, 0.2, float("nan")):
        text = f"threshold must be 2^-14 to 1/8, not {threshold!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(text)}$"):
            AdaptiveNormaliser(threshold)
    normal = Fixed(COMPONENT, np.array([[0, 0, ONE]]))
    for length in (-1, 4096):
        with pytest.raises(ValueError, match=r"^lengths must be 0 to 4095$"):
            AdaptiveNormaliser().compute(normal, normal, np.array([length]))
