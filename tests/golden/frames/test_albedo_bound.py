"""Bounds of the albedo of every pixel, and of the pixel, against the bit-accurate models."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.albedo_bound import albedo_errors
from blysk.golden.frames.border import border_mask
from blysk.golden.frames.compare import compare
from blysk.golden.frames.cut import cut_by_attributes
from blysk.golden.frames.error_bound import encoded_bound, pixel_bound
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import prepare
from blysk.golden.frames.surface import MOST_TEXELS, design_for
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

from .cuts import origins

NOISE = np.random.default_rng(2).random((64, 64, 3))
CHECKER = np.repeat(np.indices((64, 64)).sum(axis=0)[..., np.newaxis] // 2 % 2, 3, axis=2).astype(float)


def scene_of(projection, texture=None, colors=True, tiles=3.0, **looks):
    """A floor at a grazing angle with two materials and a light behind it."""
    points = np.array([[-3.0, 0, 2], [3, 0, 2], [3, 0, -9], [-3, 0, -9]])
    normals = normalise(points * (0.1, 0, 0.05) + (0, 1, 0.3))
    rng = np.random.default_rng(4)
    mesh = Mesh(
        points,
        np.array([[0, 1, 2], [0, 2, 3]]),
        normals,
        material=np.array([0, 1]),
        colors=rng.random((4, 3)) if colors else np.zeros((0, 3)),
        coordinates=tiles * rng.random((4, 2)),
    )
    camera = Camera((0.4, 1.2, 5), (0, 0, 0), projection=projection, height=4.0, field_of_view=40.0)
    first = Material(0.02, (0.5, 0.6, 0.3), (0.4, 0.3, 0.6), 30, texture=texture, **looks)
    second = Material((0.0, 0.1, 0.0), (0.8, 0.7, 0.9), 0.1, 5, texture=texture, emission=(0.0, 0.05, 0.01))
    lights = (Light((0.3, 1, -0.5), (0.9, 0.8, 1.0)), Light((-1, 0.4, 0.2), (0.2, 0.1, 0.4)))
    return Scene(mesh, camera, 128, 96, (first, second), lights)


CASES = {
    "colours": (None, True, {}),
    "bilinear": (Texture(CHECKER), False, {}),
    "both, tinted": (Texture(NOISE, ("mirror", "clamp"), mipmapped=False), True, {"tinted": True}),
    "nearest": (Texture(CHECKER, filter="nearest"), True, {"unlit": True}),
}


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("case", CASES)
def test_bounds_hold(case, projection):
    """The albedo of each pixel and the pixel itself are within their bounds. The bounds are not too wide."""
    texture, colors, looks = CASES[case]
    scene = scene_of(projection, texture, colors, **looks)
    design = design_for(preset("quotient", "blinn", lights=2), scene)
    frame = prepare(scene, design)
    cut, constants = frame.cut_raster, frame.constants
    steady = ~border_mask(scene, cut, BLINN)

    given = frame.spans.attributes, cut.length, frame.spans.material
    textures = [of.texture for of in constants] if texture else ()
    albedo = design.albedo.compute(*given, textures, constants[0].texels).values
    share = []
    for which, exact, error in albedo_errors(scene, design.albedo, cut):
        off = np.abs(albedo[which] - exact)[steady.reshape(-1)[cut.pixel[which]]]
        share.append(off / error[steady.reshape(-1)[cut.pixel[which]]])
    assert 0.4 < np.concatenate(share).max() <= 1

    bound = pixel_bound(scene, design, cut)
    for transfer in ("linear", "srgb"):
        encoding = replace(design, transfer=transfer)
        picture = model_frame(scene, encoding)
        found = compare(scene, encoding, picture)
        assert 0.5 < found.method_error.steady_lsb <= found.bound_lsb < (0.75 if transfer == "linear" else 2)
        assert (found.border == "|N.L|") == (case != "nearest")
        if transfer == "linear":
            off = np.abs(picture.image - 255 * found.golden)
            assert (off <= bound)[steady].all()


def test_bounds_follow_the_slope_of_the_pixel():
    """A dark pixel has the slope of the curve at black, and a bright pixel the slope at its own colour."""
    bound, least = np.array([0.6, 0.9]), np.array([0.0, 1.0])
    step = 1 / 128
    slopes = np.array([12.92, 1.055 / 2.4 * (1 - (0.4 + step) / 255) ** (1 / 2.4 - 1)])
    each = [encoded_bound(*of, "srgb") for of in zip(bound, least, strict=True)]
    assert each == pytest.approx(slopes * (bound - 0.5 + step) + 0.5)
    assert encoded_bound(bound, least, "srgb") == max(each)
    assert encoded_bound(bound, least, "linear") == 0.9


@pytest.mark.parametrize("method", ["chord-local", "renormalise"])
def test_bounds_by_tolerance_hold(method):
    scene = scene_of("perspective", *CASES["both, tinted"][:2], tinted=True)
    for transfer in ("linear", "srgb"):
        design = replace(design_for(preset(method, "blinn", lights=2), scene), transfer=transfer)
        found = compare(scene, design, model_frame(scene, design))
        assert 0.5 < found.method_error.steady_lsb <= found.bound_lsb < (1.2 if transfer == "linear" else 6)


@pytest.mark.parametrize("method", ["quotient", "renormalise", "linear", "chord-local"])
def test_a_span_that_is_cut_for_two_reasons_counts_once(method):
    image = np.random.default_rng(5).random((512, 512, 3))
    scene = scene_of("perspective", Texture(image, mipmapped=False), tiles=0.3)
    prepared = prepare(scene, design_for(preset(method, "blinn", lights=2), scene))
    parts = np.bincount(origins(prepared.raster, prepared.cut_raster)[0])
    # With quotient a span of two pixels always becomes two parts. It counts as cut only if its ends differ.
    pairs = prepared.raster.length[parts > 1] == 2 if method == "quotient" else np.zeros(1)
    assert 0 <= (parts > 1).sum() - prepared.spans_cut <= pairs.sum()
    _, by_attributes = cut_by_attributes(scene, prepared.raster)
    assert by_attributes <= prepared.spans_cut


@pytest.mark.parametrize("wraps", [("clamp", "mirror"), ("repeat", "clamp")])
def test_cuts(wraps):
    """Frames keep their bounds far outside an image, and if a pixel crosses more texels than a word holds."""
    image = np.random.default_rng(5).random((512, 512, 3))
    scene = scene_of("perspective", Texture(image, wraps, mipmapped=False), tiles=40.0)
    design = design_for(preset("quotient", "blinn", lights=2), scene)
    frame = model_frame(scene, design)
    found = compare(scene, design, frame)
    assert 0.5 < found.method_error.steady_lsb <= found.bound_lsb < 0.75
    assert frame.prepared.spans_cut > 50
    cut, count = cut_by_attributes(scene, frame.raster)
    assert 50 < count <= len(frame.raster.length)
    several = cut.length > 1
    change = [
        np.einsum("sn,snk->sk", of / of.sum(axis=1, keepdims=True), scene.mesh.coordinates[faces])
        for faces in [scene.mesh.faces[cut.triangle]]
        for of in (cut.weights_left, cut.weights_right)
    ]
    crossed = np.abs(change[1] - change[0]).max(axis=1) * 512
    assert 31 < crossed[several].max() <= MOST_TEXELS + 1e-6
    # No span is cut without need.
    whole = scene_of("perspective", Texture(image), tiles=1.0)
    assert cut_by_attributes(whole, rasterise(whole))[1] < 60


def test_no_bound_where_none_is_known():
    """There is no bound for another method, or if words may miss the nearest texel in spans that are
    not cut."""
    scene = scene_of("perspective", None)
    for method in ("linear", "quadratic"):
        design = design_for(preset(method, "blinn", lights=2), scene)
        assert pixel_bound(scene, design, prepare(scene, design).cut_raster) is None
    image = np.random.default_rng(5).random((256, 256, 3))
    for kind, known in (("bilinear", True), ("nearest", False)):
        scene = scene_of("perspective", Texture(image, filter=kind, mipmapped=False), tiles=12.0)
        design = design_for(preset("quotient", "blinn", lights=2), scene)
        raster = rasterise(scene)
        assert (pixel_bound(scene, design, raster) is not None) == known
        assert pixel_bound(scene, design, cut_by_attributes(scene, raster)[0]) is not None
