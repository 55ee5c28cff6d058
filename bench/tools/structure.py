"""A unit's structure as boxes and arrows, made from its netlist.

The netlist is Amaranth's own, read by Yosys. A box is a register with the operations in front of it, an
operation that several registers share, a memory, a submodule or a port. Wires, slices, constants, inversions,
single-bit logic and the control by valid and ready are left out, and so is a choice between a word and
itself or a constant (enables, resets, saturation). Copies of one structure, as of the three components of a
vector, are one box.
"""

import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass, field

from amaranth.back import rtlil
from amaranth.hdl import Fragment, Shape
from amaranth.lib import stream, wiring
from amaranth.lib.data import ArrayLayout, StructLayout
from amaranth.lib.fifo import FIFOInterface

from blysk.hdl.emit.yosys import cells_and_ports

__all__ = ["Graph", "Node", "describe_shape", "graph_of", "layers"]

_SYMBOLS = {
    "$mul": "×",
    "$add": "+",
    "$sub": "−",
    "$neg": "−",
    "$lt": "<",
    "$le": "≤",
    "$gt": ">",
    "$ge": "≥",
    "$eq": "=",
    "$ne": "≠",
    "$shl": "shift",
    "$shr": "shift",
    "$sshr": "shift",
    "$sshl": "shift",
    "$shift": "shift",
    "$shiftx": "shift",
    "$mux": "mux",
    "$pmux": "mux",
}
_BITWISE = {"$not", "$and", "$or", "$xor", "$pos"}
_COMPARISONS = {"<", "≤", ">", "≥", "=", "≠"}
_DATA_PORT = re.compile(r"payload|data|constants|status")
_CONTROL = re.compile(r"(^|_)(ready|valid|ages)$")

MOST_BOXES = 48
"""Boxes of a drawing above which it leaves out more."""


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
        Symbols of the operations in the box, and how many of each; ``×c`` is by a constant.
    copies : int
        Equal boxes that this one stands for.
    stages : int
        Registers of a plain delay that the box stands for.
    """

    kind: str
    name: str = ""
    detail: str = ""
    operations: Counter[str] = field(default_factory=Counter)
    copies: int = 1
    stages: int = 1


@dataclass
class Graph:
    """Boxes and arrows.

    Parameters
    ----------
    nodes : dict of int to Node
        Boxes.
    edges : dict of (int, int) to bool
        Arrows from a box to another; false for one that only chooses or enables.
    """

    nodes: dict[int, Node] = field(default_factory=dict)
    edges: dict[tuple[int, int], bool] = field(default_factory=dict)

    def add(self, node: Node) -> int:
        """Add a box and return its number."""
        number = len(self.nodes)
        self.nodes[number] = node
        return number

    def connect(self, source: int, target: int, is_data: bool) -> None:
        """Add an arrow; one that carries data is stronger than one that chooses."""
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
        """Drop all other boxes."""
        numbers = set(numbers)
        self.nodes = {number: node for number, node in self.nodes.items() if number in numbers}
        self.edges = {edge: data for edge, data in self.edges.items() if numbers.issuperset(edge)}

    def bypass(self, number: int, loops: bool = False) -> None:
        """Drop a box and join its sources to its targets, to themselves only if told."""
        into = [(a, data) for (a, b), data in self.edges.items() if b == number and a != number]
        out = [(b, data) for (a, b), data in self.edges.items() if a == number and b != number]
        del self.nodes[number]
        self.edges = {edge: data for edge, data in self.edges.items() if number not in edge}
        for a, first in into:
            for b, second in out:
                if a != b or loops:
                    self.connect(a, b, first and second)

    def merge(self, group: Iterable[int]) -> int:
        """Make one box of several: the first of the group stands for all."""
        first, *others = group
        moved = dict.fromkeys(others, first)
        edges, self.edges = self.edges, {}
        for (a, b), data in edges.items():
            self.connect(moved.get(a, a), moved.get(b, b), data)
        for number in others:
            del self.nodes[number]
        return first


def describe_shape(shape) -> str:
    """Short text of a payload's shape: formats and widths."""
    if isinstance(shape, ArrayLayout):
        return f"{shape.length} × {describe_shape(shape.elem_shape)}"
    if isinstance(shape, StructLayout):
        members = list(shape.members.values())
        if len(members) > 1 and all(member == members[0] for member in members):
            return f"{len(members)} × {describe_shape(members[0])}"
        return f"{Shape.cast(shape).width} bits"
    if isinstance(shape, Shape | int | range) or not repr(shape).startswith(("SQ", "UQ")):
        plain = Shape.cast(shape)
        return f"{plain.width} bit{'s' * (plain.width != 1)}{', signed' * plain.signed}"
    return repr(shape)


