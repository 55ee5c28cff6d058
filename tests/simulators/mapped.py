"""Mapped ECP5 netlists of components, as Verilog for simulators and for proofs by Yosys."""

import json
import re
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.hdl import Value
from amaranth.lib.wiring import Component, Out

from blysk.bench.quality.equivalence import yosys
from blysk.bench.tools.families import ECP5
from blysk.bench.tools.place_and_route import MAP_AFTER, MAP_BEFORE

__all__ = ["cells", "connect", "core", "first", "map_component", "same", "swap", "verilog_of"]

_YOSYS_CELLS = ("LUT2", "LUT4", "PFUMX", "L6MUX21", "TRELLIS_FF", "TRELLIS_DPR16X4", "CCU2C")
"""Cells for which Yosys has models."""


def map_component(component: Component, folder: Path) -> dict[str, Any]:
    """Yosys's JSON of a component by itself, mapped to ECP5 as `place_and_route` maps it."""
    (folder / "top.il").write_text(rtlil.convert(component, name="top", emit_src=False))
    yosys(MAP_BEFORE + ECP5.synthesis + MAP_AFTER, folder)
    return json.loads((folder / "netlist.json").read_text())


def verilog_of(netlist: dict[str, Any], folder: Path) -> str:
    """Verilog of a netlist, with cells as instances."""
    top = netlist["modules"]["top"]
    cells = {name: {**cell, "connections": _connected(cell)} for name, cell in top["cells"].items()}
    modules = {"top": {**top, "cells": cells}}
    (folder / "mapped.json").write_text(json.dumps({**netlist, "modules": modules}))
    yosys("read_json mapped.json\nwrite_verilog -noattr mapped.v\n", folder)
    return (folder / "mapped.v").read_text()


def cells_of(*names: str) -> str:
    """Yosys's models of cells, without their delays."""
    lattice = Path(find_spec("pyosys").origin).parent / "share" / "lattice"
    library = "\n".join((lattice / file).read_text() for file in ("common_sim.vh", "ccu2c_sim.vh"))
    text = ""
    for name in names:
        (model,) = re.findall(rf"^module {name} ?\(.*?^endmodule$", library, re.DOTALL | re.MULTILINE)
        text += re.sub(r"^\s*specify$.*?^\s*endspecify$", "", model, flags=re.DOTALL | re.MULTILINE) + "\n"
    return text


def _ours() -> str:
    text = (Path(__file__).parent / "ecp5_cells.v").read_text()
    names = [f"INITVAL_{k:02X}" for k in range(64)]
    values = "\n".join(f"  parameter [319:0] {name} = 320'b0;" for name in names)
    return text.replace("@INITVALS@", values).replace("@INITIAL@", ", ".join(reversed(names)))


def cells() -> str:
    """Models of the cells: Yosys's, and ours where Yosys has black boxes."""
    return cells_of(*_YOSYS_CELLS) + _ours()


def first(cells: dict[str, Any], kind: str) -> dict[str, Any]:
    """The first cell of a kind, to be changed."""
    return next(cell for cell in cells.values() if cell["type"] == kind)


def swap(cell: dict[str, Any], one: str, other: str) -> None:
    pins = cell["connections"]
    pins[one], pins[other] = pins[other], pins[one]


def connect(cell: dict[str, Any], pin: str, bit: str) -> None:
    cell["connections"][pin] = [bit]


def core(component: Component, text: str) -> str:
    """Verilog of a module ``core`` for the bench, around the module ``top`` of a component."""
    ports = [("clk", 1, "input"), ("rst", 1, "input")]
    inner = ["clk", "rst"]
    for path, member, value in component.signature.flatten(component):
        name = "_".join(str(part) for part in path if part != "payload")
        ports.append((name, len(Value.cast(value)), "output" if member.flow is Out else "input"))
        inner.append("__".join(map(str, path)))
    listed = ", ".join(name for name, *_ in ports)
    declared = "".join(
        f"  {direction} {f'[{width - 1}:0] ' if width > 1 else ''}{name};\n"
        for name, width, direction in ports
        if width
    )
    joined = ", ".join(f".{port}({name})" for port, (name, *_) in zip(inner, ports, strict=True))
    return f"module core ({listed});\n{declared}  top whole ({joined});\nendmodule\n{text}{cells()}"


