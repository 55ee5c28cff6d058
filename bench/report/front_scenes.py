"""Designs over several meshes, sizes and exponents: errors and cycles, without simulation."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from blysk.bench.accuracy import scene_for
from blysk.bench.ring import ring
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.golden.frames.compare import compare_image
from blysk.golden.frames.frame import model_frame
from blysk.golden.methods.interpolator import Operand
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import Mesh
from blysk.sim.meshes.teapot import teapot

__all__ = ["FULL_SCENES", "QUICK_SCENES", "measure"]

QUICK_SCENES = (
    ("teapot", 1000, (160, 120), (20, 200)),
    ("ring", 1296, (160, 120), (20, 200)),
    ("teapot", 10_000, (320, 240), (100,)),
)
"""Mesh, triangles, size and exponents of the quick report's scenes."""

FULL_SCENES = (
    ("teapot", 1000, (640, 480), (1, 10, 100, 1000)),
    ("ring", 1296, (640, 480), (1, 10, 100, 1000)),
    ("teapot", 10_000, (640, 480), (1, 10, 100, 1000)),
    ("teapot", 10_000, (1920, 1080), (100,)),
    ("teapot", 100_000, (1920, 1080), (100,)),
)


@lru_cache(maxsize=4)
def _mesh(name: str, triangles: int) -> Mesh:
    return ring() if name == "ring" else teapot(triangles)


def measure(
    method: str,
    model: str,
    scenes: Sequence[Sequence[Any]],
    operand: Operand | None = None,
    lanes: int = 1,
) -> list[dict[str, Any]]:
    """Errors and cycles of a design over several scenes: by the bit-accurate model and the cycle model.

    Parameters
    ----------
    method, model, operand
        Arguments of `preset`.
    lanes : int
        Lanes of the pipeline.
    scenes : sequence
        Scenes in the form of `QUICK_SCENES`.

    Returns
    -------
    list of dict
        For each scene and exponent ``mesh``, ``triangles``, ``width``, ``height``, ``exponent``,
        ``method_max_lsb``, ``total_max_lsb``, ``spans`` after cutting, ``uncut_spans``, ``pixels``,
        ``cycles``.
    """
    design = preset(method, model, operand=operand).built(lanes=lanes)
    unit = unit_of(design)
    found = []
    for mesh, triangles, size, exponents in scenes:
        for exponent in exponents:
            scene = scene_for(_mesh(mesh, triangles), exponent, *size)
            frame = model_frame(scene, design)
            errors = compare_image(scene, design, frame.image)
            writes = frame.prepared.writes
            found.append(
                {
                    "mesh": mesh,
                    "triangles": len(scene.mesh.faces),
                    "width": size[0],
                    "height": size[1],
                    "exponent": exponent,
                    "method_max_lsb": errors.method_error.max_lsb,
                    "total_max_lsb": errors.total_error.max_lsb,
                    "spans": frame.spans,
                    "uncut_spans": len(frame.raster.length),
                    "pixels": frame.pixels,
                    "cycles": frame_cycles(unit, frame.prepared.spans, writes),
                }
            )
    return found
