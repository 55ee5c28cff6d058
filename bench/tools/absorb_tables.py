"""Moves look-up tables in front of adders into the adders. It changes an ECP5 netlist before nextpnr.

A cell CCU2C is two bits of an adder. Each bit is a table of four inputs, and Yosys uses two of them. A choice
or a gate in front of an operand is a table of its own then. `absorb_tables` puts this table into the free
inputs of the bit. Nothing else of the netlist changes, and its function stays the same.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import permutations, product
from typing import Any

__all__ = ["absorb_tables"]

_PINS = "ABCD"

_MOST = 2
"""Largest number of bits of adders that take the same table. With more, only wires would grow longer."""

_OTHER = -1

Reader = tuple[str, int]
"""A reader of a net: name of its cell, and the bit of an adder, 0 or 1; `_OTHER` for any other input."""


@dataclass(frozen=True)
class _Table:
    """A table of four inputs: its rows, and the net or constant at each input."""

    rows: int
    pins: tuple[Any, ...]

    @property
    def nets(self) -> list[int]:
        """Nets at the inputs, each once."""
        return list(dict.fromkeys(pin for pin in self.pins if isinstance(pin, int)))

    def row(self, values: Mapping[Any, int]) -> int:
        """Number of the row that values of the nets choose. A constant is the text 0 or 1."""
        return sum(values.get(pin, pin == "1") << k for k, pin in enumerate(self.pins))


def _table(cell: Mapping[str, Any], suffix: str = "") -> _Table | None:
    """The table of a cell, or of a bit of an adder. ``None`` if an input is open, or if it must stay."""
    parameters, nets = cell["parameters"], cell["connections"]
    pins = tuple(nets.get(f"{pin}{suffix}", ["x"])[0] for pin in _PINS)
    stays = str(cell.get("attributes", {}).get("keep", "0")).strip("0")
    if stays or any(pin not in ("0", "1") for pin in pins if not isinstance(pin, int)):
        return None
    if suffix and parameters.get(f"INJECT1_{suffix}", "YES") != "NO":
        return None
    return _Table(int(parameters[f"INIT{suffix}"], 2), pins)


@cache
def _placed(count: int, passes: tuple[int, ...], makes: tuple[int, ...]) -> tuple[int, tuple] | None:
    """Rows of an adder's bit, and for each input the number of an operand, or a constant.

    Parameters
    ----------
    count : int
        Number of operands, 4 at most.
    passes, makes : tuple of int
        For all values of the operands: whether the bit passes a carry on, and the carry that it makes if it
        passes none on.

    Returns
    -------
    tuple or None
        ``None`` if no order of the operands works. The carry that a bit makes is the row that A and B choose
        while C and D are 0.
    """
    cases = list(zip(product((0, 1), repeat=count), passes, makes, strict=True))
    for used in permutations(range(4), count):
        # A free input D is 1 and a free input C is 0, as Yosys has them.
        for free in product("01", "01", "01", "10"):
            pins = [used.index(k) if k in used else free[k] for k in range(4)]
            rows: dict[int, int] = {}
            made: dict[int, int] = {}
            fits = True
            for values, passed, carry in cases:
                bits = (pin == "1" if isinstance(pin, str) else values[pin] for pin in pins)
                row = sum(bit << k for k, bit in enumerate(bits))
                rows[row] = passed
                if not passed:
                    fits &= made.setdefault(row & 3, carry) == carry
            if fits and all(rows.setdefault(row, carry) == carry for row, carry in made.items()):
                return sum(bit << row for row, bit in rows.items()), tuple(pins)
            if count == 4:
                break
    return None


def _joined(bit: _Table, net: int, table: _Table) -> _Table | None:
    """The bit of an adder with the table inside that drives ``net``. ``None`` if it does not fit."""
    nets = list(dict.fromkeys([*(pin for pin in bit.nets if pin != net), *table.nets]))
    if len(nets) > len(_PINS):
        return None
    passes, makes = [], []
    for values in _values(nets):
        row = bit.row(values | {net: table.rows >> table.row(values) & 1})
        passes.append(bit.rows >> row & 1)
        makes.append(bit.rows >> (row & 3) & 1)
    found = _placed(len(nets), tuple(passes), tuple(makes))
    if found is None:
        return None
    rows, pins = found
    return _Table(rows, tuple(pin if isinstance(pin, str) else nets[pin] for pin in pins))


def _values(nets: list[int]) -> Iterator[dict[int, int]]:
    """All values of nets."""
    for bits in product((0, 1), repeat=len(nets)):
        yield dict(zip(nets, bits, strict=True))


def absorb_tables(cells: dict[str, dict[str, Any]], ports: set[Any]) -> int:
    """Move look-up tables into the bits of adders that read them, and remove the tables.

    A table moves if only bits of adders read it, `_MOST` at most, and if each of these bits then has at most
    four operands. The carry that a bit makes depends on its inputs A and B alone, so not every table fits.

    Parameters
    ----------
    cells : dict
        Cells of a flat module in Yosys's JSON, mapped to ECP5. They are changed.
    ports : set
        Nets of the module's ports.

    Returns
    -------
    int
        Number of removed tables.
    """
    tables: dict[int, tuple[str, _Table]] = {}
    bits: dict[Reader, _Table] = {}
    readers: defaultdict[Any, set[Reader]] = defaultdict(set)
    for name, cell in cells.items():
        nets, ways = cell["connections"], cell.get("port_directions", {})
        if cell["type"] == "LUT4" and (table := _table(cell)) is not None:
            tables[nets["Z"][0]] = name, table
        taken = set()
        for k in range(2) if cell["type"] == "CCU2C" else ():
            if (table := _table(cell, str(k))) is not None:
                bits[name, k] = table
                taken |= {f"{pin}{k}" for pin in _PINS}
                for net in table.nets:
                    readers[net].add((name, k))
        for port in nets.keys() - taken:
            if ways.get(port) != "output":
                for net in nets[port]:
                    readers[net].add((name, _OTHER))
    waiting, removed = list(tables), 0
    while waiting:
        net = waiting.pop()
        reading = readers[net]
        if net not in tables or net in ports or not 0 < len(reading) <= _MOST or not reading <= bits.keys():
            continue
        name, table = tables[net]
        joined = {bit: found for bit in reading if (found := _joined(bits[bit], net, table)) is not None}
        if len(joined) < len(reading):
            continue
        bits.update(joined)
        for (adder, k), found in joined.items():
            cells[adder]["parameters"][f"INIT{k}"] = f"{found.rows:016b}"
            pins = zip(_PINS, found.pins, strict=True)
            cells[adder]["connections"].update({f"{pin}{k}": [bit] for pin, bit in pins})
        for source in table.nets:
            readers[source] = (readers[source] - {(name, _OTHER)}) | joined.keys()
            waiting.append(source)
        del tables[net], cells[name]
        removed += 1
    return removed
