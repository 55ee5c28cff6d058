"""Fragments that a cutoff drops, by values found by hand."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

SIDE = 8
"""The pixels of a picture that a plate covers."""

PLAIN = Material((0.5,) * 3, (0,) * 3, (0,) * 3, 1)
CORNERS = np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])
"""Corners of a plate."""


def scene_of(*materials, alpha=(), places=((0, 1), (1, 1), (1, 0), (0, 0))):
    """Plates from front to back, each with its material. The camera sees them straight on."""
    count = len(materials)
    points = np.concatenate([np.column_stack([CORNERS, np.full(4, -0.1 * k)]) for k in range(count)])
    faces = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k for k in range(count)])
    mesh = Mesh(
        points,
        faces,
        np.tile([0.0, 0, 1], (len(points), 1)),
        np.repeat(np.arange(count), 2),
        coordinates=np.tile(np.array(places, float), (count, 1)),
        alpha=np.array(alpha, float),
    )
    camera = Camera((0, 0, 5), (0, 0, 0), (0, 1, 0), "orthographic", height=2.0, near=0.1)
    return Scene(mesh, camera, SIDE, SIDE, materials, ())


def shown(scene):
    """Number of the plate at each pixel, or -1 for none, and the number of dropped fragments."""
    raster = rasterise(scene)
    plate = np.full(SIDE * SIDE, -1)
    plate[raster.pixel[raster.visible]] = raster.triangle[raster.span[raster.visible]] // 2
    assert (render(scene).mask.reshape(-1) == (plate >= 0)).all()
    return plate.reshape(SIDE, SIDE), raster.dropped


def holes(alpha, **looks):
    """A material with an image that has alpha."""
    alpha = np.array(alpha, float)
    image = Texture(np.ones((*alpha.shape, 3)), filter="nearest", mipmapped=False, alpha=alpha)
    return replace(PLAIN, texture=replace(image, **looks), cutoff=0.5)


def test_holes_show_the_plate_behind():
    """The image is a checker of 4 x 4 texels, each of 2 x 2 pixels."""
    checker = np.indices((4, 4)).sum(axis=0) % 2
    plate, dropped = shown(scene_of(holes(checker), PLAIN))
    assert (plate == np.repeat(np.repeat(1 - checker, 2, 0), 2, 1)).all()
    assert dropped == 32
    # A plate behind does not have the holes of the plate in front. Hidden fragments are dropped, too.
    plate, dropped = shown(scene_of(PLAIN, holes(checker)))
    assert (plate == 0).all()
    assert dropped == 32


@pytest.mark.parametrize(
    ("alpha", "cutoff", "kept"),
    [(0.5, 0.5, True), (0.4999, 0.5, False), (0, 0, True), (1, 1, True), (1, 1.5, False), (0, None, True)],
)
def test_an_alpha_of_the_cutoff_is_drawn(alpha, cutoff, kept):
    plate, dropped = shown(scene_of(replace(PLAIN, alpha=alpha, cutoff=cutoff)))
    assert (plate == kept - 1).all()
    assert dropped == (0 if kept else SIDE * SIDE)


@pytest.mark.parametrize("filter", ["nearest", "bilinear"])
def test_rounding_drops_no_opaque_pixel(filter):
    """Sums of shares and of weights may be a little under 1."""
    places = np.random.default_rng(1).random((4, 2))
    alpha = [1, 1, 1, 1, 0.5, 1, 1, 1]
    material = replace(holes(np.ones((4, 4)), filter=filter), cutoff=1.0)
    scene = scene_of(material, PLAIN, alpha=alpha, places=places)
    camera = replace(scene.camera, projection="perspective", position=(0.3, 1, 5))
    assert rasterise(replace(scene, camera=camera)).dropped == 0


def test_alpha_is_a_product():
    """The alpha is 0.8, times 0 to 1 from left to right, times 1 on the lower half and 0.75 on the upper
    half."""
    material = replace(holes([[0.75], [1.0]]), alpha=0.8)
    plate, _ = shown(scene_of(material, alpha=[0, 1, 1, 0]))
    x = (np.arange(SIDE) + 0.5) / SIDE
    expected = 0.8 * x * np.where(np.arange(SIDE) < SIDE // 2, 0.75, 1.0)[:, np.newaxis] >= 0.5
    assert (plate == np.where(expected, 0, -1)).all()
    assert 0 < expected.sum() < expected[SIDE // 2 :].sum() * 2


def test_alpha_has_levels():
    """Texels are half a pixel wide, so the level has means, and no texel of the image has these values."""
    rows = np.kron(np.array([[1.0, 0], [0, 1]]), np.ones((8, 8)))
    rows[::2, ::2] = 0.5
    material = replace(holes(rows, mipmapped=True), cutoff=0.8)
    plate, _ = shown(scene_of(material))
    means = rows.reshape(SIDE, 2, SIDE, 2).mean(axis=(1, 3))
    assert set(means.ravel()) == {0.125, 0.875}
    assert (plate == np.where(means >= 0.8, 0, -1)).all()


def test_bad_values_are_refused():
    for looks in ({"alpha": 1.1}, {"alpha": -0.1}, {"cutoff": -1}, {"cutoff": np.nan}, {"cutoff": np.inf}):
        with pytest.raises(ValueError, match=f"a material's {next(iter(looks))} must be"):
            replace(PLAIN, **looks)
    with pytest.raises(ValueError, match="alpha must be 0 to 1"):
        holes([[2.0]])
    with pytest.raises(ValueError, match=r"alpha must have shape \(1, 1\)"):
        Texture(np.ones((1, 1, 3)), alpha=np.ones((1, 2)))
    with pytest.raises(ValueError, match="alpha must be 0 to 1"):
        scene_of(PLAIN, alpha=[np.nan, 1, 1, 1])
    with pytest.raises(ValueError, match=r"alpha must have shape \(4,\)"):
        scene_of(PLAIN, alpha=[1])
