# amaranth: UnusedElaboratable=no
"""Light unit: cycles of lit and dark beats. `tests.test_units` checks its terms."""

import numpy as np
import pytest

from blysk.bench.units.lighting.light import RECORD
from blysk.sim.engines.simulate import simulate


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] * (variant.long or name != "cosquad, interval 3, gated"))
        for name, variant in RECORD.variants.items()
        if "interval" in name
    ],
)
def test_dark_beats_bypass_the_specular_unit(name):
    """A dark beat takes two cycles, or one if the interval is one.

    A lit beat after dark beats waits for its slot.
    """
    unit = RECORD.variants[name].unit()
    run = next(RECORD.runs(unit, "operands"))
    case, interval = run.case, unit.initiation_interval
    dark = case.beats["cosine"] <= 0
    if "gated" in case.beats:
        dark = dark | case.beats["gated"].astype(bool)
    assert 0.2 < dark.mean() < 0.9
    assert not run.expected["specular"][dark].any()
    found = simulate(unit, case.beats, count=run.count, constants=case.constants, engine="auto")
    lit, starts = np.count_nonzero(~dark), np.count_nonzero(np.diff(dark.astype(int)) == 1)
    if interval == 1:
        np.testing.assert_array_equal(found.cycles - found.input_cycles, unit.latency)
    total = found.cycles[-1] - found.cycles[0]
    assert interval * (lit - 1) <= total <= interval * (lit + starts) + 2 * np.count_nonzero(dark)
    if "gated" in case.beats:
        # Spans without a highlight: the last beats of 20 that the gate stops together.
        gated = case.beats["gated"].reshape(-1, 20).all(axis=1)
        ends = 20 * np.flatnonzero(gated) + 19
        assert len(ends) > 3
        np.testing.assert_array_equal(found.cycles[ends] - found.cycles[ends - 5], 5 * min(2, interval))
