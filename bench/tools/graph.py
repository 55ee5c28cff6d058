"""Structure of a unit as boxes and arrows: the graph, its layers, and a text to compare graphs."""

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

__all__ = [
    "Graph",
    "Node",
    "layers",
    "likeness",
]


@dataclass
class Node:
    """A box of the drawing.

    Parameters
    ----------
    kind : str
        ``input``, ``output``, ``register``, ``operation``, ``memory`` or ``unit``.
    name : str
        Name of the register, port or submodule; empty for an operation.
    detail : str
        Width, format or size.
    operations : Counter
        Symbols of the operations in the box, and the number of each. ``×c`` is a product by a constant.
    copies : int
        Number of equal boxes that the box stands for.
    stages : int
        Number of registers in a plain delay that the box stands for.
    formulas : tuple of str
        Formulas of the words that the register holds in turn.
    """

    kind: str
    name: str = ""
    detail: str = ""
    operations: Counter[str] = field(default_factory=Counter)
    copies: int = 1
    stages: int = 1
    formulas: tuple[str, ...] = ()


@dataclass
class Graph:
    """Boxes and arrows.

    Parameters
    ----------
    nodes : dict of int to Node
        Boxes.
    edges : dict of (int, int) to bool
        Arrows between boxes. The value is true if the arrow carries data, false if it only chooses or
        enables.
    """

    nodes: dict[int, Node] = field(default_factory=dict)
    edges: dict[tuple[int, int], bool] = field(default_factory=dict)

    def add(self, node: Node) -> int:
        """Add a box and return its number."""
        number = len(self.nodes)
        self.nodes[number] = node
        return number

    def connect(self, source: int, target: int, is_data: bool) -> None:
        """Add an arrow. If two boxes have two arrows, the arrow that carries data is kept."""
        self.edges[source, target] = self.edges.get((source, target), False) or is_data

    def neighbours(self, data_only: bool = False) -> tuple[dict[int, set[int]], dict[int, set[int]]]:
        """Sources and targets of each box."""
        sources, targets = defaultdict(set), defaultdict(set)
        for (source, target), is_data in self.edges.items():
            if is_data or not data_only:
                sources[target].add(source)
                targets[source].add(target)
        return sources, targets

    def keep(self, numbers: Iterable[int]) -> None:
        """Keep the boxes with these numbers, and drop all other boxes."""
        numbers = set(numbers)
        self.nodes = {number: node for number, node in self.nodes.items() if number in numbers}
        self.edges = {edge: data for edge, data in self.edges.items() if numbers.issuperset(edge)}

    def bypass(self, number: int, loops: bool = False) -> None:
        """Drop a box and join its sources to its targets. A box is joined to itself only if ``loops``."""
        into = [(a, data) for (a, b), data in self.edges.items() if b == number and a != number]
        out = [(b, data) for (a, b), data in self.edges.items() if a == number and b != number]
        del self.nodes[number]
        self.edges = {edge: data for edge, data in self.edges.items() if number not in edge}
        for a, first in into:
            for b, second in out:
                if a != b or loops:
                    self.connect(a, b, first and second)

    def merge(self, group: Iterable[int]) -> int:
        """Merge several boxes into the first of the group."""
        first, *others = group
        moved = dict.fromkeys(others, first)
        edges, self.edges = self.edges, {}
        for (a, b), data in edges.items():
            self.connect(moved.get(a, a), moved.get(b, b), data)
        for number in others:
            del self.nodes[number]
        return first


def layers(graph: Graph) -> tuple[dict[int, int], set[tuple[int, int]]]:
    """Column of each box, and the arrows that lead back to an earlier column.

    Returns
    -------
    columns : dict of int to int
        Every arrow that does not lead back goes to a later column.
    back : set of (int, int)
        Arrows that close a loop.
    """
    sources, targets = graph.neighbours()
    back: set[tuple[int, int]] = set()
    state: dict[int, int] = {}
    order: list[int] = []

    def visit(root: int) -> None:
        stack = [(root, iter(sorted(targets[root])))]
        state[root] = 1
        while stack:
            number, following = stack[-1]
            for target in following:
                if state.get(target) == 1:
                    back.add((number, target))
                elif target not in state:
                    state[target] = 1
                    stack.append((target, iter(sorted(targets[target]))))
                    break
            else:
                state[number] = 2
                order.append(number)
                stack.pop()

    for number in sorted(graph.nodes, key=lambda n: (graph.nodes[n].kind != "input", n)):
        if number not in state:
            visit(number)
    order.reverse()
    columns = dict.fromkeys(graph.nodes, 0)
    for number in order:
        for target in targets[number]:
            if (number, target) not in back:
                columns[target] = max(columns[target], columns[number] + 1)
    last = max(columns.values())
    for number in reversed(order):
        ahead = [columns[t] for t in targets[number] if (number, t) not in back]
        if graph.nodes[number].kind == "output":
            columns[number] = last
        # A node without a source stands next to the node that uses it.
        elif ahead and not sources[number] - {number} and graph.nodes[number].kind != "input":
            columns[number] = min(ahead) - 1
    return columns, back


_LIKENESS_DEPTH = 8
"""Two boxes are compared with their surroundings up to this number of arrows."""


def likeness(graph: Graph) -> str:
    """Text of a graph. Graphs that differ only in widths, register names and constants share this text."""
    labels = {
        number: repr(
            (
                node.kind,
                node.name if node.kind in ("input", "output") else "",
                node.detail if node.kind == "unit" else "",
                sorted((s, n) for s, n in node.operations.items() if n and not s.endswith("c")),
                node.copies,
                node.stages,
            )
        )
        for number, node in graph.nodes.items()
    }
    sources, targets = graph.neighbours()
    # A box is identified by its neighbours, by their neighbours, and so on.
    for _ in range(_LIKENESS_DEPTH):
        labels = {
            number: _digest(
                label,
                sorted((labels[other], graph.edges[other, number]) for other in sources[number]),
                sorted((labels[other], graph.edges[number, other]) for other in targets[number]),
            )
            for number, label in labels.items()
        }
    return _digest(sorted(labels.values()))


def _digest(*parts) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()
