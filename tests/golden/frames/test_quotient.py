"""The quotient method in whole frames: the corners of its rules, and the largest error a search finds."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.compare import BORDER, compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import fragment_normals, rasterise
from blysk.golden.reference.scene import Scene

LIGHT = (0.3, 0.2, 1.0)
SOFT = ((0.3, 0.1, 1), (-0.4, 0.3, 1), (0.1, -0.5, 1))
GRAZING = ((1, 0.1, 0.1), (0.9, -0.3, -0.1), (0.8, 0.4, 0.05))
BEHIND = ((1, 0.1, -0.3), (0.9, -0.3, -0.2), (0.8, 0.4, -0.5))
OPPOSITE = ((0, 0, 1), (0, 0, -1), (0, 0, -1))


def scene_of(places, w, normals, lights=(LIGHT,), size=(40, 16), exponent=10, **options):
    """A triangle in each of some cells of one size, by places of 0 to 1 in it, W and normals; V is z."""
    places, w, normals = (np.asarray(values, dtype=np.float64) for values in (places, w, normals))
    columns, rows = size
    count = len(places)
    height = rows * count
    places = places * (columns - 4, rows - 4) + 2
    places = places + np.stack([np.zeros(count), rows * np.arange(count)], axis=1)[:, np.newaxis]
    scale = 2 * np.tan(np.radians(20)) / height
    across = (places - (columns / 2, height / 2)) * scale * w[..., np.newaxis]
    vertices = np.concatenate([across * (1, -1), -w[..., np.newaxis]], axis=-1).reshape(-1, 3)
    mesh = Mesh(vertices, np.arange(3 * count).reshape(-1, 3), normals.reshape(-1, 3))
    camera = Camera((0, 0, 0), (0, 0, -1), projection="perspective", field_of_view=40, near=1e-9)
    material = Material((0,) * 3, (0.02,) * 3, (0.98,) * 3, exponent)
    lights = tuple(light if isinstance(light, Light) else Light(light) for light in lights)
    return Scene(mesh, camera, columns, height, material, lights, **{"back_faces": "show"} | options)


def one(normals, places=((0, 0), (0.4, 1), (1, 0.1)), w=(1, 1.3, 1.1), **options):
    """A triangle that faces the viewer; with ``places`` in another order its back does."""
    return scene_of([places], [w], [normals], **options)


def drawn(scene, model):
    design = preset("quotient", model, max(len(scene.lights), 1), materials=len(scene.materials))
    frame = model_frame(scene, design)
    return frame, compare(scene, design, frame)


MIRRORED = ((0, 0), (1, 0.1), (0.4, 1))
CORNERS = {
    "light at the viewer": (one(SOFT, lights=[(0, 0, 1)]), 150),
    "light behind the horizon": (one(BEHIND, lights=[(1, 0, -0.8)]), 3),
    "light nearly behind": (one(GRAZING, lights=[(0.01, 0, -1)]), 3),
    "terminator": (one(((1, 0.1, 0.1), (-1, -0.3, 0.1), (0, 0.4, 1))), 3),
    "back faces flipped": (one(np.negative(SOFT), MIRRORED, back_faces="flip"), 100),
    "back faces shown": (one(SOFT, MIRRORED), 100),
    "opposite normals": (one(OPPOSITE), 3),
    "a normal of 0": (one(((0, 0, 0), (0, 0, 1), (0, 1, 1))), 3),
    "normals of 0": (one(np.zeros((3, 3)), back_faces="flip"), 3),
    "three lights": (
        one(SOFT, lights=[Light((0.5, 0, 1), (0.4, 0.3, 0.2)), (-1, 1, 0.2), Light((0, 0, -1), (0.3,) * 3)]),
        3,
    ),
    "a light that is off": (one(SOFT, lights=[Light((0, 0, 1), (0, 0, 0)), (1, 1, 1)]), 3),
    "4095 pixels": (one(SOFT, ((-0.3, 0), (0.5, 3), (1.3, 0.1)), (1, 1.5, 7), size=(4095, 6)), 50),
    "pixels one and two at a time": (one(SOFT, ((0.5, 0), (0.52, 1), (0.57, 0.9)), size=(40, 30)), 3),
    "W of 1 to 10,000": (one(SOFT, w=(1, 1e4, 30)), 3),
}
"""Scenes, and the brightness that some pixel has at least."""


@pytest.mark.parametrize("model", ["blinn", "phong"])
@pytest.mark.parametrize("name", CORNERS)
def test_corners(name, model):
    """Every pixel off the border of a light is rounded right, nearly; none is flagged."""
    scene, brightest = CORNERS[name]
    for exponent in (1, 1000):
        scene = replace(scene, material=replace(scene.material, exponent=exponent))
        frame, errors = drawn(scene, model)
        assert frame.out_of_range_spans == frame.wide_spans == 0
        assert errors.visible_pixels > 10
        assert errors.method_error.steady_lsb < 0.56
        assert 2 not in frame.cut_raster.length
        if exponent == 1:
            assert frame.image.max() >= brightest


def test_spans_of_one_two_and_4095_pixels_occur():
    """The rasteriser's spans in the scenes above."""
    names = "4095 pixels", "pixels one and two at a time"
    lengths = {name: rasterise(CORNERS[name][0]).length for name in names}
    assert lengths["4095 pixels"].max() == 4095
    assert {1, 2} <= set(lengths["pixels one and two at a time"].tolist())


def test_back_faces_that_are_culled():
    frame, errors = drawn(one(SOFT, MIRRORED, back_faces="cull"), "blinn")
    assert errors.visible_pixels == frame.spans == 0


def test_opposite_viewer_by_the_definition():
    """L = -V: R·V is 1 - 2 (N·L)^2, brightest where a light grazes; Blinn's model has no highlight."""
    for exponent in (1, 10):
        scene = one(GRAZING, lights=[(0, 0, -1)], exponent=exponent)
        frame, errors = drawn(scene, "phong")
        shown = np.flatnonzero(frame.raster.visible)
        cosine = -fragment_normals(scene, frame.raster, shown)[:, 2]
        exact = 0.02 * np.maximum(cosine, 0) + np.where(cosine > 0, 0.98 * (1 - 2 * cosine**2) ** exponent, 0)
        found = frame.image.reshape(-1, 3)[frame.raster.pixel[shown], 0]
        steady = np.abs(cosine) > BORDER
        assert np.abs(found - 255 * exact)[steady].max() < 0.56
        assert (found > 200).sum() > 20
        assert errors.method_error.steady_lsb < 0.56
        assert drawn(scene, "blinn")[0].image.max() == 0


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_materials_of_other_exponents(model):
    scene = scene_of([((0, 0), (0.4, 1), (1, 0.1))] * 2, [(1, 1.3, 1.1)] * 2, [SOFT] * 2)
    materials = [replace(scene.material, exponent=exponent) for exponent in (3, 300)]
    mesh = replace(scene.mesh, material=np.array([0, 1]))
    scene = replace(scene, mesh=mesh, material=materials)
    design = preset("quotient", model, materials=2)
    design = replace(design, specular=replace(design.specular, banks=2))
    frame = model_frame(scene, design)
    assert compare(scene, design, frame).method_error.steady_lsb < 0.56
    assert frame.image[:16].sum() > 2 * frame.image[16:].sum() > 0


def test_local_lights_are_refused():
    scene = one(SOFT, lights=[Light(position=(1, 2, 3))])
    with pytest.raises(ValueError, match=r"need the method chord-local$"):
        model_frame(scene, preset("quotient", "phong"))
