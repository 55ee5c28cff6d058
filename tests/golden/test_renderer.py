import math
from dataclasses import replace

import numpy as np
import pytest

from golden.camera import Camera
from golden.geometry import Mesh, normalise
from golden.interpolation import CURVES, interpolate
from golden.lighting import Light, Material
from golden.raster import fragment_barycentrics, fragment_normals, rasterise
from golden.reflection import REFLECTION_MODELS
from golden.renderer import SHADINGS, render, shade_spans
from golden.scene import Scene

MATERIAL = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.5, 0.4, 0.6), 20)
LIGHTS = (Light((1, 2, 3), (0.9, 0.8, 0.7)), Light((-2, 1, 1), (0.2, 0.3, 0.5)))
BACKGROUND = (0.25, 0.5, 0.75)


def ball(segments=12, rings=7):
    """An ellipsoid with its own normals, open at the poles, so that its inside is seen too."""
    u, v = np.meshgrid(
        np.arange(segments) * 2 * np.pi / segments, np.linspace(0.5, np.pi - 0.3, rings), indexing="ij"
    )
    unit = np.stack((np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)), axis=-1).reshape(-1, 3)
    first = (np.arange(segments)[:, np.newaxis] * rings + np.arange(rings - 1)).reshape(-1)
    second = (first + rings) % (segments * rings)
    faces = np.concatenate(
        (np.column_stack((first, second, second + 1)), np.column_stack((first, second + 1, first + 1)))
    )
    # Outward anticlockwise.
    return Mesh(unit * (1, 0.7, 1.2), faces[:, ::-1].copy(), normalise(unit / (1, 0.7, 1.2)))


def soup(seed, count=14):
    """Triangles that cross each other."""
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1, 1, (3 * count, 3))
    return Mesh(
        vertices,
        np.arange(3 * count).reshape(count, 3),
        normalise(rng.normal((0, 0, 2), size=vertices.shape)),
    )


def scene_of(mesh, camera, width=44, height=33, **options):
    return Scene(mesh, camera, width, height, MATERIAL, LIGHTS, background=BACKGROUND, **options)


