"""Options of commands, from the tables of the Python interface."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import click
from click.core import ParameterSource

from blysk.sim.api.lights import Lights
from blysk.sim.api.options import LIGHTS, SCENE, Option
from blysk.sim.errors import InputError
from blysk.sim.value_types import Truth

__all__ = ["given_options", "options_of"]

Command = Callable[..., Any]


def _text(value: object) -> str:
    """A default in the form of the command line."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return ("x" if isinstance(value[0], int) else ",").join(f"{part:g}" for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _click_option(name: str, option: Option) -> Callable[[Command], Command]:
    text = option.help + " Repeat for more." * isinstance(option.kind, Lights)
    if option.default is not None:
        text += f"  [default: {_text(option.default)}]"
    if isinstance(option.kind, Lights):
        return click.option(_flag(name), name, multiple=True, type=option.kind.numbers, help=text)
    flag = f"--{name.replace('_', '-')}"
    if isinstance(option.kind, Truth):
        return click.option(f"{flag}/--no-{flag[2:]}", name, default=None, help=text)
    return click.option(flag, name, type=option.kind, help=text)


def options_of(table: Mapping[str, Option]) -> Callable[[Command], Command]:
    """Decorator of a command that adds the options of a table.

    The options have no defaults here, because the Python interface sets the missing values. An option of
    lights (``--light``, ``--point-light``, ``--spot-light``) takes the numbers of one light. Repeat it for
    more lights.
    """

    def decorate(command: Command) -> Command:
        for name, option in reversed(table.items()):
            command = _click_option(name, option)(command)
        return command

    return decorate


def given_options(context: click.Context, names: Iterable[str]) -> dict[str, Any]:
    """Values of the options that are on the command line.

    Raises
    ------
    InputError
        If `Light` refuses the numbers of a light.
    """
    return {
        name: _values(context, name)
        for name in names
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }


def _values(context: click.Context, name: str) -> Any:
    """Value of an option. For an option of lights these are the lights."""
    value, kind = context.params[name], SCENE[name].kind if name in SCENE else None
    if not (isinstance(kind, Lights) and isinstance(value, tuple)):
        return value
    lights = []
    for numbers in value:
        try:
            lights.append(kind.light(numbers))
        except ValueError as error:
            thing = f"{_flag(name)} {','.join(f'{number:g}' for number in numbers)}"
            raise InputError(thing, str(error), kind.remedy) from None
    return lights


def _flag(name: str) -> str:
    """Flag of an option. An option of lights has the flag of a single light."""
    return f"--{name.removesuffix('s') if name in LIGHTS else name}".replace("_", "-")
