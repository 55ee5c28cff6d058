# amaranth: UnusedElaboratable=no
"""Angular setup: its times and parts; `tests.test_units` has its results, and the interpolator's."""

import pytest

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.emit.cost import cost_of


@pytest.mark.long
@pytest.mark.parametrize(
    ("angle", "latencies", "counts", "longest"),
    [
        ("half_chord", [53, 54, 55, 58, 58, 59], [26, 13, 9, 7, 6, 5], 26),
        ("arccos", [53, 54, 56, 59, 59, 58], [23, 13, 9, 8, 7, 6], 21),
    ],
)
def test_times_and_parts(angle, latencies, counts, longest):
    parameters = AngularSetup(angle)
    units = [AngularSetupUnit(parameters, initiation_interval=interval) for interval in range(1, 7)]
    assert [unit.latency for unit in units] == latencies
    assert [cost_of(unit).multiplier_count for unit in units] == counts
    for interval in (0, longest + 1):
        message = rf"^initiation_interval must be 1 to {longest}, not {interval}$"
        with pytest.raises(ValueError, match=message):
            AngularSetupUnit(parameters, initiation_interval=interval)
    assert AngularSetupUnit(parameters).initiation_interval == 6
