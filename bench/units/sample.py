"""Samples of a unit's errors: results, exact results, and results of the unit's formula in float64."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["Decisions", "Sample"]


@dataclass(frozen=True)
class Sample:
    """Results of a unit, and the expected results.

    Parameters
    ----------
    found : array
        Values of the bit-accurate model.
    exact : array, same shape
        The exact function of the same operands in float64.
    formula : array, same shape, optional
        The unit's approximate formula in float64. ``None`` if the unit's tables cannot be separated from its
        arithmetic.
    at : array, broadcast to the same shape, optional
        The operand on the axis of a drawing of errors. The record's ``axis`` names this operand.
    """

    found: np.ndarray
    exact: np.ndarray
    formula: np.ndarray | None = None
    at: np.ndarray | None = None

    @property
    def errors(self) -> tuple[float | None, float | None, float]:
        """Largest model, arithmetic and total error."""
        total = self._size(self.found, self.exact)
        if self.formula is None:
            return None, None, total
        return self._size(self.formula, self.exact), self._size(self.found, self.formula), total

    @staticmethod
    def _size(a, b) -> float:
        return float(np.abs(np.subtract(a, b)).max())

    @property
    def extremes(self) -> "Sample":
        """The samples that have the errors of `errors`: at most three."""
        pairs = [(self.found, self.exact)]
        if self.formula is not None:
            pairs += [(self.formula, self.exact), (self.found, self.formula)]
        worst = [int(np.abs(np.subtract(a, b)).argmax()) for a, b in pairs]
        parts = (self.found, self.exact, self.formula)
        return Sample(*(None if part is None else np.ravel(part)[worst] for part in parts))

    @classmethod
    def joined(cls, samples: "Iterator[Sample]") -> "Sample":
        """Several samples, of any shapes, joined into one flat sample."""
        samples = [
            s if s.at is None else replace(s, at=np.broadcast_to(s.at, np.shape(s.found))) for s in samples
        ]
        parts = [
            None
            if any(getattr(s, name) is None for s in samples)
            else np.concatenate([np.ravel(getattr(s, name)) for s in samples])
            for name in ("found", "exact", "formula", "at")
        ]
        return type(samples[0])(*parts)


class Decisions(Sample):
    """Decisions and expected decisions, 1 for yes and 0 for no. An error is a share of all decisions.

    ``formula`` is yes if ``found`` or ``exact`` is yes. So the model error is the share of needless yes, and
    the arithmetic error is the share of wrong no.
    """

    @classmethod
    def of(cls, found: np.ndarray, exact: np.ndarray, at: np.ndarray | None = None) -> "Decisions":
        """Decisions and expected decisions from booleans."""
        found, exact = (np.asarray(decision, dtype=np.int8) for decision in (found, exact))
        return cls(found, exact, np.maximum(found, exact), at)

    @staticmethod
    def _size(a, b):
        return float(np.abs(np.subtract(a, b)).mean())

    @property
    def extremes(self) -> "Decisions":
        """All decisions, without their operands."""
        return replace(self, at=None)
