"""Figures of the specification that no device's own tests hold, grouped as they are published."""

import math

import numpy as np
import pytest

from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS

X = np.linspace(0, 30, 6001)
"""``n (1 - cos gamma)``; above 30 Blinn is below 1e-13."""


def cosines(n):
    return 1 - X[n >= X] / n


# docs/theory/models.md#reflection-models: the largest errors against Blinn over the whole range.


def schlick(cosine, n):
    return cosine / (n - n * cosine + cosine)


@pytest.mark.parametrize(("n", "shown"), [(16, "0.19"), (64, "0.20"), (256, "0.20")])
def test_schlick_is_no_better_than_the_parabola(n, shown):
    """A rival of the literature that the project does not build: ``c / (n - n c + c)``."""
    cosine = cosines(n)
    error = np.abs(schlick(cosine, n) - cosine**n).max()
    assert f"{error:.2f}" == shown
    assert (
        error
        > np.abs(
            REFLECTION_MODELS["cosquad"].reflect(cosine, n) - REFLECTION_MODELS["blinn"].reflect(cosine, n)
        ).max()
    )


@pytest.mark.parametrize("n", [16, 64, 256, 1000])
def test_slope_of_the_epicentre_fit(n):
    """fQ2 is the better line where Blinn >= 0.5, its refitted slope the better one over the whole range."""
    cosine = cosines(n)
    blinn = REFLECTION_MODELS["blinn"].reflect(cosine, n)
    own, refitted = (
        np.abs(REFLECTION_MODELS[name].reflect(cosine, n) - blinn)
        for name in ("cosquad_lin", "lyon1_refitted")
    )
    assert own[blinn >= 0.5].max() < refitted[blinn >= 0.5].max() / 2
    assert refitted.max() < 0.56 * own.max()


def test_half_chord_keeps_its_precision():
    """``psi = 2 arcsin(|N_r - N_l|/2)`` at 1 degree: what rounding of the ends costs, no more."""
    psi = math.radians(1)
    ends = quantise(np.array([[1.0, 0, 0], [math.cos(psi), math.sin(psi), 0]]))
    squared = Fixed(HalfChord.OPERAND_FORMAT, np.square(ends[1] - ends[0]).sum())
    turns = float(HalfChord().compute(squared, np.zeros((), bool)).values)
    # Each component of each end is off by half a step of 2^-17.
    assert abs(2 * math.pi * turns - psi) <= math.sqrt(2) * COMPONENT.step + HalfChord.RELATIVE_ERROR * psi


# Recurrences in fixed point.


def grown(first, second, pixels):
    """What codes in the first and the second difference have become, in the accumulator's own units."""
    unit = DifferenceAccumulator()
    zero = Fixed(COMPONENT, np.zeros((1, 3), int))
    first, second = (Fixed(unit.format, np.full((1, 3), code)) for code in (first, second))
    normal = unit.compute(zero, first, second, np.zeros(1, int), np.array([pixels]))
    return normal.codes[0, 0] * 2**25


def test_growth_of_an_error_in_the_differences():
    """e1 grows to ``m e1``, e2 to ``m^2/2 e2``, to half a step of 2^-17."""
    m, half = 4094, 2**24
    e1, e2 = 2**22, 2**14
    assert abs(grown(e1, 0, m) - m * e1) <= half
    assert abs(grown(0, e2, m) - m * (m - 1) // 2 * e2) <= half
    assert grown(0, e2, m) == pytest.approx(m**2 / 2 * e2, rel=1e-3)


def test_fractional_bits_of_the_differences():
    """For 2^-17 after 4095 pixels, half of it from each difference: 30 bits for the first, 41 the second."""
    budget, fraction_bits = 2.0**-18, DifferenceAccumulator().format.fraction_bits
    for growth, bits in ((4095, 30), (4095**2 / 2, 41)):
        assert round(-math.log2(budget / growth)) == bits < fraction_bits
    # The bound 2^-(F+1) (1 + T + T^2/2) of T steps.
    assert 2.0 ** -(fraction_bits + 1) * (1 + 4094 + 4094**2 / 2) < 2.0**-17
