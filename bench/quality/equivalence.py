"""Proofs by ABC that a mutant is equivalent to its unit: no stimulus distinguishes them."""

import itertools
import math
import re
import subprocess
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Set
from importlib.util import find_spec
from pathlib import Path

from blysk.bench.tools.place_and_route import YOSYS
from blysk.bench.tools.tool_runner import ToolError
from blysk.hdl.emit.processes import run_program

__all__ = ["Miter", "yosys"]

_SECONDS = 20
"""Time limit of a proof of equivalence, in seconds.

A first attempt comes before this proof. The limit of the first attempt is a quarter of this time. Most
successful proofs take at most 3 seconds.
"""


YOSYS_SECONDS = 1800
"""Time limit of a run of Yosys, in seconds. Every run that has finished so far took less time."""


def yosys(script: str, folder: Path) -> None:
    """Run a Yosys script in a folder, with the package pyosys.

    Raises
    ------
    ToolError
        If Yosys fails, or has not ended after `YOSYS_SECONDS`.
    """
    command = [sys.executable, "-c", YOSYS]
    streams = {"capture_output": True, "encoding": "utf-8"}
    try:
        done = run_program(command, input=script, cwd=folder, timeout=YOSYS_SECONDS, **streams)
    except subprocess.TimeoutExpired:
        raise ToolError(f"Yosys has not ended after {YOSYS_SECONDS} s") from None
    if done.returncode:
        raise ToolError(f"Yosys failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}")


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

_NARROW = 12


def _numbers(data: bytes) -> Iterator[int]:
    """Numbers in AIGER's binary format.

    A byte has 7 bits of a number, and the lowest bits come first. Bit 7 is 1 if another byte follows.
    """
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


class Miter:
    """Equivalence check of a unit and a mutant of the unit. Both are AND gates and one-bit registers.

    A proof through multipliers would take too long. Therefore unit and mutant share their registers, and the
    proof shows that both compute the same next values. Then the registers stay equal by induction. Shared
    registers of at most 12 bits, and registers named ``valid`` or ``ages``, count as the control of the unit:
    in the proof they take the next values that the unit computes. The other shared registers are free inputs,
    or 0 if they are always 0 in the unit. The register that the fault reaches first is not shared. Bits that
    differ in a proof are not shared in the next proof.

    Parameters
    ----------
    folder : path
        Folder with the netlist ``whole.il`` of `mutation.mutate`. With 0 at its input ``mutant`` the netlist
        is the unit. Intermediate files are written here.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        yosys(_AIGER, folder)
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
        self._zero = self._constant()

    def _constant(self) -> set[int]:
        """Registers of the unit that are always 0. While all of them are 0, their next values are 0."""
        zero = set(range(len(self._next)))
        while True:
            # The value of each node: 0, 1, or ``None`` if it is not constant.
            nodes = [0] + [None] * self._inputs + [0 if k in zero else None for k in range(len(self._next))]
            for place in self._mutant:
                nodes[1 + place] = 0

            def known(literal: int, nodes=nodes) -> int | None:
                value = nodes[literal >> 1]
                return value if value is None else value ^ literal & 1

            for a, b in self._gates:
                a, b = known(a), known(b)
                nodes.append(0 if a == 0 or b == 0 else 1 if a == b == 1 else None)
            changed = {k for k in zero if known(self._next[k]) != 0}
            if not changed:
                return zero
            zero -= changed

    def is_equivalent(self, mutant: int, register: str = "") -> bool:
        """Whether a mutant is proved equivalent to the unit.

        ``register`` is the register that the mutant's fault reaches first.
        """
        shared = set(range(len(self._next)))
        # With all registers shared, simplification of the gates may remove the fault. With fewer shared
        # registers this is rare.
        if not self._write(mutant, shared):
            return True
        # Perhaps the fault has no effect, whatever the registers contain. For example, it changes a
        # register's input only while the register keeps its value.
        if self._prove(mutant, shared, _SECONDS / 4)[0]:
            return True
        if register:
            whole = re.compile(re.escape(register) + r"(\W|$)")
            shared = {latch for latch in shared if not any(map(whole.match, self._names[latch]))}
        end = time.monotonic() + _SECONDS
        while (left := end - time.monotonic()) > 0:
            proved, differing = self._prove(mutant, shared, left)
            if proved or not differing:
                return proved
            shared -= differing
        return False

    def _prove(self, mutant: int, shared: Set[int], seconds: float) -> tuple[bool, set[int]]:
        """Whether all outputs and ``shared`` registers are proved equal, and the registers that differ."""
        compared = self._write(mutant, shared)
        if not compared:
            return True, set()
        script = f"read_aiger mutant.aig; strash; scleanup; scorr; pdr -a -v -T {math.ceil(seconds)}"
        abc = Path(find_spec("pyosys").origin).parent / "yosys-abc"
        try:
            done = run_program(
                [abc, "-c", script],
                capture_output=True,
                encoding="utf-8",
                cwd=self._folder,
                timeout=seconds + 1,
            )
        except subprocess.TimeoutExpired:
            return False, set()
        found = re.search(r"Properties: +All = (\d+). +Proved = (\d+)", done.stdout)
        if done.returncode or found is None:
            raise ToolError(f"ABC failed: {(done.stderr or done.stdout).strip().splitlines()[-1]}")
        asserted = (int(k) for k in re.findall(r"Output +(\d+) was (?:trivially )?asserted", done.stdout))
        return found[1] == found[2], {compared[k] for k in asserted} - {-1}

    def _write(self, mutant: int, shared: Set[int]) -> list[int]:
        """Write ``mutant.aig``.

        Returns a number for each output of the file: the register that the output compares, or -1 if it
        compares an output of the unit.
        """
        known, gates = {}, []
        places = itertools.count(1 + self._inputs)
        units = [[0, *range(2, 2 * self._inputs + 2, 2)] for _ in range(2)]
        for latch in range(len(self._next)):
            literal = 0 if latch in self._zero else 2 * next(places)
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
                # A shared register has one node. The unit gives the node's next value.
                ends = zip(now, (a, a if latch in shared else b), strict=True)
                following |= {node: end for node, end in ends if node}
            if a != b and (latch < 0 or latch in shared):
                outputs.append(both(both(a, b) ^ 1, both(a ^ 1, b ^ 1) ^ 1))
                compared.append(latch)
        # Nodes on which the outputs depend, directly or through registers.
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
