"""Verilog of designs, with a header that describes core, ports and constants."""

import re
from collections.abc import Mapping
from importlib.metadata import version
from typing import Unpack

from blysk.golden.frame_constants import address_table
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.reference.scene import BACK_FACES
from blysk.golden.reference.transfer import SPACES
from blysk.golden.render import Renderer
from blysk.hdl.bus.bus import BusUnit, core_of
from blysk.hdl.emit.verilog import check_name, emit
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit, PixelPipelinesUnit, port_descriptions
from blysk.hdl.port_descriptions import LANE_DESCRIPTIONS, PORT_DESCRIPTIONS
from blysk.hdl.render import RendererUnit
from blysk.sim.api.bus_verilog import bus_descriptions, bus_header, triangle_descriptions
from blysk.sim.api.design import built
from blysk.sim.api.design import design as default_design
from blysk.sim.api.options import BUILD, BuildOptions
from blysk.sim.api.signature import with_options
from blysk.sim.api.verilog_example import example_of
from blysk.sim.errors import OptionError

__all__ = ["ShadingUnit", "header_of", "lines_of", "verilog", "verilog_and_unit"]

_LIMIT = "2048 sin(a / 2), rounded down; spans with an angle over a are cut"
_FORMATS = "SQ(i, f): two's complement, i + f bits, value = code / 2^f; UQ(i, f): the same without a sign"

ShadingUnit = ShadingPipelineUnit | PixelPipelinesUnit | MergedPipelinesUnit
"""A unit from spans to pixels: one pipeline or several."""


def header_of(unit: ShadingUnit, by_triangles: bool = False) -> list[str]:
    """Description of one or several pipelines, in lines: version, design, cycles, streams.

    Parameters
    ----------
    unit : ShadingUnit
        The pipelines.
    by_triangles : bool
        Whether hardware geometry makes the spans. The attributes of spans are then not described.
    """
    model = unit.model
    several = model if isinstance(model, PixelPipelines) else None
    made = model.design if isinstance(model, PixelPipelines) else model
    gate = ", highlight gate" if made.gate else ""
    beat, count = ("pixel", "length") if made.build.lanes == 1 else ("beat", "beats")
    lines = [
        f"blysk {version('blysk')} shading pipeline, MIT licence",
        f"method {made.method}, model {made.model}, lights {made.lights}, materials {made.materials}, "
        f"{made.build.style} style{gate}",
        f"transfer {made.transfer}: pixels are codes of {SPACES[made.transfer]}",
        f"latency {unit.latency} cycles, {unit.cycles_per_pixel} a {beat}",
        f"a span takes at most max({unit.cycles_per_pixel} {count}, {unit.setup_interval}) cycles",
        *_several_lines(several, unit),
        *_lane_lines(made),
        _FORMATS,
    ]
    if made.lights:
        lines += made.interpolator.input_lines(made.lights, made.specular is not None, made.factors)
    lines += [] if by_triangles else _albedo_lines(made)
    lines += [
        f"colour constants: {Intensity.COLOR_FORMAT}, 255 times coefficient times light",
        "before the first span: hold rst high for a cycle, then write every frame constant in any order",
    ]
    return lines


def _albedo_lines(design: ShadingPipeline) -> list[str]:
    """Description of the attributes of a span, in lines."""
    albedo = design.albedo
    if albedo is None:
        return []
    names = ["vertex colour, 0 to 1"] * albedo.colors
    names += ["u and v, (texels of the level - base) / 2^range"] * (albedo.texture is not None)
    over = " over W, times a scale of the span; weight: 1/W times the same scale, at most 1 - 4 2^-23"
    return [
        "The albedo of a pixel multiplies its ambient and diffuse light; emission is added.",
        f"i_attributes_start, SQ(1, 23): {'; '.join(names)}" + (";" if albedo.perspective else ""),
        *([f"each{over}"] if albedo.perspective else []),
    ]


def _surface_lines(geometry: GeometryUnit) -> list[str]:
    """Description of the attributes of a triangle's surface, in lines."""
    surface = geometry.model.surface
    if surface is None:
        return []
    names = ["vertex colour r, g, b, 0 to 1"] * surface.colors
    names += ["u, v, each (texels of the level - base) / 2^range, -1 to 1"] * surface.coordinates
    return [
        "The albedo of a pixel multiplies its ambient and diffuse light; emission is added.",
        f"i_surface_*, {ATTRIBUTE}: of each corner {'; '.join(names)};",
        "each of these numbers times s, and after them s; s is 1/W over the largest 1/W of the triangle,",
        "times 1 - 2^-10; without perspective s is 1 - 2^-10",
    ]


