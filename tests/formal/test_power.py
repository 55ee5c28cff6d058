"""Proofs of the exact power unit: how far its term may rise while the cosine falls, and where it is 0."""

import numpy as np
import pytest

import blysk.hdl.lighting.power
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import MAX_EXPONENT
from blysk.golden.number.fixed import UQ
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.lighting.power import PowerUnit
from blysk.sim.engines.simulate import simulate

from .test_specular import OPERANDS, of_argument, reads_one_word

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

EXPONENTS = range(1, MAX_EXPONENT + 1)

# Up to 4 million arguments give light. At lower exponents up to 33 million do, which would take minutes.
EXHAUSTED = sorted({*(2**k + step for k in range(7, 10) for step in (-1, 0, 1)), 100, 777, 999, 1000})

RISE = 5
"""Largest rise, in steps of the result. It is under 0.01 steps of an 8-bit channel at intensity 1."""


def last_lit(exponent):
    """``1 - cos gamma`` at which the power is a step of the result. Beyond it no term is over 0."""
    return -np.expm1(np.log(Power.RESULT_FORMAT.step) / exponent)


def shortfall(low, high, exponent):
    """Bound of the steps by which a term may be under the exact term, before the last cut; 1 - cos from low
    to high.

    An operation takes words p and q, whose factors are cut. It makes ``p + q - p q`` and up to ``c (p + q)``
    more, where c is a step of the factors. Both grow with p and q. So no word x or s is under its exact value
    x° or s°. Let x^ and s^ be the words with the whole ``c (p + q)`` in every operation; no word is over
    them. The distances

        ``x^ - x° <- (x^ - x°) (2 - x^ - x°) + 2 c x^``

        ``s^ - s° <- (s^ - s°) (1 - x°) + (x^ - x°) (1 - s^) + c (s^ + x^)``

    are sums of numbers that are not negative. So the larger end of each factor bounds them. Saturation only
    lowers words. If a saturated word is used, the term is 0.
    """
    cut = Power.FACTOR_FORMAT.step
    exact = most = np.array([low, high])
    far_x, s = np.zeros_like(low), None
    for bit in range(Power.EXPONENT_BITS):
        if exponent >> bit & 1 and s is None:
            s, far = most, far_x
        elif exponent >> bit & 1:
            far = far * (1 - exact[0]) + far_x * (1 - s[0]) + cut * (s[1] + most[1])
            s = np.minimum(s + most - s * most + cut * (s + most), 1)
        far_x = far_x * (2 - most[0] - exact[0]) + 2 * cut * most[1]
        exact = exact * (2 - exact)
        most = np.minimum(most * (2 - most) + 2 * cut * most, 1)
    return far / Power.RESULT_FORMAT.step


def of_shortfall(exponent):
    """The bound is under `RISE` steps where there is light.

    The rest is for float64, and for ``1 - 2^-34`` in place of 1.
    """
    edges = -np.expm1(np.linspace(0, np.log(Power.RESULT_FORMAT.step), 65) / exponent)
    low, high = edges[:-1], edges[1:]
    for _ in range(10):
        open = shortfall(low, high, exponent) > RISE - 1e-4
        if not open.any():
            return
        low, high = low[open], high[open]
        middle = (low + high) / 2
        low, high = np.r_[low, middle], np.r_[middle, high]
    raise AssertionError(f"terms may be {RISE} steps too small at exponent {exponent}")


def check(unit, exponent, codes):
    """Largest rise in steps, for arguments that never fall.

    The rise and each term keep the bounds of `RISE`.
    """
    run = simulate(
        unit,
        {"operand": codes, "dark": np.zeros(len(codes), dtype=np.uint8)},
        count=len(codes),
        constants={"exponent": exponent},
    )
    terms = run.beats.astype(np.int64)
    code = codes if unit.model.operand == "one_minus_cosine" else ONE_SQUARED.codes - codes
    x = np.clip(code * unit.model.operand_format.step, 0, 1 - 2.0**-52)
    under = np.exp(exponent * np.log1p(-x)) / Power.RESULT_FORMAT.step - terms
    rise = (terms - np.minimum.accumulate(terms)).max()
    assert rise <= RISE, "a term rises too far"
    assert under.min() >= 0, "a term is too large"
    assert under.max() < RISE + 1, "a term is too small"
    return rise


