# amaranth: UnusedElaboratable=no
"""Diffuse unit: RTL against its twin, clock by clock."""

import numpy as np
import pytest

from golden.diffuse import Diffuse
from golden.fixed import Fixed
from golden.unit_vector import ONE_SQUARED
from hdl.diffuse import DiffuseUnit


@pytest.mark.parametrize("latency", [2, 7])
def test_equals_twin(verify, latency):
    rng = np.random.default_rng(6)
    format, one = Diffuse.OPERAND_FORMAT, int(ONE_SQUARED.codes)
    edges = [0, 1, -1, one, one + 1, one - 1, 1 << 34, (1 << 34) - 1, (1 << 34) - (1 << 16), 1 << 16]
    edges += [(1 << 16) - 1, format.min_code, format.max_code]
    codes = np.r_[edges, rng.integers(-one, one, 1500), rng.integers(format.min_code, format.max_code, 100)]
    verify(DiffuseUnit(latency), codes, Diffuse().compute(Fixed(format, codes)).codes)


def test_latency_must_hold_the_work():
    with pytest.raises(ValueError, match="latency must be at least 2"):
        DiffuseUnit(1)
