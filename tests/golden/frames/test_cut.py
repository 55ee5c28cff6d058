"""Cutting spans, by angle and by error, against the true normals of the spans that were cut and float64."""

from dataclasses import fields, replace

import numpy as np
import pytest

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_by_angle, cut_by_error, cut_spans
from blysk.golden.frames.local import local_values, middle_normals
from blysk.golden.frames.prepare import quantise_spans, sort_by_material
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import Raster, fragment_normals, rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import fragment_positions, shade_spans
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

METHOD = LocalChordInterpolator()
ONE_VALUE = (ONE / 2**17) ** 2
WIDTH = 4095
EPSILON = 2.0**-53


def raster_of(rng, left, right, length, spread=0.3):
    """Spans of these normals and lengths anywhere on a picture; a span of one pixel has one normal.

    Of the normals at the ends each is up to ``10^spread`` times as long, or as short, as 1.
    """
    length = np.broadcast_to(length, len(left)).astype(np.int32)
    right = np.where(length[:, np.newaxis] == 1, left, right)
    count, fragments = len(length), int(length.sum())
    x = rng.integers(0, WIDTH - length, endpoint=True).astype(np.int32)
    y = rng.integers(0, 4095, count).astype(np.int32)
    span = np.repeat(np.arange(count, dtype=np.int32), length)
    offset = (np.arange(fragments) - np.repeat(np.cumsum(length) - length, length)).astype(np.int16)
    return Raster(
        x=x,
        y=y,
        length=length,
        triangle=rng.integers(0, 1000, count).astype(np.int32),
        normal_left=left,
        normal_right=right,
        magnitude_left=10.0 ** rng.uniform(-spread, spread, count),
        magnitude_right=10.0 ** rng.uniform(-spread, spread, count),
        weights_left=np.ones((count, 3)),
        weights_right=np.ones((count, 3)),
        back=rng.random(count) < 0.5,
        span=span,
        offset=offset,
        pixel=(y[span] * WIDTH + x[span] + offset).astype(np.int32),
        visible=rng.random(fragments) < 0.5,
        triangles=1000,
        degenerate=1,
        culled=2,
        outside=3,
        uncovered=4,
        hidden_spans=5,
        repaired_normals=6,
    )


def angles(raster):
    """Degrees between the ends of each span, by the form that is exact at both ends of the scale."""
    left, right = raster.normal_left, raster.normal_right
    sine = np.linalg.norm(left - right, axis=1)
    return np.degrees(2 * np.arctan2(sine, np.linalg.norm(left + right, axis=1)))


def origins(raster, cut):
    """The given span of each part, by its first fragment."""
    first = np.cumsum(cut.length) - cut.length
    return raster.span[first], raster.offset[first]


@pytest.fixture
def out_of_range(normal_pairs):
    """Spans of 0 to 179.9 degrees and 1 to 60 pixels, and what they are cut to."""
    rng = np.random.default_rng(11)
    left, right = map(normalise, normal_pairs(rng, 5000, rng.uniform(0, 179.9, 5000)))
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


def line_at(raster, span, t):
    """``(1-t) m_l N_l + t m_r N_r`` of spans."""
    left = ((1 - t) * raster.magnitude_left[span])[:, np.newaxis] * raster.normal_left[span]
    return left + (t * raster.magnitude_right[span])[:, np.newaxis] * raster.normal_right[span]


def test_normals_at_cuts_are_true(out_of_range):
    """Those of the line between the whole span's ends with their lengths, and so are the lengths."""
    raster, cut, _ = out_of_range
    origin, first = origins(raster, cut)
    for offset, side in ((first, "left"), (first + cut.length - 1, "right")):
        line = line_at(raster, origin, offset / np.maximum(raster.length[origin] - 1, 1))
        size = np.linalg.norm(line, axis=1)
        largest = np.maximum(raster.magnitude_left, raster.magnitude_right)[origin]
        np.testing.assert_allclose(getattr(cut, f"magnitude_{side}"), size, rtol=0, atol=1e-14)
        # Each term is rounded three times, on both sides; division by a short line magnifies that.
        error = np.abs(getattr(cut, f"normal_{side}") - line / size[:, np.newaxis]).max(axis=1)
        assert (error <= EPSILON * (8 * largest / size + 8)).all()


