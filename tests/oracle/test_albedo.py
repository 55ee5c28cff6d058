"""Vertex colours and textures in float64 against the ray caster."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

from .caster import Paint, cast, meet
from .test_frames import COEFFICIENTS, LIGHT, MESHES, SURE, camera_of, view_of

SIZE = 96, 72
WORDS = {"repeat": "wrap", "mirror": "symmetric", "clamp": "edge"}
"""The words of `numpy.pad` for our words."""


def floor() -> Mesh:
    """Two triangles that go from under the camera far away."""
    points = np.array([[-4.0, 0, 4], [4, 0, 4], [4, 0, -30], [-4, 0, -30]])
    return Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 1, 0], (4, 1)))


def scene_of(name: str, projection: str, texture: Texture | None, colors=False, **looks) -> Scene:
    """A mesh with random colours and texture coordinates."""
    rng = np.random.default_rng(5)
    if name == "floor":
        mesh, camera = floor(), Camera((0.3, 0.8, 2.0), (0, 0.4, 0), projection="perspective")
        mesh = replace(mesh, coordinates=mesh.vertices[:, ::2] / 3)
    else:
        mesh, camera = MESHES[name], camera_of(name, projection)
        mesh = replace(mesh, coordinates=rng.uniform(-1.5, 1.5, (len(mesh.vertices), 2)))
    if colors:
        mesh = replace(mesh, colors=rng.random((len(mesh.vertices), 3)))
    material = Material(*COEFFICIENTS, 20, texture=texture, **looks)
    return Scene(mesh, camera, *SIZE, material, (Light(LIGHT),))


def casted(scene: Scene, image: np.ndarray | None):
    """The picture of the ray caster, with an image in place of the scene's texture."""
    mesh, material = scene.mesh, scene.material
    paint = Paint(mesh.faces, mesh.colors if mesh.colors.size else None, mesh.coordinates, image)
    if material.texture is not None:
        paint.wrap = tuple(WORDS[wrap] for wrap in material.texture.wrap)
        paint.order = int(material.texture.filter == "bilinear")
    look = {"paint": paint, "tinted": material.tinted, "emission": material.emission}
    given = mesh.vertices, mesh.faces, mesh.normals, view_of(scene), LIGHT, COEFFICIENTS
    return cast(*given, material.exponent, "blinn", steps=256, **look)


def errors(scene: Scene, seen) -> np.ndarray:
    """Errors in LSB at the pixels that are not in doubt."""
    frame = render(scene)
    sure = seen.hit & (seen.margin > SURE) & (np.abs(seen.cosine) > 1e-6)
    assert sure.sum() > 0.8 * frame.mask.sum()
    return np.abs(255 * frame.image - seen.color)[sure]


def texture(*settings, size=(8, 16)) -> Texture:
    """Noise of full contrast, without levels."""
    return Texture(np.random.default_rng(7).random((*size, 3)), *settings, mipmapped=False)


LOOKS = {
    "colours": (None, True, {}),
    "colours, tinted": (None, True, {"tinted": True}),
    "bilinear": (texture(("repeat", "mirror"), "bilinear"), False, {"emission": (0.1, 0.0, 0.2)}),
    "bilinear, other wraps": (texture(("mirror", "clamp"), "bilinear"), False, {}),
    "nearest": (texture(("clamp", "repeat"), "nearest"), False, {}),
    "both, tinted": (texture(("mirror", "repeat"), "nearest"), True, {"tinted": True, "emission": 0.05}),
}


@pytest.mark.parametrize(
    ("name", "projection", "look"),
    [
        ("coarse torus", "perspective", "colours"),
        ("triangle", "perspective", "colours, tinted"),
        ("triangle", "perspective", "bilinear"),
        ("coarse torus", "orthographic", "bilinear, other wraps"),
        ("coarse torus", "perspective", "nearest"),
        ("needle", "orthographic", "nearest"),
        ("coarse torus", "orthographic", "both, tinted"),
    ],
)
def test_albedo(name, projection, look):
    image, colors, looks = LOOKS[look]
    scene = scene_of(name, projection, image, colors, **looks)
    seen = casted(scene, None if image is None else image.texels)
    assert errors(scene, seen).max() < 1e-7
    # The picture comes from the albedo.
    plain = replace(
        scene, mesh=replace(scene.mesh, colors=np.zeros((0, 3))), material=Material(*COEFFICIENTS, 20)
    )
    assert errors(plain, seen).max() > 20


def steps_of(scene: Scene, raster) -> np.ndarray:
    """Largest texel step of each span, from coordinates close to both ends."""
    view, mesh, found = view_of(scene), scene.mesh, np.zeros(len(raster.length))
    size = np.array(scene.material.texture.texels.shape[1::-1])
    h = 1e-3
    for index in np.unique(raster.triangle):
        own = raster.triangle == index
        corners = mesh.vertices[mesh.faces[index]]
        if view.places(corners)[2].min() > view.near:
            corners = view.snapped(corners, 256)
        for x in (raster.x[own], raster.x[own] + raster.length[own] - 1):
            for right, down in ((h, 0), (0, h)):
                at = [
                    meet(view, corners, x + 0.5 + sign * right, raster.y[own] + 0.5 + sign * down)[0]
                    for sign in (1, -1)
                ]
                change = (at[0] - at[1]) @ mesh.coordinates[mesh.faces[index]] / (2 * h) * size
                found[own] = np.maximum(found[own], np.abs(change).max(axis=-1))
    return found


