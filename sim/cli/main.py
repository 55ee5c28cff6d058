"""The command line: commands of this folder, and commands of installed packages."""

import os
import re
import signal
import sys
import threading
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

import click

from blysk.golden.methods.installed import MethodError
from blysk.hdl.emit.errors import NetlistError
from blysk.sim.cli.lazy_command import LazyCommand
from blysk.sim.engines.cache import provide_caches
from blysk.sim.errors import CompilerMissing, InputError, OptionError, SimulationError, one_line
from blysk.sim.run_files import RunFiles

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["cli", "main"]

_COMMANDS = {
    "render": LazyCommand(
        "Render a mesh or a scene file through the simulated pipeline.", "blysk.sim.cli.render"
    ),
    "verilog": LazyCommand("Emit the pipeline as Verilog.", "blysk.sim.cli.verilog"),
}
"""Commands of this folder."""


class _Group(click.Group):
    """Group of this folder's commands, and of commands that packages register under ``blysk.commands``.

    Higher layers add their commands in this way.
    """

    def list_commands(self, ctx):
        return sorted({*_COMMANDS, *_installed()})

    def get_command(self, ctx, cmd_name):
        # These come before the import: Matplotlib looks for its folder when it is imported, and NumPy starts
        # a thread for each core, which takes longer than the products of this package.
        provide_caches()
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        found = _command(cmd_name)
        return found.load() if isinstance(found, LazyCommand) else found

    def format_commands(self, ctx, formatter):
        """Write the list of commands from their lines, without loading a command."""
        found = {name: _command(name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl([(name, one.get_short_help_str(80)) for name, one in found.items() if one])


@cache
def _installed() -> dict[str, "EntryPoint"]:
    """Commands of installed packages by name. This reads the metadata of every package."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group="blysk.commands")}


def _command(name: str) -> click.Command | None:
    """A command of this folder or of an installed package.

    The command may not be loaded yet. ``None`` if no command has this name.
    """
    if name in _COMMANDS:
        return _COMMANDS[name]
    return _installed()[name].load() if name in _installed() else None


@click.group(cls=_Group, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(
    None, "--version", package_name="blysk", prog_name="blysk", message="%(prog)s %(version)s"
)
def cli():
    """Phong and Blinn shading by simulated hardware.

    \b
    Example:
        blysk render teapot --exponent 100 --compare teapot.png
    """
    try:
        os.getcwd()
    except OSError as error:
        reason = f"cannot be used ({error.strerror})"
        raise InputError("the current folder", reason, "change to a folder that exists") from error


def _run(arguments: list[str]) -> int:
    """`cli.main` without click's handling of an interrupt and a closed pipe."""
    try:
        with RunFiles().active(), cli.make_context("blysk", arguments) as context:
            cli.invoke(context)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    return 0


def _without_traceback(text: str) -> str:
    """Output of another program. A traceback is cut to its last line, without the name of the exception."""
    start, mark, rest = text.partition("Traceback (most recent call last)")
    if not mark:
        return text
    last = rest.strip().splitlines()[-1].strip()
    return start + re.sub(r"^([A-Za-z_]\w*\.)*[A-Z]\w*(Error|Exception|Trap): *", "", last)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return the exit status.

    - 0: done.
    - 1: a simulation failed.
    - 2: bad input, or no compiler, memory or disk space; standard error has one line.
    - 130: interrupted, by a terminal or by SIGTERM.
    - 141: standard output is a closed pipe.
    """

    def show(message, *_):
        # A progress bar may be shown: `write` puts the line above it.
        from tqdm import tqdm

        tqdm.write(f"blysk: warning: {one_line(str(message))}", file=sys.stderr)

    # Cached models leave components that nothing elaborates. Some of these live until the program ends.
    warnings.filterwarnings("ignore", message=r"<blysk\.")
    # The name of a file may have letters that the terminal cannot show, or bytes that are not text.
    if hasattr(sys.stdout, "reconfigure"):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with _termination_as_interrupt(), warnings.catch_warnings():
            warnings.simplefilter("default", RuntimeWarning)
            warnings.showwarning = show
            status = _run(sys.argv[1:] if arguments is None else list(arguments))
        # A closed pipe or a full disk behind standard output raises its error here, not at exit.
        print(end="", flush=True)
        return status
    except (click.Abort, KeyboardInterrupt):
        print("blysk: interrupted", file=sys.stderr)
        return 130
    except OptionError as error:
        print(f"blysk: {_option_error(error)}", file=sys.stderr)
        return 2
    except (InputError, MethodError) as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 2
    except click.ClickException as error:
        print(f"blysk: {one_line(error.format_message().rstrip('.'))}; see blysk --help", file=sys.stderr)
        return 2
    except CompilerMissing as error:
        print(f"blysk: {error}", file=sys.stderr)
        return 2
    except (NetlistError, SimulationError) as error:
        print(f"blysk: {one_line(_without_traceback(str(error)))}", file=sys.stderr)
        return 1
    except MemoryError:
        print("blysk: out of memory; use a smaller --size or mesh", file=sys.stderr)
        return 2
    except BrokenPipeError:
        _give_up_output()
        return 141
    except OSError as error:
        text = one_line(f"{error.filename or 'standard output'}: {error.strerror or error}")
        print(f"blysk: {text}; free some space, or send the output elsewhere", file=sys.stderr)
        _give_up_output()
        return 2


def _option_error(error: OptionError) -> InputError:
    """The error of an option, with the name that the option has on the command line."""
    option = error.option
    flag = (option.removesuffix("s") if option.endswith("lights") else option).replace("_", "-")
    return error.at(f"--{flag} {error.value}".strip())


@contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """Treat SIGTERM as an interrupt, so that workers end and no half-written files stay."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _give_up_output() -> None:
    """Send standard output to the null device. Then its buffer raises no second error at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