def test_parts_have_the_line_of_the_whole(out_of_range):
    """At every pixel: so the true normal in the middle of a part is the whole span's there."""
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


def test_narrow_spans_are_untouched(normal_pairs):
    rng = np.random.default_rng(12)
    left, right = normal_pairs(rng, 2000, rng.uniform(0, 44.999999, 2000))
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
    """The curve jumps at its middle: an odd span has a pixel there, which any unit normal may have."""
    rng = np.random.default_rng(14)
    left = np.eye(3)[:1]
    raster = raster_of(rng, left, -left, length)
    cut, count = cut_by_angle(raster, MAX_SPAN_ANGLE)
    assert count == (length > 1)
    # Halving closes in on the jump.
    assert len(cut.length) <= 1 + length.bit_length()
    assert (angles(cut)[cut.length > 1] == 0).all()
    ends = np.concatenate([cut.normal_left, cut.normal_right])
    assert (np.linalg.norm(ends, axis=1) == 1).all()
    if length > 1:
        assert np.array_equal(cut.normal_left[0], left[0])
        assert np.array_equal(cut.normal_right[-1], -left[0])


def test_the_pipeline_flags_no_span_after_the_cut(normal_pairs):
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
    left, right = normal_pairs(rng, len(angle), angle)
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
    assert preset().compute(quantised(cut), constants).out_of_range_spans == 0


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
def test_sorted_spans_are_a_permutation(normal_pairs, materials, cut):
    """Every span and fragment once, with all that belongs to it, in the given order within a material.

    x and the pixel are not read: they hold the numbers that spans and fragments had before.
    """
    rng = np.random.default_rng(17)
    left, right = map(normalise, normal_pairs(rng, 3000, rng.uniform(0, 90, 3000)))
    raster = raster_of(rng, left, right, rng.integers(1, 30, 3000))
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
    # A span's fragments stay together, from its first to its last.
    assert np.array_equal(ordered.span, np.repeat(np.arange(count), ordered.length))
    start = np.cumsum(ordered.length) - ordered.length
    assert np.array_equal(ordered.offset, np.arange(len(ordered.span)) - start[ordered.span])


