"""Difference setup twin against the curve in float64: every length, every word of the table."""

import numpy as np
import pytest

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise

UNIT = DifferenceSetup()
LENGTHS = np.arange(1, 4096)


def compute(g, p, length):
    return UNIT.compute(Fixed(GPQ.G_FORMAT, g), Fixed(GPQ.P_FORMAT, p), length)


def coefficients(rng, count, share=1.0):
    """Codes of G and P, up to a share of their words."""
    return tuple(
        np.trunc(rng.uniform(-share, share, (count, 3)) * format.max_code).astype(np.int64)
        for format in (GPQ.G_FORMAT, GPQ.P_FORMAT)
    )


def test_stiff_every_length_to_its_last_pixel():
    """The curve's end, with the largest coefficients of both signs: errors are as derived in the docstring.

    The square's relative 2^-16 has a term of second order, 2^-34, that the docstring leaves out.
    """
    rng = np.random.default_rng(1)
    worst = 0
    for _ in range(8):
        g, p = coefficients(rng, len(LENGTHS))
        g[::2] = np.sign(g[::2]) * GPQ.G_FORMAT.max_code
        p[::2] = np.sign(p[::2]) * GPQ.P_FORMAT.max_code
        first, second = compute(g, p, LENGTHS)
        last = LENGTHS - 1
        for pixel in (last, (last + 1) // 2, rng.integers(0, LENGTHS)):
            k = pixel[:, np.newaxis]
            dt = 1 / np.maximum(last, 1)[:, np.newaxis]
            g_value, p_value = g * 2.0**-17, p * 2.0**-17
            exact = p_value * k * dt + g_value * (k * dt) ** 2
            ours = k * first.values + k * (k - 1) / 2 * second.values
            t = k * dt
            bound = 2.0**-17 * np.abs(p_value) * t
            bound += (2.0**-16 + 2.0**-17 + 2.0**-34) * np.abs(g_value) * t**2
            bound += 2.0**-42 * (k + k**2 / 2)
            error = np.abs(ours - exact)
            # Float64 itself, of numbers under 2.
            assert (error <= bound + 2.0**-50).all()
            worst = max(worst, (error / np.maximum(bound, 2.0**-42)).max())
    assert worst > 0.5


@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_lengths(length):
    """Powers of two (dt = 1 and 1/2 here) have exact differences; others the bound above."""
    rng = np.random.default_rng(length)
    g, p = coefficients(rng, 1000)
    first, second = compute(g, p, np.full(1000, length))
    dt = 1 / max(length - 1, 1)
    exact_first, exact_second = (p + g * dt) * dt * 2.0**-17, 2 * g * dt**2 * 2.0**-17
    if length in (1, 2, 3):
        np.testing.assert_array_equal(first.values, exact_first)
        np.testing.assert_array_equal(second.values, exact_second)
    else:
        assert not np.array_equal(first.values, exact_first)
        relative = 2.0**-16 + 2.0**-17 + 2.0**-34
        assert (np.abs(second.values - exact_second) <= np.abs(exact_second) * relative + 2.0**-42).all()
        bound = np.abs(p * dt) * 2.0**-34 + np.abs(g * dt**2) * 2.0**-17 * relative + 2.0**-42
        assert (np.abs(first.values - exact_first) <= bound).all()


def test_powers_of_two_are_exact():
    rng = np.random.default_rng(2)
    steps = 2 ** np.arange(12)
    for step in steps:
        g, p = coefficients(rng, 500)
        first, second = compute(g, p, np.full(500, step + 1))
        # Products have 17 fraction bits; 42 hold them to steps of 2^12 where the square's shift is up to 24.
        g_term = np.floor(g * 2.0**25 / step**2 + 0.5)
        np.testing.assert_array_equal(second.codes, 2 * g_term)
        np.testing.assert_array_equal(first.codes, g_term + np.floor(p * 2.0**25 / step + 0.5))


def test_stiff_words_hold_every_outcome():
    """W_0 to 1.5 and 2 G dt^2 to 1 at the ends of the words, where dt is 1: no wrap."""
    g = np.array([GPQ.G_FORMAT.min_code, GPQ.G_FORMAT.max_code])[:, np.newaxis] * np.ones(3, int)
    p = np.array([GPQ.P_FORMAT.min_code, GPQ.P_FORMAT.max_code])[:, np.newaxis] * np.ones(3, int)
    for length in (1, 2):
        first, second = compute(g, p, np.full(2, length))
        np.testing.assert_array_equal(first.values, (g + p) * 2.0**-17)
        np.testing.assert_array_equal(second.values, 2 * g * 2.0**-17)
    assert first.values.min() == -1.5
    assert second.values.min() == -1


@pytest.mark.parametrize("angle", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
@pytest.mark.parametrize("length", [1, 2, 3, 16, 4095])
def test_stiff_angles(angle, length, normal_pairs):
    """Of real spans: the end of the curve within its bound; wider spans saturate before, so it holds there.

    With equal ends both differences are 0 to the bit, for every length.
    """
    left, right = (Fixed(COMPONENT, quantise(n)) for n in normal_pairs(np.random.default_rng(6), 2000, angle))
    g, p, _ = GPQ().compute(left, MiddleNormal().compute(left, right)[0], right)
    first, second = UNIT.compute(g, p, np.full(2000, length))
    steps = max(length - 1, 1)
    found = steps * first.values + steps * (steps - 1) / 2 * second.values
    bound = 2.0**-17 * np.abs(p.values) + (2.0**-16 + 2.0**-17 + 2.0**-34) * np.abs(g.values)
    bound += 2.0**-42 * (steps + steps**2 / 2) + 2.0**-50
    assert (np.abs(found - (g.values + p.values)) <= bound).all()
    if angle == 0:
        assert not first.codes.any()
        assert not second.codes.any()


def test_zero_coefficients_stay_zero():
    zero = np.zeros((len(LENGTHS), 3), dtype=int)
    for difference in compute(zero, zero, LENGTHS):
        assert not difference.codes.any()


def test_other_operands_are_refused():
    g, p = Fixed(GPQ.G_FORMAT, np.zeros((1, 3), int)), Fixed(GPQ.P_FORMAT, np.zeros((1, 3), int))
    with pytest.raises(ValueError, match=r"^operands must be SQ\(0, 17\) and SQ\(1, 17\), not "):
        UNIT.compute(p, p, [5])
    with pytest.raises(ValueError, match=r"^operands must be "):
        UNIT.compute(g, Fixed(SQ(2, 16), np.zeros((1, 3), int)), [5])
    for length in (0, 4096, -1):
        with pytest.raises(ValueError, match=r"^lengths must be 1 to 4095$"):
            UNIT.compute(g, p, [length])


def test_documented_order():
    """``(G dt + P) dt`` and ``2 (G dt) dt``: the end of the curve within the bound of the docstring.

    For coefficients up to half of their words, where ``G dt + P`` does not saturate; every length.
    """
    unit = DifferenceSetup(as_published=True)
    rng = np.random.default_rng(7)
    worst = 0
    for share in (0.5, 0.5, 0.5, 0.01):
        g, p = coefficients(rng, len(LENGTHS), share)
        first, second = unit.compute(Fixed(GPQ.G_FORMAT, g), Fixed(GPQ.P_FORMAT, p), LENGTHS)
        k = np.maximum(LENGTHS - 1, 1)[:, np.newaxis]
        g_value, p_value = g * 2.0**-17, p * 2.0**-17
        found = k * first.values + k * (k - 1) / 2 * second.values
        bound = 2.0**-17 * np.abs(p_value) + (2.0**-16 + 2.0**-34) * np.abs(g_value)
        bound += 2 * 2.0**-18 * (1 + 2.0**-17) + 2.0**-42 * (k + k**2 / 2)
        error = np.abs(found - (g_value + p_value))
        assert (error <= bound + 2.0**-50).all()
        worst = max(worst, (error / bound).max())
    assert worst > 0.5


def test_documented_order_saturates():
    """Slopes past the end of ``SQ(1, 17)``, at the ends of the words: clipped, never wrapped."""
    unit = DifferenceSetup(as_published=True)
    ends = [
        (a, b) for a in (GPQ.G_FORMAT.min_code, 0, GPQ.G_FORMAT.max_code) for b in (-(2**17), 0, 2**17 - 1)
    ]
    g, p = (np.array(column)[:, np.newaxis] * np.ones(3, int) for column in zip(*ends, strict=True))
    for length in (1, 2, 3, 16, 4095):
        first, second = unit.compute(
            Fixed(GPQ.G_FORMAT, g), Fixed(GPQ.P_FORMAT, p), np.full(len(ends), length)
        )
        dt = 1 / max(length - 1, 1)
        slope = np.clip((g * dt + p) * 2.0**-17, -1, 1 - 2.0**-17)
        # dt and its rounded products: relative 2^-17 each, and half a step of the slope.
        assert (np.abs(first.values - slope * dt) <= dt * (2.0**-16 + 2.0**-18) + 2.0**-42).all()
        assert (
            np.abs(second.values - 2 * g * 2.0**-17 * dt**2) <= dt**2 * (2.0**-15 + 2.0**-17) + 2.0**-41
        ).all()
