# amaranth: UnusedElaboratable=no
"""Diffuse unit: RTL against its twin, clock by clock."""

import numpy as np
import pytest

from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit


@pytest.mark.parametrize(("latency", "interval"), [(2, 1), (7, 1), (3, 2), (10, 2), (11, 3), (10, 6)])
def test_equals_twin(verify, latency, interval):
    rng = np.random.default_rng(6)
    format, one = Diffuse().operand_format, int(ONE_SQUARED.codes)
    edges = [0, 1, -1, one, one + 1, one - 1, 1 << 34, (1 << 34) - 1, (1 << 34) - (1 << 16), 1 << 16]
    edges += [(1 << 16) - 1, format.min_code, format.max_code]
    codes = np.r_[edges, rng.integers(-one, one, 1500), rng.integers(format.min_code, format.max_code, 100)]
    unit = DiffuseUnit(latency=latency, initiation_interval=interval)
    verify(unit, codes, Diffuse().compute(Fixed(format, codes)).codes)


def test_waits_in_a_register_an_interval():
    """Ages; operand, turn and ready at more than an interval of 1; rounded, result, one that waits; then a
    copy for each interval begun.
    """
    assert DiffuseUnit().latency == 2
    assert DiffuseUnit(initiation_interval=4).latency == 3
    width, rounded = Diffuse().operand_format.width, 22
    for latency, interval, copies in ((7, 1, 5), (11, 2, 4), (11, 3, 2), (11, 6, 1)):
        cost = cost_of(DiffuseUnit(latency=latency, initiation_interval=interval))
        control = latency + 1 + (0 if interval == 1 else width + 2 + (interval - 1).bit_length())
        assert cost.register_bits == control + rounded + 17 * (2 + copies)
        assert cost.multiplier_count == 0


@pytest.mark.parametrize(("interval", "least"), [(1, 2), (2, 3)])
def test_latency_must_hold_the_work(interval, least):
    with pytest.raises(ValueError, match=rf"^latency must be at least {least}, not {least - 1}$"):
        DiffuseUnit(latency=least - 1, initiation_interval=interval)
