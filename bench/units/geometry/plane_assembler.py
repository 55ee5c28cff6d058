"""Record of the plane assembler."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.triangles import frame_of
from blysk.golden.geometry.gradient_setup import Gradients, GradientSetup
from blysk.golden.geometry.plane_assembler import PlaneAssembler
from blysk.golden.geometry.triangles import ATTRIBUTES, FrameSettings
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.plane_assembler import PlaneAssemblerUnit

__all__ = ["RECORD"]

_FORMATS = {"start": GradientSetup.START_FORMAT} | dict.fromkeys(
    ("short", "long", "inward"), GradientSetup.FORMAT
)


def _expect(unit, case):
    count = len(case.beats["size"]) // ATTRIBUTES
    beats = {
        name: value[: ATTRIBUTES * count].reshape(count, ATTRIBUTES) for name, value in case.beats.items()
    }
    words = {name: Fixed(format, beats[name]) for name, format in _FORMATS.items()}
    gradients = Gradients(**words, size=beats["size"])
    planes = PlaneAssembler().compute(gradients, beats["least"][:, 0], frame_of(case.constants)).beats
    if not unit.serial:
        return planes
    # One attribute after the other. Each has the length of the triangle's pieces.
    return {
        name: np.repeat(value, ATTRIBUTES) if name == "piece" else value.reshape(-1)
        for name, value in planes.items()
    }


def _case(rng, count, limit):
    beats = {name: any_codes(rng, format, ATTRIBUTES * count) for name, format in _FORMATS.items()}
    size = 1 << rng.integers(0, 20, (count, 1))
    size = np.minimum(size + rng.integers(0, size + 1, (count, ATTRIBUTES)), (1 << 20) - 1)
    size[::5, 0] = rng.choice([1, (1 << 20) - 1], len(size[::5]))
    least = rng.integers(0, 3457, count)
    least[::7] = rng.choice([0, 1, 3456], len(least[::7]))
    # A third of the bounds: ``least`` times ``limit`` is next to ``norm`` times a power of two.
    norm = size[:, :3].max(axis=1) + size[:, :3].sum(axis=1)
    close = np.arange(count) % 3 == 0
    near = (norm << rng.integers(0, 13, count)) // max(limit, 1) + rng.integers(0, 2, count)
    least = np.where(close, np.minimum(near, 3456), least)
    beats |= {"size": size.ravel(), "least": np.repeat(least, ATTRIBUTES)}
    return Case(beats, FrameSettings(0, 0, 10, 10, limit=limit).codes)


def _usual(unit, rng, count):
    """Sizes of every power of two, with the default limit.

    A third of the bounds are next to a value where the length of a piece changes.
    """
    return _case(rng, count, 267)


def _largest(unit, rng, count):
    """Sizes and bounds of the same kinds, with the largest limit."""
    return _case(rng, count, 1023)


def _least(unit, rng, count):
    """Sizes and bounds of the same kinds, with limit 0 or 1. Limit 0 cuts all spans to single pixels."""
    return _case(rng, count, int(rng.integers(0, 2)))


RECORD = Record(
    name="plane_assembler",
    title="Gradients of a triangle's attributes, and the longest piece of its spans",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(PlaneAssemblerUnit, note="exact"),
        "serial": Variant(partial(PlaneAssemblerUnit, serial=True), note="exact"),
    },
    expect=_expect,
    stimuli={
        "usual": Stimulus(_usual, 500),
        "largest": Stimulus(_largest, 300),
        "least": Stimulus(_least, 100),
    },
    axis="",
)
