"""Files of a core for other tools: its test bench, and its packages."""

from typing import Any

from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.bus.bus import BusUnit
from blysk.hdl.emit.verilog import port_widths
from blysk.sim.api.bus_documents import documents_of
from blysk.sim.api.verilog import lines_of
from blysk.sim.frames.testbench import bench_files
from blysk.sim.packages.package import Core, Package

__all__ = ["bench_of", "package_files"]


def bench_of(design: ShadingPipeline, unit: Any, name: str, text: str) -> dict[str, str]:
    """Files of the test bench of a core, by path; see `bench_files`."""
    return bench_files(design, unit, name, text, lines_of(unit))


def package_files(
    package: Package, design: ShadingPipeline, unit: Any, name: str, text: str
) -> dict[str, str]:
    """Files of a package, by path.

    Parameters
    ----------
    package : Package
        The kind of package.
    design : ShadingPipeline
        The design, with its `Build`.
    unit : Component
        The core, as `core_of` makes it.
    name, text : str
        Name of the top module, and Verilog of the core.
    """
    on_bus = isinstance(unit, BusUnit)
    return package.files(
        Core(
            design,
            name,
            text,
            port_widths(unit),
            documents_of(unit, name) if on_bus else {},
            unit.map if on_bus else None,
            (unit.framing.model.given, unit.framing.model.made) if on_bus else (),
            lambda: bench_of(design, unit, name, text),
        )
    )
