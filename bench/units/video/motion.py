"""Record of the motion."""

from functools import cache, partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.bench.units.video.meshes import any_memory
from blysk.golden.reference.camera import Camera
from blysk.golden.video.motion import ANGLE_BITS, ENTRIES, Motion, rotation
from blysk.hdl.video.motion import MotionUnit

__all__ = ["RECORD"]

_AXIS = (0.3, 1.0, -0.2)


@cache
def _motion() -> Motion:
    """Motion in two slots. Slot 0 turns the mesh of a memory before a camera. Slot 1 has any codes."""
    memory = any_memory()
    camera = Camera.framing(memory.world(memory.parts[0]).vertices, (0.2, 0.4, 1.0), "perspective")
    made = Motion.of(memory, camera, (640, 480), _AXIS)
    rng = np.random.default_rng(2026)
    constant = rng.integers(-(1 << 24), 1 << 24, (1, ENTRIES))
    cosine, sine = rng.integers(-(1 << 17), 1 << 17, (2, 1, ENTRIES))
    words = ((made.constant, constant), (made.cosine, cosine), (made.sine, sine))
    return Motion(*(np.concatenate(pair) for pair in words))


def _expect(unit, case):
    entries = unit.model.compute(case.beats["slot"], case.beats["angle"])
    index = np.tile(np.arange(ENTRIES), len(entries))
    return {"index": index, "value": entries.ravel()}


def _angles(unit, rng, count):
    """Any angles in both slots. The first angles are at and next to the quarters of a turn."""
    angle = rng.integers(0, 1 << ANGLE_BITS, count)
    quarters = np.array([0, 1023, 1024, 2047, 2048, 3071, 3072, 4095])
    angle[: len(quarters)] = quarters[:count]
    return Case({"slot": rng.integers(0, 2, count), "angle": angle})


def _measure(rng, count):
    """Entries of the rotation of normals."""
    angle = rng.integers(0, 1 << ANGLE_BITS, count)
    found = _motion().compute(np.zeros(count, dtype=np.int64), angle)[:, 12:] * 2.0**-16
    exact = np.stack([rotation(_AXIS, Motion.radians(code)).ravel() for code in angle.tolist()])
    return Sample(found, exact, None, np.broadcast_to(angle[:, np.newaxis] / 4096, found.shape))


RECORD = Record(
    name="motion",
    title="The matrix of a mesh that turns",
    source="docs/theory/video.md#vertices",
    variants={"two slots": Variant(partial(MotionUnit, _motion()), _measure, "all angles")},
    expect=_expect,
    stimuli={"angles": Stimulus(_angles, 400)},
    axis="angle, turns",
)
