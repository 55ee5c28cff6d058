"""Pieces of spans for a method that takes vectors, against exact values of N/W and depth along them."""

import numpy as np
import pytest

from blysk.bench.units.triangles import random_triangles
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.geometry.span_attributes import (
    SPAN_DEPTH,
    SPAN_NORMAL,
    SPAN_STEP,
    SpanAttributes,
    WholeSpans,
)
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import FrameSettings
from blysk.golden.methods.quotient_interpolator import QuotientInterpolator
from blysk.golden.number.fixed import SQ, Fixed

FRAME = FrameSettings(-200, -200, 200, 200)


@pytest.fixture(scope="module")
def spans():
    """Spans of triangles with normals of any directions, and W in ratios of 100 and more."""
    rng = np.random.default_rng(3)
    triangles = random_triangles(rng, 600, size=60.0, spread=0.5)
    triangles.normal[::2] //= 1 << rng.integers(0, 8, (300, 3, 1))
    geometry = Geometry(vectors=True)
    drawn, rows, _, _ = geometry.rows(triangles, FRAME)
    return SpanAttributes(whole=True).compute(rows, geometry.planes(drawn, FRAME)[0])[0]


@pytest.fixture(scope="module")
def halved(spans):
    return SpanHalver().compute(spans)


def owners(spans, pieces):
    """The span of each piece. Pieces of a span follow each other."""
    span = np.repeat(np.arange(len(spans)), spans.length)
    return span[np.cumsum(pieces.length) - 1]


def nearest(left, right):
    """Least length on the way from one end to the other."""
    way = right - left
    square = (way**2).sum(axis=1)
    place = np.clip(-(left * way).sum(axis=1) / np.where(square, square, 1), 0, 1)
    return np.linalg.norm(left + place[:, np.newaxis] * way, axis=1)


def test_pieces_are_the_spans(spans, halved):
    """Pieces have every pixel once, in order from the long edge on.

    N/W and depth at both ends are those of the plane.
    """
    pieces, cut = halved
    span = owners(spans, pieces)
    np.testing.assert_array_equal(np.bincount(span, pieces.length), spans.length)
    assert 100 < cut == (np.bincount(span) > 1).sum() < len(spans) / 2
    first = np.where(
        pieces.turned, spans.x[span] + spans.length[span] - pieces.x - pieces.length, pieces.x - spans.x[span]
    )
    begins = np.r_[True, span[1:] != span[:-1]]
    np.testing.assert_array_equal(first, np.where(begins, 0, np.r_[0, (first + pieces.length)[:-1]]))
    for column, at in ((0, "left"), (pieces.length - 1, "right")):
        place = np.where(pieces.turned, pieces.length - 1 - column, column) + first
        exact = spans.near.codes[span] + place[:, np.newaxis] * spans.inward.codes[span]
        value = Fixed(SPAN_STEP, exact[:, :3]).truncate(SPAN_NORMAL.fraction_bits).saturate(SPAN_NORMAL)
        np.testing.assert_array_equal(getattr(pieces, at).codes, value.codes)
        depth = Fixed(SPAN_STEP, exact[:, 3]).saturate(SQ(1, 32)).codes + 2**32
        found = pieces.depth if at == "left" else pieces.depth_last
        np.testing.assert_array_equal(found.codes, depth)
        assert found.format == SPAN_DEPTH


def test_normals_stay_long(halved):
    """At every pixel of a piece N/W is 5/16 of its scale or more, which is more than the method needs."""
    pieces, _ = halved
    left, right = pieces.left.values, pieces.right.values
    largest = np.maximum(np.abs(left), np.abs(right)).max(axis=1)
    served = (pieces.length > 1) & (largest >= 2.0**-8)
    assert served.sum() > 3000
    scale = 2.0 ** np.floor(-np.log2(largest[served]))
    least = (nearest(left[served], right[served]) * scale).min()
    assert SpanHalver.SHORTEST <= least < 0.4
    assert SpanHalver.SHORTEST > QuotientInterpolator.SHORTEST
    # Steps fit the words of the method.
    step = np.abs(pieces.step.values[served]).max(axis=1) * scale
    assert 0.85 < step.max() < 1
    # Spans with both ends under 2^-8 are not cut for their length.
    short = (pieces.length > 1) & (largest < 2.0**-8)
    assert short.sum() > 100


def test_hardly_more_pieces_than_are_needed(spans, halved):
    """There are as many pieces as by halving with the exact rules (ratio 2 of the lengths, 90 degrees), or
    fewer."""
    left, right = spans.near.values[:, :3], spans.far.values[:, :3]
    length, count = spans.length, 0
    step = spans.inward.values[:, :3]
    while len(length):
        size = np.linalg.norm(left, axis=1), np.linalg.norm(right, axis=1)
        cut = (np.maximum(*size) > 2 * np.minimum(*size)) | ((left * right).sum(axis=1) < 0)
        cut &= (length > 1) & (np.abs([left, right]).max(axis=(0, 2)) >= 2.0**-8)
        count += (~cut).sum()
        left, right, step, length = left[cut], right[cut], step[cut], length[cut]
        half = (length + 1) // 2
        middle = left + (half - 1)[:, np.newaxis] * step
        left, right = np.concatenate([left, middle + step]), np.concatenate([middle, right])
        step, length = np.concatenate([step, step]), np.concatenate([half, length - half])
    assert len(spans) < len(halved[0]) < 1.02 * count


def test_attributes_have_their_format(spans):
    """Words with another binary point are refused. No spans give no pieces."""
    none = {
        name: getattr(spans, name)[:0]
        for name in ("x", "y", "length", "right", "flip", "material", "triangle")
    }
    words = {name: Fixed(SPAN_STEP, np.zeros((0, 4), dtype=np.int64)) for name in ("near", "far", "inward")}
    pieces, cut = SpanHalver().compute(WholeSpans(**none, **words))
    assert len(pieces) == cut == 0
    with pytest.raises(ValueError, match=r"attributes must be SQ\(2, 32\)"):
        SpanHalver().compute(WholeSpans(**none, **words | {"far": Fixed(SQ(1, 32), words["far"].codes)}))
