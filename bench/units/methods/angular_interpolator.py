"""Record of the angular interpolator."""

import numpy as np

from blysk.bench.units.methods.interpolator import STIMULI, case_of, expect, measured, options, status
from blysk.bench.units.record import Record, Stimulus
from blysk.golden.methods.angular_interpolator import PUBLISHED, AngularInterpolator
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.geometry import normalise

__all__ = ["RECORD"]

_ANGULAR = AngularInterpolator()


def _pole(unit, rng, count):
    """Spans on the great circle that is 90 degrees from L or H, where every cosine is 0."""
    left = rng.uniform(0, 360, count)
    around = np.radians([left, left + rng.uniform(-149, 149, count)])
    ends = quantise(np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1))
    ends[:, ::2] = np.roll(ends[:, ::2], 1, axis=-1)
    case = case_of(unit, rng, *ends, rng.integers(1, 40, count))
    case.constants["direction"], case.constants["halfway"] = ONE * np.eye(3, dtype=np.int64)[[2, 0]]
    return case


def _longest_words(unit, rng, count):
    """Normals and L with the longest codes that rounding gives.

    Some pairs of normals are opposite, 60 degrees apart or 90 degrees apart.
    """

    def rounded(about):
        codes = np.rint(normalise(about + rng.uniform(-0.002, 0.002, (200_000, 3))) * ONE).astype(int)
        return codes[np.argsort(-np.linalg.norm(codes, axis=-1))]

    vector = rounded(np.sqrt(1 / 3))[0]
    about = normalise(vector)
    # The ends of these spans differ by a step in each component. So at most one end has length 1.
    step = np.floor(normalise(vector + rng.integers(-100, 101, (200_000, 3))) * ONE).astype(int)
    excess = np.linalg.norm(step, axis=-1) - ONE
    step = step[np.argsort(np.abs(excess + np.sqrt(3) / 2))[:40]]
    first, second = (rounded(np.array(side) / 3)[:1000] for side in ((2, 2, 1), (1, -2, 2)))
    tie = np.argsort(np.abs(first @ second.T), axis=None)[:count]
    middle, side = (normalise(np.cross(about, rng.normal(size=(count, 3)))) for _ in range(2))
    half = np.radians(10.0 ** rng.uniform(-1, 1.5, (count, 1)))
    sixty = np.cos(np.pi / 3) * side + np.sin(np.pi / 3) * np.cross(side, about)
    pairs = [
        (quantise(side[:1]), -quantise(side[:1])),
        (step, step + 1),
        (first[tie // 1000], second[tie % 1000]),
        tuple(quantise(middle * np.cos(angle) + about * np.sin(angle)) for angle in (-half, half)),
        (quantise(side), quantise(sixty)),
        (vector[np.newaxis], vector[np.newaxis]),
        (quantise(side[1:2]), quantise(sixty[1:2])),
    ]
    left, right = (np.concatenate(end) for end in zip(*pairs, strict=True))
    case = case_of(unit, rng, left, right, np.full(len(left), 3))
    case.constants["direction"] = case.constants["halfway"] = vector
    return case


def _variants():
    yield "angular", measured(_ANGULAR)
    yield "angular, interval 1", options(_ANGULAR, 2, setup_interval=1)
    yield "angular, interval 6, no highlights", options(_ANGULAR, setup_interval=6, highlights=False)
    for method in PUBLISHED:
        yield method.name, options(method, as_published=True)


RECORD = Record(
    name="angular_interpolator",
    title="Cosines of angles in equal steps on the great circle",
    source="docs/theory/interpolation.md#angular-method; [T] 3.1, 3.2",
    variants=dict(_variants()),
    expect=expect,
    status=status,
    stimuli=STIMULI
    | {"pole": Stimulus(_pole, 200), "longest words": Stimulus(_longest_words, 400, stalled=False)},
    waivers={
        "cordic_*": (
            "The axes of the great circle are at most 0.71 and the root of 2. The controlling bit is above "
            "these bits, so it is 0."
        ),
        "minor_operand": (
            "The fault changes the register only while the output is stalled. Its word has been read by then."
        ),
    },
    still={
        "half of an angle has 37 fraction bits, and the phase has 40": "top.{spare,payload}[0-2]",
        "an angle is at most half a turn, and a step is less than half a turn": "top.{spare,payload}[79]",
    },
)
