"""Place and route: parts of an FPGA that a unit or the pipeline takes, and its clock rate.

``blysk fpga`` prints it, from tools that pip installs: Yosys (package ``pyosys``) maps the netlist to the
cells of a family of FPGAs, nextpnr (a package a family) places and routes them on a device of the family in
its slowest speed grade, out of context: ports are no pins. Placement starts from a seed, and the clock rate
differs by a few per cent between seeds. There is a `Family` for Lattice's ECP5 and one for Nexus.

Every port has a register before or behind it, so that every path of the design is between registers and
counts; these registers are not among the counted parts. The delay of reset is not counted.

On ECP5 `absorb_registers` moves registers beside a multiplier into it, as Yosys does not. nextpnr times a
multiplier with registers on one side in full, but not the path between registers on both sides. The clock
rate of a design with such a multiplier is quoted up to `Family.limit`, and the design is named below the
table.

On Nexus nextpnr times each stage of a multiplier, with its registers' clock-to-output and setup times, and
Yosys moves registers beside a multiplier into it; only a multiplier with an adder inside has no delay, and is
refused.
"""

import os
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import click
from amaranth.lib import wiring

from blysk.bench.command import progress
from blysk.bench.tools.blocks import ENTRIES
from blysk.bench.tools.families import DEVICES, ECP5, ECP5_85F, Family, Parts
from blysk.bench.tools.parts_by_unit import parts_by_unit, sum_parts
from blysk.bench.tools.place_and_route import SEEDS, Layout, lay_out, versions_of
from blysk.bench.tools.tool_runner import TooLarge
from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.presets import METHODS
from blysk.hdl.bus.tops import TOPS
from blysk.sim.api.design import design, pixel_pipelines, renderer_of
from blysk.sim.api.options import DESIGN, PIPES, PORTS, SETUPS
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.errors import InputError
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Choice, OutputFile, Whole

__all__ = [
    "command",
    "rerouted",
    "table",
    "table_by_unit",
    "untimed",
]


_HEAD = ("design", "LUT", "FF", "mult", "BRAM", "LUTRAM", "min", "median", "max", "slowest path, ns")


def table(layouts: Sequence[Layout], family: Family = ECP5) -> str:
    """The figures as aligned text, below the parts of the device; the path is that of the slowest seed."""
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
    return _aligned(lines, {0, len(_HEAD) - 1})


def table_by_unit(name: str, units: Mapping[str, Parts], family: Family = ECP5) -> str:
    """Parts of each unit as aligned text, between those of the device and those of the whole design."""
    rows = {family.device: family.capacity, **units, name: sum_parts(units)}
    head = ("unit", *_HEAD[1:6])
    return _aligned([head, *((unit, *map(str, asdict(parts).values())) for unit, parts in rows.items())], {0})


def _aligned(lines: Sequence[Sequence[str]], left: Container[int]) -> str:
    """Lines of words as columns; those of ``left`` begin at one place, the others end at one."""
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
                f"{layout.name}: {closed} have registers inside on both sides, between which the tool does "
                f"not time; no clock rate above {family.limit:g} MHz is quoted"
            )


def rerouted(layouts: Sequence[Layout]) -> Iterator[str]:
    """A line for each design that is so far from the target that nextpnr did not route slow paths again."""
    for layout in layouts:
        if seeds := [str(place.seed) for place in layout.places if place.rerouted]:
            yield (
                f"{layout.name}: from seed {', '.join(seeds)} the target was out of reach, "
                "and slow paths were not routed again"
            )


def _units(names: Sequence[str]) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """Entries of the table of the units, by a unit's name (all its variants) or by unit and variant."""
    for name in names:
        found = [entry for entry in ENTRIES if name in (entry.title, entry.record.name)]
        if not found:
            known = ", ".join(dict.fromkeys(entry.record.name for entry in ENTRIES))
            raise InputError(f"--unit {name}", "unknown unit", f"use {known}, or one of their variants")
        yield from ((entry.title, entry.variant.unit) for entry in found)


def _pipelines(
    given: Mapping[str, Any], lights: int, every: bool, pipes: int = 1, top: str = "shader", setups: int = 1
) -> Iterator[tuple[str, Callable[[], wiring.Component]]]:
    """The pipeline or another core by the given options, with one method or with every method."""
    for method in METHODS if every else (given.get("method"),):
        chosen = {**given, "method": method}
        made = design(lights=lights, **chosen)
        name = [f"{'pipeline' if top == 'shader' else top} {made.method}", made.model or "no model"]
        name += [f"{lights} lights" if lights != 1 else "1 light"]
        name += [chosen[option] for option in ("operand",) if option in chosen]
        name += [made.build.style] if made.build.style != "throughput" else []
        name += [f"interval {chosen['setup_interval']}"] if "setup_interval" in chosen else []
        name += ["gate"] if made.gate else []
        name += [f"{pipes} pipelines"] if pipes > 1 else []
        name += [f"{setups} lanes"] if setups > 1 else []
        if top == "shader":
            yield ", ".join(name), partial(pixel_pipelines, made, pipes)
        elif not (made.takes_values or (made.takes_vectors and lights > 1)) or not every:
            yield ", ".join(name), partial(TOPS[top].unit, renderer_of(made, "top", top), setups=setups)


