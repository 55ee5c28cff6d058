"""Parts of other FPGAs that a design takes, by Yosys alone: ``blysk fpga --device``.

Nothing is placed, so there is no clock rate. Memories that a design writes have no initial zeros, as in the
emitted Verilog.
"""

import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from amaranth.back import rtlil
from amaranth.lib import wiring

from blysk.bench.tools.device_names import DEVICE_NAMES
from blysk.bench.tools.families import NEXUS
from blysk.bench.tools.place_and_route import MAP_AFTER, MAP_BEFORE, YOSYS
from blysk.bench.tools.tool_runner import ToolRunner
from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.emit.memories import without_zeros
from blysk.sim.cli.progress import progress
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra
from blysk.sim.output import write_json

__all__ = ["DEVICES", "Device", "count_cells", "map_devices", "parts", "table"]


@dataclass(frozen=True)
class Device:
    """A kind of FPGA, and the names of its cells in Yosys.

    Parameters
    ----------
    synthesis : str
        Yosys's command from a flat netlist to mapped cells.
    lut, carry, flip_flop, multiplier, block_ram, lut_ram : str
        Patterns of the counted kinds of cells.
    """

    synthesis: str
    lut: str
    carry: str
    flip_flop: str
    multiplier: str
    block_ram: str
    lut_ram: str


DEVICES = {
    "xc7": Device(
        "synth_xilinx -family xc7 -top top -flatten -noiopad -noclkbuf",
        lut="LUT[1-6]|SRL16E|SRLC32E",
        carry="CARRY4",
        flip_flop="FD[RSCP]+E(_1)?",
        multiplier="DSP48E1",
        block_ram="RAMB(18|36)E1",
        lut_ram=r"RAM\d+(X\d+[SD]|M|M16)(_1)?",
    ),
    "gowin": Device(
        "synth_gowin -family gw2a -top top -noiopads",
        lut="LUT[1-4]",
        carry="ALU",
        flip_flop="DFFN?[CPRS]?E?",
        multiplier="MULT(9X9|18X18|36X36)",
        block_ram="(SDP|DP|SP|pROM|SDPX9|DPX9|SPX9|pROMX9)B?|pROM(X9)?",
        lut_ram="RAM16SD?P?[124]",
    ),
    "nexus": Device(
        NEXUS.synthesis,
        lut="LUT4",
        carry="CCU2",
        flip_flop=NEXUS.flip_flop,
        multiplier=NEXUS.multiplier,
        block_ram=NEXUS.block_ram,
        lut_ram=NEXUS.distributed_ram,
    ),
    "cyclonev": Device(
        "synth_intel_alm -family cyclonev -top top -noiopad -noclkbuf",
        lut="MISTRAL_ALUT[2-6]|MISTRAL_NOT",
        carry="MISTRAL_ALUT_ARITH",
        flip_flop="MISTRAL_FF",
        multiplier="MISTRAL_MUL(9X9|18X18|27X27)",
        block_ram="MISTRAL_M10K",
        lut_ram="MISTRAL_MLAB",
    ),
    "ice40": Device(
        "synth_ice40 -dsp -top top",
        lut="SB_LUT4",
        carry="SB_CARRY",
        flip_flop="SB_DFF.*",
        multiplier="SB_MAC16",
        block_ram="SB_RAM40_4K.*",
        lut_ram="(?!)",
    ),
    "gatemate": Device(
        "synth_gatemate -top top -noiopad -noclkbuf",
        lut="CC_LUT[1-4]|CC_L2T[45]",
        carry="CC_ADDF",
        flip_flop="CC_DFF",
        multiplier="CC_MULT",
        block_ram="CC_BRAM_[24]0K",
        lut_ram="(?!)",
    ),
}
"""Devices by the names of `DEVICE_NAMES`."""

_PARTS = {
    "LUT": "lut",
    "carry": "carry",
    "FF": "flip_flop",
    "mult": "multiplier",
    "BRAM": "block_ram",
    "LUTRAM": "lut_ram",
}


def count_cells(component: wiring.Component, name: str, clocked: bool = False) -> Counter[str]:
    """Numbers of cells by kind, after Yosys has mapped a component to a device.

    Parameters
    ----------
    component : wiring.Component
        Component in the clock domain ``sync``. Its ports stay ports.
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
    if version_of("pyosys") is None:
        raise InputError("fpga", "pyosys is not installed", install_extra("fpga"))
    with clocked_reads(clocked):
        netlist = without_zeros(rtlil.convert(component, name="top", emit_src=False))
    script = MAP_BEFORE + DEVICES[name].synthesis + MAP_AFTER
    with tempfile.TemporaryDirectory(prefix="blysk-") as temporary:
        folder = Path(temporary)
        (folder / "top.il").write_text(netlist, encoding="utf-8")
        ToolRunner().run("Yosys", YOSYS, [], folder, script)
        mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
    return Counter(cell["type"] for cell in mapped["modules"]["top"]["cells"].values())


def parts(cells: Counter[str], name: str) -> dict[str, int]:
    """Numbers of the counted parts of a device, by the heads of the table."""
    patterns = {head: getattr(DEVICES[name], field) for head, field in _PARTS.items()}
    return {
        head: sum(count for kind, count in cells.items() if re.fullmatch(pattern, kind))
        for head, pattern in patterns.items()
    }


def table(rows: Sequence[tuple[str, str, dict[str, int]]]) -> str:
    """Aligned text: for each design and device the numbers of the parts."""
    lines = [("design", "device", *_PARTS)]
    lines += [(design, DEVICE_NAMES[name], *map(str, counts.values())) for design, name, counts in rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        " ".join(
            text.ljust(width) if k < 2 else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    )


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
        JSON file with the number of cells of every kind.

    Raises
    ------
    InputError, ToolError
        As `count_cells`.
    """
    rows: list[tuple[str, str, dict[str, int]]] = []
    kinds: list[dict[str, Any]] = []
    with progress(total=len(designs) * len(names), unit="netlists") as bar:
        for design, unit in designs:
            for name in names:
                cells = count_cells(unit(), name, clocked)
                rows.append((design, name, parts(cells, name)))
                kinds.append({"design": design, "device": name, **rows[-1][2], "cells": dict(cells)})
                bar.update()
    if figures:
        write_json(figures, {"tools": {"pyosys": version_of("pyosys")}, "designs": kinds})
    click.echo(table(rows))
