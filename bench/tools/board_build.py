"""Makes the bitstream of a board's top by Yosys, nextpnr and ecppack, and reads the reached clock rates."""

import contextlib
import hashlib
import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from amaranth.hdl import Elaboratable

from blysk.bench.tools.absorb_registers import absorb_registers, text_of_step
from blysk.bench.tools.boards import Board, packages_missing
from blysk.bench.tools.carry_starts import start_carries
from blysk.bench.tools.families import ECP5, signal_name
from blysk.bench.tools.kept_builds import KeptBuild, text_of
from blysk.bench.tools.memory_map import MemoryMap, ScenePatterns, blocks_of_netlist, carrying, memory_words
from blysk.bench.tools.nextpnr import CROWDED, is_crowded, run_nextpnr
from blysk.bench.tools.place_and_route import MAP_AFTER, MAP_BEFORE, YOSYS, versions_of
from blysk.bench.tools.shared_addresses import share_addresses
from blysk.bench.tools.tool_runner import MOUNT, GivenUp, TooLarge, ToolError, ToolRunner, Watch
from blysk.hdl.core.scene_memory import contents_from

__all__ = [
    "BoardNetlist",
    "Built",
    "Clock",
    "build",
    "pack",
    "refuse_too_large",
    "run_tool",
]

PERIODS = 1
"""Periods of the reader's clock that a path between two clocks may take.

The words on the path stay unchanged for longer than this.
"""

_LIBRARY = """\
read_verilog -lib -specify +/lattice/cells_sim_ecp5.v
read_verilog -lib +/lattice/cells_bb_ecp5.v
"""

_FEWEST = 16
"""Least number of registers with the same enable or reset.

An enable or reset of fewer registers becomes logic before the registers. Each tile has few wires for enables.
On a nearly full 25F at least 865 wires were used twice with all enables, and 7 wires with this limit. Both
figures are without `_SETTINGS`.
"""

_LEGALISE = f"""\
opt_clean
dfflegalize -cell $_DFF_?_ 01 -cell $_DFF_?P?_ r -cell $_SDFF_?P?_ r -cell $_DFFE_??_ 01 \
-cell $_DFFE_?P??_ r -cell $_SDFFE_?P??_ r -mince {_FEWEST} -minsrst {_FEWEST}
"""
"""Commands of Yosys's step ``map_ffs`` with the limit `_FEWEST`."""

_MEMORIES = """\
setattr -set ram_style "distributed" m:*render.pipeline.coordinates m:*render.depths
"""
"""Commands of Yosys for memories that go into look-up tables.

The coordinates that wait beside shading are 64 words of 25 bits. So the table of sRGB finds room on a 25F.
The words that wait for the depth test are 64 words of 67 bits. So the motion's coefficients find room.
"""

_LAYOUT = ("--placer", "static", "--router", "router2", "--router2-alt-weights")
"""Options of nextpnr. This placer makes the shortest wires.

If wires are scarce, nextpnr's other router removes as many wires as it lays. On a 25F it does not end.
"""

_ROUNDS, _FEW = 100, 10
"""The router may be given up after `_ROUNDS` rounds, if it uses `_FEW` or more wires twice."""

_SETTINGS = {"router2/currCongWeightMult": "0.2"}
"""Settings of nextpnr in the netlist. The cost of a wire that is used twice grows by this in each round.

By default the cost is constant. If wires are scarce, a few hundred wires are then used twice to the end.
"""

_PARTS = {
    "look-up tables": "TRELLIS_COMB",
    "flip-flops": "TRELLIS_FF",
    "multipliers": "MULT18X18D",
    "block RAMs": "DP16KD",
    "PLLs": "EHXPLLL",
}
"""Counted parts, and their names in nextpnr's report."""


@dataclass(frozen=True)
class Clock:
    """A clock of a placed design, or the paths from one clock to another.

    Parameters
    ----------
    name : str
        Domain of the clock, or two domains as ``one to another``.
    needed, reached : float
        Rates, MHz.
    path : str
        The slowest path, from register to register, and its delay.
    """

    name: str
    needed: float
    reached: float
    path: str

    @property
    def met(self) -> bool:
        """Whether the reached rate is at least the needed rate."""
        return self.reached >= self.needed


@dataclass(frozen=True)
class Built:
    """A bitstream, its parts and its clocks.

    Parameters
    ----------
    parts : dict of str to (int, int)
        Used and available number of each part, by name.
    clocks : tuple of Clock
        Every clock of the design.
    closed : int
        Multipliers with registers inside on both sides. nextpnr does not time paths between these registers.
    seed : int
        Seed of the placement.
    bitstream : bytes
        Bitstream that the FPGA loads.
    words : int
        Number of memory words that were read back from the bitstream. All were equal to the written words.
    """

    parts: dict[str, tuple[int, int]]
    clocks: tuple[Clock, ...]
    closed: int
    seed: int
    bitstream: bytes
    words: int


