"""SystemRDL 2.0: the registers of a core on a bus, for PeakRDL and other generators."""

import json

from blysk.golden.bus.registers import IDENTITY, VERSION, WORD_BITS, Register
from blysk.sim.packages.package import Core
from blysk.sim.run_files import MARK

__all__ = ["files", "register_text"]

_ACCESS = {
    "read-only": "sw = r; hw = w;",
    "read-write": "sw = rw; hw = r; reset = 0;",
    "write-only": "sw = w; hw = r;",
    "clear": "sw = rw; hw = w; onwrite = woclr; reset = 0;",
}
_CONSTANTS = {"identity": IDENTITY, "version": VERSION}

_KEYWORDS = """\
    abstract accesstype addressingtype addrmap alias all bit boolean bothedge compact component
    componentwidth constraint default encode enum external false field fullalign hw inside internal level
    longint mem na negedge nonsticky number onreadtype onwritetype posedge property r rclr ref reg regalign
    regfile rset ruser rw rw1 signal string struct sw this true type unsigned w w1 wclr woclr woset wot wr
    wset wuser wzc wzs wzt
"""
"""Words that SystemRDL takes as a name only behind a backslash."""


def register_text(core: Core) -> str:
    """The registers in SystemRDL 2.0."""
    assert core.map is not None
    lines = [
        f"// {MARK}.",
        f"addrmap {_name(core.name)} {{",
        f"    name = {json.dumps(core.name)};",
        f"    desc = {json.dumps(core.map.core)};",
        f"    default regwidth = {WORD_BITS};",
        f"    default accesswidth = {WORD_BITS};",
        "    littleendian;",
    ]
    for register in core.map.registers:
        lines += ["", *_register(register)]
    return "\n".join([*lines, "};", ""])


def _name(name: str) -> str:
    return f"\\{name}" if name in _KEYWORDS.split() else name


def _register(register: Register) -> list[str]:
    text = register.text + (f"; {register.format}" if register.format else "")
    text += "; extended by its sign" if register.signed else ""
    access = _ACCESS[register.access]
    if register.name in _CONSTANTS:
        access = f"sw = r; hw = na; reset = {WORD_BITS}'h{_CONSTANTS[register.name]:X};"
    fields = register.bits or (("value", 0, register.width, ""),)
    lines = ["    reg {", f"        desc = {json.dumps(text)};"]
    for name, first, width, of_bits in fields:
        desc = f" desc = {json.dumps(of_bits)};" if of_bits else ""
        lines.append(f"        field {{ {access}{desc} }} {_name(name)}[{first + width - 1}:{first}];")
    return [*lines, f"    }} {_name(register.name)} @ 0x{register.address:03X};"]


def files(core: Core) -> dict[str, str]:
    """Texts of the package, by path."""
    return {f"{core.name}.rdl": register_text(core)}
