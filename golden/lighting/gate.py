"""Base of the models of gates, which decide whether a span can hold a visible highlight."""

from functools import cached_property

import numpy as np

from blysk.golden.beats import Spans
from blysk.golden.lighting.highlight_operand import MAX_EXPONENT, HighlightOperand
from blysk.golden.number.fixed import Fixed, Format

__all__ = ["Gate"]


class Gate:
    """Decides which spans may have a highlight, by a threshold for each exponent or table.

    A subclass has a field ``specular``, the model of the gated unit.
    """

    specular: HighlightOperand

    @property
    def threshold_format(self) -> Format:
        """Format of a threshold."""
        raise NotImplementedError

    @property
    def threshold_rule(self) -> str | None:
        """Rule by which a table's values give its threshold. ``None``: a rule of the model alone gives it."""
        return None

    @cached_property
    def thresholds(self) -> Fixed:
        """The PROM: thresholds for exponents 0 to 1023."""
        return self.thresholds_of(self.specular.last_lit_arguments)

    def thresholds_of(self, last_lit_arguments: np.ndarray) -> Fixed:
        """Thresholds from the largest arguments with a term over 0, in steps of 2^-25."""
        raise NotImplementedError

    def thresholds_at(self, exponent: int | np.ndarray) -> Fixed:
        """Thresholds from the PROM.

        Parameters
        ----------
        exponent : int or int array, any shape
            1 to 1000.

        Raises
        ------
        ValueError
            If an exponent is out of range.
        """
        exponent = np.asarray(exponent, dtype=np.int64)
        if exponent.size and not 1 <= exponent.min() <= exponent.max() <= MAX_EXPONENT:
            raise ValueError(f"exponents must be 1 to {MAX_EXPONENT}")
        return self.thresholds[exponent]

    def lit(self, spans: Spans, halfway: np.ndarray, threshold: Fixed) -> np.ndarray:
        """Bit-accurate decisions for each light.

        Parameters
        ----------
        spans : Spans
            Spans as the gated method takes them.
        halfway : int array, shape (lights, 3)
            Codes of H of each light, ``SQ(1, 17)``.
        threshold : Fixed, shape (spans,)
            Threshold of each span's material.

        Returns
        -------
        bool array, shape (spans, lights)
            False: every pixel of the span has a specular term of 0 from the light.
        """
        raise NotImplementedError