def test_spans_in_order_are_untouched(normal_pairs):
    rng = np.random.default_rng(18)
    raster = raster_of(rng, *map(normalise, normal_pairs(rng, 100, 5.0)), 3)
    assert sort_by_material(raster, np.zeros(1000, int)) is raster
    raster = replace(raster, triangle=np.sort(raster.triangle))
    assert sort_by_material(raster, np.arange(1000) // 100) is raster
    empty = raster_of(rng, np.empty((0, 3)), np.empty((0, 3)), 0)
    assert len(sort_by_material(empty, np.arange(1000)).length) == 0


def test_spans_have_the_material_of_their_triangle(normal_pairs):
    rng = np.random.default_rng(19)
    raster = raster_of(rng, *map(normalise, normal_pairs(rng, 100, 5.0)), 3)
    material = rng.integers(0, 9, 1000)
    for given in (raster, sort_by_material(raster, material)):
        assert np.array_equal(quantise_spans(given, material).material, material[given.triangle])


# Of a mesh under lights: the method's own curve decides.

EXPONENTS = (1, 2, 10, 50, 100, 300, 1000)


def lit_spans(rng, normal_pairs, count, angle, longest, spread, lights=2):
    """Spans anywhere under distant lights, each of one of the exponents; half near the H of a light."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    faces = len(EXPONENTS)
    mesh = Mesh(
        corners, np.tile([0, 1, 2], (faces, 1)), np.tile([0.0, 0, 1], (3, 1)), material=np.arange(faces)
    )
    camera = Camera((0, 0, 5), (0, 0, 0))
    ways = normalise(rng.normal(size=(lights, 3)) + np.array([0, 0, 1.5]))
    scene = Scene(
        mesh, camera, 64, 64, tuple(material(n) for n in EXPONENTS), tuple(Light(tuple(way)) for way in ways)
    )
    left, right = map(normalise, normal_pairs(rng, count, angle))
    raster = raster_of(rng, left, right, rng.integers(1, longest, count, endpoint=True), spread)
    raster = replace(raster, triangle=rng.integers(0, faces, count).astype(np.int32))
    near = normalise(ways + normalise(np.asarray(camera.viewer)))[rng.integers(0, lights, count)]
    n = np.array(EXPONENTS)[raster.triangle][:, np.newaxis]
    near = normalise(near + rng.normal(size=near.shape) * np.minimum(1.5 / np.sqrt(n), 0.5))
    half = np.arange(count) % 2 == 0
    # The span turned as a whole, so that its left end is near H.
    turned = normalise(near + (right - left))
    ends = {
        "normal_left": np.where(half[:, None], near, left),
        "normal_right": np.where(
            (half & (raster.length > 1))[:, None], turned, np.where(half[:, None], near, right)
        ),
    }
    return scene, replace(raster, **ends)


def chord_operands(scene, cut):
    """What the chord method makes of spans, as the pipeline takes them; and its flags."""
    constants = FrameConstants.of(scene, len(scene.lights))
    words = (
        Fixed(COMPONENT, codes)
        for codes in (
            *(quantise(v) for v in (cut.normal_left, cut.normal_right)),
            constants.direction,
            constants.halfway,
            quantise(middle_normals(cut)),
        )
    )
    left, right, direction, halfway, middle = words
    chord = ChordInterpolator()
    values = chord.values(left, middle, right, direction, halfway)
    exponent = np.array([m.exponent for m in scene.materials])[scene.mesh.material[cut.triangle]]
    wide = SpanLimit().compute(left, right, values, cut.length, exponent)
    return chord.compute_values(values, cut.length), wide


def reflected(u, exponent):
    """Specular terms, each pixel of its own exponent."""
    terms = np.empty_like(u)
    for n in EXPONENTS:
        terms[exponent == n] = REFLECTION_MODELS["cosquad"].reflect(1 - u[exponent == n], n)
    return terms


def moved(exponent):
    """LSB by which the rounding of N and of H moves a term; N counts 1.25 times in a quadratic."""
    return 2.25 * 255 * 0.77 * np.sqrt(exponent) * np.sqrt(3) / 2 * COMPONENT.step


CASES = {
    "narrow": (10.0, 40, 0.05),
    "long": (6.0, 1500, 0.02),
    "magnitudes": (15.0, 40, 0.5),
    "needles": (60.0, 12, 1.5),
    "wide": (179.0, 60, 0.3),
}
"""Largest angle, longest span, spread of the lengths of the ends."""


@pytest.mark.parametrize("case", CASES)
def test_errors_of_the_chord_method_are_in_the_budgets(case, normal_pairs):
    """Every pixel of random true spans, n 1 to 1000: fit, arithmetic, rounding of N and H; no flag at all."""
    angle, longest, spread = CASES[case]
    rng = np.random.default_rng(len(case))
    count = 3000 if longest < 1000 else 150
    scene, raster = lit_spans(rng, normal_pairs, count, rng.uniform(0, angle, count), longest, spread)
    cut, spans_cut = cut_by_error(scene, raster, ChordInterpolator())
    assert spans_cut == np.count_nonzero(np.bincount(origins(raster, cut)[0]) > 1)
    assert 0 < spans_cut <= count
    operands, wide = chord_operands(scene, cut)
    assert not operands.out_of_range.any()
    assert not wide.any()
    cosine, u = exact_operands(scene, raster)
    exponent = np.array(EXPONENTS)[raster.triangle[raster.span]]
    # Where the light is behind nothing is asked of either.
    front = cosine > 4 * np.sqrt(3) * COMPONENT.step
    diffuse = 255 * np.abs(operands.cosine.values / ONE_VALUE - cosine)
    print(f"{case}: {diffuse[front].max():.3f} LSB, {len(cut.length)} of {count}")
    assert diffuse[front].max() <= METHOD.DIFFUSE_BUDGET + moved(1)
    terms = [reflected(value, exponent) for value in (operands.highlight.values / ONE_VALUE, u)]
    specular = 255 * np.abs(terms[0] - terms[1])
    assert np.count_nonzero(terms[1][front] > 0.1) > 300
    for n in EXPONENTS:
        which = front & (exponent == n)[:, np.newaxis]
        largest = specular[which].max()
        print(f"{case}, n = {n}: {largest:.3f} LSB")
        assert largest <= METHOD.HIGHLIGHT_BUDGET + moved(n)
    assert specular[front].max() > 0.1


@pytest.mark.parametrize("case", ["narrow", "wide"])
def test_flags_before_the_cut(case, normal_pairs):
    """Some of the uncut spans are flagged, or wide; of those of up to three pixels none is wide."""
    angle, longest, spread = CASES[case]
    rng = np.random.default_rng(3)
    scene, raster = lit_spans(rng, normal_pairs, 2000, rng.uniform(5, angle, 2000), longest, spread)
    operands, wide = chord_operands(scene, raster)
    assert wide.any()
    assert not wide[raster.length < 4].any()
    assert operands.out_of_range.any() == (case == "wide")
    assert not operands.out_of_range[raster.length < 3].any()


@pytest.mark.parametrize("method", ["linear", "quadratic", "angular", "chord", "chord-local"])
def test_cut_by_error_of_every_method(method, normal_pairs):
    """No part is over the method's angle; one or two pixels stay; the curve is right at its quarters."""
    rng = np.random.default_rng(7)
    scene, raster = lit_spans(rng, normal_pairs, 1500, rng.uniform(0, 90, 1500), 50, 0.2)
    interpolator = METHODS[method]
    cut, count = cut_by_error(scene, raster, interpolator)
    assert count > 100
    assert np.array_equal(cut.pixel, raster.pixel)
    assert (angles(cut)[cut.length > 1] <= max(map(interpolator.widest_span, EXPONENTS)) + 1e-9).all()
    if isinstance(interpolator, ChordInterpolator):
        return
    # Normals of the method against true ones, at every pixel, by the highlight of the first light.
    span = cut.span
    t = cut.offset / np.maximum(cut.length - 1, 1)[span]
    own = interpolator.exact_normals(cut.normal_left[span], cut.normal_right[span], t)
    cosine, u = exact_operands(scene, raster)
    light = scene.lights[0]
    halfway = normalise(np.asarray(light.direction) + scene.camera.viewer)
    found = np.square(own - halfway).sum(axis=1) / 2 if interpolator.uses_chord else 1 - own @ halfway
    exponent = np.array(EXPONENTS)[raster.triangle[raster.span]]
    terms = [reflected(value, exponent) for value in (found, u[:, 0])]
    front = cosine[:, 0] > 1e-3
    error = 255 * np.abs(terms[0] - terms[1])[front]
    print(f"{method}: {error.max():.3f} LSB, {len(cut.length)} of {len(raster.length)}")
    assert error.max() <= METHOD.HIGHLIGHT_BUDGET * 1.1


def test_cut_spans_chooses(normal_pairs):
    """By error for methods with a fit, by angle alone for those that hold at every angle."""
    rng = np.random.default_rng(8)
    scene, raster = lit_spans(rng, normal_pairs, 300, rng.uniform(0, 120, 300), 30, 0.2)
    for method, interpolator in METHODS.items():
        design = preset(method, lights=2, materials=len(EXPONENTS))
        found, count = cut_spans(scene, raster, design)
        widest = min(map(interpolator.widest_span, EXPONENTS))
        expected = (
            cut_by_error(scene, raster, interpolator)
            if interpolator.CUT_BY_ERROR
            else cut_by_angle(raster, widest)
        )
        assert count == expected[1]
        assert np.array_equal(found.length, expected[0].length)


CENTRE = np.array([0.0, 1.575, 0.0])


def material(exponent):
    return Material((0.1,) * 3, (0.7,) * 3, (0.6,) * 3, exponent)


def lit_teapot(exponent, triangles=1000, viewer="near"):
    """A lamp to the upper left, one close to the lid, and the sun."""
    mesh = teapot(triangles)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1), "perspective", 4 / 3, field_of_view=45)
    lamps = [Light(position=tuple(CENTRE + offset)) for offset in ([-3.2, 4.0, 4.5], [0.3, 2.1, 0.5])]
    return Scene(mesh, camera, 320, 240, material(exponent), (*lamps, Light((1, 1, 1))), viewer=viewer)


