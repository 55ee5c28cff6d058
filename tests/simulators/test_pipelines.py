"""Pipelines as Verilog, in Icarus Verilog and in Verilator, against the model, pixel by pixel, under stalls.

In the long run one of both simulators draws a frame with each pipeline. In the quick run one pipeline draws
a small frame.
"""

import numpy as np
import pytest

from blysk.bench.units.registry import RECORDS
from blysk.golden.frame_constants import writes_of
from blysk.hdl.emit.verilog import emit
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats, teapot_frame

from ..decided import digest_of
from .verilog_bench import SIMULATORS, VerilogBench, assert_beats, missing_tool, pauses

PIPELINES = {name: given.unit for name, given in RECORDS["pipeline"].variants.items() if not given.long}
QUICK = ("quotient, blinn",)
FRAMES = {"verilator": ((320, 240), 5000), "icarus": ((64, 48), 200)}
"""Size of the picture, and triangles, of the long run."""
VERILATED = (
    *("quotient, blinn", "renormalise, blinn", "chord-local", "3 lights", "compact", "gate, compact"),
    *("values, the second of 2 lights fades", "no specular light, grey, few bits"),
)
"""Pipelines that Verilator runs. Icarus runs the others. Both read the same text."""


@pytest.fixture
def check(tmp_path, decided, request):
    """Make a check that compares a pipeline's Verilog with its model.

    Runs that CI leaves out are run again if the text, the spans or the pixels change.
    """
    seldom = request.node.get_closest_marker("long") and not request.node.get_closest_marker("ci")

    def check(name, simulator, *size, **options):
        if missing_tool(simulator):
            pytest.skip(missing_tool(simulator))
        unit = PIPELINES[name]()
        design = unit.model
        spans, constants, pixels = teapot_frame(design, *size)
        text, beats, expected = emit(unit, "core"), beats_of(unit, spans), pixel_beats(pixels)
        sent = {"write": writes_of(constants), **pauses(np.random.default_rng(2026))}
        flags = (pixels.out_of_range_spans, 1)
        digest = digest_of("pipeline", simulator, text, beats, sent, expected, flags)
        if seldom and decided.knows(digest):
            return
        bench = VerilogBench(unit, tmp_path, text, **options)
        found = bench.run(simulator, beats, len(pixels.x), **sent)
        assert_beats(found.beats, expected)
        assert len(np.unique(pixels.color)) > 10 * min(design.lights, 1)
        assert (found.status["out_of_range_spans"], found.status["empty_spans"]) == flags
        if seldom:
            decided.add(digest)

    return check


@pytest.mark.parametrize("simulator", ["icarus", pytest.param("verilator", marks=pytest.mark.long)])
@pytest.mark.parametrize("name", QUICK)
def test_pipeline(check, name, simulator):
    check(name, simulator)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "simulator"),
    [
        (name, simulator)
        for name in PIPELINES
        for simulator in SIMULATORS
        if (simulator == "verilator") == (name in VERILATED)
    ],
)
def test_a_frame_of_every_pipeline(check, name, simulator):
    (width, height), triangles = FRAMES[simulator]
    design = PIPELINES[name]().model
    size = min(width, 1 << design.x_bits), min(height, 1 << design.y_bits)
    check(name, simulator, size, triangles, optimise=True)
