"""Flat, Gouraud, quadratic Gouraud and adaptive shading against sums by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.fragments import fragment_barycentrics
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN, PHONG
from blysk.golden.reference.renderer import Thresholds, gouraud_triangles, render
from blysk.golden.reference.scene import Scene

from .scenes import LIGHTS, MATERIAL, SCENES, ball, cast, color_by_hand, scene_of


def test_flat():
    scene = SCENES["perspective"]
    frame = render(scene, "flat", PHONG)
    triangle, _ = cast(scene)
    corners = scene.mesh.vertices[scene.mesh.faces]
    plane = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = Mesh(
        corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), normalise(plane).repeat(3, 0)
    )
    exact = render(replace(scene, mesh=flat), "phong", PHONG)
    assert frame.image == pytest.approx(exact.image, abs=1e-12)
    assert (frame.mask == exact.mask).all()
    assert len(np.unique(frame.image[frame.mask], axis=0)) <= len(np.unique(triangle))


def corners_of(scene, raster):
    """Visible fragments. For each: the normals at the corners as they are seen, and its shares of them."""
    visible = np.flatnonzero(raster.visible)
    span = raster.span[visible]
    turn = np.where(raster.back[span], -1.0, 1.0)[:, np.newaxis, np.newaxis]
    normals = scene.mesh.normals[scene.mesh.faces[raster.triangle[span]]] * turn
    return visible, normals, fragment_barycentrics(raster, visible)


def test_gouraud():
    scene = SCENES["perspective"]
    raster = rasterise(scene)
    visible, corners, shares = corners_of(scene, raster)
    expected = np.einsum("fc,fck->fk", shares, color_by_hand(corners, scene.camera.viewer))
    image = render(scene, "gouraud", BLINN).image.reshape(-1, 3)
    assert image[raster.pixel[visible]] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", ["perspective", "orthographic", "near plane"])
def test_quadratic_gouraud_pixel_by_pixel(name):
    """The quadratic through six colours of each face, in two barycentric coordinates, by a system of six
    equations."""
    scene = SCENES[name]
    raster = rasterise(scene)
    image = render(scene, "quadratic_gouraud", BLINN, raster).image.reshape(-1, 3)
    visible, corners, shares = corners_of(scene, raster)
    nodes = np.concatenate((corners, corners + np.roll(corners, -1, axis=1)), axis=1)

    def powers(u, v):
        return np.stack([u**0, u, v, u * u, u * v, v * v], axis=-1)

    # First, second and third corner, and the middles of the edges from each corner to the next.
    places = np.array([[1, 0, 0, 0.5, 0, 0.5], [0, 1, 0, 0.5, 0.5, 0]])
    polynomial = np.linalg.solve(powers(*places), color_by_hand(normalise(nodes), scene.camera.viewer))
    expected = np.einsum("fp,fpk->fk", powers(shares[:, 0], shares[:, 1]), polynomial)
    assert image[raster.pixel[visible]] == pytest.approx(np.clip(expected, 0, 1), abs=1e-12)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_quadratic_gouraud_is_exact_for_quadratics(projection, monkeypatch):
    """Corners on a circle about the z axis with normals along (x, y, 1), so interpolated normals are of this
    form, too.

    The colours are made a polynomial of ``N_x/N_z = x`` and ``N_y/N_z = y``. For these colours both shadings
    are exact.
    """
    angle = np.array([0.3, 2.2, 4.4])
    vertices = 0.8 * np.stack((np.cos(angle), np.sin(angle), np.zeros(3)), axis=1)
    mesh = Mesh(vertices, np.array([[0, 1, 2]]), normalise(vertices + np.array([0, 0, 1])))
    camera = Camera((0.4, 0.3, 3), (0, 0, 0), projection=projection, height=2.0, field_of_view=40)
    scene = scene_of(mesh, camera, 60, 50)

    def polynomial(cubic):
        def color(normals, *_):
            x, y = normals[..., 0] / normals[..., 2], normals[..., 1] / normals[..., 2]
            first = 0.4 + 0.3 * x - 0.2 * y + 0.2 * x * x - 0.1 * x * y + 0.15 * y * y
            return np.stack((first, 0.5 - 0.4 * x * y, 0.5 + cubic * x * y * y), axis=-1)

        return color

    for cubic in (0.0, 0.5):
        monkeypatch.setattr("blysk.golden.reference.renderer.intensity", polynomial(cubic))
        images = {
            shading: render(scene, shading).image for shading in ("gouraud", "quadratic_gouraud", "phong")
        }
        off = {name: np.abs(image - images["phong"]).max(axis=(0, 1)) for name, image in images.items()}
        assert (off["gouraud"][:2] > 0.02).all()
        assert off["quadratic_gouraud"][:2] == pytest.approx(0, abs=1e-12)
        assert (off["quadratic_gouraud"][2] > 0.01) == (cubic > 0)


def test_quadratic_gouraud_is_nearer_to_phong():
    scene = SCENES["orthographic"]
    exact = render(scene, "phong").image
    linear, quadratic = (
        np.abs(render(scene, name).image - exact) for name in ("gouraud", "quadratic_gouraud")
    )
    assert quadratic.mean() < linear.mean() / 3


def test_quadratic_gouraud_stays_in_range():
    """One corner is lit, and the other five nodes are black. The polynomial falls to -1/8 along the edges."""
    normals = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    material = Material((0, 0, 0), (0, 0, 0), (1, 1, 1), 1000)
    camera = Camera((0.3, 0.3, 3), (0.3, 0.3, 0), height=1.2)
    scene = Scene(
        Mesh(vertices, np.array([[0, 1, 2]]), normals), camera, 60, 60, material, (Light((0, 0, 1)),)
    )
    raster = rasterise(scene)
    image = render(scene, "quadratic_gouraud", BLINN, raster).image.reshape(-1, 3)
    visible = np.flatnonzero(raster.visible)
    share = fragment_barycentrics(raster, visible)[:, 0]
    raw = share * (2 * share - 1)
    assert raw.min() < -0.12
    assert image[raster.pixel[visible], 0] == pytest.approx(np.maximum(raw, 0), abs=1e-12)


def test_middle_of_opposite_normals_is_the_face():
    vertices = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    normals = np.array([[0.0, 1, 0], [0, -1, 0], [0.6, 0, 0.8]])
    mesh = Mesh(vertices, np.array([[0, 1, 2]]), normals)
    camera = Camera((0, 0, 3), (0, 0, 0), height=2.2)
    for direction in (0, 1):
        # The second time the triangle is seen from behind, with its normals negated.
        turned = Mesh(vertices, mesh.faces[:, ::-1].copy(), -normals) if direction else mesh
        scene = scene_of(turned, camera, 40, 40)
        raster = rasterise(scene)
        assert raster.back.all() == (direction == 1)
        image = render(scene, "quadratic_gouraud", BLINN, raster).image.reshape(-1, 3)
        visible = np.flatnonzero(raster.visible)
        share = fragment_barycentrics(raster, visible)[:, :: -1 if direction else 1]
        chosen = (share[:, 0] * share[:, 1]).argmax()
        u, v, w = share[chosen]
        node = [color_by_hand(n, (0, 0, 1)) for n in (*normals, (0, 0, 1))]
        node += [color_by_hand(normalise(normals[2] + normals[end]), (0, 0, 1)) for end in (0, 1)]
        shares = (u * (2 * u - 1), v * (2 * v - 1), w * (2 * w - 1), 4 * u * v, 4 * w * u, 4 * v * w)
        assert image[raster.pixel[visible[chosen]]] == pytest.approx(
            np.clip(shares @ np.array(node), 0, 1), abs=1e-12
        )


def close_by_hand(scene, normal, highlight, diffuse):
    """Faces whose vertices differ by less than the thresholds, by three comparisons."""
    result = []
    for face in scene.mesh.faces.tolist():
        close = True
        for a, b in ((0, 1), (0, 2), (1, 2)):
            first, second = scene.mesh.normals[face[a]], scene.mesh.normals[face[b]]
            close = close and math.dist(first, second) < normal
            for light in scene.lights:
                half = np.add(light.direction, scene.camera.viewer)
                half = half / np.linalg.norm(half)
                close = close and abs(first @ half - second @ half) < highlight
                close = close and abs(first @ light.direction - second @ light.direction) < diffuse
        result.append(close)
    return np.array(result)


@pytest.mark.parametrize(
    "thresholds",
    [
        *(pytest.param(of, marks=pytest.mark.long) for of in ((0.15, 1, 1), (2, 0.05, 2), (2, 2, 0.2))),
        *((0.6, 0.1, 0.3), (0.9, 0.004, 0.008)),
    ],
)
def test_triangles_for_gouraud(thresholds):
    scene = scene_of(ball(40, 25), SCENES["perspective"].camera)
    found = gouraud_triangles(scene, Thresholds(*thresholds))
    assert found.dtype == bool
    assert (found == close_by_hand(scene, *thresholds)).all()
    assert found.any() != (thresholds[1] == 0.004)
    assert not found.all()
    if thresholds == (0.9, 0.004, 0.008):
        assert (gouraud_triangles(scene) == found).all()


def test_normals_far_apart_are_not_close():
    """This is the fault of appendix В: on a cone about L = V = H the cosines are equal, and the normals far
    apart."""
    turn = np.array([0, 2, 4]) * np.pi / 3
    for degrees, close in ((0, True), (20, True), (40, False)):
        slope = np.radians(degrees)
        normals = np.stack(
            (np.sin(slope) * np.cos(turn), np.sin(slope) * np.sin(turn), np.full(3, np.cos(slope))), axis=1
        )
        mesh = Mesh(normals, np.array([[0, 1, 2]]), normals)
        scene = Scene(mesh, Camera((0, 0, 3), (0, 0, 0), height=2.0), 8, 8, MATERIAL, (Light((0, 0, 1)),))
        # |N_a - N_b| = sqrt 3 sin: 0.59 at 20 degrees, 1.11 at 40.
        assert gouraud_triangles(scene).tolist() == [close]


def test_thresholds_at_their_ends():
    for name in ("perspective", "crossing"):
        scene = SCENES[name]
        raster = rasterise(scene)
        none = render(scene, "adaptive", BLINN, raster, Thresholds(0, 0, 0))
        every = render(scene, "adaptive", BLINN, raster, Thresholds(math.inf, math.inf, math.inf))
        assert none.image == pytest.approx(render(scene, "phong", BLINN, raster).image, abs=1e-14)
        assert every.image == pytest.approx(render(scene, "gouraud", BLINN, raster).image, abs=1e-14)
        assert not gouraud_triangles(scene, Thresholds(0, 0, 0)).any()
        assert gouraud_triangles(scene, Thresholds(math.inf, math.inf, math.inf)).all()


def test_adaptive_takes_each_triangle_from_one_method():
    scene = SCENES["perspective"]
    raster = rasterise(scene)
    thresholds = Thresholds(0.6, 0.2, 0.4)
    linear = close_by_hand(scene, 0.6, 0.2, 0.4)[raster.triangle[raster.span[raster.visible]]]
    assert 0.1 < linear.mean() < 0.9
    pixel = raster.pixel[raster.visible]
    gouraud, phong, adaptive = (
        render(scene, name, BLINN, raster, thresholds).image.reshape(-1, 3)[pixel]
        for name in ("gouraud", "phong", "adaptive")
    )
    assert adaptive == pytest.approx(np.where(linear[:, np.newaxis], gouraud, phong), abs=1e-14)


def test_default_thresholds_are_narrow():
    """A face within the thresholds differs little from Phong: by 0.008 in N·L, and by n times 0.004 in the
    highlight.

    Between vertices 1.3 degrees apart N·H and N·L may exceed the values at both ends by ``1 - cos 0.65``
    degrees, 7e-5.
    """
    scene = scene_of(ball(500, 300), SCENES["orthographic"].camera)
    raster = rasterise(scene)
    linear = gouraud_triangles(scene)
    assert linear[raster.triangle[raster.span[raster.visible]]].mean() > 0.03
    adaptive, phong = (render(scene, name, BLINN, raster) for name in ("adaptive", "phong"))
    diffuse, specular = 0.008 + 1e-4, (0.004 + 1e-4) * MATERIAL.exponent
    worst = max(
        sum(light.color[c] for light in LIGHTS)
        * (diffuse * MATERIAL.diffuse[c] + specular * MATERIAL.specular[c])
        for c in range(3)
    )
    # A light's edge is a step of a highlight. No visible triangle of Gouraud shading crosses an edge here.
    assert 0 < np.abs(adaptive.image - phong.image).max() < worst
