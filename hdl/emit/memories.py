"""Memories and multipliers of a netlist: initial zeros, and attributes for synthesis."""

import json
import re
from typing import NamedTuple

from blysk.hdl.core.memory import NEEDS_ZEROS

__all__ = ["SMALL", "ZEROS_MARK", "with_attributes", "without_zeros"]

SMALL = 64
"""Largest number of words of a memory that belongs into look-up tables."""

ZEROS_MARK = "".join(f"  attribute \\{name} {value}\n" for name, value in NEEDS_ZEROS.items())
"""Line of a netlist before a memory whose words are read before they are written."""

_PART = r"(?:  attribute [^\n]*\n)*  cell \{kind} \S+\n(?:    [^\n]*\n)*?  end\n"
_INITIAL, _WRITE = (re.compile(_PART.format(kind=kind)) for kind in (r"$meminit_v2", r"$memwr_v2"))
_MEMORY = re.compile(r'^    parameter \\MEMID (".*")$', re.MULTILINE)
_ZEROS = re.compile(r"^    connect \\DATA \d+'0+$", re.MULTILINE)
_NEEDED = re.compile(re.escape(ZEROS_MARK) + r"  memory .* (\\\S+)$", re.MULTILINE)
_ARRAY = re.compile(r"^  reg (?:\[\d+:0\] )?(\w+) \[(\d+):0\];$", re.MULTILINE)
_WIRE = re.compile(r"^  (?:wire|reg) (?:signed )?(?:\[\d+:0\] )?(\w+);$", re.MULTILINE)
_WRITTEN = re.compile(r"^\s+(\w+)\[.*\] <= ", re.MULTILINE)
_PRODUCT = re.compile(r"^  assign (\w+) = [^;]* \* [^;]*;$", re.MULTILINE)


class _Attributes(NamedTuple):
    """Attributes of a synthesis tool: a name, and values for large and small memories; for multipliers."""

    ram: tuple[str, str, str]
    rom: tuple[str, str, str]
    multiplier: tuple[str, str]


_TOOLS = {
    "vivado": _Attributes(
        ("ram_style", "block", "distributed"), ("rom_style", "block", "distributed"), ("use_dsp", "yes")
    ),
    "quartus": _Attributes(("ramstyle", "", "MLAB"), ("romstyle", "", "MLAB"), ("multstyle", "dsp")),
    "synplify": _Attributes(
        ("syn_ramstyle", "block_ram", "distributed"),
        ("syn_romstyle", "block_rom", "logic"),
        ("syn_multstyle", "block_mult"),
    ),
    "gowin": _Attributes(
        ("syn_ramstyle", "block_ram", "distributed_ram"),
        ("syn_romstyle", "block_rom", "distributed_rom"),
        ("syn_dspstyle", "dsp"),
    ),
}


def without_zeros(netlist: str) -> str:
    """A netlist in RTLIL without the initial zeros of memories that the netlist writes.

    A table, which nothing writes, keeps its words. So does a written memory with a word other than 0, and a
    memory with the attribute ``needs_zeros``, whose words are read before they are written.

    Parameters
    ----------
    netlist : str
        RTLIL as Amaranth writes it.
    """

    def strip(module: re.Match) -> str:
        text = module[0]
        written = {_MEMORY.search(cell[0])[1] for cell in _WRITE.finditer(text)}
        written -= {json.dumps(name) for name in _NEEDED.findall(text)}

        def kept(cell: re.Match) -> str:
            return "" if _MEMORY.search(cell[0])[1] in written and _ZEROS.search(cell[0]) else cell[0]

        return _INITIAL.sub(kept, text) if written else text

    return re.sub(r"^module .*?^end$", strip, netlist, flags=re.MULTILINE | re.DOTALL)


def with_attributes(text: str, tool: str | None) -> str:
    """Verilog whose memories and products have the attributes of a synthesis tool.

    Memories of more than `SMALL` words go into block RAMs, smaller memories into look-up tables. Products go
    into multipliers.

    Parameters
    ----------
    text : str
        Verilog as `emit` writes it, with a line for each declaration, product and write.
    tool : str or None
        One of `ATTRIBUTES` of `blysk.golden.build`. ``None``: the text stays as it is.
    """
    if tool is None:
        return text
    ram, rom, (name, value) = _TOOLS[tool]

    def mark(module: re.Match) -> str:
        body = module[0]
        written, products = set(_WRITTEN.findall(body)), set(_PRODUCT.findall(body))

        def memory(found: re.Match) -> str:
            style, large, small = ram if found[1] in written else rom
            of_size = large if int(found[2]) >= SMALL else small
            return f'  (* {style} = "{of_size}" *)\n{found[0]}' if of_size else found[0]

        def wire(found: re.Match) -> str:
            return f'  (* {name} = "{value}" *)\n{found[0]}' if found[1] in products else found[0]

        return _WIRE.sub(wire, _ARRAY.sub(memory, body))

    return re.sub(r"^module .*?^endmodule", mark, text, flags=re.MULTILINE | re.DOTALL)
