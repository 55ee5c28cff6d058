"""Bisection unit: RTL against its twin, clock by clock, for every variant."""

import numpy as np
import pytest

from golden.bisection import Bisection
from golden.fixed import Fixed
from golden.unit_vector import COMPONENT, quantise
from hdl.bisection import BisectionUnit

# With the initiation interval and the latency that the unit's text states.
VARIANTS = [
    (Bisection(), 6, 28),
    (Bisection(2, as_documented=True), 6, 28),
    (Bisection(1, as_documented=True), 6, 28),
    (Bisection(2, 45), 5, 23),
    (Bisection(1, 45), 4, 20),
]


@pytest.mark.parametrize(("parameters", "interval", "latency"), VARIANTS, ids=str)
def test_equals_twin(verify, normal_pairs, parameters, interval, latency):
    rng = np.random.default_rng(2)
    angles = np.r_[np.zeros(20), rng.uniform(0, 90, 1500), np.full(20, 45), np.full(20, 90)]
    angles = np.r_[angles, 10.0 ** rng.uniform(-4, 0, 100), rng.uniform(90, 180, 200), [180]]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    # Not only unit vectors: every word at its ends must not upset what follows.
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 6))
    left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
    order = rng.permutation(len(left))
    left, right = left[order], right[order]
    middle, u, wide = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    assert wide.any()
    assert not wide.all()
    unit = BisectionUnit(parameters)
    assert (unit.initiation_interval, unit.latency) == (interval, latency)
    verify(
        unit,
        {"normal_a": left, "normal_b": right},
        {"normal_middle": middle.codes, "one_minus_cosine": u.codes, "wide": wide},
    )