@dataclass(frozen=True)
class BoardNetlist:
    """A top with the board's pins as a netlist for Yosys, with random words in the memories of its scene.

    Parameters
    ----------
    netlist, constraints : bytes
        Netlist in Yosys's language, and constraints of pins and clocks. They do not depend on the words of
        the scene.
    patterns : ScenePatterns
        The random words, and the words of the scene.
    """

    netlist: bytes
    constraints: bytes
    patterns: ScenePatterns

    @classmethod
    def of(cls, board: Board, top: Elaboratable) -> "BoardNetlist":
        """The netlist of a top that requests its pins from the platform."""
        patterns = ScenePatterns()
        with contents_from(patterns):
            # Places of the source code would tell a moved project from the mapped and routed design.
            files = board.make().prepare(top, "top", debug_verilog=False, emit_src=False).files
        netlist, constraints = (
            text if isinstance(text, bytes) else text.encode() for text in (files["top.il"], files["top.lpf"])
        )
        return cls(netlist, constraints, patterns)

    @property
    def digest(self) -> str:
        """Digest of netlist and constraints."""
        return hashlib.sha256(hashlib.sha256(self.netlist).digest() + self.constraints).hexdigest()


def _script(draw: float) -> str:
    """Yosys's commands for a drawing clock of ``draw`` MHz.

    They are the commands for a unit, with cells of pins and PLL and with these changes.

    Small enables become logic. Multiplexers that join two look-up tables are not used. Both tables would have
    to be placed side by side, and few tables are saved (20,101 instead of 20,150 on a 25F, with 1,336
    multiplexers).

    The mapper saves look-up tables on paths that take less than a third of the clock's period by its
    estimate. Wires on a nearly full device are three times as long as in the estimate.
    """
    mapped = re.sub(r"(?<=abc9\.D )\d+", str(round(1e6 / draw / 3)), ECP5.synthesis)
    *before, synthesis = mapped.splitlines(keepends=True)
    synthesis += " -nowidelut"
    before.insert(0, _MEMORIES)
    halves = f"{synthesis} -run begin:map_ffs\n{_LEGALISE}{synthesis} -run map_ffs:"
    return "".join((_LIBRARY, MAP_BEFORE, *before, halves, MAP_AFTER))


