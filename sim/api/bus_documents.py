"""Documents of a core on a bus, written beside its Verilog: registers as Markdown, C header and SVD."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from blysk.golden.bus.byte_layout import ByteLayout, Field
from blysk.golden.bus.registers import ADDRESS_BITS, ERRORS, WORD_BITS, Register
from blysk.hdl.bus.bus import BusUnit
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.render import RendererUnit
from blysk.sim.api.options import DOCUMENTS
from blysk.sim.run_files import MARK

__all__ = ["FRAME", "beats_text", "documents_of", "frame_text", "layout_lines"]

FRAME = "in the light's frame: H along z, L and V in the xz plane"
"""Frame of the vectors N/W of spans or corners, for a method that takes vectors."""

_IN_FRAME = ("normal", "start")
"""Fields of a beat that hold vectors N/W."""

_SPACE = 1 << ADDRESS_BITS
_IN_SVD = {
    "read-only": {"access": "read-only"},
    "read-write": {"access": "read-write"},
    "write-only": {"access": "write-only"},
    "clear": {"access": "read-write", "modifiedWriteValues": "oneToClear"},
}
_ACCESS = {"clear": "a 1 clears its bit"}


def documents_of(unit: BusUnit, name: str) -> dict[str, str]:
    """Texts of the documents by suffix: ``.md``, ``.h`` and ``.svd``. All list the same registers.

    Parameters
    ----------
    unit : BusUnit
        The core.
    name : str
        Name of its Verilog module.
    """
    texts = _markdown(unit, name), _header(unit, name), _svd(unit, name)
    return dict(zip(DOCUMENTS, texts, strict=True))


def frame_text(core: ShadingPipelineUnit | RendererUnit | GeometryUnit) -> str:
    """Frame of the vectors of a core's spans or corners. Empty if the frame does not belong to a light."""
    unit = core.geometry if isinstance(core, RendererUnit) else core
    if isinstance(unit, GeometryUnit) and unit.rotates:
        return FRAME.replace("the light's", "light 0's")
    return FRAME if unit.vectors else ""


def _values(unit: BusUnit, field: Field) -> str:
    """Number format of a field. If the field holds a vector N/W, also the frame of the vector's axes."""
    frame = frame_text(unit.framing.core)
    return f"{field.values}; N/W {frame}" if field.name in _IN_FRAME and frame else field.values


def layout_lines(layout: ByteLayout) -> list[str]:
    """A line for each field of TDATA: first byte, C type, name, number format."""
    rows = [(offset, _declared(field), field.values) for field, offset in _placed(layout)]
    if layout.padding:
        rows.append((layout.size - layout.padding, _padding(layout), _PADDED))
    return [f"{offset:>4}  {declared:<28} {text}" for offset, declared, text in rows]


def beats_text(unit: BusUnit, layout: ByteLayout) -> str:
    """Bytes of a triangle, span or pixel, and if they take several beats, the number of beats."""
    bits = unit.stream
    if not bits:
        return f"{layout.size} bytes"
    return f"{layout.size} bytes in {8 * layout.size // bits} beats of {bits} bits, the lowest bytes first"


_PADDED = "ignored on the input, 0 on the output"


def _padding(layout: ByteLayout) -> str:
    return f"uint8_t padding[{layout.padding}]"


def _placed(layout: ByteLayout) -> Iterator[tuple[Field, int]]:
    """Fields and their first bytes."""
    return zip(layout.fields, layout.offsets, strict=True)


def _declared(field: Field) -> str:
    return f"{field.c_type} {field.name}" + "".join(f"[{size}]" for size in field.shape)


def _what(register: Register) -> str:
    return register.text + (f"; {register.format}" if register.format else "")


