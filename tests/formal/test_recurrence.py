"""Proof that x and D of the recurrence never wrap, in whole spans of any step."""

from itertools import product

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ, Fixed, Format
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT, quantise

from .bounds import unknown

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

LENGTH = (1 << Recurrence.LENGTH_BITS) - 1
WIDEST_BEND = 2.02
"""Largest c, for steps of up to 90 degrees: 2, plus 1 %."""


def squared_norm(x, difference, c):
    """``N^2 = D^2 + c x D + c x^2``, which is ``(D + c x/2)^2 + (c - c^2/4) x^2``, for 0 < c < 4."""
    return difference * difference + c * x * difference + c * x * x


def most_at_start(c):
    """Largest N of start values: the N of an amplitude of 1, plus 1 %, plus 2^-30.

    ``x(k) = A cos(phase - k d)`` has ``N = A sin d``, and ``sin d = sqrt(c - c^2/4)``. A is the amplitude of
    unit vectors, but the lengths of codes are off. If the difference of two ends is hardly longer than these
    errors, it points along the ends and not across. So A is up to ``sqrt(1 + 2 e/sin d)``, and at most sqrt
    2. The rest is for roundings of the words, and for steps so small that the word of c is 0.
    """
    sine = np.sqrt(c - c * c / 4)
    with np.errstate(divide="ignore"):
        amplitude = np.sqrt(1 + np.minimum(2 * CODE_LENGTH_ERROR / sine, 1))
    return 1.01 * amplitude * sine + 2.0**-30


def of_one_step(unit, monkeypatch, shift):
    """A step of the model is ``x' = x + D'``, ``D' = D - c x + e``.

    The result is c for every K, and a bound of |e|.

    The register holds x plus half a step of the operand.
    """
    monkeypatch.setattr(Format, "wrap", lambda _, codes: codes)
    factor = np.arange(unit.coefficient_format.max_code + 1)
    one = 1 << unit.state_format.fraction_bits
    register, before = (unknown(-2 * one, 2 * one)[:, 0] for _ in range(2))
    total, difference = unit._reinsch(register, before, factor, shift, False)
    c = factor * 2.0 ** (1 - unit.fraction_bits - shift)
    (x,), (d,) = register.parts, before.parts
    assert set(total.parts) == set(difference.parts) == {x, d}
    np.testing.assert_array_equal(difference.parts[x], -c)
    np.testing.assert_array_equal(total.parts[x], 1 - c)
    np.testing.assert_array_equal(total.rest, difference.rest)
    for sums in (total, difference):
        np.testing.assert_array_equal(sums.parts[d], 1)
    e = np.abs(np.array(difference.rest) - c * unit._half_operand).max(axis=0) / one
    # e has the roundings of float64, half a step of the operand, and a cut.
    assert (e <= (c * 2.0 ** -(unit.fraction_bits + 1) + 1 / one) * (1 + 2.0**-40)).all()
    return c, e


def largest_words(c, e):
    """Bounds of |x| and |D| at every pixel of every span whose start values keep `most_at_start`.

    A step without e does not change N, and N is a norm. So a step with e adds at most ``N(0, e) = |e|``. This
    gives ``x <= N / sqrt(c - c^2/4)`` and ``D <= N / sqrt(1 - c/4)``. For the smallest c a step of the word
    is larger than c. Sums of absolute values then give smaller bounds.
    """
    flat = np.sqrt(1 - c / 4)
    start = most_at_start(c)
    with np.errstate(divide="ignore"):
        x = (start + LENGTH * e) / np.sqrt(c - c * c / 4)
    # This bound holds as long as |x| is under 2.
    steepest = start / flat + LENGTH * (2 * c + e)
    farthest = 1.01 + LENGTH * steepest
    small = farthest < np.minimum(x, 2)
    return np.where(small, farthest, x), np.where(small, steepest, (start + LENGTH * e) / flat)


def of_spans(unit, monkeypatch, format=None):
    """Check that D, and x plus half a step of the operand, fit the format."""
    format = format or unit.state_format
    for shift in range(1 << unit.SHIFT_BITS):
        c, e = of_one_step(unit, monkeypatch, shift)
        served = c <= WIDEST_BEND
        x, difference = largest_words(c[served], e[served])
        most = -format.min_code * format.step
        assert x.max() + 2.0 ** -(unit.fraction_bits + 1) < most, f"x to {x.max()} wraps in {format}"
        assert difference.max() < most, f"D to {difference.max()} wraps in {format}"


