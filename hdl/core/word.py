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
    name, operands, latency, lifetime, unit, since
        As for `Operation`.
    graph : Dataflow
        That it is a word of.
    make : callable
        Makes its hardware.
    text : str or None
        Its formula, where its function does not tell.
    trace : callable
        Gives, of the symbols of the operands, its formula and those of what its functional unit is given;
        no formula where it has none.
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
        """Formulas of the operands of its functional unit, where they have any."""
        return self._found[1]

    @property
    def formula(self) -> Formula | None:
        """What it is, of the words that it is made from; ``None`` if that has no formula."""
        found = self._found[0]
        return found if isinstance(found, Formula) else None

    @property
    def symbol(self) -> Formula:
        """What it is called in formulas of others: its own formula if that is short, or its name.

        A name of one or two letters is a symbol of its own.
        """
        found = self.formula
        if found is None or (self.operands and (len(self.name) <= 2 or len(found.text) > LONGEST)):
            return Formula(self.name)
        return found

    @property
    def stage(self) -> int:
        """Enabled cycles from the input of a beat to the first on which the word can be read."""
        return self.graph.schedule.stage(self)

    @property
    def read(self) -> int:
        """Enabled cycles from the input of a beat to that on which its operands are read."""
        return self.graph.schedule.placements[self].read


def traced(function: Callable[..., Any]) -> Callable[..., tuple[Any, Sequence[Any]]]:
    """Trace of a word that a function makes of its operands."""
    return lambda *symbols: (formula_of(function, symbols), ())
