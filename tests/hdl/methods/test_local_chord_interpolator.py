# amaranth: UnusedElaboratable=no
"""The local chord method: cycles, multipliers and shapes of its unit; `test_units` holds its operands."""

import numpy as np
import pytest

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.methods.local_chord_interpolator import RECORD

METHOD = LocalChordInterpolator()


def test_cycles():
    """The first span leaves `latency` cycles after it came; pixels of a span on the cycles after each other.

    Of spans of the interval's length and more there is no gap.
    """
    unit = LocalChordInterpolatorUnit(METHOD, 1)
    case = next(RECORD.runs(unit, "spans")).case
    for least in (1, unit.setup_interval):
        length = case.beats["length"] = np.maximum(case.beats["length"], least)
        run = simulate(unit, case.beats, count=int(length.sum()), engine="auto")
        assert run.cycles[0] == run.input_cycles[0] + unit.latency
        _, step = pixels_of(length)
        np.testing.assert_array_equal(np.diff(run.cycles)[step[1:] > 0], 1)
        assert np.all(run.cycles[step == 0] >= run.input_cycles + unit.latency)
    np.testing.assert_array_equal(np.diff(run.cycles), 1)


@pytest.mark.parametrize(("lights", "interval"), [(1, 1), (1, 2), (1, 4), (1, 6), (2, 4)])
def test_multipliers(lights, interval):
    """Those of the setup alone."""
    unit = LocalChordInterpolatorUnit(METHOD, lights, setup_interval=interval)
    assert cost_of(unit).multipliers == {(18, 18): -(-(1 + 5 * lights) // interval)}
    dark = LocalChordInterpolatorUnit(METHOD, 2, setup_interval=2, highlights=False, length_bits=5)
    assert cost_of(dark).multiplier_count == 3


def test_is_an_interpolator_but_for_its_input():
    """The shell finds what it reads of an interpolator unit."""
    unit = LocalChordInterpolatorUnit(METHOD, 2, setup_interval=3)
    assert (unit.lights, unit.setup_interval, unit.cycles_per_pixel) == (2, 3, 1)
    assert list(type(unit).setup_intervals(METHOD)) == [1, 2, 3, 4, 5, 6]
    assert unit.o.payload.shape() == InterpolatorUnit(METHOD, 2).o.payload.shape()
    members = unit.i.payload.shape().members
    assert (list(members), members["values"].length) == (["values", "length"], 2)
    assert cost_of(unit).multiplier_count == 4
