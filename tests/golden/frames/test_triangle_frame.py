"""Frames by the models of geometry, shading and depth test, against exact normals of every pixel."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.compare import compare_image, compare_triangles
from blysk.golden.frames.prepare import constants_of
from blysk.golden.frames.surface import design_for
from blysk.golden.frames.triangle_frame import sent_triangles, triangle_frame
from blysk.golden.geometry.geometry import Geometry
from blysk.golden.presets import preset
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.golden.reference.texture import Texture
from blysk.golden.render import Renderer
from blysk.sim.api.scene import scene

METHODS = "quadratic", "renormalise"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("triangles", "exponent"), [(220, 1), (1000, 20), (220, 100), (1000, 1000)])
def test_within_one_lsb_of_exact_normals(method, triangles, exponent):
    """The frame covers the pixels of the float64 rasteriser and no others.

    At each pixel the error is within one LSB.
    """
    drawn = scene("teapot", size=(160, 120), triangles=triangles, exponent=exponent)
    renderer = Renderer(preset(method, "cosquad", operand="one_minus_cosine"))
    frame = triangle_frame(drawn, renderer)
    exact = render(drawn, "phong", renderer.design.specular.reflection)
    np.testing.assert_array_equal(frame.owner >= 0, exact.mask)
    error = np.abs(frame.image - exact.image * 255)[exact.mask]
    assert 0.4 < error.max() < 0.6
    compared = compare_image(drawn, renderer.design, frame.image)
    assert compared.method_error.max_lsb == pytest.approx(error.max())
    assert compared.visible_pixels == exact.mask.sum()
    assert np.isnan(compared.arithmetic_error.max_lsb)


@pytest.mark.parametrize(
    ("model", "triangles", "exponent", "back_faces"),
    [
        ("blinn", 1000, 50, "flip"),
        ("blinn", 1000, 1000, "cull"),
        ("blinn", 64, 50, "flip"),
        ("phong", 1000, 50, "flip"),
        ("phong", 1000, 1000, "cull"),
    ],
)
def test_vectors_within_0_6_lsb_of_exact_normals(model, triangles, exponent, back_faces):
    """With the quotient method and one light hardly any pixel is not the nearest code."""
    drawn = scene("teapot", size=(160, 120), triangles=triangles, exponent=exponent, back_faces=back_faces)
    renderer = Renderer(preset("quotient", model))
    frame, exact = triangle_frame(drawn, renderer), render(drawn, "phong", REFLECTION_MODELS[model])
    np.testing.assert_array_equal(frame.owner >= 0, exact.mask)
    error = np.abs(frame.image - exact.image * 255)[exact.mask]
    assert 0.49 < error.max() < 0.6
    assert 0 < (error > 0.5).mean() < 0.01
    # There are more pieces than spans only if normals turn far along a span.
    raster = rasterise(drawn)
    whole = len(raster.length) + raster.hidden_spans
    assert (back_faces == "flip") == (raster.culled == 0)
    assert frame.counts["spans"] <= (1.01 if triangles > 64 else 1.5) * whole
    assert frame.counts["cut"] <= frame.counts["spans"] - whole


LIGHTS = (-0.5, 0.8, 0.7), (1.0, 0.2, 0.4), (0.3, -1.0, 0.6), (0.2, 1.0, -0.5)
"""Directions of lights. The last light is behind the horizon for most of the visible surface."""


@pytest.mark.parametrize(
    ("model", "lights", "triangles", "exponent"),
    [("blinn", 2, 1000, 50), ("blinn", 4, 64, 1000), ("phong", 2, 64, 50), ("phong", 3, 1000, 1000)],
)
def test_vectors_of_several_lights(model, lights, triangles, exponent):
    """Vectors are turned into the frame of each light. The exact frame takes only the lights' directions."""
    drawn = scene("teapot", size=(160, 120), triangles=triangles, exponent=exponent, lights=LIGHTS[:lights])
    # A light that the scene does not have is black.
    renderer = Renderer(preset("quotient", model, lights=max(lights, 3)))
    frame, exact = triangle_frame(drawn, renderer), render(drawn, "phong", REFLECTION_MODELS[model])
    np.testing.assert_array_equal(frame.owner >= 0, exact.mask)
    error = np.abs(frame.image - exact.image * 255)[exact.mask]
    assert 0.49 < error.max() < 0.6
    assert 0 < (error > 0.5).mean() < 0.01
    with pytest.raises(ValueError, match="axes of further lights"):
        renderer.compute(frame.sent.triangles, frame.sent.frame, constants_of(drawn, renderer.design))


