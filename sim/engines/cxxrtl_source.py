"""The C++ of a component, and the macros of the driver.

Amaranth writes the netlist. Yosys' CXXRTL makes a C++ class of it. Modules of this folder rewrite the class.
"""

import contextlib
import gc
import re
import warnings
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

from amaranth._toolchain.yosys import YosysError, YosysWarning
from amaranth.back import rtlil
from amaranth.lib.wiring import Component

from blysk.hdl.emit.yosys import AmaranthYosys
from blysk.sim.engines.beats import word_count
from blysk.sim.engines.engine import Ports, SimulationError
from blysk.sim.engines.guards import group_registers
from blysk.sim.engines.parts import read_parts
from blysk.sim.engines.words import plain_words

__all__ = [
    "SCRIPT",
    "generated",
    "header_of",
    "members_of",
    "netlist_of",
    "runtime_folder",
    "sources_of",
    "text_of",
]

# The script has no `opt` and no `opt_clean`. Both join registers and combinational fields to wires, which
# CXXRTL would buffer.
SCRIPT = "hierarchy -auto-top; proc; flatten; write_cxxrtl -O6 -g0"


def text_of(name: str) -> str:
    """Text of a file of this folder."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Turn garbage collection off.

    A netlist has many small objects, which all stay in use. Garbage collection would take a third of the
    time.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _check_netlist(component: Component, netlist: str) -> None:
    name = type(component).__name__
    top = re.search(r"^attribute \\top 1$.*?^end$", netlist, re.DOTALL | re.MULTILINE)
    inputs = (
        set(re.findall(r"^  wire .* input \d+ +(?:signed )? *\\(\S+)$", top[0], re.MULTILINE))
        if top
        else set()
    )
    if "clk" not in inputs:
        raise ValueError(f"{name} has nothing in the clock domain sync")
    driven = {
        "i__payload",
        "i__valid",
        "o__ready",
        "constants",
        "write__payload",
        "write__valid",
        "clk",
        "rst",
    }
    if inputs - driven:
        raise ValueError(f"{name} has inputs that nothing drives: {', '.join(sorted(inputs - driven))}")
    if re.search(r"^  cell \$(check|print) ", netlist, re.MULTILINE):
        raise ValueError(f"{name} has an assertion or a print statement, which only the engine pysim runs")


def generated(netlist: str) -> str:
    """C++ of a netlist."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            text = AmaranthYosys.run(["-q", "-"], f"read_rtlil <<rtlil\n{netlist}\nrtlil\n{SCRIPT}\n")
    except YosysError as error:
        # If the WebAssembly runtime of Yosys fails, the text is a traceback, whose last line has the reason.
        raise SimulationError(f"Yosys: {str(error).strip().splitlines()[-1]}") from error
    except PermissionError as error:
        raise SimulationError(f"Yosys: {error.filename} cannot be started ({error.strerror})") from error
    for warning in caught:
        # With feedback or buffered wires, one evaluation a cycle gives wrong values. Several evaluations are
        # slow.
        if issubclass(warning.category, YosysWarning) and re.search(
            "feedback|buffered", str(warning.message)
        ):
            raise SimulationError(
                f"Yosys: {str(warning.message).strip()} A combinational signal depends on itself, "
                "or a field of a structure depends on another field: give each field its own signal, or use "
                "the engine pysim"
            )
    return plain_words(group_registers(read_parts(text)))


def netlist_of(component: Component) -> str:
    """Netlist of a component, as RTLIL. `ValueError` if an engine cannot run the component."""
    with _without_collection():
        netlist = rtlil.convert(component, name="top", emit_src=False)
    _check_netlist(component, netlist)
    return netlist


def sources_of(component: Component) -> tuple[str, str]:
    """C++ of a component, and of the driver. The driver includes the file that the macro ``BLYSK_MODEL``
    names.

    Parameters
    ----------
    component : Component
        As for `Compiled`.

    Raises
    ------
    SimulationError, ValueError
        As `Compiled` raises them for the component.
    """
    text = generated(netlist_of(component))
    return text, header_of(text) + members_of(Ports(component)) + text_of("cxxrtl_driver.cc")


def runtime_folder() -> Path:
    """Folder of CXXRTL's headers, which the C++ of `sources_of` may include."""
    return Path(AmaranthYosys.data_dir()) / "include" / "backends" / "cxxrtl" / "runtime"


def header_of(text: str) -> str:
    """The driver's macro ``BLYSK_WORDS`` for a model that does not include CXXRTL's header; else nothing."""
    return "" if "#include <cxxrtl/cxxrtl.h>" in text else "#define BLYSK_WORDS\n"


def members_of(ports: Ports) -> str:
    """The driver's macros ``BLYSK_HAS_...``, one for each optional member that exists and has bits."""
    shapes = {"CONSTANTS": ports.constants, "WRITE": ports.write, "STATUS": ports.status}
    return "".join(
        f"#define BLYSK_HAS_{name}\n"
        for name, shape in shapes.items()
        if shape is not None and word_count(shape)
    )
