"""Record of the triangle assembly."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.video.meshes import any_memory
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.triangles import ATTRIBUTE, DEPTH
from blysk.golden.video.triangle_assembly import TriangleAssembly
from blysk.golden.video.vertex_unit import ScreenVertices
from blysk.hdl.video.triangle_assembly import TriangleAssemblyUnit

__all__ = ["RECORD"]

_BAND = {"top": -8, "bottom": 8}


def _made(unit, case):
    words = case.write["vertex"]
    vertices = ScreenVertices(**{**words, "outside": words["outside"].astype(bool)})
    beats = case.beats
    return unit.model.compute(vertices, beats["first"], beats["count"], beats["material"], **case.constants)


def _case(unit, rng, count, spread, outside):
    mesh, steps = unit.model.mesh, unit.model.grid.steps
    vertices = {
        "x": rng.integers(-50 * steps, 50 * steps, mesh.vertices),
        "y": rng.integers(-spread, spread + 1, mesh.vertices),
        "depth": rng.integers(0, DEPTH.max_code, mesh.vertices),
        "normal": rng.integers(ATTRIBUTE.min_code, ATTRIBUTE.max_code, (mesh.vertices, 3)),
        "outside": (rng.random(mesh.vertices) < outside).astype(np.int64),
    }
    if mesh.surface is not None:
        shape = mesh.vertices, mesh.surface.attributes + 1
        vertices["surface"] = rng.integers(ATTRIBUTE.min_code, ATTRIBUTE.max_code, shape)
    first = rng.integers(0, mesh.triangles, count)
    size = 1 + (rng.random(count) ** 4 * (mesh.triangles - first)).astype(np.int64)
    first[:2], size[:2] = 0, mesh.triangles
    beats = {"first": first, "count": size, "material": rng.integers(0, 1024, count)}
    return Case(beats, _BAND, {"index": np.arange(mesh.vertices), "vertex": vertices})


def _around(unit, rng, count):
    """Vertices above, in and below the band. A tenth are outside the visible space."""
    return _case(unit, rng, count, 14 * unit.model.grid.steps, 0.1)


def _within(unit, rng, count):
    """Vertices on less than two scanlines. Most triangles cover no centre, or one row of centres."""
    return _case(unit, rng, count, unit.model.grid.steps, 0.0)


RECORD = Record(
    name="triangle_assembly",
    title="Triangles of a range that lie in a band, from screen vertices",
    source="[T] figure 4.10",
    variants={
        "77 triangles": Variant(partial(TriangleAssemblyUnit, TriangleAssembly(any_memory())), note="exact"),
        "colours and coordinates": Variant(
            partial(TriangleAssemblyUnit, TriangleAssembly(any_memory(surface=AttributeSpans(True, True)))),
            note="exact",
            long=True,
        ),
    },
    expect=lambda unit, case: _made(unit, case)[0].beats,
    status=lambda unit, case: _made(unit, case)[1],
    stimuli={"around": Stimulus(_around, 60), "within": Stimulus(_within, 60)},
    axis="",
    still={
        "a counter has room for more events than a run has": (
            "count_sent[9-31] count_rejected[7-31] count_outside[7-31]"
        ),
    },
    remembers=True,
)
