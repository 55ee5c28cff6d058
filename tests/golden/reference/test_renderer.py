"""Phong shading against ray casting; spans and their curves; materials; refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.curves import CURVES, interpolate
from blysk.golden.reference.fragments import fragment_barycentrics, fragment_normals
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN, COSQUAD, REFLECTION_MODELS
from blysk.golden.reference.renderer import SHADINGS, Thresholds, render, shade_operands, shade_spans
from blysk.golden.reference.scene import Scene

from .scenes import BACKGROUND, LIGHTS, MATERIAL, SCENES, SEVERAL, ball, cast, color_by_hand, scene_of


def phong_by_rays(scene, triangle, shares):
    """Phong shading with Blinn's model, computed for one hit of each pixel."""
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


@pytest.mark.parametrize("name", SCENES)
def test_phong_against_ray_casting(name):
    scene = SCENES[name]
    raster = rasterise(scene)
    frame = render(scene, "phong", BLINN, raster)
    triangle, shares = cast(scene)
    exact, normal = phong_by_rays(scene, triangle, shares)
    # Corners are rounded to 1/256 pixel, so a pixel may show a point that is up to 1/512 pixel away in x and
    # y. Take the square of twice this size around the pixel. If its corners show the same triangle, the pixel
    # must show this triangle. Its colour must then be no further away than the colours of the square's
    # corners.
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
    # The light's edge makes one step of a highlight. No pixel is within 1/256 pixel of this edge.
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
    # 1/256 pixel at the far end of the floor, 22 units away and 1 below: 22^2 / 1 units over a focal length
    # of 35 pixels, divided by the floor's 20 units.
    assert found == pytest.approx(expected, abs=22**2 / 35 / 20 / 256)
    assert (raster.magnitude_left > 0).all()


def test_near_plane_pieces_keep_the_order_of_spans():
    raster = rasterise(SCENES["near plane, many"])
    order = np.lexsort((raster.x, raster.y, raster.triangle))
    assert (order == np.arange(len(order))).all()
    assert (np.diff(raster.span) >= 0).all()
    shown = raster.pixel[raster.visible]
    assert len(np.unique(shown)) == len(shown)


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
    flipped = render(scene, shading, BLINN, None, thresholds).image
    same = render(replace(scene, mesh=mesh, back_faces="show"), shading, BLINN, None, thresholds).image
    assert flipped == pytest.approx(same, abs=1e-10)
    shown = render(replace(scene, back_faces="show"), shading, BLINN, None, thresholds).image
    assert np.abs(shown - flipped).max() > 0.05
    # Without its back faces the picture has holes where they showed.
    culled = render(replace(scene, back_faces="cull"), shading, BLINN, None, thresholds)
    front = np.zeros(culled.mask.size, dtype=bool)
    front[raster.pixel[raster.visible & ~raster.back[raster.span]]] = True
    assert culled.image[front.reshape(culled.mask.shape)] == pytest.approx(
        flipped[front.reshape(culled.mask.shape)], abs=1e-10
    )


def test_slerp_and_span_curves():
    scene = SCENES["orthographic"]
    raster = rasterise(scene)
    phong = render(scene, "phong", BLINN, raster)
    # In the orthographic projection vertex normals are linear along a span, but the ends are normalised.
    normalised = shade_spans(scene, raster, "normalised", BLINN)
    slerp = render(scene, "slerp", BLINN, raster)
    assert (slerp.image == shade_spans(scene, raster, "slerp", BLINN)).all()
    assert (slerp.mask == phong.mask).all()
    assert 0 < np.abs(normalised - phong.image).max() < 0.05
    assert 0 < np.abs(slerp.image - normalised).max() < 0.02
    visible = np.flatnonzero(raster.visible)
    span = raster.span[visible]
    t = raster.offset[visible] / np.maximum(raster.length[span] - 1, 1)
    for curve in CURVES:
        image = shade_spans(scene, raster, curve, COSQUAD).reshape(-1, 3)
        normals = interpolate(curve, raster.normal_left[span], raster.normal_right[span], t)
        expected = color_by_hand(
            normals,
            scene.camera.viewer,
            lambda cosine: np.maximum(MATERIAL.exponent / 2 * (np.minimum(cosine, 1) - 1) + 1, 0) ** 2,
        )
        assert image[raster.pixel[visible]] == pytest.approx(expected, abs=1e-12)


