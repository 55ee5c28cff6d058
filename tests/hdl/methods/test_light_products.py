# amaranth: UnusedElaboratable=no
"""Products of a normal with the vectors of every light: exact integers."""

import numpy as np
import pytest

from blysk.bench.units.methods.light_products import RECORD
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.methods.light_products import LightProductsUnit


@pytest.mark.parametrize("operand", ["cosine", "one_minus_cosine"])
@pytest.mark.parametrize("stimulus", RECORD.stimuli)
def test_products_are_exact_integers(operand, stimulus):
    """N.L and N.H are exact.

    The chord has halved differences from a difference of 1 on, and is cut to 25 bits.
    """
    unit = LightProductsUnit(LinearInterpolator(operand=operand), 3)
    case = next(RECORD.runs(unit, stimulus)).case
    found, normals = RECORD.expect(unit, case), case.beats
    direction, halfway = (case.constants[name] for name in ("direction", "halfway"))
    np.testing.assert_array_equal(found["cosine"], normals @ direction.T)
    exact = normals @ halfway.T
    if operand == "one_minus_cosine":
        difference = normals[:, np.newaxis] - halfway
        far = ((difference < COMPONENT.min_code) | (difference > COMPONENT.max_code)).any(axis=-1)
        halved = np.square(difference >> 1).sum(axis=-1) << 2
        square = np.where(far, halved, np.square(difference).sum(axis=-1))
        exact = np.minimum(square >> 10, Specular.ARGUMENT_FORMAT.max_code)
    np.testing.assert_array_equal(found["highlight"], exact)
