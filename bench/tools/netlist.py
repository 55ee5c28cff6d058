"""The netlist of a unit as a graph of words.

The netlist is Amaranth's own, read by Yosys.
"""

import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterable

from amaranth.back import rtlil
from amaranth.hdl import Fragment, Shape
from amaranth.lib import stream, wiring
from amaranth.lib.data import ArrayLayout, StructLayout
from amaranth.lib.fifo import FIFOInterface

from blysk.bench.tools.formulas import Formulas
from blysk.bench.tools.graph import Graph, Node
from blysk.hdl.emit.yosys import cells_and_ports

__all__ = [
    "Netlist",
    "describe_shape",
]


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

_DATA_PORT = re.compile(r"payload|data|constants|status")


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
    """Net, direction, name and shape of every member, without valid and ready.

    The direction is true for an input.
    """
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


class Netlist:
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
        graph, ports, formulas = self.graph, module["ports"], Formulas(self.component)
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
                    number = graph.add(Node("register", part, f"{width}", formulas=formulas.of(part)))
                    self.owner |= dict.fromkeys(word[start : start + width], number)
                    operands = taken[start : start + width]
                    inputs.append((number, [(bit, True) for bit in operands if isinstance(bit, int)]))
                continue
            elif kind.startswith("$mem"):
                depth, width = (int(cell["parameters"][key], 2) for key in ("SIZE", "WIDTH"))
                rom = not int(cell["parameters"]["WR_PORTS"], 2)
                memory_name = _short([cell["parameters"]["MEMID"].lstrip("\\").removesuffix(".memory")])
                detail = f"{'ROM' if rom else 'RAM'} {depth} × {width}"
                number = graph.add(Node("memory", memory_name, detail, formulas=formulas.of(memory_name)))
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
        """Operands that multiplexers choose only to keep a register's word.

        An operand is given by the name of its cell and by its number.
        """
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
        """Whether an adder adds one bit of a word to the upper bits of the same word."""
        return any(
            sum(isinstance(bit, int) for bit in dict.fromkeys(cell["connections"][port])) <= 1
            and isinstance(cell["connections"][port][0], int)
            for port in "AB"
        )

    def _operands(self, name: str, place: int | None = None) -> Iterable[tuple[int, bool]]:
        """Input bits of a cell. With ``place``: only the input bits that give output bit ``place``.

        Each bit has a flag, which is true if the bit carries data.
        """
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
        """Boxes whose words reach a net, directly or through cells that have no box.

        Each box has a flag, which is true if the box sends data to the net.
        """
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
    """Name, offset and width of a register's fields. A register without fields counts as a single field."""
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
    """Words among which a multiplexer chooses."""
    operands = cell["connections"]
    width = len(operands["Y"])
    several = operands["B"]
    return [operands["A"], *(several[k : k + width] for k in range(0, len(several), width))]


def _without_duplicates(cells: dict) -> tuple[dict, dict[int, int]]:
    """Cells without duplicates, and for each net of a dropped cell the net that replaces it.

    A duplicate has the same kind, parameters and inputs as another cell.
    """
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
    """The simplest name of a net, without path and serial number."""
    if not names:
        return ""
    name = min(names, key=lambda name: (name.count("."), "__" in name, len(name), name)).split(".")[-1]
    name = re.sub(r"\$\d+$", "", name.lstrip("\\"))
    return "" if name.startswith("$") else name