@pytest.mark.parametrize(
    ("name", "projection", "side"),
    [
        ("coarse torus", "perspective", 64),
        ("triangle", "perspective", 256),
        ("coarse torus", "orthographic", 64),
    ],
)
def test_levels(name, projection, side):
    """Levels of spans are compared with numeric derivatives, and a picture with levels found in this way."""
    image = np.random.default_rng(8).random((side, side, 3))
    scene = scene_of(name, projection, Texture(image, ("mirror", "repeat")))
    raster = rasterise(scene)
    exact = np.log2(steps_of(scene, raster)) + 0.5
    sure = np.abs(exact - np.rint(exact)) > 1e-4
    assert sure.mean() > 0.99
    last = side.bit_length() - 1
    assert (raster.level[sure] == np.clip(np.floor(exact[sure]), 0, last)).all()
    assert len(np.unique(raster.level)) >= 3

    level = np.full(SIZE[::-1], -1)
    level.reshape(-1)[raster.pixel[raster.visible]] = raster.level[raster.span[raster.visible]]
    color = np.zeros((*level.shape, 3))
    for number in range(last + 1):
        if number:
            image = (image[::2, ::2] + image[1::2, ::2] + image[::2, 1::2] + image[1::2, 1::2]) / 4
        if (level == number).any():
            seen = casted(scene, image)
            color[level == number] = seen.color[level == number]
    seen.color = color
    assert errors(scene, seen).max() < 1e-7


def test_near_plane():
    """A floor that goes under the camera, where corners are cut off."""
    image = texture(("repeat", "repeat"), "bilinear")
    scene = scene_of("floor", "perspective", replace(image, mipmapped=True), True)
    raster = rasterise(scene)
    steps = steps_of(scene, raster)
    exact = np.log2(steps) + 0.5
    sure = np.abs(exact - np.rint(exact)) > 0.02
    assert (raster.level[sure] == np.clip(np.floor(exact[sure]), 0, 4)).all()
    assert len(np.unique(raster.level)) == 5

    scene = replace(scene, material=replace(scene.material, texture=image))
    seen = casted(scene, image.texels)
    which = np.flatnonzero(raster.visible & (seen.margin.reshape(-1) > SURE)[raster.pixel])
    pixel = raster.pixel[which]
    assert len(which) > 0.5 * SIZE[0] * SIZE[1]
    found = np.abs(255 * render(scene).image - seen.color).reshape(-1, 3)[pixel]
    # The ray caster does not round the corners of a cut to 1/256 pixel. This shifts them by half of it.
    assert (found.max(axis=1) < 255 * steps[raster.span[which]] / 512).all()


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("filter", ["nearest", "bilinear", "none"])
def test_cutoff(projection, filter):
    """A plate with holes stands in front of a whole plate of other colours, and the holes show the plate
    behind."""
    rng = np.random.default_rng(9)
    plate = np.array([[-1.0, -1, 0], [1, -1, 0.4], [1, 1, 0], [-1, 1, -0.3]])
    points = np.concatenate([plate, 0.9 * plate - (0, 0, 0.8)])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    normals = np.tile([0.0, 0, 1], (8, 1))
    alpha = np.array({"nearest": [], "bilinear": [1, 0.9, 0.8, 1] * 2, "none": [1, 0.1, 0.2, 1] * 2}[filter])
    places = np.tile([[0.0, 1], [1.5, 1], [1.5, -0.5], [0, -0.5]], (2, 1))
    material = Material(*COEFFICIENTS, 20, cutoff=0.5)
    paint = Paint(faces, rng.random((8, 3)), places, alpha=alpha if alpha.size else None, cut=(0, 1))
    if filter != "none":
        checker = np.indices((4, 4)).sum(axis=0) % 2 * 1.0
        image = Texture(np.ones((4, 4, 3)), ("mirror", "repeat"), filter, False, checker)
        material = replace(material, texture=image)
        paint.opacity, paint.order = checker, int(filter == "bilinear")
        paint.wrap = WORDS["mirror"], WORDS["repeat"]
    mesh = Mesh(points, faces, normals, [0, 0, 1, 1], paint.colors, places, alpha)
    camera = Camera.framing(points, (0.2, 0.3, 1), projection=projection)
    scene = Scene(mesh, camera, *SIZE, (material, replace(material, cutoff=None)), (Light(LIGHT),))
    given = points, faces, normals, view_of(scene), LIGHT, COEFFICIENTS, 20, "blinn"
    seen = cast(*given, steps=256, paint=paint)
    assert errors(scene, seen).max() < 1e-7

    raster = rasterise(scene)
    whole = rasterise(replace(scene, material=(replace(material, cutoff=None),) * 2))
    front = raster.visible & (raster.triangle[raster.span] < 2)
    # The plate in front hides no part of itself.
    covered = int((whole.triangle[whole.span] < 2).sum())
    assert raster.dropped == covered - front.sum()
    assert 0.2 < raster.dropped / covered < 0.8