def every_argument(exponent):
    """All arguments up to the last that gives light, and some beyond."""
    end, last = int(last_lit(exponent) * 2.0**25) + 2, Power.ARGUMENT_FORMAT.max_code
    return np.r_[np.arange(end), np.linspace(end, last, 1000).astype(np.int64)]


def some_cosines(exponent):
    """Random arguments where there is light, arguments next to a change of a factor, and both ends of the
    word."""
    rng = np.random.default_rng(exponent)
    x = np.r_[rng.uniform(0, last_lit(exponent), 1000), rng.uniform(0, 2, 50)]
    codes = (x * 2.0**34).astype(np.int64)
    codes = np.sort(np.r_[codes, codes >> 17 << 17, (codes >> 17 << 17) - 1])
    format = Power().operand_format
    return np.r_[format.max_code, ONE_SQUARED.codes - codes, format.min_code]


def of_power(operand):
    format = Power.COMPLEMENT_FORMAT
    return of_argument(PowerUnit(Power(operand)), "x_0", format, format.max_code)


@pytest.mark.parametrize("operand", OPERANDS)
def test_term_follows_from_the_argument(prove, operand):
    """By induction, for every operand: a term depends only on the limited ``1 - cos gamma``.

    A dark beat has the largest argument, like a 1 - cos gamma of 1 and more.
    """
    reads_one_word(PowerUnit(Power(operand)), "x_0")
    prove(of_power(operand))


def test_term_rises_by_five_steps_at_most():
    """For every argument of 34 bits and every exponent, by bounds: a term rises by at most `RISE` steps.

    A term is never over the exact term, cut to 17 bits, and at most `RISE` steps under it. The exact term
    falls as the argument rises. So a term is at most `RISE` steps over any term of a smaller argument.

    A term rises at all because the sum of ``p + q - p q`` has 34 bits, and the product has 17 bits of each
    factor. Where a factor goes to its next code, the product grows by up to two of its steps, and the sum by
    2^-34.
    """
    for exponent in EXPONENTS:
        of_shortfall(exponent)
    assert RISE * Power.RESULT_FORMAT.step < 0.01 / 255
    assert (RISE + 1) * Power.RESULT_FORMAT.step <= Power.ERROR


def test_term_rises_by_three_steps_at_every_argument():
    """Exhaustion of 1 - cos gamma in the unit, for the exponents `EXHAUSTED`: terms rise by 2 or 3 steps."""
    unit = PowerUnit(Power("one_minus_cosine"))
    rises = [check(unit, exponent, every_argument(exponent)) for exponent in EXHAUSTED]
    assert set(rises) == {2, 3}


def test_term_of_a_cosine_keeps_the_bounds():
    """Some arguments of 34 bits in the unit, at every exponent."""
    unit = PowerUnit(Power("cosine"))
    for exponent in EXPONENTS:
        check(unit, exponent, some_cosines(exponent))


def of_darkness(operand):
    """Dark beats at the peak, and arguments of 1 and more. By `of_argument` a few of each are enough."""
    unit = PowerUnit(Power(operand))
    peak, end = 0, 1 << 25
    if operand == "cosine":
        peak, end = ONE_SQUARED.codes.item(), unit.model.operand_format.min_code
    beats = {"operand": np.array([peak, end, peak]), "dark": np.array([1, 0, 0], dtype=np.uint8)}
    for exponent in EXPONENTS:
        terms = simulate(unit, beats, count=3, constants={"exponent": exponent}).beats
        assert terms.tolist() == [0, 0, 2**17 - 1]


