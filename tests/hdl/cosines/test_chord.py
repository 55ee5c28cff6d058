"""Chord unit: RTL against its twin, clock by clock."""

import numpy as np

from blysk.golden.cosines.chord import Chord
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.hdl.cosines.chord import ChordUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate


def test_equals_twin(verify, normal_pairs):
    rng = np.random.default_rng(1)
    angles = np.r_[np.zeros(20), 10.0 ** rng.uniform(-4, 0, 300), rng.uniform(0, 180, 1500), 180]
    left, right = (quantise(v) for v in normal_pairs(rng, len(angles), angles))
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (400, 6))
    # Differences of exactly one and a step more and less.
    border = np.array([[ONE, 0, 0, ONE - d, 0, 0] for d in (2**17 - 1, 2**17, 2**17 + 1)])
    # The largest differences.
    border = np.vstack([border, [COMPONENT.min_code] * 3 + [COMPONENT.max_code] * 3])
    border = np.vstack([border, np.roll(border, 3, axis=1)])
    left = np.vstack([left, ends[:, :3], border[:, :3]])
    right = np.vstack([right, ends[:, 3:], border[:, 3:]])
    order = rng.permutation(len(left))
    left, right = left[order], right[order]
    expected = Chord().operand(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    assert expected.codes.max() == Chord.ARGUMENT_FORMAT.max_code
    assert expected.codes.min() == 0
    verify(ChordUnit(), {"a": left, "b": right}, expected.codes)


def test_every_bit_counts(normal_pairs):
    """Bits that are cut off carry into the others once in many thousands."""
    rng = np.random.default_rng(2)
    angles = np.r_[10.0 ** rng.uniform(-4, 0, 50_000), rng.uniform(0, 180, 150_000)]
    left, right = (quantise(v) for v in normal_pairs(rng, len(angles), angles))
    expected = Chord().operand(Fixed(COMPONENT, left), Fixed(COMPONENT, right))
    run = simulate(ChordUnit(), {"a": left, "b": right}, count=len(angles), engine="auto")
    np.testing.assert_array_equal(run.beats, expected.codes)


def test_timing_and_cost():
    unit = ChordUnit()
    assert (unit.latency, unit.initiation_interval) == (11, 1)
    assert cost_of(unit).multipliers == {(18, 18): 3}
