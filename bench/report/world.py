"""The core of this project compared with other cores: rate, device, resources, light per pixel, verification.

The figures of other cores are from their sources (docs/theory/references.md#other-hardware). None of these
figures was measured here. A figure that we did not find in its source is "not found in its source".
"""

from blysk.bench.report.claims import Claim, ClaimTable, Document
from blysk.bench.report.placed import placed
from blysk.bench.tools.families import DEVICE

__all__ = ["CORES", "OTHERS", "claims", "own", "section", "tasks"]

_NOT_STATED = "not found in its source"

CORES = {
    "Lai02": "Lai, Yu, Chen 2002",
    "Sheikh12": "Sheikh and others 2012",
    "RasterI": "Raster I",
    "PicoGS": "pico-gs",
    "RasterIX": "RasterIX",
    "PixelForge": "PixelForge",
    "SpinalVoodoo": "SpinalVoodoo",
    "OpenGlory": "OpenGlory",
    "OpenGPGPU": "OpenGPGPU/gpu",
    "Skybox": "Vortex, Skybox",
    "Graphite": "Graphite",
    "PICA200": "PICA200",
}
"""Names of other cores by their keys in docs/theory/references.md."""

OTHERS: dict[str, dict[str, str]] = {
    "rate": {
        "Lai02": "117.5 million pixels a second at 450 MHz",
        "Sheikh12": "2.05 billion vertices a second at 1.05 V, measured",
        "RasterI": "about 30 frames a second of 1024x768, 3,000 faces, at 100 MHz",
        "PicoGS": "colour combiner: a pixel a cycle at 100 MHz; SPI port: 640 to 960 triangles a frame at 60 "
        "Hz",
        "RasterIX": "100 million pixels and 200 million texels a second at 100 MHz",
        "PixelForge": "60 frames a second of 640x480, 500 to 1,000 triangles",
        "SpinalVoodoo": _NOT_STATED,
        "OpenGlory": "about 15 frames a second of Quake on the XCKU040",
        "OpenGPGPU": "22 cycles a pixel with a flat colour, 256 with a program",
        "Skybox": "peak of 3.7 billion pixels a second at 230 MHz, 32 cores",
        "Graphite": _NOT_STATED,
        "PICA200": "400 million pixels a second at 100 MHz, theoretical",
    },
    "device": {
        "Lai02": "standard cells, simulated; we leave out the process",
        "Sheikh12": "32 nm, a chip",
        "RasterI": "Artix-7 100T (Arty A7-100T)",
        "PicoGS": "ECP5-25K (ICEpi Zero)",
        "RasterIX": "Xilinx 7 series (Artix-7 200T, Zynq 7020, Artix-7 35T)",
        "PixelForge": "Cyclone V (DE1-SoC)",
        "SpinalVoodoo": "Cyclone V (DE10-Nano), 50 MHz",
        "OpenGlory": "XCKU040 (AXKU040), 175 MHz; ECP5-85F (ULX3S), 20 MHz, later 30",
        "OpenGPGPU": "none; synthesised for ASAP7",
        "Skybox": "Stratix 10, Arria 10, Alveo, Versal",
        "Graphite": "ECP5 (ULX3S)",
        "PICA200": "65 nm, at most 400 MHz; in a games console",
    },
    "resources": {
        "Lai02": "12,061 gates",
        "Sheikh12": "0.064 mm2, 151 mW",
        "RasterI": "69 % of the LUT, 97 % of the block RAM, 88 % of the DSP",
        "PicoGS": "budget: 16 of 28 DSP slices, 18 of 56 block RAMs; 8 multipliers in the rasteriser",
        "RasterIX": "4,500 to 36,000 LUT by configuration",
        "PixelForge": "31,372 ALM, 75 DSP, 634,097 bits of memory, by its presentation of February "
        "2026; 27,702 ALM and 62 DSP by its thesis",
        "SpinalVoodoo": _NOT_STATED,
        "OpenGlory": "85 % of the LUT of the XCKU040 with eight rasterisers",
        "OpenGPGPU": _NOT_STATED,
        "Skybox": _NOT_STATED,
        "Graphite": _NOT_STATED,
        "PICA200": "0.5 to 1.0 mW a MHz",
    },
    "light per pixel": {
        "Lai02": "normal and Phong highlight of every pixel, by logarithms",
        "Sheikh12": "Phong's formula by logarithms, for vertices and pixels",
        "RasterI": "deferred Phong shading in Q11.13, with vertices, textures and anti-aliasing around it",
        "PicoGS": "none: the host lights vertices; textures, depth and blending are done per pixel in Q4.12",
        "RasterIX": "none: lights are in the software vertex pipeline of OpenGL 1.3; textures, fog and depth "
        "per pixel",
        "PixelForge": "none: ambient and diffuse light at vertices (no specular light); perspective-correct "
        "colour per pixel, no textures",
        "SpinalVoodoo": "none: colours of vertices interpolated in 12.12 (Gouraud); textures, fog, depth and "
        "blending per pixel",
        "OpenGlory": "none, no light at all; textures, depth and blending per pixel",
        "OpenGPGPU": "a program in RISC-V code for every pixel",
        "Skybox": "a program in RISC-V code for every pixel, with units that rasterise and take texels",
        "Graphite": "none: colours of vertices (Gouraud) and textures",
        "PICA200": "fragment lighting: interpolates a quaternion, whose dot products address tables of the "
        "highlight",
    },
    "verification": {
        "Lai02": _NOT_STATED,
        "Sheikh12": "a chip, measured; mean error of a vertex's light 0.56 % against single precision",
        "RasterI": "on the board; states no error against exact arithmetic",
        "PicoGS": "Verilator frames equal to those of a bit-accurate Rust model",
        "RasterIX": "unit tests in Verilator, games on boards",
        "PixelForge": "unit and integration tests in simulation, demos on the board",
        "SpinalVoodoo": "Verilator, with the Glide test programs and traces of games",
        "OpenGlory": "cocotb with GHDL or NVC, a software emulator, boards",
        "OpenGPGPU": "Scala tests, Linux guests in QEMU",
        "Skybox": "simulators and FPGAs",
        "Graphite": "Verilator, and a software model",
        "PICA200": _NOT_STATED,
    },
}
"""Printed figures of other cores, by quantity and core."""

