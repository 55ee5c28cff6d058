"""Errors at and away from the border of a light, the bound, and the model with which a frame is compared."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.golden.frames.border import BORDER, border_mask, highlight_step
from blysk.golden.frames.compare import compare, compare_image, target_of
from blysk.golden.frames.error_bound import encoded_bound, error_bound
from blysk.golden.frames.frame import model_frame
from blysk.golden.presets import MODELS, preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.lobes import BECKMANN, COPLANAR_PHONG, GGX, TabulatedModel
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN, COSQUAD, REFLECTION_MODELS
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.transfer import encode
from blysk.sim.meshes.teapot import teapot

METHODS = ("chord-local", "renormalise")
GREY = Material((0.05,) * 3, (0.02,) * 3, (0.98,) * 3, 20)


def facing(normals, light=(0.3, 0.4, 1), depths=(0, 0, 0), background=(0, 0, 0), **material):
    """A triangle that faces the viewer, with given normals at its corners."""
    corners = np.array([[-1, -1, depths[0]], [1, -0.8, depths[1]], [0.1, 1, depths[2]]], dtype=float)
    normals = np.asarray(normals, dtype=float)
    mesh = Mesh(corners, np.array([[0, 1, 2]]), normals / np.linalg.norm(normals, axis=1, keepdims=True))
    camera = Camera.framing(corners, (0, 0, 1), "perspective", 4 / 3)
    surface = replace(GREY, **material)
    return Scene(mesh, camera, 128, 96, material=surface, lights=[Light(light)], background=background)


def made(method, model, scene):
    return preset(method, model).for_materials(scene.materials)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("model", "name"), [("blinn", "exponent"), ("ggx", "roughness")])
def test_steady_errors_keep_the_bound(method, model, name):
    """Random triangles keep the bound.

    Their normals are far apart, lengths differ, and highlights have nearly the full channel.
    """
    rng, largest = np.random.default_rng(7), 0.0
    sharpest = 0.1 if method == "chord-local" else 0.15
    for value in (1, 30, 900) if name == "exponent" else (sharpest, 0.3, 0.9):
        normals = [0, 0, 1] + rng.uniform(-0.9, 0.9, (3, 3)) * [1, 1, 0.3]
        scene = facing(normals, rng.normal((0, 0, 1.5)), rng.uniform(-2, 0.5, 3), **{name: value})
        design = made(method, model, scene)
        found = compare(scene, design, model_frame(scene, design))
        # A quarter of a step is left out of a lobe that has a scale.
        left_out = 2.0**-19 if design.lobe.scale else 0
        term = 0.2 + 255 * (design.lobe.line_error(value) + 3 * 2.0**-17 + left_out)
        budgets = 0.5 + 3 / 128 + 0.02 * (0.12 + 255 * 2.0**-18) + 0.98 * term
        expected = budgets if method == "chord-local" else 0.5 + 1 / 16 + 1 / 4
        assert found.bound_lsb == pytest.approx(expected)
        assert found.target == model
        assert found.method_error.steady_lsb <= found.bound_lsb
        largest = max(largest, found.method_error.steady_lsb)
    assert largest > 0.45


@pytest.mark.long
@pytest.mark.parametrize("method", ["quotient", "renormalise"])
def test_every_exponent_and_model_is_within_an_lsb(method):
    """Every thirteenth exponent of the method's first model is tried, and some exponents of the others."""
    models = ["blinn", "phong"] if method == "quotient" else ["cosquad", *MODELS]
    exponents = range(1, 1001, 13)
    for model in dict.fromkeys(models):
        for exponent in exponents if model == models[0] else (1, 3, 10, 100, 1000):
            scene = scene_for(teapot(992), exponent, 320, 240)
            design = made(method, model, scene)
            found = compare(scene, design, model_frame(scene, design))
            assert found.method_error.steady_lsb <= 1.0, f"{model}, {exponent}"


def test_pixels_at_the_border_are_counted_apart():
    """N·L goes through 0. A picture without this light differs only at the border of the light."""
    scene = facing([[1, 0, 0.2], [-1, 0, 0.2], [0, 0.1, 1]], (1, 0, 0), exponent=1)
    raster = rasterise(scene)
    border = border_mask(scene, raster, BLINN)
    assert 0 < border.sum() < 0.05 * border.size
    design = made("renormalise", "blinn", scene)
    frame = model_frame(scene, design)
    exact = compare(scene, design, frame)
    assert exact.border_pixels == np.count_nonzero(border)
    wrong = frame.image.copy()
    wrong[border] = 255
    found = compare_image(scene, design, wrong)
    assert found.method_error.steady_lsb == exact.method_error.steady_lsb <= exact.bound_lsb
    assert found.method_error.border_lsb == found.method_error.max_lsb > 200
    assert found.bound_lsb is None


def test_a_step_of_the_lobe_is_a_border():
    """GGX of a large roughness is not 0 at N·H = 0, so pixels beside this line count as border, too."""
    scene = facing([[1, 0, 0.1], [-1, 0, 0.1], [0, 0.1, 1]], (1, 0, -0.4), roughness=0.9)
    raster = rasterise(scene)
    smooth, rough = (border_mask(scene, raster, model) for model in (BLINN, GGX))
    assert (smooth <= rough).all()
    assert rough.sum() > smooth.sum()
    small = replace(scene, material=replace(GREY, roughness=0.1))
    np.testing.assert_array_equal(border_mask(small, raster, GGX), smooth)


