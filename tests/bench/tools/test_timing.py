"""Timing diagrams show the behaviour of the units, and break no rule of a stream."""

import numpy as np
import pytest

from blysk.bench.tools.timing import PIXELS, draw_timing, waves_of
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit

Z_AXIS = [0, 0, ONE]
FIXED = [DotProductUnit, SpecularUnit, DifferenceSetupUnit]
SPANS = [
    (DifferenceAccumulatorUnit, {"length": 64}),
    (AdaptiveNormaliserUnit, {"normal_left": Z_AXIS, "normal_right": Z_AXIS, "length": 64}),
]


def moves(waves, stream):
    return np.flatnonzero(waves.levels[f"{stream}.valid"] & waves.levels[f"{stream}.ready"])


@pytest.mark.parametrize("unit", FIXED)
def test_times_are_those_of_the_unit(unit):
    unit = unit()
    waves = waves_of(unit)
    inputs, outputs = moves(waves, "i"), moves(waves, "o")
    assert inputs[0] == 0
    assert [waves.inputs[k] for k in inputs] == [waves.outputs[k] for k in outputs] == ["A", "B", "C"]
    # The first result comes after the latency, and waits for two cycles.
    assert np.flatnonzero(waves.levels["o.valid"])[0] == unit.latency
    assert outputs[0] == unit.latency + 2
    assert inputs[1] == unit.initiation_interval


@pytest.mark.parametrize(("unit", "beat"), SPANS)
def test_spans_give_pixels(unit, beat):
    waves = waves_of(unit(), beat)
    names = [waves.outputs[k] for k in moves(waves, "o")]
    assert names == [f"{span}{k}" for span in "ABC" for k in range(PIXELS)]


@pytest.mark.parametrize(("unit", "beat"), [*((u, None) for u in FIXED), *SPANS])
def test_rules_of_a_stream(unit, beat):
    waves = waves_of(unit(), beat)
    for stream, names in (("i", waves.inputs), ("o", waves.outputs)):
        valid, ready = waves.levels[f"{stream}.valid"], waves.levels[f"{stream}.ready"]
        waits = np.flatnonzero(valid & ~ready)
        assert all(valid[k + 1] and names[k + 1] == names[k] for k in waits)
        assert [name is not None for name in names] == valid.tolist()
    # Both kinds of stall occur.
    assert np.count_nonzero(~waves.levels["o.ready"]) == 2
    offered = np.flatnonzero(waves.levels["i.valid"])
    last = next(k for k, name in enumerate(waves.inputs) if name == "C")
    assert not waves.levels["i.valid"][last - 2 : last].any()
    assert offered[-1] >= last


def test_drawing_leaves_out_quiet_cycles():
    waves = waves_of(AdaptiveNormaliserUnit(), SPANS[1][1])
    figure = draw_timing(waves)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert "⋯" in texts
    assert len([text for text in texts if text.isdigit()]) < waves.cycles / 2
    assert {"A0", "A1", "A2", "C2", "i.valid", "o.payload"} <= set(texts)
    short = [text.get_text() for text in draw_timing(waves_of(DotProductUnit())).axes[0].texts]
    assert "⋯" not in short


def test_results_that_do_not_come():
    # A span without pixels gives none, and the diagram has none to show.
    unit = DifferenceAccumulatorUnit()
    with pytest.raises(RuntimeError, match="gave 0 of 3 results"):
        waves_of(unit, {})