_EXACT = "Phong shading with exact {} highlights at every pixel, "

_OWN = {
    ("quotient", "blinn"): _EXACT.format("Blinn") + "no unit normal: quotients of quadratics",
    ("quotient", "phong"): _EXACT.format("Phong") + "no unit normal: quotients of quadratics",
    ("renormalise", "blinn"): _EXACT.format("Blinn") + "each normal divided by its length",
}
"""Light per pixel of pipelines of this project, by method and model."""


def own(method: str, model: str, date: str) -> dict[str, str]:
    """The quantities of `OTHERS` for a pipeline of this project, from committed figures of place and route.

    Parameters
    ----------
    method, model : str
        The pipeline.
    date : str
        Date of the pipeline's figures. Empty if there are no figures.
    """
    light = _OWN.get((method, model), "")
    verified = (
        "bit-accurate model within a stated bound of float64; simulated RTL equal to the model to the bit"
    )
    found = {"light per pixel": light, "verification": verified}
    if not date:
        return {"rate": "not placed yet", "device": DEVICE, "resources": "not placed yet", **found}
    entry = placed(DEVICE)[method, model]
    rate, count = entry["fmax_median_mhz"], len(entry["fmax_mhz"])
    return {
        "rate": f"up to a pixel a cycle: {rate:.0f} million a second at {rate:.0f} MHz, median of "
        f"{count} placement{'s' * (count > 1)}",
        "device": f"{entry['device']}, the shading core alone, out of context, {date}",
        "resources": f"{entry['luts']:,} LUT, {entry['flip_flops']:,} flip-flops, {entry['multipliers']} "
        "multipliers",
        **found,
    }


def claims(quick: bool) -> list[Claim]:
    """Statements of the sources of other cores, and of this project. A quick report has the same."""
    found = []
    for quantity, printed in OTHERS.items():
        found += [Claim(f"{CORES[key]} [{key}]", "", quantity, printed=text) for key, text in printed.items()]
        for method, model in _OWN:
            date = placed(DEVICE).get((method, model), {"date": ""})["date"]
            settings = {"method": method, "model": model, "date": date}
            found.append(Claim(f"blysk: {method}, {model}", "", quantity, own, settings, quantity))
    return found


_DOCUMENT = Document(
    "world",
    "Compared with other cores",
    [
        "The figures of other cores are printed in their sources. We measured none of these figures. *Not "
        "found in its source* marks a figure that a source does not state, or that we did not find. For "
        "references see docs/theory/references.md, *Other hardware*.",
        "**The figures are not directly comparable.** blysk is a shading core: triangles become spans before "
        "the core, and pixels go to a frame buffer outside. The open graphics processors also have vertices, "
        "depth and memory, and most of them textures. These parts take most of their logic. Raster I has "
        "fixed light per pixel; OpenGPGPU and Skybox run a program per pixel. Some rates are peaks at a "
        "clock rate, other rates are frames with all memory accesses. Gates of a standard cell, LUT of four "
        "inputs and LUT of six inputs are different units.",
        "Of these cores blysk states a largest error and a bound, and Sheikh and others state a mean error. "
        "Units of powers have stated errors, too: [Harris04] has 8 to 10 bits.",
        "Our rate is that of the shading core alone, placed out of context on a single device.",
        "The method `quotient` is a combination of known parts: [Duff79], [DEC90], [Bishop86], [Lyon93], "
        "[Loisel]. Ours are Phong's highlight by a single factor, and the bound for every span in words of "
        "18 bits. See docs/theory/quotient.md, *Prior art*.",
    ],
    [ClaimTable("world", "This core and other cores", claims)],
    appendix=False,
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