# Black boxes stand for the parts that the step does not change.
_PROOF = """\
read_json both.json
read_verilog models.v
read_verilog -lib -nowb -ignore_redef +/lattice/cells_sim_ecp5.v
setattr -unset keep */c:*
hierarchy -top top
proc
flatten
setattr -unset keep w:* c:*
opt_expr
opt_dff
opt_clean
simplemap t:$*dff*
opt -full -share_all
simplemap t:$not
dfflegalize -cell $_DFF_P_ 01 -cell $_DFFE_PP_ 01
opt_merge -share_all
opt_clean
write_json proof.json
"""


def same(before: dict[str, Any], after: dict[str, Any], folder: Path) -> str:
    """Whether two netlists do the same in every cycle; the result is the reason why not, or empty.

    Cells of the netlist ``after`` that are new or changed (multipliers, memories, look-up tables) are put
    beside the netlist ``before`` and read its nets. A memory is put there as a memory without register, and
    the register. A carry that was removed must have no reader. Adders that took look-up tables are compared
    row by row.

    Yosys then merges cells that have the same function, the same inputs and the same state at power-up. Each
    product of ``after`` must be merged with the net of ``before`` that it drives in ``after``. Then the nets
    of ``before`` satisfy every equation of ``after``, and these have only one solution.
    """
    old, new = before["modules"]["top"], after["modules"]["top"]
    if new["ports"] != old["ports"]:
        return "other ports"
    reads, drives = set(), []
    for port in new["ports"].values():
        (reads.update if port["direction"] == "output" else drives.extend)(port["bits"])
    for cell in new["cells"].values():
        for port, bits in cell["connections"].items():
            (reads.update if cell["port_directions"][port] == "input" else drives.extend)(bits)
    drives = [bit for bit in drives if isinstance(bit, int)]
    if len(drives) != len(set(drives)):
        return "a net with two drivers"
    if lacking := reads - set(drives) - {"0", "1", "x"}:
        return f"{len(lacking)} nets without a driver"
    fresh = 1 + max(bit for bit in (*reads, *drives, *_nets(old)) if isinstance(bit, int))
    cells, left, right, adders = dict(old["cells"]), [], [], 0
    for name, cell in new["cells"].items():
        if cell == old["cells"].get(name):
            continue
        if cell["type"] == "LUT4":
            if name in old["cells"]:
                return f"{name} is changed"
            cells[name] = cell
            continue
        if cell["type"] == "CCU2C" and _adds_the_same(cell, old["cells"][name], old["cells"]):
            adders += 1
            continue
        if cell["type"] not in ("MULT18X18D", "DP16KD"):
            return f"{name} is changed"
        connections = dict(cell["connections"])
        for port, (bit,) in cell["connections"].items():
            if cell["port_directions"][port] == "output":
                connections[port] = [fresh]
                if bit in reads:
                    left.append(bit)
                    right.append(fresh)
                fresh += 1
        cells[f"{name}$after"] = cell = {**cell, "connections": connections}
        if cell["type"] == "DP16KD":
            fresh = _take_registers_out(cells, f"{name}$after", old["cells"][name], fresh)
    if adders and not left:
        return ""
    outputs = {
        name: {"direction": "output", "bits": bits} for name, bits in (("left", left), ("right", right))
    }
    module = {**old, "cells": cells, "ports": {**old["ports"], **outputs}}
    (folder / "both.json").write_text(json.dumps({"creator": "", "modules": {"top": module}}))
    ours = _ours()
    memory, register = (ours.index(text) for text in ("// A memory of 1024", "// The register behind"))
    models = (
        cells_of("LUT4", "TRELLIS_FF") + ours[:memory] + ours[register : ours.index("// A port of a table")]
    )
    (folder / "models.v").write_text(models)
    yosys(_PROOF, folder)
    ports = json.loads((folder / "proof.json").read_text())["modules"]["top"]["ports"]
    left, right = (ports[name]["bits"] for name in ("left", "right"))
    differ = sum(a != b for a, b in zip(left, right, strict=True))
    return f"{differ} of {len(left)} nets are not shown to be equal" if differ or not left else ""