def _several_lines(several: PixelPipelines | None, unit: ShadingUnit) -> list[str]:
    """Description of several pipelines, in lines."""
    if several is None:
        return []
    streams = (
        "o_k_*: pixels of pipeline k"
        if isinstance(unit, PixelPipelinesUnit)
        else "o_*: pixels in the spans' order"
    )
    return [
        f"{several.pipes} pipelines; pipeline k shades scanlines with y mod {several.pipes} = k; {streams}"
    ]


def _lane_lines(design: ShadingPipeline) -> list[str]:
    """Description of several lanes, in lines."""
    lanes = design.build.lanes
    if lanes == 1:
        return []
    return [
        f"{lanes} lanes: a beat of o has the next {lanes} pixels of a span, from its first pixel on; "
        "the last beat has the rest"
        + ("; a beat without a drawn pixel is left out" if design.build.takes_triangles else "")
    ]


def _render_header(unit: RendererUnit) -> list[str]:
    """Description of a core from triangles to pixels: its pipeline without its input, and its geometry."""
    first, *lines = (
        line.replace("latency", "shading: latency") if line.startswith("latency") else line
        for line in header_of(unit.pipeline, by_triangles=True)
        if not line.startswith("i_")
    )
    return [
        first.replace("shading pipeline", "triangles to pixels"),
        *lines,
        *_geometry_lines(unit.geometry),
        *_axes_lines(unit.model),
        *_coarse_lines(unit),
        *_memory_lines(unit.model.design.build.lanes),
        "constants_picture: change it for each picture, to clear the depths as after rst; without a change "
        "triangles add to the picture",
    ]


def _memory_lines(lanes: int) -> list[str]:
    """Lines about the memory of depths, or about the banks of several lanes."""
    port, kind, clears = "memory_*", "a depth for each pixel", "a pixel"
    if lanes > 1:
        port, kind = "memory_k_*", f"bank k of the depths, for columns with x mod {lanes} = k"
        clears = "a pixel in each bank"
    return [
        f"{port}: {kind}; read data comes a clock after its place; before a picture's first "
        f"pixel the core writes all ones to every pixel of the picture, {clears} a clock",
    ]


def _axes_lines(renderer: Renderer) -> list[str]:
    """Lines about the axes of further lights, and about the length of a normal."""
    if not renderer.axes:
        return []
    return [
        "With several lights no vertex normal may be longer than 1, before it is multiplied by 1/W.",
        f"axes of light k, from 1 on: {', '.join(renderer.axes)} of its frame, each as its dot products with",
        "x, y and z of light 0's frame; a dot product times 2^17, rounded, at most 2^17 - 1; write the axes "
        "before the first triangle of a frame",
    ]


def _coarse_lines(unit: RendererUnit) -> list[str]:
    if unit.coarse is None:
        return []
    given = unit.coarse.model
    return [
        f"coarse depth test: pictures of at most {given.width}x{given.height}, {given.blocks:,} words of "
        f"{given.word_bits} bits; the first span of a picture waits for {given.swept:,} cycles"
    ]


def _geometry_lines(geometry: GeometryUnit) -> list[str]:
    """Description of the input of a core from triangles to spans."""
    grid = geometry.grid
    spans = "their true lines, uncut" if geometry.lines else "two unit normals, spans of a wide angle cut"
    normal, limit = "vertex normal", "is not read" if geometry.lines else _LIMIT
    if geometry.vectors:
        spans, limit = "N/W and its step, cut where N/W grows short", "is not read"
        which = "light 0" if geometry.rotates else "the light"
        normal = f"vertex normal in the frame of {which} (H along z, L and V in the xz plane)"
    return [
        f"geometry: at most a triangle in {geometry.interval} cycles; spans with {spans}; {grid.coordinate} "
        "coordinates",
        f"i_normal_*: {normal} times 1/W over the largest 1/W of the triangle, "
        f"{ATTRIBUTE}; i_depth: linear on the screen",
        *_surface_lines(geometry),
        f"constants_*: the picture's borders in pixels; back faces {', '.join(map(_numbered, BACK_FACES))}",
        f"constants_limit: {limit}",
        "constants_* change only while no triangle, span or pixel is inside; status_*: counters since reset",
    ]


