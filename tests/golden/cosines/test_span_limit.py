"""Span limit: angles and levels against their definitions in float64; no span is missed."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import SpanValues, largest_span_angle
from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.unit_vector import ONE_SQUARED, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.sim.units.operands import component_words, pairs_at

LIMIT = SpanLimit()
EXPONENTS = np.arange(1, 1001)
ONE_VALUE = float(ONE_SQUARED.values)


def flagged(degrees, u, f=0.5, exponent=100, length=4, **options):
    """Of spans of an angle, with values of one light: three of u, the largest of f."""
    left, right = pairs_at(np.random.default_rng(1), np.size(degrees), degrees)
    count = len(left)
    values = SpanValues.quantise(
        np.broadcast_to(np.reshape(f, (-1, 1, 1)), (count, 1, 3)), np.broadcast_to(u, (count, 1, 3))
    )
    ends = component_words(quantise(left), quantise(right))
    n = np.broadcast_to(exponent, count)
    return LIMIT.compute(*ends, values, np.broadcast_to(length, count), n, **options)


def test_octaves_are_safe():
    """The limit of an octave is at most that of each exponent; the level at least; both by octaves alone."""
    angles, levels = ([f(n) for n in EXPONENTS] for f in (LIMIT.angle, LIMIT.lit))
    exact = np.array([largest_span_angle(n) for n in EXPONENTS])
    assert (angles <= exact).all()
    assert (angles >= exact * 2 ** (-1 / 6) - 1e-12).all()
    assert len(np.unique(angles)) == len({int(n).bit_length() for n in EXPONENTS if angles[n - 1] < 15}) + 1
    for n, level in zip(EXPONENTS, levels, strict=True):
        assert level >= min(2, 7 / max(n - 1, 1e-9))
        # `ChordInterpolator.is_lit` is the same rule for an exponent.
        assert level == 2 or not ChordInterpolator.is_lit(n, level)


@pytest.mark.parametrize("model", ["blinn", "cosquad", "cosquad7", "cosquad_lin", "lyon2", "lyon3", "exp"])
def test_from_the_level_on_there_is_no_highlight(model):
    """A quarter of an LSB, in float64, of every model that decreases as fast as Blinn's power."""
    served = REFLECTION_MODELS[model]
    for n in (5, 8, 15, 16, 100, 127, 128, 1000):
        u = np.linspace(LIMIT.lit(n), 2, 20_001)
        assert 255 * served.reflect(1 - u, n).max() <= 0.25


@pytest.mark.parametrize("exponent", [1, 2, 3, 4, 63, 64, 511, 512, 1000])
def test_flag_of_the_angle(exponent):
    """A span cut at the limit and then quantised is not wide; one of 0.02 degrees more is."""
    for limit, u in ((LIMIT.angle(exponent), [0.0, 0.0, 0.0]), (LIMIT.WIDEST, [1.9999, 1.9999, 1.9999])):
        if LIMIT.lit(exponent) == 2 and u[0]:
            continue
        assert not flagged(np.full(5000, limit), u, exponent=exponent).any()
        assert flagged(np.full(5000, limit + 0.02), u, exponent=exponent).all()
    assert not flagged(np.full(50, limit + 5), u, exponent=exponent, length=3).any()


@pytest.mark.parametrize("exponent", [8, 100, 1000])
def test_flag_of_the_least_value(exponent):
    """Between the limits a span is wide where the quadratic's least u is under the level, in front."""
    rng, count = np.random.default_rng(exponent), 20_000
    level = LIMIT.lit(exponent)
    u = level * rng.uniform(0, 3, (count, 1, 3))
    u[::2] = level * (1 + 0.1 * rng.normal(size=u[::2].shape))
    u = np.clip(u, 0, 1.99)
    left, middle, right = np.moveaxis(u[:, 0], 1, 0)
    curvature = 2 * (left + right - 2 * middle)
    t = np.linspace(0, 1, 201)[:, np.newaxis]
    least = (left + t * (right - left - curvature + t * curvature)).min(axis=0)
    found = flagged(np.full(count, (LIMIT.angle(exponent) + LIMIT.WIDEST) / 2), u, exponent=exponent)
    assert found[least < level - 1e-6].all()
    # The bound is the ends' least, less a quarter of G.
    bound = np.minimum(left, right) - np.maximum(curvature, 0) / 4
    sure = np.abs(bound - level) > 1e-6
    # Codes are in units of ONE_SQUARED, the level is not: it is a little farther.
    sure &= np.abs(bound * ONE_VALUE - level) > 1e-6 + level * (1 - ONE_VALUE)
    np.testing.assert_array_equal(found[sure], (bound < level)[sure])
    assert 0.2 < found.mean() < 0.98
    behind = flagged(np.full(count, 20.0), u, f=-0.0626, exponent=exponent)
    assert not behind.any()
    nearly = flagged(np.full(count, 20.0), u, f=-0.0624, exponent=exponent)
    np.testing.assert_array_equal(nearly, flagged(np.full(count, 20.0), u, exponent=exponent))


def test_any_light_counts():
    """A span is wide if one of its lights makes it so, each by its own N·L."""
    left, right = pairs_at(np.random.default_rng(3), 4, 20.0)
    diffuse = np.full((4, 2, 3), 0.5)
    highlight = np.full((4, 2, 3), 1.9)
    highlight[1, 0], highlight[2, 1] = 0.0, 0.0
    highlight[3, 0], diffuse[3, 0] = 0.0, -0.5
    values = SpanValues.quantise(diffuse, highlight)
    ends = component_words(quantise(left), quantise(right))
    found = LIMIT.compute(*ends, values, np.full(4, 9), np.full(4, 100))
    assert found.tolist() == [False, True, True, False]
    assert not LIMIT.compute(*ends, values, np.full(4, 9), np.full(4, 100), False).any()


def test_without_highlights_only_the_widest_counts():
    zero = [0.0, 0.0, 0.0]
    assert not flagged(np.full(9, 29.9), zero, highlights=False).any()
    assert flagged(np.full(9, 30.1), zero, highlights=False).all()


@pytest.mark.parametrize("exponent", [0, 1001])
def test_refuses(exponent):
    with pytest.raises(ValueError, match=r"^exponents must be 1 to 1000$"):
        flagged(np.full(3, 1.0), [0.0, 0.0, 0.0], exponent=exponent)
    assert not LIMIT.compute(
        *component_words(*np.zeros((2, 0, 3), dtype=np.int64)),
        SpanValues(*np.zeros((2, 0, 1, 3), dtype=np.int64)),
        np.zeros(0, int),
        np.zeros(0, int),
    ).any()