def one_span_a_line(left, right, lengths, direction=(0, 0, 1), n=20):
    """A scene and its raster with one span a line, from the same left normal to the same right normal."""
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
    image = shade_spans(scene, raster, curve, BLINN)
    for line, length in enumerate(lengths):
        t = np.arange(length) / max(length - 1, 1)
        c = interpolate(curve, left, right, t)[:, 2]
        expected = [min(max(value, 0.0), 1.0) ** 20 for value in c.tolist()]
        assert image[line, :length, 0] == pytest.approx(expected, abs=1e-13)
        assert (image[line, length:] == 0).all()


@pytest.mark.parametrize("n", [1, 2, 3, 10, 100, 500, 1000])
def test_stiff_peak_and_pixels(n):
    """The peak is on a pixel, between two pixels, and narrower than a pixel.

    The highlight is inside a span.
    """
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
    # At n = 1000 two pixels 60 degrees apart miss a highlight. A third pixel between them shows it in full.
    if n == 1000:
        assert image[0].max() == 0
        assert image[1, :3] == pytest.approx([0, 1, 0], abs=1e-12)
        # The highlight is inside the longest span, which is dark at both ends.
        assert (image[4, [0, -1]] == 0).all()
        assert 0.05 < (image[4] > 0).mean() < 0.2


def test_stiff_opposite_normals_have_no_middle():
    scene, raster = one_span_a_line((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), [3])
    for curve in CURVES:
        image = shade_spans(scene, raster, curve, BLINN)
        # 90 degrees at the ends; 0 in the middle, except for the great circle, which goes round.
        assert image[0, [0, 2]] == pytest.approx(np.zeros((2, 3)), abs=1e-300)
        if curve != "slerp":
            assert (image[0, 1] == 0).all()


@pytest.mark.parametrize("shading", SHADINGS)
def test_stiff_normals_of_no_length(shading):
    """Vertex normals of 0 give the face's own normal if normals are interpolated, and the ambient term at a
    vertex."""
    mesh = ball()
    scene = scene_of(replace(mesh, normals=np.zeros_like(mesh.normals)), SCENES["perspective"].camera)
    raster = rasterise(scene)
    frame, flat = (render(scene, name, BLINN, raster).image for name in (shading, "flat"))
    visible = np.flatnonzero(raster.visible)
    pixel = raster.pixel[visible]
    found, face = frame.reshape(-1, 3)[pixel], flat.reshape(-1, 3)[pixel]
    share_of_face = np.ones(len(visible))
    if shading in ("gouraud", "adaptive"):
        # The normals are equal, so that adaptive takes them for close.
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
    image = shade_spans(scene, replace(raster, normal_left=viewer, normal_right=viewer), "linear", BLINN)
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
    # A highlight differs from Blinn's by the difference of the models, times the specular colours of both
    # lights.
    bound = max(sum(light.color[c] for light in LIGHTS) * MATERIAL.specular[c] for c in range(3))
    if shading == "quadratic_gouraud":
        # The six weights add up to at most 5/3 in magnitude, in the middle of the triangle.
        bound *= 5 / 3
    cosine, n = np.linspace(-1, 1, 20_001), MATERIAL.exponent
    for name, model in REFLECTION_MODELS.items():
        if name != "blinn" and not model.MIRROR:
            largest = np.abs(model.reflect(cosine, n) - BLINN.reflect(cosine, n)).max()
            difference = np.abs(images[name].image - images["blinn"].image).max()
            assert 0 < difference <= bound * largest * (1 + 1e-3), name


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
        shade_spans(empty, rasterise(empty), "cubic", BLINN)
    for name in ("normal", "highlight", "diffuse"):
        for value in (-0.1, math.nan):
            with pytest.raises(ValueError, match=f"^the {name} threshold must be at least 0, not {value}$"):
                Thresholds(**{name: value})


def test_shade_operands():
    """Shading from N·L and N·H of every fragment gives the same as from its normal.

    Each triangle has its own material.
    """
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
    found = shade_operands(scene, raster, cosine, highlight, COSQUAD)
    assert found == pytest.approx(shade_spans(scene, raster, "normalised", COSQUAD), abs=1e-13)


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_each_triangle_has_its_own_material(shading, model):
    """Pixel by pixel the picture equals the picture in which all triangles have the material of the triangle
    there."""
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
        # The sums are the same in another order of the pixels, except for the rounding of float64.
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
