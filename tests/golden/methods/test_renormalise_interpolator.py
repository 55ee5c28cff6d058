"""Renormalisation at every pixel: normals of the true line against float64, a frame against exact normals."""

import numpy as np
import pytest

from blysk.bench.units.operands import any_lengths, code_pairs_at, pairs_at
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.normals.line_setup import LineSetup, quantise_line
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene

METHOD = RenormaliseInterpolator()
STEP = METHOD.END_FORMAT.step
LINE_ERROR = LineSetup.ERROR + np.sqrt(3) * STEP
"""Error of a pixel's vector before it is renormalised."""


def lines(rng, count, degrees, proportion):
    """Codes of ends at an angle. The shorter end has at least a proportion of the length of the longer."""
    left, right = pairs_at(rng, count, degrees)
    short = proportion ** rng.random((2, count, 1))
    return quantise_line(left * short[0], right * short[1])


def pixels(left, right, length):
    """Normals, flags and the exact vectors of all pixels with their spans, in units of the largest length."""
    normals, out_of_range = METHOD.normals(*(Fixed(METHOD.END_FORMAT, end) for end in (left, right)), length)
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    return normals, out_of_range, ((1 - t) * left[span] + t * right[span]) * STEP, span


@pytest.mark.parametrize("proportion", [1, 0.5, 1 / 16, 1 / 100])
@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 90, 150])
def test_normals_of_true_lines(degrees, proportion):
    """Every pixel is within the line's error, divided by its length, and the renormaliser's error.

    Spans have every length. The interpolated vector of a pixel equals that of unit ends only if both ends are
    as long.
    """
    rng = np.random.default_rng(int(degrees * 10))
    left, right = lines(rng, 200, degrees, proportion)
    length = any_lengths(rng, 200)
    normals, out_of_range, line, _ = pixels(left, right, length)
    size = np.linalg.norm(line, axis=1)
    distance = np.linalg.norm(normals.codes / ONE - line / size[:, np.newaxis], axis=1)
    bound = LINE_ERROR / size + Renormaliser.DIRECTION_ERROR + Renormaliser.LENGTH_ERROR
    assert not out_of_range.any()
    assert (distance <= bound).all()
    assert distance.max() > COMPONENT.step


def test_flag():
    """Exactly those spans are flagged that have a pixel whose vector has no component of 2^-8."""
    rng = np.random.default_rng(6)
    left, right = lines(rng, 5000, rng.uniform(175, 180, 5000), 0.1)
    length = rng.integers(1, 200, 5000)
    normals, out_of_range, line, span = pixels(left, right, length)
    largest = np.abs(line).max(axis=1)
    short = np.bincount(span, largest < Renormaliser.SHORTEST - LINE_ERROR, 5000) > 0
    perhaps = np.bincount(span, largest <= Renormaliser.SHORTEST + LINE_ERROR, 5000) > 0
    assert out_of_range[short].all()
    assert not out_of_range[~perhaps].any()
    assert 250 < np.count_nonzero(short) <= np.count_nonzero(perhaps) < 0.9 * len(length)
    served = ~out_of_range[span]
    exact = normalise(line[served])
    distance = np.linalg.norm(normals.codes[served] / ONE - exact, axis=1)
    own = Renormaliser.DIRECTION_ERROR + Renormaliser.LENGTH_ERROR
    assert (distance <= LINE_ERROR / np.linalg.norm(line[served], axis=1) + own).all()


def test_operand_error():
    """The bound of both operands holds for ends of unit length, at every angle, with and without
    highlights."""
    rng = np.random.default_rng(7)
    for degrees in (0, 20, 90, 120, 160):
        left, right = (codes << 5 for codes in code_pairs_at(rng, 300, degrees))
        length = any_lengths(rng, 300)
        vectors = [normalise(rng.normal(size=(1, 3))) for _ in range(2)]
        words = [Fixed(COMPONENT, np.rint(vector * ONE).astype(np.int64)) for vector in vectors]
        ends = (Fixed(METHOD.END_FORMAT, end) for end in (left, right))
        operands = METHOD.compute(*ends, length, *words)
        _, _, line, _ = pixels(left, right, length)
        light, halfway = (word.codes[0] / ONE for word in words)
        cosine = normalise(line) @ light
        chord = np.square(normalise(line) - halfway).sum(axis=1) / 2
        bound = METHOD.operand_error(4095, degrees)
        assert np.abs(operands.cosine.values[:, 0] / METHOD.COSINE_OF_ZERO - cosine).max() <= bound
        assert (
            np.abs(operands.highlight.values[:, 0] / METHOD.COSINE_OF_ZERO - chord).max() <= bound + 2.0**-25
        )


