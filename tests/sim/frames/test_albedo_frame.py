"""Frames with vertex colours and textures through RTL: the model's pixels, within the bound of float64."""

from dataclasses import replace

import numpy as np
import pytest

import blysk
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.frames.frame import frame_buffer, model_frame
from blysk.golden.frames.prepare import prepare
from blysk.golden.frames.surface import design_for
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.divide import divided
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.renderer import render
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import Texture
from blysk.golden.render import Renderer
from blysk.sim.errors import OptionError

GLOSSY = Material((0.1,) * 3, (0.6,) * 3, (0.3,) * 3, 50)


def floor():
    """Two triangles at a grazing angle, with vertex colours, and texture coordinates over four images."""
    corners = np.array([(x, 0.0, z) for z in (-3, 3) for x in (-1, 1)])
    normals = normalise(corners * (0.1, 0, 0) + (0, 1, 0))
    coordinates = corners[:, ::2] * (1, 0.5)
    return Mesh(
        corners,
        np.array([(0, 2, 1), (1, 2, 3)]),
        normals,
        colors=np.random.default_rng(3).random((4, 3)),
        coordinates=coordinates,
    )


def scene_of(size):
    """The floor in perspective, with a tinted material that emits light, and a texture of several levels."""
    mesh = floor()
    texture = Texture(np.random.default_rng(4).random((8, 8, 3)))
    camera = Camera.framing(mesh.vertices, (0.2, 0.3, 1), projection="perspective")
    material = replace(GLOSSY, texture=texture, tinted=True, emission=(0.02, 0, 0.01))
    return Scene(mesh, camera, *size, material, (Light((0.3, 1, 0.5)),))


@pytest.mark.long
@pytest.mark.parametrize(("engine", "size"), [("pysim", (24, 18)), ("cxxrtl", (320, 240))])
def test_colours_times_texels(engine, size):
    """Pixels equal the model's, and are half an LSB from float64."""
    scene = scene_of(size)
    frame = blysk.render(scene, engine=engine, transfer="linear")
    design = frame.design
    assert design.albedo == Albedo(texture=TextureSampler(), tints=True)
    prepared = prepare(scene, design)
    pixels = design.compute(prepared.spans, prepared.constants)
    expected = frame_buffer(scene, prepared.cut_raster, pixels.color, "linear")
    np.testing.assert_array_equal(frame.image, expected)
    error = np.abs(expected - 255 * render(scene).image)
    assert 0.45 < error.max() < 0.55


@pytest.mark.long
def test_texels_outside_and_holes():
    """Texels come after random numbers of cycles, and alpha makes holes.

    The frame equals that of texels inside.
    """
    scene = scene_of((24, 18))
    alpha = np.indices((8, 8)).sum(axis=0) % 2
    texture = replace(scene.material.texture, alpha=alpha, filter="nearest", mipmapped=False)
    scene = replace(scene, material=replace(scene.material, texture=texture, cutoff=0.5))
    inside = design_for(blysk.design(), scene)
    sampler = replace(inside.albedo.texture, memory=TexelMemory(inside.albedo.texture.memory.depth, True))
    outside = replace(inside, albedo=replace(inside.albedo, texture=sampler))
    frame, expected = blysk.render(scene, design=outside, engine="pysim"), model_frame(scene, inside)
    np.testing.assert_array_equal(frame.image, expected.image)
    dropped = expected.raster.dropped
    assert frame.figures["counts"]["cut_out_pixels"] == dropped > 20
    assert f"their alpha is under the cutoff: {dropped}" in str(frame)
    # A texel takes four cycles on average, in place of a single cycle.
    assert frame.figures["cycles_per_pixel"] > 3


@pytest.mark.long
def test_render_of_a_mesh_with_colours():
    """By the interface for Python, with its default transfer."""
    mesh = blysk.Mesh(*(getattr(floor(), name) for name in ("vertices", "faces", "normals")))
    mesh = replace(mesh, colors=np.array([(1.0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)]))
    frame = blysk.render(mesh, view="0.2,0.3,1", size=(24, 18), engine="pysim")
    assert frame.error.steady_lsb < 0.8
    assert len(np.unique(frame.image)) > 30


@pytest.mark.long
@pytest.mark.parametrize(
    ("projection", "style"), [("perspective", "throughput"), ("orthographic", "compact")]
)
def test_colours_times_texels_by_triangles(projection, style):
    """With hardware geometry pixels equal the model's, and are half an LSB from float64."""
    scene = scene_of((24, 18))
    scene = replace(scene, camera=replace(scene.camera, projection=projection))
    options = {"geometry": "hardware", "transfer": "linear", "style": style}
    frame = blysk.render(scene, engine="pysim", **options)
    expected = triangle_frame(divided(scene), Renderer(frame.design))
    np.testing.assert_array_equal(frame.image, expected.image)
    assert 0.4 < frame.error.steady_lsb < frame.comparison.bound_lsb < 1


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (
            {"method": "renormalise"},
            "method renormalise: hardware geometry gives vertex colours .*; use quotient",
        ),
        ({"setups": 2}, "setups 2: vertex colours and textures take one lane .*; leave out setups"),
    ],
)
def test_hardware_geometry_refuses_colours_that_it_does_not_serve(options, match):
    with pytest.raises(OptionError, match=match):
        blysk.render(scene_of((40, 30)), geometry="hardware", engine="pysim", **options)


def test_triangles_that_cross_too_many_texels_are_refused():
    scene = scene_of((40, 30))
    scene = replace(scene, mesh=replace(scene.mesh, coordinates=scene.mesh.coordinates * 600))
    with pytest.raises(OptionError, match=r"geometry hardware: a triangle crosses more than 4094 texels; di"):
        blysk.render(scene, geometry="hardware", engine="pysim")