def of_cosines_to_0():
    """At n = 1 a cosine from 0 down to -2^-17 has a term of one step; for smaller cosines the term is 0."""
    codes = -np.arange(1 << 18)
    beats = {"operand": codes, "dark": np.zeros(len(codes), dtype=np.uint8)}
    run = simulate(PowerUnit(Power("cosine")), beats, count=len(codes), constants={"exponent": 1})
    np.testing.assert_array_equal(run.beats, codes > 1 - (1 << 17))


@pytest.mark.parametrize("operand", OPERANDS)
def test_term_is_0_in_the_dark(operand):
    """The term is 0 for every exponent and every beat that is dark or has an argument of 1 or more."""
    of_darkness(operand)


def test_term_is_0_where_the_cosine_is_not_over_0():
    """The exception is n = 1 next to 0, because ``1 - cos gamma`` is relative to unit vectors, 2^-16 less
    than 1.

    At every other exponent the exact term of this argument is under a step, and no term is over it.
    """
    of_cosines_to_0()
    assert (1 - ONE_SQUARED.values) ** 2 < Power.RESULT_FORMAT.step


BUGS_OF_ARGUMENT = {
    "1 is not that of unit vectors": ("one_minus", "ONE_SQUARED.values.item()", "1"),
    "it wraps": ("datapath", "complement.saturate", "complement.wrap"),
    "a dark beat is lit": ("datapath", "Mux(dark, ", "Mux(0, "),
}


@pytest.mark.parametrize("bug", BUGS_OF_ARGUMENT)
def test_bugs_of_the_argument_are_found(refute, inject, bug):
    """Each bug, injected in the unit, refutes a claim."""
    name, *change = BUGS_OF_ARGUMENT[bug]
    inject(blysk.hdl.lighting.power if name == "one_minus" else PowerUnit, name, *change)
    refute(of_power("cosine"), 4)


def test_bug_of_the_bounds_is_found(monkeypatch):
    """Factors with a bit less are found."""
    monkeypatch.setattr(Power, "FACTOR_FORMAT", UQ(0, 16))
    with pytest.raises(AssertionError, match=r"^terms may be 5 steps too small at exponent 513$"):
        of_shortfall(513)


@pytest.mark.parametrize("operand", OPERANDS)
def test_bug_of_the_dark_is_found(inject, operand):
    """A dark beat that gets the term of its cosine is found."""
    inject(PowerUnit, "datapath", "Mux(dark, ", "Mux(0, ")
    with pytest.raises(AssertionError):
        of_darkness(operand)


def test_bug_of_cosines_to_0_is_found(inject):
    """A 1 that is not that of unit vectors is found."""
    inject(blysk.hdl.lighting.power, "one_minus", "ONE_SQUARED.values.item()", "1")
    with pytest.raises(AssertionError):
        of_cosines_to_0()


BUGS = {
    "factors have two bits less": (
        "_products",
        "p.truncate(17) * q.truncate(17)",
        "p.truncate(15) * q.truncate(15)",
        "a term rises too far",
    ),
    "a square wraps": (
        "_pipelined",
        "square.saturate(format)",
        "square.wrap(format)",
        "a term rises too far",
    ),
    "a factor has a bit less": ("_products", "q.truncate(17)", "q.truncate(16)", "a term is too small"),
    "the sum has no low bits": (
        "_products",
        "register(m, p + q, ",
        "register(m, p.truncate(17).extend(p.format) + q, ",
        "a term is too large",
    ),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(inject, bug):
    """Each bug, injected in the unit, breaks a bound."""
    *change, claim = BUGS[bug]
    inject(PowerUnit, *change)
    with pytest.raises(AssertionError, match=f"^{claim}"):
        check(PowerUnit(Power("one_minus_cosine")), 1000, every_argument(1000))
