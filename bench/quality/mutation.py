"""Mutants of a unit: small faults in its netlist, all in one compiled model, and the stimuli to find them."""

import ctypes
import json
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import reduce
from importlib import resources
from itertools import product
from operator import xor
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.back import rtlil
from amaranth.hdl import Fragment, Module, Mux, Value, unsigned
from amaranth.lib.wiring import Component, In, Member, Out

from blysk.bench.quality.equivalence import yosys
from blysk.bench.tools.tool_runner import ToolError
from blysk.bench.units.record import Record
from blysk.bench.units.registry import RECORDS
from blysk.hdl.core.views import copy
from blysk.hdl.geometry.triangles import COUNTER_BITS
from blysk.sim.engines import cxxrtl, cxxrtl_source
from blysk.sim.engines.compilers import find_compilers
from blysk.sim.engines.engine import CompilerMissing, Drive, Ports, Trace
from blysk.sim.engines.simulate import stimulus_of

__all__ = ["Mutants", "Wrapped", "flags_of", "killed", "mutate", "stimuli_of", "units_inside", "vectors_of"]

_KINDS = {record.kind for record in RECORDS.values()}


def units_inside(fragment: Fragment, path: str = "") -> Iterator[str]:
    """Paths of the parts of a unit that have their own record. Parts inside these parts are left out.

    Parameters
    ----------
    fragment : Fragment
        The elaborated unit.
    path : str
        Path of the unit, with a dot at the end.
    """
    for inner, name, *_ in fragment.subfragments:
        if any(type(origin) in _KINDS for origin in inner.origins or ()):
            yield f"{path}{name}"
        else:
            yield from units_inside(inner, f"{path}{name}.")


def stimuli_of(record: Record, unit: Component) -> list[Drive]:
    """Drive of every run of a record's default variant, in ascending order of input beats.

    Stimuli of the long run are left out.

    Parameters
    ----------
    record : Record
        The unit.
    unit : Component
        The unit's default variant.
    """
    runs = [
        run
        for name, stimulus in record.stimuli_of(record.default).items()
        if not stimulus.long
        for run in record.runs(unit, name)
    ]
    sent = [stimulus_of(unit, run.case.beats, count=run.count, **run.case.sent, **run.stalls) for run in runs]
    return sorted(sent, key=lambda stimulus: len(stimulus.input))


def vectors_of(record: Record) -> list[tuple[Drive, Trace]]:
    """The stimuli of `stimuli_of`. Each comes with the trace of the unit in the compiled engine."""
    unit = record.variants[record.default].unit()
    model = cxxrtl.Compiled(unit)
    return [(sent, model.run(sent)) for sent in stimuli_of(record, unit)]


class Wrapped(Component):
    """A unit inside another component.

    Parameters
    ----------
    unit : Component
        The unit.
    **members : Member
        Members besides the unit's members, or in place of its ``status``.
    """

    def __init__(self, unit: Component, **members: Member):
        self.unit = unit
        super().__init__({**unit.signature.members, **members})

    def elaborate(self, platform) -> Module:
        """Connect the unit's members. The subclass or the caller adds the unit as a submodule."""
        m = Module()
        for name, member in self.unit.signature.members.items():
            inner, outer = getattr(self.unit, name), getattr(self, name)
            if not member.is_port:
                source, sink = (inner, outer) if name == "o" else (outer, inner)
                m.d.comb += [
                    copy(sink.payload, source.payload),
                    sink.valid.eq(source.valid),
                    source.ready.eq(sink.ready),
                ]
            elif member.flow is In:
                m.d.comb += copy(inner, outer)
            elif self.signature.members[name] == member:
                m.d.comb += copy(outer, inner)
        return m


