"""Frames of the exponents asked for, and their errors."""

import pytest

from blysk.bench.accuracy import measure
from blysk.golden.presets import preset
from blysk.sim.meshes.teapot import teapot


@pytest.mark.long
def test_measures_every_exponent():
    rows = list(measure(teapot(500), preset(model="cosquad"), (1, 100), 64, 48))
    assert [row[0] for row in rows] == [1, 100]
    first, second = (row[1] for row in rows)
    assert first.pixels == second.pixels > 500
    assert (first.image != second.image).any()
    for _, _, result in rows:
        assert 0 < result.arithmetic_error.max_lsb <= 1
        assert result.total_error.max_lsb > 5
