"""The angular method in the pipeline: RTL against its twin, where the last bits of its cosines decide."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.pipeline import ShadingPipelineUnit

from ..edges import SHADE, constants_of, highlight_edges, spans_on_edges
from ..pixels import assert_equals_twin


@pytest.fixture(scope="module")
def unit():
    return ShadingPipelineUnit(preset("angular"))


def test_last_bits_count(unit):
    """What is worked out for a span counts, where the cosine of a pixel is on an edge.

    That is where light and shade meet, or where the colour changes: far from a highlight's peak every word
    of a span counts, and near it those of a pixel have the most bits.
    """
    rng = np.random.default_rng(5)
    parameters = unit.parameters
    code = quantise(normalise(rng.normal(size=3)))
    count = 8000
    angles = np.r_[90 * 10.0 ** rng.uniform(-5, -2.5, count), rng.uniform(3, 149, count)]
    steps = np.r_[rng.integers(0, 25, count), rng.integers(0, 13, count)]

    def cosine(left, right, length, steps):
        words = (Fixed(COMPONENT, codes) for codes in (left, right, np.broadcast_to(code, left.shape)))
        _, *wave, _ = parameters.interpolator.setup.compute(*words, length)
        # Half-way between two codes is the place from which either is as far.
        below = HighlightCosine().compute(*wave, np.arange(len(steps)), steps).codes - 0.5
        return ((1 << 25) - below) * 2.0**9

    for edges, exponent in (
        (SHADE, 1),
        (highlight_edges(parameters, 3), 3),
        (highlight_edges(parameters, 1000), 1000),
    ):
        spans = spans_on_edges(rng, code, edges, angles, steps, cosine)
        constants, stalls = constants_of(code, exponent), rng.random(1009) < 0.4
        pixels = parameters.compute(spans, constants)
        assert_equals_twin(unit, spans, constants, pixels, output_stalls=stalls)


def test_vector_at_the_pole(unit):
    """Spans on the great circle that is everywhere 90 degrees from a vector: there is no cosine to work out.

    Half of them are so to the light, and dark, half to the peak of the highlight.
    """
    rng = np.random.default_rng(6)
    count = 200
    left = rng.uniform(0, 360, count)
    around = np.radians([left, left + rng.uniform(-149, 149, count)])
    ends = quantise(np.stack([np.cos(around), np.sin(around), 0 * around], axis=-1))
    ends[:, ::2] = np.roll(ends[:, ::2], 1, axis=-1)
    place = np.zeros(count, dtype=np.int64)
    spans = Spans(place, place, rng.integers(1, 40, count), *ends)
    peak, light = ONE * np.eye(3, dtype=np.int64)[[0, 2], np.newaxis]
    constants = constants_of(peak[0], 1)
    constants = replace(constants, direction=light, specular=Intensity.color(np.array([[3.9, 3.8, 3.7]])))
    pixels = unit.parameters.compute(spans, constants)
    assert_equals_twin(unit, spans, constants, pixels, output_stalls=rng.random(1009) < 0.4)


def longer(code):
    """How much longer a code is than that of length 1."""
    return np.linalg.norm(code, axis=-1) - ONE


def test_words_at_their_ends(unit):
    """Spans for which the words of the setup are as large as rounding makes those of unit vectors.

    Normals are opposite, and 60 and 90 degrees apart; the vector is a normal, along the step from one to the
    next, and at right angles to a span's middle.
    """
    rng = np.random.default_rng(18)

    def rounded(about, count):
        return np.rint(normalise(about + rng.uniform(-0.002, 0.002, (count, 3))) * ONE).astype(int)

    codes = rounded(np.sqrt(1 / 3), 100_000)
    vector = codes[np.argmax(longer(codes))]
    about = normalise(vector)
    # Of a step by one in each component at most one end is a unit vector's code but for its last bits.
    step = np.floor(normalise(vector + rng.integers(-100, 101, (200_000, 3))) * ONE).astype(int)
    step = step[np.argsort(np.abs(longer(step) + np.sqrt(3) / 2))[:40]]
    codes = (rounded(np.array(side) / 3, 200_000) for side in ((2, 2, 1), (1, -2, 2)))
    first, second = (code[np.argsort(-longer(code))[:1000]] for code in codes)
    tie = np.argsort(np.abs(first @ second.T), axis=None)[:400]
    first, second = first[tie // 1000], second[tie % 1000]
    middle, side = (normalise(np.cross(about, rng.normal(size=(400, 3)))) for _ in range(2))
    half = np.radians(10.0 ** rng.uniform(-1, 1.5, (400, 1)))
    sixty = np.cos(np.pi / 3) * side + np.sin(np.pi / 3) * np.cross(side, about)
    pairs = [
        (quantise(side[:1]), -quantise(side[:1])),
        (step, step + 1),
        (first, second),
        tuple(quantise(middle * np.cos(turn) + about * np.sin(turn)) for turn in (-half, half)),
        (quantise(side), quantise(sixty)),
        (vector[np.newaxis], vector[np.newaxis]),
        (quantise(side[1:2]), quantise(sixty[1:2])),
    ]
    ends = (np.concatenate(end) for end in zip(*pairs, strict=True))
    place = np.zeros(sum(len(left) for left, _ in pairs), dtype=np.int64)
    spans = Spans(place, place, place + 3, *ends)
    constants = constants_of(vector, 1)
    assert_equals_twin(unit, spans, constants, unit.parameters.compute(spans, constants))
