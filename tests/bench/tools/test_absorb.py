"""``blysk absorb``: a netlist of a file, and files that are refused."""

import copy
import json

import pytest

from blysk.bench.tools.absorb_registers import absorb_registers
from blysk.sim.cli.main import main


def multiplied(inside="NONE"):
    """A multiplier of registers, with a register behind it; ``inside``: the clock of its own register."""
    pins = {f"{name}{k}": [100 * n + k] for n, (name, bits) in enumerate((("A", 18), ("B", 18), ("P", 36)), 1)
            for k in range(bits)}  # fmt: skip
    cells = {
        "m": {
            "type": "MULT18X18D",
            "parameters": {"REG_OUTPUT_CLK": inside},
            "attributes": {},
            "port_directions": {pin: "output" if pin[0] == "P" else "input" for pin in pins},
            "connections": pins,
        }
    }
    ways = {"CLK": "input", "DI": "input", "Q": "output", "CE": "input", "LSR": "input"}
    for k in range(72):
        place = 100 + k if k < 18 else 182 + k if k < 36 else 264 + k
        given, made = (1000 + k, place) if k < 36 else (place, 1000 + k)
        cells[f"f{k}"] = {
            "type": "TRELLIS_FF",
            "parameters": {"CEMUX": "1", "REGSET": "RESET"},
            "attributes": {},
            "port_directions": ways,
            "connections": {"CLK": [2], "DI": [given], "Q": [made], "CE": ["1"], "LSR": ["0"]},
        }
    ports = {"clk": {"direction": "input", "bits": [2]}}
    return {"modules": {"core": {"attributes": {"top": "1"}, "ports": ports, "cells": cells}}}


def test_file(tmp_path, monkeypatch, capsys):
    """The file has the result of the function, and a second run moves nothing."""
    monkeypatch.chdir(tmp_path)
    given = multiplied()
    (tmp_path / "core.json").write_text(json.dumps(given))
    assert main(["absorb", "core.json", "-o", "out.json"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("72 flip-flops are removed: registers of 2 operands and 1 products")
    assert "1 multipliers have registers on both sides" in told
    made = json.loads((tmp_path / "out.json").read_text())
    assert made == absorb_registers(given, "core")[0]
    assert list(made["modules"]["core"]["cells"]) == ["m"]
    assert main(["absorb", "out.json", "-o", "again.json"]) == 0
    assert capsys.readouterr().out.startswith("0 flip-flops are removed")
    assert json.loads((tmp_path / "again.json").read_text()) == made


def test_registers_inside_already_stay():
    given = multiplied("CLK1")
    assert absorb_registers(given, "core")[0] == given


def broken(change):
    """Text of a netlist after a change of its module."""
    given = copy.deepcopy(multiplied())
    change(given["modules"])
    return json.dumps(given)


@pytest.mark.parametrize(
    ("text", "arguments", "line"),
    [
        (None, [], "core.json: cannot be opened (No such file or directory); give a file that Yosys's"),
        ("module top;", [], "core.json: is not JSON; give a file that Yosys's write_json wrote"),
        ("[1]", [], "core.json: is no netlist of Yosys; give"),
        ('{"modules": {"core": 3}}', [], "core.json: is no netlist of Yosys; give"),
        ('{"modules": {}}', [], "core.json: has 0 modules and none is the top; name the module by --top"),
        ("whole", ["--top", "x"], "--top x: is no module of core.json; use one of core"),
        (broken(lambda of: of.update(m={"cells": {"a": {"type": "core"}}}, core={})), ["--top", "m"],
         "core.json: is not flat, it has the module core; call flatten in Yosys"),
        (broken(lambda of: of["core"].update(cells={"a": {"type": "SB_LUT4"}})), [],
         "core.json: the module core has no cells of ECP5; map it by synth_ecp5"),
        (broken(lambda of: of["core"]["cells"]["m"].pop("type")), [],
         "core.json: the module core is no netlist of Yosys for ECP5; give"),
        (broken(lambda of: of["core"].update(cells={"a": 3})), [], "core.json: is no netlist of Yosys; give"),
        ("whole", ["-o", "core.json"], "core.json: is a file that this run reads; choose another file"),
    ],
)  # fmt: skip
def test_bad_input_is_one_line(text, arguments, line, refused, tmp_path):
    if text is not None:
        (tmp_path / "core.json").write_text(json.dumps(multiplied()) if text == "whole" else text)
    refused(
        "absorb", "core.json", *(["-o", "out.json"] if "-o" not in arguments else []), *arguments, line=line
    )
