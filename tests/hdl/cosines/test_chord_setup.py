# amaranth: UnusedElaboratable=no
"""Chord setup: multipliers at every interval, and refusals; `tests.test_units` holds it against its model."""

import pytest

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.emit.cost import cost_of

from ..variants import mostly_long


@pytest.mark.parametrize(
    ("lights", "interval"), mostly_long([*((1, i) for i in (1, 2, 3, 4, 5, 7, 13, 26)), (2, 4)], (1, 4))
)
def test_multipliers(lights, interval):
    """7 products a span and 19 a light, as even as the interval allows; all of 18 bits."""
    unit = ChordSetupUnit(None, lights, initiation_interval=interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): -(-(7 + 19 * lights) // interval)}
    assert unit.multipliers == cost.multiplier_count
    assert cost.constant_multipliers == 0
    # The latency grows with the interval by the cycles that products wait for a multiplier.
    assert unit.latency >= ChordSetupUnit(None, lights, initiation_interval=1).latency


def test_default_interval():
    unit = ChordSetupUnit()
    assert (unit.lights, unit.initiation_interval, unit.multipliers) == (1, 4, 7)


@pytest.mark.parametrize(
    ("terms", "fraction_bits", "interval"), mostly_long([(1, 36, 4), (2, 46, 5), (3, 40, 1)], ())
)
def test_each_term_is_a_product(terms, fraction_bits, interval):
    unit = ChordSetupUnit(ChordSetup(terms, fraction_bits), initiation_interval=interval)
    assert cost_of(unit).multiplier_count == -(-(4 + terms + 19) // interval)


@pytest.mark.long
def test_shorter_spans_need_a_smaller_table():
    assert cost_of(ChordSetupUnit(length_bits=9)).rom_bits == 17 << 8


def test_refusals():
    for interval in (0, -1):
        with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
            ChordSetupUnit(initiation_interval=interval)
    for bits in (1, 13):
        with pytest.raises(ValueError, match=rf"^length_bits must be 2 to 12, not {bits}$"):
            ChordSetupUnit(length_bits=bits)
    with pytest.raises(ValueError, match=r"^terms must be 1 to 3, not 4$"):
        ChordSetup(terms=4)
    for bits in (34, 37, 48):
        with pytest.raises(ValueError, match=rf"^fraction_bits must be even and 36 to 46, not {bits}$"):
            ChordSetup(fraction_bits=bits)
