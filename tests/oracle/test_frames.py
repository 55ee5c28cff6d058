"""Frames of the pipelines against the ray caster: coarse and fine meshes, both projections, camera inside."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import shade_spans
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

from .caster import View, cast, unit

SIZE = 384, 288
LIGHT = -0.5, 0.8, 0.7
COEFFICIENTS = (0.05,) * 3, (0.4, 0.3, 0.2), (0.55, 0.5, 0.6)
SURE = 1e-4
"""Margin from which on it is certain which triangle a pixel shows."""


def torus(around: int, across: int) -> Mesh:
    """A torus with some numbers of sides."""
    u, v = np.meshgrid(*(np.arange(n) * 2 * np.pi / n for n in (around, across)), indexing="ij")
    normal = np.stack([np.cos(u) * np.cos(v), np.sin(v), np.sin(u) * np.cos(v)], axis=-1)
    points = np.stack([np.cos(u), 0 * u, np.sin(u)], axis=-1) + 0.45 * normal
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")

    def at(a, b):
        return a % around * across + b % across

    faces = [[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]]
    faces = np.concatenate([np.stack(face, axis=-1).reshape(-1, 3) for face in faces])
    return Mesh(points.reshape(-1, 3), faces, normal.reshape(-1, 3))


def triangle() -> Mesh:
    """A triangle that starts close to the camera and goes far away, with normals 100 degrees apart."""
    points = np.array([[-1.0, -1.0, 0.9], [1.0, -1.0, -6.0], [0.0, 1.2, 0.0]])
    return Mesh(points, np.array([[0, 1, 2]]), unit([[-0.7, -0.3, 0.6], [0.8, 0.1, 0.7], [0.1, 0.8, 0.4]]))


def needle() -> Mesh:
    """A sliver across the picture, with normals 60 degrees apart."""
    points = np.array([[-1.2, -0.40, 0.5], [1.3, 0.35, -2.0], [-1.2, -0.38, 0.5]])
    return Mesh(points, np.array([[0, 1, 2]]), unit([[-0.5, 0.1, 0.8], [0.6, 0.3, 0.7], [-0.5, 0.4, 0.8]]))


MESHES = {
    "coarse torus": torus(9, 6),
    "fine torus": torus(48, 24),
    "teapot": teapot(1000),
    "triangle": triangle(),
    "needle": needle(),
}


def camera_of(name: str, projection: str) -> Camera:
    """A camera that shows all of a mesh. For single triangles it stands close to them."""
    if len(MESHES[name].faces) > 1:
        return Camera.framing(MESHES[name].vertices, (0.4, 0.5, 1.0), projection, SIZE[0] / SIZE[1], 30.0)
    return Camera((0.1, 0.2, 2.2), (0.0, 0.0, 0.0), projection=projection, height=2.4, field_of_view=70.0)


def view_of(scene: Scene) -> View:
    """The scene's camera for the ray caster."""
    camera = scene.camera
    perspective = camera.projection == "perspective"
    of_projection = perspective, camera.field_of_view, camera.height, camera.near
    return View(camera.position, camera.target, scene.width, scene.height, *of_projection)


def held(scene: Scene, design, light=LIGHT, **options) -> tuple[np.ndarray, float]:
    """Errors at the pixels that are not in doubt, in LSB, and the project's own method error."""
    mesh = scene.mesh
    seen = cast(
        mesh.vertices,
        mesh.faces,
        mesh.normals,
        view_of(scene),
        light,
        COEFFICIENTS,
        scene.materials[0].exponent,
        design.specular.reflection.name,
        steps=256,
        **options,
    )
    frame = model_frame(scene, design)
    shown = np.any(frame.image != 0, axis=-1)
    sure = seen.hit & (seen.margin > SURE) & (np.abs(seen.cosine) > 0.002)
    assert np.count_nonzero(sure) > 0.9 * np.count_nonzero(shown) - 400
    assert shown[sure].all()
    # A pixel that only one of both pictures shows lies on an edge.
    assert np.count_nonzero(shown != seen.hit) <= 0.002 * shown.size
    return np.abs(frame.image[sure] - seen.color[sure]), compare(scene, design, frame).method_error.max_lsb


def scene_of(mesh: Mesh, camera: Camera, exponent: int) -> Scene:
    """The light is one white light from above on the left."""
    material = Material(*COEFFICIENTS, exponent)
    return Scene(mesh, camera, *SIZE, material, (Light(LIGHT),))


def words_bound(design, exponent: int) -> float:
    """Bound of the error in LSB from the words of a method's normals, with rounding and the cut of spans."""
    method = design.interpolator
    error = method.operand_error(SIZE[0], method.MAX_ANGLE)
    highlight = method.highlight_error(design.specular, exponent, SIZE[0], error)
    return 0.75 + 255 * float(np.max(COEFFICIENTS[1]) * error + np.max(COEFFICIENTS[2]) * highlight)


EXPONENTS = 1, 50, 1000


