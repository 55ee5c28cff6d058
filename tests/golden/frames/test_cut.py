"""Cutting spans by angle, against the true normals of the uncut spans and float64."""

from dataclasses import fields, replace

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_by_angle
from blysk.golden.frames.prepare import quantise_spans, sort_by_material
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise

from .cuts import angles, line_at, origins, raster_of

WIDTH = 4095
EPSILON = 2.0**-53


@pytest.fixture
def out_of_range():
    """Spans of 0 to 179.9 degrees and 1 to 60 pixels, and their parts."""
    rng = np.random.default_rng(11)
    left, right = map(normalise, pairs_at(rng, 5000, rng.uniform(0, 179.9, 5000)))
    raster = raster_of(rng, left, right, rng.integers(1, 60, 5000, endpoint=True))
    return raster, *cut_by_angle(raster, MAX_SPAN_ANGLE)


def test_fragments_and_pixels_stay(out_of_range):
    raster, cut, _ = out_of_range
    assert np.array_equal(cut.pixel, raster.pixel)
    assert np.array_equal(cut.visible, raster.visible)
    assert np.array_equal(cut.y[cut.span] * WIDTH + cut.x[cut.span] + cut.offset, raster.pixel)
    assert np.array_equal(np.bincount(cut.span), cut.length)
    assert (np.diff(cut.span) >= 0).all()
    origin, _ = origins(raster, cut)
    assert np.array_equal(np.bincount(origin, weights=cut.length), raster.length)
    for name in ("triangle", "back", "y"):
        assert np.array_equal(getattr(cut, name), getattr(raster, name)[origin])
    for name in ("triangles", "degenerate", "culled", "outside", "uncovered", "hidden_spans"):
        assert getattr(cut, name) == getattr(raster, name)
    np.testing.assert_allclose(cut.weights_left, 1, rtol=1e-12)


def test_every_part_is_narrow_or_one_pixel(out_of_range):
    _, cut, _ = out_of_range
    # The comparison of cosines is exact to 2**-52, an angle of 45 degrees to 2**-52 / sin 45 radians.
    assert (angles(cut)[cut.length > 1] <= MAX_SPAN_ANGLE + 1e-12).all()


def test_normals_at_cuts_are_true(out_of_range):
    """At cuts, normals and lengths are those of the line between the whole span's ends with their lengths."""
    raster, cut, _ = out_of_range
    origin, first = origins(raster, cut)
    for offset, side in ((first, "left"), (first + cut.length - 1, "right")):
        line = line_at(raster, origin, offset / np.maximum(raster.length[origin] - 1, 1))
        size = np.linalg.norm(line, axis=1)
        largest = np.maximum(raster.magnitude_left, raster.magnitude_right)[origin]
        np.testing.assert_allclose(getattr(cut, f"magnitude_{side}"), size, rtol=0, atol=1e-14)
        # Each term is rounded three times on both sides. Division by a short line makes this larger.
        error = np.abs(getattr(cut, f"normal_{side}") - line / size[:, np.newaxis]).max(axis=1)
        assert (error <= EPSILON * (8 * largest / size + 8)).all()


def test_parts_have_the_line_of_the_whole(out_of_range):
    """At every pixel the parts have the line of the whole span.

    So the true normal in the middle of a part is the whole span's normal there.
    """
    raster, cut, _ = out_of_range
    t = [r.offset / np.maximum(r.length - 1, 1)[r.span] for r in (raster, cut)]
    whole, parts = (line_at(r, r.span, at) for r, at in zip((raster, cut), t, strict=True))
    np.testing.assert_allclose(parts, whole, rtol=0, atol=1e-13)


def test_counts(out_of_range):
    raster, cut, count = out_of_range
    assert count == np.count_nonzero((angles(raster) > MAX_SPAN_ANGLE) & (raster.length > 1))
    origin, _ = origins(raster, cut)
    assert count == np.count_nonzero(np.bincount(origin) > 1)


def quantised(raster):
    return quantise_spans(raster, np.zeros(1 + raster.triangle.max(initial=0), dtype=np.int64))


def test_narrow_spans_are_untouched():
    rng = np.random.default_rng(12)
    left, right = pairs_at(rng, 2000, rng.uniform(0, 44.999999, 2000))
    raster = raster_of(rng, left, right, rng.integers(1, 30, 2000))
    cut, count = cut_by_angle(raster, MAX_SPAN_ANGLE)
    assert count == 0
    for name in ("x", "y", "length", "triangle", "normal_left", "normal_right", "span", "offset", "pixel"):
        assert np.array_equal(getattr(cut, name), getattr(raster, name)), name


def test_no_span_at_all():
    rng = np.random.default_rng(13)
    cut, count = cut_by_angle(raster_of(rng, np.empty((0, 3)), np.empty((0, 3)), 0), MAX_SPAN_ANGLE)
    assert (count, len(cut.length), len(quantised(cut))) == (0, 0, 0)


@pytest.mark.parametrize("length", [1, 2, 3, 4, 5, 4094, 4095])
def test_opposite_normals(length):
    """With opposite normals the curve jumps at its middle.

    In an odd span a pixel is there, and any unit normal is right.
    """
    rng = np.random.default_rng(14)
    left = np.eye(3)[:1]
    raster = raster_of(rng, left, -left, length)
    cut, count = cut_by_angle(raster, MAX_SPAN_ANGLE)
    assert count == (length > 1)
    # Halving comes closer and closer to the jump.
    assert len(cut.length) <= 1 + length.bit_length()
    assert (angles(cut)[cut.length > 1] == 0).all()
    ends = np.concatenate([cut.normal_left, cut.normal_right])
    assert (np.linalg.norm(ends, axis=1) == 1).all()
    if length > 1:
        assert np.array_equal(cut.normal_left[0], left[0])
        assert np.array_equal(cut.normal_right[-1], -left[0])


