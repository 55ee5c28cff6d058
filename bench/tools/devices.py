"""Parts of other FPGAs that a design takes, by Yosys alone: ``blysk fpga --device``.

Nothing is placed, so there is no clock rate. Memories that a design writes have no initial zeros, as in the
emitted Verilog. `python -m blysk.bench.report.placed` keeps the figures beside those of placed designs.
"""

import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from amaranth.back import rtlil
from amaranth.lib import wiring

from blysk.bench.tools.device_names import DEVICE_NAMES
from blysk.bench.tools.families import NEXUS
from blysk.bench.tools.fpga import aligned
from blysk.bench.tools.place_and_route import MAP_AFTER, MAP_BEFORE, YOSYS
from blysk.bench.tools.tool_runner import ToolRunner
from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.emit.memories import without_zeros
from blysk.sim.cli.progress import progress
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra
from blysk.sim.output import write_json

__all__ = ["DEVICES", "PARTS", "Device", "count_cells", "map_devices", "parts", "table"]


@dataclass(frozen=True)
class Device:
    """A kind of FPGA, and the names of its cells in Yosys.

    Parameters
    ----------
    synthesis : str
        Yosys's commands from a flat netlist to mapped cells.
    luts, carries, flip_flops, multipliers, block_rams, distributed_rams : str
        Patterns of the counted kinds of cells. A family without cells of a kind has a pattern that fits none.
    """

    synthesis: str
    luts: str
    carries: str
    flip_flops: str
    multipliers: str
    block_rams: str
    distributed_rams: str = "(?!)"


DEVICES = {
    "xc7": Device(
        "synth_xilinx -family xc7 -top top -flatten -noiopad -noclkbuf",
        luts="LUT[1-6]|SRL16E|SRLC32E",
        carries="CARRY4",
        flip_flops="FD[RSCP]+E(_1)?",
        multipliers="DSP48E1",
        block_rams="RAMB(18|36)E1",
        distributed_rams=r"RAM\d+(X\d+[SD]|M|M16)(_1)?",
    ),
    "gowin": Device(
        "synth_gowin -family gw2a -top top -noiopads",
        luts="LUT[1-4]",
        carries="ALU",
        flip_flops="DFFN?[CPRS]?E?",
        multipliers="MULT(9X9|18X18|36X36)",
        block_rams="(SDP|DP|SP)(X9)?B?|pROM(X9)?",
        distributed_rams="RAM16S(DP)?[124]",
    ),
    "nexus": Device(
        NEXUS.synthesis,
        luts="LUT4|WIDEFN9",
        carries="CCU2",
        flip_flops=NEXUS.flip_flop,
        multipliers=NEXUS.multiplier,
        block_rams=NEXUS.block_ram,
        distributed_rams=NEXUS.distributed_ram,
    ),
    "cyclonev": Device(
        "synth_intel_alm -family cyclonev -top top -noiopad -noclkbuf",
        luts="MISTRAL_ALUT[2-6]|MISTRAL_NOT",
        carries="MISTRAL_ALUT_ARITH",
        flip_flops="MISTRAL_FF",
        multipliers="MISTRAL_MUL(9X9|18X18|27X27)",
        block_rams="MISTRAL_M10K",
        distributed_rams="MISTRAL_MLAB",
    ),
    "ice40": Device(
        "synth_ice40 -dsp -top top",
        luts="SB_LUT4",
        carries="SB_CARRY",
        flip_flops="SB_DFF.*",
        multipliers="SB_MAC16",
        block_rams="SB_RAM40_4K.*",
    ),
    "gatemate": Device(
        "synth_gatemate -top top -noiopad -noclkbuf",
        luts="CC_LUT[1-4]|CC_L2T[45]",
        carries="CC_ADDF",
        flip_flops="CC_DFF",
        multipliers="CC_MULT",
        block_rams="CC_BRAM_[24]0K",
    ),
}
"""Devices by the names of `DEVICE_NAMES`."""

PARTS = {
    "LUT": "luts",
    "carry": "carries",
    "FF": "flip_flops",
    "mult": "multipliers",
    "BRAM": "block_rams",
    "LUTRAM": "distributed_rams",
    "other": "others",
}
"""Numbers of `parts` by the heads of the table."""


def count_cells(component: wiring.Component, name: str, clocked: bool = False) -> Counter[str]:
    """Numbers of cells by kind, after Yosys has mapped a component to a device.

    Parameters
    ----------
    component : wiring.Component
        Component in the clock domain ``sync``. Its ports stay ports, without pads.
    name : str
        One of `DEVICES`.
    clocked : bool
        Whether memories are read at clock edges, see `clocked_reads`.

    Raises
    ------
    InputError
        If pyosys is not installed.
    ToolError
        If Yosys fails.
    """
    _version()
    with clocked_reads(clocked):
        netlist = without_zeros(rtlil.convert(component, name="top", emit_src=False))
    script = MAP_BEFORE + DEVICES[name].synthesis + MAP_AFTER
    with tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        folder = Path(temporary)
        (folder / "top.il").write_text(netlist, encoding="utf-8")
        ToolRunner().run("Yosys", YOSYS, [], folder, script)
        mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
    return Counter(cell["type"] for cell in mapped["modules"]["top"]["cells"].values())


def _version() -> str:
    """Version of pyosys. `InputError` if it is not installed."""
    version = version_of("pyosys")
    if version is None:
        raise InputError("fpga", "pyosys is not installed", install_extra("fpga"))
    return version


def parts(cells: Mapping[str, int], name: str) -> dict[str, int]:
    """Numbers of the parts of a device, by the names of `PARTS`.

    A cell of a kind without a pattern is one of the ``others``. Yosys's notes about scopes are no cells.
    """
    patterns = {part: getattr(DEVICES[name], part) for part in PARTS.values() if part != "others"}
    found = dict.fromkeys(PARTS.values(), 0)
    for kind, count in cells.items():
        if kind != "$scopeinfo":
            fits = [part for part, pattern in patterns.items() if re.fullmatch(pattern, kind)]
            found[fits[0] if fits else "others"] += count
    return found


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Aligned text: for each design and device the numbers of the parts."""
    lines = [("design", "device", *PARTS)]
    lines += [(row["design"], row["device"], *(str(row[part]) for part in PARTS.values())) for row in rows]
    return aligned(lines, {0, 1})


def map_devices(
    designs: Sequence[tuple[str, Callable[[], wiring.Component]]],
    names: Sequence[str],
    clocked: bool,
    figures: str | None,
) -> None:
    """Map designs to devices, and print the table.

    Parameters
    ----------
    designs : sequence of (str, callable)
        Name of each design, and a function that makes it.
    names : sequence of str
        Some of `DEVICES`.
    clocked : bool
        As in `count_cells`.
    figures : str or None
        JSON file for the parts, and for the number of cells of each kind.

    Raises
    ------
    InputError, ToolError
        As `count_cells`.
    """
    tools = {"pyosys": _version()}
    rows: list[dict[str, Any]] = []
    with progress(total=len(designs) * len(names), unit="netlists") as bar:
        for design, unit in designs:
            for name in names:
                bar.set_description_str(f"{design}, {DEVICE_NAMES[name]}")
                cells = count_cells(unit(), name, clocked)
                row = {"design": design, "device": DEVICE_NAMES[name], **parts(cells, name)}
                rows.append({**row, "seeds": [], "cells": dict(sorted(cells.items()))})
                bar.update()
    if figures:
        write_json(figures, {"tools": tools, "designs": rows})
    click.echo(table(rows))