def torus(around, along, radius=0.45):
    """A coarse torus about the y axis, whose vertices have exact normals."""
    u, v = np.meshgrid(*(np.arange(n) * (2 * np.pi / n) for n in (around, along)), indexing="ij")
    normals = np.stack([np.cos(u) * np.cos(v), np.sin(v), np.sin(u) * np.cos(v)], axis=-1)
    vertices = radius * normals + np.stack([np.cos(u), np.zeros_like(u), np.sin(u)], axis=-1)
    index = np.arange(around * along).reshape(around, along)
    corners = [np.roll(index, shift, (0, 1)) for shift in ((0, 0), (0, -1), (-1, -1), (-1, 0))]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(vertices.reshape(-1, 3), faces, normals.reshape(-1, 3))


def close_torus(exponent):
    """A torus of twelve by seven, seen from so near that the depths at a span's ends are 1:3 and more."""
    camera = Camera((0.4, 0.9, 1.9), (0.0, -0.1, 0.4), projection="perspective", field_of_view=85.0)
    material = Material((0.1,) * 3, (0.5,) * 3, (0.5,) * 3, exponent)
    return Scene(torus(12, 7), camera, 200, 150, material, (Light((0.5, 1.0, 0.8)),))


@pytest.mark.parametrize("exponent", [1, 30, 200])
def test_frame_in_strong_perspective(exponent):
    """Every pixel off the terminator is within 0.6 LSB of exact normals; half an LSB of this is rounding."""
    scene = close_torus(exponent)
    design = preset("renormalise", "cosquad")
    frame = model_frame(scene, design)
    assert frame.prepared.spans_cut == frame.prepared.missed_spans == 0
    assert frame.out_of_range_spans == 0
    raster = frame.raster
    ends = np.stack([raster.magnitude_left, raster.magnitude_right])[:, raster.length > 1]
    assert (ends.max(axis=0) / ends.min(axis=0)).max() > 1.5
    visible = np.flatnonzero(raster.visible)
    cosine = fragment_normals(scene.mesh, raster, visible) @ scene.lights[0].direction
    exact = render(scene, "phong", design.specular.reflection, raster=raster).image.reshape(-1, 3)
    shown = frame.image.reshape(-1, 3)
    pixel = raster.pixel[visible]
    error = np.abs(shown[pixel] - 255 * exact[pixel]).max(axis=1)
    assert error[np.abs(cosine) > 0.002].max() <= 0.6
    assert np.count_nonzero(np.abs(cosine) > 0.002) > 0.9 * len(pixel) > 5000
    comparison = compare(scene, design, frame)
    assert comparison.method_error.p999_lsb <= 0.6
    print(f"n = {exponent}: {error[np.abs(cosine) > 0.002].max():.3f} LSB")


def test_frame_without_lengths_is_worse():
    """If the ends are made unit vectors, as in textbooks, bands appear where the perspective is strong."""
    scene = close_torus(30)
    design = preset("renormalise", "cosquad")
    frame = model_frame(scene, design)
    assert compare(scene, design, frame).method_error.max_lsb <= 2
    spans = frame.prepared.spans
    lengths = [np.linalg.norm(end, axis=1) for end in (spans.normal_left, spans.normal_right)]
    kept = np.maximum(*lengths) / np.minimum(*lengths)
    assert kept.max() > 1.5
    left, right = (normalise(end) for end in (spans.normal_left, spans.normal_right))
    unit = quantise_line(left, right)
    span = np.argmax(kept * np.arccos(np.clip((left * right).sum(axis=1), -1, 1)) * (spans.length > 10))
    true, _, line, _ = pixels(
        *(end[[span]] for end in (spans.normal_left, spans.normal_right)), spans.length[[span]]
    )
    flat, _, _, _ = pixels(*(end[[span]] for end in unit), spans.length[[span]])
    wrong, right_one = (np.linalg.norm(n.codes / ONE - normalise(line), axis=1).max() for n in (flat, true))
    assert wrong > 100 * right_one
