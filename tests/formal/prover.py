"""Proofs of hardware: Yosys and ABC decide claims about a unit for all inputs (package pyosys)."""

import re
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from amaranth.back import rtlil
from amaranth.hdl import Assert, Assume, DomainRenamer, Fragment, Module, ShapeLike, Signal, Value, ValueLike
from amaranth.lib.wiring import Component, In

from blysk.sim.installation import install_extra

from ..decided import Decided, digest_of

__all__ = ["Harness", "Verdict", "decide", "expect", "missing_tool"]

_YOSYS = "import sys, pyosys.libyosys as y; d = y.Design(); [d.run_pass(l.strip()) for l in sys.stdin]"

# Products and tables are cut off. A claim that holds for all of their results holds for their true results.
_SCRIPT = """\
read_rtlil top.il
hierarchy -auto-top
proc
flatten
opt_clean
memory_collect
opt_clean
select -set cut CUT
cutpoint @cut
memory_map
async2sync
dffunmap
opt_expr
opt_merge
opt_clean
chformal -lower
setundef -undriven -anyseq
alumacc
techmap
aigmap
write_aiger -zinit -symbols top.aig
"""

_SECONDS = 600
"""Seconds after which a proof is given up."""


class Harness:
    """A unit with free inputs in every cycle, and the claims about it.

    All members of the input, and ``rst``, may take any value in any cycle. So a claim holds for every
    stimulus, and with a reset at any time. Registers of `m` are reset with the unit.

    Multipliers, and tables without a write port, give any result in every cycle. A claim that is proved in
    this way holds for the unit. A claim that is refuted in this way may still hold.

    Parameters
    ----------
    unit : Component
        Unit. It is elaborated at once, so that claims may name signals that its `elaborate` keeps.
    multiplies : bool
        Keep the true multipliers. This is for operands of few bits.

    Attributes
    ----------
    m : Module
        Module for the registers of a model.
    """

    def __init__(self, unit: Component | None = None, *, multiplies: bool = False):
        self.m, self.multiplies = Module(), multiplies
        self.unit = unit
        self._ports: list[Value] = []
        self._claims: list[Value] = []
        if unit is not None:
            self.m.submodules.unit = self._fragment = Fragment.get(unit, None)
            self._ports = [
                Value.cast(value) for _, member, value in unit.signature.flatten(unit) if member.flow is In
            ]

    def free(self, shape: ShapeLike = 1, name: str = "free") -> Signal:
        """A signal that takes any value in every cycle."""
        signal = Signal(shape, name=name)
        self._ports.append(Value.cast(signal))
        return signal

    def register(self, name: str) -> Signal:
        """The register of a name in the unit itself. Registers of submodules do not count.

        Raises
        ------
        KeyError
            If it has none, or several.
        """
        statements = self._fragment.statements["sync"]
        found = (signal for statement in statements for signal in statement._lhs_signals())
        named = {id(signal): signal for signal in found if signal.name == name}
        if len(named) != 1:
            raise KeyError(f"{len(named)} registers are named {name}")
        return named.popitem()[1]

    def claim(self, condition: ValueLike) -> None:
        """Claim that a condition holds in every cycle."""
        self._claims.append(Value.cast(condition))

    def assume(self, condition: ValueLike) -> None:
        """Consider only runs in which a condition holds in every cycle."""
        self.m.d.comb += Assume(condition)

    def without_claims(self) -> "Harness":
        """A harness with the same runs and without claims."""
        other = Harness(multiplies=self.multiplies)
        other.m.submodules.runs, other.unit, other._ports = self.m, self.unit, self._ports
        return other

    def netlist(self) -> str:
        """The harness as RTLIL text."""
        top = Module()
        top.submodules.runs = self.m
        top.d.comb += [Assert(condition) for condition in self._claims]
        # A copy, because a fragment that was converted cannot be used again.
        return rtlil.convert(DomainRenamer({})(Fragment.get(top, None)), ports=self._ports)


