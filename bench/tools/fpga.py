"""Place and route: parts of an FPGA that a unit or the pipeline takes, and its clock rate.

``blysk fpga`` prints both. pip installs the tools. Yosys (package ``pyosys``) maps the netlist to the cells
of a family of FPGAs. nextpnr (a package for each family) places and routes the cells on a device of the
family in its slowest speed grade. nextpnr works out of context, so ports are not pins. Placement starts from
a seed. The clock rate differs by a few per cent between seeds. There is a `Family` for Lattice's ECP5, and
another for Nexus.

Every port has a register before or behind it. So every path of the design lies between registers and is
timed. These registers are not among the counted parts. The delay of reset is not counted.

On ECP5 Yosys leaves registers beside a multiplier outside, and `absorb_registers` moves them into the
multiplier. nextpnr then times paths through a multiplier with registers on one side. It does not time a path
between registers on both sides. A design with this path is quoted with at most `Family.limit`, and is named
below the table.

On Nexus Yosys moves registers beside a multiplier into the multiplier. nextpnr times each stage of a
multiplier, with clock-to-output and setup times of its registers. Only for a multiplier with an adder inside
does nextpnr know no delay. A design with this multiplier is refused.
"""

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import click
from amaranth.lib import wiring

from blysk.bench.tools.blocks import entries_shown
from blysk.bench.tools.families import ECP5, Family, Parts
from blysk.bench.tools.parts_by_unit import parts_by_unit, sum_parts
from blysk.bench.tools.place_and_route import Layout, lay_out, versions_of
from blysk.bench.tools.tool_runner import TooLarge
from blysk.bench.units.names import UNITS
from blysk.golden.build import Build
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import METHODS
from blysk.hdl.bus.bus import core_of
from blysk.sim.api.design import built, design
from blysk.sim.cli.progress import progress
from blysk.sim.errors import InputError, OptionError
from blysk.sim.output import write_json

__all__ = [
    "about",
    "aligned",
    "count_by_unit",
    "name_of",
    "pipelines_of",
    "place",
    "run_again",
    "table",
    "table_by_unit",
    "units_of",
    "untimed",
]


Designs = Sequence[tuple[str, Callable[[], wiring.Component]]]
"""Name of each design, and a function that makes it."""

_HEAD = ("design", "LUT", "FF", "mult", "BRAM", "LUTRAM", "min", "median", "max", "slowest path, ns")


def table(layouts: Sequence[Layout], family: Family = ECP5) -> str:
    """Figures as aligned text. The first row has the device's own parts. A path is of the slowest seed."""
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
    return aligned(lines, {0, len(_HEAD) - 1})


def table_by_unit(name: str, units: Mapping[str, Parts], family: Family = ECP5) -> str:
    """Parts of each unit as aligned text. The first row has the device's parts, the last row the design's."""
    rows = {family.device: family.capacity, **units, name: sum_parts(units)}
    head = ("unit", *_HEAD[1:6])
    return aligned([head, *((unit, *map(str, asdict(parts).values())) for unit, parts in rows.items())], {0})