def floor(lamps, exponent=50, viewer="near", eye=(0, 1.5, 5)):
    """A square of two triangles, from so near that its spans are as wide as the picture."""
    vertices = np.array([[-4, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]], dtype=float)
    mesh = Mesh(vertices, np.array([[0, 2, 1], [0, 3, 2]]), np.tile([0.0, 1, 0], (4, 1)))
    camera = Camera(eye, (0, 0, 0), projection="perspective", field_of_view=50)
    lights = tuple(Light(position=lamp) for lamp in lamps)
    return Scene(mesh, camera, 320, 200, material(exponent), lights, back_faces="show", viewer=viewer)


def exact_operands(scene, raster):
    """N·L and u of every fragment, each vector normalised there."""
    span = raster.span
    t = raster.offset / np.maximum(raster.length[span] - 1, 1)
    normal = normalise(line_at(raster, span, t))
    point = fragment_positions(scene, raster, np.arange(len(span)))
    viewer = scene.camera.position - point if scene.viewer == "near" else scene.camera.viewer
    viewer = viewer / np.linalg.norm(viewer, axis=-1, keepdims=True)
    cosine, u = [], []
    for light in scene.lights:
        towards = light.direction if light.position is None else light.position - point
        towards = normalise(np.broadcast_to(towards, point.shape))
        halfway = normalise(towards + viewer)
        cosine.append((normal * towards).sum(axis=1))
        u.append(((normal - halfway) ** 2).sum(axis=1) / 2)
    return np.stack(cosine, axis=1), np.stack(u, axis=1)


