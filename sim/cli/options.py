"""Options of commands, from the tables of the Python interface."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import click
from click.core import ParameterSource

from blysk.golden.reference.lighting import Light
from blysk.sim.api.options import Option
from blysk.sim.errors import InputError
from blysk.sim.value_types import Truth, Vector

__all__ = ["given_options", "lights_of", "options_of"]

_LIGHTS = {
    "--light": ("lights", Vector("a light", (3, 6), "X,Y,Z or X,Y,Z,R,G,B"), ("direction", "color")),
    "--point-light": (
        "point_lights",
        Vector("a point light", (3, 6, 9), "X,Y,Z or X,Y,Z,R,G,B or X,Y,Z,R,G,B,K0,K1,K2"),
        ("position", "color", "attenuation"),
    ),
    "--spot-light": (
        "spot_lights",
        Vector("a spot light", (8, 11, 14), "X,Y,Z,DX,DY,DZ,INNER,OUTER or ...,R,G,B or ...,R,G,B,K0,K1,K2"),
        ("position", "spot", "cone", "color", "attenuation"),
    ),
}
"""Options of lights: parameter, type, and the fields of `Light` that the numbers fill in turn."""

_COUNTS = {"cone": 2}
"""Count of a field's numbers, if it is not 3."""

_HELP = {
    "--point-light": "Position of a light in the mesh's units, its colour, and its attenuation: at the "
    "distance d it counts 1/(K0 + K1 d + K2 d^2), at most 1; needs --method chord-local.",
    "--spot-light": "The same of a light that shines along DX,DY,DZ: in full up to INNER degrees from there, "
    "and not at all from OUTER on.",
}

_REMEDIES = {
    "--light": "give a direction other than 0 and colours of 0 or more",
    "--point-light": "give colours and coefficients of 0 or more",
    "--spot-light": "give an axis other than 0, a larger outer angle, colours and coefficients of 0 or more",
}

Command = Callable[..., Any]


def _text(value: object) -> str:
    """A default in the form of the command line."""
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

    The options have no defaults here: the Python interface sets the values that are not given. ``lights``
    becomes ``--light``, ``--point-light`` and ``--spot-light``, see `lights_of`.
    """

    def decorate(command: Command) -> Command:
        for name, option in reversed(table.items()):
            if name == "lights" and not isinstance(option.default, int):
                help = {"--light": f"{option.help}  [default: -0.5,0.8,0.7]"} | _HELP
                for flag, (parameter, kind, _) in reversed(_LIGHTS.items()):
                    added = click.option(flag, parameter, multiple=True, type=kind, help=help[flag])
                    command = added(command)
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


def lights_of(options: Mapping[str, Any]) -> list[Light]:
    """Lights of ``--light``, ``--point-light`` and ``--spot-light``, in this order; empty without any.

    Raises
    ------
    InputError
        If `Light` refuses a number.
    """
    lights = []
    for flag, (parameter, _, fields) in _LIGHTS.items():
        for numbers in options[parameter]:
            parts, rest = {}, tuple(numbers)
            for field in fields:
                count = _COUNTS.get(field, 3)
                if rest:
                    parts[field], rest = rest[:count], rest[count:]
            try:
                lights.append(Light(**parts))
            except ValueError as error:
                thing = f"{flag} {','.join(f'{number:g}' for number in numbers)}"
                raise InputError(thing, str(error), _REMEDIES[flag]) from None
    return lights
