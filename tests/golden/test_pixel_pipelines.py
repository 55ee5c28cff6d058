"""Several pipelines: each scanline belongs to one pipeline, and together they give the pixels of a single
pipeline."""

from dataclasses import fields

import numpy as np
import pytest

from blysk.bench.units.pipeline_spans import any_constants, any_spans
from blysk.golden.build import PIPES
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.presets import preset


def rows(pixels):
    return np.column_stack([pixels.y, pixels.x, pixels.color, pixels.last])


@pytest.mark.parametrize("pipes", PIPES)
def test_pipelines_together_give_the_pixels_of_one(pipes):
    """Within each scanline pixels are in the order of the spans. Counters are sums."""
    rng, design = np.random.default_rng(pipes), preset(y_bits=5)
    several = PixelPipelines(design.built(pipes=pipes))
    spans = any_spans(rng, design, rng.integers(0, 9, 300))
    constants = any_constants(rng, design, spans)
    one, each = several.compute(spans, constants), several.compute_each(spans, constants)
    assert len(each) == pipes
    for pipe, pixels in enumerate(each):
        assert np.all(pixels.y % pipes == pipe)
    expected, found = rows(one), np.concatenate([rows(pixels) for pixels in each])
    for y in np.unique(spans.y):
        np.testing.assert_array_equal(found[found[:, 0] == y], expected[expected[:, 0] == y])
    assert len(found) == len(expected)
    for name in [field.name for field in fields(one) if field.name.endswith("spans")]:
        assert getattr(one, name) == sum(getattr(pixels, name) for pixels in each)


@pytest.mark.parametrize("pipes", [0, 3, 6, 16, -1])
def test_number_of_pipelines_is_checked(pipes):
    with pytest.raises(ValueError, match=f"one of 1, 2, 4, 8, not {pipes}"):
        preset().built(pipes=pipes)


def test_no_more_pipelines_than_scanlines():
    PixelPipelines(preset(y_bits=2).built(pipes=4))
    with pytest.raises(ValueError, match="number of scanlines, 4, not 8"):
        PixelPipelines(preset(y_bits=2).built(pipes=8))
