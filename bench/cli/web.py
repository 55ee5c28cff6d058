"""``blysk web``: the live page; see `blysk.bench.tools.web`."""

from pathlib import Path

import click

from blysk.bench.tools.web_designs import DESIGNS, SERVED, TABLES
from blysk.bench.tools.web_folder import PAGE, check_extras, check_folder, folders_of, report_files
from blysk.golden.presets import METHODS, MIRROR_LOBES, MODELS
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import processors
from blysk.sim.value_types import Whole

__all__ = ["command"]


class _Design(click.ParamType):
    """Type of an option: a method and a model with a stroke between them."""

    name = "METHOD/MODEL"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        method, _, model = value.partition("/")
        if method not in SERVED:
            raise InputError(f"--design {value}", "unknown method", f"use one of {', '.join(SERVED)}")
        served = (*TABLES, *MIRROR_LOBES) if METHODS[method].TAKES_VECTORS else (*MODELS, *TABLES)
        if model not in served:
            raise InputError(f"--design {value}", "unknown model", f"use one of {', '.join(served)}")
        return method, model


@click.command()
@click.option(
    "-o",
    "--output",
    "folder",
    type=click.Path(path_type=Path),
    default="site",
    show_default=True,
    help="Folder of the site; it is made, or an earlier site in it replaced.",
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="A report by `blysk bench`, in place of the quick one that is measured for the site.",
)
@click.option(
    "--pages",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Pages of the units by `blysk pages`.  [default: docs/blocks of the project, if it is there]",
)
@click.option(
    "--design",
    "designs",
    type=_Design(),
    multiple=True,
    help=f"A module of this method and model alone; repeat for more.  [default: {len(DESIGNS)} of them]",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=processors,
    show_default="number of cores",
    help="Processes that compile.",
)
def command(folder, report, pages, designs, jobs):
    """Write a static site: the pipeline as WebAssembly, simulated live while the light is moved.

    The page index.html opens from disk and from any web server, and loads only files of the site. The site
    also has the report of error against run time, guide and theory, and the pages of the units. The first
    time takes some minutes; modules, spans and measurements are kept in the cache, and made again after the
    code has changed.

    \b
    Example:
        blysk web -o site
        blysk web -o site --report report
    """
    check_folder(folder)
    folders = folders_of(pages)
    if report is not None:
        report_files(report)
    check_extras()
    from blysk.bench.tools.web import make_site

    make_site(folder, report, folders, designs, jobs)
    click.echo(f"{'site':<12}{folder / PAGE}")