def _fields(name: str, shape) -> list[tuple[str, str, int, int]]:
    """Name, description, offset and width of the fields of a port."""
    if isinstance(shape, StructLayout):
        return [
            (key, describe_shape(part.shape), part.offset, Shape.cast(part.shape).width)
            for key, part in shape
        ]
    return [(name, describe_shape(shape), 0, Shape.cast(shape).width)]


def _ports(component: wiring.Component) -> list[tuple[str, bool, str, object]]:
    """Net, whether it is an input, name and shape of every member, without valid and ready."""
    ports = []
    for name, member in component.signature.members.items():
        is_input = member.flow == wiring.In
        if member.is_signature and isinstance(member.signature, stream.Signature):
            payload = member.signature.members["payload"].shape
            ports.append((f"{name}__payload", is_input, name, payload))
        elif member.is_port:
            ports.append((name, is_input, name, member.shape))
    return ports


def _submodules(fragment: Fragment, path: str) -> dict[str, str]:
    """Modules of the units and FIFOs directly inside a unit, and the names of their classes."""
    found = {}
    for sub, name, *_ in fragment.subfragments:
        inner = f"{path}.{name}"
        origins = [type(o).__name__ for o in sub.origins or () if _is_unit(o)]
        found |= {inner: origins[0]} if origins else _submodules(sub, inner)
    return found


def _is_unit(origin) -> bool:
    if isinstance(origin, FIFOInterface):
        return True
    return isinstance(origin, wiring.Component) and any(
        member.is_signature and isinstance(member.signature, stream.Signature)
        for member in origin.signature.members.values()
    )


