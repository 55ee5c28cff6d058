# amaranth: UnusedElaboratable=no
"""Parts by unit: the unit to which each part counts, and that no part is lost."""

import json
from dataclasses import astuple, replace

import pytest
from amaranth.back import rtlil

from blysk.bench.tools import parts_by_unit as by_unit
from blysk.bench.tools.absorb_registers import Absorbed
from blysk.bench.tools.families import ECP5, Parts
from blysk.bench.tools.parts_by_unit import OTHERS, parts_by_unit, sum_parts, units_of
from blysk.bench.tools.place_and_route import Registered, map_cells, parts_of
from blysk.bench.tools.tool_runner import ToolRunner
from blysk.hdl.lighting.light import LightUnit
from blysk.sim.cli.main import main

from .stubs import REPORT, Counter
from .test_place_and_route import tools

_CELLS = {
    "unit.a.sum_CCU2C_S0": ("CCU2C", {}),
    "unit.a.b.word_TRELLIS_FF_Q": ("TRELLIS_FF", {"DI": [8], "Q": [9]}),
    "unit.a.b.datapath.word_LUT4_Z": ("LUT4", {}),
    "unit.a.b.c.d.memory.0.0": ("TRELLIS_DPR16X4", {}),
    "unit.a.bc_MULT18X18D": ("MULT18X18D", {}),
    "unit.word_LUT4_Z": ("LUT4", {}),
    "i__payload_TRELLIS_FF_Q": ("TRELLIS_FF", {"DI": [2], "Q": [3]}),
}


def test_cells_belong_to_the_innermost_unit_of_three_names(monkeypatch):
    """A register at a port is not counted. A signal's name is not taken for a unit's name."""
    paths = ("a", "a.b", "a.b.datapath", "a.b.c", "a.b.c.d", "empty")
    netlist = "".join(f"module \\top.unit.{path}\n" for path in paths)
    mapped = {
        "modules": {
            "top": {
                "ports": {"i": {"bits": [2]}},
                "cells": {name: {"type": kind, "connections": c} for name, (kind, c) in _CELLS.items()},
            }
        }
    }
    monkeypatch.setattr(by_unit.rtlil, "convert", lambda *_, **__: netlist)
    monkeypatch.setattr(by_unit, "map_cells", lambda *_: (mapped, Absorbed()))
    monkeypatch.setattr(by_unit, "versions_of", lambda _: {})
    assert units_of(netlist) == ["a", "a.b", "a.b.c", "empty"]
    assert parts_by_unit(Counter()) == {
        "a": Parts(2, 0, 1, 0, 0),
        "a.b": Parts(1, 1, 0, 0, 0),
        "a.b.c": Parts(6, 0, 0, 0, 1),
        OTHERS: Parts(1, 0, 0, 0, 0),
    }


@pytest.mark.ci
@pytest.mark.long
@tools
def test_units_have_all_parts_of_the_design(tmp_path):
    """Units of a light: its diffuse and specular units, and the parts between them."""
    found = parts_by_unit(LightUnit())
    assert {"diffuse", "specular"} < set(found)
    netlist = rtlil.convert(Registered(LightUnit()), name="top", emit_src=False)
    mapped, _ = map_cells(netlist, tmp_path, ToolRunner(), ECP5, absorb=True)
    whole, total = parts_of(mapped, REPORT), sum_parts(found)
    assert replace(total, luts=whole.luts) == whole
    assert whole.multipliers
    assert total.luts > max(parts.luts for parts in found.values()) > 0


@tools
def test_command(tmp_path, capsys):
    path = tmp_path / "units.json"
    assert main(["fpga", "--unit", "diffuse", "--by-unit", "--json", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["unit", "LUT", "FF", "mult", "BRAM", "LUTRAM"]
    units = json.loads(path.read_text())["units"]["diffuse"]
    total = sum_parts({unit: Parts(**parts) for unit, parts in units.items()})
    assert lines[-1].split() == ["diffuse", *map(str, astuple(total))]