@click.command()
@options_of(DESIGN)
@options_of(PIPES)
@options_of({"top": PORTS["top"]})
@options_of(SETUPS)
@click.option(
    "--family",
    "family_name",
    type=Choice("family", DEVICES),
    help="Of FPGAs: "
    + ", ".join(f"{name}: {family.device}" for name, family in DEVICES.items())
    + ".  [default: ecp5; of several pipelines ecp5-85f]",
)
@click.option("--lights", type=Whole(1, MAX_LIGHTS), default=1, show_default=True, help="Number of lights.")
@click.option("--every-method", is_flag=True, help="The pipeline of every method.")
@click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="NAME",
    help="In place of the pipeline, a unit of the table of blysk blocks: all its variants, or one, as in "
    "'bisection 1, 45'; repeat for more.",
)
@click.option(
    "--target",
    type=Whole(1, 1000),
    default=ECP5.target,
    show_default=True,
    help="Clock rate in MHz that the tool is asked for; one within reach gives more than one far beyond.",
)
@click.option("--seeds", type=Whole(1, 100), default=SEEDS, show_default=True, help="Placements of each.")
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=lambda: min(os.cpu_count() or 1, 4),
    show_default="number of cores, 4 at most",
    help="Placements at once, of half a GB each.",
)
@click.option("--keep-registers", is_flag=True, help="ECP5: no registers inside multipliers.")
@click.option(
    "--by-unit", is_flag=True, help="Parts of each unit inside, as mapped; without placement and clock rate."
)
@click.option("--json", "figures", type=OutputFile(), help="Every figure, and the slowest path of each seed.")
@click.pass_context
def command(
    context,
    family_name,
    lights,
    pipes,
    top,
    setups,
    every_method,
    units,
    target,
    seeds,
    jobs,
    keep_registers,
    by_unit,
    figures,
    **_,
):
    """Place and route the pipeline on an FPGA, and print its parts and clock rate.

    LUT: look-up tables of four inputs, with those that serve as carries and memories; FF: flip-flops, without
    those inside multipliers; mult: multipliers of 18x18 bits; BRAM: block RAMs of 18 Kibit; LUTRAM: memories
    of 16x4 bits in look-up tables. The first line has the parts of the FPGA. Clock rates are in MHz, over the
    seeds. The slowest path is that of the slowest seed: its delay in cells and between them, and the
    registers at its ends. Earlier placements come from the cache. On ECP5 registers beside a multiplier move
    into it; the tool does not time the path between registers on both sides, and a line below the table says
    so.

    \b
    Examples:
        blysk fpga --seeds 3 --json quotient.json
        blysk fpga --family nexus --unit specular
        blysk fpga --pipes 4 --seeds 1
        blysk fpga --top render --style compact --target 115 --seeds 1
        blysk fpga --top render --style compact --by-unit
    """
    pipes = pipes or PIPES["pipes"].default
    family = DEVICES[family_name] if family_name else ECP5_85F if pipes > 1 else ECP5
    family = replace(family, target=target)
    chosen = given_options(context, list(DESIGN))
    top = top or "shader"
    given = [*chosen, *given_options(context, ["lights", "pipes", "top", "setups", "every_method"])]
    if units and given:
        option = f"--{given[0].replace('_', '-')}"
        raise InputError(option, "is for the pipeline", "leave it out, or --unit")
    if every_method and "method" in given:
        raise InputError("--method", "is one of every method", "leave it out, or --every-method")
    if pipes > 1 and top != "shader":
        raise InputError(f"--pipes {pipes}", "triangles go to one pipeline", "leave it out, or --top")
    setups = setups or SETUPS["setups"].default
    if setups > 1 and top == "shader":
        raise InputError(
            f"--setups {setups}", "spans need no triangle setup", "leave it out, or --top geometry or render"
        )
    if by_unit and (placing := given_options(context, ["target", "seeds", "jobs"])):
        raise InputError(f"--{next(iter(placing))}", "nothing is placed", "leave it out, or --by-unit")
    if figures:
        check_writable(figures)
    designs = list(_units(units) if units else _pipelines(chosen, lights, every_method, pipes, top, setups))
    tools = versions_of(family)
    about = {"device": family.device, "capacity": asdict(family.capacity), "tools": tools}
    if by_unit:
        found = {
            name: parts_by_unit(unit(), family, not keep_registers)
            for name, unit in progress(designs, total=len(designs), unit="designs")
        }
        if figures:
            entries = {
                name: {unit: asdict(parts) for unit, parts in of.items()} for name, of in found.items()
            }
            write_json(figures, {**about, "units": entries})
        click.echo("\n\n".join(table_by_unit(name, of, family) for name, of in found.items()))
        return
    layouts, too_large = [], {}
    with progress(total=len(designs) * seeds, unit="placements") as bar:
        for name, unit in designs:
            bar.set_description_str(name)
            try:
                layouts.append(lay_out(name, unit(), seeds, jobs, bar.update, family, not keep_registers))
            except TooLarge as error:
                if len(designs) == 1:
                    raise
                too_large[name] = str(error)
    if figures:
        write_json(
            figures,
            {
                **about,
                "target_mhz": target,
                "designs": [layout.as_dict() for layout in layouts],
                "too_large": too_large,
            },
        )
    click.echo(table(layouts, family))
    for line in (*untimed(layouts, family), *rerouted(layouts)):
        click.echo(line)
    for name, reason in too_large.items():
        click.echo(f"{name}: {reason}")