def _numbered(name: str) -> str:
    return f"{BACK_FACES.index(name)}: {name}"


def _geometry_header(unit: GeometryUnit) -> list[str]:
    """Description of a core from triangles to spans, in lines."""
    return [f"blysk {version('blysk')} triangles to spans, MIT licence", _FORMATS, *_geometry_lines(unit)]


def lines_of(unit: ShadingUnit | RendererUnit | GeometryUnit | BusUnit) -> list[str]:
    """Description of any core in lines, see `header_of`; on a bus that of the core inside."""
    core = unit.framing.core if isinstance(unit, BusUnit) else unit
    if isinstance(core, GeometryUnit):
        return _geometry_header(core)
    return _render_header(core) if isinstance(core, RendererUnit) else header_of(core)


def _descriptions(unit: ShadingUnit | RendererUnit) -> Mapping[str, str]:
    """Descriptions of the ports of a core with pixels as output."""
    if isinstance(unit, RendererUnit):
        return triangle_descriptions(unit)
    members = unit.i.payload.shape().members
    ports = {f"i_{field}" for field in members} | set(unit.signature.members)
    if "attributes" in members:
        ports |= {f"i_attributes_{field}" for field in members["attributes"].members}
    texts = port_descriptions(unit.model.pipes) if isinstance(unit, PixelPipelinesUnit) else PORT_DESCRIPTIONS
    if isinstance(unit, ShadingPipelineUnit) and unit.model.build.lanes > 1:
        single = {port for port in texts if port.startswith("o_")}
        texts = {port: text for port, text in texts.items() if port not in single} | LANE_DESCRIPTIONS
    return {
        port: text for port, text in texts.items() if not port.startswith(("i_", "texel_")) or port in ports
    }


@with_options(BUILD, BuildOptions)
def verilog(
    design: ShadingPipeline | None = None, name: str = "blysk", **options: Unpack[BuildOptions]
) -> str:
    """Verilog-2001 of a pipeline for synthesis, with a table of its ports and frame constants.

    Parameters
    ----------
    design : Design, optional
        The pipeline, from `design`; by default ``design()``.
    name : str
        Name of the top module.
    **options
        Options below, with the names of the command line. ``None`` counts as not given.

    Raises
    ------
    InputError
        If the name is not a Verilog identifier, or an option does not suit the design or the core, see
        `built`.
    """
    return verilog_and_unit(built(default_design() if design is None else design, options), name)[0]


def verilog_and_unit(
    design: ShadingPipeline, name: str
) -> tuple[str, ShadingUnit | RendererUnit | GeometryUnit | BusUnit]:
    """Verilog of the core that the design's `Build` asks for, and the unit from which it was made.

    Raises
    ------
    OptionError
        If the name is not a Verilog identifier.
    """
    if not re.fullmatch("[a-zA-Z][a-zA-Z0-9_]*", name):
        raise OptionError("name", name, "not a Verilog name", "use letters, digits and underscores")
    try:
        check_name(name)
    except ValueError as error:
        raise OptionError("name", name, str(error), "choose another name") from None
    unit = core_of(design)
    p = design
    loads = p.loads_tables and p.lobe.fixed is None
    core = unit.framing.core if isinstance(unit, BusUnit) else unit
    renderer = core.model if isinstance(core, RendererUnit) else None
    axes = [f"axis {axis}" for axis in renderer.axes] if renderer else []
    counts = p.lights, p.materials, p.banks
    constants = address_table(
        *counts, p.threshold_format, loads, p.interpolator.light_meanings, axes, p.albedo
    )
    lines = lines_of(core)
    words = [*constants, *example_of(p, renderer)]
    descriptions: Mapping[str, str]
    if isinstance(unit, BusUnit):
        header, descriptions = bus_header(unit, p.build.bus, lines, words), bus_descriptions(unit)
    elif isinstance(unit, GeometryUnit):
        header, descriptions = lines, triangle_descriptions(unit)
    else:
        header = [*lines, "", "Frame constants, through the write port:", *words]
        descriptions = _descriptions(unit)
    text = {option: getattr(p.build, option) for option in ("zeros", "memories", "attributes")}
    return emit(unit, name, header=header, descriptions=descriptions, **text), unit
