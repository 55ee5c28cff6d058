# amaranth: UnusedElaboratable=no
"""Middle normal unit: RTL against its twin, clock by clock."""

import numpy as np
import pytest

from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.sim.engines.simulate import simulate

# Latency and multipliers for the initiation intervals 1 to 9, as the unit's text states them.
STATED = [(36, 9), (37, 5), (40, 3), (39, 3), (40, 2), (40, 2), (40, 2), (44, 2), (52, 1)]


@pytest.mark.parametrize("interval", range(1, 10))
def test_intervals_and_what_they_cost(interval):
    unit = MiddleNormalUnit(initiation_interval=interval)
    assert (unit.latency, unit.initiation_interval) == (STATED[interval - 1][0], interval)
    cost = cost_of(unit)
    assert cost.multiplier_count == STATED[interval - 1][1]
    assert all(out_of_range <= 18 for out_of_range, _ in cost.multipliers)


def test_default_interval():
    unit = MiddleNormalUnit()
    assert (unit.latency, unit.initiation_interval) == (40, 6)


@pytest.mark.parametrize("interval", [0, 10, -1, 1.5])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^initiation_interval must be 1 to 9, not {interval}$"):
        MiddleNormalUnit(initiation_interval=interval)


@pytest.mark.parametrize(
    ("interval", "fit"),
    [
        *((interval, "exact") for interval in range(1, 10)),
        (6, "as_published"),
        (6, "minimax_2"),
        (6, "minimax_3"),
        (1, "minimax_3"),
    ],
)
def test_equals_twin(verify, normal_pairs, interval, fit):
    parameters = MiddleNormal(fit)
    rng = np.random.default_rng(2)
    angles = np.r_[np.zeros(20), rng.uniform(0, 45, 1500), np.full(20, 45), rng.uniform(45, 180, 300), [180]]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    # Not only unit vectors: every word at its ends must not upset what follows.
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 6))
    left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
    middle, out_of_range = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    verify(
        MiddleNormalUnit(parameters, interval),
        {"normal_left": left, "normal_right": right},
        {
            "normal_left": left,
            "normal_right": right,
            "normal_middle": middle.codes,
            "out_of_range": out_of_range,
        },
    )


def test_every_bit_counts(normal_pairs, one_minus_cosines):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    rng = np.random.default_rng(3)
    left, right = (quantise(normals) for normals in normal_pairs(rng, 40_000, rng.uniform(0, 60, 40_000)))
    # Of all pairs of the first 1500 those up to 60 degrees whose u is at the border of a step.
    u = one_minus_cosines(left[:1500], right[:1500])
    first, second = np.nonzero((u < ONE_SQUARED.codes // 2) & ((u + 8) % (1 << 16) < 16))
    left, right = np.vstack([left, left[first]]), np.vstack([right, right[second]])
    middle, out_of_range = MiddleNormal().compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    beats = {"normal_left": left, "normal_right": right}
    run = simulate(MiddleNormalUnit(), beats, count=len(left), engine="auto")
    np.testing.assert_array_equal(run.beats["normal_middle"], middle.codes)
    np.testing.assert_array_equal(run.beats["out_of_range"], out_of_range)
