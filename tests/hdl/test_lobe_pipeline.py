# amaranth: UnusedElaboratable=no
"""Pipelines with a table: RTL against the bit-accurate model, tables that are loaded again, the gate,
cost."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.units.lighting.highlight_gate import spans_about
from blysk.bench.units.operands import component_words, sphere
from blysk.golden.frame_constants import writes_of
from blysk.golden.frames.prepare import with_tables
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import quantise
from blysk.golden.presets import preset
from blysk.golden.reference.lighting import Material
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import _sample, beats_of
from blysk.sim.frames.vectors import pixel_beats

from ..checks import assert_beats_equal

DESIGNS = {
    "renormalise": preset("renormalise", "blinn"),
    "materials, lights, gate": preset("quadratic", "ggx", materials=3, lights=2, gate=True),
    "two banks of three materials": preset("linear", "beckmann", materials=3, banks=2),
    "compact, gate": preset("quadratic", "beckmann", materials=3, style="compact", gate=True, cutoff=1 / 510),
    "fixed, gate, compact": preset("quadratic", "blinn", 2, exponent=20, gate=True, style="compact"),
    "fixed roughness": preset("linear", "ggx", roughness=0.3),
    "values": preset("chord-local", "ggx"),
    "other size": preset("linear", "ggx", octaves=12, steps=32),
}


def shade(unit, spans, write, expected, **stalls):
    """Check that pixels equal the model's."""
    expected = pixel_beats(expected)
    options = {"count": len(expected["x"]), "write": write, "engine": "auto", **stalls}
    assert_beats_equal(simulate(unit, beats_of(unit, spans), **options).beats, expected)


@pytest.mark.long
@pytest.mark.parametrize("design", DESIGNS)
def test_equals_model(design):
    design = DESIGNS[design]
    unit = ShadingPipelineUnit(design)
    spans, constants = _sample(design)
    pixels = design.compute(spans, constants)
    rng = np.random.default_rng(7)
    stalls = {"input_stalls": rng.random(997) < 0.4, "output_stalls": rng.random(1009) < 0.4}
    for options in ({}, stalls):
        shade(unit, spans, writes_of(constants), pixels, **options)


def test_a_frame_loads_its_own_tables():
    """Tables of the frame before are replaced in every bank."""
    design = preset("linear", "ggx", materials=3)
    unit = ShadingPipelineUnit(design)
    spans, constants = _sample(design)
    material = Material((0.1,) * 3, (0.5,) * 3, (0.6,) * 3, 10)

    def of(*roughness):
        return with_tables(constants, [replace(material, roughness=r) for r in roughness], design)

    first, second = of(0.2, 0.5, 0.8), of(0.6, 0.15, 0.6)
    writes = [writes_of(frame) for frame in (first, second)]
    write = {name: np.concatenate([beats[name] for beats in writes]) for name in writes[0]}
    pixels, before = design.compute(spans, second), design.compute(spans, first)
    assert (pixels.color != before.color).any()
    shade(unit, spans, write, pixels)


def test_gate_by_threshold():
    """The gate decides as the model, for any T. There is no PROM."""
    p = HighlightGate(QuadraticInterpolator().gate_limits)
    unit = HighlightGateUnit(p, takes_threshold=True)
    assert cost_of(unit).rom_bits == 0
    assert unit.latency == HighlightGateUnit(p).latency
    rng = np.random.default_rng(3)
    decided = set()
    for threshold in (0, 1, 40_000, 110_000, 131_000, 2**17 - 1):
        halfway = np.repeat(sphere(rng, 1), 500, axis=0)
        cosine = np.full(500, (threshold * 2.0**-17) ** 0.5)
        left, right = map(quantise, spans_about(rng, halfway, cosine, rng.uniform(0, 40, 500), 0.01))
        vector = quantise(halfway[:1])
        expected = p.compute_by(*component_words(left, right, vector[0]), Fixed(p.level_format, threshold))
        run = simulate(
            unit,
            {"normal_left": left, "normal_right": right},
            count=500,
            constants={"halfway": vector, "threshold": threshold},
        )
        np.testing.assert_array_equal(run.beats, expected)
        decided |= set(expected.tolist())
    assert decided == {True, False}
    with pytest.raises(ValueError, match=r"^a gate with an exponent of its own takes no threshold$"):
        HighlightGateUnit(p, exponent=20, takes_threshold=True)


def test_rate_is_that_of_cosquad():
    """The latency is equal, too, except for registers of the shift, of the table and of the multiplier."""
    units = [ShadingPipelineUnit(preset("renormalise", model)) for model in ("blinn", "cosquad")]
    assert len({(unit.cycles_per_pixel, unit.setup_interval) for unit in units}) == 1
    assert units[0].latency == units[1].latency + 3
    assert units[0].cycles_per_pixel == 1
