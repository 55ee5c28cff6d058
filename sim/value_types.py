"""Types of options and of keys of scene files: reading of texts, and check of values."""

import math
import re
from collections.abc import Iterable
from typing import Any

import click

from blysk.golden.reference.scene import LARGEST_SIDE
from blysk.golden.reference.transfer import color_of_text
from blysk.golden.text import numbers_of_text
from blysk.sim.errors import InputError, one_line

__all__ = [
    "Choice",
    "Color",
    "Few",
    "Number",
    "OutputFile",
    "PartError",
    "Several",
    "Size",
    "Truth",
    "Value",
    "Vector",
    "Whole",
    "plain",
    "shown",
    "shown_key",
]


class Value(click.ParamType):
    """Type of an option. The command line gives texts; files and Python give numbers, lists and texts.

    Attributes
    ----------
    remedy : str
        Advice for the command line after a refused value: "give a whole number from 1 to 9".
    """

    remedy: str

    @property
    def in_python(self) -> str:
        """`remedy` for Python."""
        return self.remedy

    @property
    def in_file(self) -> str:
        """`remedy` for a scene file."""
        return self.in_python

    def read(self, value: Any) -> Any:
        """The checked value, from a text of the command line or from a value of a scene file or of Python.

        Raises
        ------
        ValueError
            If the value is not accepted. The message has the reason.
        """
        return self.check(self.parse(value) if isinstance(value, str) else value)

    def parse(self, text: str) -> Any:
        """The value that a text stands for, not yet checked. `ValueError` if the text has another form."""
        return text

    def check(self, value: Any) -> Any:
        """The value in the option's own type. `ValueError` with the reason if the value is not accepted."""
        raise NotImplementedError

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str | None:
        """Placeholder of a value in the help text."""
        return self.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Checked value of a text. `InputError` with option and text if the value is not accepted."""
        try:
            return self.read(value)
        except ValueError as error:
            option = param.opts[0] if param else self.name
            reason = f"unknown {self.name}" if str(error) == "unknown" else str(error)
            remedy = getattr(error, "remedy", self.remedy)
            raise InputError(f"{option} {value}", reason, remedy) from None


class PartError(ValueError):
    """Bad part of a value, with a reason and a remedy. ``key`` names the part, such as ``[2].color``."""

    def __init__(self, key: str, reason: str, remedy: str):
        super().__init__(reason)
        self.key, self.remedy = key, remedy


def plain(value: Any) -> Any:
    """A value with lists in place of arrays, and Python's numbers in place of NumPy's, at any depth."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if type(value) in (list, tuple):
        return type(value)(map(plain, value))
    return value


def shown(value: Any) -> str:
    """Text of a value for a message: one line of at most 40 characters."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple):
        return one_line(f"[{', '.join(shown(part) for part in value[:7])}]", 40)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) >= 10**18:
        return "a huge number"
    return one_line(repr(value) if isinstance(value, str) else str(value), 40)


def shown_key(name: str) -> str:
    """A key of a file, as a message shows it."""
    return name if re.fullmatch("[A-Za-z0-9_-]{1,40}", name) else shown(name)


def _finite(value: Any, least: float = -math.inf, most: float = math.inf) -> float:
    """A number in a range, ends included. Its size is at most 1e300, which leaves room for products."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError("not a number")
    # Comparison comes before the conversion, which a huge whole number would overflow.
    if not (least <= value <= most and -1e300 <= value <= 1e300):
        raise ValueError("out of range")
    return float(value)


def _floats(text: str, reason: str) -> list[float]:
    """Numbers that a text holds, separated by commas."""
    try:
        return numbers_of_text(text)
    except ValueError:
        raise ValueError(reason) from None


class Whole(Value):
    """A whole number in a range, both ends included."""

    name = "NUMBER"

    def __init__(self, least: int, most: int):
        self.least, self.most = least, most
        self.remedy = f"give a whole number from {least} to {most}"

    def parse(self, text: str) -> Any:
        """The number that a text of up to 18 digits stands for. The text may have a sign.

        Other texts stay unchanged.
        """
        return int(text) if re.fullmatch(r"[+-]?[0-9]{1,18}", text) else text

    def check(self, value: Any) -> Any:
        """The value as an `int`, within the range."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise ValueError("not a whole number")
        if not self.least <= value <= self.most:
            raise ValueError("out of range")
        return value


class Few(Whole):
    """One of a few whole numbers."""

    def __init__(self, *numbers: int):
        super().__init__(min(numbers), max(numbers))
        self.numbers = numbers
        self.remedy = f"give one of {', '.join(map(str, numbers))}"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Placeholder in the help text: the numbers."""
        return f"[{'|'.join(map(str, self.numbers))}]"

    def check(self, value: Any) -> Any:
        """The value as an `int`, one of the few numbers."""
        if super().check(value) not in self.numbers:
            raise ValueError("not one of the choices")
        return value


class Number(Value):
    """A finite number in a range, both ends included."""

    name = "NUMBER"

    def __init__(self, least: float, most: float, unit: str = ""):
        self.least, self.most = least, most
        self.remedy = f"give {least:g} to {most:g}{unit and f' {unit}'}"

    def parse(self, text: str) -> Any:
        """The number that a text stands for, by the rules of Python's `float`."""
        return _floats(text, "not a number")[0] if "," not in text else text

    def check(self, value: Any) -> Any:
        """The value as a `float`, within the range."""
        return _finite(value, self.least, self.most)


