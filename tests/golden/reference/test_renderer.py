import math
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.curves import CURVES, interpolate
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.raster import face_normals, fragment_barycentrics, fragment_normals, rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import (
    SHADINGS,
    Thresholds,
    fragment_positions,
    gouraud_triangles,
    render,
    shade_operands,
    shade_spans,
)
from blysk.golden.reference.scene import Scene

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
    point = np.einsum("hwc,hwck->hwk", shares, scene.mesh.vertices[faces])
    if scene.viewer == "near":
        viewer = scene.camera.position - point
        viewer = viewer / np.linalg.norm(viewer, axis=-1, keepdims=True)
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    image = np.empty(normal.shape)
    for channel in range(3):
        total = np.full(normal.shape[:2], scene.material.ambient[channel])
        for light in scene.lights:
            towards = light.direction if light.position is None else light.position - point
            towards = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
            half = towards + viewer
            half = half / np.linalg.norm(half, axis=-1, keepdims=True)
            lit = (normal * towards).sum(axis=-1)
            shine = np.maximum((normal * half).sum(axis=-1), 0) ** scene.material.exponent
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
LAMPS = (Light(position=(1.5, 1, 2), color=(0.9, 0.8, 0.7)), Light((-2, 1, 1), (0.2, 0.3, 0.5)))
SCENES |= {
    "point light": replace(SCENES["orthographic"], lights=LAMPS),
    "near viewer": replace(SCENES["perspective"], viewer="near"),
    "point light and near viewer": replace(SCENES["crossing in perspective"], lights=LAMPS, viewer="near"),
    "point light, near viewer and near plane": replace(
        SCENES["near plane, many"], lights=LAMPS, viewer="near"
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_phong_against_ray_casting(name):
    scene = SCENES[name]
    raster = rasterise(scene)
    frame = render(scene, "phong", REFLECTION_MODELS["blinn"], raster)
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
    frame = render(scene, "flat", REFLECTION_MODELS["phong"])
    triangle, _ = cast(scene)
    corners = scene.mesh.vertices[scene.mesh.faces]
    plane = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = Mesh(
        corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), normalise(plane).repeat(3, 0)
    )
    exact = render(replace(scene, mesh=flat), "phong", REFLECTION_MODELS["phong"])
    assert frame.image == pytest.approx(exact.image, abs=1e-12)
    assert (frame.mask == exact.mask).all()
    assert len(np.unique(frame.image[frame.mask], axis=0)) <= len(np.unique(triangle))


def color_by_hand(normal, viewer, lights=LIGHTS, material=MATERIAL):
    """Blinn's color of one normal, saturated; no code of the project's lighting."""
    color = np.array(material.ambient)
    for light in lights:
        half = np.add(light.direction, viewer)
        half = half / np.linalg.norm(half)
        lit = float(np.dot(normal, light.direction))
        if lit > 0:
            shine = max(float(np.dot(normal, half)), 0.0) ** material.exponent
            color = color + np.multiply(light.color, material.diffuse) * lit
            color = color + np.multiply(light.color, material.specular) * shine
    return np.clip(color, 0, 1)


def through_six_points(scene, face, turned, shares):
    """The quadratic through six colors of one face, in two barycentric coordinates, by a system of six."""
    corners = scene.mesh.normals[scene.mesh.faces[face]] * turned
    first, second, third = corners
    nodes = {(1, 0): first, (0, 1): second, (0, 0): third}
    nodes |= {(0.5, 0.5): first + second, (0, 0.5): second + third, (0.5, 0): third + first}
    values = [
        color_by_hand(normal / np.linalg.norm(normal), scene.camera.viewer) for normal in nodes.values()
    ]

    def powers(u, v):
        return [1, u, v, u * u, u * v, v * v]

    polynomial = np.linalg.solve([powers(*place) for place in nodes], values)
    return np.clip(powers(shares[0], shares[1]) @ polynomial, 0, 1)


@pytest.mark.parametrize("name", ["perspective", "orthographic", "near plane"])
def test_quadratic_gouraud_pixel_by_pixel(name):
    scene = SCENES[name]
    raster = rasterise(scene)
    image = render(scene, "quadratic_gouraud", REFLECTION_MODELS["blinn"], raster).image.reshape(-1, 3)
    visible = np.flatnonzero(raster.visible)
    shares = fragment_barycentrics(raster, visible)
    for fragment, share in zip(visible.tolist(), shares, strict=True):
        span = raster.span[fragment]
        turned = -1 if raster.back[span] else 1
        expected = through_six_points(scene, raster.triangle[span], turned, share)
        assert image[raster.pixel[fragment]] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_quadratic_gouraud_is_exact_for_quadratics(projection, monkeypatch):
    """Corners on a circle about the z axis with normals along (x, y, 1): so are all the interpolated normals.

    The colors are made a polynomial of ``N_x/N_z = x`` and ``N_y/N_z = y``. Phong shading is exact for any.
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
    """One lit corner, the other five nodes black: the polynomial falls to -1/8 of it along the edges."""
    normals = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    material = Material((0, 0, 0), (0, 0, 0), (1, 1, 1), 1000)
    camera = Camera((0.3, 0.3, 3), (0.3, 0.3, 0), height=1.2)
    scene = Scene(
        Mesh(vertices, np.array([[0, 1, 2]]), normals), camera, 60, 60, material, (Light((0, 0, 1)),)
    )
    raster = rasterise(scene)
    image = render(scene, "quadratic_gouraud", REFLECTION_MODELS["blinn"], raster).image.reshape(-1, 3)
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
        # The second time seen from behind, with its normals negated.
        turned = Mesh(vertices, mesh.faces[:, ::-1].copy(), -normals) if direction else mesh
        scene = scene_of(turned, camera, 40, 40)
        raster = rasterise(scene)
        assert raster.back.all() == (direction == 1)
        image = render(scene, "quadratic_gouraud", REFLECTION_MODELS["blinn"], raster).image.reshape(-1, 3)
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
    """Faces whose vertices differ by less than the thresholds, one comparison after the other."""
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
    "thresholds", [(0.15, 1, 1), (2, 0.05, 2), (2, 2, 0.2), (0.6, 0.1, 0.3), (0.9, 0.004, 0.008)]
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
    """The trap of appendix В: on a cone about L = V = H the cosines are equal, and the normals far apart."""
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
        none = render(scene, "adaptive", REFLECTION_MODELS["blinn"], raster, Thresholds(0, 0, 0))
        every = render(
            scene, "adaptive", REFLECTION_MODELS["blinn"], raster, Thresholds(math.inf, math.inf, math.inf)
        )
        assert none.image == pytest.approx(
            render(scene, "phong", REFLECTION_MODELS["blinn"], raster).image, abs=1e-14
        )
        assert every.image == pytest.approx(
            render(scene, "gouraud", REFLECTION_MODELS["blinn"], raster).image, abs=1e-14
        )
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
        render(scene, name, REFLECTION_MODELS["blinn"], raster, thresholds).image.reshape(-1, 3)[pixel]
        for name in ("gouraud", "phong", "adaptive")
    )
    assert adaptive == pytest.approx(np.where(linear[:, np.newaxis], gouraud, phong), abs=1e-14)


def test_default_thresholds_are_narrow():
    """What passes them differs from Phong by little: N·L by 0.008, the highlight by n times 0.004.

    Between vertices 1.3 degrees apart N·H and N·L may rise over their ends by ``1 - cos 0.65`` degrees, 7e-5.
    """
    scene = scene_of(ball(500, 300), SCENES["orthographic"].camera)
    raster = rasterise(scene)
    linear = gouraud_triangles(scene)
    assert linear[raster.triangle[raster.span[raster.visible]]].mean() > 0.03
    adaptive, phong = (
        render(scene, name, REFLECTION_MODELS["blinn"], raster) for name in ("adaptive", "phong")
    )
    diffuse, specular = 0.008 + 1e-4, (0.004 + 1e-4) * MATERIAL.exponent
    worst = max(
        sum(light.color[c] for light in LIGHTS)
        * (diffuse * MATERIAL.diffuse[c] + specular * MATERIAL.specular[c])
        for c in range(3)
    )
    # A light's edge is a step of a highlight; none is crossed by a visible triangle of Gouraud here.
    assert 0 < np.abs(adaptive.image - phong.image).max() < worst


@pytest.mark.parametrize("shading", SHADINGS)
def test_turned_back_faces_are_those_of_a_turned_mesh(shading):
    scene = SCENES["perspective"]
    raster = rasterise(scene)
    back = np.zeros(len(scene.mesh.faces), dtype=bool)
    back[raster.triangle] = raster.back
    assert 0 < back[raster.triangle].mean() < 1
    corners = np.where(back[:, np.newaxis], scene.mesh.faces[:, [0, 2, 1]], scene.mesh.faces)
    turn = np.where(back, -1.0, 1.0).repeat(3)[:, np.newaxis]
    mesh = Mesh(
        scene.mesh.vertices[corners.ravel()],
        np.arange(corners.size).reshape(-1, 3),
        scene.mesh.normals[corners.ravel()] * turn,
    )
    thresholds = Thresholds(0.6, 0.2, 0.4)
    flipped = render(scene, shading, REFLECTION_MODELS["blinn"], None, thresholds).image
    same = render(
        replace(scene, mesh=mesh, back_faces="show"), shading, REFLECTION_MODELS["blinn"], None, thresholds
    ).image
    assert flipped == pytest.approx(same, abs=1e-10)
    shown = render(
        replace(scene, back_faces="show"), shading, REFLECTION_MODELS["blinn"], None, thresholds
    ).image
    assert np.abs(shown - flipped).max() > 0.05
    # Without its back faces the picture has holes where they showed.
    culled = render(replace(scene, back_faces="cull"), shading, REFLECTION_MODELS["blinn"], None, thresholds)
    front = np.zeros(culled.mask.size, dtype=bool)
    front[raster.pixel[raster.visible & ~raster.back[raster.span]]] = True
    assert culled.image[front.reshape(culled.mask.shape)] == pytest.approx(
        flipped[front.reshape(culled.mask.shape)], abs=1e-10
    )


def test_gouraud():
    scene = SCENES["perspective"]
    frame = render(scene, "gouraud", REFLECTION_MODELS["blinn"])
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
    phong = render(scene, "phong", REFLECTION_MODELS["blinn"], raster)
    # In the orthographic projection vertex normals are linear along a span, but the ends were normalised.
    normalised = shade_spans(scene, raster, "normalised", REFLECTION_MODELS["blinn"])
    slerp = render(scene, "slerp", REFLECTION_MODELS["blinn"], raster)
    assert (slerp.image == shade_spans(scene, raster, "slerp", REFLECTION_MODELS["blinn"])).all()
    assert (slerp.mask == phong.mask).all()
    assert 0 < np.abs(normalised - phong.image).max() < 0.05
    assert 0 < np.abs(slerp.image - normalised).max() < 0.02
    for curve in CURVES:
        image = shade_spans(scene, raster, curve, REFLECTION_MODELS["cosquad"])
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


def one_span_a_line(left, right, lengths, direction=(0, 0, 1), n=20):
    """A scene and its raster with one span a line, from the same left to the same right normal."""
    lengths = np.asarray(lengths, dtype=np.int32)
    count = len(lengths)
    material = Material((0, 0, 0), (0, 0, 0), (1, 1, 1), n)
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.eye(3))
    scene = Scene(
        mesh, Camera((0, 0, 3), (0, 0, 0), height=2.0), lengths.max(), count, material, (Light(direction),)
    )
    span = np.repeat(np.arange(count), lengths)
    offset = np.arange(len(span)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    raster = replace(
        rasterise(scene),
        normal_left=np.tile(left, (count, 1)),
        normal_right=np.tile(right, (count, 1)),
        length=lengths,
        span=span,
        offset=offset,
        pixel=span * scene.width + offset,
        visible=np.ones(len(span), dtype=bool),
    )
    return scene, raster


def about_the_peak(degrees, turn=0.0):
    """Normals at both sides of the z axis, which is L, V and H, turned by a part of their angle."""
    angle = np.radians(degrees)
    ends = np.array([turn - 0.5, turn + 0.5]) * angle
    return np.stack((np.sin(ends), np.zeros(2), np.cos(ends)), axis=1)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90, 120, 180])
def test_stiff_spans_of_every_angle_and_length(degrees, curve):
    lengths = [1, 2, 3, 16, 4095]
    left, right = about_the_peak(degrees, 0.1)
    scene, raster = one_span_a_line(left, right, lengths)
    image = shade_spans(scene, raster, curve, REFLECTION_MODELS["blinn"])
    for line, length in enumerate(lengths):
        t = np.arange(length) / max(length - 1, 1)
        c = interpolate(curve, left, right, t)[:, 2]
        expected = [min(max(value, 0.0), 1.0) ** 20 for value in c.tolist()]
        assert image[line, :length, 0] == pytest.approx(expected, abs=1e-13)
        assert (image[line, length:] == 0).all()


@pytest.mark.parametrize("n", [1, 2, 3, 10, 100, 500, 1000])
def test_stiff_peak_and_pixels(n):
    """The peak on a pixel, between two, and narrower than a pixel; the highlight inside one span."""
    degrees = 60
    left, right = about_the_peak(degrees)
    lengths = [2, 3, 16, 17, 4095]
    scene, raster = one_span_a_line(left, right, lengths, n=n)
    for model in ("blinn", "cosquad"):
        image = shade_spans(scene, raster, "slerp", REFLECTION_MODELS[model])[..., 0]
        for line, length in enumerate(lengths):
            step = np.radians(degrees) / (length - 1)
            row = image[line, :length]
            # With an even length the nearest pixels are half a step away.
            nearest = 0.0 if length % 2 else step / 2
            top = np.cos(nearest) ** n if model == "blinn" else max(1 - n * np.sin(nearest / 2) ** 2, 0) ** 2
            assert row.max() == pytest.approx(top, abs=1e-12)
            assert row == pytest.approx(row[::-1], abs=1e-12)
    # At n = 1000 two pixels 60 degrees apart miss a highlight that the third, between them, shows whole.
    if n == 1000:
        assert image[0].max() == 0
        assert image[1, :3] == pytest.approx([0, 1, 0], abs=1e-12)
        # Inside the longest span: dark at both ends.
        assert (image[4, [0, -1]] == 0).all()
        assert 0.05 < (image[4] > 0).mean() < 0.2


def test_stiff_opposite_normals_have_no_middle():
    scene, raster = one_span_a_line((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), [3])
    for curve in CURVES:
        image = shade_spans(scene, raster, curve, REFLECTION_MODELS["blinn"])
        # 90 degrees at the ends; 0 in the middle but for the great circle, which goes round.
        assert image[0, [0, 2]] == pytest.approx(np.zeros((2, 3)), abs=1e-300)
        if curve != "slerp":
            assert (image[0, 1] == 0).all()


def test_stiff_normals_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match=r"^vertices and normals must be finite$"):
        Mesh(np.eye(3), np.array([[0, 1, 2]]), np.full((3, 3), np.nan))


@pytest.mark.parametrize("shading", SHADINGS)
def test_stiff_normals_of_no_length(shading):
    """Vertex normals 0 give the face's own where normals are interpolated, the ambient term at a vertex."""
    mesh = ball()
    scene = scene_of(replace(mesh, normals=np.zeros_like(mesh.normals)), SCENES["perspective"].camera)
    raster = rasterise(scene)
    frame, flat = (
        render(scene, name, REFLECTION_MODELS["blinn"], raster).image for name in (shading, "flat")
    )
    visible = np.flatnonzero(raster.visible)
    pixel = raster.pixel[visible]
    found, face = frame.reshape(-1, 3)[pixel], flat.reshape(-1, 3)[pixel]
    share_of_face = np.ones(len(visible))
    if shading in ("gouraud", "adaptive"):
        # Equal, so that adaptive takes them for close.
        share_of_face[:] = 0
    elif shading == "quadratic_gouraud":
        u, v, w = fragment_barycentrics(raster, visible).T
        share_of_face = 4 * (u * v + v * w + w * u)
    expected = MATERIAL.ambient + share_of_face[:, np.newaxis] * (face - MATERIAL.ambient)
    assert found == pytest.approx(np.clip(expected, 0, 1), abs=1e-12)


def test_replaced_spans_are_used():
    scene = SCENES["orthographic"]
    raster = rasterise(scene)
    viewer = np.tile(scene.camera.viewer, (len(raster.x), 1))
    image = shade_spans(
        scene, replace(raster, normal_left=viewer, normal_right=viewer), "linear", REFLECTION_MODELS["blinn"]
    )
    shown = image.reshape(-1, 3)[raster.pixel[raster.visible]]
    assert np.ptp(shown, axis=0) == pytest.approx((0, 0, 0), abs=1e-12)


@pytest.mark.parametrize("shading", SHADINGS)
def test_every_shading_and_model(shading):
    scene = SCENES["perspective"]
    raster = rasterise(scene)
    images = {model: render(scene, shading, REFLECTION_MODELS[model], raster) for model in REFLECTION_MODELS}
    for frame in images.values():
        assert frame.image.shape == (33, 44, 3)
        assert 0 <= frame.image.min() <= frame.image.max() <= 1
        assert (frame.image[~frame.mask] == BACKGROUND).all()
        assert (frame.image[frame.mask] != BACKGROUND).any()
    # [T], [C]: the approximations stay within 0.17 of Blinn, times the specular of both lights.
    bound = 0.17 * max(sum(light.color[c] for light in LIGHTS) * MATERIAL.specular[c] for c in range(3))
    if shading == "quadratic_gouraud":
        # The six weights add up to at most 5/3 in magnitude, in the middle of the triangle.
        bound *= 5 / 3
    for model in list(REFLECTION_MODELS)[2:]:
        difference = np.abs(images[model].image - images["blinn"].image).max()
        assert 0 < difference < bound


@pytest.mark.parametrize("shading", SHADINGS)
def test_results_do_not_depend_on_the_chunks(shading, monkeypatch):
    scene = SCENES["perspective"]
    thresholds = Thresholds(0.6, 0.2, 0.4)
    whole = render(scene, shading, thresholds=thresholds)
    monkeypatch.setattr("blysk.golden.reference.renderer._CHUNK", 29)
    assert render(scene, shading, thresholds=thresholds).image == pytest.approx(whole.image, abs=1e-14)


def test_empty_picture_and_refusals():
    scene = SCENES["orthographic"]
    empty = replace(scene, mesh=Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int64), np.zeros((3, 3))))
    for shading in SHADINGS:
        frame = render(empty, shading)
        assert not frame.mask.any()
        assert (frame.image == BACKGROUND).all()
    with pytest.raises(ValueError, match=r"shading must be one of flat, .* not 'toon'"):
        render(empty, "toon")
    with pytest.raises(ValueError, match=r"curve must be one of linear, .* not 'cubic'"):
        shade_spans(empty, rasterise(empty), "cubic", REFLECTION_MODELS["blinn"])
    for name in ("normal", "highlight", "diffuse"):
        for value in (-0.1, math.nan):
            with pytest.raises(ValueError, match=f"^the {name} threshold must be at least 0, not {value}$"):
                Thresholds(**{name: value})


