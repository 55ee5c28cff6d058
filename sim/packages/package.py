"""The record of a kind of package, and the core that a package holds."""

import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

from blysk.golden.build import PORTS, TOPS
from blysk.golden.pipeline import ShadingPipeline
from blysk.sim.errors import InputError
from blysk.sim.installation import install_extra

if TYPE_CHECKING:
    from blysk.golden.bus.byte_layout import ByteLayout
    from blysk.golden.bus.registers import RegisterMap

__all__ = ["Core", "Package"]

_TITLES = {
    "shader": "spans to pixels",
    "geometry": "triangles to spans",
    "render": "triangles to pixels",
}


@dataclass(frozen=True)
class Core:
    """A core, and the texts that belong to it.

    Parameters
    ----------
    design : ShadingPipeline
        The design, with its `Build`.
    name, verilog : str
        Name of the top module, and its Verilog.
    ports : mapping of str to int
        Ports of the top module in their order: bits of an input, or minus the bits of an output.
    documents : mapping of str to str
        Documents of a core on a bus, by suffix.
    map : RegisterMap or None
        Registers of a core on a bus.
    layouts : tuple of ByteLayout
        Layouts of the input and the output of a core on a bus.
    make_bench : callable
        Function that makes the files of the test bench, by path.
    """

    design: ShadingPipeline
    name: str
    verilog: str
    ports: Mapping[str, int]
    documents: Mapping[str, str] = field(default_factory=dict)
    map: "RegisterMap | None" = None
    layouts: "tuple[ByteLayout, ...]" = ()
    make_bench: Callable[[], Mapping[str, str]] = dict

    @property
    def version(self) -> str:
        """Version of this program, which is the version of the package."""
        return version("blysk")

    @property
    def title(self) -> str:
        """What the core does, in a line."""
        design = self.design
        return f"{_TITLES[design.build.top]}, method {design.method}, model {design.model}"

    @cached_property
    def bench(self) -> Mapping[str, str]:
        """Files of the test bench without the Verilog, by path."""
        return {path: text for path, text in self.make_bench().items() if path != f"{self.name}.v"}


@dataclass(frozen=True)
class Package:
    """A kind of package. The file of this room with its name makes it.

    Parameters
    ----------
    name : str
        Name on the command line.
    text : str
        The package and its use, for the help.
    buses : tuple of str
        Buses of the cores that can be packaged.
    tops : tuple of str
        Cores that can be packaged.
    benched : bool
        Whether the package holds the test bench.
    whole_beats : bool
        Whether a beat of a stream must be a whole triangle, span or pixel.
    modules : tuple of str
        Modules of the extra ``packages`` that make the package.
    """

    name: str
    text: str
    buses: tuple[str, ...] = PORTS
    tops: tuple[str, ...] = TOPS
    benched: bool = False
    whole_beats: bool = False
    modules: tuple[str, ...] = ()

    def files(self, core: Core) -> dict[str, str]:
        """Texts of the package, by path."""
        made: dict[str, str] = import_module(f"blysk.sim.packages.{self.name}").files(core)
        return made

    def check(self, design: ShadingPipeline) -> None:
        """Refuse a core that has no such package, and a missing module. Nothing is made.

        Raises
        ------
        InputError
            If the package cannot be made.
        """
        thing, build = f"--package {self.name}", design.build
        if build.bus not in self.buses:
            buses = [f"--bus {bus}" for bus in self.buses]
            raise InputError(thing, f"it has no form for --bus {build.bus}", f"give {' or '.join(buses)}")
        if build.top not in self.tops:
            tops = [f"--top {top}" for top in self.tops]
            raise InputError(thing, f"it has no form for --top {build.top}", f"give {' or '.join(tops)}")
        if self.whole_beats and build.stream is not None:
            raise InputError(thing, "it changes the widths of streams itself", "leave out --stream")
        for module in self.modules:
            if importlib.util.find_spec(module) is None:
                raise InputError(thing, f"{module} is not installed", install_extra("packages"))
