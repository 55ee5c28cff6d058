"""The end of a command of this folder that is run as a module: its errors in one line, its exit status."""

import sys
from collections.abc import Sequence

import click

from sim.engine import CompilerMissing, SimulationError
from sim.errors import InputError

__all__ = ["run"]


def run(command: click.Command, name: str, arguments: Sequence[str] | None) -> int:
    """Run a command; what goes wrong is told in one line.

    Parameters
    ----------
    command : click.Command
        Its result is an exit status.
    name : str
        Of the module, for messages.
    arguments : sequence of str or None
        ``None``: those of the process.

    Returns
    -------
    int
        The command's; 1 when a simulation or a tool goes wrong, 2 for bad input.
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
