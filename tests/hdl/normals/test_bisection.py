# amaranth: UnusedElaboratable=no
"""Bisection unit: RTL against its twin, clock by clock, for every variant."""

import numpy as np
import pytest

from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED, quantise
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.sim.engines.simulate import simulate

# Latency and multipliers for the initiation intervals 1, 2, ..., as the unit's text states them.
NARROW_1, NARROW_2, WIDE = Bisection(1, 45), Bisection(2, 45), Bisection()
STATED = {
    WIDE: [(23, 9), (25, 5), (26, 3), (28, 3), (29, 2), (27, 2), (25, 2), (25, 2), (38, 1)],
    NARROW_2: [(20, 8), (21, 4), (23, 3), (25, 2), (24, 2), (23, 2), (23, 2), (29, 1)],
    NARROW_1: [(17, 7), (19, 4), (20, 3), (21, 2), (19, 2), (20, 2), (25, 1)],
}
VARIANTS = [
    (WIDE, 6),
    (Bisection(2, as_published=True), 6),
    (Bisection(1, as_published=True), 6),
    (NARROW_2, 5),
    (NARROW_1, 4),
    *((WIDE, interval) for interval in (1, 2, 3, 4, 5, 7, 9)),
    (Bisection(2, as_published=True), 1),
    *((NARROW_2, interval) for interval in (1, 3, 8)),
    *((NARROW_1, interval) for interval in (1, 2, 7)),
]


@pytest.mark.long
def test_intervals_and_what_they_cost():
    for parameters, stated in STATED.items():
        assert BisectionUnit(parameters).initiation_interval == parameters.steps + 3
        for interval, (latency, multipliers) in enumerate(stated, 1):
            unit = BisectionUnit(parameters, interval)
            assert (unit.initiation_interval, unit.latency) == (interval, latency)
            cost = cost_of(unit)
            assert cost.multiplier_count == multipliers
            assert all(out_of_range <= 18 for out_of_range, _ in cost.multipliers)


@pytest.mark.parametrize(
    ("parameters", "interval"), [(WIDE, 0), (WIDE, 10), (WIDE, 2.5), (NARROW_1, 8)], ids=str
)
def test_refuses_an_interval(parameters, interval):
    with pytest.raises(
        ValueError, match=rf"^initiation_interval must be 1 to {parameters.steps + 6}, not {interval}$"
    ):
        BisectionUnit(parameters, interval)


@pytest.mark.parametrize(("parameters", "interval"), VARIANTS, ids=str)
def test_equals_twin(verify, normal_pairs, parameters, interval):
    rng = np.random.default_rng(2)
    angles = np.r_[np.zeros(20), rng.uniform(0, 90, 1500), np.full(20, 45), np.full(20, 90)]
    angles = np.r_[angles, 10.0 ** rng.uniform(-4, 0, 100), rng.uniform(90, 180, 200), [180]]
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    # Not only unit vectors: every word at its ends must not upset what follows.
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 6))
    left, right = np.vstack([left, corners[:, :3]]), np.vstack([right, corners[:, 3:]])
    order = rng.permutation(len(left))
    left, right = left[order], right[order]
    # 1 - cosine is halfway between two words: 180994.5.
    left[0], right[0] = (35421, 119829, 39572), (-5993, -85566, 99107)
    middle, u, out_of_range = parameters.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    assert out_of_range.any()
    assert not out_of_range.all()
    verify(
        BisectionUnit(parameters, interval),
        {"normal_a": left, "normal_b": right},
        {"normal_middle": middle.codes, "one_minus_cosine": u.codes, "out_of_range": out_of_range},
    )


def test_every_bit_counts(normal_pairs):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    rng = np.random.default_rng(3)
    angles = rng.uniform(0, 100, 300_000)
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    # Of the cosine's, those at the border of its rounding: an eighth, so that all of them are there.
    below = (ONE_SQUARED.codes - np.einsum("ij,ij->i", left, right)) % (1 << 17) - (1 << 16)
    chosen = np.r_[:20_000, 20_000 + np.flatnonzero(abs(below[20_000:]) < 1 << 13)]
    left, right = left[chosen], right[chosen]
    middle, u, out_of_range = WIDE.compute(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    run = simulate(
        BisectionUnit(WIDE), {"normal_a": left, "normal_b": right}, count=len(chosen), engine="auto"
    )
    np.testing.assert_array_equal(run.beats["normal_middle"], middle.codes)
    np.testing.assert_array_equal(run.beats["one_minus_cosine"], u.codes)
    np.testing.assert_array_equal(run.beats["out_of_range"], out_of_range)
