"""Spans that are counted because a bound does not hold for them: unequal lengths, and W of 1 to 100,000."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.missed import missed_pieces
from blysk.golden.frames.prepare import constants_of
from blysk.golden.frames.triangle_frame import frame_of_pixels, sent_triangles, triangle_frame
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

COLUMNS, ROWS = 100, 40
ARCS = preset("quadratic", "blinn", operand="one_minus_cosine")
"""A method of unit normals, whose spans hardware cuts by an angle."""
LIGHT = tuple(normalise((0.05, 0.03, 1.0)))
PROMISED = 0.5 + 1 / 16 + 1 / 4
"""LSB, docs/guide/accuracy.md, for diffuse and specular light of 1 together."""

# A climbing search found this triangle, with values of W nearer to each other: W of 9.05 to 11.4, normals
# within 10.3 degrees.
WORST = (
    [(75.56, 19.3), (21.85, 35.73), (4.36, 14.49)],
    [11.415, 9.046, 9.155],
    [(0.0177, -0.0577), (-0.0707, 0.0305), (0.0375, 0.1205)],
)


def scene_of(places, w, tilts, exponent, specular=0.5):
    """A scene with a triangle in each cell of a picture, from the pixels, W and normals ``(x, y, 1)`` of its
    corners."""
    places, w, tilts = (np.asarray(values, dtype=np.float64) for values in (places, w, tilts))
    count = len(places)
    height, slope = ROWS * count, np.tan(np.radians(20))
    places = places + np.stack([np.zeros(count), ROWS * np.arange(count)], axis=1)[:, np.newaxis]
    across = (places - (COLUMNS / 2, height / 2)) * (slope * 2 / height) * w[..., np.newaxis]
    vertices = np.concatenate([across * (1, -1), -w[..., np.newaxis]], axis=-1).reshape(-1, 3)
    normals = np.concatenate([tilts, np.ones((count, 3, 1))], axis=-1).reshape(-1, 3)
    mesh = Mesh(vertices, np.arange(3 * count).reshape(-1, 3), normalise(normals))
    camera = Camera((0, 0, 0), (0, 0, -1), projection="perspective", field_of_view=40, near=1e-6)
    material = Material((0,) * 3, (1 - specular,) * 3, (specular,) * 3, exponent)
    return Scene(mesh, camera, COLUMNS, height, material, (Light(LIGHT),), back_faces="show")


def errors(scene, design, image):
    """Largest error of each triangle in LSB, without pixels whose N·L is within rounding of 0."""
    raster = rasterise(scene)
    which = np.flatnonzero(raster.visible)
    lit = np.abs(fragment_normals(scene, raster, which) @ LIGHT) > 0.002
    exact = render(scene, "phong", design.specular.reflection, raster).image * 255
    error = np.abs(image - exact).max(axis=-1).reshape(-1)[raster.pixel[which]] * lit
    largest = np.zeros(len(scene.mesh.faces))
    np.maximum.at(largest, raster.triangle[raster.span[which]], error)
    return largest


def by_hardware(scene, design):
    """Largest error of each triangle drawn by geometry in hardware, and the counters."""
    renderer = Renderer(design)
    sent = sent_triangles(scene, renderer)
    drawn = renderer.compute(sent.triangles, sent.frame, constants_of(scene, design))
    counts = missed_pieces(scene, renderer, sent) | {"out_of_range": drawn.out_of_range_spans}
    image = frame_of_pixels(scene, drawn.x, drawn.y, drawn.color, renderer.design.transfer)
    return errors(scene, design, image), counts


def test_unequal_lengths_are_counted():
    """Hardware cuts by an angle alone and is 2 LSB off, which is counted. Software is not off."""
    scene = scene_of(*([part] for part in WORST), 992, 0.98)
    error, counts = by_hardware(scene, ARCS)
    assert error.max() > 2
    assert counts["missed_pieces"] > 5
    assert counts["short_normals"] == counts["out_of_range"] == 0
    assert errors(scene, ARCS, model_frame(scene, ARCS).image).max() < PROMISED


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_unequal_lengths_do_not_matter_to_vectors(model):
    """With vectors the same triangle, and W of 1 to 100, is within 0.6 LSB, and nothing is counted."""
    design = preset("quotient", model)
    for scene in (scene_of(*([part] for part in WORST), 992, 0.98), deep_scene(100, 1000)):
        error, counts = by_hardware(scene, design)
        assert 0.49 < error.max() < 0.6
        assert not any(counts.values())


@pytest.mark.parametrize("exponent", [30, 992])
def test_what_is_not_counted_is_as_promised(exponent):
    """The worst triangle is made flatter and flatter. Each triangle is within the promise, or is counted."""
    rng = np.random.default_rng(3)
    counted = {True: [], False: []}
    for share in (0.03, 0.07, 0.2, 0.5, 1.0):
        places, w, tilts = (np.array(part) for part in WORST)
        places = places + rng.uniform(-3, 3, (4, 3, 2))
        w = 10 * (w / 10) ** rng.uniform(0, 2, (4, 1))
        tilts = (tilts * share + rng.normal(0, 0.003, (4, 3, 2))) * np.sqrt(992 / exponent) ** 0.3
        scene = scene_of(places, w, tilts, exponent, 0.98)
        error, counts = by_hardware(scene, ARCS)
        counted[counts["missed_pieces"] > 0].append(error.max())
    assert max(counted[False]) < PROMISED
    if exponent == 992:
        assert max(counted[True]) > 1


def deep_scene(ratio, exponent):
    """Triangles with one corner, or two corners, farther away than the others by a ratio."""
    rng = np.random.default_rng(8)
    places = np.array([[(2, 3), (70, 5), (40, 15)], [(2, 2), (4, 15), (70, 10)]])
    w = np.array([(1, ratio, 1), (1, ratio, ratio)])
    return scene_of(places, w, rng.normal(0, 0.4, (2, 3, 2)), exponent)


CHEAP = "chord-local", "renormalise", "linear"


@pytest.mark.parametrize(
    "method", [pytest.param(name, marks=[] if name in CHEAP else pytest.mark.long) for name in METHODS]
)
def test_no_method_is_silently_wrong_in_any_depth(method):
    """With software no pixel is off, or the missed spans are counted. With hardware the counters tell."""
    design = preset(method, "blinn")
    for ratio in (300.0, 1e5):
        scene = deep_scene(ratio, 30)
        frame = model_frame(scene, design)
        assert frame.out_of_range_spans == 0
        assert errors(scene, design, frame.image).max() < PROMISED or frame.prepared.missed_spans
        if not design.interpolator.serves_local:
            error, counts = by_hardware(scene, design)
            assert error.max() < PROMISED or any(counts.values())


@pytest.mark.parametrize(("far", "wrong"), [(500, False), (1e5, True)])
def test_far_surfaces_that_change_places_are_counted(far, wrong):
    """Two sheets are 0.1 % apart, with the nearer sheet second. A near triangle sets the range of 1/W."""
    corner = [(2, 2), (98, 2), (50, 38)]
    tilted = np.array([1, 1.0006, 1.0003])
    w = np.array([np.full(3, 0.9), 1.001 * far * tilted, far * tilted])
    scene = scene_of([corner] * 3, w, np.zeros((3, 3, 2)), 10)
    corners = scene.mesh.vertices.reshape(-1, 3, 3).copy()
    # The second sheet lies in front of the first.
    corners[2] = corners[1] / 1.001
    scene = replace(scene, mesh=replace(scene.mesh, vertices=corners.reshape(-1, 3)))
    frame = triangle_frame(scene, Renderer(preset("renormalise", "blinn")))
    assert (frame.owner == 1).any() == wrong
    assert frame.sent.far == 2 * wrong


def test_lengths_beyond_the_words_of_renormalise_are_cut():
    """Corners at W of 3031, 7564 and 0.86 were 235 LSB off, before spans of this kind were cut."""
    scene = scene_of(
        [[(98, 3), (97, 36), (2, 20)]], [(3031, 7564, 0.86)], [[(0.6, 0), (-0.6, 0.1), (0, 0)]], 6
    )
    design = preset("renormalise", "blinn")
    frame = model_frame(scene, design)
    assert frame.prepared.spans_cut > 10
    assert frame.out_of_range_spans == 0
    assert errors(scene, design, frame.image).max() < 0.6