def test_the_step_is_that_of_the_curve():
    """The step is ``r^8`` of the full channel for GGX.

    A polynomial, which goes on for negative N·H, has none.
    """
    scene = facing(np.eye(3) + 1, roughness=0.83)
    dim = replace(scene, material=replace(scene.materials[0], specular=(0.73, 0.1, 0.1), exponent=1))
    assert highlight_step(dim, GGX) == pytest.approx(255 * 0.73 * 0.83**8, rel=1e-4)
    assert highlight_step(
        dim, TabulatedModel.of_points("flat", np.array([0.0, 1.0]), np.array([0.5, 0.5]))
    ) == pytest.approx(255 * 0.73 * 0.5)
    for model in (BLINN, COSQUAD, REFLECTION_MODELS["exp"], BECKMANN, COPLANAR_PHONG):
        assert highlight_step(dim, model) == 0


@pytest.mark.parametrize(("method", "model"), [("chord-local", "ggx"), ("quotient", "blinn")])
def test_an_unlit_surface_has_no_border(method, model):
    """N·L goes through 0. The colour is just under half a code, and its operand is on the half."""
    scene = facing([[-1, 0, 0.1], [1, 0, 0.1], [1, 0.1, 1]], (1, 0, 0), diffuse=100.4924 / 255, unlit=True)
    assert border_mask(replace(scene, material=GREY), rasterise(scene), GGX).any()
    found = compare(scene, made(method, model, scene), model_frame(scene, made(method, model, scene)))
    assert (found.border_pixels, found.step_lsb) == (0, 0)
    assert 0.507 < found.method_error.steady_lsb <= found.bound_lsb
    assert found.bound_lsb == pytest.approx(0.5 + 3 / 128)


@pytest.mark.parametrize("ambient", [0.0, 0.02, 0.3])
def test_errors_of_srgb_are_of_its_codes(ambient):
    """Errors are compared with a second implementation of the curve.

    The bound takes the slope at the least colour.
    """
    scene = facing([[1, 0, 0.2], [-1, 0, 0.1], [0, 0.1, 1]], ambient=(ambient,) * 3, background=(0.2, 0, 1))
    linear, design = (replace(made("quotient", "blinn", scene), transfer=of) for of in ("linear", "srgb"))
    own = compare(scene, linear, model_frame(scene, linear))
    frame = model_frame(scene, design)
    found = compare(scene, design, frame)
    light = own.golden
    curve = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(found.golden, curve, atol=1e-12)
    assert frame.image[0, 0].tolist() == [124, 0, 255]
    assert (own.transfer, found.transfer) == ("linear", "srgb")
    shown = ~border_mask(scene, frame.raster, BLINN).reshape(-1)[frame.raster.pixel]
    pixels = frame.raster.pixel[frame.raster.visible & shown]
    error = np.abs(frame.image - 255 * curve).reshape(-1, 3)[pixels].max()
    assert found.method_error.steady_lsb == pytest.approx(error)
    assert 0.45 < error <= found.bound_lsb
    steepest = {0.0: 12.92, 0.02: 4.3064, 0.3: 0.8872}[ambient]
    assert found.bound_lsb == pytest.approx(0.5 + steepest * (own.bound_lsb - 0.5 + 1 / 128), rel=0.02)


def test_the_bound_of_encoded_colours_is_reached():
    """For every dark colour, a colour that is off by the whole linear bound keeps the encoded bound and comes
    near it."""
    light, bound = np.linspace(0, 30, 3001), 0.6
    for shift in (-0.1, 0.1):
        found = np.round((light + shift) * 64) / 64
        off = np.abs(np.round(255 * encode(found / 255)) - 255 * encode(light / 255))
        limits = np.array([encoded_bound(bound, of / 255, "srgb") for of in light])
        assert np.all(off <= limits)
        assert (off / limits).max() > 0.9
    assert encoded_bound(bound, 0.0, "linear") == bound


def test_no_bound_where_none_is_known():
    scene = facing(np.eye(3) + 1)
    assert error_bound(scene, made("linear", "blinn", scene)) is None
    assert error_bound(scene, made("quadratic", "blinn", scene)) is None
    sharp = facing(np.eye(3) + 1, roughness=0.05)
    assert error_bound(sharp, made("chord-local", "ggx", sharp)) is not None
    assert error_bound(sharp, preset("chord-local", "ggx")) is None
    assert error_bound(sharp, made("renormalise", "ggx", sharp)) is None
    sharper = facing(np.eye(3) + 1, roughness=0.03)
    assert error_bound(sharper, made("chord-local", "ggx", sharper)) is None
    painted = replace(scene, mesh=replace(scene.mesh, colors=np.ones((3, 3))))
    assert error_bound(painted, preset("renormalise", "cosquad")) is None
    two = replace(scene, lights=[Light((0, 0, 1)), Light((0, 1, 1), (2.0, 0.5, 0.5))])
    assert error_bound(two, made("renormalise", "blinn", two)) == pytest.approx(0.5 + 3 * (1 / 16 + 1 / 4))
    assert error_bound(scene, preset("renormalise", "cosquad")) == pytest.approx(0.5 + 5 / 16)


def test_the_target_is_the_model_of_the_table():
    assert target_of(preset("quadratic", "ggx")) is GGX
    assert target_of(preset("quadratic", "phong_coplanar")).name == "phong_coplanar"
    assert target_of(preset("quadratic", "cosquad")) is target_of(preset("linear", "blinn_product")) is BLINN
    assert BORDER == 0.002
