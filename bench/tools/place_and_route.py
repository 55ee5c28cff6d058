"""Place and route of a component: mapping by Yosys, placement by nextpnr, and figures of its report."""

import contextlib
import hashlib
import json
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

from amaranth.back import rtlil
from amaranth.hdl import Const, Module, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from blysk.bench.tools.absorb_registers import Absorbed, absorb_registers, text_of_step
from blysk.bench.tools.defaults import SEEDS
from blysk.bench.tools.families import ECP5, Family, Parts, Place, kind_of_cell, signal_name
from blysk.bench.tools.kept_builds import KeptBuild
from blysk.bench.tools.nextpnr import CROWDED, SLOW, is_crowded, is_slow, run_nextpnr
from blysk.bench.tools.tool_runner import MOUNT, TooLarge, ToolError, ToolRunner, Watch
from blysk.sim.engines.cache import cache_folder, version_of
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra
from blysk.sim.output import write_json

__all__ = [
    "MAP_AFTER",
    "MAP_BEFORE",
    "YOSYS",
    "Layout",
    "Registered",
    "at_port",
    "lay_out",
    "map_cells",
    "parts_of",
    "ports_of",
    "read_report",
    "tool_versions",
    "versions_of",
]


# Names of registers stay, because cells get their names. Amaranth's other names are aliases. From an alias
# abc9 makes two cells with one name.
MAP_BEFORE = """\
read_rtlil top.il
hierarchy -top top
proc
flatten
opt_clean -purge
select -set registers t:$*dff* %co1:+[Q] w:* %i
rename -hide w:* @registers %d
"""

MAP_AFTER = """
write_json netlist.json"""

YOSYS = "import sys, pyosys.libyosys as y; d = y.Design(); [d.run_pass(l.strip()) for l in sys.stdin]"

_LARGE = 1000
"""Least number of look-up tables of a large design."""


@dataclass(frozen=True)
class Layout:
    """A design, its parts, and its places from several seeds.

    Parameters
    ----------
    name : str
        The design.
    parts : Parts
        Parts of the design, the same for every seed.
    places : tuple of Place
        A place for each seed.
    """

    name: str
    parts: Parts
    places: tuple[Place, ...]

    @property
    def fmax(self) -> tuple[float, float, float]:
        """Smallest, median and largest clock rate in MHz."""
        rates = [place.fmax for place in self.places]
        return min(rates), median(rates), max(rates)

    @property
    def closed(self) -> int:
        """Multipliers with registers on both sides. nextpnr does not time paths between these registers."""
        return max(place.closed for place in self.places)

    def as_dict(self) -> dict[str, Any]:
        """The figures under stable names."""
        low, middle, high = self.fmax
        return {
            "design": self.name,
            **asdict(self.parts),
            "fmax_min_mhz": low,
            "fmax_median_mhz": middle,
            "fmax_max_mhz": high,
            "closed_multipliers": self.closed,
            "seeds": [asdict(place) for place in self.places],
        }


class Registered(wiring.Component):
    """A component with a register at every port except clock and reset.

    The registers break the handshakes of the component. So this component is for timing, not for simulation.

    Parameters
    ----------
    component : wiring.Component
        Component in the clock domain ``sync``.

    Members
    -------
    The ports of the component, without nesting. Each port is an unsigned word.
    """

    def __init__(self, component: wiring.Component):
        self._component = component
        self._ports = {
            "__".join(map(str, path)): (member.flow, Value.cast(value))
            for path, member, value in component.signature.flatten(component)
            # If a stream is always valid or always ready, its `valid` or `ready` is a constant.
            if not isinstance(Value.cast(value), Const) and len(Value.cast(value))
        }
        super().__init__({name: flow(Shape(len(value))) for name, (flow, value) in self._ports.items()})

    def elaborate(self, platform) -> Module:
        """Add the registers between the ports and the component."""
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
    """Version of each tool by its package. ``None`` if the package is not installed. Nothing is imported."""
    return {package: version_of(package) for package in ("pyosys", family.package)}


def versions_of(family: Family) -> dict[str, str]:
    """Versions of the tools. `InputError` if a tool is not installed."""
    versions = tool_versions(family)
    missing = [package for package, version in versions.items() if version is None]
    if missing:
        verb = "is" if len(missing) == 1 else "are"
        raise InputError("fpga", f"{' and '.join(missing)} {verb} not installed", install_extra(family.extra))
    return versions


def ports_of(netlist: Mapping[str, Any]) -> set[int]:
    """Nets of the ports of a netlist in Yosys's JSON."""
    # Nets are numbers, and constants are texts.
    ports = netlist["modules"]["top"]["ports"].values()
    return {bit for port in ports for bit in port["bits"] if isinstance(bit, int)}


