"""Shared parts of the commands: progress that can be interrupted, and the exit status."""

import contextlib
import io
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

import click
from tqdm import tqdm

from blysk.sim.errors import CompilerMissing, InputError, SimulationError

__all__ = ["progress", "resumable", "run", "steps"]

_SECONDS = 10
"""Seconds between two lines of `progress` without a terminal."""

Part = TypeVar("Part")


class _Lines(tqdm):
    """Progress without a terminal: a line on standard error every `_SECONDS`. Shorter work prints no line."""

    def __init__(self, *arguments, **options):
        self._printed = time.monotonic()
        super().__init__(*arguments, file=io.StringIO(), ncols=0, **options)

    def display(self, msg=None, pos=None):
        """Print the state if the last line is old enough. The empty state at the end is not printed."""
        if msg is None and time.monotonic() - self._printed >= _SECONDS:
            self._printed = time.monotonic()
            print(self, file=sys.stderr, flush=True)


def progress(parts: Iterable[Part] | None = None, *, total: int, unit: str) -> "tqdm[Part]":
    """Progress of long work: a bar on a terminal, else a line on standard error every 10 seconds.

    Parameters
    ----------
    parts : iterable, optional
        Parts of the work. The bar then iterates over them. Without parts, call ``update`` after each part.
    total : int
        Number of the parts.
    unit : str
        Name of the parts.
    """
    kind = tqdm if sys.stderr.isatty() else _Lines
    return kind(parts, total=total, unit=f" {unit}", leave=False)


@contextlib.contextmanager
def steps() -> Iterator[Callable[[str], None]]:
    """Show the steps of long work. Call the context's value with the name of each step.

    On a terminal one line changes. Else each step is a line on standard error.
    """
    if sys.stderr.isatty():
        with tqdm(bar_format="{desc}", leave=False) as bar:
            yield bar.set_description_str
    else:
        yield lambda step: click.echo(f"blysk: {step}", err=True)


@contextlib.contextmanager
def resumable(total: int, unit: str) -> Iterator[Callable[[], None]]:
    """Show the progress of work whose parts are kept. Call the context's value after each part.

    An interrupt ends the command with status 130, and a line with the number of parts that are kept.

    Parameters
    ----------
    total : int
        Number of the parts.
    unit : str
        Name of the parts.
    """
    kept = 0
    with progress(total=total, unit=unit) as bar:

        def count() -> None:
            nonlocal kept
            kept += 1
            bar.update()

        try:
            yield count
        except KeyboardInterrupt:
            bar.close()
            click.echo(f"blysk: stopped; {kept} of {total} {unit} are kept, run again to continue", err=True)
            raise click.exceptions.Exit(130) from None


def run(command: click.Command, name: str, arguments: Sequence[str] | None) -> int:
    """Run a command, and print an error in one line.

    Parameters
    ----------
    command : click.Command
        The command. Its result is an exit status.
    name : str
        Name of the module, for messages.
    arguments : sequence of str or None
        Arguments. ``None``: the arguments of the process.

    Returns
    -------
    int
        Exit status of the command: 1 if a simulation or a tool fails, 2 for bad input.
    """
    try:
        return command.main(arguments, prog_name=name, standalone_mode=False)
    except click.ClickException as error:
        print(f"{name}: {error.format_message().rstrip('.')}; see --help", file=sys.stderr)
    except (InputError, CompilerMissing) as error:
        print(f"{name}: {error}", file=sys.stderr)
    except SimulationError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    return 2
