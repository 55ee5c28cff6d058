"""Options of lights: tables in a scene file, objects in Python, numbers on the command line."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from blysk.golden.lighting.intensity import MAX_LIGHTS
from blysk.golden.reference.lighting import Light
from blysk.sim.value_types import Color, PartError, Value, Vector, plain, shown, shown_key

__all__ = ["Lights", "LightsLike"]

LightsLike = Light | Mapping[str, Any] | str | Sequence[Any]
"""Lights: a `Light`, a dict of its fields, numbers or a text as on the command line; or several of these."""


class Lights(Value):
    """Lights. Each is a `Light`, a table of its parts, or numbers as on the command line.

    Parameters
    ----------
    numbers : Vector
        Numbers of a light on the command line.
    fields : tuple of str
        Fields of `Light` that the numbers fill, in this order.
    remedy : str
        Remedy if `Light` refuses the numbers: it says which numbers to give.
    """

    name = "lights"
    in_file = "write [[lights]] and its direction and color below, for each light"
    parts: Mapping[str, Value] = {
        "direction": Vector("three numbers", direction=True),
        "position": Vector("three numbers"),
        "color": Color(math.inf),
        "attenuation": Vector("three numbers", metavar="K0,K1,K2"),
        "spot": Vector("three numbers", direction=True),
        "cone": Vector("two angles", (2,), "INNER,OUTER"),
    }

    def __init__(self, numbers: Vector, fields: tuple[str, ...], remedy: str):
        self.numbers, self.fields, self.remedy = numbers, fields, remedy

    @property
    def in_python(self) -> str:
        """`remedy` for Python, with every form of lights."""
        return (
            f'give a Light, a dict with direction or position, numbers, or "{self.numbers.name}"; or a list '
            "of these"
        )

    def check(self, value: Any) -> Any:
        """The value as a tuple of `Light`."""
        entries = [value] if isinstance(value, Light | Mapping | str) or _is_numbers(value) else value
        if not isinstance(entries, list | tuple):
            raise ValueError("not a light")
        if len(entries) > MAX_LIGHTS:
            raise PartError("", f"{len(entries)} lights", f"give at most {MAX_LIGHTS}")
        return tuple(self._light(entry, f"[{number}]") for number, entry in enumerate(entries, 1))

    def light(self, numbers: Sequence[float]) -> Light:
        """The light that checked numbers describe; `ValueError` if `Light` refuses a number."""
        parts: dict[str, Any] = {}
        rest = tuple(numbers)
        for field in self.fields:
            count = 2 if field == "cone" else 3
            if rest:
                parts[field], rest = rest[:count], rest[count:]
        return Light(**parts)

    def _light(self, entry: object, key: str) -> Light:
        if isinstance(entry, Light):
            return entry
        if isinstance(entry, Mapping):
            return self._of_table(entry, key)
        if not isinstance(entry, str) and not _is_numbers(entry):
            raise PartError(key, f"{shown(entry)} is not a light", self.in_python)
        try:
            numbers = self.numbers.read(entry)
        except ValueError as error:
            raise PartError(key, f"{shown(entry)} is {error}", self.numbers.in_python) from None
        try:
            return self.light(numbers)
        except ValueError as error:
            raise PartError(key, str(error), self.remedy) from None

    def _of_table(self, entry: Mapping[str, object], key: str) -> Light:
        parts = {}
        for name, part in entry.items():
            if name not in self.parts:
                raise PartError(
                    f"{key}.{shown_key(name)}", "unknown key", f"use one of {', '.join(self.parts)}"
                )
            try:
                parts[name] = self.parts[name].read(plain(part))
            except ValueError as error:
                reason = f"{shown(part)} is {error}"
                raise PartError(f"{key}.{name}", reason, self.parts[name].in_python) from None
        if "direction" not in parts and "position" not in parts:
            remedy = "give three numbers, from the mesh to the light, or a position"
            raise PartError(f"{key}.direction", "is missing", remedy)
        if "direction" in parts and "position" in parts:
            raise PartError(key, "holds both direction and position", "leave one of them out")
        try:
            return Light(**parts)
        except ValueError as error:
            remedy = "see the keys of lights in blysk render --help"
            raise PartError(key, str(error), remedy) from None


def _is_numbers(value: object) -> bool:
    return (
        isinstance(value, list | tuple)
        and bool(value)
        and all(isinstance(part, int | float) for part in value)
    )
