"""Cost of a component before synthesis: multipliers, register bits, memory bits."""

from collections import Counter
from dataclasses import dataclass

from amaranth.back import rtlil
from amaranth.lib import wiring

from blysk.hdl.emit.yosys import cells_and_ports

__all__ = ["Cost", "cost_of"]


@dataclass(frozen=True)
class Cost:
    """Parts of a component's netlist, counted after constant folding and before technology mapping.

    Parameters
    ----------
    cells : int
        Operators, multiplexers, registers and memories of any width.
    multipliers : dict of (int, int) to int
        Number of multipliers for each pair of operand widths, the wider width first. Multipliers by a
        constant are left out.
    constant_multipliers : int
        Number of multipliers by a constant.
    register_bits : int
        Flip-flops.
    rom_bits, ram_bits : int
        Bits of memories without and with a write port.
    """

    cells: int
    multipliers: dict[tuple[int, int], int]
    constant_multipliers: int
    register_bits: int
    rom_bits: int
    ram_bits: int

    @property
    def multiplier_count(self) -> int:
        """Number of multipliers of any width."""
        return sum(self.multipliers.values())

    @property
    def totals(self) -> dict[str, int]:
        """Four numbers by name: ``cells``, ``multipliers``, ``register_bits`` and ``memory_bits``."""
        return {
            "cells": self.cells,
            "multipliers": self.multiplier_count,
            "register_bits": self.register_bits,
            "memory_bits": self.rom_bits + self.ram_bits,
        }


def cost_of(component: wiring.Component) -> Cost:
    """Count the parts of a component.

    Raises
    ------
    RuntimeError
        If its netlist cannot be read.
    """
    cells = cells_and_ports(rtlil.convert(component, name="top", emit_src=False))["cells"].values()
    multipliers: Counter[tuple[int, int]] = Counter()
    constant = registers = rom = ram = 0
    for cell in cells:
        kind, parameters = cell["type"], cell["parameters"]
        if kind == "$mul":
            operands = [cell["connections"][port] for port in "AB"]
            if any(all(isinstance(bit, str) for bit in operand) for operand in operands):
                constant += 1
            else:
                multipliers[tuple(sorted(map(_significant, operands), reverse=True))] += 1
        elif "dff" in kind:
            registers += int(parameters["WIDTH"], 2)
        elif kind.startswith("$mem"):
            bits = int(parameters["WIDTH"], 2) * int(parameters["SIZE"], 2)
            if int(parameters["WR_PORTS"], 2):
                ram += bits
            else:
                rom += bits
    return Cost(len(cells), dict(multipliers), constant, registers, rom, ram)


def _significant(operand: list) -> int:
    """Bits of an operand without the copies of its sign or the zeros at its top."""
    width = len(operand)
    while width > 1 and operand[width - 1] == operand[width - 2]:
        width -= 1
    return width