# Point lights and a near viewer

LOCAL = (
    "point light",
    "near viewer",
    "point light and near viewer",
    "point light, near viewer and near plane",
)


@pytest.mark.parametrize("name", LOCAL)
def test_fragment_positions(name):
    """On their triangles, and projected where their pixels are, to the 1/256 pixel of the vertices."""
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
    # Slivers and clipped triangles stretch the steps.
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
    images = [
        render(s, shading, REFLECTION_MODELS["blinn"], raster, thresholds).image for s in (scene, local)
    ]
    difference = np.abs(images[0] - images[1])
    if shading == "adaptive":
        # A triangle at a threshold may change its method.
        assert np.quantile(difference, 0.99) < 20 / far
    else:
        assert 0 < difference.max() < 20 / far


@pytest.mark.parametrize("shading", SHADINGS)
def test_every_shading_of_point_lights(shading):
    """At the middle of the triangle, at its vertices, at every fragment: as `intensity` has it there."""
    scene = SCENES["point light and near viewer"]
    raster = rasterise(scene)
    image = render(scene, shading, REFLECTION_MODELS["cosquad"], raster, Thresholds(9, 9, 9)).image
    assert 0 <= image.min() <= image.max() <= 1
    distant = replace(scene, lights=LIGHTS, viewer="distant")
    assert (
        np.abs(
            image - render(distant, shading, REFLECTION_MODELS["cosquad"], raster, Thresholds(9, 9, 9)).image
        ).max()
        > 0.05
    )
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
        REFLECTION_MODELS["cosquad"],
        points=points,
    )
    nodes = np.clip(nodes, 0, 1)
    shares = fragment_barycentrics(raster, which) if nodes.shape[1] == 3 else np.ones((len(which), 1))
    expected = np.einsum("fn,fnk->fk", shares, nodes)
    assert image.reshape(-1, 3)[raster.pixel[which]] == pytest.approx(expected, abs=1e-12)


