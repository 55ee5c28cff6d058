"""Parts of an FPGA that each unit of a design takes, from the netlist before placement."""

import re
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.lib import wiring

from blysk.bench.tools.families import ECP5, Family, Parts
from blysk.bench.tools.place_and_route import Registered, at_port, map_cells, ports_of, versions_of
from blysk.bench.tools.tool_runner import ToolRunner

__all__ = ["OTHERS", "parts_by_unit", "sum_parts", "units_of"]

OTHERS = "others"
"""Name of the parts that belong to the design itself and to no unit inside."""

_LUTS = {"LUT4": 1, r"CCU2C?": 2, r"(TRELLIS_)?DPR16X4": 6}
"""Look-up tables of a cell, by the pattern of its kind.

A cell of a memory takes four, and two more for its write port.
"""

_LEVELS = 3
"""Largest number of names in the path of a unit."""


def units_of(netlist: str) -> list[str]:
    """Paths of the units in a design, in the order of its netlist.

    Parameters
    ----------
    netlist : str
        RTLIL of a `Registered` component. A path has at most `_LEVELS` names. The datapath of a pipelined
        unit is a part of this unit.
    """
    found = re.findall(r"^module \\top\.unit\.(\S+)$", netlist, re.MULTILINE)
    return [path for path in found if path.count(".") < _LEVELS and path.split(".")[-1] != "datapath"]


def parts_by_unit(
    component: wiring.Component, family: Family = ECP5, absorb: bool = True
) -> dict[str, Parts]:
    """Parts of each unit of a component, by the unit's path.

    Parts of a unit inside another unit count only for the inner unit. Yosys maps the whole component, so
    units may share logic. Shared logic counts for the unit in the name of its cell. Look-up tables are
    counted before placement. nextpnr later adds some at the ends of carries.

    Parameters
    ----------
    component : wiring.Component
        Component in the clock domain ``sync``.
    family : Family
        Family of the device.
    absorb : bool
        As in `lay_out`.

    Raises
    ------
    InputError
        If a tool is not installed.
    ToolError
        If a tool fails.
    """
    versions_of(family)
    netlist = rtlil.convert(Registered(component), name="top", emit_src=False)
    with tempfile.TemporaryDirectory(prefix="blysk-") as folder:
        mapped, _ = map_cells(
            netlist, Path(folder), ToolRunner(), family, absorb and family.limit is not None
        )
    return _count(mapped, units_of(netlist), family)


def _count(mapped: Mapping[str, Any], units: Sequence[str], family: Family) -> dict[str, Parts]:
    ports, known, counts = ports_of(mapped), set(units), {}
    kinds = {
        "flip_flops": family.flip_flop,
        "multipliers": family.multiplier,
        "block_rams": family.block_ram,
        "distributed_rams": family.distributed_ram,
    }
    for name, cell in mapped["modules"]["top"]["cells"].items():
        if re.fullmatch(family.flip_flop, cell["type"]) and at_port(cell, ports):
            continue
        names = name.removeprefix("unit.").split(".")
        paths = (".".join(names[:size]) for size in range(min(_LEVELS, len(names)), 0, -1))
        parts = counts.setdefault(next((path for path in paths if path in known), OTHERS), Counter())
        parts["luts"] += sum(n for kind, n in _LUTS.items() if re.fullmatch(kind, cell["type"]))
        for part, pattern in kinds.items():
            parts[part] += bool(re.fullmatch(pattern, cell["type"]))
    return {
        unit: Parts(**{part: counts[unit][part] for part in ("luts", *kinds)})
        for unit in (*units, OTHERS)
        if unit in counts
    }


def sum_parts(parts: Mapping[str, Parts]) -> Parts:
    """Parts of all units together."""
    return Parts(*(sum(column) for column in zip(*map(astuple, parts.values()), strict=True)))
