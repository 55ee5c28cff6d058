"""Triangles divided for levels of textures: depths of edges, no gap, the same surface."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.scene_triangles import scene_triangles
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.divide import EDGE_DEPTH_RATIO, divided
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

CORNERS = np.array([(x, 0.0, z) for z in (-10, 10) for x in (-5, 5)])
TEXTURE = Texture(np.random.default_rng(1).random((64, 64, 3)))


def floor(position):
    """Two triangles of a floor with a texture of seven levels."""
    colors = (CORNERS - CORNERS.min(axis=0)) / 20
    mesh = Mesh(CORNERS, np.array([(0, 2, 1), (1, 2, 3)]), np.tile([0, 1.0, 0], (4, 1)), colors=colors)
    mesh = replace(mesh, coordinates=CORNERS[:, ::2] / 2, material=np.array([0, 1]))
    camera = Camera(position, (0, 0, -10), projection="perspective", field_of_view=50)
    look = Material((0.1,) * 3, (0.6,) * 3, (0.3,) * 3, 50, texture=TEXTURE)
    return Scene(mesh, camera, 80, 60, (look, look), (Light((0.3, 1, 0.5)),))


@pytest.mark.parametrize("position", [(0, 1, 12), (0, 1, 8), (1, 0.3, 0)])
def test_levels_of_triangles_are_those_of_spans(position):
    """In front of the floor, over its edge and in its middle; hardly a level is another, and none by two."""
    scene = floor(position)
    found = divided(scene)
    raster, whole = rasterise(found), rasterise(scene)
    assert 50 < len(found.mesh.faces) < 200
    sent = scene_triangles(found, surface=AttributeSpans(coordinates=True))
    off = np.repeat(raster.level - sent.levels[raster.triangle], raster.length)
    assert np.abs(off).max() <= 1
    assert (off != 0).mean() < 0.25
    # No gap: the same pixels, but for those at the border of the floor.
    pixels = [np.zeros(scene.width * scene.height, dtype=bool) for _ in range(2)]
    for covered, of in zip(pixels, (raster, whole), strict=True):
        covered[of.pixel] = True
    assert np.count_nonzero(pixels[0] ^ pixels[1]) <= 2


def test_the_surface_stays_the_same():
    """Every new vertex has the colours, texture coordinates and normals of its place; materials are kept."""
    found = divided(floor((0, 1, 8)))
    mesh = found.mesh
    np.testing.assert_allclose(mesh.colors, (mesh.vertices - CORNERS.min(axis=0)) / 20, atol=1e-12)
    np.testing.assert_allclose(mesh.coordinates, mesh.vertices[:, ::2] / 2, atol=1e-12)
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 1.0, 0], (len(mesh.vertices), 1)))
    corners = mesh.vertices[mesh.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[:, 1] > 0).all()
    for material in (0, 1):
        assert normal[mesh.material == material, 1].sum() == pytest.approx(200)
    # Each edge has two sides, except those of the border, which lie on it.
    sides = Counter(map(frozenset, mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()))
    for edge, count in sides.items():
        ends = mesh.vertices[list(edge)]
        border = (np.abs(ends[:, [0, 2]]) == [5, 10]).all(axis=0).any()
        assert count == 2 - border


def test_edges_in_the_picture_have_near_depths():
    scene = divided(floor((0, 1, 12)))
    depth = scene.camera.homogeneous(scene.mesh.vertices, scene.width, scene.height)[:, 2]
    of = depth[scene.mesh.faces]
    assert (of.max(axis=1) <= EDGE_DEPTH_RATIO**2 * of.min(axis=1)).mean() > 0.9
    assert depth.max() / depth.min() > 5


def test_scenes_without_need_are_not_divided():
    scene = floor((0, 1, 12))
    plain = tuple(replace(of, texture=replace(TEXTURE, mipmapped=False)) for of in scene.materials)
    for same in (
        replace(scene, camera=replace(scene.camera, projection="orthographic")),
        replace(scene, material=plain),
        replace(scene, camera=replace(scene.camera, position=(0, 1, 500))),
    ):
        assert divided(same) is same
