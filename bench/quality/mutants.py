"""Mutants: how many small faults in the hardware of every device its tests would find.

``python -m blysk.bench.quality.mutants [DEVICE ...]`` takes faults of a device at random (a bit of a cell
that is stuck, inverted, or inverted by a neighbour: Yosys' pass ``mutate``), and gives each the vectors of
the device's tests. These are the real ones: the tests run, and what they send through the unit is kept. A
mutant is killed if an output beat, or its clock, is not that of the unit; in a run without stalls the cycles
of the inputs count, too. Of the others, those are equivalent that no stimulus could tell from the unit, as
Yosys and ABC (package pyosys) prove; they count for nothing. The *score* is the share of the rest that is
killed. Clocks are not mutated, and reset stays low: tests and proofs of their own hold each unit to it.

All mutants are one compiled model, an input of which chooses. The exit status is 1 when a device's score is
less than `LEAST`, or a mutant survives that `mutants.json` gives no reason for; 2 for bad input.
"""

import contextlib
import ctypes
import functools
import hashlib
import inspect
import io
import itertools
import json
import re
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, is_dataclass, replace
from functools import partial
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click
import numpy as np
from amaranth.back import rtlil
from amaranth.hdl import Module, Mux, Value, unsigned
from amaranth.lib.wiring import Component, In, Member, Out
from amaranth.sim import Simulator
from tqdm import tqdm

from blysk.bench.command import run
from blysk.bench.store import Task, results_of, version_of
from blysk.bench.tools.blocks import BLOCKS
from blysk.bench.tools.fpga import _YOSYS, ToolError
from blysk.golden.presets import METHODS, preset
from blysk.hdl.pipeline import INTERPOLATORS, ShadingPipelineUnit
from blysk.sim.cli.main import Whole
from blysk.sim.engines import cxxrtl, pysim, simulate
from blysk.sim.engines.engine import CompilerMissing, Ports, Stimulus, Trace
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor, processors
from blysk.sim.output import check_writable, write_json

__all__ = [
    "DEVICES",
    "LEAST",
    "Device",
    "Score",
    "Wrapped",
    "main",
    "measure",
    "scores",
    "table",
    "vectors_of",
]

COUNT = 200
SEED = 7

LEAST = 0.95
"""Target: the least score of a device."""

_TESTS = Path(__file__).parents[2] / "tests"
_ARGUED = "mutants.json"
_SECONDS = 10
"""After which a proof that a mutant is equivalent is given up."""


@dataclass(frozen=True)
class Device:
    """What is mutated, and by what its faults are looked for.

    Parameters
    ----------
    name : str
        As in the device table.
    unit : callable
        Makes the unit that the tests drive.
    tests : tuple of str
        Files of ``tests/hdl``.
    within : str
        Submodule of the unit that is mutated, where it is not all of it.
    """

    name: str
    unit: Callable[[], Component]
    tests: tuple[str, ...]
    within: str = ""


def _devices() -> dict[str, Device]:
    """Every device that has tests of its own, as it is by default; interpolators inside their pipelines."""
    found: dict[str, Device] = {}
    methods = {name: INTERPOLATORS[type(p)].__module__.rpartition(".")[2] for name, p in METHODS.items()}
    blocks = {}
    for block in BLOCKS:
        if not _is_default(blocks.setdefault(block.device, block).unit) and _is_default(block.unit):
            blocks[block.device] = block
    for name, block in blocks.items():
        unit, module, within = block.unit, name, ""
        if methods.get(block.variant) == name and name != "local_chord_interpolator":
            unit = partial(ShadingPipelineUnit, preset(block.variant))
            module, within = "pipeline", "interpolator"
        else:
            unit = block.unit
            module = _class_of(unit).__module__.rpartition(".")[2]
        tests = [f"test_{stem}.py" for stem in dict.fromkeys((module, name))]
        found[name] = Device(
            name, unit, tuple(str(path) for t in tests for path in (_TESTS / "hdl").rglob(t)), within
        )
    return found


def _is_default(unit: Callable[[], Component]) -> bool:
    """Whether a unit is the one that its class makes without arguments."""
    if not isinstance(unit, partial):
        return True
    signature = inspect.signature(unit.func)
    for name, value in signature.bind(*unit.args, **unit.keywords).arguments.items():
        default = signature.parameters[name].default
        if value != (type(value)() if default is None and is_dataclass(value) else default):
            return False
    return True