def test_the_pipeline_flags_no_span_after_the_cut():
    rng = np.random.default_rng(15)
    angle = np.concatenate(
        [
            rng.uniform(0, 180, 40_000),
            MAX_SPAN_ANGLE + rng.normal(0, 1e-4, 30_000),
            2 * MAX_SPAN_ANGLE + rng.normal(0, 1e-4, 28_000),
            np.full(1000, MAX_SPAN_ANGLE),
            np.full(1000, 180.0),
        ]
    )
    left, right = pairs_at(rng, len(angle), angle)
    raster = raster_of(rng, left, right, rng.integers(1, 12, len(angle), endpoint=True))

    def flagged(raster):
        spans = quantised(raster)
        _, out_of_range = MiddleNormal().compute(
            Fixed(COMPONENT, spans.normal_left), Fixed(COMPONENT, spans.normal_right)
        )
        return np.count_nonzero(out_of_range)

    cut, _ = cut_by_angle(raster, MAX_SPAN_ANGLE)
    assert flagged(cut) == 0
    assert flagged(raster) > 30_000
    vector = np.array([[0, 0, ONE]])
    constants = FrameConstants(10, np.zeros(3, int), vector, vector, np.zeros((1, 3), int), vector * 0)
    assert preset("quadratic", "cosquad").compute(quantised(cut), constants).out_of_range_spans == 0


def test_quantised_ends():
    rng = np.random.default_rng(16)
    left = np.array([[1.0, 0, 0], [0.6, 0, 0.8]])
    raster = raster_of(rng, left, -left[::-1], 7)
    spans = quantised(raster)
    assert spans.normal_left[0].tolist() == [ONE, 0, 0]
    for codes, normals in ((spans.normal_left, left), (spans.normal_right, -left[::-1])):
        assert np.abs(codes / ONE - normals).max() < 2.0**-17
    for name in ("x", "y", "length"):
        assert np.array_equal(getattr(spans, name), getattr(raster, name))


@pytest.mark.parametrize("materials", [2, 7, 1000])
@pytest.mark.parametrize("cut", [False, True])
def test_sorted_spans_are_a_permutation(materials, cut):
    """Every span and fragment occurs once with all of its data, in the given order within a material.

    x and the pixel are not read, so they hold the earlier numbers of spans and fragments.
    """
    rng = np.random.default_rng(17)
    left, right = map(normalise, pairs_at(rng, 3000, rng.uniform(0, 90, 3000)))
    raster = raster_of(rng, left, right, rng.integers(1, 30, 3000))
    raster = replace(raster, level=rng.integers(0, 9, 3000).astype(np.int8))
    if cut:
        raster, _ = cut_by_angle(raster, MAX_SPAN_ANGLE)
    count = len(raster.length)
    raster = replace(raster, x=np.arange(count), pixel=np.arange(len(raster.span)))
    material = rng.integers(0, materials, 1000)
    ordered = sort_by_material(raster, material)

    spans, fragments = ordered.x, ordered.pixel
    assert np.array_equal(np.sort(spans), np.arange(count))
    assert np.array_equal(np.sort(fragments), np.arange(len(raster.span)))
    assert not np.array_equal(spans, np.arange(count))
    for name in (field.name for field in fields(raster)):
        given, moved = getattr(raster, name), getattr(ordered, name)
        if name in ("span", "offset", "visible"):
            expected = given[fragments]
            moved = spans[moved] if name == "span" else moved
        elif np.ndim(given):
            expected = given[spans]
        else:
            expected = given
        if name != "pixel":
            assert np.array_equal(moved, expected), name
        assert np.asarray(getattr(ordered, name)).dtype == np.asarray(given).dtype, name

    of_span = material[ordered.triangle]
    steps = np.diff(of_span)
    assert (steps >= 0).all()
    assert (np.diff(spans)[steps == 0] > 0).all()
    # The fragments of a span stay together, from its first to its last.
    assert np.array_equal(ordered.span, np.repeat(np.arange(count), ordered.length))
    start = np.cumsum(ordered.length) - ordered.length
    assert np.array_equal(ordered.offset, np.arange(len(ordered.span)) - start[ordered.span])


def test_spans_in_order_are_untouched():
    rng = np.random.default_rng(18)
    raster = raster_of(rng, *map(normalise, pairs_at(rng, 100, 5.0)), 3)
    assert sort_by_material(raster, np.zeros(1000, int)) is raster
    raster = replace(raster, triangle=np.sort(raster.triangle))
    assert sort_by_material(raster, np.arange(1000) // 100) is raster
    empty = raster_of(rng, np.empty((0, 3)), np.empty((0, 3)), 0)
    assert len(sort_by_material(empty, np.arange(1000)).length) == 0


def test_spans_have_the_material_of_their_triangle():
    rng = np.random.default_rng(19)
    raster = raster_of(rng, *map(normalise, pairs_at(rng, 100, 5.0)), 3)
    material = rng.integers(0, 9, 1000)
    for given in (raster, sort_by_material(raster, material)):
        assert np.array_equal(quantise_spans(given, material).material, material[given.triangle])
