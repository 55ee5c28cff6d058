"""The angular method in the pipeline: RTL against its twin, where the last bits of its cosines decide."""

from dataclasses import replace

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.geometry import normalise
from golden.highlight_cosine import HighlightCosine
from golden.intensity import Intensity
from golden.pipeline import ShadingPipeline, Spans
from golden.unit_vector import COMPONENT, ONE, quantise
from hdl.pipeline import ShadingPipelineUnit

from .edges import SHADE, assert_equals_twin, constants_of, highlight_edges, spans_on_edges


@pytest.fixture(scope="module")
def unit():
    return ShadingPipelineUnit(ShadingPipeline("angular"))


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
        assert_equals_twin(unit, spans, constants_of(code, exponent), rng.random(1009) < 0.4)


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
    assert_equals_twin(unit, spans, constants, rng.random(1009) < 0.4)
