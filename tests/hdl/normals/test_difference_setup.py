# amaranth: UnusedElaboratable=no
"""Difference setup: times and parts at every interval, and refusals; `tests.test_units` has its results."""

import pytest

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit

from ..variants import mostly_long

# Latency and multipliers for the initiation intervals 1, 2, ..., as the unit's text states them.
STATED = {
    (False, 2): [(17, 7), (18, 4), (18, 3), (20, 2), (21, 2), (21, 2), (24, 1)],
    (True, 2): [(20, 9), (21, 5), (23, 3), (22, 3), (25, 2), (23, 2), (22, 2), (22, 2), (29, 1)],
    (False, 1): [(11, 3), (13, 2), *[(14, 1)] * 5],
}


@pytest.mark.long
@pytest.mark.parametrize(
    ("as_published", "order", "interval"),
    mostly_long(
        [(*key, interval) for key, stated in STATED.items() for interval in range(1, len(stated) + 1)],
        (False, 2, 7),
    ),
)
def test_intervals_and_parts(as_published, order, interval):
    unit = DifferenceSetupUnit(DifferenceSetup(as_published), initiation_interval=interval, order=order)
    cost = cost_of(unit)
    assert (unit.latency, cost.multiplier_count) == STATED[as_published, order][interval - 1]
    assert unit.initiation_interval == interval
    assert all(widest <= 18 for widest, _ in cost.multipliers)
    assert cost.rom_bits == 2048 * 17
    assert ("g" in unit.i.payload.shape().members) == (order == 2)


def test_default_interval_is_that_of_one_multiplier():
    for parameters, order, interval in (
        (None, 2, 7),
        (DifferenceSetup(as_published=True), 2, 9),
        (None, 1, 3),
    ):
        assert DifferenceSetupUnit(parameters, order=order).initiation_interval == interval


@pytest.mark.parametrize("bits", mostly_long([2, 3, 7, 10], 7))
def test_shorter_spans_need_a_smaller_table(bits):
    assert cost_of(DifferenceSetupUnit(length_bits=bits)).rom_bits == 17 << (bits - 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *(
            ({"initiation_interval": i}, f"initiation_interval must be 1 to 7, not {i}")
            for i in (0, 8, -1, 1.5)
        ),
        *(({"order": order}, f"order must be 1 or 2, not {order}") for order in (0, 3)),
        *(({"length_bits": bits}, f"length_bits must be 2 to 12, not {bits}") for bits in (1, 13)),
    ],
)
def test_refuses(arguments, message):
    with pytest.raises(ValueError, match=rf"^{message}$"):
        DifferenceSetupUnit(**arguments)