def test_shade_operands():
    """From N·L and N·H of every fragment as from its normal; each triangle with its own material."""
    scene = SCENES["perspective"]
    mesh = replace(scene.mesh, material=np.arange(len(scene.mesh.faces)) % len(SEVERAL))
    scene = replace(scene, mesh=mesh, material=SEVERAL)
    raster = rasterise(scene)
    t = raster.offset / np.maximum(raster.length[raster.span] - 1, 1)
    ends = raster.normal_left[raster.span], raster.normal_right[raster.span]
    normals = interpolate("normalised", *ends, t)
    cosine = np.stack([normals @ light.direction for light in scene.lights], axis=1)
    viewer = scene.camera.viewer
    halves = [normalise(light.direction + viewer) for light in scene.lights]
    highlight = np.stack([normals @ half for half in halves], axis=1)
    found = shade_operands(scene, raster, cosine, highlight, REFLECTION_MODELS["cosquad"])
    assert found == pytest.approx(
        shade_spans(scene, raster, "normalised", REFLECTION_MODELS["cosquad"]), abs=1e-13
    )


def test_local_refusals():
    scene = SCENES["orthographic"]
    with pytest.raises(
        ValueError, match=r"^a near viewer needs a perspective camera; an orthographic one is "
    ):
        replace(scene, viewer="near")
    with pytest.raises(ValueError, match=r"^viewer must be one of distant, near, not 'far'$"):
        replace(scene, viewer="far")
    with pytest.raises(ValueError, match=r"^a near viewer needs the points that it sees$"):
        SCENES["near viewer"].view_vectors()
    scene = SCENES["point light"]
    raster = rasterise(scene)
    raster = replace(raster, weights_left=raster.weights_left[:0], weights_right=raster.weights_right[:0])
    with pytest.raises(ValueError, match=r"^point lights and a near viewer need the weights of the spans$"):
        shade_spans(scene, raster, "normalised", REFLECTION_MODELS["blinn"])


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


