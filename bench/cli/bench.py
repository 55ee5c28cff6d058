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
@click.option("--quick", is_flag=True, help="Use small pictures and few samples; takes minutes.")
@click.option(
    "--mesh",
    "meshes",
    type=click.Path(),
    multiple=True,
    metavar="FILE",
    help="Also measure this mesh. Repeat for more.",
)
@click.option(
    "--only",
    "names",
    type=_Name(),
    multiple=True,
    metavar="SECTION",
    help=f"Write only this section: {', '.join(sections.SECTIONS)}. Repeat for more.",
)
@click.option(
    "--committed-rates",
    "committed",
    is_flag=True,
    help="Take the committed clock rates. A full report otherwise places and routes designs for hours.",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    help="Processes, with up to 1 GB each. Measurements of time run alone.  [default: number of cores]",
)
@click.option(
    "--cluster",
    "address",
    metavar="ADDRESS",
    help="Dask scheduler, tcp://host:8786. Its workers measure everything but times; this machine measures "
    "times.",
)
def command(folder, quick, meshes, names, committed, jobs, address):
    """Measure error against run time and all other figures of the report, and write the report into FOLDER.

    The default FOLDER is report. The command makes it, or replaces an earlier report in it. The page
    index.html is one file that any browser opens from disk. Each table is also a CSV file, the drawing of
    each conclusion is also an SVG file, and report.json has every figure. The cache keeps each measurement,
    so a stopped report continues if the code is the same.

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
            raise InputError("--mesh", "the workers of a cluster do not have the file", "leave out --cluster")
    for mesh in meshes:
        check_mesh_file(mesh)
    check_folder(folder)
    environment()
    names = [name for name in sections.SECTIONS if name in names or not names]
    chosen = chosen_tasks(quick, meshes, names, places=not committed)
    with resumable(sum(len(own) for _, own in chosen), "measurements") as count:
        made = measured(chosen, jobs or processors(), count, address)
        write_report(folder, made, about(quick, meshes, names) | {"cluster": address})
    click.echo(f"{'report':<12}{folder / PAGE}")
