"""Pipelines as Verilog, in Icarus Verilog and in Verilator, against their twin, pixel by pixel, under stalls.

A frame of each in the long run, and a small one of a few in the quick one.
"""

import numpy as np
import pytest

from blysk.golden.frame_constants import writes_of
from blysk.golden.presets import METHODS, preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.testbench import pixel_beats, teapot_frame

from .verilog_bench import SIMULATORS, VerilogBench, assert_beats, missing_tool

PIPELINES = {
    **{method: (preset(method), "throughput") for method in METHODS},
    "compact": (preset("chord"), "compact"),
    "compact, normals and a power": (preset("linear", "blinn"), "compact"),
    "gate": (preset("chord", "exp", gate=True), "throughput"),
    "gate, compact": (preset("quadratic", "lyon3", gate=True), "compact"),
    "lights and materials": (
        preset("quadratic", "cosquad_lin", lights=3, materials=4, operand="one_minus_cosine"),
        "throughput",
    ),
    "exponent": (preset("chord", "coscos4", lights=2, exponent=60), "throughput"),
    "grey": (preset("chord", None, grey=True), "throughput"),
    "without lights": (preset(lights=0, materials=2), "throughput"),
}
QUICK = ("chord",)
FRAME = (640, 480), 10_000
"""Size of the picture, and triangles, of the long run."""


@pytest.fixture
def check(tmp_path):
    """Hold a pipeline's Verilog against its twin."""

    def check(name, simulator, *size, **options):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        design, style = PIPELINES[name]
        spans, constants, pixels = teapot_frame(design, *size)
        unit = ShadingPipelineUnit(design.built(style=style))
        rng = np.random.default_rng(2026)
        found = VerilogBench(unit, tmp_path, **options).run(
            simulator,
            beats_of(unit, spans),
            len(pixels.x),
            write=writes_of(constants),
            input_stalls=rng.random(997) < 0.3,
            output_stalls=rng.random(1009) < 0.3,
        )
        assert_beats(found.beats, pixel_beats(pixels))
        assert len(np.unique(pixels.color)) > 10 * min(design.lights, 1)
        assert (found.status["out_of_range_spans"], found.status["empty_spans"]) == (
            pixels.out_of_range_spans,
            1,
        )

    return check


@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize("name", QUICK)
def test_pipeline(check, name, simulator):
    check(name, simulator)


@pytest.mark.long
@pytest.mark.parametrize("simulator", SIMULATORS)
@pytest.mark.parametrize("name", PIPELINES)
def test_a_frame_of_every_pipeline(check, name, simulator):
    check(name, simulator, *FRAME, optimise=True)
