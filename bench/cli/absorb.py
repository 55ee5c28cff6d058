"""``blysk absorb``: registers into the multipliers and block RAMs of a netlist for ECP5."""

import json
from typing import Any

import click

from blysk.bench.tools.absorb_registers import Absorbed, absorb_registers
from blysk.sim.errors import InputError
from blysk.sim.output import check_writable, write_text
from blysk.sim.run_files import reads
from blysk.sim.value_types import OutputFile

__all__ = ["command"]

_REMEDY = "give a file that Yosys's write_json wrote"
_KINDS = {"TRELLIS_FF", "MULT18X18D", "DP16KD", "LUT4"}


def _read(path: str) -> dict[str, Any]:
    """The netlist in a file."""
    try:
        with open(reads(path), encoding="utf-8") as file:
            netlist = json.load(file)
    except OSError as error:
        raise InputError(path, f"cannot be opened ({error.strerror})", _REMEDY) from None
    except (ValueError, RecursionError):
        raise InputError(path, "is not JSON", _REMEDY) from None
    modules = netlist.get("modules") if isinstance(netlist, dict) else None
    if not isinstance(modules, dict) or not all(
        isinstance(module, dict)
        and all(isinstance(module.get(key, {}), dict) for key in ("cells", "ports", "attributes"))
        and all(isinstance(cell, dict) for cell in module.get("cells", {}).values())
        for module in modules.values()
    ):
        raise InputError(path, "is no netlist of Yosys", _REMEDY)
    return netlist


def _flag(module: dict[str, Any], name: str) -> bool:
    """Whether a module has an attribute other than 0."""
    return str(module.get("attributes", {}).get(name, "0")).strip("0") != ""


def _top(path: str, modules: dict[str, Any], name: str | None) -> str:
    """Name of the design's module, which must be flat and mapped to ECP5."""
    inside = {key: module for key, module in modules.items() if not _flag(module, "blackbox")}
    if name is not None and name not in inside:
        raise InputError(f"--top {name}", f"is no module of {path}", f"use one of {', '.join(inside)}")
    tops = [key for key, module in inside.items() if _flag(module, "top")]
    found = [name] if name is not None else tops or list(inside)
    if len(found) != 1:
        raise InputError(path, f"has {len(found)} modules and none is the top", "name the module by --top")
    kinds = {cell.get("type") for cell in modules[found[0]].get("cells", {}).values()}
    if hidden := sorted(kinds & inside.keys()):
        raise InputError(path, f"is not flat, it has the module {hidden[0]}", "call flatten in Yosys")
    if not kinds & _KINDS:
        raise InputError(
            path, f"the module {found[0]} has no cells of ECP5", "map it by synth_ecp5, without -noflatten"
        )
    return found[0]


def _told(found: Absorbed) -> str:
    """Counts as text."""
    return (
        f"{found.removed:,} flip-flops are removed: registers of {found.operands} operands and "
        f"{found.products} products are inside multipliers, and of {found.words} words inside block RAMs. "
        f"{found.inverters} look-up tables invert an enable; {found.carries} carries are cut off. "
        f"{found.tables} look-up tables are removed: they are inside adders."
    )


@click.command()
@click.argument("netlist", metavar="NETLIST.json")
@click.option("--top", help="Module of the design.  [default: the module that Yosys marks as the top]")
@click.option("-o", "--output", type=OutputFile(), required=True, help="JSON file for nextpnr.")
def command(netlist, top, output):
    """Move registers into the multipliers and block RAMs of your netlist for ECP5.

    Run it between Yosys and nextpnr. The netlist is flat, and mapped by synth_ecp5. Yosys leaves the
    registers beside a multiplier outside, and nextpnr does not move them. Look-up tables in front of adders
    move into the adders where they fit. The result does the same in each cycle. blysk fpga runs the same
    step. Multipliers and block RAMs with registers inside stay as they are.

    nextpnr does not time paths between registers on both sides of a multiplier. Do not clock a design with
    these paths above 250 MHz. docs/guide/fpga.md has the lines of ecp5.ys.

    \b
    Example:
        blysk verilog -o core.v
        yosys -s ecp5.ys
        blysk absorb core.json -o absorbed.json
        nextpnr-ecp5 --25k --json absorbed.json --out-of-context --lpf-allow-unconstrained
    """
    given = _read(netlist)
    check_writable(output)
    name = _top(netlist, given["modules"], top)
    try:
        changed, found = absorb_registers(given, name)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        raise InputError(netlist, f"the module {name} is no netlist of Yosys for ECP5", _REMEDY) from None
    write_text(output, json.dumps(changed))
    click.echo(_told(found))
    if found.closed:
        click.echo(
            f"{found.closed} multipliers have registers on both sides. nextpnr does not time the paths "
            "between these registers: do not clock the design above 250 MHz."
        )