class _Observed(Wrapped):
    """A unit with an input that selects a mutant, and outputs that are 0 while their value does not matter.

    ``ready`` and payload matter only while ``valid`` is high. ``status`` has a counter of 32 bits for each of
    `flags_of` the unit. The counter counts the cycles in which the flag is high, as in a pipeline. For each
    further output ``status`` has a checksum of 32 bits over the cycles. If the output has a member ``valid``,
    the checksum is over cycles with ``valid`` high.

    Parameters
    ----------
    unit : Component
        The unit.
    width : int
        Number of bits of the input ``mutant``.
    """

    def __init__(self, unit: Component, width: int):
        members = {"mutant": In(width)}
        self.flags, self.others = flags_of(unit), _others_of(unit)
        if self.flags or self.others:
            members["status"] = Out(32 * len(self.flags + self.others))
        super().__init__(unit, **members)

    def elaborate(self, platform):
        """Add the unit, counters of its flags, and checksums of its further outputs."""
        m = super().elaborate(platform)
        m.submodules.unit = self.unit
        for index, name in enumerate(self.flags):
            count = self.status.word_select(index, 32)
            m.d.sync += count.eq(count + getattr(self.unit, name))
        for index, name in enumerate(self.others, len(self.flags)):
            output, seen = getattr(self.unit, name), self.status.word_select(index, 32)
            word = Value.cast(output)
            if "valid" in getattr(output.shape(), "members", {}):
                word = Mux(output.valid, word, 0)
            parts = [word[start : start + 32] for start in range(0, len(word), 32)]
            m.d.sync += seen.eq(reduce(xor, parts, seen.rotate_left(1)))
        payload = Value.cast(self.o.payload)
        m.d.comb += payload.eq(Mux(self.o.valid, Value.cast(self.unit.o.payload).as_unsigned(), 0))
        for name in ("i", "write"):
            if name in self.signature.members:
                outer = getattr(self, name)
                # This is a multiplexer, because `opt_merge` would merge an AND with an equal AND of the unit.
                m.d.comb += outer.ready.eq(Mux(outer.valid, getattr(self.unit, name).ready, 0))
        return m


def flags_of(unit: Component) -> list[str]:
    """Names of a unit's flags. Empty if the unit has a port ``status``, which counts them."""
    if "status" in unit.signature.members:
        return []
    return [name for name in ("out_of_range", "wide") if name in unit.signature.members]


def _others_of(unit: Component) -> list[str]:
    """Names of a unit's outputs that are no stream and no flag. Empty if the unit has a ``status``."""
    members, known = unit.signature.members, {"o", *flags_of(unit)}
    if "status" in members:
        return []
    return [name for name, member in members.items() if member.flow is Out and name not in known]


# The reset is undriven and set to 0, so its logic is removed. `setattr` removes initial values of wires. Else
# a wire would keep the initial value of a register that `zinit` has inverted. `opt_dff` makes clock enables.
# Else a register would hold its word by a loop through a multiplexer, and take in a fault at its output on
# every cycle. An inversion would then alternate from cycle to cycle. If a word is held for an even number of
# cycles, no test would see the inversion.
_FLATTEN = """\
read_rtlil top.il
hierarchy -auto-top
proc
flatten
delete -input w:rst
setundef -undriven -zero
opt_expr
opt_merge
zinit -all
setattr -unset init w:*
setundef -zero -init
opt_clean
opt_dff -nosdff
opt_clean
write_rtlil flat.il
write_json flat.json"""

# Registers of counters of events, from `count_events` and from the status of a pipeline without its flag.
_COUNTER = re.compile(r"wire<(?:16|32)> (p_\w*_(?:count__\w+|status_5b_\w+));")

_LIST = """\
select -set own -read own.txt
mutate -list {count} -seed {seed} -o list{round}.txt @own"""

# Nets whose bits have several drivers are split. CXXRTL would evaluate a net several times if its bits depend
# on each other.
_MUTATE = """\
read_rtlil flat.il
script mutants.txt
opt_clean
write_rtlil whole.il
splitnets -driver
write_rtlil mutated.il"""


