"""A command whose file is imported when it runs, so that the list of commands is quick."""

from importlib import import_module

import click

__all__ = ["LazyCommand"]


class LazyCommand(click.Command):
    """A command whose module is imported when the command runs.

    Parameters
    ----------
    line : str
        Purpose of the command, for the list of commands.
    module : str
        Module with the command, which has the name ``command``.
    """

    def __init__(self, line: str, module: str):
        super().__init__(module.rpartition(".")[2], short_help=line)
        self.module = module

    def load(self) -> click.Command:
        """The command, from its file."""
        return import_module(self.module).command
