"""Starts carry chains without a cell for the first carry. It changes an ECP5 netlist before nextpnr.

Yosys gives the first adder of a chain, CCU2C, a constant carry. nextpnr puts a pair of look-up tables before
each such chain, and leads the constant to it through the wires of the device. `start_carries` makes the first
carry of a chain from the operands alone, so that no constant is needed.
"""

from collections.abc import Mapping
from typing import Any

__all__ = ["start_carries"]

_PINS = "ABCD"


def start_carries(netlist: Mapping[str, Any]) -> int:
    """Change the first adders of chains in a mapped netlist, in place. Returns their number.

    Each adder has two bits, and so two carries. The first carry depends on the operands A0 and B0 if C0, D0
    and the carry before it are constant. A lower quarter of the table then gives this carry, and the upper
    quarter, which passes the carry before, is 0. The sum of the first bit, if it is read, becomes a look-up
    table.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON, mapped.
    """
    cells = netlist["modules"]["top"]["cells"]
    read = {
        bit
        for cell in cells.values()
        for port, bits in cell["connections"].items()
        if cell["port_directions"][port] == "input"
        for bit in bits
    }
    read.update(bit for port in netlist["modules"]["top"]["ports"].values() for bit in port["bits"])
    started, sums = 0, {}
    for name, cell in cells.items():
        pins = cell["connections"]
        if cell["type"] != "CCU2C" or not {pins[pin][0] for pin in ("CIN", "C0", "D0")} <= {"0", "1"}:
            continue
        if cell["parameters"]["INJECT1_0"] != "NO":
            continue
        carry = int(pins["CIN"][0])
        table = int(cell["parameters"]["INIT0"], 2)
        row = 4 * int(pins["C0"][0]) + 8 * int(pins["D0"][0])
        passes = [table >> (row + k) & 1 for k in range(4)]
        carries = [carry if passed else table >> k & 1 for k, passed in enumerate(passes)]
        if pins["S0"][0] in read:
            sums[f"{name}$first"] = _look_up_table(
                [passed ^ carry for passed in passes], {"A": pins["A0"], "B": pins["B0"]}, pins["S0"]
            )
        cell["parameters"]["INIT0"] = f"{sum(bit << k for k, bit in enumerate(carries)):016b}"
        pins.update(C0=["1"], D0=["1"], S0=["x"], CIN=["x"])
        started += 1
    cells.update(sums)
    return started


def _look_up_table(rows: list[int], inputs: dict[str, list[Any]], output: list[Any]) -> dict[str, Any]:
    """A cell of a table over A and B."""
    return {
        "hide_name": 0,
        "type": "LUT4",
        "parameters": {"INIT": f"{sum(rows[k % 4] << k for k in range(16)):016b}"},
        "attributes": {},
        "port_directions": {**dict.fromkeys(_PINS, "input"), "Z": "output"},
        "connections": {**{pin: ["0"] for pin in _PINS}, **inputs, "Z": output},
    }
