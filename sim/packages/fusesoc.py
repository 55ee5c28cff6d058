"""FuseSoC: a core file in CAPI2 with the Verilog, its documents and the test bench."""

import json
from string import Template

from blysk.sim.packages.package import Core
from blysk.sim.run_files import MARK

__all__ = ["files"]


_README = Template("""\
# $name for FuseSoC

<!-- $mark -->

The core goes from $title. In this folder:

    pip install fusesoc 'cocotb>=2.0'
    fusesoc core show blysk::$name
    fusesoc run --target=lint blysk::$name
    fusesoc run --target=sim blysk::$name                   # Icarus Verilog
    fusesoc run --target=sim blysk::$name --pauses 7        # other random pauses
    fusesoc run --target=verilator blysk::$name

Verilator and Icarus Verilog must be on the path. The targets `sim` and `verilator` send a small frame
through the core, and compare every beat with the expected beat. The last line must have `PASS=5 FAIL=0`.
cocotb 2.1 runs no test without this variable, which Edalize 0.6 does not set:

    export GPI_USERS="$$(cocotb-config --libpython);$$(cocotb-config --pygpi-entry-point)"
""")


_STATUS = '''\
"""The last test: FuseSoC sees a failed test only by the exit status of the simulator."""

import os

import cocotb
import test_core


@cocotb.test()
async def exit_status(dut):
    """End the simulator with status 1 if a run of `test_core` failed."""
    if len(test_core.PASSED) < len(test_core.PAUSES):
        print("a test failed", flush=True)
        os._exit(1)
'''


def files(core: Core) -> dict[str, str]:
    """Texts of the package, by path."""
    texts = {f"{core.name}.core": _core_file(core), f"rtl/{core.name}.v": core.verilog}
    texts |= {f"doc/{core.name}{suffix}": text for suffix, text in core.documents.items()}
    texts["README.md"] = _README.substitute(name=core.name, mark=MARK, title=core.title)
    bench = {path: text for path, text in core.bench.items() if path not in ("run.py", "README.md")}
    return texts | {f"bench/{path}": text for path, text in (bench | {"test_status.py": _STATUS}).items()}


def _core_file(core: Core) -> str:
    """Text of the core file. Strings are in JSON, which is YAML, too."""
    name = core.name
    documents = [f"doc/{name}{suffix}" for suffix in core.documents]
    vectors = [path for path in core.bench if path.startswith("vectors/")]
    lines = [
        "CAPI=2:",
        f"# {MARK}. README.md has the commands.",
        f"name: {json.dumps(f'blysk::{name}:{core.version}')}",
        f"description: {json.dumps(core.title)}",
        "",
        "filesets:",
        "  rtl:",
        "    files:",
        f"      - rtl/{name}.v",
        "    file_type: verilogSource-2001",
    ]
    if documents:
        lines += [
            "  documents:",
            "    files:",
            *(f"      - {path}" for path in documents),
            "    file_type: user",
        ]
    lines += [
        "  bench:",
        "    files:",
        *(f"      - bench/{name}: {{copyto: {name}}}" for name in ("test_core.py", "test_status.py")),
        *(f"      - bench/{path}: {{copyto: {path}}}" for path in vectors),
        "    file_type: user",
        "",
        "parameters:",
        "  pauses:",
        "    datatype: int",
        "    paramtype: plusarg",
        "    default: 1",
        "    description: Seed of the random pauses of the test",
        "",
        "targets:",
        "  default: &default",
        f"    filesets: [{', '.join(['rtl', *(['documents'] if documents else [])])}]",
        f"    toplevel: {json.dumps(name)}",
        "",
        "  lint:",
        "    <<: *default",
        "    description: Verilator, with every warning",
        "    flow: lint",
        "    flow_options:",
        "      tool: verilator",
        "      verilator_options: [-Wall]",
        "",
        "  sim: &sim",
        "    <<: *default",
        "    description: cocotb in Icarus Verilog, against the expected output of the bit-accurate model",
        "    flow: sim",
        "    flow_options:",
        "      tool: icarus",
        "      timescale: 1ns/1ps",
        "      cocotb_module: 'test_core,test_status'",
        "    filesets_append: [bench]",
        "    parameters: [pauses]",
        "",
        "  verilator:",
        "    <<: *sim",
        "    description: The same in Verilator",
        "    flow_options:",
        "      tool: verilator",
        "      cocotb_module: 'test_core,test_status'",
        "      verilator_options: [--timescale, 1ns/1ps, -Wno-fatal, --output-split, '0', -CFLAGS, -O0]",
    ]
    return "\n".join(lines) + "\n"
