"""Record of the attribute serialiser."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.triangles import random_triangles, triangles_with
from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.hdl.geometry.attribute_serialiser import AttributeSerialiserUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    beats = case.beats
    order = np.stack((beats["top"], 3 - beats["top"] - beats["bottom"], beats["bottom"]), axis=1)
    rows = np.arange(len(order))[:, np.newaxis]
    return AttributeSerialiser().compute(
        triangles_with(**{name: beats[name][rows, order] for name in ("depth", "normal")})
    )


def _case(rng, count, spread):
    triangles = random_triangles(rng, count, spread=spread)
    order = rng.permuted(np.tile(np.arange(3), (count, 1)), axis=1)
    words = {"depth": triangles.depth, "normal": triangles.normal}
    return Case(words | {"top": order[:, 0], "bottom": order[:, 2]})


def _near(unit, rng, count):
    """Normals of all lengths. The normals of a triangle's corners are near to each other."""
    return _case(rng, count, 0.3)


def _far(unit, rng, count):
    """Normals of any direction. Some have components near 0 or with extreme codes."""
    case = _case(rng, count, 2.0)
    low, high = -(1 << 23) + 1, (1 << 23) - 1
    words = [low, high, 0, -1, 1, 4095, 4096, -4096, -4097]
    case.beats["normal"][::3] = rng.choice(words, case.beats["normal"][::3].shape)
    case.beats["normal"][::6, 1:] = np.sign(case.beats["normal"][::6, :1]) * np.abs(
        case.beats["normal"][::6, 1:]
    )
    return case


RECORD = Record(
    name="attribute_serialiser",
    title="A triangle's attributes one after the other, and a bound on its normals' length",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(AttributeSerialiserUnit, note="exact"),
        "without skid buffer": Variant(partial(AttributeSerialiserUnit, skid=False), note="exact"),
    },
    expect=_expect,
    stimuli={"near": Stimulus(_near, 500), "far": Stimulus(_far, 500)},
    axis="",
    still={"total_0 sums magnitudes of the first corner's components, so its sign is 0": "total_0[13]"},
)
