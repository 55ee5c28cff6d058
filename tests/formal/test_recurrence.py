"""Proof that x and D of the recurrence never wrap, over whole spans of any step."""

from itertools import product

import numpy as np
import pytest

from golden.fixed import SQ, Format
from golden.recurrence import Recurrence

from .bounds import unknown

pytestmark = pytest.mark.prove

LENGTH = (1 << Recurrence.LENGTH_BITS) - 1
OFF = 0.01
"""Part by which K, and D(0) beside ``sin d``, may be off; those of the setup are by under 0.001."""


def squared_norm(x, difference, c):
    """``N^2 = D^2 + c x D + c x^2``, which is ``(D + c x/2)^2 + (c - c^2/4) x^2``, of 0 < c < 4."""
    return difference * difference + c * x * difference + c * x * x


def of_one_step(unit, monkeypatch, shift):
    """A step of the twin, for every K, is ``x' = x + D'``, ``D' = D - c x + e``: c, and a bound of |e|.

    The register holds x with half a step of the operand.
    """
    monkeypatch.setattr(Format, "wrap", lambda _, codes: codes)
    factor = np.arange(unit.coefficient_format.max_code + 1)
    one = 1 << unit.state_format.fraction_bits
    register, before = (unknown(-2 * one, 2 * one)[:, 0] for _ in range(2))
    total, difference = unit._reinsch(register, before, factor, shift, False)
    (x,), (d,) = register.parts, before.parts
    assert set(total.parts) == set(difference.parts) == {x, d}
    c = -difference.parts[x]
    np.testing.assert_array_equal(c, factor * 2.0 ** (1 - unit.fraction_bits - shift))
    np.testing.assert_array_equal(total.parts[x], 1 - c)
    np.testing.assert_array_equal(total.rest, difference.rest)
    for sums in (total, difference):
        np.testing.assert_array_equal(sums.parts[d], 1)
    e = np.abs(np.array(difference.rest) - c * unit._half_operand).max(axis=0) / one
    # But for roundings of float64, half a step of the operand, and a cut.
    assert (e <= (c * 2.0 ** -(unit.fraction_bits + 1) + 1 / one) * (1 + 2.0**-40)).all()
    return c, e


def largest_words(unit, c, e):
    """Bounds of |x| and |D| at every pixel of every span, for steps to 90 degrees.

    Without e a step leaves N as it is, so with it N grows by ``N(0, e) = |e|`` at most, as N is a norm.
    That bounds ``x <= N / sqrt(c - c^2/4)`` and ``D <= N / sqrt(1 - c/4)``. For the smallest c, where a step
    of the word is more than what bends, sums of absolute values do better.
    """
    word = unit.state_format.step
    # With d the span's step, and the held c off by OFF.
    bend = np.minimum(c / (1 - OFF), 2)
    sine, own = (np.sqrt(x * (1 - x / 4)) for x in (bend, c))
    first, second = 1 + word, np.sqrt(bend) + OFF * sine + word
    norm = np.maximum(sine, own) + OFF * (bend / 2 + sine) + (1 + np.sqrt(c)) * word + LENGTH * e
    with np.errstate(divide="ignore"):
        x, difference = norm / own, norm / np.sqrt(1 - c / 4)
    # As long as |x| is under 2.
    steepest = second + LENGTH * (2 * c + e)
    farthest = first + LENGTH * steepest
    small = farthest < np.minimum(x, 2)
    return np.where(small, farthest, x), np.where(small, steepest, difference)


def of_spans(unit, monkeypatch, format=None):
    """x, with half a step of the operand, and D fit the format."""
    format = format or unit.state_format
    for shift in range(1 << unit.SHIFT_BITS):
        c, e = of_one_step(unit, monkeypatch, shift)
        # Steps to 90 degrees, c = 2.
        served = c <= 2 * (1 + OFF)
        x, difference = largest_words(unit, c[served], e[served])
        most = -format.min_code * format.step
        assert x.max() + 2.0 ** -(unit.fraction_bits + 1) < most, f"x to {x.max()} wraps in {format}"
        assert difference.max() < most, f"D to {difference.max()} wraps in {format}"


def test_a_step_leaves_the_norm():
    """The polynomials are of degree 2 in each of x, D and c: equal on 3 x 3 x 3 points, they are the same."""
    for x, difference, c in product(range(3), repeat=3):
        after = x + difference
        assert squared_norm(after, difference - c * after, c) == squared_norm(x, difference, c)


@pytest.mark.parametrize("guard_bits", [20, 28])
def test_x_and_d_never_wrap(monkeypatch, guard_bits):
    """Every word of K and every shift, steps to 90 degrees, to 4095 pixels; K and D(0) may be off by 1 %."""
    of_spans(Recurrence(guard_bits=guard_bits), monkeypatch)


def test_words_a_bit_too_short_are_found(monkeypatch):
    """An integer bit less."""
    with pytest.raises(AssertionError, match=" wraps in "):
        of_spans(Recurrence(), monkeypatch, SQ(1, 44))


def test_words_that_drift_are_found(monkeypatch):
    """What the shortest words cut of each step adds up, so that long spans of small steps do wrap."""
    unit = Recurrence(fraction_bits=8, guard_bits=10)
    with pytest.raises(AssertionError, match=r"x to .* wraps in "):
        of_spans(unit, monkeypatch)
    monkeypatch.undo()
    first, second = unit.start(np.array([-0.9]), np.array([0.0]), np.array([1e-4]))
    x = unit.states(first, second, *unit.coefficient(np.array([1e-4])), LENGTH).values
    assert np.abs(np.diff(x, axis=0)).max() > 2


BUGS = {
    "no half step": ("x >> self.guard_bits", "(x - self._half_operand) >> self.guard_bits"),
    "bends outwards": ("difference - (product", "difference + (product"),
    "cuts before it shifts": ("product >> shift >> cut", "product >> 20 << 20 >> shift >> cut"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(plant, monkeypatch, bug):
    """Planted in the twin, each breaks what is said of a step."""
    plant(Recurrence, "_reinsch", *BUGS[bug])
    with pytest.raises(AssertionError):
        of_one_step(Recurrence(), monkeypatch, 3)