@dataclass(frozen=True)
class Verdict:
    """The verdict on the claims.

    Parameters
    ----------
    holds : bool or None
        Whether the claims hold, in every cycle or in as many cycles as asked for. ``None``: this was not
        decided in time.
    cycles : int
        Number of the last cycle of the counterexample, from 0, or the frames that the search has seen.
    trace : str
        The counterexample. Each line has the input bits that are 1 in a cycle. Empty if there is none.
    """

    holds: bool | None
    cycles: int
    trace: str = ""


def missing_tool() -> str:
    """The reason why nothing can be proved on this machine; empty if proofs are possible."""
    return "" if find_spec("pyosys") else f"pyosys is not installed: {install_extra('fpga')}"


def _run_yosys(script: str, folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _YOSYS], input=script, capture_output=True, encoding="utf-8", cwd=folder
    )
    if done.returncode:
        raise RuntimeError(f"Yosys failed: {done.stderr[-2000:] or done.stdout[-2000:]}")


def expect(
    holds: bool, harness: Harness, folder: Path, cycles: int | None = None, *, decided: Decided
) -> Verdict:
    """The expected verdict if `decided` has it, otherwise the verdict of `decide`.

    The digest of a verdict covers the netlist with its claims, without places in the source. It also covers
    the commands of Yosys and ABC with the number of cycles, and the expected verdict.
    """
    netlist = harness.netlist()
    text = re.sub(r"^ *attribute \\src .*\n", "", netlist, flags=re.MULTILINE)
    digest = digest_of(text, _commands(cycles, harness.multiplies), holds)
    if decided.knows(digest):
        return Verdict(holds, 0)
    verdict = decide(netlist, folder, cycles, harness.multiplies)
    if verdict.holds is holds:
        decided.add(digest)
    return verdict


def _commands(cycles: int | None, multiplies: bool) -> tuple[str, str]:
    """The commands of Yosys and ABC."""
    cut = "t:$mem_v2 r:WR_PORTS=0 %i" + ("" if multiplies else " t:$mul %u")
    engine = f"lcorr; pdr -T {_SECONDS}" if cycles is None else f"bmc3 -F {cycles} -T {_SECONDS}"
    return (
        _SCRIPT.replace("CUT", cut),
        f"read_aiger top.aig; fold; {engine}; print_status; write_cex -n top.cex",
    )


def decide(netlist: str, folder: Path, cycles: int | None = None, multiplies: bool = False) -> Verdict:
    """Decide whether the claims of a netlist hold.

    Parameters
    ----------
    netlist : str
        RTLIL text of a harness.
    folder : path
        Folder for the netlist.
    cycles : int or None
        Look for a counterexample of at most this many cycles from power-up, by bounded model checking.
        ``None``: prove the claims for runs of any length, by property-directed reachability (IC3). IC3 finds
        an inductive invariant and verifies it. Registers that are always equal, for example in two equal
        chains, are merged before. Otherwise IC3 would have to find that they are equal bit by bit.
    multiplies : bool
        See `Harness`.

    Raises
    ------
    RuntimeError
        If Yosys or ABC fails.
    """
    (folder / "top.il").write_text(netlist)
    script, command = _commands(cycles, multiplies)
    _run_yosys(script, folder)
    abc = Path(find_spec("pyosys").origin).parent / "yosys-abc"
    done = subprocess.run([abc, "-c", command], capture_output=True, encoding="utf-8", cwd=folder)
    status = re.search(r"Status = (-?\d+) +Frames = (-?\d+)", done.stdout)
    if done.returncode or status is None:
        raise RuntimeError(f"ABC failed: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    code, frames = int(status[1]), int(status[2])
    if code == 0:
        return Verdict(False, frames, _trace(folder / "top.cex"))
    if code == 1 or (cycles is not None and f"No output asserted in {cycles} frames" in done.stdout):
        return Verdict(True, frames)
    return Verdict(None, frames)


def _trace(path: Path) -> str:
    """Inputs of a counterexample: for each cycle the names of the bits that are 1."""
    cycles: dict[int, list[str]] = {}
    for name, clock, bit in re.findall(r"^(\S+)@(\d+)=([01])$", path.read_text(), re.MULTILINE):
        cycles.setdefault(int(clock), []).extend([name] if bit == "1" else [])
    return "\n".join(f"{clock}: {' '.join(names)}" for clock, names in sorted(cycles.items()))
