"""Formulas of a unit's registers, for the labels of a drawing."""

import re
from collections import defaultdict

from amaranth.lib import wiring

from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.formula import Formula
from blysk.hdl.core.word import Word

__all__ = ["Formulas"]


class Formulas:
    r"""Formulas by the names of registers, from a unit's data flows and from its class.

    The registers of a functional unit have the formulas of all operations that share it. Its operand
    registers have the formulas of the operands. Its other registers have the formulas of the results. A
    result without a formula has the name of its word.

    Parameters
    ----------
    component : Component
        A unit. Its class may have a dictionary ``FORMULAS`` from regular expressions to formulas. An
        expression matches names of registers. In its formula ``\1`` stands for its first group.
    """

    def __init__(self, component: wiring.Component):
        self._stated: dict[str, str] = getattr(component, "FORMULAS", {})
        self._of: dict[str, list[str]] = {}
        self._results: dict[str, list[str]] = defaultdict(list)
        for graph in vars(component).values():
            for word in graph.words if isinstance(graph, Dataflow) else ():
                self._add(graph, word)

    def _add(self, graph: Dataflow, word: Word) -> None:
        formula = word.formula
        if word.resource is None:
            self._put(self._of, word.name, formula)
            return
        instance = word.resource.prefix(graph.schedule.placements[word].instance)
        self._put(self._results, instance, formula or Formula(word.name))
        for k, operand in enumerate(word.given):
            for name in (str(k), "abcd"[k]):
                self._put(self._of, instance + name, operand)

    @staticmethod
    def _put(found: dict[str, list[str]], name: str, formula: object) -> None:
        if isinstance(formula, Formula) and formula.text not in found.setdefault(name, []):
            found[name].append(formula.text)

    def of(self, name: str) -> tuple[str, ...]:
        """Formulas of a register. Empty if the register has none."""
        for pattern, text in self._stated.items():
            if match := re.fullmatch(pattern, name):
                return (match.expand(text),)
        if name not in self._of:
            for instance, found in self._results.items():
                if name.startswith(instance):
                    return () if re.fullmatch(r"[\da-d]", name[len(instance) :]) else tuple(found)
            # A copy of a word for a later stage has the stage in its name.
            name = re.sub(r"_\d+$", "", name)
        return tuple(self._of.get(name, ()))