def at_port(cell: Mapping[str, Any], ports: set[int]) -> bool:
    """Whether a flip-flop is directly at a port, as the registers of `Registered` are."""
    return any(ports & {*cell["connections"].get(pin, ())} for pin in ("D", "DI", "Q"))


def parts_of(netlist: Mapping[str, Any], report: Mapping[str, Any], family: Family = ECP5) -> Parts:
    """Parts of a mapped netlist. The number of look-up tables comes from nextpnr's report.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON of a `Registered` component.
    report : dict
        nextpnr's report, JSON.
    family : Family
        Family to which the netlist is mapped.
    """
    cells = netlist["modules"]["top"]["cells"].values()
    ports = ports_of(netlist)

    def count(pattern: str) -> int:
        return sum(bool(re.fullmatch(pattern, cell["type"])) for cell in cells)

    return Parts(
        luts=int(report["utilization"][family.look_up_tables]["used"]),
        flip_flops=sum(
            bool(re.fullmatch(family.flip_flop, cell["type"])) and not at_port(cell, ports) for cell in cells
        ),
        multipliers=count(family.multiplier),
        block_rams=count(family.block_ram),
        distributed_rams=count(family.distributed_ram),
    )


def _refuse_untimed(netlist: Mapping[str, Any], family: Family) -> None:
    """Refuse a netlist if it has a cell through which nextpnr does not time paths."""
    for cell in netlist["modules"]["top"]["cells"].values():
        kind = cell["type"]
        for name in (kind, *(f"{kind}.{key}={value}" for key, value in cell["parameters"].items())):
            if re.fullmatch(family.untimed, name):
                raise ToolError(f"the netlist has a cell {name}, which nextpnr does not time paths through")


def _refuse_too_large(kinds: Mapping[str, int], family: Family) -> None:
    """Refuse a netlist that has more cells of a kind than fit. The placer would try for ever."""
    for name, pattern, most in (
        ("flip-flops", family.flip_flop, family.capacity.flip_flops),
        ("multipliers", family.multiplier, family.capacity.multipliers),
        ("block RAMs", family.block_ram, family.capacity.block_rams),
        ("look-up tables", "LUT4", family.capacity.luts),
    ):
        count = sum(number for kind, number in kinds.items() if re.fullmatch(pattern, kind))
        if count > most:
            raise TooLarge(f"does not fit: {count:,} {name}, ports too, on {most:,} of the {family.device}")


def _write_without_ports(path: Path, netlist: Mapping[str, Any]) -> None:
    """Write a netlist without its ports for placement. A design may have more ports than an FPGA has pins."""
    top = {**netlist["modules"]["top"], "ports": {}}
    path.write_text(json.dumps({**netlist, "modules": {**netlist["modules"], "top": top}}), encoding="utf-8")


