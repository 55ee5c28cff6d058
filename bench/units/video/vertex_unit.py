"""Record of the vertex unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import unit_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.video.motion import ENTRIES, rotation
from blysk.golden.video.vertex_unit import ENTRY, OFFSET, WEIGHT, Matrix, VertexTransform
from blysk.hdl.video.vertex_unit import VertexUnit

__all__ = ["RECORD", "any_matrix"]


def any_matrix(rng: np.random.Generator, distance: float = 1.4, size: float = 0.4) -> Matrix:
    """Matrix of an object with any rotation before a camera.

    Distance and size of the object are in units of the distance of the near plane.
    """
    turn = rotation(rng.normal(size=3), rng.uniform(0, 6.3))
    rows = size * np.array([[1.7], [1.7], [1.0]]) * turn
    position, normal = (Fixed.round(ENTRY, values).codes for values in (rows, turn))
    offset = [rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), distance]
    return Matrix(position, Fixed.round(OFFSET, offset).codes, normal)


def _writes(matrix: Matrix) -> dict[str, np.ndarray]:
    """Beats that write a matrix. Entries of the bench have the bits that `Motion` gives them."""
    parts = matrix.position.ravel(), matrix.offset, matrix.normal.ravel()
    return {"index": np.arange(ENTRIES), "value": np.concatenate(parts)}


def _matrix(write) -> Matrix:
    position, offset, normal = np.split(write["value"], (9, 12))
    return Matrix(position.reshape(3, 3), offset, normal.reshape(3, 3))


def _expect(unit, case):
    given = case.beats["position"], case.beats["normal"], _matrix(case.write)
    made = unit.model.compute(*given, case.beats.get("attributes"))
    return {"index": case.beats["index"], "vertex": made.beats}


def _case(unit, rng, count, matrix):
    index_bits = len(unit.i.payload.index)
    position = rng.integers(-ONE, ONE + 1, (count, 3))
    ends = rng.random(count) < 0.1
    position[ends] = rng.choice([-ONE, 0, ONE], (ends.sum(), 3))
    beats = {"index": rng.integers(0, 1 << index_bits, count), "position": position}
    beats["normal"] = unit_codes(rng, count)
    if (surface := unit.model.surface) is not None:
        beats["attributes"] = rng.integers(-WEIGHT, WEIGHT + 1, (count, surface.attributes))
    return Case(beats, write=_writes(matrix))


def _inside(unit, rng, count):
    """An object before the camera."""
    return _case(unit, rng, count, any_matrix(rng))


def _around(unit, rng, count):
    """An object whose vertices are mostly outside the visible space: too near, too far, or beside it."""
    matrix = any_matrix(rng, distance=rng.choice([0.5, 1.5, 15.5]), size=1.1)
    return _case(unit, rng, count, matrix)


def _any(unit, rng, count):
    """Any codes of matrices."""
    most = ENTRY.max_code
    position, normal = rng.integers(-most - 1, most + 1, (2, 3, 3))
    offset = rng.integers(OFFSET.min_code, OFFSET.max_code + 1, 3)
    return _case(unit, rng, count, Matrix(position, offset, normal))


def _measure(rng, count):
    """Columns of the vertices inside the visible space, in steps of the grid."""
    unit, matrix = VertexTransform(), any_matrix(rng)
    position = rng.integers(-ONE, ONE + 1, (count, 3))
    found = unit.compute(position, unit_codes(rng, count), matrix)
    space = Fixed(COMPONENT, position).values @ Fixed(ENTRY, matrix.position).values.T
    space = space + Fixed(OFFSET, matrix.offset).values
    exact = space[:, 0] / space[:, 2] * 2.0 ** (unit.scale_bits + unit.grid.subpixel_bits)
    kept = ~found.outside
    return Sample(found.x[kept], exact[kept], None, space[kept, 2])


RECORD = Record(
    name="vertex_unit",
    title="Vertices times a matrix, divided by W, on the screen",
    source="docs/theory/video.md#vertices",
    variants={
        "one multiplier": Variant(
            VertexUnit, _measure, "vertices inside", note="error of the column, in 1/256 pixel"
        ),
        "colours and coordinates": Variant(
            partial(VertexUnit, VertexTransform(surface=AttributeSpans(True, True))), long=True
        ),
    },
    expect=_expect,
    stimuli={
        "inside": Stimulus(_inside, 2000),
        "around": Stimulus(_around, 1000, repeats=3),
        "any": Stimulus(_any, 1000, repeats=3),
    },
    axis="W, near planes",
    still={
        "a mantissa is at least 1 and its reciprocal at least 1/2, so both begin with a bit of 1": (
            "mantissa[25] {table_0_row,reciprocal_row,port__data}[27]"
        )
    },
)