class _Netlist:
    """The netlist of a unit as a graph of words."""

    def __init__(self, component: wiring.Component):
        self.component = component
        fragment = Fragment.get(component, None)
        self.units = _submodules(fragment, "top")
        text = rtlil.convert(component, name="top", emit_src=False)
        present = set(re.findall(r"^module \\(\S+)$", text, flags=re.MULTILINE))
        self.units = {path: name for path, name in self.units.items() if path in present}
        for path in self.units:
            text = text.replace(f"\nmodule \\{path}\n", f"\nattribute \\keep_hierarchy 1\nmodule \\{path}\n")
        module = cells_and_ports(text)
        self.cells, self.replaced = _without_duplicates(module["cells"])
        self.held = self._find_held()
        self.graph = Graph()
        self.driver: dict[int, tuple[str, int]] = {}
        self.owner: dict[int, int] = {}
        self.cache: dict[int, dict[int, bool]] = {}
        self._read(module)

    def _read(self, module) -> None:
        graph, ports = self.graph, module["ports"]
        names = defaultdict(list)
        for name, net in module["netnames"].items():
            if not net["hide_name"]:
                names[tuple(net["bits"])].append(name)
        members = _ports(self.component)
        sinks, inputs = [], []
        for net, is_input, member, shape in members:
            bits = ports[net]["bits"] if net in ports else module["netnames"][net]["bits"]
            for name, text, offset, width in _fields(member, shape):
                number = graph.add(Node("input" if is_input else "output", name, text))
                field_bits = bits[offset : offset + width]
                if is_input:
                    self.owner |= dict.fromkeys(field_bits, number)
                else:
                    sinks.append((number, field_bits))
        for name, cell in self.cells.items():
            kind = cell["type"]
            for port, bits in cell["connections"].items():
                if cell["port_directions"][port] == "output":
                    self.driver |= {bit: (name, k) for k, bit in enumerate(bits) if isinstance(bit, int)}
            if "dff" in kind:
                word, taken = tuple(cell["connections"]["Q"]), cell["connections"]["D"]
                for part, start, width in _parts(word, names):
                    number = graph.add(Node("register", part, f"{width}"))
                    self.owner |= dict.fromkeys(word[start : start + width], number)
                    operands = taken[start : start + width]
                    inputs.append((number, [(bit, True) for bit in operands if isinstance(bit, int)]))
                continue
            elif kind.startswith("$mem"):
                depth, width = (int(cell["parameters"][key], 2) for key in ("SIZE", "WIDTH"))
                rom = not int(cell["parameters"]["WR_PORTS"], 2)
                memory_name = _short([cell["parameters"]["MEMID"].lstrip("\\").removesuffix(".memory")])
                detail = f"{'ROM' if rom else 'RAM'} {depth} × {width}"
                number = graph.add(Node("memory", memory_name, detail))
            elif kind in self.units:
                title = (
                    re.sub(r"(?<=[a-z])(?=[A-Z])", " ", self.units[kind].removesuffix("Unit"))
                    .lower()
                    .lstrip("_")
                )
                title = "FIFO" if "FIFO" in self.units[kind] else title
                number = graph.add(Node("unit", kind.split(".")[-1], title))
            elif self._is_operation(name):
                symbol = _SYMBOLS[kind]
                if symbol == "+" and self._rounds(cell):
                    symbol = "round"
                elif symbol in ("×", "+", "−") and self._has_constant(cell):
                    symbol += "c"
                number = graph.add(Node("operation", operations=Counter([symbol])))
            else:
                continue
            inputs.append((number, list(self._operands(name))))
            for port, bits in cell["connections"].items():
                is_output = cell["port_directions"][port] == "output"
                if is_output and (kind not in self.units or _DATA_PORT.search(port)):
                    self.owner |= dict.fromkeys(bits, number)
        for number, operands in inputs:
            for bit, is_data in operands:
                for source, data in self._sources(bit).items():
                    graph.connect(source, number, data and is_data)
        for number, bits in sinks:
            for bit in bits:
                for source, data in self._sources(bit).items():
                    graph.connect(source, number, data)

    def _find_held(self) -> set[tuple[str, int]]:
        """Operands by which a choice leaves a register as it is: cell, and number of the operand."""
        choices = {}
        for name, cell in self.cells.items():
            if cell["type"] in ("$mux", "$pmux"):
                choices |= dict.fromkeys(cell["connections"]["Y"], name)
        held = set()
        for cell in self.cells.values():
            if "dff" in cell["type"]:
                word, todo, seen = cell["connections"]["Q"], [cell["connections"]["D"]], set()
                while todo:
                    for name in {choices[bit] for bit in todo.pop() if bit in choices} - seen:
                        seen.add(name)
                        for k, operand in enumerate(_operand_words(self.cells[name])):
                            if operand == word:
                                held.add((name, k))
                            else:
                                todo.append(operand)
        return held

    def _is_operation(self, name: str) -> bool:
        cell = self.cells[name]
        kind, operands = cell["type"], cell["connections"]
        if kind in ("$mux", "$pmux"):
            words = [
                tuple(operand)
                for k, operand in enumerate(_operand_words(cell))
                if (name, k) not in self.held and any(isinstance(bit, int) for bit in operand)
            ]
            return len(set(words)) > 1
        if kind not in _SYMBOLS:
            return False
        symbol = _SYMBOLS[kind]
        if symbol in ("=", "≠") or symbol == "shift":
            return any(isinstance(bit, int) for bit in operands["B"])
        if symbol in ("+", "−"):
            return len(operands["Y"]) > 1 and any(isinstance(bit, int) for bit in operands["A"])
        return True

    def _has_constant(self, cell) -> bool:
        """Whether an operand is a constant."""
        operands = (cell["connections"].get(port, [0]) for port in "AB")
        return any(not any(isinstance(bit, int) for bit in operand) for operand in operands)

    def _rounds(self, cell) -> bool:
        """Whether an adder adds one bit of a word to its upper bits."""
        return any(
            sum(isinstance(bit, int) for bit in dict.fromkeys(cell["connections"][port])) <= 1
            and isinstance(cell["connections"][port][0], int)
            for port in "AB"
        )

    def _operands(self, name: str, place: int | None = None) -> Iterable[tuple[int, bool]]:
        """Input bits of a cell (or those of one of its output bits), and whether they carry data."""
        cell = self.cells[name]
        kind = cell["type"]
        if kind in ("$mux", "$pmux"):
            for k, operand in enumerate(_operand_words(cell)):
                if (name, k) not in self.held:
                    bits = operand if place is None else operand[place : place + 1]
                    yield from ((bit, True) for bit in bits if isinstance(bit, int))
            yield from ((bit, False) for bit in cell["connections"]["S"] if isinstance(bit, int))
            return
        for port, bits in cell["connections"].items():
            if cell["port_directions"][port] == "output":
                continue
            if kind in self.units and not _DATA_PORT.search(port):
                continue
            if port in ("CLK", "ARST", "SRST", "RD_CLK", "WR_CLK", "RD_EN", "RD_ARST", "RD_SRST"):
                continue
            is_data = port not in ("EN", "WR_EN")
            if place is not None and kind in _BITWISE:
                bits = bits[min(place, len(bits) - 1) :][:1]
            for bit in bits:
                if isinstance(bit, int):
                    yield bit, is_data

    def _sources(self, bit: int) -> dict[int, bool]:
        """Boxes that a net depends on through cells that have none, and whether by data."""
        bit = self.replaced.get(bit, bit)
        found = self.cache.get(bit)
        if found is None:
            self.cache[bit] = found = {}
            if bit in self.owner:
                found[self.owner[bit]] = True
            elif bit in self.driver:
                name, place = self.driver[bit]
                if self.cells[name]["type"] not in self.units:
                    for operand, is_data in self._operands(name, place):
                        for source, data in self._sources(operand).items():
                            found[source] = found.get(source, False) or (data and is_data)
        return found


