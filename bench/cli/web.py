"""``blysk web``: the live page; see `blysk.bench.web.web`."""

from pathlib import Path

import click

from blysk.bench.web.web_designs import DESIGNS, SERVED, TABLES
from blysk.bench.web.web_folder import PAGE, check_extras, check_folder, docs_files, report_files
from blysk.golden.presets import METHODS, MIRROR_LOBES, MODELS
from blysk.sim.errors import InputError
from blysk.sim.frames.workers import processors
from blysk.sim.run_files import reads
from blysk.sim.value_types import Whole

__all__ = ["command"]


class _Design(click.ParamType):
    """Type of an option: a method and a model with a slash between them."""

    name = "METHOD/MODEL"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        method, _, model = value.partition("/")
        if method not in SERVED:
            raise InputError(f"--design {value}", "unknown method", f"use one of {', '.join(SERVED)}")
        of = METHODS[method]
        served = (*(() if of.needs_table else MODELS), *TABLES, *(MIRROR_LOBES if of.serves_mirror else ()))
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
    help="Folder of the site. The command makes it, or replaces an earlier site in it.",
)
@click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Report of `blysk bench`. Without this option the command measures a quick report.",
)
@click.option(
    "--docs",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Documents, from `make docs`. Without this option the site has none.",
)
@click.option(
    "--design",
    "designs",
    type=_Design(),
    multiple=True,
    help="Compile only this method and model. Repeat for more. Only with quotient/blinn the page has meshes "
    f"with colours and textures.  [default: {len(DESIGNS)} designs]",
)
@click.option(
    "--jobs",
    type=Whole(1, 64),
    default=processors,
    show_default="number of cores",
    help="Processes that compile.",
)
def command(folder, report, docs, designs, jobs):
    """Write a static site: the pipeline as WebAssembly, simulated live while the light is moved.

    The page index.html opens from disk and from any web server, and loads only files of the site. The site
    also has the report of error against run time. `make site` adds guide, Python interface, theory and the
    pages of the units. The first run takes some minutes. The cache keeps modules, spans and measurements
    until the code changes.

    \b
    Example:
        blysk web -o site
        blysk web -o site --report report
    """
    check_folder(folder)
    if docs is not None:
        docs_files(docs)
    if report is not None:
        for path in report_files(report):
            reads(path)
    check_extras()
    from blysk.bench.web.web import make_site

    make_site(folder, report, docs, designs, jobs)
    click.echo(f"{'site':<12}{folder / PAGE}")
