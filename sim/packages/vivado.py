"""Vivado: a Tcl script that packages a core on AXI, and a wrapper with the attributes of its interfaces."""

from blysk.sim.packages.package import Core
from blysk.sim.packages.wrapper import DEPTH_PORTS, declared, depth_memory, has_depths
from blysk.sim.run_files import MARK

__all__ = ["files"]

_INTERFACES = {
    "s_axis": "xilinx.com:interface:axis:1.0",
    "m_axis": "xilinx.com:interface:axis:1.0",
    "s_axil": "xilinx.com:interface:aximm:1.0",
}
"""Interfaces of a core on AXI, and their kinds in Vivado."""

_SCRIPT = """\
# {mark}, untried in Vivado.
# Makes an IP from the Verilog beside this file: vivado -mode batch -source package.tcl
# The IP is then in the folder ip. Add this folder to the IP repositories of a project.
set folder [file dirname [file normalize [info script]]]
create_project -in_memory {name}_package
add_files -norecurse [list {files}]
set_property top {top} [current_fileset]
update_compile_order -fileset sources_1
ipx::package_project -root_dir [file join $folder ip] -vendor blysk -library shading \\
  -taxonomy /UserIP -import_files -force
set core [ipx::current_core]
set_property name {name} $core
set_property version {version} $core
set_property display_name {{{name}}} $core
set_property description {{{title}}} $core
foreach interface {{s_axis m_axis s_axil}} {{
  ipx::associate_bus_interfaces -busif $interface -clock aclk $core
}}
ipx::create_xgui_files $core
ipx::update_checksums $core
ipx::check_integrity $core
ipx::save_core $core
close_project
"""


def files(core: Core) -> dict[str, str]:
    """Texts of the package, by path."""
    sources = {f"rtl/{core.name}.v": core.verilog, f"rtl/{core.name}_vivado.v": _wrapper(core)}
    if has_depths(core):
        sources[f"rtl/{core.name}_depths.v"] = depth_memory(core, MARK)
    # IP-XACT takes versions of two numbers.
    short = ".".join(core.version.split(".")[:2])
    script = _SCRIPT.format(
        mark=MARK,
        name=core.name,
        top=f"{core.name}_vivado",
        version=short,
        title=core.title,
        files=" ".join(f"[file join $folder {path}]" for path in sources),
    )
    documents = {f"doc/{core.name}{suffix}": text for suffix, text in core.documents.items()}
    return {"package.tcl": script} | sources | documents


def _wrapper(core: Core) -> str:
    """The core with ``aclk``, ``aresetn``, attributes of its interfaces, and its memory of depths inside."""
    name = core.name
    ports = {
        port: bits
        for port, bits in core.ports.items()
        if port not in ("clk", "rst") and not port.startswith(DEPTH_PORTS)
    }
    belongs = f"ASSOCIATED_BUSIF {':'.join(_INTERFACES)}, ASSOCIATED_RESET aresetn"
    listed = [
        '(* X_INTERFACE_INFO = "xilinx.com:signal:clock:1.0 aclk CLK" *)\n'
        f'  (* X_INTERFACE_PARAMETER = "{belongs}" *)\n'
        "  input aclk",
        '(* X_INTERFACE_INFO = "xilinx.com:signal:reset:1.0 aresetn RST" *)\n'
        '  (* X_INTERFACE_PARAMETER = "POLARITY ACTIVE_LOW" *)\n'
        "  input aresetn",
    ]
    for port, text in declared(ports).items():
        interface = next(member for member in _INTERFACES if port.startswith(f"{member}_"))
        signal = port.removeprefix(f"{interface}_").upper()
        listed.append(f'(* X_INTERFACE_INFO = "{_INTERFACES[interface]} {interface} {signal}" *)\n  {text}')
    joined = [".clk(aclk)", ".rst(!aresetn)", *(f".{port}({port})" for port in ports)]
    sizes, depths = "", []
    if has_depths(core):
        memory = {port: bits for port, bits in core.ports.items() if port.startswith(DEPTH_PORTS)}
        sizes = " #(\n  parameter WIDTH = 640,\n  parameter HEIGHT = 480\n)"
        depths = [f"  wire [{abs(bits) - 1}:0] {port};" for port, bits in memory.items()]
        joined += [f".{port}({port})" for port in memory]
        connections = ", ".join(f".{port.removeprefix(DEPTH_PORTS)}({port})" for port in memory)
        depths.append(
            f"  {name}_depths #(.WIDTH(WIDTH), .HEIGHT(HEIGHT)) depths (.clk(aclk), {connections});"
        )
    lines = [
        f"// {MARK}. The core {name} with the ports that Vivado expects.",
        *(["// WIDTH x HEIGHT: the largest picture."] if depths else []),
        f"module {name}_vivado{sizes} (",
        ",\n".join(f"  {port}" for port in listed),
        ");",
        *depths,
        f"  {name} core ({', '.join(joined)});",
        "endmodule",
    ]
    return "\n".join(lines) + "\n"
