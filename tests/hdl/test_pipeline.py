"""The shading pipeline: RTL against its twin, pixel by pixel and clock by clock."""

import math

import numpy as np
import pytest

from golden.frame_constants import FrameConstants
from golden.intensity import Intensity
from golden.pipeline import ShadingPipeline, Spans
from golden.specular import SPECULAR_MODELS
from golden.unit_vector import quantise
from hdl.pipeline import ShadingPipelineUnit
from sim.engine import simulate


def make_spans(rng, lengths, normal_pairs, largest_angle=44.0):
    lengths = np.asarray(lengths)
    left, right = normal_pairs(rng, len(lengths), rng.uniform(0, largest_angle, len(lengths)))
    return Spans(
        x=rng.integers(0, 4096 - lengths + (lengths == 0) * -1),
        y=rng.integers(0, 4096, len(lengths)),
        length=lengths,
        normal_left=quantise(left),
        normal_right=quantise(right),
    )


def make_constants(rng, lights, exponent=20, brightness=1.0):
    vectors = rng.normal(size=(2, lights, 3))
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return FrameConstants(
        exponent=exponent,
        ambient=Intensity.color(rng.uniform(0, 0.2, 3)),
        direction=quantise(vectors[0]),
        halfway=quantise(vectors[1]),
        diffuse=Intensity.color(rng.uniform(0, brightness, (lights, 3))),
        specular=Intensity.color(rng.uniform(0, brightness, (lights, 3))),
    )


def beats_of(spans):
    return {name: getattr(spans, name) for name in ("x", "y", "length", "normal_left", "normal_right")}


def assert_pixels(run, pixels):
    np.testing.assert_array_equal(run.beats["x"], pixels.x)
    np.testing.assert_array_equal(run.beats["y"], pixels.y)
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(run.beats[name], pixels.color[:, channel])
    np.testing.assert_array_equal(run.beats["last"], pixels.last)


def run(unit, spans, constants, pixels, **options):
    options.setdefault("engine", "auto")
    return simulate(unit, beats_of(spans), count=len(pixels.x), write=constants.writes(), **options)


@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("lights", [1, 3])
def test_equals_twin_under_stalls(model, lights, normal_pairs):
    rng = np.random.default_rng(lights)
    parameters = ShadingPipeline(model=model, lights=lights)
    unit = ShadingPipelineUnit(parameters)
    for exponent in (1, 30, 1000):
        spans = make_spans(rng, rng.integers(0, 60, 600), normal_pairs)
        constants = make_constants(rng, lights, exponent, brightness=rng.choice([1.0, 8.0]))
        pixels = parameters.compute(spans, constants)
        assert len(np.unique(pixels.color)) > 100
        for input_share, output_share in ((0, 0), (0.5, 0.5), (0.95, 0), (0, 0.7)):
            result = run(
                unit,
                spans,
                constants,
                pixels,
                input_stalls=rng.random(997) < input_share,
                output_stalls=rng.random(1009) < output_share,
            )
            assert_pixels(result, pixels)
            assert result.status["wide_spans"] == pixels.wide_spans == 0
            assert result.status["empty_spans"] == np.count_nonzero(spans.length == 0)
            assert not result.status["overrun"]


def test_sixteen_lights(normal_pairs):
    rng = np.random.default_rng(16)
    parameters = ShadingPipeline(lights=16)
    spans = make_spans(rng, rng.integers(1, 60, 100), normal_pairs)
    constants = make_constants(rng, 16, brightness=0.1)
    pixels = parameters.compute(spans, constants)
    assert_pixels(run(ShadingPipelineUnit(parameters), spans, constants, pixels), pixels)


@pytest.mark.parametrize("lights", [1, 3])
def test_clocks(lights, normal_pairs):
    """One pixel a clock; a span costs its length or the setup interval, whichever is more, and no more.

    Spans that the buffer holds ready cost their length alone.
    """
    rng = np.random.default_rng(7)
    lengths = np.r_[rng.integers(1, 40, 500), np.full(50, 1), np.full(50, 7), [4095, 4095, 1, 1]]
    parameters = ShadingPipeline(lights=lights)
    unit = ShadingPipelineUnit(parameters)
    spans = make_spans(rng, lengths, normal_pairs)
    constants = make_constants(rng, lights)
    pixels = parameters.compute(spans, constants)
    result = run(unit, spans, constants, pixels)
    starts = np.cumsum(lengths) - lengths
    first_pixels = result.clocks[starts]
    assert first_pixels[0] == result.input_clocks[0] + unit.latency
    assert unit.latency == 66 + math.ceil(math.log2(2 * lights + 1))
    assert unit.setup_interval <= 8
    taken = np.diff(first_pixels)
    assert np.all(taken >= lengths[:-1])
    assert np.all(taken <= np.maximum(lengths[:-1], unit.setup_interval))
    long_enough = lengths[:-1] >= unit.setup_interval
    np.testing.assert_array_equal(taken[long_enough], lengths[:-1][long_enough])
    # In a long run of short spans each costs the setup interval.
    assert np.all(taken[510:548] == unit.setup_interval)
    within = np.delete(np.diff(result.clocks), starts[1:] - 1)
    assert np.all(within == 1)


def test_engines_agree(normal_pairs):
    rng = np.random.default_rng(8)
    parameters = ShadingPipeline(model="cosquad_lin", lights=2)
    spans = make_spans(rng, rng.integers(0, 12, 60), normal_pairs, largest_angle=90)
    constants = make_constants(rng, 2)
    pixels = parameters.compute(spans, constants)
    assert pixels.wide_spans > 10
    stalls = {"input_stalls": rng.random(97) < 0.5, "output_stalls": rng.random(89) < 0.4}
    unit = ShadingPipelineUnit(parameters)
    slow, fast = (
        run(unit, spans, constants, pixels, engine=engine, **stalls) for engine in ("pysim", "auto")
    )
    assert_pixels(slow, pixels)
    assert_pixels(fast, pixels)
    np.testing.assert_array_equal(slow.clocks, fast.clocks)
    np.testing.assert_array_equal(slow.input_clocks, fast.input_clocks)
    assert slow.status == fast.status
    assert slow.status["wide_spans"] == pixels.wide_spans


def test_wide_spans_are_counted(normal_pairs):
    rng = np.random.default_rng(9)
    parameters = ShadingPipeline()
    for angle, wide in ((0.0, False), (44.99, False), (45.1, True), (90.0, True), (180.0, True)):
        left, right = normal_pairs(rng, 50, angle)
        spans = Spans(np.zeros(50, int), np.zeros(50, int), np.full(50, 9), quantise(left), quantise(right))
        constants = make_constants(rng, 1)
        pixels = parameters.compute(spans, constants)
        result = run(ShadingPipelineUnit(parameters), spans, constants, pixels)
        assert_pixels(result, pixels)
        assert result.status["wide_spans"] == pixels.wide_spans == 50 * wide


def test_span_past_the_last_column_is_flagged(normal_pairs):
    rng = np.random.default_rng(10)
    parameters = ShadingPipeline()
    spans = make_spans(rng, [10, 10], normal_pairs)
    for x, flagged in ((4086, 0), (4087, 1)):
        spans.x[:] = x
        constants = make_constants(rng, 1)
        pixels = parameters.compute(spans, constants)
        result = run(ShadingPipelineUnit(parameters), spans, constants, pixels)
        assert_pixels(result, pixels)
        assert result.status["overrun"] == flagged