def _parts(word: tuple[int, ...], names: dict[tuple, list[str]]) -> list[tuple[str, int, int]]:
    """Name, offset and width of a register's fields; of the whole where it has none."""
    whole = _short(names[word])
    stems = {f"{name}." for name in names[word]}
    found = {}
    for bits, aliases in names.items():
        for alias in aliases:
            stem, field_name = alias.rpartition(".")[::2]
            if f"{stem}." in stems and len(bits) < len(word) and bits[0] in word:
                start = word.index(bits[0])
                if "[" not in field_name and word[start : start + len(bits)] == bits:
                    found[start] = (re.sub(r"\$\d+$", "", field_name), start, len(bits))
    parts = [found[start] for start in sorted(found)]
    return parts if sum(width for _, _, width in parts) == len(word) else [(whole, 0, len(word))]


def _operand_words(cell) -> list[list]:
    """Words among which a choice chooses."""
    operands = cell["connections"]
    width = len(operands["Y"])
    several = operands["B"]
    return [operands["A"], *(several[k : k + width] for k in range(0, len(several), width))]


def _without_duplicates(cells: dict) -> tuple[dict, dict[int, int]]:
    """Cells without those that work out the same word once more, and nets for those of the dropped ones."""
    replaced: dict[int, int] = {}
    count = -1
    while count != len(cells):
        count = len(cells)
        known: dict[tuple, dict] = {}
        kept = {}
        for name, cell in cells.items():
            outputs = {p for p, way in cell["port_directions"].items() if way == "output"}
            for port, bits in cell["connections"].items():
                if port not in outputs:
                    cell["connections"][port] = [replaced.get(bit, bit) for bit in bits]
            key = None
            if "Y" in outputs and len(outputs) == 1:
                inputs = {p: bits for p, bits in cell["connections"].items() if p != "Y"}
                key = (cell["type"], json.dumps([cell["parameters"], inputs], sort_keys=True))
            if key in known:
                replaced |= zip(cell["connections"]["Y"], known[key]["connections"]["Y"], strict=True)
            else:
                kept[name] = cell
                if key:
                    known[key] = cell
        cells = kept
        while any(bit in replaced for bit in replaced.values()):
            replaced = {bit: replaced.get(other, other) for bit, other in replaced.items()}
    return cells, replaced


