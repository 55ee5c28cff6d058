"""A unit's structure as boxes and arrows, made from its netlist.

The netlist is Amaranth's own, read by Yosys. A box is a register with the operations in front of it, an
operation that several registers share, a memory, a submodule or a port. Wires, slices, constants, inversions,
single-bit logic and the control by valid and ready are left out. Multiplexers between a word and itself or a
constant (enables, resets, saturation) are left out, too. Copies of one structure, such as the three
components of a vector, are one box.
"""

import re
from collections import defaultdict
from collections.abc import Iterable
from copy import deepcopy

from amaranth.lib import wiring

from blysk.bench.tools.graph import Graph, layers
from blysk.bench.tools.netlist import Netlist

__all__ = [
    "graph_of",
]


_COMPARISONS = {"<", "≤", ">", "≥", "=", "≠"}

_CONTROL = re.compile(r"(^|_)(ready|valid|ages)$|^(held|moves)$")

MOST_BOXES = 48
"""Largest number of boxes of a drawing. If there are more, some kinds of boxes are left out."""


def _reached(starts: Iterable[int], following: dict[int, set[int]]) -> set[int]:
    found, todo = set(), list(starts)
    while todo:
        number = todo.pop()
        if number not in found:
            found.add(number)
            todo += following[number]
    return found


def _drop_control(graph: Graph) -> None:
    """Keep boxes through which data pass, and boxes that choose among data by operands."""
    inputs = [number for number, node in graph.nodes.items() if node.kind == "input"]
    outputs = [number for number, node in graph.nodes.items() if node.kind == "output"]
    data_sources, data_targets = graph.neighbours(data_only=True)
    kept = _reached(outputs, data_sources)
    operands = _reached(inputs, data_targets)
    sources, _ = graph.neighbours()
    may_choose = {
        number
        for number in operands | kept
        if graph.nodes[number].kind != "register" or not _CONTROL.search(graph.nodes[number].name)
    }
    choosing = {number: sources[number] & may_choose for number in graph.nodes}
    kept |= _reached(kept, choosing)
    graph.keep(kept | set(inputs) | set(outputs))
    for (a, b), is_data in list(graph.edges.items()):
        if not is_data and a not in may_choose:
            del graph.edges[a, b]


def _drop_idle_choices(graph: Graph) -> None:
    """Bypass multiplexers that choose among fewer than two words."""
    changed = True
    while changed:
        changed = False
        for number in list(graph.nodes):
            node = graph.nodes[number]
            if node.kind != "operation" or set(node.operations) != {"mux"}:
                continue
            sources, targets = graph.neighbours(data_only=True)
            words = sources[number] - {number}
            # The condition on which a register keeps its word is not a choice.
            if len(targets[number]) == 1:
                words -= targets[number]
            if len(words) < 2:
                graph.bypass(number)
                changed = True


def _fuse(graph: Graph) -> None:
    """Put an operation into the box that takes its result, if no other box takes the result."""
    changed = True
    while changed:
        changed = False
        _, targets = graph.neighbours()
        for number in list(graph.nodes):
            node = graph.nodes[number]
            if node.kind != "operation" or len(targets[number]) != 1:
                continue
            (target,) = targets[number]
            other = graph.nodes[target]
            if target == number or other.kind not in ("register", "operation"):
                continue
            if not graph.edges[number, target]:
                continue
            loops = (target, target) in graph.edges or (target, number) in graph.edges
            other.operations += node.operations
            # A choice among the results of choices counts as one choice.
            if other.operations["mux"]:
                other.operations["mux"] = 1
            graph.merge([target, number])
            if not loops:
                graph.edges.pop((target, target), None)
            changed = True
            break


def _join_delays(graph: Graph) -> None:
    """Merge a register with the registers that only delay its word."""
    changed = True
    while changed:
        changed = False
        sources, _ = graph.neighbours()
        for number, node in graph.nodes.items():
            before = sources[number] - {number}
            if node.kind != "register" or node.operations or len(before) != 1:
                continue
            (source,) = before
            other = graph.nodes[source]
            if other.kind == "register" and other.detail == node.detail and graph.edges[source, number]:
                other.stages += node.stages
                graph.merge([source, number])
                graph.edges.pop((source, source), None)
                changed = True
                break