def local_errors(scene, by_material=False):
    """Errors in LSB of full reflection over all fragments and lights, diffuse and specular; the cut spans."""
    raster = rasterise(scene)
    cut, count = cut_by_error(scene, raster, METHOD)
    if by_material:
        cut = sort_by_material(cut, scene.mesh.material)
    values = local_values(scene, cut)
    operands = METHOD.compute_values(values, cut.length)
    assert not operands.out_of_range.any()
    # Every fragment by its triangle and pixel.
    key, wanted = (
        r.triangle[r.span].astype(np.int64) * scene.width * scene.height + r.pixel for r in (cut, raster)
    )
    place = np.argsort(key)[np.searchsorted(np.sort(key), wanted)]
    assert np.array_equal(key[place], wanted)
    found, highlight = operands.cosine[place], operands.highlight[place]
    cosine, u = exact_operands(scene, raster)
    diffuse = Diffuse(found.format).compute(found).values
    specular, expected = np.zeros((2, *u.shape))
    unit = Specular(REFLECTION_MODELS["cosquad"], "one_minus_cosine")
    material = scene.mesh.material[raster.triangle[raster.span]]
    for index, coefficients in enumerate(scene.materials):
        which, n = material == index, coefficients.exponent
        specular[which] = unit.compute(highlight[which], Diffuse.dark(found[which]), n).values
        expected[which] = np.where(
            cosine[which] > 0, REFLECTION_MODELS["cosquad"].reflect(1 - u[which], n), 0
        )
    # At a step of the words from 0 the sign of N·L, and with it the highlight, may be the other.
    sure = np.abs(cosine) > 2.0**-25
    return (
        255 * np.abs(diffuse - np.maximum(cosine, 0)).max(initial=0),
        255 * np.abs(specular - expected)[sure].max(initial=0),
        cut,
        count,
        expected,
    )


@pytest.mark.parametrize("exponent", [1, 10, 100, 1000])
@pytest.mark.parametrize("triangles", [100, 1000, 10_000])
def test_local_operands_of_the_teapot(exponent, triangles):
    """Fit, arithmetic and the last units together, at every pixel: under half an LSB of full reflection.

    0.4 and 0.12 LSB for the former; the specular unit's own error adds up to 0.05, the diffuse one's 0.01.
    """
    diffuse, specular, cut, count, expected = local_errors(lit_teapot(exponent, triangles))
    print(
        f"{triangles} triangles, n = {exponent}: {diffuse:.3f}, {specular:.3f} LSB, {len(cut.length)} spans"
    )
    assert count > 0
    assert np.count_nonzero(expected > 0.1) > 20
    assert 0.03 < diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert 0.03 < specular <= METHOD.HIGHLIGHT_BUDGET + 0.05


