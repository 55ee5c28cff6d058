# amaranth: UnusedElaboratable=no
"""Local chord setup: times and parts, refusals, and its output under stalls; see `tests.test_units`."""

import numpy as np
import pytest

from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.cosines.local_chord_setup import RECORD

from ..variants import mostly_long


@pytest.mark.parametrize(
    ("lights", "interval"), mostly_long([*((1, i) for i in range(1, 7)), (2, 4), (3, 16)], (1, 4))
)
def test_multipliers(lights, interval):
    """1 product a span and 5 a light, as even as the interval allows; all of 18 bits."""
    unit = LocalChordSetupUnit(None, lights, initiation_interval=interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): -(-(1 + 5 * lights) // interval)}
    assert unit.multipliers == cost.multiplier_count
    assert cost.constant_multipliers == 0
    assert unit.latency >= LocalChordSetupUnit(None, lights, initiation_interval=1).latency


def test_options():
    unit = LocalChordSetupUnit()
    assert (unit.lights, unit.initiation_interval, unit.multipliers) == (1, 4, 2)
    assert cost_of(LocalChordSetupUnit(length_bits=9)).rom_bits == 17 << 8
    assert LocalChordSetupUnit(None, 2, initiation_interval=2, highlights=False).multipliers == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *(({"initiation_interval": i}, f"interval must be at least 1, not {i}") for i in (0, -1)),
        *(({"length_bits": bits}, f"length_bits must be 2 to 12, not {bits}") for bits in (1, 13)),
    ],
)
def test_refuses(arguments, message):
    with pytest.raises(ValueError, match=rf"^{message}$"):
        LocalChordSetupUnit(**arguments)


def test_waiting_output_blocks_the_input():
    """Of each pair of beats the first waits at the output: the second enters one cycle after it has left."""
    unit = LocalChordSetupUnit()
    case = RECORD.stimuli["spans"].make(unit, np.random.default_rng(3), 40)
    stalls = {"input_stalls": np.arange(60) != 0, "output_stalls": np.arange(120) < 65}
    run = simulate(unit, case.beats, count=40, engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats, RECORD.expect(unit, case))
    np.testing.assert_array_equal(run.input_cycles[1::2], run.cycles[::2] + 1)
    np.testing.assert_array_equal(run.cycles[1::2], run.input_cycles[1::2] + unit.latency)