@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_first_light_off(model):
    """The first light is off and lights nothing. The squares of other lights still come from its frame."""
    drawn = scene("teapot", size=(96, 72), triangles=220, exponent=20, lights=LIGHTS[:3])
    lights = (replace(drawn.lights[0], color=(0.0, 0.0, 0.0)), *drawn.lights[1:])
    drawn = replace(drawn, lights=lights)
    frame = triangle_frame(drawn, Renderer(preset("quotient", model, lights=3)))
    exact = render(drawn, "phong", REFLECTION_MODELS[model])
    assert np.abs(frame.image - exact.image * 255)[exact.mask].max() < 0.6


def test_normals_that_are_longer_than_1():
    """Files may have normals longer than 1.

    One factor shortens the normals of a triangle, so that nothing wraps.
    """
    drawn = scene("teapot", size=(64, 48), triangles=220, lights=LIGHTS[:2])
    mesh = replace(drawn.mesh, normals=drawn.mesh.normals * (1 + 2.0**-8))
    renderer = Renderer(preset("quotient", "blinn", lights=2))
    sent = sent_triangles(replace(drawn, mesh=mesh), renderer)
    longest = np.linalg.norm(sent.triangles.normal * 2.0**-23, axis=2).max(axis=1)
    assert (np.abs(longest - 1) < 2.0**-22).all()
    error = triangle_frame(replace(drawn, mesh=mesh), renderer).image.astype(int)
    assert np.abs(error - triangle_frame(drawn, renderer).image).max() <= 1


@pytest.mark.parametrize("lights", [1, 3])
def test_vectors_without_highlights(lights):
    """The z axis of a frame is along its light."""
    drawn = scene("teapot", size=(64, 48), triangles=220, specular=0, lights=LIGHTS[:lights])
    frame = triangle_frame(drawn, Renderer(preset("quotient", None, lights=lights)))
    exact = render(drawn, "phong", REFLECTION_MODELS["blinn"])
    error = np.abs(frame.image - exact.image * 255)[exact.mask]
    assert 0.4 < error.max() < 0.6


def test_another_surface_only_within_the_depths_rounding():
    """Where another sheet shows, its depth in float64 is nearly equal.

    The sheets are folded flat at their common edge.
    """
    drawn = scene("teapot", size=(640, 480), triangles=64)
    frame = triangle_frame(drawn, Renderer(preset("renormalise", x_bits=10, y_bits=9)))
    raster = rasterise(drawn)
    owner = np.full(frame.owner.size, -1)
    owner[raster.pixel[raster.visible]] = raster.triangle[raster.span[raster.visible]]
    owner = owner.reshape(frame.owner.shape)
    np.testing.assert_array_equal(frame.owner >= 0, owner >= 0)
    y, x = np.nonzero(owner != frame.owner)
    assert 100 < len(x) < 250

    corner = drawn.camera.homogeneous(drawn.mesh.vertices, drawn.width, drawn.height)[drawn.mesh.faces]
    steps = (2.0**24 - 2) / np.ptp(1 / corner[..., 2])
    ones = np.ones((len(x), 3))
    target = np.stack([x + 0.5, y + 0.5, ones[:, 0]], axis=-1)[..., np.newaxis]

    def nearness(faces):
        place = np.rint(corner[faces, :, :2] / corner[faces, :, 2:3] * 256) / 256
        weight = np.linalg.solve(np.stack([*np.moveaxis(place, -1, 0), ones], axis=1), target)[..., 0]
        return steps * (weight / corner[faces, :, 2]).sum(axis=1)

    apart = nearness(owner[y, x]) - nearness(frame.owner[y, x])
    assert apart.min() >= 0
    assert 1 < apart.max() < 2


