"""Bit-accurate model of a lobe of the quotient method: any curve of N·H or R·V, by a place in a table."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np

from blysk.golden.cosines.quotient import OCTAVES, STEPS, place_format
from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.golden.number.fixed import UQ, Fixed, Format

__all__ = ["QuotientLobe"]


@dataclass(frozen=True)
class QuotientLobe(Lobe):
    """Any lobe of N·H or R·V from a table that `Quotient` addresses, linear between entries.

    The integer of a place is the address of a word, its fraction the position within the step. The table of a
    lobe of N·H has a part for ``s = sin^2 gamma`` and a part for ``1 - s``. The table of a lobe of R·V has
    one part, for ``s = sin^2 (gamma/2)``. A part has `OCTAVES` octaves of `STEPS` steps and a row for all
    smaller numbers. A place past the end gives 0. Words, entries, writes and banks are as for `Lobe`.

    *Error of the lines*, with rounding, at the possible places (s or 1 - s up to 1/2), in LSB:

    - ``blinn`` and ``phong``: within 0.06 at exponents 1 to 1000;
    - ``ggx``: within 0.04 from roughness 0.1 on (5.3 at 0.05);
    - ``beckmann``: within 0.1;
    - ``cosquad``: within 0.12.

    Parameters
    ----------
    model, banks, cutoff, fixed
        As for `Lobe`. The model may be of R·V, too.
    operand : str
        ``"place"``.

    Raises
    ------
    ValueError
        As for `Lobe`. `table` also refuses a lobe of N·H that goes on beyond a right angle.

    Source: docs/theory/quotient.md#pixel.
    """

    operand: Literal["place"] = "place"  # type: ignore[assignment]
    octaves: int = OCTAVES
    steps: int = STEPS

    OPERANDS: ClassVar[tuple[str, ...]] = ("place",)
    SERVES_MIRROR: ClassVar[bool] = True

    def for_operand(self, operand: Any, scale: int = 0) -> Lobe:
        """The unit for another operand: a `Lobe` with a table of the same model.

        Raises
        ------
        ValueError
            If the model is of R·V, which has no other operand.
        """
        if operand == self.operand:
            return self
        if self.reflection.MIRROR:
            raise ValueError(f"{self.name} is a lobe of R·V: take the method quotient, or phong_coplanar")
        return Lobe(self.reflection, operand, scale=scale, **self.table_options)

    @property
    def argument_text(self) -> str:
        """Formula of the first table's argument."""
        return "s = (1 - R.V)/2" if self.reflection.MIRROR else "s = 1 - (N.H)^2"

    def is_sharp(self, parameter: float | None) -> bool:
        """Whether `line_error` is over a quarter of an LSB."""
        return self.line_error(parameter) > 1 / 1020

    @property
    def parts(self) -> int:
        """Parts of the table: 2, or 1 for a lobe of R·V."""
        return 1 if self.reflection.MIRROR else 2

    @property
    def rows(self) -> int:
        """Rows of all parts."""
        return self.parts * (self.octaves + 1)

    @property
    def argument_format(self) -> Format:
        """Format of a place."""
        return place_format(self.parts)

    @property
    def operand_format(self) -> Format:
        """Format of a place."""
        return self.argument_format

    @property
    def fraction_format(self) -> Format:
        """Format of the position within a step."""
        return UQ(0, self.argument_format.fraction_bits)

    @cached_property
    def knots(self) -> np.ndarray:
        """s, or 1 - s, of a part's entries and of its end, 1: float64 array, shape ((E + 1) M + 1,)."""
        return Lobe(octaves=self.octaves, steps=self.steps).knots

    @property
    def cosines(self) -> tuple[np.ndarray, np.ndarray]:
        """Cosines at entries and end, and in the middles of steps. A part ends where the next part starts.

        ``sqrt(1 - s)`` and ``sqrt(1 - (1 - s))``; ``1 - 2 s`` for a lobe of R·V.
        """
        knots = np.minimum(self.knots, 1 - 2.0**-40)
        pair = knots, (knots[1:] + knots[:-1]) / 2
        if self.reflection.MIRROR:
            return 1 - 2 * pair[0], 1 - 2 * pair[1]
        entries, middles = (np.concatenate([np.sqrt(1 - s), np.sqrt(s)]) for s in pair)
        return np.delete(entries, len(knots)), middles

    def _beside(self, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        left, right = super()._beside(high)
        if self.parts == 2:
            # Of the steps from 1/2 on, only the first step is used before the border of the parts.
            border = len(self.knots) - 1
            left[border] = right[border]
        return left, right

    def table(self, parameter: float | None = None) -> LobeTable:
        """Table of the model for one parameter, as in `Lobe`.

        Raises
        ------
        ValueError
            As for `Lobe`. Also if the curve of N·H is over half an LSB beyond the right angle, where this
            method has no highlight.
        """
        if not self.reflection.MIRROR and (parameter is not None or self.reflection.PARAMETER is None):
            beyond = float(self.reflection.reflect(np.array(-(2.0**-20)), parameter))
            if beyond > 1 / 510:
                given = "" if parameter is None else f" with {self.reflection.PARAMETER} {parameter:g}"
                raise ValueError(
                    f"{self.name}{given} is {beyond:.2g} beyond a right angle of N and H, where the method "
                    "quotient has no highlight; take another method or model"
                )
        return super().table(parameter)

    def line_error(self, parameter: float | None) -> float:
        """Largest error of the lines between entries, at seven places of each step that is used."""
        values, knots = self.table(parameter).values.values, self.knots
        used = knots[:-1] <= 1 / 2
        share = np.arange(1, 8)[:, np.newaxis] / 8
        middles = knots[:-1][used] + np.diff(knots)[used] * share
        parts = [1 - 2 * middles] if self.reflection.MIRROR else [np.sqrt(1 - middles), np.sqrt(middles)]
        largest = 0.0
        for part, cosine in enumerate(parts):
            first = part * (len(knots) - 1)
            entry = values[first : first + len(knots)]
            line = (1 - share) * entry[:-1][used] + share * entry[1:][used]
            largest = max(largest, float(np.abs(line - self.reflection.reflect(cosine, parameter)).max()))
        return largest

    def address(self, argument: Fixed) -> tuple[np.ndarray, Fixed]:
        """Word of a table, and position within its step: integer and fraction of a place."""
        format = self.fraction_format
        return argument.codes >> format.width, Fixed(format, argument.codes & format.max_code)
