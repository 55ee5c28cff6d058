"""Several pipelines: a scanline belongs to one of them, and together they give the pixels of one."""

from dataclasses import fields

import numpy as np
import pytest

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import Spans
from blysk.golden.pixel_pipelines import PIPES, PixelPipelines
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise


def frame(rng, count=300):
    """Spans on any scanline, some of them empty, and constants of one light."""
    normals = normalise(rng.normal(size=(count, 3)))
    right = normalise(normals + rng.normal(scale=0.1, size=(count, 3)))
    length = rng.integers(0, 9, count)
    spans = Spans(
        rng.integers(0, 60, count), rng.integers(0, 40, count), length, quantise(normals), quantise(right)
    )
    vectors = (quantise(normalise(rng.normal(size=(1, 3)))) for _ in range(2))
    colors = rng.integers(0, 255 * 64, (2, 1, 3))
    return spans, FrameConstants(20, rng.integers(0, 2000, 3), *vectors, *colors)


def rows(pixels):
    return np.column_stack([pixels.y, pixels.x, pixels.color, pixels.last])


@pytest.mark.parametrize("pipes", PIPES)
def test_pipelines_together_give_the_pixels_of_one(pipes):
    """In the order of the spans within each scanline; and the counts are sums."""
    several = PixelPipelines(preset(model="cosquad"), pipes)
    spans, constants = frame(np.random.default_rng(pipes))
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
        PixelPipelines(preset(model="cosquad"), pipes)


def test_no_more_pipelines_than_scanlines():
    PixelPipelines(preset(model="cosquad", y_bits=2), 4)
    with pytest.raises(ValueError, match="number of scanlines, 4, not 8"):
        PixelPipelines(preset(model="cosquad", y_bits=2), 8)
