"""Difference setup against the curve in float64: every length, every word of the table."""

import numpy as np
import pytest

from blysk.bench.units.operands import code_pairs_at, component_words, curves_of
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import SQ, Fixed

UNIT, PUBLISHED = DifferenceSetup(), DifferenceSetup(as_published=True)
LENGTHS = np.arange(1, 4096)
STEP = 2.0**-17
SQUARE = 2.0**-16 + 2.0**-17 + 2.0**-34
"""Relative error of dt^2, and of a product with dt^2."""


def compute(g, p, length, unit=UNIT):
    return unit.compute(Fixed(GPQ.G_FORMAT, g), Fixed(GPQ.P_FORMAT, p), length)


def coefficients(rng, count, share=1.0):
    """Codes of G and P, up to a share of the range of their words."""
    return tuple(
        np.trunc(rng.uniform(-share, share, (count, 3)) * format.max_code).astype(np.int64)
        for format in (GPQ.G_FORMAT, GPQ.P_FORMAT)
    )


def walk(first, second, k):
    """Sum of the differences up to pixel k."""
    return k * first.values + k * (k - 1) / 2 * second.values


def test_stiff_every_length_to_its_last_pixel():
    """At the end of the curve, the largest coefficients of both signs have the errors that the docstring
    states."""
    rng, worst, last = np.random.default_rng(1), 0, LENGTHS - 1
    for _ in range(4):
        g, p = coefficients(rng, len(LENGTHS))
        g[::2] = np.sign(g[::2]) * GPQ.G_FORMAT.max_code
        p[::2] = np.sign(p[::2]) * GPQ.P_FORMAT.max_code
        first, second = compute(g, p, LENGTHS)
        for pixel in (last, (last + 1) // 2, rng.integers(0, LENGTHS)):
            k = pixel[:, np.newaxis]
            t = k / np.maximum(last, 1)[:, np.newaxis]
            bound = STEP * np.abs(p * STEP) * t + SQUARE * np.abs(g * STEP) * t**2
            bound += 2.0**-42 * (k + k**2 / 2)
            error = np.abs(walk(first, second, k) - (p * t + g * t**2) * STEP)
            # The rounding of float64 itself, for numbers under 2.
            assert (error <= bound + 2.0**-50).all()
            worst = max(worst, (error / np.maximum(bound, 2.0**-42)).max())
    assert worst > 0.5


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_lengths(length):
    """Lengths for which dt is a power of two (here 1 and 1/2) have exact differences.

    Other lengths keep the bound above.
    """
    g, p = coefficients(np.random.default_rng(length), 1000)
    first, second = compute(g, p, np.full(1000, length))
    dt = 1 / max(length - 1, 1)
    exact_first, exact_second = (p + g * dt) * dt * STEP, 2 * g * dt**2 * STEP
    if length in (1, 2, 3):
        np.testing.assert_array_equal(first.values, exact_first)
        np.testing.assert_array_equal(second.values, exact_second)
    else:
        assert not np.array_equal(first.values, exact_first)
        assert (np.abs(second.values - exact_second) <= np.abs(exact_second) * SQUARE + 2.0**-42).all()
        bound = np.abs(p * dt) * 2.0**-34 + np.abs(g * dt**2) * STEP * SQUARE + 2.0**-42
        assert (np.abs(first.values - exact_first) <= bound).all()


@pytest.mark.parametrize("step", 2 ** np.arange(12))
def test_powers_of_two_are_exact(step):
    g, p = coefficients(np.random.default_rng(2), 500)
    first, second = compute(g, p, np.full(500, step + 1))
    # Products have 17 fraction bits. If the square's shift is up to 24, 42 bits hold the products in steps of
    # 2^12.
    g_term = np.floor(g * 2.0**25 / step**2 + 0.5)
    np.testing.assert_array_equal(second.codes, 2 * g_term)
    np.testing.assert_array_equal(first.codes, g_term + np.floor(p * 2.0**25 / step + 0.5))


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_angles(angle, length):
    """In real spans the end of the curve is within its bound.

    Wider spans saturate earlier, so the bound holds there, too.

    With equal ends both differences are exactly 0 for every length.
    """
    ends = component_words(*code_pairs_at(np.random.default_rng(6), 2000, angle))
    g, p, _ = curves_of(*ends)
    first, second = UNIT.compute(g, p, np.full(2000, length))
    steps = max(length - 1, 1)
    bound = STEP * np.abs(p.values) + SQUARE * np.abs(g.values)
    bound += 2.0**-42 * (steps + steps**2 / 2) + 2.0**-50
    assert (np.abs(walk(first, second, steps) - (g.values + p.values)) <= bound).all()
    assert angle > 0 or not (first.codes.any() or second.codes.any())


def test_zero_coefficients_stay_zero():
    zero = np.zeros((len(LENGTHS), 3), dtype=int)
    for difference in compute(zero, zero, LENGTHS):
        assert not difference.codes.any()


def test_published_order():
    """With ``(G dt + P) dt`` and ``2 (G dt) dt`` the end of the curve is within its bound.

    Coefficients are up to half of their words, so that ``G dt + P`` does not saturate. Every length is tried.
    """
    rng, worst = np.random.default_rng(7), 0
    k = np.maximum(LENGTHS - 1, 1)[:, np.newaxis]
    for share in (0.5, 0.5, 0.5, 0.01):
        g, p = coefficients(rng, len(LENGTHS), share)
        bound = STEP * np.abs(p * STEP) + (2.0**-16 + 2.0**-34) * np.abs(g * STEP)
        bound += 2 * 2.0**-18 * (1 + STEP) + 2.0**-42 * (k + k**2 / 2)
        error = np.abs(walk(*compute(g, p, LENGTHS, PUBLISHED), k) - (g + p) * STEP)
        assert (error <= bound + 2.0**-50).all()
        worst = max(worst, (error / bound).max())
    assert worst > 0.5


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_published_order_saturates(length):
    """Slopes past the end of ``SQ(1, 17)``, at the ends of the words, are clipped and never wrap."""
    ends = np.meshgrid([GPQ.G_FORMAT.min_code, 0, GPQ.G_FORMAT.max_code], [-(2**17), 0, 2**17 - 1])
    g, p = (np.repeat(column.reshape(-1, 1), 3, axis=1) for column in ends)
    first, second = compute(g, p, np.full(len(g), length), PUBLISHED)
    dt = 1 / max(length - 1, 1)
    slope = np.clip((g * dt + p) * STEP, -1, 1 - STEP)
    # dt and its rounded products have relative errors of 2^-17 each, and the slope half a step.
    assert (np.abs(first.values - slope * dt) <= dt * (2.0**-16 + 2.0**-18) + 2.0**-42).all()
    bound = dt**2 * (2.0**-15 + STEP) + 2.0**-41
    assert (np.abs(second.values - 2 * g * STEP * dt**2) <= bound).all()


def test_refuses():
    g, p, other = (Fixed(format, np.zeros((1, 3), int)) for format in (GPQ.G_FORMAT, GPQ.P_FORMAT, SQ(2, 16)))
    for words in ((p, p), (g, other)):
        with pytest.raises(ValueError, match=r"^operands must be SQ\(0, 17\) and SQ\(1, 17\), not "):
            UNIT.compute(*words, [5])
    for length in (0, 4096, -1):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            UNIT.compute(g, p, [length])
