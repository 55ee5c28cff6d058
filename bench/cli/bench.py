"""``blysk bench``: the report; see `blysk.bench.report.report`."""

from pathlib import Path

import click

from blysk.bench.command import resumable
from blysk.bench.report import sections
from blysk.bench.report.page import environment
from blysk.bench.report.report import (
    PAGE,
    about,
    check_folder,
    chosen_tasks,
    measured,
    write_report,
)
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import check_address, processors
from blysk.sim.meshes.mesh_path import check_mesh_file
from blysk.sim.value_types import Whole

__all__ = ["command"]


class _Name(click.ParamType):
    """A name of a section."""

    name = "section"

    def convert(self, value, param, ctx):
        if value not in sections.SECTIONS:
            remedy = f"use one of {', '.join(sections.SECTIONS)}"
            raise InputError(f"{param.opts[0]} {value}", "unknown section", remedy)
        return value


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), default="report")
@click.option("--quick", is_flag=True, help="Small pictures, few samples: minutes.")
@click.option(
    "--mesh",
    "meshes",
    type=click.Path(),
    multiple=True,
    metavar="FILE",
    help="A further mesh; repeat for more.",
)
@click.option(
    "--only",
    "names",
    type=_Name(),
    multiple=True,
    metavar="SECTION",
    help=f"This section alone: {', '.join(sections.SECTIONS)}; repeat for more.",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    help="Processes, of up to a GB each; what measures a time runs alone.  [default: number of cores]",
)
@click.option(
    "--cluster",
    "address",
    metavar="ADDRESS",
    help="Dask scheduler, tcp://host:8786, whose workers measure what is no time; times are this machine's.",
)
def command(folder, quick, meshes, names, jobs, address):
    """Measure error against run time and everything else in the report, and write it into FOLDER.

    FOLDER is report by default; it is made, or an earlier report in it is replaced. The page index.html is
    one file that any browser opens from disk; each table is also a CSV file, each conclusion's drawing an SVG
    file, and report.json has every figure. Each measurement is kept in the cache: a report that was stopped
    continues from there, if the code is the same.

    \b
    Example:
        blysk bench --quick
        blysk bench report --mesh model.obj
    """
    if address is not None:
        check_address(address)
        if jobs:
            raise InputError("--jobs", "a cluster has its own workers", "leave out --jobs or --cluster")
        if meshes:
            raise InputError("--mesh", "the workers of a cluster have not the file", "leave out --cluster")
    for mesh in meshes:
        check_mesh_file(mesh)
    check_folder(folder)
    environment()
    names = [name for name in sections.SECTIONS if name in names or not names]
    chosen = chosen_tasks(quick, meshes, names)
    with resumable(sum(len(own) for _, own in chosen), "measurements") as count:
        made = measured(chosen, jobs or processors(), count, address)
        write_report(folder, made, about(quick, meshes, names) | {"cluster": address})
    click.echo(f"{'report':<12}{folder / PAGE}")