def test_true_lines_are_not_cut():
    """Each scanline of a triangle gives one span, as in the rasteriser, also if it is hidden.

    Methods with arcs have more.
    """
    drawn = scene("teapot", size=(160, 120), triangles=220, back_faces="cull")
    counts = {method: triangle_frame(drawn, Renderer(preset(method, "cosquad"))).counts for method in METHODS}
    assert counts["renormalise"]["cut"] == 0 < counts["quadratic"]["cut"]
    raster = rasterise(drawn)
    assert counts["renormalise"]["spans"] == len(raster.length) + raster.hidden_spans
    assert counts["renormalise"]["spans"] < counts["quadratic"]["spans"]
    assert counts["renormalise"]["pixels"] == counts["quadratic"]["pixels"]


def test_two_sided_materials():
    """Through holes in a teapot, back faces of two materials are visible.

    Only the two-sided material is drawn.
    """
    drawn = scene("teapot", size=(160, 120), triangles=1000, back_faces="cull")
    faces = drawn.mesh.faces[np.arange(len(drawn.mesh.faces)) % 8 > 3]
    mesh = replace(drawn.mesh, faces=faces, material=np.arange(len(faces)) // 16 % 2)
    both = replace(drawn.material[0], two_sided=True), drawn.material[0]
    drawn = replace(drawn, mesh=mesh, material=both)
    renderer, masks = Renderer(preset("quadratic", "cosquad", materials=2)), []
    for back_faces in ("cull", "flip"):
        given = replace(drawn, back_faces=back_faces)
        frame, exact = triangle_frame(given, renderer), render(given, "phong", REFLECTION_MODELS["cosquad"])
        np.testing.assert_array_equal(frame.owner >= 0, exact.mask)
        assert np.abs(frame.image - exact.image * 255)[exact.mask].max() < 0.6
        masks.append(exact.mask.sum())
    single = render(replace(drawn, material=(both[1],) * 2), "phong", REFLECTION_MODELS["cosquad"])
    assert single.mask.sum() + 100 < masks[0] < masks[1] - 100


def test_methods_and_geometry_must_fit():
    """Triangles give no values, and no unit normals to a method that takes lines."""
    with pytest.raises(ValueError, match="triangles give normals, and chord-local takes values"):
        Renderer(preset("chord-local", "cosquad"))
    with pytest.raises(ValueError, match="takes vectors for several lights, the geometry gives vectors"):
        Renderer(preset("quotient", "blinn", lights=2), Geometry(vectors=True))
    with pytest.raises(ValueError, match="only vectors are turned"):
        Geometry(lines=True, rotates=True)
    with pytest.raises(ValueError, match="takes vectors, the geometry gives unit normals"):
        Renderer(preset("quotient", "blinn"), Geometry())
    with pytest.raises(ValueError, match="true lines or vectors, not both"):
        Geometry(lines=True, vectors=True)
    with pytest.raises(ValueError, match="takes unit normals, the geometry gives true lines"):
        Renderer(preset("quadratic", "cosquad"), Geometry(lines=True))
    with pytest.raises(ValueError, match="takes true lines, the geometry gives unit normals"):
        Renderer(preset("renormalise", "cosquad"), Geometry())


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("texture", [None, "bilinear", "nearest"])
def test_colours_and_textures_within_their_bound(projection, texture):
    """A teapot whose vertex colours are its positions, and with a texture of noise in levels: every pixel is
    within its bound."""
    drawn = scene("teapot", size=(80, 60), triangles=1000, projection=projection)
    place = (drawn.mesh.vertices - drawn.mesh.vertices.min(axis=0)) / np.ptp(drawn.mesh.vertices, axis=0)
    mesh = replace(drawn.mesh, colors=place, coordinates=3 * place[:, :2] - 1)
    material = drawn.materials[0]
    if texture:
        noise = np.random.default_rng(3).random((64, 64, 3))
        material = replace(material, texture=Texture(noise, filter=texture, wrap=("clamp", "mirror")))
    drawn = replace(drawn, mesh=mesh, material=material)
    renderer = Renderer(design_for(preset("quotient", "blinn"), drawn, triangles=True))
    frame = triangle_frame(drawn, renderer)
    compared = compare_triangles(drawn, renderer, frame.sent, frame.image)
    assert 0.49 < compared.method_error.steady_lsb < compared.bound_lsb < 0.8
    assert (len(np.unique(frame.sent.levels)) > 2) == bool(texture)
    plain = triangle_frame(scene("teapot", size=(80, 60), triangles=1000, projection=projection), Renderer())
    np.testing.assert_array_equal(frame.owner, plain.owner)
