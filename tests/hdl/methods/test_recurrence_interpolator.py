"""The recurrence method in the pipeline: RTL against its twin, pixel by pixel and clock by clock."""

import functools

import numpy as np
import pytest

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.pipeline import ShadingPipelineUnit

from ..edges import SHADE, constants_of, highlight_edges, spans_on_edges
from ..pixels import assert_equals_twin


def make_spans(rng, lengths, normal_pairs, degrees):
    lengths = np.asarray(lengths)
    left, right = normal_pairs(rng, len(lengths), degrees)
    zeros = np.zeros(len(lengths), dtype=np.int64)
    return Spans(zeros, zeros + 5, lengths, quantise(left), quantise(right))


def make_constants(rng, lights, exponent, halfway):
    # The light on the side of the highlight, so that it shows.
    halfway = halfway / np.linalg.norm(halfway, axis=-1, keepdims=True)
    vectors = np.stack([halfway + rng.uniform(-0.5, 0.5, halfway.shape), halfway])
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return FrameConstants(
        exponent=exponent,
        ambient=Intensity.color(rng.uniform(0, 0.2, 3)),
        direction=quantise(vectors[0]),
        halfway=quantise(vectors[1]),
        diffuse=Intensity.color(rng.uniform(0.3, 1, (lights, 3))),
        specular=Intensity.color(rng.uniform(0.3, 1, (lights, 3))),
    )


@functools.cache
def unit_of(method, model, lights, interval):
    """One for all tests, as it is made and compiled but once."""
    return ShadingPipelineUnit(preset(method, model, lights, setup_interval=interval))


@pytest.mark.parametrize(
    ("method", "model", "lights", "interval"),
    [
        ("recurrence", "cosquad", 1, 4),
        pytest.param("recurrence", "blinn", 2, 4, marks=pytest.mark.long),
        pytest.param("recurrence", "blinn", 1, 2, marks=pytest.mark.long),
        pytest.param("recurrence-direct", "cosquad", 1, 4, marks=pytest.mark.long),
    ],
)
def test_equals_twin(normal_pairs, monkeypatch, method, model, lights, interval):
    """Under stalls; and a span costs its length or the setup interval, whichever is more."""
    # Unstable, so no method for use.
    monkeypatch.setitem(METHODS, "recurrence-direct", RecurrenceInterpolator("direct"))
    rng = np.random.default_rng(lights)
    unit = unit_of(method, model, lights, interval)
    parameters = unit.parameters
    assert (unit.setup_interval, unit.cycles_per_pixel) == (interval, 1)
    lengths = np.r_[rng.integers(0, 40, 150), np.full(30, 1), np.full(30, 7), [4095, 1, 1], np.arange(1, 10)]
    for exponent in (1, 1000):
        spans = make_spans(rng, lengths, normal_pairs, 10.0 ** rng.uniform(-2, 2, len(lengths)))
        constants = make_constants(rng, lights, exponent, spans.normal_left[:lights])
        pixels = parameters.compute(spans, constants)
        assert len(np.unique(pixels.color)) > 100
        assert 0 < pixels.out_of_range_spans < 20
        result = assert_equals_twin(unit, spans, constants, pixels)
        shown = lengths[lengths > 0]
        starts = np.cumsum(shown) - shown
        first = result.cycles[starts]
        assert np.all(np.diff(first) <= np.maximum(shown[:-1], interval))
        assert np.all(np.delete(np.diff(result.cycles), starts[1:] - 1) == 1)
        if lengths[0]:
            assert first[0] == result.input_cycles[0] + unit.latency
        for input_share, output_share in ((0.4, 0.4), (0.95, 0), (0, 0.7)):
            stalls = {
                "input_stalls": rng.random(997) < input_share,
                "output_stalls": rng.random(1009) < output_share,
            }
            assert_equals_twin(unit, spans, constants, pixels, **stalls)


def test_last_bits_count():
    """What is worked out for a pixel counts to the last of 44 fraction bits, where its cosine is on an edge.

    That is where light and shade meet, from either side, or, for N.H, where the colour changes.
    """
    rng = np.random.default_rng(5)
    unit = unit_of("recurrence", "cosquad", 1, 4)
    setup = unit.parameters.interpolator.setup
    code = quantise(normalise(rng.normal(size=3)))
    count = 12000
    # The words of a narrow span are the finest; a wide one needs all of its tables.
    angles = 90 * np.r_[10.0 ** rng.uniform(-4.5, -2.5, count), rng.uniform(0.03, 1, count)]
    steps = np.r_[rng.integers(0, 25, count), rng.integers(3, 13, count)]
    for vector, edges, exponent in (
        (code, SHADE, 1),
        (~code, SHADE, 1),
        (code, highlight_edges(unit.parameters, 1000), 1000),
    ):

        def cosine(left, right, length, steps, vector=vector):
            *start, _ = setup.compute(*(Fixed(COMPONENT, codes) for codes in (left, right, vector)), length)
            states = setup.recurrence.states(*start, steps.max() + 1) + setup.recurrence.exchange
            return np.ldexp(states.codes[steps, np.arange(len(steps))], 34 - states.format.fraction_bits)

        spans = spans_on_edges(rng, vector, edges, angles, steps, cosine)
        constants, stalls = constants_of(vector, exponent), rng.random(1009) < 0.2
        pixels = unit.parameters.compute(spans, constants)
        assert_equals_twin(unit, spans, constants, pixels, output_stalls=stalls)


def test_ends_of_the_words():
    """Words that are no unit vectors saturate as in the twin, and upset no span that follows."""
    rng = np.random.default_rng(8)
    unit, count = unit_of("recurrence", "cosquad", 1, 4), 200
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code], (3, count, 3))
    ends[:2, ::2] = quantise(normalise(rng.normal(size=(2, count // 2, 3))))
    place = np.zeros(count, dtype=np.int64)
    spans = Spans(place, place, rng.integers(1, 20, count), ends[0], ends[1])
    for code in ends[2, :2]:
        constants, stalls = constants_of(code, 1), rng.random(1009) < 0.2
        pixels = unit.parameters.compute(spans, constants)
        assert_equals_twin(unit, spans, constants, pixels, output_stalls=stalls)


def test_half_the_square_of_a_radian(normal_pairs):
    """It is 1/2 but for rounding, which brings the normalised word of some spans to 1."""
    rng = np.random.default_rng(19)
    unit = unit_of("recurrence", "cosquad", 1, 4)
    spans = make_spans(rng, rng.integers(1, 20, 100), normal_pairs, np.degrees(1))
    constants = make_constants(rng, 1, 20, spans.normal_left[:1])
    assert_equals_twin(unit, spans, constants, unit.parameters.compute(spans, constants))