def mutate(unit: Component, count: int, seed: int, folder: Path) -> dict[int, str]:
    """Write the netlist of a unit, and of the unit with its mutants, to a folder.

    ``flat.il`` is the unit. ``whole.il`` is the unit with all mutants. ``mutated.il`` is ``whole.il`` with
    nets split by their drivers. Cells of `units_inside` the unit get no faults. Yosys chooses ``count``
    mutants by ``seed``. Some of these mutants are left out. Returns the name of each mutant, by its number.
    """
    width = count.bit_length()
    netlist = rtlil.convert(_Observed(unit, width), name="top", emit_src=False)
    (folder / "top.il").write_text(netlist)
    yosys(_FLATTEN, folder)
    top = json.loads((folder / "flat.json").read_text())["modules"]["top"]
    behind = _registers_behind(top)
    inside = [f"*unit.?{path.replace('.', '.?')}.*" for path in units_inside(Fragment.get(unit, None))]
    own = [
        name
        for name, cell in top["cells"].items()
        if "unit." in name
        and cell["type"] != "$scopeinfo"
        and not any(fnmatchcase(name, pattern) for pattern in inside)
    ]
    (folder / "own.txt").write_text("".join(f"top/{name}\n" for name in own))
    listed = _listed(count, seed, _most_listed(top, own), folder) if own else []
    kept, known = [], {}
    for number, text in enumerate(listed, 1):
        mutant = _described(text, top["cells"], behind)
        # Four kinds of faults are left out. A fault of a clock is not small. The contents of a memory must be
        # constant. A read port of a memory may lack the reset or the enable that has the fault. If an output
        # bit of a cell inverts another output bit, a bit might depend on itself.
        small = not re.search(r"^\w+ (\$meminit|\S+ [A-Z_]*CLK\[)|^cnot\d \S+ Y\[", mutant)
        if small and not _of_missing_control(text, top["cells"]):
            kept.append(text.replace("mutate", f"mutate -ctrl mutant {width} {number}", 1))
            known[number] = mutant
    (folder / "mutants.txt").write_text("\n".join(kept))
    yosys(_MUTATE, folder)
    return known


