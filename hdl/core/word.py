"""A word of a data-flow graph, with its formula."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from blysk.hdl.core.formula import LONGEST, Formula, formula_of
from blysk.hdl.core.schedule import Operation

__all__ = ["Word", "traced"]


@dataclass(eq=False)
class Word(Operation):
    """A word of a data flow, and the operation that makes it.

    Parameters
    ----------
    name, operands, latency, lifetime, resource, since
        As for `Operation`.
    graph : Dataflow
        Graph of the word.
    make : callable
        Makes the word's hardware.
    text : str or None
        Formula of the word, if its function does not give the formula.
    trace : callable
        Takes the symbols of the operands. Returns the word's formula, or ``None``, and the formulas of the
        operands of its functional unit.
    """

    graph: Any = None
    make: Callable[[Any], Any] | None = None
    text: str | None = None
    trace: Callable[..., tuple[Any, Sequence[Any]]] = lambda *operands: (None, ())

    @cached_property
    def _found(self) -> tuple[Any, Sequence[Any]]:
        found, given = self.trace(*(word.symbol for word in self.operands))
        return Formula.read(self.text) if self.text else found, given

    @property
    def given(self) -> Sequence[Any]:
        """Formulas of the operands of its functional unit, if there are any."""
        return self._found[1]

    @property
    def formula(self) -> Formula | None:
        """Formula of the word in the symbols of its operands; ``None`` without a formula."""
        found = self._found[0]
        return found if isinstance(found, Formula) else None

    @property
    def symbol(self) -> Formula:
        """Symbol of the word in formulas of other words: its own formula if it is short, else its name.

        A name of one or two letters is a symbol of its own.
        """
        found = self.formula
        if found is None or (self.operands and (len(self.name) <= 2 or len(found.text) > LONGEST)):
            return Formula(self.name)
        return found

    @property
    def stage(self) -> int:
        """Enabled cycles from the input of a beat to the first cycle on which the word can be read."""
        return self.graph.schedule.stage(self)

    @property
    def read(self) -> int:
        """Enabled cycles from the input of a beat to the read of its operands."""
        return self.graph.schedule.placements[self].read


def traced(function: Callable[..., Any]) -> Callable[..., tuple[Any, Sequence[Any]]]:
    """``trace`` of a word that ``function`` makes from its operands."""
    return lambda *symbols: (formula_of(function, symbols), ())
