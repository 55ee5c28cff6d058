"""Worked example in the header of a Verilog file: every write of a frame, and the values of a table."""

import numpy as np

from blysk.golden.frame_constants import LOBE_ADDRESS
from blysk.golden.frames.prepare import constants_of
from blysk.golden.frames.triangle_frame import triangle_constants
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

__all__ = ["example_of"]

AMBIENT, DIFFUSE, SPECULAR, EXPONENT = 0.05, 0.4, 0.55, 50
"""The surface of the example."""

_PER_LINE = 8


def example_of(design: ShadingPipeline, renderer: Renderer | None = None) -> list[str]:
    """Lines: all writes for a grey surface, and for white light from the direction of the viewer, in decimal.

    Parameters
    ----------
    design : Design
        The pipeline. If its exponent is fixed at build time, the example has this exponent. If its tables are
        fixed for other lobes, there are no lines.
    renderer : Renderer, optional
        Core that sends triangles to the pipeline. The example then also writes the axes of further lights.
    """
    material = Material(
        (AMBIENT,) * 3, (DIFFUSE,) * 3, (SPECULAR,) * 3, exponent=design.build.exponent or EXPONENT
    )
    triangle = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.eye(3), material=np.zeros(1, np.int64))
    lights = (Light((0, 0, 1)),) * design.lights
    scene = Scene(triangle, Camera((0, 0, 5), (0, 0, 0)), 8, 8, (material,) * design.materials, lights)
    try:
        first, *more = triangle_constants(scene, renderer) if renderer else constants_of(scene, design)
    except ValueError:
        # The tables are fixed for lobes with other parameters.
        return []
    writes = first.writes(0 if more else None)
    pairs = list(zip(writes["address"].tolist(), writes["data"].tolist(), strict=True))
    table = [data for address, data in pairs if address == LOBE_ADDRESS]
    others = [f"{address}: {data}" for address, data in pairs if address != LOBE_ADDRESS]
    lines = [
        "",
        f"Example: ambient {AMBIENT}, diffuse {DIFFUSE}, specular {SPECULAR}, exponent {material.exponent}, "
        "L = H = (0, 0, 1), white light; address: data of each write of a material",
        *("  " + ", ".join(others[k : k + _PER_LINE]) for k in range(0, len(others), _PER_LINE)),
    ]
    if table:
        lines += _table_lines(design.lobe, table)
        if design.has_threshold and (rule := design.highlight_gate.threshold_rule):
            lines.append(f"  threshold: {rule}")
    return lines


def _table_lines(lobe: Lobe, table: list[int]) -> list[str]:
    steps, octaves = lobe.steps, lobe.octaves
    first, parts = lobe.argument_text, []
    operand = first[0]
    if lobe.parts == 2:
        half = lobe.entries // 2
        parts = [
            f"  these are {half} values; then {half} values of S as a function of c = (N.H)^2, in the same "
            "rows and steps; last c = 1"
        ]
    return [
        f"Table, {len(table)} writes to address {LOBE_ADDRESS} in this order: 2^17 + bank, then "
        f"{lobe.entries + 1} values of the highlight S({operand}), {first}, times 2^17 (1 is 2^17 - 1):",
        f"  row r = 0 to {octaves}, step k = 0 to {steps - 1}: {operand} = k / {steps} 2^-{octaves} in row "
        f"0, (1 + k / {steps}) 2^(r - {octaves + 1}) from row 1 on"
        + ("" if parts else f"; last {operand} = 1"),
        *parts,
        "  each rounded to the nearest; between two values the highlight is a straight line. The values "
        "of the example are moved by half the error of this line. This halves the error; plain S also works",
        f"  of the example: {', '.join(map(str, table[:6]))}, ..., {', '.join(map(str, table[-4:]))}; entry "
        f"{lobe.entries // 2}: {table[1 + lobe.entries // 2]}",
    ]
