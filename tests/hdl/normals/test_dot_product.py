"""Dot-product unit: RTL against its twin, clock by clock."""

import numpy as np
import pytest

from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.dot_product import DotProductUnit


@pytest.mark.parametrize("format", [COMPONENT, SQ(2, 4)], ids=str)
def test_equals_twin(verify, format):
    rng = np.random.default_rng(1)
    ends = np.array([format.min_code, format.max_code, 0, 1, -1])
    edges = np.stack(np.meshgrid(*[ends] * 4), axis=-1).reshape(-1, 4)[:, [0, 1, 2, 3, 0, 1]]
    codes = np.vstack([edges, rng.integers(format.min_code, format.max_code + 1, (2000, 6))])
    parameters = DotProduct(format, format)
    expected = parameters.compute(Fixed(format, codes[:, :3]), Fixed(format, codes[:, 3:])).codes
    verify(DotProductUnit(parameters), {"a": codes[:, :3], "b": codes[:, 3:]}, expected)