def _class_of(unit: Callable[[], Component]) -> type:
    return unit.func if isinstance(unit, partial) else unit


DEVICES: dict[str, Device] = _devices()
"""Every device, by name, in the order of the device table."""


# The vectors of the tests.


class _Recorder:
    """Keeps what tests send through one unit, and skips those of other units and those without an engine.

    The compiled engine stands in for Amaranth's simulator, of which it is known to give the same.
    """

    def __init__(self, unit: Component):
        self._type, self._netlist = type(unit), rtlil.convert(unit, emit_src=False)
        self._known: dict[int, tuple[Component, bool]] = {}
        self.runs: list[tuple[Stimulus, Trace]] = []

    def _check(self, unit: Component) -> None:
        import pytest

        if id(unit) not in self._known:
            same = type(unit) is self._type and rtlil.convert(unit, emit_src=False) == self._netlist
            self._known[id(unit)] = unit, same
        if not self._known[id(unit)][1]:
            pytest.skip("another unit")

    @contextlib.contextmanager
    def watching(self) -> Iterator[None]:
        """Stand between tests and engines."""
        import pytest

        recorder, compiled, cache = self, simulate._compiled, str(cxxrtl.cache_folder())
        checking = pysim.Simulator

        class Watched:
            def __init__(self, component, vcd=None):
                recorder._check(component)
                # That of the tests is empty.
                with pytest.MonkeyPatch.context() as patch:
                    patch.setenv("BLYSK_CACHE", cache)
                    self._model = compiled(component)

            def run(self, stimulus, progress):
                trace = self._model.run(stimulus, progress)
                recorder.runs.append((stimulus, trace))
                return trace

        class Own(checking):
            """The simulator that a new model is compared with."""

        def initialise(simulator, *arguments, **options):
            if not isinstance(simulator, Own):
                pytest.skip("without an engine")
            make(simulator, *arguments, **options)

        make = Simulator.__init__
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(simulate, "_compiled", Watched)
            patch.setattr(simulate, "_interpreted", Watched)
            patch.setattr(pysim, "Simulator", Own)
            patch.setattr(Simulator, "__init__", initialise)
            yield


def _record(name: str) -> list[tuple[Stimulus, Trace]]:
    """Run the tests of a device, and keep what they send."""
    import pytest

    device = DEVICES[name]
    recorder = _Recorder(device.unit())
    files = list(device.tests)
    output = io.StringIO()
    with recorder.watching(), contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
        status = pytest.main(["--quiet", "-p", "no:cacheprovider", "-W", "ignore", *files])
    if status or not recorder.runs:
        lines = output.getvalue().strip().splitlines()
        raise ToolError(f"the tests of {name} fail or do not drive it: {lines[-1]}")
    return recorder.runs


def vectors_of(name: str) -> list[tuple[Stimulus, Trace]]:
    """What the tests of a device send through it, and what comes of it, shortest first.

    Parameters
    ----------
    name : str
        A key of `DEVICES`.

    Raises
    ------
    ToolError
        If a test fails, or none drives the unit.
    """
    # The tests may themselves be run by a test.
    with local_executor(1) as executor:
        runs = executor.submit(_record, name).result()
    return sorted(runs, key=lambda run: len(run[0].input))


# The mutants.


class Wrapped(Component):
    """A unit inside another component.

    Parameters
    ----------
    unit : Component
        The unit.
    **members : Member
        Members beside those of the unit, or in place of its ``status``.
    """

    def __init__(self, unit: Component, **members: Member):
        self.unit = unit
        super().__init__({**unit.signature.members, **members})

    def elaborate(self, platform) -> Module:
        """Connect the unit's members; the unit itself is for those to add who wrap it."""
        m = Module()
        for name, member in self.unit.signature.members.items():
            inner, outer = getattr(self.unit, name), getattr(self, name)
            if not member.is_port:
                source, sink = (inner, outer) if name == "o" else (outer, inner)
                m.d.comb += [
                    Value.cast(sink.payload).eq(Value.cast(source.payload)),
                    sink.valid.eq(source.valid),
                    source.ready.eq(sink.ready),
                ]
            elif member.flow is In:
                m.d.comb += Value.cast(inner).eq(Value.cast(outer))
            elif self.signature.members[name] == member:
                m.d.comb += Value.cast(outer).eq(Value.cast(inner))
        return m


