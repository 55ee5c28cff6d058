"""Albedo in float64: the sum with an albedo, levels of spans, and parts of spans."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.cut import cut_by_angle
from blysk.golden.frames.prepare import sort_by_material
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.reference.albedo import fragment_albedo
from blysk.golden.reference.lighting import Material, intensity, intensity_of_cosines
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN
from blysk.golden.reference.renderer import SHADINGS, render, shade_operands, shade_spans
from blysk.golden.reference.texture import Texture

from .scenes import LAMPS, LIGHTS, MATERIAL, SCENES

RNG = np.random.default_rng(1)
TEXTURE = Texture(RNG.random((16, 32, 3)), ("mirror", "clamp"))
V = np.array([0.0, 0.0, 1.0])


def painted(scene, *materials, colors=True):
    """A scene with vertex colours and texture coordinates, and a material for every second face."""
    count = len(scene.mesh.vertices)
    mesh = replace(
        scene.mesh,
        coordinates=RNG.uniform(-3, 3, (count, 2)),
        material=np.arange(len(scene.mesh.faces)) % len(materials),
        colors=RNG.random((count, 3)) if colors else np.zeros((0, 3)),
    )
    return replace(scene, mesh=mesh, material=materials)


TEXTURED = replace(MATERIAL, texture=TEXTURE, emission=(0.0, 0.1, 0.02))
SCENE = painted(SCENES["crossing in perspective"], TEXTURED, replace(MATERIAL, tinted=True))


@pytest.mark.parametrize("tinted", [False, True])
def test_sum(tinted):
    """Each term follows the formula, light by light."""
    material = replace(MATERIAL, tinted=tinted, emission=(0.1, 0.0, 0.3))
    normals, albedo = RNG.normal(size=(50, 3)), RNG.random((50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    diffuse, specular = np.multiply(material.ambient, (0.5, 1, 2)), np.zeros((50, 3))
    for light in LIGHTS:
        halfway = light.direction + V
        halfway /= np.linalg.norm(halfway)
        cosine = normals @ light.direction
        diffuse = diffuse + np.maximum(cosine, 0)[:, np.newaxis] * light.color * material.diffuse
        lobe = np.maximum(normals @ halfway, 0) ** 20 * (cosine > 0)
        specular += lobe[:, np.newaxis] * light.color * material.specular
    expected = albedo * diffuse + (albedo if tinted else 1) * specular + (0.1, 0, 0.3)
    found = intensity(normals, material, LIGHTS, (0.5, 1, 2), V, BLINN, albedo=albedo)
    assert found == pytest.approx(expected, abs=1e-14)


def test_sum_of_cosines():
    cosine, highlight, albedo = RNG.uniform(-1, 1, (2, 40, 2)), RNG.random((40, 2)), RNG.random((40, 3))
    cosine = cosine[0]
    given = (MATERIAL, LIGHTS, (1.0,) * 3, cosine, highlight, BLINN)
    black, white = (intensity_of_cosines(*given, albedo=np.full(3, of)) for of in (0.0, 1.0))
    assert white == pytest.approx(intensity_of_cosines(*given), abs=1e-15)
    found = intensity_of_cosines(*given, albedo=albedo)
    assert found == pytest.approx(black + albedo * (white - black), abs=1e-14)
    dark = replace(MATERIAL, specular=0)
    expected = albedo * intensity_of_cosines(dark, *given[1:])
    assert intensity_of_cosines(dark, *given[1:], albedo=albedo) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("albedo", [None, (0.5, 0.25, 1.0)])
def test_unlit(albedo):
    """An unlit surface shows its diffuse colour and its emission, whatever the lights."""
    material = replace(MATERIAL, unlit=True, emission=(0.0, 0.0, 0.125))
    expected = np.multiply(material.diffuse, 1.0 if albedo is None else albedo) + material.emission
    for lights in ((), LIGHTS, LAMPS):
        found = intensity(np.eye(3), material, lights, (0.2,) * 3, V, BLINN, points=np.eye(3), albedo=albedo)
        assert found == pytest.approx(np.tile(expected, (3, 1)))


def test_constants():
    """Without albedo, emission and unlit surfaces are constants, and the vectors of lights do not change."""
    scene = replace(SCENES["orthographic"], ambient_light=(0.5,) * 3)
    lit = FrameConstants.of(scene)
    glowing = FrameConstants.of(replace(scene, material=replace(MATERIAL, emission=(1.0, 0.0, 0.25))))
    expected = Intensity.color(np.multiply(MATERIAL.ambient, 0.5) + np.array((1, 0, 0.25)))
    assert (glowing.ambient == expected).all()
    unlit = FrameConstants.of(replace(scene, material=replace(MATERIAL, unlit=True)))
    assert (unlit.ambient == Intensity.color(np.array(MATERIAL.diffuse))).all()
    assert not unlit.diffuse.any()
    assert not unlit.specular.any()
    for name in ("direction", "halfway"):
        assert (getattr(unlit, name) == getattr(lit, name)).all()
    assert (glowing.diffuse == lit.diffuse).all()


def test_white_changes_nothing():
    """White vertices and white texels give the same picture as a scene without them, in every shading."""
    scene = SCENES["perspective"]
    count = len(scene.mesh.vertices)
    mesh = replace(scene.mesh, colors=np.ones((count, 3)), coordinates=RNG.normal(size=(count, 2)))
    white = replace(MATERIAL, texture=Texture(np.ones((4, 4, 3))))
    raster = rasterise(scene)
    for shading in SHADINGS:
        expected = render(scene, shading, raster=raster).image
        found = render(replace(scene, mesh=mesh, material=white), shading).image
        assert found == pytest.approx(expected, abs=1e-12)


def test_every_picture_has_the_albedo():
    """A white surface with ambient light alone shows its albedo in every shading."""
    material = Material((1,) * 3, 0, 0, 1, texture=TEXTURE)
    scene = painted(replace(SCENES["crossing"], lights=()), material, replace(material, texture=None))
    raster = rasterise(scene)
    which = np.flatnonzero(raster.visible)
    albedo = fragment_albedo(scene, raster, which)
    nothing = np.zeros((len(raster.span), 0))
    images = [render(scene, shading, raster=raster).image for shading in SHADINGS]
    images.append(shade_spans(scene, raster, "linear", BLINN))
    images.append(shade_operands(scene, raster, nothing, nothing, BLINN))
    for image in images:
        assert image.reshape(-1, 3)[raster.pixel[which]] == pytest.approx(albedo, abs=1e-12)
    assert np.ptp(albedo, axis=0).min() > 0.5


def test_parts_have_the_levels_of_their_span():
    """Cuts and another order of spans change neither a level nor the albedo of a pixel."""
    raster = rasterise(SCENE)
    cut, count = cut_by_angle(raster, 1.0)
    cut = sort_by_material(cut, SCENE.mesh.material)
    assert count > 10
    assert len(np.unique(raster.level)) > 2
    assert len(cut.level) == len(cut.length)
    levels, albedos = [], []
    for of in (raster, cut):
        by_pixel = np.lexsort((of.triangle[of.span], of.pixel))
        levels.append(of.level[of.span[by_pixel]])
        albedos.append(fragment_albedo(SCENE, of, by_pixel))
    assert (levels[0] == levels[1]).all()
    assert albedos[0] == pytest.approx(albedos[1], abs=1e-11)


def test_levels_only_where_needed():
    plain = replace(TEXTURED, texture=replace(TEXTURE, mipmapped=False))
    assert not len(rasterise(painted(SCENES["crossing"], plain)).level)
    assert not len(rasterise(SCENES["crossing"]).level)
    # The texture of a material without faces has no effect.
    unused = replace(SCENES["crossing"], material=(MATERIAL, TEXTURED))
    assert not unused.has_albedo
    raster = rasterise(unused)
    assert not len(raster.level)
    assert fragment_albedo(unused, raster, np.arange(3)) is None


def test_refusals():
    with pytest.raises(ValueError, match=r"^the material of a face has a texture, and the mesh has no textu"):
        replace(SCENES["crossing"], material=TEXTURED)
    raster = rasterise(SCENE)
    with pytest.raises(ValueError, match=r"^textures with several levels need the levels of the spans$"):
        fragment_albedo(SCENE, replace(raster, level=raster.level[:0]), np.arange(3))
    with pytest.raises(ValueError, match=r"^point lights, a near viewer and an albedo need the weights of"):
        fragment_albedo(SCENE, replace(raster, weights_left=raster.weights_left[:0]), np.arange(3))
