"""Shared parts of the commands: work that can be interrupted, and the exit status."""

import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence

import click

from blysk.sim.cli.progress import progress
from blysk.sim.errors import CompilerMissing, InputError, SimulationError

__all__ = ["resumable", "run"]


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