def _connected(cell: dict[str, Any]) -> dict[str, Any]:
    """Ports of a cell, without outputs that drive nothing."""
    directions = cell["port_directions"]
    given = cell["connections"].items()
    return {port: bits for port, bits in given if directions[port] != "output" or bits != ["x"]}


def _adds_the_same(cell: dict[str, Any], before: dict[str, Any], cells: dict[str, Any]) -> bool:
    """Whether a CCU2C adds the same as ``before``, which reads look-up tables among ``cells``.

    The carry to the next cell may be left open. Both bits are compared for all values at their inputs.
    """
    fixed = "CIN", "S0", "S1"
    if any(cell["connections"][port] != before["connections"][port] for port in fixed):
        return False
    if cell["connections"]["COUT"] not in (["x"], before["connections"]["COUT"]):
        return False
    tables = {c["connections"]["Z"][0]: c for c in cells.values() if c["type"] == "LUT4"}

    def value(net, known):
        if net in known:
            return known[net]
        table = tables[net]
        row = sum(value(table["connections"][pin][0], known) << k for k, pin in enumerate("ABCD"))
        return int(table["parameters"]["INIT"], 2) >> row & 1

    def both(of, k, known):
        # Whether a carry passes, and else the carry: two bits of Yosys's model.
        row = sum(value(of["connections"][f"{pin}{k}"][0], known) << n for n, pin in enumerate("ABCD"))
        rows = int(of["parameters"][f"INIT{k}"], 2)
        passes = rows >> row & 1
        return passes, passes or rows >> (row & 3) & 1

    for k in range(2):
        if cell["parameters"][f"INJECT1_{k}"] != "NO" or before["parameters"][f"INJECT1_{k}"] != "NO":
            return False
        nets = {cell["connections"][f"{pin}{k}"][0] for pin in "ABCD"} - {"0", "1"}
        for bits in product((0, 1), repeat=len(nets)):
            known = {"0": 0, "1": 1, **dict(zip(nets, bits, strict=True))}
            try:
                if both(cell, k, known) != both(before, k, known):
                    return False
            except KeyError:
                # The old bit reads a net that the new bit does not read.
                return False
    return True


def _take_registers_out(cells: dict[str, Any], name: str, before: dict[str, Any], fresh: int) -> int:
    """Put the registers of a memory's words behind the memory, as separate cells.

    The result is the next free net.
    """
    cell = cells[name]
    connections, parameters = dict(cell["connections"]), dict(cell["parameters"])
    wide = int(str(parameters["DATA_WIDTH_B"]), 2) == 36
    for port in "AB":
        if parameters[f"REGMODE_{port}"] != "OUTREG":
            continue
        outputs = {k: connections[f"DO{port}{k}"] for k in range(18)}
        for k in outputs:
            connections[f"DO{port}{k}"] = [fresh + k]
        pins = {
            "clk": connections["CLKB" if wide else f"CLK{port}"],
            "ce": connections[f"OCE{port}"],
            "rst": connections[f"RST{port}"],
            "d": list(range(fresh, fresh + 18)),
            "q": [bit for k in range(18) for bit in outputs[k]],
        }
        fresh += 18
        cells[f"{name}_{port}"] = {
            "hide_name": 0,
            "type": "ecp5_word",
            "parameters": {"REGMODE": "OUTREG"},
            "attributes": {},
            "port_directions": {pin: "output" if pin == "q" else "input" for pin in pins},
            "connections": pins,
        }
        # The values of the port's own pins without the register.
        parameters[f"REGMODE_{port}"] = before["parameters"][f"REGMODE_{port}"]
        connections[f"OCE{port}"] = before["connections"][f"OCE{port}"]
    cells[name] = {**cell, "connections": connections, "parameters": parameters}
    return fresh


def _nets(module: dict[str, Any]) -> set[Any]:
    return {bit for cell in module["cells"].values() for bits in cell["connections"].values() for bit in bits}