def cast(scene, dx=0.0, dy=0.0):
    """Ray through every pixel centre, moved by (dx, dy) pixels: nearest triangle or -1, and shares."""
    camera = scene.camera
    forward = np.subtract(camera.target, camera.position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    column, row = np.meshgrid(np.arange(scene.width) + 0.5 + dx, np.arange(scene.height) + 0.5 + dy)
    across, above = column - scene.width / 2, scene.height / 2 - row
    if camera.projection == "perspective":
        unit = 2 * math.tan(math.radians(camera.field_of_view) / 2) / scene.height
        origin = np.broadcast_to(camera.position, (*column.shape, 3))
        direction = forward + unit * (across[..., np.newaxis] * right + above[..., np.newaxis] * up)
    else:
        unit = camera.height / scene.height
        origin = camera.position + unit * (across[..., np.newaxis] * right + above[..., np.newaxis] * up)
        direction = np.broadcast_to(forward, (*column.shape, 3))
    # origin + depth direction = a + s (b - a) + t (c - a), for every pixel and triangle.
    a, b, c = np.moveaxis(scene.mesh.vertices[scene.mesh.faces], 1, 0)
    matrices = np.empty((*column.shape, len(a), 3, 3))
    matrices[..., 0] = b - a
    matrices[..., 1] = c - a
    matrices[..., 2] = -direction[:, :, np.newaxis]
    offset = origin[:, :, np.newaxis] - a
    s, t, depth = np.moveaxis(np.linalg.solve(matrices, offset[..., np.newaxis])[..., 0], -1, 0)
    hit = (s >= 0) & (t >= 0) & (s + t <= 1) & (depth >= camera.near)
    depth = np.where(hit, depth, np.inf)
    nearest = depth.argmin(axis=-1)[..., np.newaxis]
    s, t = np.take_along_axis(s, nearest, -1), np.take_along_axis(t, nearest, -1)
    shares = np.concatenate((1 - s - t, s, t), axis=-1)
    return np.where(hit.any(axis=-1), nearest[..., 0], -1), shares


def phong_by_rays(scene, triangle, shares):
    """Phong shading with Blinn's model, written out for one hit a pixel."""
    faces = scene.mesh.faces[triangle]
    normal = np.einsum("hwc,hwck->hwk", shares, scene.mesh.normals[faces])
    a, b, c = np.moveaxis(scene.mesh.vertices[faces], 2, 0)
    plane = np.cross(b - a, c - a)
    viewer = np.subtract(scene.camera.position, scene.camera.target)
    viewer = viewer / np.linalg.norm(viewer)
    to_camera = scene.camera.position - a if scene.camera.projection == "perspective" else viewer
    normal[(plane * to_camera).sum(axis=-1) < 0] *= -1
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    image = np.empty(normal.shape)
    for channel in range(3):
        total = np.full(normal.shape[:2], scene.material.ambient[channel])
        for light in scene.lights:
            half = light.direction + viewer
            half = half / np.linalg.norm(half)
            lit = normal @ np.array(light.direction)
            shine = np.maximum(normal @ half, 0) ** scene.material.exponent
            total += light.color[channel] * np.where(
                lit > 0, scene.material.diffuse[channel] * lit + scene.material.specular[channel] * shine, 0
            )
        image[..., channel] = np.clip(total, 0, 1)
    image[triangle < 0] = scene.background
    return image, normal


INSIDE = Camera((0.1, 0.05, 0.3), (0, 0.1, -1), projection="perspective", field_of_view=80, near=0.2)
SCENES = {
    "orthographic": scene_of(ball(), Camera.framing(ball().vertices, (0.4, 0.9, 1), "orthographic", 4 / 3)),
    "perspective": scene_of(
        ball(), Camera.framing(ball().vertices, (0.4, 0.9, 1), "perspective", 4 / 3, field_of_view=75)
    ),
    "crossing": scene_of(soup(1), Camera((0.3, 0.2, 3), (0, 0, 0), height=2.0)),
    "crossing in perspective": scene_of(
        soup(2), Camera((0.3, 0.2, 2.5), (0, 0, 0), projection="perspective", field_of_view=40)
    ),
    # Triangles before, behind and across the near plane; some are seen from behind.
    "near plane": scene_of(soup(3), INSIDE),
    "near plane, many": scene_of(soup(4, 40), INSIDE),
    # So near that corners project millions of pixels away.
    "guard band": scene_of(soup(5, 40), replace(INSIDE, near=1e-7)),
    "orthographic near plane": scene_of(soup(6, 40), Camera((0, 0, 0.1), (0, 0, -1), height=2.0, near=0.2)),
}


@pytest.mark.parametrize("name", SCENES)
def test_phong_against_ray_casting(name):
    scene = SCENES[name]
    raster = rasterise(scene)
    frame = render(scene, "phong", "blinn", raster)
    triangle, shares = cast(scene)
    exact, normal = phong_by_rays(scene, triangle, shares)
    # Corners are rounded to 1/256 pixel, so a pixel shows what lies up to 1/512 pixel away in x and y. Where
    # the corners of a square of twice that size show the same triangle, the pixel must show it, with a color
    # no further away than that of the square's corners.
    stable = np.ones(triangle.shape, dtype=bool)
    spread = np.zeros(exact.shape)
    turn = np.zeros(exact.shape)
    for dx in (-1 / 256, 1 / 256):
        for dy in (-1 / 256, 1 / 256):
            moved, moved_shares = cast(scene, dx, dy)
            stable &= moved == triangle
            moved_exact, moved_normal = phong_by_rays(scene, moved, moved_shares)
            spread = np.maximum(spread, np.abs(moved_exact - exact))
            turn = np.maximum(turn, np.abs(moved_normal - normal))
    assert stable.mean() > 0.9
    assert (stable & (triangle >= 0)).mean() > 0.2
    found = np.full(triangle.size, -1)
    visible = np.flatnonzero(raster.visible)
    found[raster.pixel[visible]] = raster.triangle[raster.span[visible]]
    found = found.reshape(triangle.shape)
    assert (found[stable] == triangle[stable]).all()
    assert (frame.mask == (found >= 0)).all()
    # The light's edge makes one step of a highlight; no pixel stands within 1/256 pixel of it here.
    assert (np.abs(frame.image - exact) <= spread + 1e-9)[stable].all()
    surface = stable & (triangle >= 0)
    assert np.median(spread[surface]) < 0.5 / 255
    normals = np.zeros((triangle.size, 3))
    normals[raster.pixel[visible]] = fragment_normals(scene, raster, visible)
    normals = normals.reshape(normal.shape)
    assert (np.abs(normals - normal) <= turn + 1e-9)[surface].all()
    if "near plane" in name:
        assert raster.outside > 0


def test_perspective_is_not_screen_linear():
    """A floor that runs away from the camera, where linear interpolation would be far off."""
    vertices = np.array([[-1.0, 0, 0], [1, 0, 0], [1, 0, -20], [-1, 0, -20]])
    normals = normalise(np.array([[-1.0, 1, 0], [1, 1, 0], [1, 1, -1], [-1, 1, -1]]))
    mesh = Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), normals)
    scene = scene_of(mesh, Camera((0, 1, 2), (0, 0, -4), projection="perspective", field_of_view=50))
    raster = rasterise(scene)
    _, shares = cast(scene)
    visible = np.flatnonzero(raster.visible)
    found = fragment_barycentrics(raster, visible)
    expected = shares.reshape(-1, 3)[raster.pixel[visible]]
    # 1/256 pixel at the far end of the floor, 22 units away and 1 below: 22^2 / 1 units a focal length of 35
    # pixels, over the floor's 20 units.
    assert found == pytest.approx(expected, abs=22**2 / 35 / 20 / 256)
    assert (raster.magnitude_left > 0).all()


