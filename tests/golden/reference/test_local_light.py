"""Rendering with point lights and a near viewer."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.faces import face_normals
from blysk.golden.reference.fragments import fragment_barycentrics
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, intensity
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN, COSQUAD
from blysk.golden.reference.renderer import SHADINGS, Thresholds, fragment_positions, render, shade_spans

from .scenes import LIGHTS, SCENES

LOCAL = (
    "point light",
    "near viewer",
    "point light and near viewer",
    "point light, near viewer and near plane",
)


@pytest.mark.parametrize("name", LOCAL)
def test_fragment_positions(name):
    """Fragments lie on their triangles, and project to their pixels within the 1/256 pixel of the
    vertices."""
    scene = SCENES[name]
    raster = rasterise(scene)
    points = fragment_positions(scene, raster, np.arange(len(raster.span)))
    triangle = raster.triangle[raster.span]
    corner = scene.mesh.vertices[scene.mesh.faces[triangle, 0]]
    plane = face_normals(scene.mesh)[triangle]
    assert np.abs(((points - corner) * plane).sum(axis=1)).max() < 1e-12
    x, y, _ = scene.camera.project(points, scene.width, scene.height).T
    centre = raster.pixel % scene.width + 0.5, raster.pixel // scene.width + 0.5
    miss = np.hypot(x - centre[0], y - centre[1])
    # Slivers and clipped triangles make the steps longer.
    assert np.median(miss) < 2 / 256
    assert np.quantile(miss, 0.95) < 0.1


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("far", [1e3, 1e6])
def test_far_lamps_and_a_far_camera_are_distant(shading, far):
    """Every shading tends to that of directions, as 1 / distance."""
    scene = SCENES["perspective"]
    camera = Camera(
        tuple(far * scene.camera.viewer), (0, 0, 0), projection="perspective", field_of_view=170 / far
    )
    scene = replace(scene, camera=camera)
    lamps = [Light(position=far * np.array(light.direction), color=light.color) for light in LIGHTS]
    raster = rasterise(scene)
    thresholds = Thresholds(0.6, 0.2, 0.4)
    local = replace(scene, lights=lamps, viewer="near")
    assert local.local
    assert not scene.local
    images = [render(s, shading, BLINN, raster, thresholds).image for s in (scene, local)]
    difference = np.abs(images[0] - images[1])
    if shading == "adaptive":
        # A triangle at a threshold may change its method.
        assert np.quantile(difference, 0.99) < 20 / far
    else:
        assert 0 < difference.max() < 20 / far


@pytest.mark.parametrize("shading", SHADINGS)
def test_every_shading_of_point_lights(shading):
    """At the middle of the triangle, at its vertices, and at every fragment, colours are those of
    `intensity`."""
    scene = SCENES["point light and near viewer"]
    raster = rasterise(scene)
    image = render(scene, shading, COSQUAD, raster, Thresholds(9, 9, 9)).image
    assert 0 <= image.min() <= image.max() <= 1
    distant = replace(scene, lights=LIGHTS, viewer="distant")
    assert np.abs(image - render(distant, shading, COSQUAD, raster, Thresholds(9, 9, 9)).image).max() > 0.05
    which = np.flatnonzero(raster.visible)
    triangle = raster.triangle[raster.span[which]]
    back = raster.back[raster.span[which]][:, np.newaxis, np.newaxis]
    corners = scene.mesh.vertices[scene.mesh.faces[triangle]]
    if shading == "flat":
        points, normals = (
            corners.mean(axis=1, keepdims=True),
            face_normals(scene.mesh)[triangle][:, np.newaxis],
        )
    elif shading in ("gouraud", "adaptive"):
        points, normals = corners, scene.mesh.normals[scene.mesh.faces[triangle]]
    else:
        return
    normals = np.where(back, -normals, normals)
    viewer = normalise(scene.camera.position - points)
    nodes = intensity(
        normals,
        scene.material,
        scene.lights,
        scene.ambient_light,
        viewer,
        COSQUAD,
        points=points,
    )
    nodes = np.clip(nodes, 0, 1)
    shares = fragment_barycentrics(raster, which) if nodes.shape[1] == 3 else np.ones((len(which), 1))
    expected = np.einsum("fn,fnk->fk", shares, nodes)
    assert image.reshape(-1, 3)[raster.pixel[which]] == pytest.approx(expected, abs=1e-12)


def test_local_refusals():
    scene = SCENES["orthographic"]
    with pytest.raises(
        ValueError, match=r"^a near viewer needs a perspective camera, not an orthographic camera$"
    ):
        replace(scene, viewer="near")
    with pytest.raises(ValueError, match=r"^viewer must be one of distant, near, not 'far'$"):
        replace(scene, viewer="far")
    with pytest.raises(ValueError, match=r"^a near viewer needs the points that it sees$"):
        SCENES["near viewer"].view_vectors()
    scene = SCENES["point light"]
    raster = rasterise(scene)
    raster = replace(raster, weights_left=raster.weights_left[:0], weights_right=raster.weights_right[:0])
    with pytest.raises(ValueError, match=r"^point lights, a near viewer and an albedo need the weights"):
        shade_spans(scene, raster, "normalised", BLINN)


def test_local_results_do_not_depend_on_the_chunks(monkeypatch):
    scene = SCENES["point light and near viewer"]
    images = []
    for chunk in (1 << 18, 29):
        monkeypatch.setattr("blysk.golden.reference.renderer._CHUNK", chunk)
        images += [render(scene, shading).image for shading in ("phong", "slerp", "adaptive")]
    for whole, parts in zip(images[:3], images[3:], strict=True):
        assert parts == pytest.approx(whole, abs=1e-14)


def test_view_vectors():
    scene = SCENES["near viewer"]
    points = np.array([[0.0, 0, 0], scene.camera.position, [1, 2, -3]])
    found = scene.view_vectors(points)
    assert found[0] == pytest.approx(normalise(scene.camera.position))
    assert not found[1].any()
    assert found[2] * np.linalg.norm(scene.camera.position - points[2]) == pytest.approx(
        scene.camera.position - points[2]
    )
    assert replace(scene, viewer="distant").view_vectors() == pytest.approx(scene.camera.viewer)