# Materials

SEVERAL = (
    MATERIAL,
    Material((0.3, 0, 0), (0.1, 0.9, 0.2), (0.8, 0, 0), 3),
    Material((0, 0, 0), (1,) * 3, (1,) * 3, 200),
)


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_each_triangle_has_its_own_material(shading, model):
    """Pixel by pixel the picture in the one material of the triangle there."""
    mesh = ball()
    mesh = replace(mesh, material=np.random.default_rng(8).integers(0, 3, len(mesh.faces)))
    one = scene_of(ball(), Camera((2, 1, 3), (0, 0, 0)))
    scene = replace(one, mesh=mesh, material=SEVERAL)
    raster = rasterise(scene)
    owner = np.full(scene.width * scene.height, -1)
    owner[raster.pixel[raster.visible]] = mesh.material[raster.triangle[raster.span[raster.visible]]]
    assert np.bincount(owner[owner >= 0], minlength=3).min() > 50
    given = render(scene, shading, REFLECTION_MODELS[model]).image.reshape(-1, 3)
    for index, material in enumerate(SEVERAL):
        alone = render(replace(one, material=material), shading, REFLECTION_MODELS[model])
        own = owner == index
        # The same sums in another order of the pixels: float64 rounding only.
        assert np.abs(given[own] - alone.image.reshape(-1, 3)[own]).max() < 1e-14
    assert (given[owner < 0] == BACKGROUND).all()


