# amaranth: UnusedElaboratable=no
"""Light unit: both terms of a light against the composition of the twins, clock by clock."""

import numpy as np
import pytest

from blysk.golden.cosines.chord import Chord
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.sim.engines.simulate import simulate


def operands_of(parameters, diffuse, normals, direction, halfway):
    """``N . L`` in the format of ``diffuse``, and ``N . H`` or the chord."""
    normals, direction, halfway = (Fixed(COMPONENT, codes) for codes in (normals, direction, halfway))
    cosine = DotProduct().compute(normals, direction)
    cosine = cosine.truncate(diffuse.operand_format.fraction_bits).saturate(diffuse.operand_format)
    product = DotProduct().compute if parameters.operand == "cosine" else Chord().operand
    return {"cosine": cosine, "highlight": product(normals, halfway)}


def terms(parameters, diffuse, operands, exponent):
    cosine = operands["cosine"]
    specular = parameters.compute(operands["highlight"], cosine.codes <= 0, exponent)
    return {"diffuse": diffuse.compute(cosine).codes, "specular": specular.codes}


def codes_of(operands):
    return {name: operand.codes for name, operand in operands.items()}


def normals_about(rng, direction, halfway, exponent):
    """All around, about the highlight, about the terminator, on it, and the ends of the word."""
    everywhere = rng.normal(size=(300, 3))
    highlight = halfway / ONE + rng.normal(size=(300, 3)) / np.sqrt(exponent)
    terminator = np.cross(direction, rng.normal(size=(100, 3))) / ONE
    normals = np.vstack([everywhere, highlight, terminator, [halfway / ONE, direction / ONE]])
    normals = quantise(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    ends = [COMPONENT.min_code, COMPONENT.max_code, 0]
    return np.vstack([normals, np.stack(np.meshgrid(ends, ends, ends), axis=-1).reshape(-1, 3)])


# The chord method and the angular one have N.L in SQ(2, 25); methods that find normals have it whole.
DIFFUSE = {"cosine": Diffuse(), "one_minus_cosine": Diffuse(SQ(2, 25))}


@pytest.mark.parametrize(
    ("model", "operand", "exponent"),
    [
        *(("cosquad", "cosine", exponent) for exponent in (1, 30, 1000)),
        *(("cosquad", "one_minus_cosine", exponent) for exponent in (1, 30, 1000)),
        ("lyon3", "one_minus_cosine", 1000),
        ("exp", "cosine", 1),
        ("coscos2", "one_minus_cosine", 30),
        ("blinn", "cosine", 30),
        ("blinn", "one_minus_cosine", 1000),
    ],
)
def test_equals_twins(verify, normal_pairs, model, operand, exponent):
    rng = np.random.default_rng(exponent)
    parameters = Power(operand) if model == "blinn" else Specular(REFLECTION_MODELS[model], operand)
    light, viewer = normal_pairs(rng, 1, 70.0)
    halfway = (light + viewer) / np.linalg.norm(light + viewer)
    direction, halfway = quantise(light)[0], quantise(halfway)[0]
    normals = normals_about(rng, direction, halfway, exponent)
    operands = operands_of(parameters, DIFFUSE[operand], normals, direction, halfway)
    expected = terms(parameters, DIFFUSE[operand], operands, exponent)
    dark = normals @ direction <= 0
    assert expected["specular"].max() > 2**16
    assert not expected["specular"][dark].any()
    assert not expected["diffuse"][dark].any()
    unit = LightUnit(parameters, DIFFUSE[operand])
    assert unit.latency == (PowerUnit if model == "blinn" else SpecularUnit)(parameters).latency
    verify(unit, codes_of(operands), expected, constants={"exponent": exponent})


def test_every_bit_counts(normal_pairs):
    """Every bit of the exponent and of its slope; of the products those too that are rounded off."""
    rng = np.random.default_rng(7)
    unit = LightUnit()
    for exponent in [*1 << np.arange(10), *rng.integers(1, 1001, 50)]:
        direction, halfway = (quantise(v)[0] for v in normal_pairs(rng, 1, 35.0))
        normals = halfway / ONE + rng.normal(size=(4000, 3)) / np.sqrt(exponent)
        normals = quantise(normals / np.linalg.norm(normals, axis=1, keepdims=True))
        operands = operands_of(Specular(), Diffuse(), normals, direction, halfway)
        constants = {"exponent": exponent}
        run = simulate(unit, codes_of(operands), count=len(normals), constants=constants, engine="auto")
        for name, expected in terms(Specular(), Diffuse(), operands, exponent).items():
            np.testing.assert_array_equal(run.beats[name], expected)


def test_terminator(verify):
    """The highlight, however bright, comes and goes with N.L: 0, one code above and below, any one bit."""
    direction, halfway = np.array([1, 0, 0]), np.array([0, 0, ONE])
    normals = np.array([[1, 0, ONE], [0, 0, ONE], [-1, 0, ONE]])
    operands = codes_of(operands_of(Specular(), Diffuse(), normals, direction, halfway))
    np.testing.assert_array_equal(operands["cosine"], [1, 0, -1])
    bits = 1 << np.arange(1, 34)
    cosine = np.r_[operands["cosine"], np.c_[bits, -bits].ravel()]
    lit = cosine > 0
    expected = {"diffuse": lit * (cosine + 2**16 >> 17), "specular": lit * (2**17 - 2)}
    operands = {"cosine": cosine, "highlight": np.resize(operands["highlight"], len(cosine))}
    verify(LightUnit(), operands, expected, constants={"exponent": 10})


def test_black_light(verify, normal_pairs):
    """A light that is not there, all zero: no diffuse and no specular term."""
    normals = quantise(normal_pairs(np.random.default_rng(1), 200, 0.0)[0])
    zero = np.zeros(3, dtype=int)
    operands = codes_of(operands_of(Specular(), Diffuse(), normals, zero, zero))
    expected = {"diffuse": np.zeros(200, int), "specular": np.zeros(200, int)}
    verify(LightUnit(), operands, expected, constants={"exponent": 1})


@pytest.mark.parametrize(
    ("model", "operand", "interval"),
    [("cosquad", "cosine", 3), ("coscos4", "one_minus_cosine", 6), ("blinn", "one_minus_cosine", 42)],
)
@pytest.mark.parametrize("gated", [False, True])
def test_dark_beats_pass_the_specular_unit_by(model, operand, interval, gated, normal_pairs):
    """In order, with a specular term of 0; a run of them takes a clock each."""
    rng = np.random.default_rng(interval)
    parameters = Power(operand) if model == "blinn" else Specular(REFLECTION_MODELS[model], operand)
    diffuse = DIFFUSE[operand]
    light, viewer = normal_pairs(rng, 1, 70.0)
    direction = quantise(light)[0]
    halfway = quantise((light + viewer) / np.linalg.norm(light + viewer))[0]
    normals = normals_about(rng, direction, halfway, 30)
    operands = operands_of(parameters, diffuse, normals, direction, halfway)
    count = len(normals)
    dark = operands["cosine"].codes <= 0
    beats = codes_of(operands)
    if gated:
        beats["gated"] = rng.random(count) < 0.3
        beats["gated"][200:250] = True
        dark = dark | beats["gated"]
    expected = {
        "diffuse": diffuse.compute(operands["cosine"]).codes,
        "specular": parameters.compute(operands["highlight"], dark, 30).codes,
    }
    assert 0.2 < dark.mean() < 0.9
    unit = LightUnit(parameters, diffuse, initiation_interval=interval, gated=gated)
    assert unit.initiation_interval == interval
    runs = []
    for share in (0, 0.3, 0.8):
        runs.append(
            simulate(
                unit,
                beats,
                count=count,
                constants={"exponent": 30},
                engine="auto",
                input_stalls=rng.random(997) < share / 2,
                output_stalls=rng.random(1009) < share,
            )
        )
        for name, codes in expected.items():
            np.testing.assert_array_equal(runs[-1].beats[name], codes)
    lit = np.count_nonzero(~dark)
    cycles = runs[0].cycles
    # After a run of dark beats, which take a clock each, a lit one waits for the unit's turn.
    runs_of_dark = np.count_nonzero(np.diff(dark.astype(int)) == 1)
    assert interval * (lit - 1) <= cycles[-1] - cycles[0] <= interval * (lit + runs_of_dark) + (count - lit)
    if gated:
        # The last of a long run of dark beats.
        assert cycles[249] - cycles[230] == 19


@pytest.mark.long
@pytest.mark.parametrize("model", ["cosquad", "blinn"])
def test_exponent_for_good(verify, model, normal_pairs):
    rng = np.random.default_rng(1)
    parameters = Power() if model == "blinn" else Specular(REFLECTION_MODELS[model])
    direction, halfway = (quantise(vector)[0] for vector in normal_pairs(rng, 1, 20.0))
    operands = operands_of(
        parameters, Diffuse(), normals_about(rng, direction, halfway, 77), direction, halfway
    )
    expected = terms(parameters, Diffuse(), operands, 77)
    assert np.count_nonzero(expected["specular"]) > 100
    verify(LightUnit(parameters, exponent=77), codes_of(operands), expected)
