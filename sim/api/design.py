"""Designs by the words of the command line, and their Verilog."""

import re
from dataclasses import replace
from importlib.metadata import version
from typing import Any, Unpack

from blysk.golden.frame_constants import address_table
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.pipeline import Design
from blysk.golden.presets import LOBES, METHODS, MODELS, PUBLISHED, preset
from blysk.hdl.emit.verilog import emit
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pipeline import PORT_DESCRIPTIONS, ShadingPipelineUnit
from blysk.sim.api.options import COUNTS, DESIGN, DesignOptions
from blysk.sim.api.settings import Settings, read_settings
from blysk.sim.errors import OptionError

__all__ = ["design", "design_of", "header_of", "verilog", "verilog_and_unit"]


def design(*, lights: int = 1, materials: int = 1, **options: Unpack[DesignOptions]) -> Design:
    """A pipeline with the defaults of the command line.

    Parameters
    ----------
    lights, materials : int
        How many it serves: 1 to 16, and 1 to 1024.
    method : str
        Interpolation along a span: one of `METHODS`, by default ``"quadratic"``.
    model : str
        Reflection model: one of `MODELS` or `LOBES`, by default ``"cosquad"``; or the curve of a file.
    operand : {"cosine", "one_minus_cosine"}
        Operand of the specular unit, of methods that find normals.
    gate : bool
        Whether there is a highlight gate.
    setup_interval : int
        Least cycles from a span to the next, where the method has that choice.
    style : {"throughput", "compact"}
        One pixel a cycle, or few multipliers.

    Raises
    ------
    InputError
        If there is no such pipeline.
    """
    counts = {"lights": lights, "materials": materials}
    settings = read_settings("", {**options, **counts}, {**DESIGN, **COUNTS})
    return design_of(settings, settings["lights"], settings["materials"])


def design_of(settings: Settings, lights: int, materials: int = 1) -> Design:
    """The pipeline that the design options describe.

    Parameters
    ----------
    settings : Settings
        With values of `DESIGN`.
    lights, materials : int
        Its counts.

    Raises
    ------
    OptionError
        If there is no such pipeline.
    """
    method = settings["method"]
    served = MODELS | LOBES
    if isinstance(settings["model"], str) and settings["model"] not in served:
        remedy = f"use one of {', '.join(served)}"
        raise settings.refuse("model", "the pipeline finds N.H, not R.V", remedy)
    if settings["gate"] and not (METHODS | PUBLISHED)[method].serves_gate:
        lacks = "error bound" if method in PUBLISHED else "normals"
        raise settings.refuse("gate", f"{method} has no {lacks} for one", "leave it out", "")
    options: dict[str, Any] = {name: settings[name] for name in DESIGN if name not in ("method", "model")}
    try:
        made = preset(method, settings["model"], lights, **options)
    except ValueError as error:
        raise settings.refuse("operand", str(error), "leave it out") from None
    intervals = unit_of(made.interpolator).setup_intervals(made.interpolator)
    if settings["setup_interval"] not in (None, *intervals):
        remedy = f"give 1 to {max(intervals)}" if intervals else "leave it out"
        raise settings.refuse("setup_interval", f"method {method} is not built for it", remedy)
    if isinstance(made.specular, Lobe):
        made = replace(made, specular=replace(made.specular, banks=min(materials, Lobe.MAX_BANKS)))
    return replace(made, materials=materials)


def header_of(unit: ShadingPipelineUnit) -> list[str]:
    """What a pipeline is, in lines: version, design and cycles."""
    made = unit.parameters
    gate = ", highlight gate" if made.gate else ""
    return [
        f"blysk {version('blysk')} shading pipeline",
        f"method {made.method}, model {made.model}, lights {made.lights}, materials {made.materials}, "
        f"{made.build.style} style{gate}",
        f"latency {unit.latency} cycles, {unit.cycles_per_pixel} a pixel",
        f"a span takes at most max({unit.cycles_per_pixel} length, {unit.setup_interval}) cycles",
    ]


def verilog(design: Design | None = None, name: str = "blysk") -> str:
    """Verilog-2001 of a pipeline for synthesis, with a table of its ports and frame constants.

    Parameters
    ----------
    design : Design, optional
        The pipeline, as `design` makes it; by default that of the defaults.
    name : str
        Name of the top module.

    Raises
    ------
    InputError
        If the name is none in Verilog.
    """
    return verilog_and_unit(Design() if design is None else design, name)[0]


def verilog_and_unit(design: Design, name: str) -> tuple[str, ShadingPipelineUnit]:
    """The same, and the pipeline that it is of."""
    if not re.fullmatch("[a-zA-Z][a-zA-Z0-9_]*", name):
        raise OptionError("name", name, "no Verilog name", "use letters, digits and underscores")
    unit = ShadingPipelineUnit(design)
    p = unit.parameters
    lobe = p.specular if isinstance(p.specular, Lobe) else None
    loads = lobe is not None and lobe.fixed is None
    constants = address_table(p.lights, p.materials, loads, has_threshold=lobe is not None and p.gate)
    header = [*header_of(unit), "", "Frame constants, through the write port:", *constants]
    fields = {f"i_{field}" for field in unit.i.payload.shape().members}
    descriptions = {
        port: text for port, text in PORT_DESCRIPTIONS.items() if not port.startswith("i_") or port in fields
    }
    try:
        return emit(unit, name, header=header, descriptions=descriptions), unit
    except ValueError as error:
        raise OptionError("name", name, str(error), "choose another name") from None