def aligned(lines: Sequence[Sequence[str]], left: Container[int]) -> str:
    """Lines of words as columns. Columns in ``left`` are aligned left, and other columns right."""
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        " ".join(
            text.ljust(width) if k in left else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def untimed(layouts: Sequence[Layout], family: Family = ECP5) -> Iterator[str]:
    """A line for each design in which nextpnr leaves the interior of a multiplier untimed."""
    for layout in layouts:
        if layout.closed:
            closed = f"{layout.closed} of {layout.parts.multipliers} multipliers"
            yield (
                f"{layout.name}: {closed} have registers inside on both sides. The tool does not time the "
                f"paths between these registers. No clock rate above {family.limit:g} MHz is quoted."
            )


_RUN_AGAIN = {
    "default_placer": "the static placer found no place for block RAMs or multipliers. nextpnr's default "
    "placer placed the design.",
    "rerouted": "the target was out of reach. The design was routed a second time, without another routing "
    "of slow paths.",
}
"""Sentences about facts of `Place`, behind the seeds."""


def run_again(layouts: Sequence[Layout]) -> Iterator[str]:
    """A line for each design for which nextpnr was run again with other options, see `Place`."""
    for layout in layouts:
        for fact, said in _RUN_AGAIN.items():
            if seeds := [str(place.seed) for place in layout.places if getattr(place, fact)]:
                yield f"{layout.name}: with seed {', '.join(seeds)} {said}"


def units_of(names: Sequence[str]) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """Variants by names. A name of a unit stands for all of its variants in `entries_shown`.

    A name of a unit and a variant stands for this variant.
    """
    for name in names:
        entries = [entry for unit in UNITS for entry in entries_shown(unit)]
        found = [entry for entry in entries if name in (entry.title, entry.record.name)]
        if not found:
            unit = name.split(" ")[0]
            known = dict.fromkeys([unit, *(entry.title for entry in entries if entry.record.name == unit)])
            raise InputError(f"--unit {name}", "unknown variant", f"use {' or '.join(known)}")
        yield from ((entry.title, entry.variant.unit) for entry in found)


_WORDS = {
    "style": "{}",
    "setup_interval": "interval {}",
    "lanes": "{} pixel lanes",
    "pipes": "{} pipelines",
    "setups": "{} lanes",
}
"""Words for build options in the name of a design, if they differ from the option's name and value."""


def name_of(design: ShadingPipeline, operand: str | None = None) -> str:
    """Name of a design in tables: core, method, model, lights, and options other than the defaults."""
    build = design.build
    name = [f"{'pipeline' if build.top == 'shader' else build.top} {design.method}"]
    name += [design.model or "no model"]
    name += [f"{design.lights} lights" if design.lights != 1 else "1 light"]
    name += [operand] if operand else []
    name += ["gate"] if design.gate else []
    name += [" and ".join(design.albedo.parts)] if design.albedo else []
    name += ["grey"] if design.grey else []
    bits = {word: getattr(design, f"{word}_bits") for word in ("x", "y", "length")}
    name += [f"{word} in {number} bits" for word, number in bits.items() if number != LENGTH_BITS]
    name += [design.transfer] if design.transfer != "linear" else []
    default = vars(Build(top=build.top))
    changed = {option: value for option, value in vars(build).items() if value != default[option]}
    name += [_WORDS.get(option, f"{option} {{}}").format(value) for option, value in changed.items()]
    return ", ".join(name)


def pipelines_of(
    given: Mapping[str, Any], every: bool, build: Mapping[str, Any] | None = None
) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """The core by arguments of `design` and options of its build, with the given method.

    With ``every``: the same kind of core, once for each method that serves it. Transfer is linear by default.

    Raises
    ------
    OptionError
        If a value is not accepted, or the only method does not serve the core.
    """
    for method in METHODS if every else (given.get("method"),):
        made = design(**{"transfer": "linear", **given, "method": method})
        try:
            made = built(made, build or {})
        except OptionError as error:
            if every and error.option == "top":
                continue
            raise
        yield name_of(made, given.get("operand")), partial(core_of, made)


def about(family: Family) -> dict[str, Any]:
    """Device, its parts and the tools' versions, for the JSON file. `InputError` if a tool is missing."""
    return {"device": family.device, "capacity": asdict(family.capacity), "tools": versions_of(family)}


def count_by_unit(designs: Designs, family: Family, inside: bool, figures: str | None) -> None:
    """Print the parts of each unit inside the designs, before placement. Parameters are as in `place`."""
    found = {
        name: parts_by_unit(unit(), family, inside)
        for name, unit in progress(designs, total=len(designs), unit="designs")
    }
    if figures:
        entries = {name: {unit: asdict(parts) for unit, parts in of.items()} for name, of in found.items()}
        write_json(figures, {**about(family), "units": entries})
    click.echo("\n\n".join(table_by_unit(name, of, family) for name, of in found.items()))


def place(designs: Designs, family: Family, seeds: int, jobs: int, inside: bool, figures: str | None) -> None:
    """Place and route designs, and print the table.

    Parameters
    ----------
    designs : sequence of (str, callable)
        Name of each design, and a function that makes it.
    family : Family
        The FPGA, and its target clock rate.
    seeds, jobs, inside
        ``seeds``, ``jobs`` and ``absorb`` of `lay_out`.
    figures : str or None
        JSON file for every figure.

    Raises
    ------
    InputError
        If a tool is missing.
    ToolError
        If a tool fails, or the only design does not fit.
    """
    layouts, too_large = [], {}
    with progress(total=len(designs) * seeds, unit="placements") as bar:
        for name, unit in designs:
            bar.set_description_str(name)
            try:
                found = lay_out(name, unit(), seeds, jobs, bar.update, bar.set_postfix_str, family, inside)
                layouts.append(found)
            except TooLarge as error:
                if len(designs) == 1:
                    raise
                too_large[name] = str(error)
    if figures:
        write_json(
            figures,
            {
                **about(family),
                "target_mhz": family.target,
                "designs": [layout.as_dict() for layout in layouts],
                "too_large": too_large,
            },
        )
    click.echo(table(layouts, family))
    for line in (*untimed(layouts, family), *run_again(layouts)):
        click.echo(line)
    for name, reason in too_large.items():
        click.echo(f"{name}: {reason}")
