"""Model of the factor unit against exact products."""

import numpy as np
import pytest

from blysk.golden.lighting.factor import Factor
from blysk.golden.number.fixed import SQ, UQ, Fixed

TOP = 2**17 - 1


def compute(specular, factor):
    return Factor().compute(Fixed(UQ(0, 17), specular), Fixed(UQ(0, 17), factor))


def test_every_factor_of_some_terms():
    """The result is less than 2^-17 under the product, and never over it."""
    factor = np.arange(2**17)
    for term in (0, 1, 3, 2**16, 99_991, TOP):
        exact = term * factor / 2**34
        found = compute(np.full_like(factor, term), factor).values
        assert ((exact - 2.0**-17 < found) & (found <= exact)).all()


def test_ends():
    """A factor of 0 leaves nothing. A factor of 1, which is a step less than 1, takes off a step."""
    terms = np.array([0, 1, 2**16, TOP])
    assert not compute(terms, 0 * terms).codes.any()
    assert (terms - compute(terms, 0 * terms + TOP).codes).tolist() == [0, 1, 1, 1]


def test_other_operands_are_refused():
    with pytest.raises(ValueError, match=r"^operands must be UQ\(0, 17\), not UQ\(0, 17\), SQ\(1, 17\)$"):
        Factor().compute(Fixed(UQ(0, 17), [0]), Fixed(SQ(1, 17), [0]))