class _Observed(Wrapped):
    """A unit, an input that chooses a mutant, and outputs that are 0 where no partner of a stream looks.

    A ``ready`` is seen while ``valid`` is high, a payload likewise. The cycles on which a unit's
    ``out_of_range`` is high are its status, as in a pipeline.

    Parameters
    ----------
    unit : Component
        The unit.
    width : int
        Bits of that input, ``mutant``.
    """

    def __init__(self, unit: Component, width: int):
        members = {"mutant": In(width)}
        if _flags(unit):
            members["status"] = Out(32)
        super().__init__(unit, **members)

    def elaborate(self, platform):
        """Add the unit."""
        m = super().elaborate(platform)
        m.submodules.unit = self.unit
        if _flags(self.unit):
            m.d.sync += self.status.eq(self.status + self.unit.out_of_range)
        payload = Value.cast(self.o.payload)
        m.d.comb += payload.eq(Mux(self.o.valid, Value.cast(self.unit.o.payload).as_unsigned(), 0))
        for name in ("i", "write"):
            if name in self.signature.members:
                outer = getattr(self, name)
                m.d.comb += outer.ready.eq(getattr(self.unit, name).ready & outer.valid)
        return m


def _flags(unit: Component) -> bool:
    """Whether a unit has a flag that no run of its own shows."""
    return "out_of_range" in unit.signature.members and "status" not in unit.signature.members


# Reset is held low, so that it goes.
_LIST = """\
read_rtlil top.il
hierarchy -auto-top
proc
flatten
delete -input w:rst
setundef -undriven -zero
opt_expr
opt_merge
zinit -all
opt_clean
write_rtlil flat.il
write_json flat.json
mutate -list {count} -seed {seed} -ctrl mutant {width} 1 -o list.txt c:*{cells}.*"""

# What has several drivers is split: a word whose bits depend on each other would be evaluated several times.
_MUTATE = """\
read_rtlil flat.il
script mutants.txt
setundef -zero -init
opt_clean
write_rtlil whole.il
splitnets -driver
write_rtlil mutated.il"""


def _yosys(script: str, folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _YOSYS], input=script, capture_output=True, encoding="utf-8", cwd=folder
    )
    if done.returncode:
        raise ToolError(f"Yosys failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}")


def _mutate(unit: Component, within: str, count: int, seed: int, folder: Path) -> dict[int, str]:
    """Write ``flat.il``, the unit, and ``whole.il`` and ``mutated.il``, with all its mutants.

    Returns what each is, by number.
    """
    width = count.bit_length()
    netlist = rtlil.convert(_Observed(unit, width), name="top", emit_src=False)
    (folder / "top.il").write_text(netlist)
    cells = ".*".join(part for part in ("unit", within) if part)
    _yosys(_LIST.format(count=count, seed=seed, width=width, cells=cells), folder)
    top = json.loads((folder / "flat.json").read_text())["modules"]["top"]
    behind = _registers_behind(top)
    kept, known = [], {}
    for number, text in enumerate((folder / "list.txt").read_text().splitlines(), 1):
        mutant = _described(text, top["cells"], behind)
        # Another clock is no small fault, and a table's words must be constant.
        if not re.search(r"^\w+ (\$meminit|\S+ [A-Z_]*CLK\[)", mutant):
            kept.append(text)
            known[number] = mutant
    (folder / "mutants.txt").write_text("\n".join(kept))
    _yosys(_MUTATE, folder)
    return known


def _described(command: str, cells: Mapping[str, Any], behind: Callable[[str], str]) -> str:
    """Name of a mutant that does not depend on the netlist's numbers."""
    found = re.search(r"-mode (\S+) .*-cell (\S+) -port (\S+) -portbit (\d+)(?: -ctrlbit (\d+))?", command)
    mode, cell, port, bit, by = found.groups()
    cell = cell.removeprefix("\\")
    return f"{mode} {cells[cell]['type']} {port}[{bit}]{f' by [{by}]' if by else ''} -> {behind(cell)}"