def _drop_indirect(graph: Graph) -> None:
    """Drop arrows that carry choices, and arrows beside a longer path. Ports that only choose keep theirs."""
    passing = {a for (a, _), is_data in graph.edges.items() if is_data}
    graph.edges = {
        edge: data
        for edge, data in graph.edges.items()
        if data or (graph.nodes[edge[0]].kind == "input" and edge[0] not in passing)
    }
    _, back = layers(graph)
    _, targets = graph.neighbours()
    forward = {a: {b for b in targets[a] if (a, b) not in back} for a in graph.nodes}
    for a, near in forward.items():
        far = _reached((c for b in near for c in forward[b]), forward)
        for b in near & far:
            del graph.edges[a, b]


_INDEX = re.compile(r"(_?\d+|_[xyzrgb]|\[\d+\])(?=_|\[|$)")


def _join_copies(graph: Graph) -> None:
    """Merge boxes that are alike and have the same neighbours."""
    classes = {
        number: (
            node.kind,
            _INDEX.sub("", node.name) if node.kind == "register" else node.name,
            node.detail,
            node.stages,
            tuple(sorted(node.operations.items())),
            number if node.kind in ("input", "output", "unit", "memory") else -1,
        )
        for number, node in graph.nodes.items()
    }
    sources, targets = graph.neighbours()
    count = 0
    while count != len(set(classes.values())):
        count = len(set(classes.values()))
        numbering = {key: k for k, key in enumerate(dict.fromkeys(classes.values()))}
        known = {number: numbering[key] for number, key in classes.items()}
        classes = {
            number: (
                known[number],
                frozenset(known[a] for a in sources[number]),
                frozenset(known[b] for b in targets[number]),
            )
            for number in graph.nodes
        }
    groups = defaultdict(list)
    for number, key in classes.items():
        groups[key].append(number)
    for group in groups.values():
        if len(group) > 1:
            node = graph.nodes[group[0]]
            node.copies = len(group)
            node.formulas = tuple(dict.fromkeys(f for other in group for f in graph.nodes[other].formulas))
            if node.name:
                node.name = _INDEX.sub("", node.name)
            looped = any((number, number) in graph.edges for number in group)
            graph.merge(group)
            if not looped:
                graph.edges.pop((group[0], group[0]), None)


def graph_of(component: wiring.Component, most: int = MOST_BOXES) -> Graph:
    """Read a unit's structure.

    Parameters
    ----------
    component : Component
        Unit.
    most : int
        Largest number of boxes. If there are more, comparisons and roundings are left out first, then
        choices. At last only memories, multipliers, adders, submodules and ports stay.

    Returns
    -------
    Graph
    """

    def simplified(dropped: set[str], kept: set[str] | None) -> Graph:
        graph = deepcopy(whole)
        for number, node in list(graph.nodes.items()):
            if node.kind == "operation" and set(node.operations) <= dropped:
                graph.bypass(number, loops=True)
        _drop_control(graph)
        _drop_idle_choices(graph)
        _fuse(graph)
        _join_delays(graph)
        if kept:
            for number, node in list(graph.nodes.items()):
                if node.kind in ("register", "operation") and not kept & set(node.operations):
                    graph.bypass(number, loops=True)
            _drop_indirect(graph)
        _join_copies(graph)
        return graph

    whole = Netlist(component).graph
    light = _COMPARISONS | {"round"}
    choices = light | {"mux", "shift"}
    arithmetic = {"×", "×c", "+", "+c", "−", "−c"}
    for dropped, kept in ((set(), None), (light, None), (choices, None), (choices, arithmetic)):
        graph = simplified(dropped, kept)
        if len(graph.nodes) <= most:
            break
    return graph