def test_near_plane_pieces_keep_the_order_of_spans():
    raster = rasterise(SCENES["near plane, many"])
    order = np.lexsort((raster.x, raster.y, raster.triangle))
    assert (order == np.arange(len(order))).all()
    assert (np.diff(raster.span) >= 0).all()
    shown = raster.pixel[raster.visible]
    assert len(np.unique(shown)) == len(shown)


def test_flat():
    scene = SCENES["perspective"]
    frame = render(scene, "flat", "phong")
    triangle, _ = cast(scene)
    corners = scene.mesh.vertices[scene.mesh.faces]
    plane = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = Mesh(
        corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), normalise(plane).repeat(3, 0)
    )
    exact = render(replace(scene, mesh=flat), "phong", "phong")
    assert frame.image == pytest.approx(exact.image, abs=1e-12)
    assert (frame.mask == exact.mask).all()
    assert len(np.unique(frame.image[frame.mask], axis=0)) <= len(np.unique(triangle))


def test_gouraud():
    scene = SCENES["perspective"]
    frame = render(scene, "gouraud", "blinn")
    raster = rasterise(scene)
    visible = np.flatnonzero(raster.visible)
    face = scene.mesh.faces[raster.triangle[raster.span[visible]]]
    shares = fragment_barycentrics(raster, visible)
    turned = np.where(raster.back[raster.span[visible]], -1.0, 1.0)
    total = np.zeros((len(visible), 3))
    viewer = scene.camera.viewer
    for corner in range(3):
        normal = scene.mesh.normals[face[:, corner]] * turned[:, np.newaxis]
        color = np.tile(np.array(MATERIAL.ambient), (len(visible), 1))
        for light in LIGHTS:
            half = normalise(light.direction + viewer)
            lit = normal @ np.array(light.direction)
            shine = np.where(lit > 0, np.maximum(normal @ half, 0) ** MATERIAL.exponent, 0)
            color += np.maximum(lit, 0)[:, np.newaxis] * light.color * np.array(MATERIAL.diffuse)
            color += shine[:, np.newaxis] * light.color * np.array(MATERIAL.specular)
        total += shares[:, corner, np.newaxis] * np.minimum(color, 1)
    assert frame.image.reshape(-1, 3)[raster.pixel[visible]] == pytest.approx(total, abs=1e-12)


