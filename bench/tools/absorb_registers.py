"""Moves registers into the multipliers and memories beside them. It changes an ECP5 netlist before nextpnr.

An ECP5 multiplier, MULT18X18D, has registers for each operand and for the product. A block RAM, DP16KD, has a
register for the word that it reads. Yosys uses none of these registers. `absorb_registers` takes Yosys's JSON
netlist. It moves flip-flops directly before or behind a multiplier into the multiplier, and flip-flops behind
a block RAM into the block RAM. It also disconnects the last carry of a chain if the carry has no reader. Else
nextpnr would add a pair of look-up tables for it. `absorb_tables` moves look-up tables into adders. Nothing
else of the netlist changes, and its function stays the same in every cycle from power-up on.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from blysk.bench.tools import absorb_tables as tables
from blysk.bench.tools.absorb_tables import absorb_tables

__all__ = ["Absorbed", "absorb_registers", "text_of_step"]

_MULTIPLIER, _FLIP_FLOP = "MULT18X18D", "TRELLIS_FF"

_MEMORY, _CARRY = "DP16KD", "CCU2C"

_OPERAND_BITS, _PRODUCT_BITS, _WORD_BITS = 18, 36, 18

_OUTPUT = "OUTPUT"

_INVERTER = f"{0x5555:016b}"
"""Look-up table of the negated first input."""

Pin = tuple[str, str, int]
"""A pin of a cell: names of the cell and the port, and the bit."""


@dataclass(frozen=True)
class Absorbed:
    """Counts of `absorb_registers`.

    Parameters
    ----------
    operands, products : int
        Operands and products that have registers inside a multiplier.
    removed : int
        Removed flip-flops. A flip-flop with another reader stays.
    inverters : int
        Added look-up tables that invert an enable. Flip-flops can invert an enable, multipliers cannot.
    closed : int
        Multipliers with registers for both operands and the product.
    words : int
        Read ports of block RAMs that have a register inside.
    carries : int
        Chains whose last carry was disconnected.
    tables : int
        Look-up tables that moved into adders.
    """

    operands: int = 0
    products: int = 0
    removed: int = 0
    inverters: int = 0
    closed: int = 0
    words: int = 0
    carries: int = 0
    tables: int = 0

    def as_dict(self) -> dict[str, int]:
        """The figures under stable names."""
        return asdict(self)


@dataclass(frozen=True)
class _Control:
    """Clock and enable of a register. A constant enable is a string."""

    clock: int
    enable: int | str
    inverted: bool


class _Netlist:
    """The cells of a flat module, by net."""

    def __init__(self, module: Mapping[str, Any]):
        self.cells = {
            name: {**cell, **{key: dict(cell.get(key, {})) for key in ("parameters", "connections")}}
            for name, cell in module["cells"].items()
        }
        self.ports = {bit for port in module["ports"].values() for bit in port["bits"]}
        self.pins: defaultdict[Any, set[Pin]] = defaultdict(set)
        self.by_output: dict[int, str] = {}
        for name, cell in self.cells.items():
            for port, bits in cell["connections"].items():
                for k, bit in enumerate(bits):
                    self.pins[bit].add((name, port, k))
            if cell["type"] == _FLIP_FLOP:
                self.by_output[cell["connections"]["Q"][0]] = name
        bits = [bit for cell in self.cells.values() for nets in cell["connections"].values() for bit in nets]
        self.fresh = max((bit for bit in (*bits, *self.ports) if isinstance(bit, int)), default=1) + 1
        self.inverted: dict[int, int] = {}
        self.removed = 0

    def without_registers(self, kind: str) -> list[str]:
        """Names, in order, of the cells of a kind whose own registers are unused."""
        return sorted(
            name
            for name, cell in self.cells.items()
            if cell["type"] == kind
            and not any(
                (key.startswith("REG_") and key.endswith("_CLK") and value != "NONE")
                or (key.startswith("REGMODE_") and value != "NOREG")
                for key, value in cell["parameters"].items()
            )
        )

    def net(self, cell: str, port: str) -> Any:
        """Net or constant at a port of one bit."""
        (bit,) = self.cells[cell]["connections"].get(port, ["x"])
        return bit

    def connect(self, cell: str, port: str, bit: Any) -> None:
        """Connect a port of one bit. An earlier connection of the port is replaced."""
        for old in self.cells[cell]["connections"].get(port, ()):
            self.pins[old].discard((cell, port, 0))
        self.cells[cell]["connections"][port] = [bit]
        self.pins[bit].add((cell, port, 0))

    def remove(self, cell: str) -> None:
        """Remove a flip-flop."""
        self.removed += 1
        del self.by_output[self.net(cell, "Q")]
        for port, (bit, *_) in self.cells.pop(cell)["connections"].items():
            self.pins[bit].discard((cell, port, 0))

    def control(self, cell: str) -> _Control | None:
        """Control of a flip-flop that a multiplier's register can replace. ``None`` if it cannot.

        A multiplier's registers are 0 at power-up and have a rising clock edge. It is not documented whether
        their reset or enable has priority, so flip-flops with a reset stay. Flip-flops at a port stay, too,
        because they represent another unit.
        """
        parameters = self.cells[cell]["parameters"]
        mode = {key: str(value).strip() for key, value in parameters.items()}
        clock, enable = self.net(cell, "CLK"), self.net(cell, "CE")
        if (
            not isinstance(clock, int)
            or mode.get("CLKMUX", "CLK") != "CLK"
            or mode.get("REGSET", "RESET") != "RESET"
            or mode.get("LSRMODE", "LSR") != "LSR"
            or mode.get("LSRMUX", "LSR") != "LSR"
            or self.net(cell, "LSR") not in ("0", "x")
            or self.ports & {self.net(cell, "DI"), self.net(cell, "Q")}
        ):
            return None
        if mode.get("CEMUX", "1") == "1":
            return _Control(clock, "1", False)
        if mode["CEMUX"] not in ("CE", "INV") or not isinstance(enable, int):
            return None
        return _Control(clock, enable, mode["CEMUX"] == "INV")

    def enable_of(self, control: _Control) -> Any:
        """Net that is high while a register of this control is enabled. An inverter is added if needed."""
        if not control.inverted:
            return control.enable
        if control.enable not in self.inverted:
            self.inverted[control.enable] = self.fresh
            name = f"enable_{control.enable}_LUT4_Z"
            inputs = dict(zip("ABCD", (control.enable, "0", "0", "0"), strict=True))
            self.cells[name] = {
                "hide_name": 0,
                "type": "LUT4",
                "parameters": {"INIT": _INVERTER},
                "attributes": {},
                "port_directions": {**dict.fromkeys(inputs, "input"), "Z": "output"},
                "connections": {},
            }
            for port, bit in (*inputs.items(), ("Z", self.fresh)):
                self.connect(name, port, bit)
            self.fresh += 1
        return self.inverted[control.enable]

    def use(self, cell: str, register: str, control: _Control) -> None:
        """Switch on a register of a multiplier.

        The register gets the first clock, and an enable input that is free or has the same enable already.
        """
        multiplier, enable = self.cells[cell], self.enable_of(control)
        names = [f"CE{k}" for k in range(4)]
        free = [name for name in names if multiplier["connections"].get(name, [enable]) == [enable]]
        ports = {"CLK0": control.clock, "RST0": "0", free[0]: enable}
        multiplier["port_directions"] = {
            **multiplier.get("port_directions", {}),
            **dict.fromkeys(ports, "input"),
        }
        for port, bit in ports.items():
            self.connect(cell, port, bit)
        multiplier["parameters"] |= {
            "RESETMODE": "SYNC",
            "GSR": "DISABLED",
            f"REG_{register}_CLK": "CLK0",
            f"REG_{register}_CE": free[0],
            f"REG_{register}_RST": "RST0",
        }

    def fits(self, cell: str, controls: set[_Control | None]) -> _Control | None:
        """Common control of a register's bits.

        ``None`` if the bits have different controls, or if the multiplier already uses another clock.
        """
        if len(controls) != 1:
            return None
        (control,) = controls
        clock = self.cells[cell]["connections"].get("CLK0")
        return control if control is not None and clock in (None, ["0"], ["x"], [control.clock]) else None

    def absorb_product(self, cell: str) -> bool:
        """Move the flip-flops behind a multiplier into it, if nothing else reads the product.

        Returns whether they were moved.
        """
        moved: dict[str, str] = {}
        for k in range(_PRODUCT_BITS):
            bit = self.net(cell, f"P{k}")
            readers = self.pins[bit] - {(cell, f"P{k}", 0)} if isinstance(bit, int) else set()
            if bit in self.ports or len(readers) > 1:
                return False
            for name, port, _ in readers:
                if self.cells[name]["type"] != _FLIP_FLOP or port != "DI":
                    return False
                moved[f"P{k}"] = name
        control = self.fits(cell, {self.control(name) for name in moved.values()})
        if control is None:
            return False
        for port, name in moved.items():
            bit = self.net(name, "Q")
            self.remove(name)
            self.connect(cell, port, bit)
        self.use(cell, _OUTPUT, control)
        return True

    def inverse_of(self, net: Any) -> Any:
        """Net that a look-up table inverts to ``net``. ``None`` if there is no such table."""
        drivers = [name for name, port, _ in self.pins[net] if port == "Z"]
        if not drivers or self.cells[drivers[0]]["type"] != "LUT4":
            return None
        cell = self.cells[drivers[0]]
        given = [self.net(drivers[0], port) for port in "ABCD"]
        sources = {bit for bit in given if isinstance(bit, int)}
        if len(sources) != 1:
            return None
        table = int(cell["parameters"]["INIT"], 2)
        low, high = (
            table >> sum((bit == "1" or (isinstance(bit, int) and value)) << k for k, bit in enumerate(given))
            for value in (0, 1)
        )
        return sources.pop() if low & 1 and not high & 1 else None

    def absorb_word(self, cell: str, ports: str) -> bool:
        """Move the flip-flops behind a read port of a block RAM into the block RAM.

        They move only if they have the enable of the read port. Then it does not matter whether this enable
        also acts on the output register inside. Returns whether they were moved.

        Parameters
        ----------
        cell : str
            The block RAM.
        ports : str
            ``A``, ``B``, or ``AB`` if both form one port of 36 bits, which is read as ``B``.
        """
        moved: dict[str, str] = {}
        for port in ports:
            for k in range(_WORD_BITS):
                name = f"DO{port}{k}"
                bit = self.net(cell, name)
                readers = self.pins[bit] - {(cell, name, 0)} if isinstance(bit, int) else set()
                if bit in self.ports or len(readers) > 1:
                    return False
                for reader, pin, _ in readers:
                    if self.cells[reader]["type"] != _FLIP_FLOP or pin != "DI":
                        return False
                    moved[name] = reader
        controls = {self.control(name) for name in moved.values()}
        if len(controls) != 1 or None in controls:
            return False
        (control,) = controls
        reads = ports[-1]
        enable = self.net(cell, f"CE{reads}")
        wanted = self.inverse_of(enable) if control.inverted else enable
        if control.clock != self.net(cell, f"CLK{reads}") or control.enable != wanted:
            return False
        for name, reader in moved.items():
            bit = self.net(reader, "Q")
            self.remove(reader)
            self.connect(cell, name, bit)
        for port in ports:
            self.connect(cell, f"OCE{port}", enable)
            self.cells[cell]["parameters"][f"REGMODE_{port}"] = "OUTREG"
        return True

    def absorb_words(self, cell: str) -> int:
        """Move the flip-flops behind each read port of a block RAM into it. Returns the number of ports."""
        # A parameter that is left out has its default, 18.
        bits = self.cells[cell].get("parameters", {}).get("DATA_WIDTH_B", f"{_WORD_BITS:b}")
        wide = int(str(bits), 2) == 2 * _WORD_BITS
        return sum(self.absorb_word(cell, ports) for ports in (("AB",) if wide else "AB"))

    def end_carry(self, cell: str) -> bool:
        """Disconnect the last carry of a chain if it has no reader. Returns whether it was disconnected."""
        bit = self.net(cell, "COUT")
        if not isinstance(bit, int) or bit in self.ports or self.pins[bit] != {(cell, "COUT", 0)}:
            return False
        self.connect(cell, "COUT", "x")
        return True

    def beside_operand(self, cell: str, operand: str) -> tuple[_Control, dict[str, str]] | None:
        """Control of an operand's flip-flops, and their names by port. ``None`` if they cannot move."""
        found: dict[str, str] = {}
        for k in range(_OPERAND_BITS):
            bit = self.net(cell, f"{operand}{k}")
            # A register of a constant 1 would be 0 on the first cycle.
            if bit in ("0", "x"):
                continue
            if bit not in self.by_output:
                return None
            found[f"{operand}{k}"] = self.by_output[bit]
        control = self.fits(cell, {self.control(name) for name in found.values()})
        return None if control is None else (control, found)

    def absorb_operands(self, cell: str, closes: bool) -> int:
        """Move the flip-flops before one operand or both operands into a multiplier. Returns their number.

        If only one operand has a register, nextpnr times the multiplier as if it had none. The logic before
        this register is then on a path through the multiplier. So the flip-flops of one operand move only if
        the product has a register (``closes``), and if they follow other flip-flops. Then the path is still
        short.
        """
        beside = {operand: self.beside_operand(cell, operand) for operand in "AB"}
        if None in beside.values():
            beside = {
                operand: given
                for operand, given in beside.items()
                if closes
                and given
                and all(self.net(name, "DI") in self.by_output for name in given[1].values())
            }
        if len({control.clock for control, _ in beside.values()}) > 1:
            return 0
        for operand, (control, found) in beside.items():
            for port, name in found.items():
                self.connect(cell, port, self.net(name, "DI"))
            self.use(cell, f"INPUT{operand}", control)
        # A flip-flop may be before both operands.
        for name in {name for _, found in beside.values() for name in found.values()}:
            if self.pins[self.net(name, "Q")] == {(name, "Q", 0)}:
                self.remove(name)
        return len(beside)


