# amaranth: UnusedElaboratable=no
"""Exact power unit: times, resets. `tests.test_units` compares it with its model."""

from blysk.bench.units.lighting.power import RECORD
from blysk.bench.units.record import Case, first
from blysk.hdl.lighting.power import PowerUnit

from ...checks import resets


def test_times_as_stated():
    for form, times in (("pipelined", (32, 1)), ("sequential", (44, 42))):
        unit = PowerUnit(form=form)
        assert (unit.latency, unit.initiation_interval) == times


def test_reset_in_mid_power():
    """The sequential form is reset in any cycle of a power. It computes the next power as after power-up."""
    unit = RECORD.variants["sequential, of a chord"].unit()
    case = next(RECORD.runs(unit, "highlights")).case
    case = Case(first(case.beats, 6), case.constants)
    found = resets(unit, case, (1, 2, 3, 7, 24, 42, 43, 44, 45), cycles=140, count=3)
    assert [cycle for cycle, _ in found] == [44, 44 + 42, 44 + 84]
