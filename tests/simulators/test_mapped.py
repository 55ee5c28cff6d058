"""Mapped ECP5 netlists with registers inside multipliers and memories, against the bit-accurate models.

Models of cells are Yosys's and ours. The quick run has a unit, and faults that are injected into its netlist.
The long run has more units, and pipelines, whose netlists are proved to do the same as before the step. The
default pipeline shades a frame.
"""

import copy

import numpy as np
import pytest

from blysk.bench.tools.absorb_registers import absorb_registers
from blysk.bench.tools.place_and_route import tool_versions
from blysk.bench.units.record import length_of
from blysk.bench.units.registry import RECORDS
from blysk.golden.frame_constants import writes_of
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats, teapot_frame

from .mapped import connect, core, first, map_component, same, swap, verilog_of
from .verilog_bench import BenchError, VerilogBench, assert_beats, missing_tool, pauses

pytestmark = pytest.mark.skipif(
    tool_versions()["pyosys"] is None or bool(missing_tool("icarus")),
    reason="pyosys or Icarus is not installed",
)

BEATS = 300

UNITS = (
    ("dot_product", ""),
    ("light_products", "cosines, 2 lights, interval 3"),
    ("chord_setup", "interval 3"),
    ("intensity", "3 lights, compact"),
    ("quadratic_evaluator", "direct"),
    ("half_chord", "interval 4"),
)

READS = {"name": "lobe", "variant": "blinn", "beats": 1300}
"""A unit that writes a block RAM and reads it through the register inside.

There are more beats than table entries.
"""

DESIGNS = [preset(), preset("renormalise", "cosquad")]
"""The default design, and a design with other accumulators, roots and setup."""

FRAME = (20, 15), 64
"""Size and triangles. Icarus simulates about ten cycles a second of a mapped pipeline."""


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """A unit's netlist before the step, made once."""
    made = {}

    def mapped(name, variant):
        if (name, variant) not in made:
            unit = RECORDS[name].variants[variant].unit()
            made[name, variant] = map_component(unit, tmp_path_factory.mktemp("mapped"))
        return copy.deepcopy(made[name, variant])

    return mapped


@pytest.fixture
def check(tmp_path, mapped):
    """Make a check that compares a unit's netlist after the step, and after a change of its cells, with the
    unit's model."""

    def check(name, variant="", change=lambda cells: None, beats=BEATS):
        record, rng = RECORDS[name], np.random.default_rng(2026)
        unit = record.variants[variant].unit()
        case = next(iter(record.stimuli_of(variant).values())).make(unit, rng, beats)
        expected = record.expect(unit, case)
        netlist, absorbed = absorb_registers(mapped(name, variant))
        change(netlist["modules"]["top"]["cells"])
        bench = VerilogBench(unit, tmp_path, core(unit, verilog_of(netlist, tmp_path)), clean=False)
        sent = {"constants": case.constants, "write": case.write, **pauses(rng)}
        found = bench.run("icarus", case.beats, length_of(expected), **sent)
        assert_beats(found.beats, expected)
        return absorbed

    return check


@pytest.mark.parametrize(
    ("name", "variant"), [UNITS[0], *(pytest.param(*unit, marks=pytest.mark.long) for unit in UNITS[1:])]
)
def test_unit(check, name, variant):
    assert check(name, variant).products


@pytest.mark.ci
@pytest.mark.long
def test_unit_with_a_memory(check):
    absorbed = check(**READS)
    assert absorbed.words == absorbed.products == 1


FAULTS = {
    # A product is taken while the unit waits.
    "wrong enable": lambda cell: connect(cell, cell["parameters"]["REG_OUTPUT_CE"], "1"),
    "wrong operand bit": lambda cell: swap(cell, "A3", "A4"),
    "wrong product bit": lambda cell: swap(cell, "P20", "P21"),
    # A product is not held while the unit waits, and comes a cycle early.
    "no register": lambda cell: cell["parameters"].update(REG_OUTPUT_CLK="NONE"),
    "in reset": lambda cell: connect(cell, "RST0", "1"),
}


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_injected_faults_are_found(check, fault):
    with pytest.raises((AssertionError, BenchError)):
        check("dot_product", change=lambda cells: FAULTS[fault](first(cells, "MULT18X18D")))


MEMORY_FAULTS = {
    "half a word without register": lambda cell: cell["parameters"].update(REGMODE_A="NOREG"),
    "wrong word bit": lambda cell: swap(cell, "DOB4", "DOB5"),
}


@pytest.mark.long
@pytest.mark.parametrize("fault", MEMORY_FAULTS)
def test_faults_injected_in_a_memory_are_found(check, fault):
    with pytest.raises((AssertionError, BenchError)):
        check(**READS, change=lambda cells: MEMORY_FAULTS[fault](first(cells, "DP16KD")))


@pytest.mark.long
@pytest.mark.parametrize(
    "design", [pytest.param(of, id=f"{of.interpolator.name}-{of.specular.reflection.name}") for of in DESIGNS]
)
def test_a_frame_of_a_pipeline(design, tmp_path):
    """A proof shows that the netlist before the step does the same.

    The netlist of the default pipeline shades a frame.
    """
    unit = ShadingPipelineUnit(design)
    before = map_component(unit, tmp_path)
    netlist, absorbed = absorb_registers(before)
    assert absorbed.closed
    assert absorbed.words
    assert absorbed.removed
    assert same(before, netlist, tmp_path) == ""
    if design is not DESIGNS[0]:
        # The proof covers every cycle.
        return
    spans, constants, pixels = teapot_frame(design, *FRAME)
    found = VerilogBench(unit, tmp_path, core(unit, verilog_of(netlist, tmp_path)), clean=False).run(
        "icarus",
        beats_of(unit, spans),
        len(pixels.x),
        write=writes_of(constants),
        **pauses(np.random.default_rng(2026)),
    )
    assert_beats(found.beats, pixel_beats(pixels))
    assert len(np.unique(pixels.color)) > 10
