# amaranth: UnusedElaboratable=no
"""Products of a normal with the vectors of every light: exact integers, times and multipliers."""

import numpy as np
import pytest

from blysk.bench.units.methods.light_products import RECORD
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.light_products import LightProductsUnit

TIMES = {"cosine": 5, "one_minus_cosine": 8}


@pytest.mark.parametrize("operand", TIMES)
@pytest.mark.parametrize("stimulus", RECORD.stimuli)
def test_products_are_exact_integers(operand, stimulus):
    """N.L and N.H whole; the chord of halved differences from a difference of 1 on, cut to 25 bits."""
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


@pytest.mark.long
@pytest.mark.parametrize(("operand", "latency"), TIMES.items())
def test_timing_and_multipliers(operand, latency):
    method = LinearInterpolator(operand=operand)
    for lights, interval in ((1, 1), (3, 1), (2, 3), (5, 1), (1, 3), (2, 12)):
        unit = LightProductsUnit(method, lights, initiation_interval=interval)
        assert unit.initiation_interval == interval
        assert interval > 1 or unit.latency == latency
        assert cost_of(unit).multipliers == {(18, 18): 6 * lights // interval}
    assert cost_of(LightProductsUnit(method, 2, highlights=False)).multiplier_count == 6