LAMPS = {
    "high": [(0.5, 3.0, 0.5)],
    "low": [(0.5, 0.05, 0.5)],
    "in steps of pixels": [(0.3, 0.002, 1.0)],
    "on the surface": [(0.25, 0.0, 0.5)],
    "on a corner": [(4.0, 0.0, 4.0)],
    "behind": [(0.5, -1.0, 0.5)],
    "opposite to the viewer": [(0.0, -1.5, -5.0)],
    "at the camera": [(0.0, 1.5, 5.0)],
    "far": [(1e6, 2e6, 1e6)],
    "through the floor": [(0.0, 1.5, -5.0), (0.1, 1.5, -4.0)],
    "several": [(1.0, 0.3, 2.0), (-1.0, 0.1, 0.0), (0.0, -2.0, 0.0)],
}


@pytest.mark.parametrize("viewer", ["near", "distant"])
@pytest.mark.parametrize("lamps", LAMPS)
@pytest.mark.parametrize("exponent", [1, 50, 1000])
def test_stiff_lamps_over_a_floor(lamps, viewer, exponent):
    """Spans of hundreds of pixels, L and H that turn within a few of them: the same bounds, and no NaN."""
    # From below the lamps above are opposite: L = -V here and there, and N·L over 0.
    eye = (0, -1.5, 5) if lamps == "through the floor" else (0, 1.5, 5)
    scene = floor(LAMPS[lamps], exponent, viewer, eye)
    diffuse, specular, cut, _, _ = local_errors(scene)
    print(f"{lamps}, {viewer}, n = {exponent}: {diffuse:.3f}, {specular:.3f} LSB, {len(cut.length)} spans")
    assert diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert specular <= METHOD.HIGHLIGHT_BUDGET + 0.05
    # What the float64 renderer shows of the parts is what it shows of the whole spans.
    raster = rasterise(scene)
    whole = shade_spans(scene, raster, "normalised", REFLECTION_MODELS["cosquad"])
    parts = shade_spans(scene, cut, "normalised", REFLECTION_MODELS["cosquad"])
    assert np.isfinite(whole).all()
    lit = np.abs(exact_operands(scene, raster)[0]).min(axis=1) > 1e-9
    pixel = raster.pixel[lit & raster.visible]
    assert np.abs(whole - parts).reshape(-1, 3)[pixel].max(initial=0) <= 1e-9


def test_a_light_behind_cuts_nothing_but_what_turns():
    """Where N·L stays negative the light gives nothing, however badly the quadratics fit."""
    scene = floor([(0.5, -9.0, 0.5)], 10, "distant")
    above = replace(scene, lights=(Light(position=(0.5, 9.0, 0.5)),))
    fine, _ = cut_by_error(above, rasterise(scene), METHOD)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    operands = METHOD.compute_values(local_values(scene, cut), cut.length)
    assert (operands.cosine.codes < 0).all()
    assert len(cut.length) < 0.8 * len(fine.length)


def test_local_cut_keeps_fragments():
    scene = lit_teapot(50, 100)
    raster = rasterise(scene)
    cut, count = cut_by_error(scene, raster, METHOD)
    assert count == np.count_nonzero(np.bincount(origins(raster, cut)[0]) > 1)
    for name in ("pixel", "visible"):
        assert np.array_equal(getattr(cut, name), getattr(raster, name))
    origin, _ = origins(raster, cut)
    assert np.array_equal(np.bincount(origin, weights=cut.length), raster.length)
    assert np.array_equal(cut.triangle, raster.triangle[origin])
    # Positions and normals of the fragments are those of the whole spans.
    everything = np.arange(len(raster.span))
    points = (fragment_positions(scene, r, everything) for r in (raster, cut))
    assert np.abs(np.subtract(*points)).max() < 1e-12
    t = raster.offset / np.maximum(raster.length[raster.span] - 1, 1)
    curve = normalise(line_at(raster, raster.span, t))
    assert np.abs(fragment_normals(scene, cut, everything) - curve).max() < 1e-12


