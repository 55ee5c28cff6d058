"""Proofs of the exact power unit: how far its term may rise as the cosine falls, and where it is 0."""

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

# Up to 4 million arguments give light; of lower exponents it is up to 33 million each, minutes in all.
EXHAUSTED = sorted({*(2**k + step for k in range(7, 10) for step in (-1, 0, 1)), 100, 777, 999, 1000})

RISE = 5
"""Steps of the result: together under a hundredth of a step of an 8-bit channel, at intensity 1."""


def last_lit(exponent):
    """``1 - cos gamma`` of which the power is a step of the result: beyond it no term is over 0."""
    return -np.expm1(np.log(Power.RESULT_FORMAT.step) / exponent)


def shortfall(low, high, exponent):
    """Steps by which a term may be under the exact one, before the last cut; 1 - cos from low to high.

    Of words p and q, whose factors are cut, an operation makes ``p + q - p q`` and less than ``c (p + q)``
    more, c a step of the factors. All of this grows with p and q. So no word x or s is under the exact one,
    x° or s°, nor over what x^ and s^ get that have ``c (p + q)`` more every time; their distances

        ``x^ - x°  <-  (x^ - x°) (2 - x^ - x°) + 2 c x^``
        ``s^ - s°  <-  (s^ - s°) (1 - x°) + (x^ - x°) (1 - s^) + c (s^ + x^)``

    are sums of what is not negative, so that each factor's larger end bounds them. Saturation only lowers
    words; one that is used makes the term 0.
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
    """It is under `RISE` steps where there is light; what is left is for float64 and ``1 - 2^-34`` for 1."""
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
    """Largest rise in steps, of arguments that never fall; it and each term keep the bounds of `RISE`."""
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
    """All up to the last that gives light, then some."""
    end, last = int(last_lit(exponent) * 2.0**25) + 2, Power.ARGUMENT_FORMAT.max_code
    return np.r_[np.arange(end), np.linspace(end, last, 1000).astype(np.int64)]


def some_cosines(exponent):
    """At random where there is light and next to where a factor changes; both ends of the word."""
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
    """Inductive, for every operand: ``1 - cos gamma``, limited, is all that a term is made of.

    A dark beat has the largest argument, as 1 - cos gamma of 1 and more.
    """
    reads_one_word(PowerUnit(Power(operand)), "x_0")
    prove(of_power(operand))


def test_term_rises_by_five_steps_at_most():
    """For every argument of 34 bits and every exponent, by bounds.

    A term is never over the exact one, cut to 17 bits, and at most `RISE` steps under that, which falls with
    the argument. So it is at most `RISE` steps over any term of a smaller argument. Why it rises at all: of
    ``p + q - p q`` the sum has 34 bits, the product has 17 of each factor. Where a factor takes its next
    code, the product grows by up to two of its steps at once and the sum by 2^-34.
    """
    for exponent in EXPONENTS:
        of_shortfall(exponent)
    assert RISE * Power.RESULT_FORMAT.step < 0.01 / 255
    assert (RISE + 1) * Power.RESULT_FORMAT.step <= Power.ERROR


def test_term_rises_by_three_steps_at_every_argument():
    """Exhaustion of 1 - cos gamma for `EXHAUSTED`, in the unit: 2 or 3 steps."""
    unit = PowerUnit(Power("one_minus_cosine"))
    rises = [check(unit, exponent, every_argument(exponent)) for exponent in EXHAUSTED]
    assert set(rises) == {2, 3}


def test_term_of_a_cosine_keeps_the_bounds():
    """Every exponent, at some arguments of 34 bits, in the unit."""
    unit = PowerUnit(Power("cosine"))
    for exponent in EXPONENTS:
        check(unit, exponent, some_cosines(exponent))


def of_darkness(operand):
    """Dark beats at the peak, and arguments of 1 and more: each is as good as any, by `of_argument`."""
    unit = PowerUnit(Power(operand))
    peak, end = 0, 1 << 25
    if operand == "cosine":
        peak, end = ONE_SQUARED.codes.item(), unit.model.operand_format.min_code
    beats = {"operand": np.array([peak, end, peak]), "dark": np.array([1, 0, 0], dtype=np.uint8)}
    for exponent in EXPONENTS:
        terms = simulate(unit, beats, count=3, constants={"exponent": exponent}).beats
        assert terms.tolist() == [0, 0, 2**17 - 1]


def of_cosines_to_0():
    """At n = 1 a cosine of 0 and less has a term of one step to -2^-17, then 0."""
    codes = -np.arange(1 << 18)
    beats = {"operand": codes, "dark": np.zeros(len(codes), dtype=np.uint8)}
    run = simulate(PowerUnit(Power("cosine")), beats, count=len(codes), constants={"exponent": 1})
    np.testing.assert_array_equal(run.beats, codes > 1 - (1 << 17))


@pytest.mark.parametrize("operand", OPERANDS)
def test_term_is_0_in_the_dark(operand):
    """Every exponent, and every beat that is dark or has an argument of 1 or more."""
    of_darkness(operand)


def test_term_is_0_where_the_cosine_is_not_over_0():
    """But at n = 1, next to 0: ``1 - cos gamma`` is from the 1 of unit vectors, which is 2^-16 less.

    At every other exponent the exact term of such an argument is under a step, and no term is over that.
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
    """Injected in the unit, each refutes the claims."""
    name, *change = BUGS_OF_ARGUMENT[bug]
    inject(blysk.hdl.lighting.power if name == "one_minus" else PowerUnit, name, *change)
    refute(of_power("cosine"), 4)


def test_bug_of_the_bounds_is_found(monkeypatch):
    """Factors of a bit less."""
    monkeypatch.setattr(Power, "FACTOR_FORMAT", UQ(0, 16))
    with pytest.raises(AssertionError, match=r"^terms may be 5 steps too small at exponent 513$"):
        of_shortfall(513)


@pytest.mark.parametrize("operand", OPERANDS)
def test_bug_of_the_dark_is_found(inject, operand):
    """That of a dark beat is the term it would have."""
    inject(PowerUnit, "datapath", "Mux(dark, ", "Mux(0, ")
    with pytest.raises(AssertionError):
        of_darkness(operand)


def test_bug_of_cosines_to_0_is_found(inject):
    """1 is not that of unit vectors."""
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
    """Injected in the unit, each breaks a bound."""
    *change, claim = BUGS[bug]
    inject(PowerUnit, *change)
    with pytest.raises(AssertionError, match=f"^{claim}"):
        check(PowerUnit(Power("one_minus_cosine")), 1000, every_argument(1000))
