"""Shares address bits of memories of look-up tables. It changes an ECP5 netlist before nextpnr.

A memory cell, TRELLIS_DPR16X4, has 16 words and four address bits. If a memory has fewer words, Yosys gives
the other bits a constant, and nextpnr leads this constant to all cells through the wires of the device.
`share_addresses` gives these bits the net of the first address bit, which is there already.
"""

from collections.abc import Mapping
from typing import Any

__all__ = ["share_addresses"]


def share_addresses(netlist: Mapping[str, Any]) -> int:
    """Change the constant address bits of memory cells in a mapped netlist, in place. Returns their number.

    A bit is changed if it is the same constant for writing and for reading, and if both first bits are nets.
    Both addresses then change alike, and different addresses stay different. So each word that is read is the
    word that was written. A cell with a 1 in its initial words stays unchanged.

    Parameters
    ----------
    netlist : dict
        Yosys's JSON, mapped.
    """
    shared = 0
    for cell in netlist["modules"]["top"]["cells"].values():
        if cell["type"] != "TRELLIS_DPR16X4" or "1" in cell["parameters"]["INITVAL"]:
            continue
        written, read = (cell["connections"][port] for port in ("WAD", "RAD"))
        if {written[0], read[0]} & {"0", "1", "x"}:
            continue
        for bit in range(1, 4):
            if written[bit] == read[bit] and written[bit] in ("0", "1"):
                written[bit], read[bit] = written[0], read[0]
                shared += 1
    return shared
