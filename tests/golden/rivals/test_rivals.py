"""Each rival against float64: its curve in exact arithmetic, its words, and its colours."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.cosines.quotient import Quotient
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Light
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import BLINN
from blysk.golden.reference.renderer import render
from blysk.golden.rivals.bishop_weimer import BishopWeimer
from blysk.golden.rivals.duff import Duff, TracedQuotient
from blysk.golden.rivals.registry import RIVALS
from blysk.golden.rivals.shades import shaded
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import screen_triangles

from .scenes import small_scene


def _polynomial(coefficients, i, j):
    c, x, y, xx, xy, yy = coefficients
    return c + x * i + y * j + xx * i * i + xy * i * j + yy * j * j


def _exact(scene, raster):
    """N·L and 1 - N·H of every fragment and light."""
    normals = fragment_normals(scene, raster, np.arange(len(raster.span)))
    towards = np.stack([light.towards() for light in scene.lights])
    halfway = halfway_vector(towards, scene.camera.viewer)
    return normals @ towards.T, 1 - normals @ halfway.T


def _errors(rival, scene):
    """Largest error in LSB, before rounding, against the exact picture."""
    raster = rasterise(scene)
    shades = rival.shade(scene, raster, Trace())
    exact = 255 * render(scene, "phong", rival.REFLECTION, raster).image.reshape(-1, 3)
    seen = raster.visible
    assert (np.abs(shades.color - shades.light) <= 0.5).all()
    return float(np.abs(shades.light - exact[raster.pixel])[seen].max())


@pytest.mark.parametrize(
    ("name", "order"), [("bishop-weimer", 3), ("bishop-weimer-six", 3), ("loisel", 2), ("abbas", 3)]
)
def test_errors_fall_with_the_size_of_triangles(name, order):
    """Edges of half the length: quadratics leave an error of third order, Loisel's vector of second order."""
    found = [_errors(RIVALS[name], small_scene(0.4, exponent=20, cells=cells)) for cells in (4, 8, 16)]
    assert found[0] > 0.3
    # Triangles of this size are not small yet, so the order is not quite reached.
    assert found[1] < found[0] * 2.0 ** -(order - 0.5)
    assert found[2] < found[0] * 4.0 ** -(order - 0.25) + 0.02


@pytest.mark.parametrize("lights", [1, 2])
def test_duff_is_exact_up_to_its_words(lights):
    scene = small_scene(0.8, exponent=200, lights=lights)
    raster = rasterise(scene)
    triangles = screen_triangles(scene, raster)
    pixels = Duff().pixels(scene, triangles, Trace())
    cosine, u = _exact(scene, raster)
    square = (pixels.numerator.values[:, 0] + pixels.rest.values)[:, np.newaxis]
    np.testing.assert_allclose(pixels.line.values / np.sqrt(square), cosine, atol=4e-5)
    np.testing.assert_allclose(pixels.numerator.values / square, u * (2 - u), atol=6e-5)
    assert (pixels.away == (u > 1)).all()
    assert _errors(Duff(), scene) < 0.15


def test_duff_keeps_highlights_whose_half_way_vector_has_three_equal_components():
    """There ``|v|^2`` would be up to 3 if only the components had to fit. The word of a pixel is under 2."""
    scene = small_scene(lights=1)
    viewer, halfway = scene.camera.viewer, np.ones(3) / np.sqrt(3)
    towards = 2 * (halfway @ viewer) * halfway - viewer
    normals = normalise(halfway + 0.05 * scene.mesh.normals)
    scene = replace(scene, mesh=replace(scene.mesh, normals=normals), lights=[Light(tuple(towards))])
    assert _errors(Duff(), scene) < 0.15


def test_duff_counts_the_multipliers_of_a_pixel_of_the_quotient_method():
    """As docs/theory/quotient.md counts them: 11 for a light, 9 for a further light."""
    scene = small_scene()
    for lights, products in ((1, 11), (2, 20)):
        trace, some = Trace(), replace(scene, lights=scene.lights[:lights])
        Duff().shade(some, rasterise(some), trace)
        assert trace.multipliers["pixel"] == products
        assert trace.multipliers["triangle"] == 18 * (1 + lights) + 18 * lights


