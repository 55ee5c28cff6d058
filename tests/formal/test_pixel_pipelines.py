"""Proof about several pipelines with a wide beat; `test_units` proves the merged stream."""

import pytest

from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.presets import preset
from blysk.hdl.pixel_pipelines import WidePipelinesUnit

from .prover import Harness
from .rules import stays

pytestmark = pytest.mark.prove


def test_wide_beats_that_wait_stay(prove):
    """By induction: no lane gets a pixel while the beat of the other lanes waits."""
    design = preset(model="cosquad", lights=0, x_bits=4, y_bits=2, length_bits=2, grey=True)
    unit = WidePipelinesUnit(PixelPipelines(design.built(pipes=2)), 4)
    harness = Harness(unit)
    stays(harness, unit.o)
    prove(harness)