def test_materials_that_fit_a_mesh():
    mesh = replace(ball(), material=np.arange(len(ball().faces)) % 2)
    camera = Camera((2, 1, 3), (0, 0, 0))
    for materials in (SEVERAL[:2], list(SEVERAL)):
        scene = Scene(mesh, camera, 4, 4, materials, LIGHTS)
        assert scene.material == scene.materials == tuple(materials)
    assert Scene(ball(), camera, 4, 4, MATERIAL, LIGHTS).materials == (MATERIAL,)
    for few in (MATERIAL, [MATERIAL]):
        with pytest.raises(ValueError, match="the mesh has faces of 2 materials, the scene 1"):
            Scene(mesh, camera, 4, 4, few, LIGHTS)
    with pytest.raises(ValueError, match="the mesh has faces of 1 materials, the scene 0"):
        Scene(ball(), camera, 4, 4, [], LIGHTS)
    with pytest.raises(TypeError, match="a scene's materials must be Material, not str"):
        Scene(mesh, camera, 4, 4, [MATERIAL, "red"], LIGHTS)


@pytest.mark.parametrize("material", [np.zeros(3, int), np.full(144, -1), np.zeros((144, 1), int)])
def test_materials_of_faces_that_are_none(material):
    mesh = ball()
    assert len(mesh.faces) == 144
    assert np.array_equal(mesh.material, np.zeros(144))
    with pytest.raises(ValueError, match="material must be an index of 0 or more for each of the 144 faces"):
        replace(mesh, material=material)
