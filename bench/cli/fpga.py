"""``blysk fpga``: place and route; see `blysk.bench.tools.fpga`."""

import os
from dataclasses import replace

import click

from blysk.bench.tools.defaults import SEEDS
from blysk.bench.tools.device_names import DEVICE_NAMES
from blysk.bench.tools.families import DEVICES, ECP5, ECP5_85F
from blysk.sim.api.design import built, design
from blysk.sim.api.options import BUILD, DESIGN, NEEDS
from blysk.sim.cli.options import given_options, options_of
from blysk.sim.errors import InputError
from blysk.sim.output import check_writable
from blysk.sim.value_types import Choice, OutputFile, Whole

__all__ = ["command"]

_BUILD = {name: BUILD[name] for name in ("lanes", "pipes", "top", "setups", "memories")}
_NEEDS = {name: NEEDS[name] for name in ("lights", "albedo", "grey", "x_bits", "y_bits", "length_bits")}
# The committed figures are of linear light.
_DESIGN = DESIGN | {"transfer": DESIGN["transfer"]._replace(default="linear")}


@click.command()
@options_of(_DESIGN)
@options_of(_BUILD)
@options_of(_NEEDS)
@click.option(
    "--family",
    "family_name",
    type=Choice("family", DEVICES),
    help="Family of FPGAs. "
    + "; ".join(f"{name}: {family.device}" for name, family in DEVICES.items())
    + ".  [default: ecp5; for several pipelines or four lanes ecp5-85f]",
)
@click.option(
    "--device",
    "devices",
    multiple=True,
    type=Choice("device", (*DEVICE_NAMES, "all")),
    help="Print the parts on FPGAs of this kind by Yosys alone, without placement. Repeat for more. "
    + "; ".join(f"{name}: {device}" for name, device in DEVICE_NAMES.items())
    + ".",
)
@click.option("--every-method", is_flag=True, help="Place the pipeline of every method.")
@click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="NAME",
    help="Place this unit in place of the pipeline. Names are those of blysk blocks. Add a variant to place "
    "only this variant, as in 'bisection 1, 45'. Repeat for more.",
)
@click.option(
    "--target",
    type=Whole(1, 1000),
    default=ECP5.target,
    show_default=True,
    help="Clock rate in MHz that the tools aim at. A target within reach gives a higher rate than a target "
    "far beyond reach.",
)
@click.option(
    "--seeds", type=Whole(1, 100), default=SEEDS, show_default=True, help="Placements of each design."
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=lambda: min(os.cpu_count() or 1, 4),
    show_default="number of cores, 4 at most",
    help="Placements at the same time, with half a GB each.",
)
@click.option("--keep-registers", is_flag=True, help="ECP5: move no registers into multipliers.")
@click.option(
    "--by-unit",
    is_flag=True,
    help="Print the mapped parts of each inner unit, without placement and clock rate.",
)
@click.option(
    "--json",
    "figures",
    type=OutputFile(),
    help="JSON file with every figure, and the slowest path of each seed.",
)
@click.pass_context
def command(
    context,
    family_name,
    devices,
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

    \b
    LUT     look-up tables of four inputs, with tables used as carries and memories
    FF      flip-flops outside multipliers
    mult    multipliers of 18x18 bits
    BRAM    block RAMs of 18 Kibit
    LUTRAM  memories of 16x4 bits in look-up tables

    The first line has the parts of the FPGA. Clock rates are in MHz, over the seeds. The slowest path is from
    the slowest seed: the delay in cells, the delay between cells, and the registers at both ends. The cache
    keeps earlier placements. On ECP5, registers beside a multiplier move into the multiplier. The tool does
    not time paths between registers on both sides of a multiplier. Lines below the table name the designs
    with these paths.

    With --device the parts are cells of this FPGA, in the sizes of its family. Further columns have cells of
    carries, and all other cells, such as wide multiplexers and inverters.

    \b
    Examples:
        blysk fpga --seeds 3 --json quotient.json
        blysk fpga --family nexus --unit specular
        blysk fpga --pipes 4 --seeds 1
        blysk fpga --albedo colors --transfer srgb
        blysk fpga --top render --style compact --target 115 --seeds 1
        blysk fpga --top render --style compact --by-unit
        blysk fpga --device xc7 --device gowin
        blysk fpga --device ice40 --memories synchronous
    """
    chosen, build = given_options(context, [*_DESIGN, *_NEEDS]), given_options(context, _BUILD)
    given = [*chosen, *build, *given_options(context, ["every_method"])]
    if units and given:
        option = f"--{given[0].replace('_', '-')}"
        raise InputError(option, "is for the pipeline", f"leave out {option} or --unit")
    if every_method and "method" in given:
        raise InputError("--method", "every method is placed", "leave out --method or --every-method")
    if devices and (
        placing := given_options(
            context, ["family_name", "target", "seeds", "jobs", "by_unit", "keep_registers"]
        )
    ):
        option = f"--{next(iter(placing)).removesuffix('_name').replace('_', '-')}"
        raise InputError(option, "a --device is mapped by Yosys alone", f"leave out {option} or --device")
    if by_unit and (placing := given_options(context, ["target", "seeds", "jobs"])):
        raise InputError(
            f"--{next(iter(placing))}", "nothing is placed", "leave it out, or leave out --by-unit"
        )
    if figures:
        check_writable(figures)
    if units:
        # The names come from the files of the records.
        from blysk.bench.units.names import UNITS

        if unknown := [name for name in units if name.split(" ")[0] not in UNITS]:
            raise InputError(f"--unit {unknown[0]}", "unknown unit", f"use {', '.join(UNITS)}")
    else:
        # With --every-method the options are checked with the default method, which serves each core.
        built(design(**chosen), build)
    several = build.get("pipes", 1) > 1 or build.get("lanes", 1) > 2
    family = DEVICES[family_name] if family_name else ECP5_85F if several else ECP5
    family = replace(family, target=target)
    from blysk.bench.tools.fpga import about, count_by_unit, pipelines_of, place, units_of
    from blysk.hdl.core.memory import clocked_reads

    designs = list(units_of(units) if units else pipelines_of(chosen, every_method, build))
    clocked = build.get("memories") == "synchronous"
    if devices:
        from blysk.bench.tools.devices import map_devices

        map_devices(
            designs, list(DEVICE_NAMES if "all" in devices else dict.fromkeys(devices)), clocked, figures
        )
        return
    # Report a missing tool before the work.
    about(family)
    with clocked_reads(clocked):
        if by_unit:
            count_by_unit(designs, family, not keep_registers, figures)
        else:
            place(designs, family, seeds, jobs, not keep_registers, figures)
