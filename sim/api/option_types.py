"""Types of single options: a reflection model, a roughness, a direction."""

import os
from collections.abc import Mapping
from typing import Any

import click

from blysk.golden.presets import MODEL_LINES
from blysk.golden.reference.light import Triple
from blysk.golden.reference.lobes import TabulatedModel
from blysk.golden.reference.measured import MEASURED
from blysk.sim.run_files import reads
from blysk.sim.value_types import Choice, Number, PartError, Vector, shown

__all__ = ["Direction", "ReflectionOption", "Roughness"]

_MEASURED = "measured:"


class ReflectionOption(Choice):
    """A reflection model by its name, ``measured:NAME`` of a fit of `MEASURED`, or the curve of a CSV file.

    The file has measured points, see `TabulatedModel`.
    """

    def __init__(self) -> None:
        super().__init__("reflection model", MODEL_LINES)
        self.points = "give a .csv file of cosines N.H rising from 0 to 1 and values from 0 to 1"
        self.remedy = f"{self.points}, or {self.remedy}"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Placeholder in the help text: the names, or a file."""
        return f"[{'|'.join(self.names)}|{_MEASURED}NAME|FILE.csv]"

    def check(self, value: Any) -> Any:
        """The value: the name of a model, or the curve that the file holds."""
        if isinstance(value, TabulatedModel):
            return value
        if isinstance(value, str) and value.startswith(_MEASURED):
            name = value.removeprefix(_MEASURED)
            if name not in MEASURED:
                known = f"give {_MEASURED} with {', '.join(list(MEASURED)[:-1])} or {list(MEASURED)[-1]}"
                raise PartError("", f"{shown(value)} is no measured material", known)
            return MEASURED[name].lobe(name)
        if not isinstance(value, str) or not value.lower().endswith(".csv"):
            return super().check(value)
        try:
            return TabulatedModel.of_csv(os.fspath(reads(value)))
        except OSError as error:
            raise PartError("", f"{shown(value)} cannot be opened ({error.strerror})", self.points) from None
        except ValueError as error:
            raise PartError("", str(error), self.points) from None


class Roughness(Number):
    """A number greater than 0 and at most 1."""

    def __init__(self) -> None:
        super().__init__(0, 1)
        self.remedy = "give a number greater than 0 and at most 1"

    def check(self, value: Any) -> Any:
        """The value as a `float`, within the range."""
        value = super().check(value)
        if not value:
            raise ValueError("out of range")
        return value


class Direction(Vector):
    """A direction, or a word for a direction.

    Parameters
    ----------
    words : mapping of str
        Value of each word: a vector, or the word itself if its vector depends on other options.
    """

    def __init__(self, words: Mapping[str, str | Triple]):
        super().__init__("a direction", direction=True)
        self.words = words
        self.remedy = f"give X,Y,Z, a vector other than 0, or one of {', '.join(words)}"
        self.metavar = f"X,Y,Z|{'|'.join(words)}"

    @property
    def in_python(self) -> str:
        """`remedy` for Python, which also takes a tuple of numbers."""
        return self.remedy.replace("X,Y,Z", 'three numbers or "X,Y,Z"', 1)

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        """Placeholder in the help text: numbers, or a word."""
        return self.metavar

    def parse(self, text: str) -> Any:
        """The direction that a text stands for: a word as it is, or numbers with commas between them."""
        return text if text in self.words else super().parse(text)

    def check(self, value: Any) -> Any:
        """The value: a tuple of `float`, or a word whose vector depends on other options."""
        if isinstance(value, str) and value in self.words:
            return self.words[value]
        return super().check(value)