def is_invariant(change):
    """Whether a step without e keeps N. N has degree 2 in x, D and c, so 3 x 3 x 3 points are enough."""
    return all(
        squared_norm(x + d, d - change * c * (x + d), c) == squared_norm(x, d, c)
        for x, d, c in product(range(3), repeat=3)
    )


def test_a_step_leaves_the_norm():
    """A step with the opposite sign of c, or with another multiple of c, does not keep N."""
    assert [change for change in (-1, 0, 0.5, 1, 2) if is_invariant(change)] == [1]


@pytest.mark.parametrize("guard_bits", [20, 28])
def test_x_and_d_never_wrap(monkeypatch, guard_bits):
    """Check every word of K and every shift, for steps of up to 90 degrees and up to 4095 pixels.

    The recurrence has one phase, or four.
    """
    of_spans(Recurrence(guard_bits=guard_bits), monkeypatch)


def test_words_a_bit_too_short_are_found(monkeypatch):
    """With an integer bit fewer, words wrap."""
    with pytest.raises(AssertionError, match=" wraps in "):
        of_spans(Recurrence(), monkeypatch, SQ(1, 44))


def test_words_that_drift_are_found(monkeypatch):
    """With the shortest words the cuts of all steps add up, so long spans of small steps wrap."""
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
def test_bugs_are_found(inject, monkeypatch, bug):
    """Each bug, injected in the model, breaks a statement about a step."""
    inject(Recurrence, "_reinsch", *BUGS[bug])
    with pytest.raises(AssertionError):
        of_one_step(Recurrence(), monkeypatch, 3)


def share_at_start(unit, first, second, coefficient, shift):
    """Largest N and |x| of start values, divided by their bounds."""
    if unit.interleave > 1:
        coefficient, shift = coefficient[:, np.newaxis], shift[:, np.newaxis]
    c = coefficient.values * 2.0 ** (2 - shift)
    assert c.max() <= WIDEST_BEND
    norm = np.sqrt(squared_norm(first.values, second.values, c))
    return max((norm / most_at_start(c)).max(), np.abs(first.values).max() / 1.01)


@pytest.mark.parametrize("interleave", [1, 4])
def test_stated_start_values_keep_the_bound(interleave):
    """Start values of any amplitude up to ``1 - 2^-16`` and any phase keep the bounds, for steps of 0 to 90
    degrees."""
    rng, unit = np.random.default_rng(1), Recurrence(interleave=interleave)
    step = np.r_[0, np.pi / 2 * 10.0 ** rng.uniform(-13, 0, 100_000), np.pi / 2]
    if interleave > 1:
        # In longer steps no pixel reads the second values.
        step /= interleave
    amplitude = (1 - 2.0**-16) * rng.choice([-1, 1, 0.1], len(step))
    start = unit.start(amplitude, rng.uniform(0, 2 * np.pi, len(step)), step)
    assert 0.98 < share_at_start(unit, *start, *unit.coefficient(step)) <= 1


def test_start_values_of_the_setup_keep_the_bound():
    """Start values of unit vectors keep the bounds: up to 90 degrees apart, and one or two codes apart, where
    A may be sqrt 2."""
    rng = np.random.default_rng(2)
    setup = RecurrenceSetup()
    # Shorter spans read no second values, or no coefficient.
    lengths = np.r_[9, 10, 17, 100, 1000, 4095]
    shares = []
    for degrees in (*10.0 ** np.linspace(-4, 1, 11), 30, 60, 89.9):
        left, right = (quantise(normals) for normals in pairs_at(rng, 20_000, degrees))
        near = rng.random((len(left), 1)) < 0.5
        vector = np.where(near, left, quantise(pairs_at(rng, len(left), 0.0)[0]))
        *start, out_of_range = setup.compute(
            *(Fixed(COMPONENT, codes) for codes in (left, right, vector)), rng.choice(lengths, len(left))
        )
        assert not out_of_range.any()
        shares.append(share_at_start(setup.recurrence, *start))
    assert 0.98 < max(shares) <= 1