def test_counted_words_are_those_of_the_quotient():
    """A unit that counts its words gives the words of the unit that does not."""
    scene = small_scene()
    raster = rasterise(scene)
    pixels = Duff().pixels(scene, screen_triangles(scene, raster), Trace())
    unit = Quotient()
    some = pixels._replace(**{name: getattr(pixels, name)[:, :1] for name in ("numerator", "line", "away")})
    counted = TracedQuotient()
    for found, expected in zip(counted.compute(some), unit.compute(some), strict=True):
        codes = [of.codes if isinstance(of, Fixed) else of for of in (found, expected)]
        np.testing.assert_array_equal(*codes)


def test_taylors_series_has_the_values_and_slopes_of_the_quotient():
    """At the middle of each triangle value and slopes are exact, by differences of the exact function."""
    scene = small_scene(0.8)
    raster = rasterise(scene)
    triangles = screen_triangles(scene, raster)
    found = BishopWeimer().host(scene, triangles)
    scaled = [triangles.normal[k] * triangles.weight[k] for k in range(3)]
    x, y = triangles.x, triangles.y
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])

    def exact(i, j):
        u = ((i - x[0]) * (y[2] - y[0]) - (j - y[0]) * (x[2] - x[0])) / area
        v = ((j - y[0]) * (x[1] - x[0]) - (i - x[0]) * (y[1] - y[0])) / area
        vector = scaled[0] * (1 - u - v) + scaled[1] * u + scaled[2] * v
        normal = (vector / np.linalg.norm(vector, axis=0)).T
        towards = np.stack([light.towards() for light in scene.lights])
        halfway = halfway_vector(towards, scene.camera.viewer)
        return np.concatenate([towards @ normal.T, 1 - halfway @ normal.T])

    i, j = x.mean(axis=0), y.mean(axis=0)
    for step in (0, 0.02):
        for a, b in ((step, 0), (-step, step), (0, -step)):
            np.testing.assert_allclose(
                _polynomial(found, i + a, j + b), exact(i + a, j + b), rtol=0, atol=1e-12 + (0.1 * step) ** 3
            )


def test_near_lights_are_served_or_refused():
    coarse, scene = (
        replace(small_scene(0.2, 20, 0, cells), lights=(Light(position=(0.5, 0.5, 4.0)),), viewer="near")
        for cells in (3, 12)
    )
    for name, most in (("bishop-weimer-six", 0.1), ("loisel", 0.5), ("abbas", 0.5)):
        assert _errors(RIVALS[name], scene) < min(most, _errors(RIVALS[name], coarse) / 8)
    for name in ("duff", "bishop-weimer"):
        with pytest.raises(ValueError, match="distant lights and a distant viewer"):
            _errors(RIVALS[name], scene)


def test_colours_are_those_of_the_units():
    rng = np.random.default_rng(2)
    scene = small_scene()
    cosine = Fixed(SQ(2, 25), rng.integers(-(1 << 24), 1 << 25, (500, 2)))
    operand = Fixed(UQ(1, 25), rng.integers(0, 1 << 20, (500, 2)))
    lobe = Lobe(BLINN, "one_minus_cosine")
    shades = shaded(scene, cosine, operand, lobe, Trace())
    constants = FrameConstants.of(scene, 2)
    unit = Diffuse(cosine.format)
    specular = lobe.compute(operand, unit.dark(cosine), lobe.table(40))
    colors = (constants.ambient, constants.diffuse, constants.specular)
    ambient, diffuse, glossy = (Fixed(Intensity.COLOR_FORMAT, of) for of in colors)
    found = Intensity(2).compute(ambient, diffuse, glossy, unit.compute(cosine), specular)
    np.testing.assert_array_equal(shades.color, found)
    assert len(np.unique(shades.color)) > 20


def test_a_triangle_before_the_near_plane_is_refused():
    scene = small_scene()
    camera = replace(scene.camera, near=float(np.linalg.norm(scene.camera.position)))
    scene = replace(scene, camera=camera)
    with pytest.raises(ValueError, match="before the near plane"):
        screen_triangles(scene, rasterise(scene))