def _listed(count: int, seed: int, most: int, folder: Path) -> list[str]:
    """Commands for at most ``count`` different mutants. Yosys lists at most ``most`` mutants at a time."""
    rounds = 1 if count <= most else 2 * -(-count // most)
    lists = [_LIST.format(count=min(count, most), seed=seed + k, round=k) for k in range(rounds)]
    # The netlist is flattened in the same run, because a netlist that is read again has another order.
    yosys("\n".join([_FLATTEN, *lists]), folder)
    found = [line for k in range(rounds) for line in (folder / f"list{k}.txt").read_text().splitlines()]
    return list(dict.fromkeys(found))[:count]


def _most_listed(module: Mapping[str, Any], own: Iterable[str]) -> int:
    """Number of mutants of ``own`` cells that Yosys can list at a time.

    Yosys takes about two mutants of each cell, of each named wire and of each bit of a named wire. If asked
    for more, it never ends. So the number is two for each cell, or two for each named bit if this is more. A
    bit counts if it is driven, or has only one reader.
    """
    chosen = {name: module["cells"][name] for name in own}
    nets = module["netnames"].values()
    named = {bit for net in nets if not net["hide_name"] for bit in net["bits"] if isinstance(bit, int)}
    readers: Counter = Counter()
    for cell in module["cells"].values():
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "input":
                readers.update(bits)
    found = {
        bit
        for cell in chosen.values()
        for port, bits in cell["connections"].items()
        for bit in bits
        if bit in named and (cell["port_directions"][port] == "output" or readers[bit] == 1)
    }
    return 2 * max(len(chosen), len(found))


def _of_missing_control(command: str, cells: Mapping[str, Any]) -> bool:
    """Whether a fault is at a reset of a memory's read port, or at the enable of a read port without a clock.

    Yosys refuses a memory with these faults.
    """
    cell, port = re.search(r"-cell (\S+) -port (\S+)", command).groups()
    found = cells[cell.removeprefix("\\")]
    if not found["type"].startswith("$memrd"):
        return False
    has_clock = int(found["parameters"]["CLK_ENABLE"], 2)
    return port.removeprefix("\\") in ("ARST", "SRST", *(() if has_clock else ("EN",)))


def _described(command: str, cells: Mapping[str, Any], behind: Callable[[str], str]) -> str:
    """Name of a mutant. It does not depend on the numbers that Yosys gives to cells and nets."""
    found = re.search(r"-mode (\S+) .*-cell (\S+) -port (\S+) -portbit (\d+)(?: -ctrlbit (\d+))?", command)
    mode, cell, port, bit, by = found.groups()
    cell = cell.removeprefix("\\")
    return f"{mode} {cells[cell]['type']} {port}[{bit}]{f' by [{by}]' if by else ''} -> {behind(cell)}"


def _registers_behind(module: Mapping[str, Any]) -> Callable[[str], str]:
    """Function from a cell's name to the first register or output that the cell's results reach."""
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
            shown = bits if cell["type"] in ("$dff", "$dffe") else [bit for bit in bits if bit in ports]
            if shown:
                return names[shown[0]]
            following = [reader for bit in bits for reader in readers[bit] if reader not in seen]
            seen.update(following)
            open_ += dict.fromkeys(following)
        return "nothing"

    return behind


class Mutants(cxxrtl.Compiled):
    """Compiled model of a unit with all its mutants."""

    def __init__(self, unit: Component, folder: Path):
        self.ports = Ports(unit)
        if counted := flags_of(unit) + _others_of(unit):
            self.ports.status = unsigned(32 * len(counted))
        netlist = (folder / "mutated.il").read_text()
        self.counters = _COUNTER.findall(cxxrtl_source.generated(netlist))
        counters = " ".join(f"BLYSK_COUNTER({name})" for name in self.counters)
        source = f"#define BLYSK_COUNTERS {counters}\n"
        source += resources.files(__package__).joinpath("mutants.cc").read_text(encoding="utf-8")
        driver = cxxrtl_source.members_of(self.ports) + cxxrtl_source.text_of("cxxrtl_driver.cc") + source
        compiler = next(find_compilers(), None)
        if compiler is None:
            raise CompilerMissing("no C++ compiler")
        # -O1 is used because compiling takes longer than running.
        compiler = replace(compiler, compile=(*compiler.compile, "-O1"))
        failure = cxxrtl._build(netlist, driver, compiler, "mutants", folder)
        if failure:
            raise ToolError(failure)
        self._library = library = cxxrtl._load(folder / "model", "mutants")
        library.blysk_open_mutant.restype = ctypes.c_void_p
        library.blysk_open = library.blysk_open_mutant

    def choose(self, mutant: int, start: int = 0) -> None:
        """Select the mutant for the next runs, and the number at which counters of events begin.

        Parameters
        ----------
        mutant : int
            Number of the mutant. 0 is the unit.
        start : int
            Number at which the counters of events begin. A narrow counter takes the low bits of this number.
        """
        ctypes.c_uint64.in_dll(self._library, "blysk_mutant").value = mutant
        ctypes.c_uint64.in_dll(self._library, "blysk_start").value = start

    def trace(self, stimulus: Drive) -> Trace:
        """Trace of a run of the stimulus. The run ends at its limit of cycles at the latest."""
        return self._run(stimulus, None)


def killed(model: Mutants, vectors: Sequence[tuple[Drive, Trace]], mutants: Iterable[int]) -> set[int]:
    """Numbers of the mutants whose trace differs from the unit's trace for one of the stimuli.

    A counter of events has more bits than a run has events. Therefore, for each word of the status, the
    shortest run that changes the word is made again. The counters begin at ``2^k - 1``, for each bit k from
    1 on. So the next event sets bit k.
    """
    alive = set(mutants)

    def run(start: int, stimulus: Drive, trace: Trace) -> None:
        limited = replace(stimulus, limit=trace.clock)
        model.choose(0, start)
        expected = _seen(limited, model.trace(limited))
        for mutant in sorted(alive):
            model.choose(mutant, start)
            if not all(map(np.array_equal, _seen(limited, model.trace(limited)), expected)):
                alive.remove(mutant)

    counting = {}
    for number, (stimulus, trace) in enumerate(vectors):
        model.choose(0)
        found = model.trace(stimulus)
        if difference := found.differs(trace if trace.status.size else replace(trace, status=found.status)):
            raise ToolError(f"the unit without a fault differs from the original unit in {difference}")
        for word in np.flatnonzero(found.status):
            if word not in counting or trace.clock < vectors[counting[word]][1].clock:
                counting[word] = number
        run(0, stimulus, trace)
    if model.counters:
        for bits, number in product(range(1, COUNTER_BITS + 1), sorted(set(counting.values()))):
            run((1 << bits) - 1, *vectors[number])
    return set(mutants) - alive


def _seen(stimulus: Drive, trace: Trace) -> tuple:
    """Parts of a trace that tests compare. Without stalls they include the clocks of the input transfers."""
    free = not (stimulus.input_stalls.any() or stimulus.output_stalls.any())
    cycles = (trace.input_cycles,) if free else ()
    return trace.end, trace.clock, trace.output, trace.cycles, trace.status, *cycles
