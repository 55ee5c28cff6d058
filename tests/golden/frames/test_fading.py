"""Lights that fade, with spans that are cut for them, against the exact frame."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.frames.compare import compare
from blysk.golden.frames.cut import cut_by_error
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.local import local_operands
from blysk.golden.presets import preset
from blysk.golden.reference.light import Light
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import COSQUAD
from blysk.golden.reference.renderer import fragment_positions

from .cuts import METHOD, ONE_VALUE, exact_operands, material
from .test_local import floor, lit_teapot

HIGH = (0.5, 3.0, 0.5)
LIGHTS = {
    "by distance": Light(position=HIGH, attenuation=(0.2, 0.1, 0.2)),
    "to its limit of 1": Light(position=(0.5, 0.6, 0.5), attenuation=(0, 0, 1)),
    "brighter than white": Light(position=HIGH, color=(5, 5, 5), attenuation=(1, 0, 1)),
    "spot": Light(position=HIGH, spot=(0.1, -1, 0.05), cone=(10, 25)),
    "sharp spot": Light(position=HIGH, spot=(0.1, -1, 0.05), cone=(15, 15.2)),
    "spot of a few pixels": Light(position=HIGH, spot=(0.3, -1, 0.2), cone=(0.1, 0.5)),
}


def drawn(scene, exponent):
    """Errors of a frame and its cut spans, and the cut spans of lights that do not fade."""
    design = preset("chord-local", "blinn", len(scene.lights))
    fading = tuple(k for k, light in enumerate(scene.lights) if light.fades)
    frame = model_frame(scene, replace(design, factors=fading))
    assert frame.out_of_range_spans == 0
    return compare(scene, design, frame), frame


@pytest.mark.parametrize("viewer", ["near", pytest.param("distant", marks=pytest.mark.long)])
@pytest.mark.parametrize("name", LIGHTS)
def test_floor(name, viewer):
    """In spans of hundreds of pixels the total error is within an LSB, whatever lies between two places of a
    span."""
    for exponent in (1, 200):
        scene = replace(floor([HIGH], exponent, viewer), lights=(LIGHTS[name],))
        errors, frame = drawn(scene, exponent)
        assert errors.total_error.max_lsb < 0.75
        assert errors.arithmetic_error.max_lsb < 0.55
        # The light is in the picture, and a span has more than one pixel.
        assert frame.image.max() > 100
        assert frame.pixels > 5 * frame.spans


def test_teapot():
    """Lights with and without a factor in one frame."""
    scene = lit_teapot(50)
    lamps = list(scene.lights)
    lamps[0] = replace(lamps[0], spot=tuple(-np.array(lamps[0].position)), cone=(5, 40))
    lamps[1] = replace(lamps[1], color=(0.3,) * 3, attenuation=(1, 0, 1))
    scene = replace(scene, lights=tuple(replace(lamp, color=(0.4,) * 3) for lamp in lamps))
    errors, _ = drawn(scene, 50)
    assert errors.total_error.max_lsb < 0.75


def test_every_pixel_is_within_the_budgets():
    """The quadratics alone keep the budgets of the cuts, for a N·L and for the highlight times a."""
    scene = replace(floor([HIGH], 20), lights=(LIGHTS["spot"],))
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values, factors = local_operands(scene, cut, factors=(0,))
    cosine, u, factor = METHOD.exact_operands(values, cut.length, factors)
    points = fragment_positions(scene, cut, np.arange(len(cut.span)))
    light = scene.lights[0]
    exact = light.factor(points)
    upright = np.einsum("fk,k->f", light.towards(points), [0.0, 1, 0])
    assert (
        255 * np.abs(np.maximum(ONE_VALUE * cosine[:, 0], 0) - exact * upright).max() <= METHOD.DIFFUSE_BUDGET
    )
    found, wanted = (COSQUAD.reflect(1 - of[:, 0], 20) for of in (u, exact_operands(scene, cut)[1]))
    assert (
        0.01
        < 255 * np.abs(np.maximum(factor[:, 0], 0) * found - exact * wanted).max()
        <= METHOD.HIGHLIGHT_BUDGET
    )


def test_operands_by_hand():
    """Codes of a and of a N·L at a first pixel. The light without a factor has its own N·L."""
    scene = floor([HIGH, HIGH])
    scene = replace(scene, lights=(scene.lights[0], LIGHTS["by distance"]))
    cut, _ = cut_by_error(scene, rasterise(scene), METHOD)
    values, factors = local_operands(scene, cut, 3, (1,))
    assert factors.shape == (len(cut.length), 1, 3)
    first = np.cumsum(cut.length) - cut.length
    points = fragment_positions(scene, cut, first)
    towards = HIGH - points
    distance = np.linalg.norm(towards, axis=1)
    a = 1 / np.maximum(0.2 + 0.1 * distance + 0.2 * distance**2, 1)
    step = ChordSetup.DIFFUSE_FORMAT.step / ONE_VALUE
    assert np.abs(factors[:, 0, 0] * step - a).max() <= step
    assert np.abs(values.diffuse[:, 1, 0] * step - a * towards[:, 1] / distance).max() <= step
    assert np.abs(values.diffuse[:, 0, 0] * step - towards[:, 1] / distance).max() <= step
    assert not values.diffuse[:, 2].any()


def test_design_without_the_factor_is_refused():
    scene = replace(floor([HIGH]), lights=(LIGHTS["spot"],))
    with pytest.raises(ValueError, match=r"^light 0 fades, and the design has no factor for it: give fact"):
        model_frame(scene, preset("chord-local", "blinn"))
    with pytest.raises(ValueError, match=r"^point lights and a near viewer need the method chord-local$"):
        model_frame(scene, preset("renormalise", "blinn"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            {"method": "renormalise", "factors": (0,)},
            r"^factors of lights need the method chord-local, and ",
        ),
        ({"model": None, "factors": (0,)}, r"and specular light$"),
        ({"factors": (1,)}, r"^factors must be different lights of 1, in order$"),
        ({"lights": 3, "factors": (1, 0)}, r"lights of 3, in order$"),
    ],
)
def test_refusals(options, says):
    with pytest.raises(ValueError, match=says):
        preset(**{"method": "chord-local", "model": "blinn"} | options)


def test_without_specular_light_there_is_no_factor():
    """N·L carries the factor, so the hardware is that of a light that does not fade."""
    scene = replace(
        floor([HIGH], 20), lights=(LIGHTS["spot"],), material=replace(material(20), specular=(0, 0, 0))
    )
    design = preset("chord-local", None)
    frame = model_frame(scene, design)
    errors = compare(scene, preset("chord-local", "blinn"), frame)
    assert errors.total_error.max_lsb < 0.75
    assert frame.image.max() > 100
