"""Pipelines with a table: errors of frames against exact shading, banks, the gate, fixed tables."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.surfaces import sphere
from blysk.golden.frame_constants import (
    BANK_ADDRESS,
    LOBE_ADDRESS,
    THRESHOLD_ADDRESS,
    FrameConstants,
    writes_of,
)
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import constants_of
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.presets import LOBES, METHODS, preset
from blysk.golden.reference.lobes import GGX, TabulatedModel
from blysk.sim.meshes.teapot import teapot

SMALL = (160, 120)


def scene(exponent=20, roughness=None, mesh=None, size=SMALL):
    given = scene_for(mesh or sphere(32), exponent, *size)
    return replace(given, material=replace(given.material, roughness=roughness))


def several(parameters, name="roughness"):
    """Make a sphere whose faces have three materials."""
    given = scene()
    materials = [replace(given.material, **{name: value}) for value in parameters]
    mesh = replace(given.mesh, material=np.arange(len(given.mesh.faces)) % len(materials))
    return replace(given, mesh=mesh, material=materials)


@pytest.mark.parametrize("exponent", [1, 10, 100, 1000])
def test_frame_is_exact_blinn(exponent):
    """No channel differs from the method in float64 by more than the rounding and 0.05 LSB."""
    design = preset("renormalise", "blinn")
    given = scene(exponent, mesh=teapot(2000))
    found = compare(given, design, model_frame(given, design))
    assert found.arithmetic_error.max_lsb < 0.55
    product = preset("renormalise", "blinn_product")
    of_products = compare(given, product, model_frame(given, product))
    assert found.total_error.max_lsb < of_products.total_error.max_lsb + 0.03
    of_squares = compare(
        given, preset("renormalise", "cosquad"), model_frame(given, preset("renormalise", "cosquad"))
    )
    assert found.total_error.rmse_lsb < (0.5 if exponent < 1000 else 0.6) * of_squares.total_error.rmse_lsb
    # The rest is the method's error: normals are linear along a span.
    assert found.method_error.max_lsb < 0.75


def test_frame_is_exact_where_a_lobe_has_a_kink():
    design, given = preset("renormalise", "phong_coplanar"), scene(1, mesh=teapot(2000))
    assert compare(given, design, model_frame(given, design)).method_error.max_lsb < 0.75


@pytest.mark.parametrize("roughness", [0.05, 0.1, 0.3, 0.6, 1])
def test_frame_is_exact_ggx(roughness):
    design = preset("renormalise", "ggx")
    given = scene(roughness=roughness, mesh=teapot(2000))
    found = compare(given, design, model_frame(given, design))
    assert found.arithmetic_error.max_lsb < 0.6
    assert found.method_error.max_lsb < 0.75


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", LOBES)
def test_every_method_serves_every_lobe(method, model):
    """The difference from the method in float64 is within the error of the operand at the steepest point of
    the lobe."""
    given = scene(30, mesh=teapot(400), size=(64, 48))
    design = preset(method, model)
    frame = model_frame(given, design)
    found = compare(given, design, frame)
    assert frame.image.max() > 150
    steepness = design.steepness(given.material)
    widest = min(design.interpolator.widest_span(steepness), design.interpolator.MAX_ANGLE)
    operand = design.interpolator.operand_error(int(frame.prepared.spans.length.max()), widest)
    # k_d and k_s are those of `scene_for`. Colours are rounded to 1/64 LSB, and pixels are rounded, too.
    bound = 0.5 + 3 / 64 + 255 * (0.4 * operand + 0.55 * (steepness * operand + 0.06 / 255))
    assert found.arithmetic_error.max_lsb < bound


@pytest.mark.parametrize("cutoff", [0, 1 / 510])
@pytest.mark.parametrize(("model", "parameters"), [("blinn", (3, 40, 900)), ("ggx", (0.2, 0.35, 0.9))])
def test_gate_changes_no_pixel(model, parameters, cutoff):
    given = several(parameters, "roughness" if model == "ggx" else "exponent")
    plain, gated = (
        preset("quadratic", model, materials=3, gate=gate, cutoff=cutoff) for gate in (False, True)
    )
    image = model_frame(given, plain).image
    np.testing.assert_array_equal(model_frame(given, gated).image, image)
    constants = constants_of(given, gated)
    frame = model_frame(given, gated)
    lit = gated.lit_spans(frame.prepared.spans, constants)[:, 0]
    shares = [lit[frame.prepared.spans.material == index].mean() for index in range(3)]
    # The narrower the highlight, the fewer spans it touches.
    assert 0 < min(shares[0], shares[2]) < max(shares[0], shares[2]) <= 1
    exact = model_frame(given, preset("quadratic", model, materials=3))
    # Half an LSB at intensity 1, and the rounding of a channel.
    assert np.abs(exact.image.astype(int) - image).max() <= (1 if cutoff else 0)


def test_equal_lobes_share_a_bank():
    given = several((0.3, 0.6, 0.3))
    design = preset("quadratic", "ggx", materials=3, gate=True)
    assert design.specular.banks == 3
    constants = constants_of(given, design)
    assert [of.bank for of in constants] == [0, 1, 0]
    assert constants[0].lobe is constants[2].lobe
    assert [of.lobe.parameter for of in constants] == [0.3, 0.6, 0.3]
    writes = writes_of(constants)
    loads = writes["data"][writes["address"] == LOBE_ADDRESS]
    # Two tables take 336 entries, the end entry and the bank each.
    assert len(loads) == 2 * 338
    assert loads[[0, 338]].tolist() == [1 << 17, 1 << 17 | 1]
    assert (writes["address"] == THRESHOLD_ADDRESS).sum() == 3
    assert writes["data"][writes["address"] == BANK_ADDRESS].tolist() == [0, 1, 0]


def test_banks_that_do_not_suffice_are_refused():
    message = (
        r"^the materials have 3 lobes, the pipeline has banks for 2; give materials an equal roughness, or "
        r"build it with more banks, up to 64$"
    )
    with pytest.raises(ValueError, match=message):
        constants_of(several((0.3, 0.6, 0.9)), preset("renormalise", "ggx", materials=3, banks=2))


def test_fixed_tables():
    """Fixed tables take no writes and give the same pixels. Other lobes are refused."""
    given = scene(40)
    fixed, loaded = preset("renormalise", "blinn", exponent=40), preset("renormalise", "blinn")
    np.testing.assert_array_equal(model_frame(given, fixed).image, model_frame(given, loaded).image)
    (constants,) = constants_of(given, fixed)
    assert LOBE_ADDRESS not in constants.writes()["address"]
    with pytest.raises(ValueError, match=r"^the exponent is fixed at 40, not 41$"):
        constants_of(scene(41), fixed)
    with pytest.raises(ValueError, match=r"^the roughness is fixed at 0.3, not 0.4$"):
        constants_of(scene(roughness=0.4), preset("renormalise", "ggx", roughness=0.3))


def test_a_curve_of_ones_own():
    """A function can be the model. Its frame equals the rendering in float64."""
    curve = TabulatedModel("steps", function=lambda c: np.round(c * 4) / 4)
    design = preset("renormalise", curve)
    assert (design.model, design.specular.banks) == ("steps", 1)
    given = scene()
    image = model_frame(given, design).image
    # The picture has four levels and the diffuse term, which is smooth.
    assert len(np.unique(image)) > 50
    found = compare(given, design, model_frame(given, design))
    assert found.arithmetic_error.p999_lsb < 0.6 * 255 / 4


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"model": "ggx", "exponent": 20}, r"^model ggx has no exponent to fix$"),
        ({"model": "blinn", "roughness": 0.2}, r"^model blinn has no roughness to fix$"),
        ({"model": "cosquad", "roughness": 0.2}, r"^model cosquad has no roughness to fix$"),
        ({"model": "ggx", "roughness": 1.5}, r"^roughness must be greater than 0 and at most 1, not 1.5$"),
        (
            {"model": "phong"},
            r"^phong is a lobe of R·V: take the method quotient, or phong_coplanar$",
        ),
        ({"model": "cosquad", "banks": 2}, r"^method renormalise has no option banks$"),
        ({"model": "ggx", "banks": 65}, r"^banks must be 1 to 64, not 65$"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        preset("renormalise", **options)


def test_bad_designs_are_refused():
    lobe = Lobe(GGX, fraction_bits=30)
    design = preset("renormalise", "ggx")
    with pytest.raises(ValueError, match=r"^1 - N·H has 25 fraction bits in a pipeline, the lobe 30$"):
        replace(design, specular=lobe)
    assert replace(preset("linear", "ggx"), specular=lobe).specular.fraction_bits == 30
    with pytest.raises(ValueError, match=r"^a lobe has tables and no exponent; fix its tables$"):
        design.built(exponent=20)
    given = scene()
    spans = model_frame(given, design).prepared.spans
    with pytest.raises(ValueError, match=r"^a lobe needs a table; constants_of gives"):
        design.compute(spans, FrameConstants.of(given))


def test_energy_factor_of_a_roughness():
    """The factor of the material's roughness multiplies k_s.

    A colour that is too bright is refused, and the message names the roughness.
    """
    given = scene(roughness=0.9)
    plain, normalised = (FrameConstants.of(given, energy=energy) for energy in (None, GGX))
    ratio = normalised.specular / plain.specular
    assert ratio == pytest.approx(GGX.energy_factor(0.9), rel=1e-3)
    message = (
        r"^the energy factor .* of ggx with roughness 0.1 makes a specular term of .*, over 8; raise the "
        r"roughness or lower the specular coefficient or the light$"
    )
    with pytest.raises(ValueError, match=message):
        FrameConstants.of(scene(roughness=0.1), energy=GGX)
