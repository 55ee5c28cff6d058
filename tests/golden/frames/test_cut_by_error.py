"""Cutting spans by error: the method's own curve against float64, at every pixel."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.frames.cut import cut_by_angle, cut_by_ends, cut_by_error, cut_spans
from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.frames.local import local_values
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.scene import Scene

from .cuts import METHOD, ONE_VALUE, angles, exact_operands, material, origins, raster_of

EXPONENTS = (1, 2, 10, 50, 100, 300, 1000)


def lit_spans(rng, count, angle, longest, spread, lights=2):
    """Spans anywhere under distant lights, each with one of the exponents.

    Half of them are near the H of a light.
    """
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
    left, right = map(normalise, pairs_at(rng, count, angle))
    raster = raster_of(rng, left, right, rng.integers(1, longest, count, endpoint=True), spread)
    raster = replace(raster, triangle=rng.integers(0, faces, count).astype(np.int32))
    near = normalise(ways + normalise(np.asarray(camera.viewer)))[rng.integers(0, lights, count)]
    n = np.array(EXPONENTS)[raster.triangle][:, np.newaxis]
    near = normalise(near + rng.normal(size=near.shape) * np.minimum(1.5 / np.sqrt(n), 0.5))
    half = np.arange(count) % 2 == 0
    # The whole span is turned so that its left end is near H.
    turned = normalise(near + (right - left))
    ends = {
        "normal_left": np.where(half[:, None], near, left),
        "normal_right": np.where(
            (half & (raster.length > 1))[:, None], turned, np.where(half[:, None], near, right)
        ),
    }
    return scene, replace(raster, **ends)


def chord_operands(scene, cut):
    """The operands that ``chord-local`` computes from the spans that the pipeline takes."""
    return METHOD.compute_values(local_values(scene, cut), cut.length)


def reflected(u, exponent):
    """Specular terms, where each pixel has its own exponent."""
    terms = np.empty_like(u)
    for n in EXPONENTS:
        terms[exponent == n] = REFLECTION_MODELS["cosquad"].reflect(1 - u[exponent == n], n)
    return terms


CASES = {
    "narrow": (10.0, 40, 0.05),
    "long": (6.0, 1500, 0.02),
    "magnitudes": (15.0, 40, 0.5),
    "needles": (60.0, 12, 1.5),
    "wide": (179.0, 60, 0.3),
}
"""Largest angle, longest span, and spread of the lengths of the ends."""


@pytest.mark.parametrize("case", CASES)
def test_errors_of_the_chord_method_are_in_the_budgets(case):
    """Fit and arithmetic at every pixel of random true spans, for n from 1 to 1000. No span is flagged."""
    angle, longest, spread = CASES[case]
    rng = np.random.default_rng(len(case))
    count = 3000 if longest < 1000 else 150
    scene, raster = lit_spans(rng, count, rng.uniform(0, angle, count), longest, spread)
    cut, spans_cut = cut_by_error(scene, raster, METHOD)
    assert spans_cut == np.count_nonzero(np.bincount(origins(raster, cut)[0]) > 1)
    assert 0 < spans_cut <= count
    operands = chord_operands(scene, cut)
    assert not operands.out_of_range.any()
    cosine, u = exact_operands(scene, raster)
    exponent = np.array(EXPONENTS)[raster.triangle[raster.span]]
    # Where the light is behind the surface, neither operand has to be right.
    front = cosine > 2.0**-24
    # The budgets hold for the words, which have a unit of their own.
    diffuse = 255 * np.abs(operands.cosine.values - cosine)
    print(f"{case}: {diffuse[front].max():.3f} LSB, {len(cut.length)} of {count}")
    assert diffuse[front].max() <= METHOD.DIFFUSE_BUDGET
    terms = [reflected(value, exponent) for value in (operands.highlight.values, u)]
    specular = 255 * np.abs(terms[0] - terms[1])
    assert np.count_nonzero(terms[1][front] > 0.1) > 300
    for n in EXPONENTS:
        which = front & (exponent == n)[:, np.newaxis]
        largest = specular[which].max()
        print(f"{case}, n = {n}: {largest:.3f} LSB")
        assert largest <= METHOD.HIGHLIGHT_BUDGET
    assert specular[front].max() > 0.1


def test_dark_scenes_of_srgb_are_cut_finer():
    """Both budgets are divided by the slope of the curve at the least ambient light, 0.02."""
    rng = np.random.default_rng(5)
    scene, raster = lit_spans(rng, 1000, rng.uniform(0, 10, 1000), 40, 0.05)
    dark = tuple(replace(of, ambient=(0.3, 0.02, 1.0)) for of in scene.materials)
    scene = replace(scene, material=dark)
    made = preset("chord-local", "cosquad", 2, materials=len(EXPONENTS))
    linear, srgb = (HighlightLimits.of(scene, replace(made, transfer=of)) for of in ("linear", "srgb"))
    assert linear.slope == 1
    assert srgb.slope == pytest.approx(1.055 / 2.4 * 0.02 ** (1 / 2.4 - 1))
    unlit = replace(scene, material=tuple(replace(of, unlit=True, diffuse=(0,) * 3) for of in dark))
    assert HighlightLimits.of(unlit, replace(made, transfer="srgb")).slope < 0.5
    cosine, u = exact_operands(scene, raster)
    exponent = np.array(EXPONENTS)[raster.triangle[raster.span]]
    parts = []
    for limits in (linear, srgb):
        cut, _ = cut_by_error(scene, raster, METHOD, limits)
        parts.append(len(cut.length))
        operands, front = chord_operands(scene, cut), cosine > 2.0**-24
        # In spans of three pixels every pixel is a place of the curve.
        front &= (cut.length[cut.span] > 3)[:, np.newaxis]
        diffuse = 255 * np.abs(operands.cosine.values / ONE_VALUE - cosine)[front].max()
        terms = [reflected(value, exponent) for value in (operands.highlight.values / ONE_VALUE, u)]
        specular = 255 * np.abs(terms[0] - terms[1])[front].max()
        print(f"slope {limits.slope:.2f}: {diffuse:.3f}, {specular:.3f} LSB, {parts[-1]} spans")
        assert diffuse <= METHOD.DIFFUSE_BUDGET / limits.slope
        assert specular <= METHOD.HIGHLIGHT_BUDGET / limits.slope
    assert 1.1 < parts[1] / parts[0] < 2


@pytest.mark.parametrize("case", ["narrow", "wide"])
def test_flags_before_the_cut(case):
    """Some wide spans are flagged before the cut. Spans of one or two pixels are never flagged."""
    angle, longest, spread = CASES[case]
    rng = np.random.default_rng(3)
    scene, raster = lit_spans(rng, 2000, rng.uniform(5, angle, 2000), longest, spread)
    operands = chord_operands(scene, raster)
    assert operands.out_of_range.any() == (case == "wide")
    assert not operands.out_of_range[raster.length < 3].any()


@pytest.mark.parametrize("method", ["linear", "quadratic", "angular", "chord-local"])
def test_cut_by_error_of_every_method(method):
    """No part is over the method's angle.

    Spans of one or two pixels are not cut. The curve is right at its quarters.
    """
    rng = np.random.default_rng(7)
    scene, raster = lit_spans(rng, 1500, rng.uniform(0, 90, 1500), 50, 0.2)
    interpolator = METHODS[method]
    cut, count = cut_by_error(scene, raster, interpolator)
    assert count > 100
    assert np.array_equal(cut.pixel, raster.pixel)
    assert (angles(cut)[cut.length > 1] <= max(map(interpolator.widest_span, EXPONENTS)) + 1e-9).all()
    if interpolator.given_values:
        return
    # Normals of the method are compared with true normals at every pixel, by the highlight of the first
    # light.
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
    assert error.max() <= HighlightLimits.TOLERANCE * 1.1


def test_cut_spans_chooses():
    """Methods with a fit are cut by error, methods with vectors by their ends, and all others by angle."""
    rng = np.random.default_rng(8)
    scene, raster = lit_spans(rng, 300, rng.uniform(0, 120, 300), 30, 0.2)
    for method, interpolator in METHODS.items():
        design = preset(method, "cosquad", lights=2, materials=len(EXPONENTS))
        found, count = cut_spans(scene, raster, design)
        widest = min(map(interpolator.widest_span, EXPONENTS))
        if interpolator.lights_cut:
            expected = cut_by_error(scene, raster, interpolator)
        elif not interpolator.brings_ends:
            expected = cut_by_ends(raster, interpolator.ENDS_RATIO)
        else:
            expected = cut_by_angle(raster, widest)
        assert count == expected[1]
        assert np.array_equal(found.length, expected[0].length)
