# amaranth: UnusedElaboratable=no
"""Highlight gate: the decisions in its record, and refusals. `tests.test_units` checks its results."""

import numpy as np
import pytest

from blysk.bench.units.lighting.highlight_gate import RECORD
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit

GATE = RECORD.variants[RECORD.default].unit().model


@pytest.mark.parametrize("variant", RECORD.variants)
def test_spans_of_the_record_are_decided_both_ways(variant):
    """Each light lights some spans, but not all. So a unit that always gives the same decision fails."""
    unit = RECORD.variants[variant].unit()
    for run in RECORD.runs(unit, "spans"):
        share = (run.expected[:, np.newaxis] >> np.arange(unit.lights) & 1).mean(axis=0)
        assert np.all((share > 0.1) & (share < 0.9))


def test_refusals():
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=rf"^exponent must be 1 to 1000, not {exponent}$"):
            HighlightGateUnit(GATE, exponent=exponent)
