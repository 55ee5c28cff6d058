"""Record of the mesh memory."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.video.meshes import any_memory
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.hdl.video.mesh_memory import MeshMemoryUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    first, count = case.beats["first"], case.beats["count"]
    index = np.repeat(first - np.cumsum(count) + count, count) + np.arange(count.sum())
    memory = unit.model
    found = {"index": index, "position": memory.position[index], "normal": memory.normal[index]}
    return found if memory.attributes is None else found | {"attributes": memory.attributes[index]}


def _ranges(unit, rng, count):
    """Ranges of one vertex up to all vertices."""
    vertices = unit.model.vertices
    first = rng.integers(0, vertices, count)
    size = 1 + (rng.random(count) ** 3 * (vertices - first)).astype(np.int64)
    first[:2], size[:2] = 0, vertices
    return Case({"first": first, "count": size})


RECORD = Record(
    name="mesh_memory",
    title="Vertices of a range, one a cycle",
    source="docs/theory/video.md#vertices",
    variants={
        "40 vertices": Variant(partial(MeshMemoryUnit, any_memory()), note="exact"),
        "colours and coordinates": Variant(
            partial(MeshMemoryUnit, any_memory(surface=AttributeSpans(True, True))), note="exact", long=True
        ),
    },
    expect=_expect,
    stimuli={"ranges": Stimulus(_ranges, 100)},
    axis="",
)
