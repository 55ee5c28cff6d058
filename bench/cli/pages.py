"""``blysk pages``: a page of each unit; see `blysk.bench.tools.pages`."""

from pathlib import Path

import click

from blysk.bench.command import progress
from blysk.bench.tools.pages_folder import check_folder
from blysk.sim.units.names import UNITS
from blysk.sim.value_types import Choice

__all__ = ["command"]


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), default="docs/blocks")
@click.option(
    "--unit", "units", type=Choice("unit", UNITS), multiple=True, help="This page alone; repeat for more."
)
def command(folder, units):
    """Write a page for each unit, with drawings of structure, timing and errors, into FOLDER.

    FOLDER is docs/blocks by default, and is made if there is none. Pictures that a page no longer has are
    removed, other files stay.

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
