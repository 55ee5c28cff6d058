"""A command whose file is imported when it runs: the list of commands does not wait for all of them."""

from importlib import import_module

import click

__all__ = ["LazyCommand"]


class LazyCommand(click.Command):
    """Place of a command in another file.

    Parameters
    ----------
    line : str
        What the command does, for the list of commands.
    module : str
        The file; it has the command by the name ``command``.
    """

    def __init__(self, line: str, module: str):
        super().__init__(module.rpartition(".")[2], short_help=line)
        self.module = module

    def load(self) -> click.Command:
        """The command, from its file."""
        return import_module(self.module).command