def frames_of(*names):
    """Methods or models with each mesh and projection, so that every exponent meets each of them."""
    for row, (name, projection) in enumerate(product(MESHES, ("perspective", "orthographic"))):
        for column, one in enumerate(names):
            yield one, name, projection, EXPONENTS[(row + row // 3 + column) % 3]


SHORT = {
    ("renormalise", "coarse torus", "perspective", 1000),
    ("renormalise", "coarse torus", "orthographic", 1),
    ("renormalise", "needle", "perspective", 1000),
    ("quadratic", "triangle", "perspective", 50),
}
"""Frames of the short run."""

FRAMES = sorted({*frames_of("quadratic", "renormalise"), *SHORT})


@pytest.mark.parametrize(
    ("method", "name", "projection", "exponent"),
    [frame if frame in SHORT else pytest.param(*frame, marks=pytest.mark.long) for frame in FRAMES],
)
def test_frame(method, name, projection, exponent):
    scene = scene_of(MESHES[name], camera_of(name, projection), exponent)
    design = preset(method, "cosquad")
    errors, own = held(scene, design)
    assert errors.max() <= max(1.0, words_bound(design, exponent) if method == "quadratic" else 0)
    # The project's own figures are those that the caster finds, except for pixels in doubt.
    assert errors.max() <= own + 0.05


@pytest.mark.parametrize(
    "model", [pytest.param("blinn_product", marks=pytest.mark.long), "blinn", "cosquad7", "cosquad_lin"]
)
def test_models(model):
    errors, _ = held(
        scene_of(MESHES["coarse torus"], camera_of("coarse torus", "perspective"), 100),
        preset("renormalise", model),
    )
    assert errors.max() <= 1.0


SHORT_QUOTIENTS = {("blinn", "triangle", "perspective", 1), ("phong", "coarse torus", "orthographic", 50)}

QUOTIENTS = sorted({*frames_of("blinn", "phong"), *SHORT_QUOTIENTS})


@pytest.mark.parametrize(
    ("model", "name", "projection", "exponent"),
    [
        frame if frame in SHORT_QUOTIENTS else pytest.param(*frame, marks=pytest.mark.long)
        for frame in QUOTIENTS
    ],
)
def test_quotient(model, name, projection, exponent):
    """Blinn's highlight is computed by N·H, and Phong's by the vector R itself."""
    scene = scene_of(MESHES[name], camera_of(name, projection), exponent)
    errors, own = held(scene, preset("quotient", model))
    assert errors.max() <= 0.6
    assert errors.max() <= own + 0.05


@pytest.mark.parametrize("exponent", [20, pytest.param(500, marks=pytest.mark.long)])
def test_camera_inside(exponent):
    """The camera is in the tube of a torus, at a wall that crosses the near plane."""
    camera = Camera((1.0, 0.0, 0.05), (0.4, 0.1, 1.0), projection="perspective", field_of_view=80.0)
    errors, _ = held(scene_of(MESHES["coarse torus"], camera, exponent), preset("renormalise", "cosquad"))
    assert errors.max() <= 1.0


def test_fresnel():
    """A light comes from behind, at V·H = 0.3.

    There the reflection is over four times as large as along the normal.
    """
    mesh, f0 = MESHES["coarse torus"], (0.04, 0.2, 0.7)
    camera = camera_of("coarse torus", "orthographic")
    side = unit(np.cross(camera.viewer, (0.0, 1.0, 0.0)))
    # L·V = 2 (V·H)^2 - 1.
    light = tuple(-0.82 * camera.viewer + (1 - 0.82**2) ** 0.5 * side)
    scene = scene_of(mesh, camera, 10)
    material = replace(scene.material, fresnel=f0)
    scene = replace(scene, material=material, lights=(Light(light),))
    errors, _ = held(scene, preset("renormalise", "cosquad"), light, f0=f0)
    assert errors.max() <= 1.0
    without, _ = held(scene, preset("renormalise", "cosquad"), light)
    assert without.max() > 20


def test_two_sided():
    """Half a torus without its back faces. Those of one of two materials are turned instead."""
    mesh = MESHES["coarse torus"]
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    faces = mesh.faces[middle[:, 2] < 0.1]
    mesh = replace(mesh, faces=faces, material=np.arange(len(faces)) // 4 % 2)
    material = Material(*COEFFICIENTS, 50)
    both = replace(material, two_sided=True), material
    camera = camera_of("coarse torus", "perspective")
    scene = Scene(mesh, camera, *SIZE, both, (Light(LIGHT),), back_faces="cull")
    one_sided = set(np.flatnonzero(mesh.material).tolist())
    errors, _ = held(scene, preset("renormalise", "cosquad", materials=2), one_sided=one_sided)
    assert errors.max() <= 1.0
    flipped = model_frame(replace(scene, back_faces="flip"), preset("renormalise", "cosquad", materials=2))
    assert (
        np.any(
            flipped.image != model_frame(scene, preset("renormalise", "cosquad", materials=2)).image, axis=-1
        ).sum()
        > 500
    )


def test_caster_finds_a_wrong_curve():
    """Ends joined without their magnitudes, as in an earlier version, are off by 10 LSB and more."""
    scene = scene_of(MESHES["triangle"], camera_of("triangle", "perspective"), 50)
    wrong = shade_spans(
        scene, rasterise(scene), "normalised", preset("renormalise", "cosquad").specular.reflection
    )
    right = compare(
        scene, preset("renormalise", "cosquad"), model_frame(scene, preset("renormalise", "cosquad"))
    ).golden
    assert 255 * np.abs(wrong - right).max() > 10