def _registers_behind(module: Mapping[str, Any]) -> Callable[[str], str]:
    """Name, by a cell's name, of the first register or output that its results come to."""
    cells, readers, names = module["cells"], defaultdict(list), {}
    for name, net in sorted(module["netnames"].items(), key=lambda item: item[1]["hide_name"]):
        names.update({bit: name for bit in net["bits"] if bit not in names})
    for name, cell in cells.items():
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                for bit in bits:
                    readers[bit].append(name)
    ports = {
        bit for port in module["ports"].values() if port["direction"] == "output" for bit in port["bits"]
    }

    def behind(start: str) -> str:
        seen, open_ = {start}, [start]
        for name in open_:
            cell = cells[name]
            outputs = [p for p, direction in cell["port_directions"].items() if direction == "output"]
            bits = [bit for port in outputs for bit in cell["connections"][port]]
            shown = bits if cell["type"] == "$dff" else [bit for bit in bits if bit in ports]
            if shown:
                return names[shown[0]]
            following = [reader for bit in bits for reader in readers[bit] if reader not in seen]
            seen.update(following)
            open_ += dict.fromkeys(following)
        return "nothing"

    return behind


class _Mutants(cxxrtl.Model):
    """All mutants of a unit, compiled."""

    def __init__(self, unit: Component, folder: Path):
        self.ports = Ports(unit)
        if _flags(unit):
            self.ports.status = unsigned(32)
        source = resources.files(__package__).joinpath("mutants.cc").read_text(encoding="utf-8")
        driver = cxxrtl._members(self.ports) + cxxrtl._source("cxxrtl_driver.cc") + source
        compiler = next(cxxrtl.find_compilers(), None)
        if compiler is None:
            raise CompilerMissing("no C++ compiler")
        # Compiling takes longer than running.
        compiler = replace(compiler, compile=(*compiler.compile, "-O1"))
        failure = cxxrtl._build((folder / "mutated.il").read_text(), driver, compiler, "mutants", folder)
        if failure:
            raise ToolError(failure)
        self._library = library = cxxrtl._load(folder / "model", "mutants")
        library.blysk_open_mutant.restype = ctypes.c_void_p
        library.blysk_open = library.blysk_open_mutant

    def choose(self, mutant: int) -> None:
        """Which mutant runs from now on; 0 for the unit."""
        ctypes.c_uint64.in_dll(self._library, "blysk_mutant").value = mutant

    def trace(self, stimulus: Stimulus) -> Trace:
        """A run of so many cycles as the stimulus says."""
        return self._run(stimulus, None)


def _killed(model: _Mutants, vectors: Sequence[tuple[Stimulus, Trace]], mutants: Iterable[int]) -> set[int]:
    """Those of the mutants that the vectors kill."""
    alive = set(mutants)
    for stimulus, trace in vectors:
        model.choose(0)
        found = model.trace(stimulus)
        if difference := found.differs(trace if trace.status.size else replace(trace, status=found.status)):
            raise ToolError(f"the unit among its mutants is not the unit: {difference} differs")
        limited = replace(stimulus, limit=trace.clock)
        expected = _seen(limited, model.trace(limited))
        for mutant in sorted(alive):
            model.choose(mutant)
            if not all(map(np.array_equal, _seen(limited, model.trace(limited)), expected)):
                alive.remove(mutant)
    return set(mutants) - alive


def _seen(stimulus: Stimulus, trace: Trace) -> tuple:
    """What a test sees of a run. Clocks of the inputs follow from those of the outputs, but under stalls."""
    free = not (stimulus.input_stalls.any() or stimulus.output_stalls.any())
    cycles = (trace.input_cycles,) if free else ()
    return trace.end, trace.clock, trace.output, trace.cycles, trace.status, *cycles


# Equivalence.

_AIGER = """\
read_rtlil whole.il
memory_collect
memory_map
async2sync
dffunmap
opt_expr
opt_merge
opt_clean
setundef -undriven -zero
zinit -all
techmap
aigmap
write_aiger -zinit -map unit.map unit.aig"""

_ROUNDS = 20
_NARROW = 12


