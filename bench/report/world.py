"""The core of this project beside other cores: rate, device, resources, light per pixel, verification.

The figures of other cores are those of their sources (docs/theory/references.md#other-hardware); none was
measured here. A figure that we did not find there is "not found in its source".
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from blysk.bench.report.placed import placed
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.bench.tools.families import DEVICE

__all__ = ["OTHERS", "Core", "own", "section", "tasks"]

_NOT_STATED = "not found in its source"


@dataclass(frozen=True)
class Core:
    """A shading or rasterising core.

    Parameters
    ----------
    name : str
        Name, with its key among the references.
    rate, device, resources : str
        As its source states them.
    per_pixel : str
        Lighting that it computes at every pixel.
    verified : str
        Its verification, as the source states it.
    source : str
        Address.
    """

    name: str
    rate: str
    device: str
    resources: str
    per_pixel: str
    verified: str
    source: str


OTHERS = (
    Core(
        "Lai, Yu, Chen 2002 [Lai02]",
        "117.5 million pixels a second",
        "standard cells, simulated; process not repeated here",
        "12,061 gates",
        "normal and Phong highlight of every pixel, by logarithms",
        _NOT_STATED,
        "ISCAS 2002, volume IV, pages 201 to 204",
    ),
    Core(
        "Raster I [RasterI]",
        "about 30 frames a second of 1024x768, 3,000 faces, at 100 MHz",
        "Artix-7 100T (Arty A7-100T)",
        "69 % of the LUT, 97 % of the block RAM, 88 % of the DSP",
        "deferred Phong shading in Q11.13, with vertices, textures and anti-aliasing around it",
        "on the board; no error against exact arithmetic stated",
        "https://github.com/alanjian85/raster-i",
    ),
    Core(
        "pico-gs [PicoGS]",
        "colour combiner: a pixel a cycle at 100 MHz; 640 to 960 triangles a frame at 60 Hz through its SPI "
        "port",
        "ECP5-25K (ICEpi Zero)",
        "budget: 16 of 28 DSP slices, 18 of 56 block RAMs; 8 multipliers in the rasteriser",
        "none: the host lights vertices; textures, depth and blending are done per pixel in Q4.12",
        "Verilator frames equal to those of a bit-accurate Rust model",
        "https://github.com/londey/pico-gs",
    ),
    Core(
        "RasterIX [RasterIX]",
        "100 million pixels and 200 million texels a second at 100 MHz",
        "Xilinx 7 series (Artix-7 200T, Zynq 7020, Artix-7 35T)",
        "4,500 to 36,000 LUT by configuration",
        "none: lights are in the software vertex pipeline of OpenGL 1.3; textures, fog and depth per pixel",
        "unit tests in Verilator, games on boards",
        "https://github.com/ToNi3141/RasterIX",
    ),
    Core(
        "PixelForge [PixelForge]",
        _NOT_STATED,
        "Cyclone V (DE1-SoC)",
        "31,372 ALM, 75 DSP, 634,097 bits of memory, by its presentation of February 2026",
        "none: ambient and diffuse light at vertices (no specular light); perspective-correct colour per "
        "pixel",
        "unit and integration tests in simulation, demos on the board",
        "https://github.com/qbojj/PixelForge",
    ),
    Core(
        "SpinalVoodoo [SpinalVoodoo]",
        _NOT_STATED,
        _NOT_STATED,
        _NOT_STATED,
        "none: colours of vertices interpolated in 12.12 (Gouraud); textures, fog, depth and blending per "
        "pixel",
        "Verilator, with the Glide test programs and traces of games",
        "https://github.com/fayalalebrun/SpinalVoodoo",
    ),
    Core(
        "PICA200 [PICA200]",
        "400 million pixels a second at 100 MHz, theoretical",
        "65 nm, at most 400 MHz; in a games console",
        "0.5 to 1.0 mW a MHz",
        "fragment lighting: a quaternion is interpolated, its dot products address tables of the highlight",
        _NOT_STATED,
        "https://en.wikipedia.org/wiki/PICA200, https://3dbrew.org",
    ),
)
"""Other cores, as their sources state."""


def own(method: str, model: str, operand: tuple[str, ...], text: str) -> Core:
    """A pipeline of this project, with the committed figures of place and route, if there are any."""
    entry = placed(DEVICE).get((method, model, *operand))
    name = f"blysk: {method}, {model}"
    verified = "bit-accurate model within a stated bound of float64; RTL equal to it bit for bit, simulated"
    if entry is None:
        return Core(name, "not placed yet", DEVICE, "not placed yet", text, verified, "this report")
    rate = entry["fmax_median_mhz"]
    return Core(
        name,
        f"up to a pixel a cycle: {rate:.0f} million a second at {rate:.0f} MHz",
        f"{entry['device']}, out of context, {entry['date']}",
        f"{entry['luts']:,} LUT, {entry['flip_flops']:,} flip-flops, {entry['multipliers']} multipliers",
        text,
        verified,
        "this report",
    )


def tasks(quick: bool) -> list[Task]:
    """No tasks: nothing is measured here.

    Parameters
    ----------
    quick : bool
        Without effect.
    """
    return []


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: the table, and a text on figures that cannot be compared."""
    exact = "Phong shading with exact Blinn highlights at every pixel, {}"
    quotients = "no unit normal: quotients of quadratics"
    cores = [
        own("quotient", "blinn", (), exact.format(quotients)),
        own("quotient", "phong", (), exact.replace("Blinn", "Phong").format(quotients)),
        own("renormalise", "blinn", (), exact.format("each normal divided by its length")),
        *OTHERS,
    ]
    text = [
        "Figures of others are theirs, as their sources state them; none was measured here, and what a "
        "source does not say, or we did not find, is *not found in its source*. References: "
        "docs/theory/references.md, other hardware.",
        "**Not comparable as they stand.** blysk is a shading core: triangles become spans before it, and "
        "its pixels "
        "leave it for a frame buffer outside; the open graphics processors bring vertices, textures, depth "
        "and memory, "
        "which take most of their logic, and no light per pixel, Raster I apart. Rates are peaks of a clock "
        "for some, "
        "frames with all of memory for others. Gates of a standard cell, LUT of four inputs and LUT of six "
        "are "
        "different units. Only blysk states an error against exact arithmetic.",
    ]
    columns = ("core", "rate", "device", "resources", "light per pixel", "how it is verified", "source")
    rows = [
        (core.name, core.rate, core.device, core.resources, core.per_pixel, core.verified, core.source)
        for core in cores
    ]
    return Section("world", "Beside the world", text, [Table("world", "This core and others", columns, rows)])