def absorb_registers(netlist: Mapping[str, Any], top: str = "top") -> tuple[dict[str, Any], Absorbed]:
    """Move flip-flops directly beside a multiplier, or behind a block RAM, into registers of this cell.

    All bits of an operand, or of a product, must be flip-flops of the same clock and enable. They must have
    no reset, be 0 at power-up, and not be at a port of the module. Bits of an operand may also be constant 0.
    Multipliers and block RAMs that have registers inside already stay as they are.
    Each bit of a product must have one reader, its flip-flop. A flip-flop of an operand with another reader
    also stays for that reader. The flip-flops of only one operand move if there are flip-flops before them
    and the product has a register, too. An enable that flip-flops use inverted gets one look-up table for
    all multipliers. The word that a block RAM reads must have no reader but its flip-flops, with the enable
    of the read port.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON of a flat module, mapped to ECP5. It is not changed.
    top : str
        The module.

    Returns
    -------
    netlist : dict
        The changed netlist. Its multipliers use ``REG_INPUTA``, ``REG_INPUTB`` and ``REG_OUTPUT``, with clock
        ``CLK0``, enables ``CE0`` to ``CE2``, and the constant 0 at reset ``RST0``. Its block RAMs use
        ``REGMODE`` and ``OCE``. Its carry chains have no unread ``COUT`` at the end. Adders use more inputs
        of ``CCU2C``.
    absorbed : Absorbed
        Counts of the moved registers and tables.
    """
    module = netlist["modules"][top]
    work = _Netlist(module)
    operands = products = closed = 0
    for name in work.without_registers(_MULTIPLIER):
        product = work.absorb_product(name)
        inputs = work.absorb_operands(name, product)
        products += product
        operands += inputs
        closed += product and inputs == 2
    words = sum(work.absorb_words(name) for name in work.without_registers(_MEMORY))
    chains = [name for name, cell in work.cells.items() if cell["type"] == _CARRY]
    carries = sum(work.end_carry(name) for name in chains)
    moved = absorb_tables(work.cells, work.ports)
    modules = {**netlist["modules"], top: {**module, "cells": work.cells}}
    found = Absorbed(operands, products, work.removed, len(work.inverted), closed, words, carries, moved)
    return {**netlist, "modules": modules}, found


def text_of_step() -> str:
    """Text of the files of this step, for the keys of kept results."""
    return "".join(Path(path).read_text(encoding="utf-8") for path in (__file__, tables.__file__))