class Vector(Value):
    """A tuple of finite numbers whose length is one of ``counts``. A direction is not 0."""

    def __init__(
        self, kind: str, counts: tuple[int, ...] = (3,), metavar: str = "X,Y,Z", direction: bool = False
    ):
        self.name, self.kind, self.counts, self.direction = metavar, kind, counts, direction
        self.remedy = f"give {metavar}" + (", a vector other than 0" if direction else "")

    @property
    def in_python(self) -> str:
        """`remedy` for Python, which also takes a tuple of numbers."""
        return self.remedy.replace(f"give {self.name}", f'give {self.kind} or "{self.name}"', 1)

    def parse(self, text: str) -> Any:
        """The numbers of a text, which are separated by commas."""
        return _floats(text, f"not {self.kind}")

    def check(self, value: Any) -> Any:
        """The value as a tuple of `float`."""
        if not isinstance(value, list | tuple) or len(value) not in self.counts:
            raise ValueError(f"not {self.kind}")
        vector = tuple(_finite(part) for part in value)
        if self.direction and not any(vector[:3]):
            raise ValueError("not a direction")
        return vector


class Color(Value):
    """A colour: ``#rrggbb`` in sRGB, three numbers of linear light, or one number for all channels.

    Its value is three numbers of linear light.
    """

    name = "COLOR"

    def __init__(self, most: float = 1.0):
        self.most = most
        limits = "of 0 or more" if math.isinf(most) else f"from 0 to {most:g}"
        self.remedy = f"give #rrggbb, red, green and blue, or one number, each {limits}"

    @property
    def in_python(self) -> str:
        """`remedy` for Python, with the text in quotes."""
        return self.remedy.replace("#rrggbb", '"#rrggbb"')

    def parse(self, text: str) -> Any:
        """The channels that a text stands for, see `color_of_text`."""
        try:
            return color_of_text(text)
        except ValueError:
            raise ValueError("not a colour") from None

    def check(self, value: Any) -> Any:
        """The value as three numbers of type `float`."""
        channels = value if isinstance(value, list | tuple) else [value] * 3
        if len(channels) != 3:
            raise ValueError("not a colour")
        return tuple(_finite(part, 0, self.most) for part in channels)


class Size(Value):
    """Width and height of a picture."""

    name = "WIDTHxHEIGHT"
    remedy = f"give WIDTHxHEIGHT, 1 to {LARGEST_SIDE} each"
    in_python = f'give (width, height) or "WIDTHxHEIGHT", 1 to {LARGEST_SIDE} each'
    in_file = f'give [width, height] or "WIDTHxHEIGHT", 1 to {LARGEST_SIDE} each'

    def parse(self, text: str) -> Any:
        """Width and height, from a text with an x between two numbers."""
        match = re.fullmatch(r"([0-9]{1,9})x([0-9]{1,9})", text)
        return [int(match[1]), int(match[2])] if match else text

    def check(self, value: Any) -> Any:
        """The value as two numbers of type `int`."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise ValueError("not a size")
        side = Whole(1, LARGEST_SIDE)
        return side.check(value[0]), side.check(value[1])


class Truth(Value):
    """True or false: a `bool` in a file and in Python, a flag on the command line."""

    name = "boolean"
    remedy = in_file = "give true or false"
    in_python = "give True or False"

    def check(self, value: Any) -> Any:
        """The value as a `bool`."""
        if not isinstance(value, bool):
            raise ValueError("neither true nor false")
        return value


class Choice(Value):
    """One of a few names.

    Parameters
    ----------
    kind : str
        Kind of thing that the names stand for, used in messages: ``"method"``.
    names : iterable of str
        The names.
    """

    def __init__(self, kind: str, names: Iterable[str]):
        self.name = kind
        self.names = tuple(names)
        self.remedy = f"use one of {', '.join(self.names)}"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Placeholder in the help text: the names."""
        return f"[{'|'.join(self.names)}]"

    def check(self, value: Any) -> Any:
        """The value: one of the names."""
        if not isinstance(value, str) or value not in self.names:
            raise ValueError("unknown")
        return value


class Several(Choice):
    """One or more of a few names, each once, with commas between them."""

    def __init__(self, kind: str, names: Iterable[str]):
        super().__init__(kind, names)
        self.remedy = f"give one or more of {', '.join(self.names)}"

    @property
    def in_python(self) -> str:
        """`remedy` for Python, which also takes a list of names."""
        return f"{self.remedy}, as a list or with commas between them"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Placeholder in the help text: the names, as many as wanted."""
        return f"[{'|'.join(self.names)}],..."

    def parse(self, text: str) -> Any:
        """The names of a text, which are separated by commas."""
        return [name.strip() for name in text.split(",")]

    def check(self, value: Any) -> Any:
        """The value as a tuple of names, in the order of ``names``."""
        if not isinstance(value, list | tuple) or not value:
            raise ValueError("unknown")
        given = [super(Several, self).check(name) for name in value]
        if len(set(given)) < len(given):
            raise ValueError("a name comes twice")
        return tuple(name for name in self.names if name in given)


class OutputFile(click.Path):
    """Name of a file to write. An empty name, as from a shell variable that is not set, is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The name of the file, if it is not empty."""
        if not value:
            raise InputError(
                f"{param.opts[-1]} ''", "is not a file name", "give a file name, or leave the option out"
            )
        return super().convert(value, param, ctx)