def _numbers(data: bytes) -> Iterator[int]:
    """Those of AIGER's binary format: seven bits a byte, lowest first, and whether there are more."""
    value = shift = 0
    for byte in data:
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            yield value
            value = shift = 0


def _coded(number: int) -> bytes:
    code = bytearray()
    while number > 127:
        code.append(number & 127 | 128)
        number >>= 7
    return bytes([*code, number])


class _Miter:
    """A unit and a mutant of it, and whether any output ever differs: AND gates and one-bit registers.

    Products are too much for a proof. So first, the two share their registers, and what either would put into
    them must be the same: if so, they stay the same by induction. Those that are narrow, or tell where beats
    are, go on as in the unit, for these control; the others are inputs: whatever they hold. Not shared are
    the mutant's own, and those bits that do differ.

    Parameters
    ----------
    folder : path
        With the netlist of all mutants that `_mutate` wrote; without any, it is the unit.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        _yosys(_AIGER, folder)
        header, rest = (folder / "unit.aig").read_bytes().split(b"\n", 1)
        self._inputs, latches, outputs, gates = map(int, header.split()[2:6])
        *lines, rest = rest.split(b"\n", latches + outputs)
        literals = [int(line.split()[0]) for line in lines]
        self._next, self._outputs = literals[:latches], literals[latches:]
        deltas = list(itertools.islice(_numbers(rest), 2 * gates))
        first = 2 * (1 + self._inputs + latches)
        left = [first + 2 * k - delta for k, delta in enumerate(deltas[::2])]
        self._gates = [(a, a - delta) for a, delta in zip(left, deltas[1::2], strict=True)]
        named = re.findall(r"^(input|latch) (\d+) (\d+) (\S+)$", (folder / "unit.map").read_text(), re.M)
        self._mutant = {
            int(i): int(bit) for kind, i, bit, name in named if (kind, name) == ("input", "mutant")
        }
        widths = Counter(name for kind, _, _, name in named if kind == "latch")
        self._names, self._free = defaultdict(set), set()
        for kind, index, _, name in named:
            if kind == "latch":
                self._names[int(index)].add(name)
                if widths[name] > _NARROW and not re.search(r"\b(ages|valid)$", name):
                    self._free.add(int(index))

    def is_equivalent(self, mutant: int, register: str = "") -> bool:
        """Whether a mutant, of whatever comes to a register, is proved to do what the unit does."""
        shared = set(range(len(self._next)))
        # What changes nothing is seen before a register is taken apart, and then hardly.
        if not self._write(mutant, shared):
            return True
        if register:
            whole = re.compile(re.escape(register) + r"(\W|$)")
            shared = {latch for latch in shared if not any(map(whole.match, self._names[latch]))}
        for _ in range(_ROUNDS):
            proved, differing = self._prove(mutant, shared)
            if proved or not differing:
                return proved
            shared -= differing
        return False

    def _prove(self, mutant: int, shared: Set[int]) -> tuple[bool, set[int]]:
        """Whether nothing differs while registers are ``shared``, and which of them do."""
        compared = self._write(mutant, shared)
        if not compared:
            return True, set()
        script = f"read_aiger mutant.aig; strash; scleanup; scorr; pdr -a -v -T {_SECONDS}"
        abc = Path(find_spec("pyosys").origin).parent / "yosys-abc"
        try:
            done = subprocess.run(
                [abc, "-c", script],
                capture_output=True,
                encoding="utf-8",
                cwd=self._folder,
                timeout=6 * _SECONDS,
            )
        except subprocess.TimeoutExpired:
            return False, set()
        found = re.search(r"Properties: +All = (\d+). +Proved = (\d+)", done.stdout)
        if done.returncode or found is None:
            raise ToolError(f"ABC failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
        asserted = (int(k) for k in re.findall(r"Output +(\d+) was (?:trivially )?asserted", done.stdout))
        return found[1] == found[2], {compared[k] for k in asserted} - {-1}

    def _write(self, mutant: int, shared: Set[int]) -> list[int]:
        """Write ``mutant.aig``; of each of its outputs, the register that it compares, or -1."""
        known, gates = {}, []
        places = itertools.count(1 + self._inputs)
        units = [[0, *range(2, 2 * self._inputs + 2, 2)] for _ in range(2)]
        for latch in range(len(self._next)):
            literal = 2 * next(places)
            units[0].append(literal)
            units[1].append(literal if latch in shared else 2 * next(places))
        first = next(places)

        def both(a: int, b: int) -> int:
            a, b = max(a, b), min(a, b)
            if b < 2 or a ^ b < 2:
                return a * b if b < 2 else b * (a == b)
            if (a, b) not in known:
                known[a, b] = 2 * (first + len(gates))
                gates.append((a, b))
            return known[a, b]

        for unit, chosen in zip(units, (0, mutant), strict=True):
            for place, bit in self._mutant.items():
                unit[1 + place] = chosen >> bit & 1
            for a, b in self._gates:
                unit.append(both(unit[a >> 1] ^ a & 1, unit[b >> 1] ^ b & 1))
        outputs, compared, following = [], [], {}
        for latch, end in [*((-1, end) for end in self._outputs), *enumerate(self._next)]:
            a, b = (unit[end >> 1] ^ end & 1 for unit in units)
            if latch >= 0 and not (latch in shared and latch in self._free):
                now = (unit[1 + self._inputs + latch] >> 1 for unit in units)
                # Of a register that is shared the unit's comes last.
                following |= dict(zip(now, (a, a if latch in shared else b), strict=True))
            if a != b and (latch < 0 or latch in shared):
                outputs.append(both(both(a, b) ^ 1, both(a ^ 1, b ^ 1) ^ 1))
                compared.append(latch)
        # What these depend on, through the registers.
        needed, open_ = {0}, [end >> 1 for end in outputs]
        while open_:
            node = open_.pop()
            if node not in needed:
                needed.add(node)
                ends = gates[node - first] if node >= first else (following.get(node, 0),)
                open_ += [end >> 1 for end in ends]
        order = sorted(needed, key=lambda node: (node >= first, node in following, node))
        place = {node: k for k, node in enumerate(order)}

        def new(literal: int) -> int:
            return 2 * place[literal >> 1] ^ literal & 1

        latches = [node for node in order if node in following]
        codes = []
        for node in order:
            if node >= first:
                b, a = sorted(map(new, gates[node - first]))
                codes.append(_coded(2 * place[node] - a) + _coded(a - b))
        inputs = len(order) - 1 - len(latches) - len(codes)
        lines = [f"aig {len(order) - 1} {inputs} {len(latches)} {len(outputs)} {len(codes)}"]
        lines += map(str, [*(new(following[node]) for node in latches), *map(new, outputs), ""])
        (self._folder / "mutant.aig").write_bytes("\n".join(lines).encode() + b"".join(codes))
        return compared


# The scores.


@dataclass(frozen=True)
class Score:
    """What became of the mutants of a device.

    Parameters
    ----------
    device : str
        Its name.
    mutants : int
        How many there were.
    equivalent : tuple of str
        Those that are proved to do what the device does.
    survived : tuple of str
        Those that are neither killed nor proved equivalent.
    """

    device: str
    mutants: int
    equivalent: tuple[str, ...]
    survived: tuple[str, ...]

    @property
    def killed(self) -> int:
        """How many the vectors kill."""
        return self.mutants - len(self.equivalent) - len(self.survived)

    @property
    def score(self) -> float:
        """Share of those that are not equivalent that is killed; 1 without any."""
        return self.killed / max(1, self.mutants - len(self.equivalent)) if self.survived else 1.0

    @property
    def open(self) -> tuple[str, ...]:
        """Survivors that the list gives no reason for."""
        return tuple(mutant for mutant in self.survived if mutant not in _argued().get(self.device, {}))


@functools.cache
def _argued() -> dict[str, dict[str, str]]:
    """Reasons why mutants may survive, by device and mutant."""
    return json.loads(resources.files(__package__).joinpath(_ARGUED).read_text(encoding="utf-8"))


def measure(device: str, count: int, seed: int, tests: str) -> dict[str, Any]:
    """Make mutants of a device and run its tests' vectors on them.

    Parameters
    ----------
    device : str
        A key of `DEVICES`.
    count, seed : int
        How many mutants, and the seed of their choice.
    tests : str
        Hash of the tests, which the vectors depend on.

    Returns
    -------
    dict
        The fields of a `Score`.

    Raises
    ------
    ToolError
        If a tool or a test fails, or the unit among its mutants is not the unit.
    """
    chosen = DEVICES[device]
    vectors = vectors_of(device)
    with tempfile.TemporaryDirectory(prefix="blysk-") as name:
        folder = Path(name)
        unit = chosen.unit()
        mutants = _mutate(unit, chosen.within, count, seed, folder)
        model = _Mutants(unit, folder)
        alive = sorted(set(mutants) - _killed(model, vectors, mutants))
        miter = _Miter(folder) if alive else None
        verdicts = {k: miter.is_equivalent(k, mutants[k].rpartition(" ")[2]) for k in alive}
    return {
        "device": device,
        "mutants": len(mutants),
        "equivalent": [mutants[k] for k, same in verdicts.items() if same],
        "survived": [mutants[k] for k, same in verdicts.items() if not same],
    }


def scores(
    devices: Sequence[str],
    count: int = COUNT,
    seed: int = SEED,
    executor: Executor | None = None,
    progress: Callable[[], object] = lambda: None,
) -> list[Score]:
    """Scores of devices, in their order; those that are known are not measured again.

    Parameters
    ----------
    devices : sequence of str
        Keys of `DEVICES`.
    count, seed : int
        As for `measure`.
    executor, progress
        As for `results_of`.
    """
    tasks = []
    shared = [path for path in sorted((_TESTS / "hdl").glob("*.py")) if not path.name.startswith("test_")]
    for device in devices:
        files = [_TESTS / "conftest.py", *shared, *map(Path, DEVICES[device].tests)]
        tests = hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()
        tasks.append(Task(measure, {"device": device, "count": count, "seed": seed, "tests": tests}))
    return [
        Score(r["device"], r["mutants"], tuple(r["equivalent"]), tuple(r["survived"]))
        for r in results_of(tasks, executor, progress)
    ]


def table(rows: Sequence[Score]) -> str:
    """Table in Markdown."""
    lines = [
        "| device | mutants | equivalent | killed | survived | score |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row.device} | {row.mutants} | {len(row.equivalent)} | {row.killed} | {len(row.survived)} "
        f"| {row.score:.1%} |"
        for row in rows
    ]
    return "\n".join(lines)


@click.command()
@click.argument("devices", nargs=-1, metavar="[DEVICE ...]")
@click.option(
    "--count", type=click.IntRange(1, 10_000), default=COUNT, show_default=True, help="Mutants a device."
)
@click.option("--seed", default=SEED, show_default=True, help="Of their choice.")
@click.option("--jobs", type=Whole(1, 64), default=processors, help="Processes.  [default: processors]")
@click.option("--json", "figures", type=click.Path(), help="File for every figure.")
def _command(devices, count, seed, jobs, figures) -> int:
    """Break every device, or those named, in small ways, and tell how many of them its tests find."""
    unknown = [device for device in devices if device not in DEVICES]
    if unknown:
        raise InputError(unknown[0], "is no device", f"choose from {', '.join(DEVICES)}")
    missing = [package for package in ("pyosys", "pytest") if version_of(package) is None]
    if missing:
        raise InputError("mutants", f"without {' and '.join(missing)}", "pip install 'blysk[test]'")
    if not _TESTS.exists():
        raise InputError("mutants", f"there are no tests in {_TESTS}", "run it in the project's own folder")
    if figures:
        check_writable(figures)
    names = devices or tuple(DEVICES)
    with (
        local_executor(jobs) as executor,
        tqdm(total=len(names), unit=" devices", leave=False, disable=None) as bar,
    ):
        rows = scores(names, count, seed, executor, bar.update)
    if figures:
        write_json(figures, [asdict(row) | {"killed": row.killed, "score": row.score} for row in rows])
    click.echo(table(rows))
    for row in rows:
        for mutant in row.open:
            click.echo(f"survived without a reason: {row.device}: {mutant}", err=True)
    return 1 if any(row.score < LEAST or row.open for row in rows) else 0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, and judge.

    Returns
    -------
    int
        0; 1 when a score is less than `LEAST`, a mutant survives without a reason or a tool fails, 2 for bad
        input, told in one line.
    """
    return run(_command, "blysk.bench.quality.mutants", arguments)


if __name__ == "__main__":
    sys.exit(main())
