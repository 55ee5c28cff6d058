"""Progress of long commands on standard error: bars and steps."""

import contextlib
import io
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

import click
from tqdm import tqdm

__all__ = ["SECONDS", "TOLD", "elapsed", "progress", "steps"]

SECONDS = 10
"""Seconds between two lines of `progress`, and before the line of a late step, without a terminal."""

TOLD = 30
"""Seconds between two lines about a long step."""

Part = TypeVar("Part")


class _Lines(tqdm):
    """Progress without a terminal: a line on standard error every `SECONDS`. Shorter work prints no line."""

    def __init__(self, *arguments, **options):
        self._printed = time.monotonic()
        super().__init__(*arguments, file=io.StringIO(), ncols=0, **options)

    def display(self, msg=None, pos=None):
        """Print the state if the last line is old enough. The empty state at the end is not printed."""
        if msg is None and time.monotonic() - self._printed >= SECONDS:
            self._printed = time.monotonic()
            print(self, file=sys.stderr, flush=True)


def progress(
    parts: Iterable[Part] | None = None, *, total: int | None, unit: str, scaled: bool = False
) -> "tqdm[Part]":
    """Progress of long work: a bar on a terminal, else a line on standard error every 10 seconds.

    Parameters
    ----------
    parts : iterable, optional
        Parts of the work. The bar then iterates over them. Without parts, call ``update`` after each part.
    total : int or None
        Number of the parts. ``None``: the number is not known yet.
    unit : str
        Name of the parts.
    scaled : bool
        Whether large numbers are shortened, as in 120k. The bar of a terminal then begins after a second.
    """
    options = {"total": total, "unit": f" {unit}", "unit_scale": scaled, "leave": False}
    if not sys.stderr.isatty():
        return _Lines(parts, **options)
    return tqdm(parts, delay=1 if scaled else 0, **options)


def elapsed(begin: float) -> str:
    """Time since a value of ``time.monotonic``, as in ``1:05 min``."""
    minutes, seconds = divmod(int(time.monotonic() - begin), 60)
    return f"{minutes}:{seconds:02} min"


@contextlib.contextmanager
def steps(late: bool = False, repeat: bool = True) -> Iterator[Callable[[str], None]]:
    """Show the steps of long work. Call the context's value with the name of each step.

    On a terminal one line changes. Else each step is a line on standard error. Every 30 seconds the running
    step is told again, with its time.

    Parameters
    ----------
    late : bool
        Whether steps without a terminal are shown only from 10 seconds after the first step on.
    repeat : bool
        Whether the running step is told again. Work that tells its state itself does not need this.
    """
    begin = time.monotonic()
    running = [("", begin)]
    ended = threading.Event()

    def say(step: str) -> None:
        if step and (not late or time.monotonic() - begin >= SECONDS):
            click.echo(f"blysk: {step}", err=True)

    with contextlib.ExitStack() as stack:
        if sys.stderr.isatty():
            say = stack.enter_context(tqdm(bar_format="{desc}", leave=False)).set_description_str

        def show(step: str) -> None:
            running[0] = step, time.monotonic()
            say(step)

        def tell_again() -> None:
            # Standard error may be closed.
            with contextlib.suppress(OSError, ValueError):
                while not ended.wait(TOLD):
                    step, since = running[0]
                    say(f"{step}: {elapsed(since)}" if step else "")

        if repeat:
            thread = threading.Thread(target=tell_again, daemon=True)
            thread.start()
            stack.callback(thread.join)
            stack.callback(ended.set)
        yield show