def _markdown(unit: BusUnit, name: str) -> str:
    lines = [
        f"# Registers of {name}",
        "",
        f"<!-- {MARK} -->",
        "",
        f"{unit.map.core.capitalize()}. Words of {WORD_BITS} bits, little endian, in {_SPACE} bytes. Signed "
        "values are extended by their sign. An access that is refused (SLVERR, ERR) changes nothing but "
        "`errors` and `refused`. `errors` takes any word or byte at any time: all ones clear it.",
        "",
        "| address | register | access | bits | what it is |",
        "| --- | --- | --- | ---: | --- |",
    ]
    for register in unit.map.registers:
        width = f"{register.width}{' signed' if register.signed else ''}"
        access = _ACCESS.get(register.access, register.access)
        lines.append(
            f"| 0x{register.address:03X} | `{register.name}` | {access} | {width} | {_what(register)} |"
        )
    lines += ["", "Bits of `errors`:", ""]
    lines += [f"- {k} `{cause}`: {text}" for k, (cause, text) in enumerate(ERRORS.items())]
    for title, layout in _layouts(unit):
        lines += [
            "",
            f"## {title}, {beats_text(unit, layout)}",
            "",
            "| byte | field | format |",
            "| ---: | --- | --- |",
        ]
        for field, offset in _placed(layout):
            lines.append(f"| {offset} | `{_declared(field)}` | {_values(unit, field)} |")
        if layout.padding:
            lines.append(f"| {layout.size - layout.padding} | `{_padding(layout)}` | {_PADDED} |")
    return "\n".join(lines) + "\n"


def _layouts(unit: BusUnit) -> Iterator[tuple[str, ByteLayout]]:
    layouts = unit.framing.model
    yield "s_axis_tdata", layouts.given
    yield "m_axis_tdata", layouts.made


def _header(unit: BusUnit, name: str) -> str:
    upper = name.upper()
    lines = [
        f"/* {name}: registers and the layouts of its streams, {MARK}. */",
        f"#ifndef {upper}_REGISTERS_H",
        f"#define {upper}_REGISTERS_H",
        "",
        "#include <stdint.h>",
        "",
        "/* Addresses of registers, in bytes. */",
    ]
    for register in unit.map.registers:
        lines.append(
            f"#define {upper}_{register.name.upper()} 0x{register.address:03X}u /* {_what(register)} */"
        )
    lines += ["", "/* Bits of registers. */"]
    for register in unit.map.registers:
        for bit, first, width, text in register.bits:
            mask = ((1 << width) - 1) << first
            lines.append(f"#define {upper}_{register.name.upper()}_{bit.upper()} 0x{mask:X}u /* {text} */")
    for kind, (title, layout) in zip(("input", "output"), _layouts(unit), strict=True):
        lines += ["", f"/* {title}, {beats_text(unit, layout)}. */", f"struct {name}_{kind} {{"]
        for field in layout.fields:
            lines.append(f"    {_declared(field)}; /* {_values(unit, field)} */")
        if layout.padding:
            lines.append(f"    {_padding(layout)}; /* {_PADDED} */")
        lines.append("};")
    return "\n".join([*lines, "", "#endif", ""])


def _svd(unit: BusUnit, name: str) -> str:
    device = ET.Element(
        "device",
        {
            "schemaVersion": "1.3",
            "xmlns:xs": "http://www.w3.org/2001/XMLSchema-instance",
            "xs:noNamespaceSchemaLocation": "CMSIS-SVD.xsd",
        },
    )
    _texts(
        device,
        name=name,
        version="1",
        description=f"{name}, {unit.map.core}",
        addressUnitBits=8,
        width=WORD_BITS,
        size=WORD_BITS,
        resetValue="0x0",
        resetMask="0x0",
    )
    peripheral = ET.SubElement(ET.SubElement(device, "peripherals"), "peripheral")
    _texts(peripheral, name=name.upper(), description=unit.map.core, baseAddress="0x0")
    _texts(ET.SubElement(peripheral, "addressBlock"), offset="0x0", size=f"0x{_SPACE:X}", usage="registers")
    registers = ET.SubElement(peripheral, "registers")
    for register in unit.map.registers:
        one = ET.SubElement(registers, "register")
        _texts(one, name=register.name.upper(), description=_what(register))
        _texts(one, addressOffset=f"0x{register.address:03X}", size=WORD_BITS, **_IN_SVD[register.access])
        fields = ET.SubElement(one, "fields")
        for bit, first, width, text in register.bits or (("value", 0, register.width, register.text),):
            _texts(
                ET.SubElement(fields, "field"),
                name=bit.upper(),
                description=text,
                bitOffset=first,
                bitWidth=width,
            )
    ET.indent(device)
    head = f'<?xml version="1.0" encoding="utf-8"?>\n<!-- {MARK} -->\n'
    return f"{head}{ET.tostring(device, encoding='unicode')}\n"


def _texts(parent: ET.Element, **texts: object) -> None:
    for tag, text in texts.items():
        ET.SubElement(parent, tag).text = str(text)