def _stuck(said: str) -> str:
    """Reason why placer or router will not end, from their log. Empty while they may end.

    In all runs that ended, the number of wires used twice at least halved while the rounds doubled.
    """
    twice = [int(number) for number in re.findall(r"^Info:\s+iter=\d+ wires=\d+ overused=(\d+)", said, re.M)]
    if len(twice) >= _ROUNDS and twice[-1] >= _FEW and 2 * min(twice) > twice[len(twice) // 2]:
        return f"{min(twice)} wires are used twice at best in {len(twice)} rounds"
    return CROWDED if is_crowded(said) else ""


def _nextpnr(name: str) -> str:
    module = ECP5.package.replace("-", "_")
    return f"import sys, {module} as n; sys.exit(n.run_{name}(sys.argv[1:]))"


def build(
    board: Board,
    top: Elaboratable,
    rates: Mapping[str, float],
    seeds: int = 1,
    progress: Callable[[str], object] = lambda step: None,
    carried: Mapping[str, Any] | None = None,
) -> Built:
    """Make the bitstream of a top that requests its pins from the platform.

    The mapped netlist and each routed placement are kept in the cache as soon as they are there. So an
    interrupted build goes on where it was. They do not depend on the words of the scene, which are written
    after routing.

    The bitstream carries a comment in JSON: ``carried``, the digest of the netlist, and where the memories of
    the scene are (`MemoryMap`).

    Parameters
    ----------
    board : Board
        The board.
    top : Elaboratable
        The top, which makes its clock domains itself.
    rates : dict of str to float
        Clock rates of the top's PLL in MHz, by domain.
    seeds : int
        Largest number of placements to try until every clock is met. If none meets all, the result is the
        best placement.
    progress : callable
        Called with the name of each step, and every 30 seconds with the state of a step, see `Watch`.
    carried : dict, optional
        Facts for the comment in the bitstream.

    Raises
    ------
    InputError
        If a tool is missing.
    TooLarge
        If the design does not fit the device.
    GivenUp
        If no placement can be routed.
    ToolError
        If a tool fails, or the bitstream reads back as another configuration. If a memory of the scene is not
        in block RAM.
    """
    packages_missing()
    given = BoardNetlist.of(board, top)
    runner = ToolRunner()
    with tempfile.TemporaryDirectory(prefix="blysk-") as name, contextlib.ExitStack() as stack:
        stack.callback(runner.stop)
        folder = Path(name)
        for file, text in (("top.il", given.netlist), ("top.lpf", given.constraints)):
            (folder / file).write_bytes(text)
        script = _script(rates["sync"])
        options = repr((board.options, _LAYOUT, _SETTINGS, versions_of(ECP5)))
        step = text_of_step() + text_of(start_carries, share_addresses)
        kept = KeptBuild((given.netlist, given.constraints, script, options, step))
        progress("mapping")
        if not kept.take(folder, "netlist.json"):
            runner.run("Yosys", YOSYS, [], folder, script, watch=Watch("mapping", progress))
            kept.keep(folder, "netlist.json")
        mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
        mapped, absorbed = absorb_registers(mapped)
        start_carries(mapped)
        share_addresses(mapped)
        mapped["modules"]["top"]["settings"] = _SETTINGS
        (folder / "top.json").write_text(json.dumps(mapped), encoding="utf-8")
        refuse_too_large(board, mapped)
        _map(blocks_of_netlist(mapped), given.patterns)
        best = reason = None
        for seed in range(1, seeds + 1):
            progress(f"placement {seed}")
            try:
                _place(board, runner, folder, seed, kept, progress)
            except GivenUp as error:
                reason = error
                continue
            report = json.loads((folder / f"{seed}.json").read_text(encoding="utf-8"))
            clocks = _clocks(report, rates)
            slack = min(clock.reached / clock.needed for clock in clocks)
            if best is None or slack > best[0]:
                best = slack, seed, report, clocks
            if slack >= 1:
                break
        if best is None:
            raise GivenUp(f"the {board.name} is not routed: {reason}; give more --seeds")
        _, seed, report, clocks = best
        progress("bitstream")
        _fill(folder, f"{seed}.config", given, carried or {})
        words = pack(runner, folder, "filled.config")
        return Built(
            {name: _used(report, kind) for name, kind in _PARTS.items()},
            clocks,
            absorbed.closed,
            seed,
            (folder / "top.bit").read_bytes(),
            words,
        )


def _fill(folder: Path, configuration: str, given: BoardNetlist, facts: Mapping[str, Any]) -> None:
    """Write ``filled.config``: a routed configuration with the words of the scene, and its comment."""
    routed = (folder / configuration).read_text(encoding="utf-8")
    memories = _map(memory_words(routed), given.patterns)
    comment = {**facts, "netlist": given.digest, "memories": memories.to_json()}
    filled = memories.replaced(routed, given.patterns.contents)
    (folder / "filled.config").write_text(carrying(filled, comment), encoding="utf-8")


def _map(blocks: Mapping[str, np.ndarray], patterns: ScenePatterns) -> MemoryMap:
    try:
        return MemoryMap.found(blocks, patterns)
    except ValueError as error:
        raise ToolError(str(error)) from None


def refuse_too_large(board: Board, netlist: Mapping[str, Any]) -> None:
    """Refuse a netlist that does not fit. The placer would fail after minutes, or try for ever.

    Parameters
    ----------
    board : Board
        The board.
    netlist : dict
        Yosys's JSON, mapped.

    Raises
    ------
    TooLarge
        If the netlist takes more of a part than the device has. The message names all these parts.
    """
    kinds = Counter(cell["type"] for cell in netlist["modules"]["top"]["cells"].values())
    counts = {
        # A carry cell takes two look-up tables. A memory of 16 words takes four.
        "look-up tables": kinds["LUT4"] + 2 * kinds["CCU2C"] + 4 * kinds["TRELLIS_DPR16X4"],
        "flip-flops": kinds["TRELLIS_FF"],
        "block RAMs": kinds["DP16KD"],
        "multipliers": kinds["MULT18X18D"],
    }
    most = dict(zip(counts, (board.luts, board.luts, board.block_rams, board.multipliers), strict=True))
    over = [f"{count:,} {name} of {most[name]:,}" for name, count in counts.items() if count > most[name]]
    if over:
        raise TooLarge(f"does not fit the {board.name}: {', '.join(over)}")


def _place(
    board: Board,
    runner: ToolRunner,
    folder: Path,
    seed: int,
    kept: KeptBuild,
    tell: Callable[[str], object],
) -> None:
    """Place and route the mapped netlist from a seed, or take what is kept of this placement."""
    results, given_up = (f"{seed}.config", f"{seed}.json"), f"{seed}.txt"
    if kept.take(folder, *results):
        return
    if kept.take(folder, given_up):
        raise GivenUp((folder / given_up).read_text(encoding="utf-8"))
    options = [
        *board.options,
        *_LAYOUT,
        *("--json", f"{MOUNT}/top.json", "--lpf", f"{MOUNT}/top.lpf", "--textcfg", f"{MOUNT}/{seed}.config"),
        *("--report", f"{MOUNT}/{seed}.json", "--seed", str(seed), "--timing-allow-fail"),
    ]
    try:
        run_nextpnr(runner, _nextpnr("nextpnr_ecp5"), options, folder, f"placement {seed}", tell, _stuck)
    except GivenUp as error:
        (folder / given_up).write_text(str(error), encoding="utf-8")
        kept.keep(folder, given_up)
        raise
    except ToolError as error:
        if "legal placement" in str(error) or "Unable to place" in str(error):
            raise TooLarge(f"does not fit the {board.name}: {error}") from None
        raise
    kept.keep(folder, *results)


def _used(report: Mapping[str, Any], kind: str) -> tuple[int, int]:
    found = report["utilization"].get(kind, {"used": 0, "available": 0})
    return int(found["used"]), int(found["available"])


def _clocks(report: Mapping[str, Any], rates: Mapping[str, float]) -> tuple[Clock, ...]:
    """Clocks of nextpnr's report, each with its slowest path, then the paths between clocks."""
    names, result = {}, []
    for net, rate in report["fmax"].items():
        name = next(
            (name for name, asked in rates.items() if abs(rate["constraint"] / asked - 1) < 1e-3), None
        )
        if name is None or name in names.values():
            raise ToolError(
                f"nextpnr constrains {net} to {rate['constraint']:.2f} MHz, which no clock asks for"
            )
        names[net] = name
    for path in report["critical_paths"]:
        edges = [path[side].removeprefix("posedge ") for side in ("from", "to")]
        if not all(edge in names for edge in edges):
            continue
        start, end = (names[edge] for edge in edges)
        name = start if start == end else f"{start} to {end}"
        delay = sum(step["delay"] for step in path["path"])
        reached = report["fmax"][edges[0]]["achieved"] if start == end else 1e3 * PERIODS / delay
        result.append(Clock(name, rates[end], reached, _described(path["path"], delay)))
    missing = set(rates) - {clock.name for clock in result}
    if missing:
        raise ToolError(f"nextpnr reports no path of {', '.join(sorted(missing))}")
    return tuple(sorted(result, key=lambda clock: (" " in clock.name, clock.name)))


def _described(path: Sequence[Mapping[str, Any]], delay: float) -> str:
    cells = sum(step["type"] == "logic" for step in path)
    start, end = (signal_name(path[k][side]["cell"], ECP5) for k, side in ((0, "from"), (-1, "to")))
    return f"{start} -> {end}, {delay:.1f} ns, {cells} cells"


def run_tool(
    runner: ToolRunner, folder: Path, tool: str, source: str, option: str, target: str, *others: str
) -> None:
    """Run ecppack or ecpunpack in a folder. The option names what the tool writes."""
    files = ["--input", f"{MOUNT}/{source}", option, f"{MOUNT}/{target}"]
    runner.run(tool, _nextpnr(tool), [*files, *others], folder)


def pack(runner: ToolRunner, folder: Path, configuration: str) -> int:
    """Make ``top.bit`` from a configuration in text, read it back, and compare.

    The read-back text may name settings differently, because several names stand for one bit. So the text is
    packed again, and must give the same bytes. The contents of memories are compared directly.

    Returns
    -------
    int
        Number of memory words. All words that were read back are equal to the written words.
    """
    steps = (
        ("ecppack", configuration, "--bit", "top.bit"),
        ("ecpunpack", "top.bit", "--textcfg", "back.config"),
        ("ecppack", "back.config", "--bit", "again.bit"),
    )
    for tool, source, option, target in steps:
        compress = ["--compress"] if tool == "ecppack" else []
        run_tool(runner, folder, tool, source, option, target, *compress)
    if (folder / "top.bit").read_bytes() != (folder / "again.bit").read_bytes():
        raise ToolError("the bitstream differs after it is read back and packed again")
    sent, back = (memory_words((folder / name).read_text()) for name in (configuration, "back.config"))
    if sent.keys() != back.keys() or any((sent[number] != back[number]).any() for number in sent):
        raise ToolError("the bitstream reads back with other contents of memories")
    return sum(map(len, sent.values()))