def test_local_values_by_hand():
    """Of one span: first, middle and last, rounded to codes in units of ONE_SQUARED."""
    scene = floor([(0.5, 0.4, 0.5), (-1, 2, 1)])
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values = local_values(scene, cut)
    span = int(np.argmax(cut.length))
    length = int(cut.length[span])
    assert length > 3
    first = int(np.cumsum(cut.length)[span]) - length
    ends = fragment_positions(scene, cut, np.array([first, first + length - 1]))
    shares = [w / w.sum() for w in (cut.weights_left[span], cut.weights_right[span])]
    middle = cut.weights_left[span] + cut.weights_right[span]
    corners = scene.mesh.vertices[scene.mesh.faces[cut.triangle[span]]]
    points = shares[0] @ corners, middle / middle.sum() @ corners, shares[1] @ corners
    assert np.abs(ends - [points[0], points[2]]).max() < 1e-12
    # On the floor's line of sight: halfway on the screen is not halfway in the world.
    eye = np.array(scene.camera.position)
    for index, light in enumerate(scene.lights):
        for place, point in enumerate(points):
            towards = np.subtract(light.position, point)
            towards /= np.linalg.norm(towards)
            sight = (eye - point) / np.linalg.norm(eye - point)
            half = (towards + sight) / np.linalg.norm(towards + sight)
            assert abs(values.diffuse[span, index, place] - ONE_VALUE * towards[1] * 2**25) < 0.51
            u = ((half - [0, 1, 0]) ** 2).sum() / 2
            assert abs(values.highlight[span, index, place] - ONE_VALUE * u * 2**26) < 0.51


def test_short_local_spans_do_not_bend():
    """A span of one pixel has one value, one of two the mean in the middle."""
    scene = lit_teapot(1000, 1000)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values = local_values(scene, cut)
    for codes in values:
        alone, pairs = codes[cut.length == 1], codes[cut.length == 2]
        assert len(alone) > 10
        assert len(pairs) > 10
        assert (alone == alone[..., :1]).all()
        assert np.abs(pairs[..., 0] + pairs[..., 2] - 2 * pairs[..., 1]).max() <= 2


def test_a_pipeline_of_more_lights():
    """The lights that the scene has not are dark in every pixel."""
    scene = lit_teapot(10, 100)
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    three, five = local_values(scene, cut), local_values(scene, cut, 5)
    for a, b in zip(three, five, strict=True):
        assert np.array_equal(a, b[:, :3])
        assert not b[:, 3:].any()
    assert Diffuse.dark(METHOD.compute_values(five, cut.length).cosine)[:, 3:].all()


def test_no_light_and_no_span():
    scene = replace(lit_teapot(10, 100), lights=())
    cut, count = cut_by_error(scene, rasterise(scene), METHOD)
    assert local_values(scene, cut).diffuse.shape == (len(cut.length), 0, 3)
    assert count == np.count_nonzero(np.bincount(origins(rasterise(scene), cut)[0]) > 1)
    empty = replace(scene, mesh=replace(scene.mesh, faces=scene.mesh.faces[:0], material=None))
    cut, count = cut_by_error(empty, rasterise(empty), METHOD)
    assert (count, len(cut.length), len(local_values(empty, cut).diffuse)) == (0, 0, 0)


def test_local_results_do_not_depend_on_the_chunks(monkeypatch):
    scene = lit_teapot(100, 100)
    raster = rasterise(scene)
    results = []
    for chunk in (1 << 16, 97):
        monkeypatch.setattr("blysk.golden.frames.local.CHUNK", chunk)
        cut, count = cut_by_error(scene, raster, METHOD)
        results.append((cut.length, count, *local_values(scene, cut)))
    for a, b in zip(*results, strict=True):
        assert np.array_equal(a, b)


def test_local_spans_by_material():
    """Each triangle's own exponent decides; the spans may be put in the order of their materials."""
    scene = lit_teapot(10, 1000)
    faces = len(scene.mesh.faces)
    mesh = replace(scene.mesh, material=np.arange(faces) % 2)
    scene = replace(scene, mesh=mesh, material=(material(1000), material(10)))
    diffuse, specular, cut, _, _ = local_errors(scene, by_material=True)
    assert diffuse <= METHOD.DIFFUSE_BUDGET + 0.01
    assert specular <= METHOD.HIGHLIGHT_BUDGET + 0.05
    assert len(np.unique(scene.mesh.material[cut.triangle])) == 2
