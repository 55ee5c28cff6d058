"""A component as a WebAssembly module, with the compiled engine's model and driver, for a browser.

The module imports nothing. Its exports are in `wasm_driver.cc`. Beats are words as `beats.pack` packs them;
`fields_of` gives the place of each field.
"""

import importlib.util
import sys
import tempfile
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from amaranth.hdl import Shape
from amaranth.lib.data import ArrayLayout, StructLayout
from amaranth.lib.wiring import Component

from blysk.golden.number.fixed import Format
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.emit.processes import run_program
from blysk.sim.engines.beats import word_count
from blysk.sim.engines.cxxrtl_source import runtime_folder, sources_of
from blysk.sim.engines.engine import CompilerMissing, Ports, SimulationError
from blysk.sim.installation import install_extra

__all__ = ["build", "fields_of", "format_of", "ports_of"]

_FLAGS = (
    *("-target", "wasm32-wasi", "-O3", "-std=c++17", "-fno-exceptions", "-fno-rtti", "-w"),
    *("-DCXXRTL_NDEBUG", "-D_LIBCPP_VERBOSE_ABORT(...)=__builtin_abort()"),
)


def build(component: Component) -> bytes:
    """Compile a component and the driver of its streams to a WebAssembly module.

    Parameters
    ----------
    component : Component
        As for `simulate`, with a stream ``write`` and a ``status``, and without ``constants``.

    Raises
    ------
    CompilerMissing
        If the package ziglang is not installed.
    SimulationError
        If Yosys cannot translate the component, or the compiler refuses the result.
    ValueError
        As `cxxrtl.Compiled` raises it. Also if the component has constants, or lacks the stream ``write`` or
        a status.
    """
    ports = Ports(component)
    if ports.constants is not None or ports.status is None or ports.write is None:
        raise ValueError("a module has the streams i, o and write, a status, and no constants")
    if importlib.util.find_spec("ziglang") is None:
        raise CompilerMissing(f"ziglang is not installed: {install_extra('web')}")
    model, driver = sources_of(component)
    tail = resources.files(__package__).joinpath("wasm_driver.cc").read_text(encoding="utf-8")
    zig = [sys.executable, "-m", "ziglang"]
    with tempfile.TemporaryDirectory(prefix="blysk-") as folder:
        (Path(folder) / "model.cc").write_text(model)
        names = '#define BLYSK_MODEL "model.cc"\n#define BLYSK_KEY ""\n'
        (Path(folder) / "driver.cc").write_text(names + driver + tail)
        for command in (
            [*zig, "c++", *_FLAGS, "-I", str(runtime_folder()), "-c", "driver.cc", "-o", "driver.o"],
            [*zig, "wasm-ld", "--no-entry", "--gc-sections", "-s", "driver.o", "-o", "model.wasm"],
        ):
            done = run_program(command, cwd=folder, capture_output=True, text=True, errors="replace")
            if done.returncode:
                lines = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
                line = next((line for line in lines if "error" in line), lines[0])
                raise SimulationError(f"ziglang ends with status {done.returncode}: {line}")
        return (Path(folder) / "model.wasm").read_bytes()


def format_of(format: Format) -> dict[str, Any]:
    """A fixed-point format as JSON: ``width``, ``signed``, and ``fraction``, the number of fraction bits."""
    return {"width": format.width, "signed": format.signed, "fraction": format.fraction_bits}


def fields_of(layout: Any) -> dict[str, dict[str, Any]]:
    """Place and format of each field of a beat, as JSON.

    Parameters
    ----------
    layout : shape
        Structures and arrays, nested as needed, of fixed-point and plain shapes.

    Returns
    -------
    dict
        For each field, by its path of names and indices with dots between them: ``offset``, its lowest bit in
        the beat, and the result of `format_of` for its format. A plain shape has 0 fraction bits.
    """
    return dict(_fields(layout, (), 0))


def _fields(shape: Any, path: tuple, offset: int) -> Iterator[tuple[str, dict[str, Any]]]:
    if isinstance(shape, StructLayout | ArrayLayout):
        for key, field in shape:
            yield from _fields(field.shape, (*path, str(key)), offset + field.offset)
    else:
        plain = Shape.cast(shape)
        format = Format(plain.signed, plain.width, 0)
        if isinstance(shape, FixedShape):
            format = shape.number_format
        yield ".".join(path), {"offset": offset, **format_of(format)}


def ports_of(component: Component) -> dict[str, dict[str, Any]]:
    """Sizes and fields of the beats of a module's ports, as JSON.

    Parameters
    ----------
    component : Component
        As for `build`.

    Returns
    -------
    dict
        By port (``i``, ``o``, ``write``, ``status``): ``words``, the number of 32-bit words of a beat, and
        ``fields``, as `fields_of` gives them.
    """
    ports = Ports(component)
    shapes = {name: getattr(ports, name) for name in ("i", "o", "write", "status")}
    return {name: {"words": word_count(shape), "fields": fields_of(shape)} for name, shape in shapes.items()}
