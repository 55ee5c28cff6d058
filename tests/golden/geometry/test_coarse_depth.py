"""Coarse depth test against the depths of every pixel: no visible pixel is dropped."""

import numpy as np
import pytest

import blysk
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.geometry.coarse_depth import BLOCKS, CoarseDepth
from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.number.spans import pixels_of
from blysk.golden.presets import preset
from blysk.golden.render import Renderer


def spans_of(rng, count, width, height, spread):
    """Spans anywhere in a picture. Their depths differ by at most ``spread`` of the whole range."""
    length = rng.integers(1, min(width, 30) + 1, count)
    left, right = rng.integers(0, max(int(spread * 2**24), 2), (2, count)) << 9
    return {
        "x": rng.integers(0, width - length + 1),
        "y": rng.integers(0, height, count),
        "length": length,
        "depth": left,
        "depth_step": (right - left) // np.maximum(length - 1, 1),
    }


def hidden_of_pixels(spans):
    """Whether the depth test draws no pixel of a span, and the number of pixels of each span."""
    length = spans["length"]
    span, k = pixels_of(length)
    test = DepthTester()
    depth = test.depths(length, spans["depth"], spans["depth_step"])
    drawn = test.drawn((spans["y"][span] << 12) + spans["x"][span] + k, depth)
    return np.bincount(span, weights=drawn, minlength=len(length)) == 0


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("bits", [8, 12, 24])
@pytest.mark.parametrize("spread", [1.0, 2.0**-11])
def test_what_is_dropped_is_hidden(block, bits, spread):
    """In small pictures of odd widths, each with many layers of spans, only hidden spans are dropped, and
    most of them are."""
    rng = np.random.default_rng(block + bits)
    found = possible = 0
    for width, height in ((1, 3), (7, 2), (33, 1), (64, 2)):
        spans = spans_of(rng, 1500, width, height, spread)
        dropped = CoarseDepth(width, height, block, bits).compute(**spans)
        hidden = hidden_of_pixels(spans)
        assert not (dropped & ~hidden).any()
        found, possible = found + dropped.sum(), possible + hidden.sum()
    # Few upper bits cannot tell depths apart that differ by 2^-11 of the whole range.
    assert found > 0.5 * possible or (bits < 24 and spread < 1)


def test_pictures_begin_cleared():
    """Several pictures give as many hidden spans as if each were tested alone."""
    rng = np.random.default_rng(3)
    test = CoarseDepth(40, 3)
    spans = spans_of(rng, 600, 40, 3, 1.0)
    picture = np.repeat([1, 0, 1], 200)
    parts = [test.compute(**{k: v[of] for k, v in spans.items()}) for of in np.split(np.arange(600), 3)]
    np.testing.assert_array_equal(test.compute(**spans, picture=picture), np.concatenate(parts))
    assert not np.array_equal(test.compute(**spans), np.concatenate(parts))


def test_spans_that_go_out_of_the_picture_are_kept_and_change_nothing():
    """The blocks of these spans would be those of the next scanline, or of the first."""
    rng = np.random.default_rng(4)
    test, spans = CoarseDepth(40, 3), spans_of(rng, 600, 40, 3, 1.0)
    beside, below = rng.random((2, 600)) < 0.2
    spans["x"], spans["y"] = spans["x"] + 40 * beside, spans["y"] + 3 * below
    spans["length"][::50] = 64
    outside = (spans["x"] + spans["length"] > 40) | below
    dropped = test.compute(**spans)
    assert not dropped[outside].any()
    alone = test.compute(**{name: values[~outside] for name, values in spans.items()})
    np.testing.assert_array_equal(dropped[~outside], alone)
    assert alone.mean() > 0.2


@pytest.mark.parametrize(("back_faces", "least"), [("flip", 0.3), ("cull", 0.005)])
def test_frames_are_the_same(back_faces, least):
    """The picture of a teapot is the same to the bit, with fewer pixels shaded."""
    scene = blysk.scene("teapot", triangles=1000, size=(160, 120), back_faces=back_faces)
    design = preset("renormalise", "blinn")
    plain = triangle_frame(scene, Renderer(design))
    frame = triangle_frame(scene, Renderer(design.built(top="render", coarse=CoarseDepth(160, 120))))
    np.testing.assert_array_equal(frame.image, plain.image)
    np.testing.assert_array_equal(frame.owner, plain.owner)
    dropped = frame.counts["dropped"]
    assert dropped + frame.counts["pixels"] == plain.counts["pixels"]
    assert dropped > least * plain.counts["pixels"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((0, 4), "width and height must be 1 to 4096, not 0 and 4"),
        ((4, 4, 5), "block must be one of 4, 8, 16, not 5"),
        ((4, 4, 8, 7), "depth_bits must be 8 to 24, not 7"),
        ((4, 4, 8, 12, 9), "tag_bits must be 2 to 8, not 9"),
    ],
)
def test_bad_options_are_refused(options, says):
    with pytest.raises(ValueError, match=f"^{says}$"):
        CoarseDepth(*options)