def test_slerp_and_span_curves():
    scene = SCENES["orthographic"]
    raster = rasterise(scene)
    phong = render(scene, "phong", "blinn", raster)
    # In the orthographic projection vertex normals are linear along a span, but the ends were normalised.
    normalised = shade_spans(scene, raster, "normalised", "blinn")
    slerp = render(scene, "slerp", "blinn", raster)
    assert (slerp.image == shade_spans(scene, raster, "slerp", "blinn")).all()
    assert (slerp.mask == phong.mask).all()
    assert 0 < np.abs(normalised - phong.image).max() < 0.05
    assert 0 < np.abs(slerp.image - normalised).max() < 0.02
    for curve in CURVES:
        image = shade_spans(scene, raster, curve, "cosquad")
        chosen = np.flatnonzero(raster.visible)[::37]
        for fragment in chosen.tolist():
            span = raster.span[fragment]
            last = raster.length[span] - 1
            t = raster.offset[fragment] / last if last else 0.0
            normal = interpolate(curve, raster.normal_left[span], raster.normal_right[span], t)
            expected = np.array(MATERIAL.ambient)
            for light in LIGHTS:
                half = normalise(light.direction + scene.camera.viewer)
                lit = normal @ np.array(light.direction)
                if lit > 0:
                    base = max(MATERIAL.exponent / 2 * (min(normal @ half, 1) - 1) + 1, 0)
                    expected = expected + np.multiply(light.color, MATERIAL.diffuse) * lit
                    expected = expected + np.multiply(light.color, MATERIAL.specular) * base**2
            line, column = divmod(int(raster.pixel[fragment]), scene.width)
            assert image[line, column] == pytest.approx(np.minimum(expected, 1), abs=1e-12)


def test_replaced_spans_are_used():
    scene = SCENES["orthographic"]
    raster = rasterise(scene)
    viewer = np.tile(scene.camera.viewer, (len(raster.x), 1))
    image = shade_spans(scene, replace(raster, normal_left=viewer, normal_right=viewer), "linear", "blinn")
    shown = image.reshape(-1, 3)[raster.pixel[raster.visible]]
    assert np.ptp(shown, axis=0) == pytest.approx((0, 0, 0), abs=1e-12)


@pytest.mark.parametrize("shading", SHADINGS)
def test_every_shading_and_model(shading):
    scene = SCENES["perspective"]
    raster = rasterise(scene)
    images = {model: render(scene, shading, model, raster) for model in REFLECTION_MODELS}
    for frame in images.values():
        assert frame.image.shape == (33, 44, 3)
        assert 0 <= frame.image.min() <= frame.image.max() <= 1
        assert (frame.image[~frame.mask] == BACKGROUND).all()
        assert (frame.image[frame.mask] != BACKGROUND).any()
    # [T], [C]: the approximations stay within 0.17 of Blinn, times the specular of both lights.
    bound = 0.17 * max(sum(light.color[c] for light in LIGHTS) * MATERIAL.specular[c] for c in range(3))
    for model in REFLECTION_MODELS[2:]:
        difference = np.abs(images[model].image - images["blinn"].image).max()
        assert 0 < difference < bound


def test_results_do_not_depend_on_the_chunks(monkeypatch):
    scene = SCENES["perspective"]
    whole = render(scene)
    monkeypatch.setattr("golden.renderer._CHUNK", 29)
    assert render(scene).image == pytest.approx(whole.image, abs=1e-14)


def test_empty_picture_and_refusals():
    scene = SCENES["orthographic"]
    empty = replace(scene, mesh=Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int64), np.zeros((3, 3))))
    for shading in SHADINGS:
        frame = render(empty, shading)
        assert not frame.mask.any()
        assert (frame.image == BACKGROUND).all()
    with pytest.raises(ValueError, match=r"shading must be one of flat, .* not 'toon'"):
        render(empty, "toon")
    for shading in SHADINGS:
        with pytest.raises(ValueError, match=r"model must be one of phong, .* not 'gauss'"):
            render(empty, shading, "gauss")
    with pytest.raises(ValueError, match=r"curve must be one of linear, .* not 'cubic'"):
        shade_spans(empty, rasterise(empty), "cubic", "blinn")