def read_report(report: Mapping[str, Any], seed: int, family: Family = ECP5, closed: int = 0) -> Place:
    """Place of a design, from nextpnr's report on its one clock.

    Parameters
    ----------
    report : dict
        The report, JSON.
    seed : int
        Seed of the placement.
    family : Family
        Family of the device.
    closed : int
        Multipliers of the design with registers inside on both sides.

    Raises
    ------
    ToolError
        If the report has no clock or several clocks, or no path between rising edges of the clock.
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
        fmax = float(rate["achieved"])
        return Place(
            seed=seed,
            fmax=min(fmax, family.limit) if closed and family.limit else fmax,
            start=signal_name(path[0]["from"]["cell"], family),
            end=f"{signal_name(path[-1]['to']['cell'], family)}.{path[-1]['to']['port']}",
            logic=logic,
            routing=routing,
            kinds=dict(Counter(kind_of_cell(cell, family) for cell in passed)),
            closed=closed,
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise ToolError(f"nextpnr's report is not as expected: {error!r}") from error


# The cache: a file for each netlist, tools and seed.


def _load(path: Path) -> tuple[Parts, Place] | None:
    try:
        entry = json.loads(path.read_text(encoding="utf-8"))
        return Parts(**entry["parts"]), Place(**entry["place"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):
        # The entry is from another program or another release.
        return None


def _store(path: Path, parts: Parts, place: Place) -> None:
    # If the entry cannot be written, only the next run takes longer.
    with contextlib.suppress(InputError, OSError):
        write_json(path, {"parts": asdict(parts), "place": asdict(place)})


def _stuck(said: str) -> str:
    """Reason why nextpnr will not end, from its log: `SLOW` or `CROWDED`. Empty if it may end."""
    return SLOW if is_slow(said) else CROWDED if is_crowded(said) else ""


def lay_out(
    name: str,
    component: wiring.Component,
    seeds: int = SEEDS,
    jobs: int = 1,
    progress: Callable[[], object] = lambda: None,
    tell: Callable[[str], object] = lambda line: None,
    family: Family = ECP5,
    absorb: bool = True,
) -> Layout:
    """Synthesise a component, then place and route it from seeds 1, 2, ....

    Results are kept in the cache, by netlist, tools and options. The mapped netlist and the result of each
    seed are kept as soon as they are there. So an interrupted run can continue.

    Parameters
    ----------
    name : str
        Name of the design.
    component : wiring.Component
        Component in the clock domain ``sync``.
    seeds : int
        Number of seeds.
    jobs : int
        Number of processes at a time.
    progress : callable
        Called after each seed.
    tell : callable
        Called with a line of each running tool every 30 seconds, see `Watch`.
    family : Family
        Family of the device.
    absorb : bool
        Whether `absorb_registers` moves registers into multipliers, if the family has a `Family.limit`.

    Raises
    ------
    InputError
        If a tool is not installed.
    TooLarge
        If the design does not fit.
    ToolError
        If a tool fails, or nextpnr cannot time the netlist.
    """
    tools = versions_of(family)
    netlist = rtlil.convert(Registered(component), name="top", emit_src=False)
    absorb = absorb and family.limit is not None
    step = text_of_step() if absorb else ""
    parts = (netlist, MAP_BEFORE, MAP_AFTER, YOSYS, step, repr(family), repr(tools))
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
        kept = KeptBuild(parts)
        with contextlib.closing(_run(netlist, missing, jobs, family, absorb, kept, tell)) as results:
            for seed, entry in results:
                _store(folder / f"{key}-{seed}.json", *entry)
                found[seed] = entry
                progress()
    return Layout(name, found[1][0], tuple(found[seed][1] for seed in range(1, seeds + 1)))


def map_cells(
    netlist: str,
    folder: Path,
    runner: ToolRunner,
    family: Family,
    absorb: bool,
    kept: KeptBuild | None = None,
    watch: Watch | None = None,
) -> tuple[dict[str, Any], Absorbed]:
    """Map a netlist in RTLIL to a family's cells. Returns Yosys's JSON, and counts of `absorb_registers`.

    With ``kept``, the mapped netlist is taken from the cache, or kept there.
    """
    if kept is None or not kept.take(folder, "netlist.json"):
        (folder / "top.il").write_text(netlist, encoding="utf-8")
        script = MAP_BEFORE + family.synthesis + MAP_AFTER
        runner.run("Yosys", YOSYS, [], folder, script, watch=watch)
        if kept is not None:
            kept.keep(folder, "netlist.json")
    mapped = json.loads((folder / "netlist.json").read_text(encoding="utf-8"))
    _refuse_untimed(mapped, family)
    return absorb_registers(mapped) if absorb else (mapped, Absorbed())


def _run(
    netlist: str,
    seeds: Sequence[int],
    jobs: int,
    family: Family,
    absorb: bool,
    kept: KeptBuild,
    tell: Callable[[str], object],
) -> Iterator[tuple[int, tuple[Parts, Place]]]:
    """Run the tools, and yield the result of each seed as soon as it is done."""
    runner = ToolRunner()
    module = family.package.replace("-", "_")
    nextpnr = f"import sys, {module} as n; sys.exit(n.{module.replace('yowasp', 'run')}(sys.argv[1:]))"
    with tempfile.TemporaryDirectory(prefix="blysk-") as name, ThreadPoolExecutor(jobs) as pool:
        folder = Path(name)
        try:
            watch = Watch("mapping", tell)
            mapping = pool.submit(map_cells, netlist, folder, runner, family, absorb, kept, watch)
            mapped, absorbed = mapping.result()
            _write_without_ports(folder / "top.json", mapped)
            kinds = Counter(cell["type"] for cell in mapped["modules"]["top"]["cells"].values())
            _refuse_too_large(kinds, family)
            options = (
                *family.options,
                "--freq",
                str(family.target),
                *(family.large if kinds["LUT4"] >= _LARGE else ()),
            )

            def route(seed: int) -> tuple[int, tuple[Parts, Place]]:
                path = folder / f"{seed}.json"
                files = ["--json", f"{MOUNT}/top.json", "--report", f"{MOUNT}/{path.name}"]
                arguments = [*options, *files, "--seed", str(seed)]
                try:
                    given_up = run_nextpnr(runner, nextpnr, arguments, folder, f"seed {seed}", tell, _stuck)
                except ToolError as error:
                    if "legal placement" in str(error):
                        raise TooLarge(f"does not fit: from seed {seed} {error}") from None
                    raise
                report = json.loads(path.read_text(encoding="utf-8"))
                place = read_report(report, seed, family, absorbed.closed)
                place = replace(place, rerouted=SLOW in given_up, default_placer=CROWDED in given_up)
                return seed, (parts_of(mapped, report, family), place)

            waiting = [pool.submit(route, seed) for seed in seeds]
            for done in as_completed(waiting):
                yield done.result()
        finally:
            runner.stop()
            pool.shutdown(cancel_futures=True)
