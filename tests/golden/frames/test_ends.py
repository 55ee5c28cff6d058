"""Every model at the ends of its range: no library warns, and a frame is within the model's error."""

import numpy as np
import pytest

from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import LOBES, MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.lobes import BECKMANN, GGX, TabulatedModel, exponent_of_roughness
from blysk.golden.reference.scene import Scene

GREY = (0.3, 0.3, 0.3)
ENDS = {"roughness": (5e-324, 1e-160, 1e-80, 1e-3, 0.05, 0.84, 1.0), "exponent": (1, 2, 1000), None: (None,)}
CURVES = {
    "black": TabulatedModel.of_points("black", [0, 1], [0, 0]),
    "white": TabulatedModel.of_points("white", [0, 1], [1, 1]),
    "spike": TabulatedModel.of_points("spike", [0, 1 - 1e-15, 1], [0, 0, 1]),
    "hole": TabulatedModel.of_points("hole", [0, 1 - 1e-15, 1], [1, 1, 0]),
}


def ball(rings=8):
    """A sphere of few triangles, with its poles."""
    up, around = np.meshgrid(np.linspace(-1, 1, rings) * np.pi / 2, np.arange(2 * rings) * np.pi / rings)
    points = np.stack([np.cos(up) * np.cos(around), np.sin(up), np.cos(up) * np.sin(around)], axis=-1)
    place = np.arange(points.size // 3).reshape(points.shape[:2])
    a, b, c, d = (
        place[:, :-1],
        place[:, 1:],
        np.roll(place, -1, axis=0)[:, :-1],
        np.roll(place, -1, axis=0)[:, 1:],
    )
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (c, b, d))])
    points = points.reshape(-1, 3)
    return Mesh(points, faces, normalise(points))


@pytest.mark.parametrize("name", [*LOBES, *MODELS, *CURVES])
def test_no_warning_at_the_ends_of_a_model(name):
    """A method that serves all models makes design, tables, cuts, pipeline, golden frame and comparison."""
    mesh = ball()
    design = preset("renormalise", CURVES.get(name, name), 1)
    camera = Camera.framing(mesh.vertices, (0.4, 0.5, 1.0), "perspective", 4 / 3)
    parameter = design.specular.reflection.PARAMETER
    for value in ENDS[parameter]:
        given = {} if parameter is None else {parameter: value}
        material = Material(GREY, GREY, GREY, **{"exponent": 10, **given})
        scene = Scene(mesh, camera, 32, 24, material, (Light((-0.5, 0.8, 0.7)),))
        made = design.for_materials(scene.materials, True)
        frame = model_frame(scene, made)
        assert np.isfinite(compare(scene, made, frame).golden).all()
        assert frame.image.any()


@pytest.mark.parametrize(
    "model", [GGX, pytest.param(BECKMANN, marks=pytest.mark.long)], ids=lambda model: model.name
)
def test_no_warning_of_a_small_roughness(model):
    """The curve is 1 at its peak and falls to 0 elsewhere, which is the limit of small roughness."""
    cosine = np.r_[-1, 0, np.linspace(0, 1, 1000, endpoint=False), 1 - 2.0**-53, 1]
    for roughness in np.geomspace(5e-324, 1, 200).tolist():
        value = model.reflect(cosine, roughness)
        assert ((value >= 0) & (value <= 1 + 1e-12)).all()
        assert roughness > 0.8 or value[-1] == pytest.approx(1)
        assert roughness > 1e-6 or value[:-1].max() < 1e-15
        figures = model.peak(roughness), model.steepness(roughness), model.energy_factor(roughness)
        assert np.isfinite(figures).all()
        assert np.isfinite(exponent_of_roughness(roughness))
