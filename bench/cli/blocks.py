"""``blysk blocks``: the table of the units; see `blysk.bench.tools.blocks`."""

import os

import click

from blysk.bench.tools.defaults import SAMPLES, SEED
from blysk.sim.cli.progress import progress
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import OutputFile, Whole

__all__ = ["command"]

_MOST_JOBS = 64


@click.command()
@click.option(
    "--samples",
    type=Whole(1000, 10_000_000),
    default=SAMPLES,
    show_default=True,
    help="Samples of each unit.",
)
@click.option(
    "--seed", type=Whole(0, 2**32 - 1), default=SEED, show_default=True, help="Seed of the random operands."
)
@click.option(
    "--jobs",
    type=Whole(1, _MOST_JOBS),
    default=lambda: min(os.cpu_count() or 1, 4),
    show_default="number of cores, 4 at most",
    help="Processes, with a quarter of a GB each.",
)
@click.option("--json", "figures", type=OutputFile(), help="JSON file with every figure, domains and notes.")
def command(samples, seed, jobs, figures):
    """Measure every variant of every unit, and print a table.

    Errors are the largest found. The model error compares the unit's formula in float64 with the exact
    function. The arithmetic error compares the unit with its formula. The total error compares the unit with
    the exact function. An error of 1 is a full term or the length of a unit vector, unless the third column
    names another unit. For units of whole spans a sample is a pixel.

    \b
    rate         of a gate: shares of decisions that let a dark span through,
                 that stop a lit span, and the sum of both
    lat          cycles from an input to its first result
    int          cycles from one result to the next
    ROM, regs    bits
    multipliers  3*18: three of 18x18 bits; 1*c: a product by a constant

    The variant of a bisection is its degree and its widest span in degrees.

    \b
    Example:
        blysk blocks --jobs 4 --json blocks.json
    """
    if figures:
        check_writable(figures)
    from blysk.bench.tools.blocks import ENTRIES, rows, table

    lines = list(progress(rows(ENTRIES, samples, seed, jobs), total=len(ENTRIES), unit="rows"))
    if figures:
        write_json(figures, {"samples": samples, "seed": seed, "blocks": [row.as_dict() for row in lines]})
    click.echo(table(lines))
