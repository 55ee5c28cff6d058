# amaranth: UnusedElaboratable=no
"""Pipelines with an albedo: pixels of every variant, latency, and cycles as without an albedo."""

import re
from dataclasses import replace

import numpy as np
import pytest
from amaranth.back import rtlil

from blysk.bench.units.pipeline import RECORD, case_of
from blysk.bench.units.pipeline_spans import any_constants, any_spans
from blysk.bench.units.record import UnitRun
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.build import BuildError
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.outside_texels import PipelineWithTexels
from blysk.sim.frames.triangles import sample_triangles

from ..checks import assert_equals_model

QUICK = "albedo", "albedo, orthographic, compact, grey"
VARIANTS = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.long)
    for name in RECORD.variants
    if name.startswith("albedo")
]


@pytest.mark.parametrize("variant", VARIANTS)
def test_equals_model(variant):
    """Under stalls. The long run has more spans of each variant."""
    unit, rng = RECORD.variants[variant].unit(), np.random.default_rng(2)
    stalls = {name: rng.random(97) < 0.3 for name in ("input_stalls", "output_stalls")}
    case = RECORD.stimuli["spans"].make(unit, rng, 120)
    assert_equals_model(unit, UnitRun(case, RECORD.expect(unit, case), None, stalls), "pysim")


@pytest.mark.long
def test_texels_outside():
    """Answers of the memory come after random numbers of cycles, and the pixels are the same."""
    design = RECORD.variants["albedo, both, without lights, 2 materials"].unit().model
    texture = TextureSampler(TexelMemory(104, external=True))
    unit = PipelineWithTexels(replace(design, albedo=replace(design.albedo, texture=texture)))
    rng = np.random.default_rng(2)
    case = RECORD.stimuli["spans"].make(unit, rng, 120)
    assert_equals_model(unit, UnitRun(case, RECORD.expect(unit, case), None, {}), "pysim")


def test_texels_outside_are_refused_where_they_have_no_port():
    design = RECORD.variants["albedo, both, without lights, 2 materials"].unit().model
    outside = replace(design, albedo=replace(design.albedo, texture=TextureSampler(TexelMemory(8, True))))
    for option, value in (("pipes", 2), ("bus", "axi")):
        with pytest.raises(BuildError, match=rf"^{option}: only a single native core has texels out"):
            outside.built(**{option: value})
    with pytest.raises(ValueError, match=r"^albedo: hardware geometry needs its texels inside; leave out"):
        Renderer(outside)


def test_an_albedo_of_triangles_is_refused_where_geometry_does_not_serve_it():
    design = replace(preset("quotient"), albedo=Albedo())
    assert Renderer(design).geometry.surface == AttributeSpans()
    with pytest.raises(ValueError, match=r"^hardware geometry has no .* for method renormalise; use quot"):
        Renderer(replace(preset("renormalise"), albedo=Albedo()))
    with pytest.raises(ValueError, match=r"^albedo: hardware geometry gives 1/W of every pixel; leave out"):
        Renderer(replace(design, albedo=Albedo(perspective=False)))
    with pytest.raises(
        ValueError, match=r"^setups: vertex colours and textures take one lane .*; leave out setups"
    ):
        Renderer(design.built(top="render", setups=2))
    with pytest.raises(ValueError, match=r"^the geometry gives other attributes of the surface than"):
        Renderer(design, Geometry(vectors=True))
    with pytest.raises(ValueError, match=r"^the triangles have other attributes than the geometry"):
        Renderer(design).geometry.compute(sample_triangles(Renderer(), (8, 8)), FrameSettings.centred(8, 8))


def test_a_pipeline_without_albedo_has_nothing_of_it():
    """It has no port, no unit and no constant of an albedo. The baselines check its cells."""
    text = rtlil.convert(ShadingPipelineUnit(preset("linear", "cosquad")), name="top", emit_src=False)
    found = re.search(r"albedo|attributes|emission|texel|texture|tinted|colored|word_(8|9|1[0-5])\b", text)
    assert found is None


def cycles_of(unit, lengths):
    rng, design = np.random.default_rng(5), unit.model
    spans = any_spans(rng, design, np.asarray(lengths))
    case = case_of(unit, spans, any_constants(rng, design, spans))
    found = simulate(unit, case.beats, count=sum(lengths), engine="pysim", write=case.write)
    return found.input_cycles, found.cycles


def test_albedo_costs_no_cycle():
    """Spans follow each other as without an albedo.

    The first pixel comes later by the latency of the units.
    """
    lengths = [5, 40, *range(1, 12), *[1] * 30, 60, 1, 1, 2, 3]
    design = RECORD.variants["albedo"].unit().model
    units = ShadingPipelineUnit(preset("quotient")), ShadingPipelineUnit(design)
    (_, plain), (inputs, colored) = (cycles_of(unit, lengths) for unit in units)
    np.testing.assert_array_equal(np.diff(colored), np.diff(plain))
    assert colored[0] - inputs[0] == units[1].latency == units[0].latency + 3


def test_first_pixel_of_a_long_albedo_path():
    """Without lights no other path is as long as that of texture and product."""
    unit = RECORD.variants["albedo, both, without lights, 2 materials"].unit()
    inputs, cycles = cycles_of(unit, [3, 1, 40])
    assert cycles[0] - inputs[0] == unit.latency
    assert np.all(np.diff(cycles)[4:] == 1)
