"""``blysk pages``: a page of each unit; see `blysk.bench.tools.pages`."""

from pathlib import Path

import click

from blysk.bench.tools.pages_folder import check_folder
from blysk.bench.units.names import UNITS
from blysk.sim.cli.progress import progress
from blysk.sim.value_types import Choice

__all__ = ["command"]


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), default="docs/blocks")
@click.option(
    "--unit",
    "units",
    type=Choice("unit", UNITS),
    multiple=True,
    help="Write only this page. Repeat for more.",
)
def command(folder, units):
    """Write a page for each unit, with drawings of structure, timing and errors, into FOLDER.

    The default FOLDER is docs/blocks. The command makes the folder if it does not exist. Pictures that no
    page has any more are removed. Other files stay.

    \b
    Example:
        blysk pages docs/blocks --unit bisection
    """
    units = units or tuple(UNITS)
    check_folder(folder, units)
    from blysk.bench.tools.pages import write_pages

    with progress(total=len(units), unit="pages") as bar:

        def show(unit):
            bar.set_postfix_str(unit)
            bar.update(units.index(unit) - bar.n)

        write_pages(folder, units, progress=show)
    click.echo(f"{'pages':<12}{folder}")
