"""Frames with vertex colours and textures by the bit-accurate model, against float64; refusals."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frames.frame import frame_buffer
from blysk.golden.frames.prepare import constants_of, prepare
from blysk.golden.frames.surface import albedo_of, design_for
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture

LIGHT = Light((0.3, 1, 0.5))
GLOSSY = Material((0.1,) * 3, (0.6,) * 3, (0.3,) * 3, 50)


def patch(colors=False, coordinates=False):
    """A bent patch of 32 triangles, six times as deep as wide, with the data of its surface."""
    rng = np.random.default_rng(3)
    x, z = (side.ravel() for side in np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-6, 6, 5)))
    corner = np.array([i * 5 + j for i in range(4) for j in range(4)])[:, np.newaxis]
    faces = np.concatenate([corner + np.array(of) for of in ((0, 5, 1), (1, 5, 6))])
    return Mesh(
        np.stack([x, -0.1 * x**2, z], axis=1),
        faces,
        normalise(np.stack([0.2 * x, np.ones(25), np.zeros(25)], axis=1)),
        colors=rng.random((25, 3)) if colors else np.zeros((0, 3)),
        coordinates=np.stack([2 * x, z], axis=1) if coordinates else np.zeros((0, 2)),
    )


def scene_of(mesh, material=GLOSSY, projection="perspective", lights=(LIGHT,)):
    camera = Camera.framing(mesh.vertices, (0.2, 0.25, 1), projection=projection)
    return Scene(mesh, camera, 96, 72, material, lights)


def errors_of(scene, method="quotient", lights=1):
    """Errors of a frame by the model in linear LSB, against float64 channels that are rounded and that are
    not."""
    design = design_for(preset(method, "blinn", lights), scene)
    prepared = prepare(scene, design)
    pixels = design.compute(prepared.spans, prepared.constants)
    found = frame_buffer(scene, prepared.cut_raster, pixels.color, "linear")
    assert len(np.unique(pixels.color)) > 30
    return np.abs(found - 255 * render(scene, "phong", REFLECTION_MODELS["blinn"]).image)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("method", ["quotient", "chord-local", "renormalise", "quadratic"])
def test_vertex_colours(method, projection):
    """Every method serves vertex colours, whatever its spans bring.

    quadratic also has its own error of the highlight.
    """
    error = errors_of(scene_of(patch(colors=True), projection=projection), method)
    assert 0.45 < error.max() < (0.57 if method != "quadratic" else 2)


NOISE = np.random.default_rng(4).random((64, 64, 3))
CHECKER = np.repeat((np.indices((64, 64)).sum(axis=0) % 2)[:, :, np.newaxis].astype(float), 3, axis=2)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize(
    ("texture", "colors"),
    [
        (Texture(CHECKER, mipmapped=False), False),
        (Texture(NOISE), True),
        (Texture(NOISE, wrap=("clamp", "mirror"), mipmapped=False), False),
    ],
    ids=["checker", "levels, colours", "clamp, mirror"],
)
def test_textures_at_a_grazing_angle(texture, colors, projection):
    """The rounding of a texel is at most 2^-12, and its light is 0.7 of the channel.

    This adds 0.05 LSB to the rounding.
    """
    mesh = patch(colors, coordinates=True)
    error = errors_of(scene_of(mesh, replace(GLOSSY, texture=texture), projection))
    assert error.max() < 0.57


def test_nearest_texels_differ_at_their_borders_only():
    """At a few pixels the border of a texel is nearer than the error of a coordinate."""
    texture = Texture(NOISE, filter="nearest", mipmapped=False)
    error = errors_of(scene_of(patch(coordinates=True), replace(GLOSSY, texture=texture)))
    assert np.quantile(error, 0.999) < 0.57


def test_tinted_emission_and_two_materials():
    """A tinted material with a texture, and another material that emits light and has no texture."""
    mesh = patch(coordinates=True)
    mesh = replace(mesh, material=np.arange(len(mesh.faces)) % 2)
    materials = [
        replace(GLOSSY, texture=Texture(NOISE), tinted=True),
        replace(GLOSSY, emission=(0.1, 0.2, 0.05)),
    ]
    scene = scene_of(mesh, materials)
    assert albedo_of(scene).tints
    assert errors_of(scene).max() < 0.57


def test_without_lights():
    """Ambient light and unlit materials."""
    scene = scene_of(patch(colors=True), lights=())
    bright = replace(scene, material=(replace(GLOSSY, ambient=(0.9,) * 3),))
    assert errors_of(bright, lights=0).max() < 0.51
    unlit = replace(scene, material=(replace(GLOSSY, unlit=True, diffuse=(1.0, 0.8, 0.5)),))
    assert errors_of(unlit, lights=1).max() < 0.51


def test_an_albedo_path_shows_a_plain_surface():
    """With a white albedo a plain surface is shown as without the albedo path, except for a rounding."""
    colored, plain = scene_of(patch(colors=True)), scene_of(patch())
    design = design_for(preset("quotient", "blinn"), colored)
    prepared = prepare(plain, design)
    found = design.compute(prepared.spans, prepared.constants).color.astype(int)
    expected = preset("quotient", "blinn").compute(
        replace(prepared.spans, attributes=None), prepared.constants
    )
    assert np.abs(found - expected.color).max() <= 1
    assert albedo_of(plain) is None


def test_a_design_refuses_what_it_does_not_show():
    colored, textured = (
        scene_of(patch(colors=True)),
        scene_of(patch(coordinates=True), replace(GLOSSY, texture=Texture(NOISE))),
    )
    plain, of_colors = preset("quotient", "blinn"), design_for(preset("quotient", "blinn"), colored)
    with pytest.raises(ValueError, match=r"^the scene has vertex colours, and the design does not: make"):
        prepare(colored, plain)
    with pytest.raises(ValueError, match=r"^the scene has textures, and the design does not: make it"):
        prepare(textured, of_colors)
    tinted = replace(colored, material=(replace(GLOSSY, tinted=True),))
    with pytest.raises(ValueError, match=r"^the scene has a tinted material, and the design does not: make"):
        prepare(tinted, of_colors)
    flat = design_for(preset("quotient", "blinn"), scene_of(patch(colors=True), projection="orthographic"))
    with pytest.raises(ValueError, match=r"^the albedo of the design is orthographic, and the camera is not"):
        prepare(colored, flat)
    spans = prepare(colored, of_colors).spans
    with pytest.raises(ValueError, match=r"^the design has an albedo, and the spans lack attributes$"):
        of_colors.compute(replace(spans, attributes=None), constants_of(colored, of_colors))
    with pytest.raises(ValueError, match=r"^the design has no albedo, and the spans have attributes$"):
        plain.compute(spans, constants_of(colored, of_colors))


def test_light_over_the_limit_is_refused():
    lights = [Light((0.3, 1, 0.5), 8.0), Light((0.1, 1, 0.5), 8.0), Light((0.1, 1, 0), 8.0)]
    scene = scene_of(
        patch(colors=True), replace(GLOSSY, diffuse=(1.0,) * 3, specular=(0.5,) * 3), lights=lights
    )
    text = (
        r"^the lights of material 0 add up to 24.1 times the full channel, and a surface with an albedo takes"
    )
    with pytest.raises(ValueError, match=text):
        constants_of(scene, design_for(preset("quotient", "blinn", 3), scene))
