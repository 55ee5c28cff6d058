"""Bound of frames by the quotient method: never exceeded, and near what is found."""

import numpy as np
import pytest

from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene


def _scene(rng):
    """Two triangles of random normals, close to a viewer in perspective, under one or two lights."""
    corners = np.c_[rng.uniform(-1, 1, (4, 2)), rng.uniform(-3, 0.5, 4)]
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    normals = normalise(np.array([0, 0, 0.6]) + rng.normal(size=(4, 3)))
    exponent = int(rng.choice([1, 7, 60, 1000]))
    lights = [Light(tuple(rng.normal((0, 0, 1)))) for _ in range(rng.integers(1, 3))]
    material = Material((0.02,) * 3, (0.02,) * 3, (0.96 / len(lights),) * 3, exponent)
    camera = Camera.framing(corners, (0, 0, 1), "perspective", 4 / 3)
    return Scene(Mesh(corners, faces, normals), camera, 64, 48, material, lights)


@pytest.mark.parametrize("model", ["blinn", "phong", "ggx"])
def test_no_frame_exceeds_its_bound(model):
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(12):
        scene = _scene(rng)
        design = preset("quotient", model, len(scene.lights)).for_materials(scene.materials)
        compared = compare(scene, design, model_frame(scene, design))
        if compared.visible_pixels > 20:
            assert compared.method_error.steady_lsb <= compared.bound_lsb
            ratios.append(compared.method_error.steady_lsb / compared.bound_lsb)
    assert max(ratios) > 0.6
