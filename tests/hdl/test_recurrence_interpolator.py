"""The recurrence method in the pipeline: RTL against its twin, pixel by pixel and clock by clock."""

import numpy as np
import pytest

from golden.frame_constants import FrameConstants
from golden.intensity import Intensity
from golden.pipeline import METHODS, ShadingPipeline, Spans
from golden.recurrence_interpolator import RecurrenceInterpolator
from golden.unit_vector import quantise
from hdl.pipeline import ShadingPipelineUnit
from sim.engine import simulate


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


def run(unit, spans, constants, pixels, **stalls):
    beats = {name: getattr(spans, name) for name in ("x", "y", "length", "normal_left", "normal_right")}
    result = simulate(unit, beats, count=len(pixels.x), write=constants.writes(), engine="auto", **stalls)
    for name, expected in (("x", pixels.x), ("y", pixels.y), ("last", pixels.last)):
        np.testing.assert_array_equal(result.beats[name], expected)
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(result.beats[name], pixels.color[:, channel])
    assert result.status["wide_spans"] == pixels.wide_spans
    return result


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
    parameters = ShadingPipeline(method, model, lights)
    unit = ShadingPipelineUnit(parameters, interval)
    assert (unit.setup_interval, unit.clocks_per_pixel) == (interval, 1)
    lengths = np.r_[rng.integers(0, 40, 150), np.full(30, 1), np.full(30, 7), [4095, 1, 1], np.arange(1, 10)]
    for exponent in (1, 1000):
        spans = make_spans(rng, lengths, normal_pairs, 10.0 ** rng.uniform(-2, 2, len(lengths)))
        constants = make_constants(rng, lights, exponent, spans.normal_left[:lights])
        pixels = parameters.compute(spans, constants)
        assert len(np.unique(pixels.color)) > 100
        assert 0 < pixels.wide_spans < 20
        result = run(unit, spans, constants, pixels)
        shown = lengths[lengths > 0]
        starts = np.cumsum(shown) - shown
        first = result.clocks[starts]
        assert np.all(np.diff(first) <= np.maximum(shown[:-1], interval))
        assert np.all(np.delete(np.diff(result.clocks), starts[1:] - 1) == 1)
        if lengths[0]:
            assert first[0] == result.input_clocks[0] + unit.latency
        for input_share, output_share in ((0.4, 0.4), (0.95, 0), (0, 0.7)):
            stalls = {
                "input_stalls": rng.random(997) < input_share,
                "output_stalls": rng.random(1009) < output_share,
            }
            run(unit, spans, constants, pixels, **stalls)
