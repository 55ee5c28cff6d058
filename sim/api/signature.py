"""Signatures and docstrings of functions with options, from the tables of options."""

import inspect
import re
from collections.abc import Callable, Mapping
from textwrap import fill
from types import GenericAlias
from typing import Any, TypeVar

from blysk.sim.api.lights import Lights
from blysk.sim.api.options import Option
from blysk.sim.value_types import Choice

__all__ = ["in_python", "with_options"]

Function = TypeVar("Function", bound=Callable[..., Any])


def in_python(text: str) -> str:
    """A help text of the command line in the words of Python: ``--method chord-local`` becomes a keyword."""
    text = re.sub(r"--([a-z][a-z-]*) ([a-z][a-z-]+)\b", lambda m: f'{_name(m[1])}="{m[2]}"', text)
    return re.sub(r"--([a-z][a-z-]*)", lambda m: _name(m[1]), text)


def _name(flag: str) -> str:
    return flag.replace("-", "_")


def with_options(table: Mapping[str, Option], types: type | None = None) -> Callable[[Function], Function]:
    """Decorator of a function that takes the options of a table. `help` shows each option by its name.

    Parameters
    ----------
    table : dict
        The options. The signature has their defaults. It has no types, because types would hide the names.
    types : TypedDict, optional
        Type of each option. If given, the docstring gets a section with type, default and help of each
        option.
    """

    def decorate(function: Function) -> Function:
        kept = [
            parameter.replace(annotation=parameter.empty)
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.kind is not parameter.VAR_KEYWORD and name not in table
        ]
        added = [
            inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=option.default)
            for name, option in table.items()
        ]
        function.__signature__ = inspect.Signature([*kept, *added])  # type: ignore[attr-defined]
        if types and function.__doc__:
            function.__doc__ = f"{inspect.cleandoc(function.__doc__)}\n\n{_section(table, types)}"
        return function

    return decorate


def _section(table: Mapping[str, Option], types: type) -> str:
    lines = ["Other Parameters", "----------------"]
    for name, option in table.items():
        kind = types.__annotations__[name]
        shown = kind.__name__ if isinstance(kind, type) and not isinstance(kind, GenericAlias) else str(kind)
        shown = re.sub(r"\b(typing|collections\.abc|blysk(\.\w+)*)\.", "", shown)
        default = "" if option.default is None else f", default {option.default!r}"
        lines.append(f"{name} : {shown}{default}")
        text = re.sub(r"  \[default: (.*)\]$", r" By default \1.", option.help)
        if isinstance(option.kind, Choice) and kind is str:
            text += f" One of {', '.join(option.kind.names)}."
        if isinstance(option.kind, Lights):
            text += " Or a list of such lights."
        lines.append(fill(in_python(text), 100, initial_indent="    ", subsequent_indent="    "))
    return "\n".join(lines)
