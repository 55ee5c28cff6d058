"""Options of commands, from the tables of the Python interface."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from blysk.golden.reference.lighting import Light
from blysk.sim.api.options import Option
from blysk.sim.errors import InputError, OptionError
from blysk.sim.value_types import Truth, Vector

__all__ = ["given_options", "lights_of", "option_error", "options_of"]

LIGHT = Vector("a light", (3, 6), "X,Y,Z or X,Y,Z,R,G,B")

_POINT_LIGHT = "Position of a light in the mesh's units, and its colour; needs --method chord-local."

Command = Callable[..., Any]


def _text(value: object) -> str:
    """A default as the command line takes it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return ("x" if isinstance(value[0], int) else ",").join(f"{part:g}" for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _click_option(name: str, option: Option) -> Callable[[Command], Command]:
    flag = f"--{name.replace('_', '-')}"
    text = option.help
    if option.default is not None:
        text += f"  [default: {_text(option.default)}]"
    if isinstance(option.kind, Truth):
        return click.option(f"{flag}/--no-{flag[2:]}", name, default=None, help=text)
    return click.option(flag, name, type=option.kind, help=text)


def options_of(table: Mapping[str, Option]) -> Callable[[Command], Command]:
    """Decorator of a command that adds the options of a table.

    None has a default here: what is not given is left to the Python interface. ``lights`` become ``--light``
    and ``--point-light``, see `lights_of`.
    """

    def decorate(command: Command) -> Command:
        for name, option in reversed(table.items()):
            if name == "lights" and not isinstance(option.default, int):
                point = "Position of a light in the mesh's units, and its colour; needs --method chord-local."
                command = click.option(
                    "--point-light", "point_lights", multiple=True, type=LIGHT, help=point
                )(command)
                direction = f"{option.help}  [default: -0.5,0.8,0.7]"
                command = click.option("--light", "lights", multiple=True, type=LIGHT, help=direction)(
                    command
                )
            else:
                command = _click_option(name, option)(command)
        return command

    return decorate


def given_options(context: click.Context, names: Sequence[str]) -> dict[str, Any]:
    """Values of the options that are on the command line."""
    return {
        name: context.params[name]
        for name in names
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }


def lights_of(directions: Sequence[tuple[float, ...]], positions: Sequence[tuple[float, ...]]) -> list[Light]:
    """Lights of ``--light`` and ``--point-light``.

    Raises
    ------
    InputError
        If a direction is 0 or a colour negative.
    """
    lights = []
    for option, kind, rows in (
        ("--light", "direction", directions),
        ("--point-light", "position", positions),
    ):
        for numbers in rows:
            try:
                lights.append(Light(color=numbers[3:] or (1.0, 1.0, 1.0), **{kind: numbers[:3]}))
            except ValueError as error:
                thing = f"{option} {','.join(f'{number:g}' for number in numbers)}"
                remedy = "give a direction other than 0 and colours of 0 or more"
                raise InputError(thing, str(error), remedy) from None
    return lights


def option_error(error: OptionError) -> InputError:
    """The error of an option in the words of the command line."""
    flag = "light" if error.option == "lights" else error.option.replace("_", "-")
    return error.at(f"--{flag} {error.value}".strip())