def _short(names: list[str]) -> str:
    """The plainest of a net's names, without path and serial number."""
    if not names:
        return ""
    name = min(names, key=lambda name: (name.count("."), "__" in name, len(name), name)).split(".")[-1]
    name = re.sub(r"\$\d+$", "", name.lstrip("\\"))
    return "" if name.startswith("$") else name


def _reached(starts: Iterable[int], following: dict[int, set[int]]) -> set[int]:
    found, todo = set(), list(starts)
    while todo:
        number = todo.pop()
        if number not in found:
            found.add(number)
            todo += following[number]
    return found


def _drop_control(graph: Graph) -> None:
    """Keep what data pass through, and what chooses among them by the operands."""
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
    """Bypass choices among fewer than two words, join a choice among choices into one."""
    changed = True
    while changed:
        changed = False
        for number in list(graph.nodes):
            node = graph.nodes[number]
            if node.kind != "operation" or set(node.operations) != {"mux"}:
                continue
            sources, targets = graph.neighbours(data_only=True)
            words = sources[number] - {number}
            # A register that may keep its word does not choose.
            if len(targets[number]) == 1:
                words -= targets[number]
            if len(words) < 2:
                graph.bypass(number)
                changed = True


def _fuse(graph: Graph) -> None:
    """Put operations into the box that alone takes their result."""
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
            # A choice among the results of choices is one.
            if other.operations["mux"]:
                other.operations["mux"] = 1
            graph.merge([target, number])
            if not loops:
                graph.edges.pop((target, target), None)
            changed = True
            break


def _join_delays(graph: Graph) -> None:
    """Make one box of a register and those that only hold its word later on."""
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
    """Drop choices, but of ports that do nothing else, and arrows beside a longer way."""
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
    """Make one box of boxes that are alike and stand between the same others."""
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
        Boxes above which choices, then comparisons and roundings, then plain registers and at last all but
        memories, multipliers, submodules and ports are left out.

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

    whole = _Netlist(component).graph
    light = _COMPARISONS | {"round"}
    choices = light | {"mux", "shift"}
    products, sums = {"×", "×c"}, {"+", "+c", "−", "−c"}
    for dropped, kept in (
        (set(), None),
        (light, None),
        (choices, None),
        (choices, products | sums),
        (choices | sums, products),
    ):
        graph = simplified(dropped, kept)
        if len(graph.nodes) <= most:
            break
    return graph


def layers(graph: Graph) -> tuple[dict[int, int], set[tuple[int, int]]]:
    """Column of each box, and the arrows that lead back.

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
        # What nothing comes before stands next to where it is used.
        elif ahead and not sources[number] - {number} and graph.nodes[number].kind != "input":
            columns[number] = min(ahead) - 1
    return columns, back
