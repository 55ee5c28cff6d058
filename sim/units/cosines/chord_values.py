"""Record of the chord values."""

from functools import partial

import numpy as np

from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.number.unit_vector import ONE, ONE_SQUARED
from blysk.golden.reference.geometry import normalise
from blysk.hdl.cosines.chord_values import ChordValuesUnit
from blysk.sim.engines.beats import dtype_of
from blysk.sim.units.operands import (
    component_words,
    dot,
    light_constants,
    sphere,
    spread_angles,
    turned,
    unit_codes,
    word_ends,
)
from blysk.sim.units.record import Case, Record, Sample, Stimulus, Variant

__all__ = ["RECORD"]

_GROUPS = 32
"""Lights of a measurement."""


def _measure(rng, count):
    """N·L and u of normals about H, at every distance; 1 is the product of unit vectors."""

    def samples():
        for _ in range(_GROUPS):
            light, halfway = unit_codes(rng, 1), unit_codes(rng, 1)
            around = np.repeat(normalise(halfway / ONE), count // _GROUPS + 1, axis=0)
            normal = turned(rng, around, spread_angles(rng, len(around), 180.0))
            normal = np.rint(normal * ONE).astype(np.int64)
            found = ChordValues().compute(*component_words(normal, light, halfway))
            found = np.stack([word.values[:, 0] for word in found]) / ONE_SQUARED.values
            exact, other = (normalise(v / ONE) for v in (normal, halfway))
            u = dot(exact - other, exact - other) / 2
            exact = np.stack([exact @ normalise(light / ONE)[0], u])
            yield Sample(found, exact, exact, u)

    return Sample.joined(samples())


def _expect(unit, case):
    vectors = component_words(case.constants["direction"], case.constants["halfway"])
    words = unit.parameters.compute(*component_words(case.beats), *vectors)
    beats = np.zeros((len(case.beats), unit.lights), dtype_of(unit.o.payload.shape().elem_shape))
    for name, word in zip(("diffuse", "highlight"), words, strict=True):
        if name in beats.dtype.names:
            beats[name] = word.codes
    return beats


def _normals(unit, rng, count):
    """Unit normals, a third near H, some equal or opposite to a light's vectors; ends of words; H = L."""
    direction, halfway = (unit_codes(rng, unit.lights) for _ in range(2))
    direction[1:2] = halfway[1:2]
    normals = sphere(rng, count)
    some = rng.integers(0, unit.lights, count)
    near = normalise(halfway[some] / ONE + 10.0 ** rng.uniform(-5, 0, (count, 1)) * sphere(rng, count))
    normals[::3] = near[::3]
    normals = np.rint(normals * ONE).astype(np.int64)
    normals[1::32], normals[2::32] = halfway[some[1::32]], -halfway[some[2::32]]
    normals[4::32], normals[5::32] = direction[some[4::32]], -direction[some[5::32]]
    normals[7::16] = word_ends(rng, len(normals[7::16]), 3)
    return Case(normals, light_constants(unit, direction, halfway))


def _corners(unit, rng, count):
    """Vectors and normals of ends of words: every difference and product at its largest."""
    vectors = word_ends(rng, 2, unit.lights, 3)
    # Of equal components all differences are at their largest together, and so is the sum of their squares.
    vectors[:, rng.random(unit.lights) < 0.5] = vectors[:, :1, :1]
    return Case(word_ends(rng, count, 3), light_constants(unit, *vectors))


def _variants():
    yield "interval 1", Variant(ChordValuesUnit, _measure, "angles of 0 to 180 degrees from N to H")
    for lights, interval in ((1, 3), (1, 6), (2, 3), (3, 6)):
        unit = partial(ChordValuesUnit, None, lights, initiation_interval=interval)
        yield f"{lights} lights, interval {interval}", Variant(unit, long=lights == 1)
    yield "no highlights", Variant(partial(ChordValuesUnit, None, 2, highlights=False))
    yield "2 lights, scale 6", Variant(partial(ChordValuesUnit, ChordValues(6), 2, initiation_interval=3))


RECORD = Record(
    name="chord_values",
    title="N·L and half the squared chord from N to H of a normal",
    source="docs/theory/chord.md#differences; [Lyon93]",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "normals": Stimulus(_normals, 2000),
        "corners": Stimulus(_corners, 300, repeats=10),
        "last bits": Stimulus(_normals, 50_000, stalled=False),
    },
    axis="1 - N·H",
    logarithmic=True,
    still={
        "L is constant during a run": "multiplier_{0-2}_{1,b}[0-17]",
        "the second bit of a square is 0": "multiplier_{3-5}_product[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "multiplier_{3-5}_product[35] square_partial[36] square_total[36-37] aligned[38-39]"
        ),
        "u is 6 at most": "u_0_rounded[29-31]",
    },
)
