"""Light unit: both terms of a light against the composition of the twins, clock by clock."""

import numpy as np
import pytest

from golden.diffuse import Diffuse
from golden.dot_product import DotProduct
from golden.fixed import Fixed
from golden.specular import Specular
from golden.unit_vector import COMPONENT, ONE, quantise
from hdl.light import LightUnit


def terms(parameters, normals, direction, halfway, exponent):
    normals, direction, halfway = (Fixed(COMPONENT, codes) for codes in (normals, direction, halfway))
    dot = DotProduct()
    cosine = dot.compute(normals, direction)
    specular = parameters.compute(dot.compute(normals, halfway), Diffuse.dark(cosine), exponent)
    return {"diffuse": Diffuse().compute(cosine).codes, "specular": specular.codes}


def normals_about(rng, direction, halfway, exponent):
    """All around, about the highlight, about the terminator, on it, and the ends of the word."""
    everywhere = rng.normal(size=(300, 3))
    highlight = halfway / ONE + rng.normal(size=(300, 3)) / np.sqrt(exponent)
    terminator = np.cross(direction, rng.normal(size=(100, 3))) / ONE
    normals = np.vstack([everywhere, highlight, terminator, [halfway / ONE, direction / ONE]])
    normals = quantise(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    ends = [COMPONENT.min_code, COMPONENT.max_code, 0]
    return np.vstack([normals, np.stack(np.meshgrid(ends, ends, ends), axis=-1).reshape(-1, 3)])


@pytest.mark.parametrize("exponent", [1, 30, 1000])
def test_equals_twins(verify, normal_pairs, exponent):
    rng = np.random.default_rng(exponent)
    parameters = Specular()
    light, viewer = normal_pairs(rng, 1, 70.0)
    halfway = (light + viewer) / np.linalg.norm(light + viewer)
    direction, halfway = quantise(light)[0], quantise(halfway)[0]
    normals = normals_about(rng, direction, halfway, exponent)
    expected = terms(parameters, normals, direction, halfway, exponent)
    dark = normals @ direction <= 0
    assert expected["specular"].max() > 2**16
    assert not expected["specular"][dark].any()
    assert not expected["diffuse"][dark].any()
    verify(
        LightUnit(parameters),
        normals,
        expected,
        constants={"direction": direction, "halfway": halfway, "exponent": exponent},
    )


def test_terminator(verify):
    """N.L of one code above 0, 0, and one below: the highlight, however bright, comes and goes with it."""
    direction, halfway = np.array([1, 0, 0]), np.array([0, 0, ONE])
    normals = np.array([[1, 0, ONE], [0, 0, ONE], [-1, 0, ONE]])
    expected = {"diffuse": np.zeros(3, int), "specular": np.array([2**17 - 2, 0, 0])}
    constants = {"direction": direction, "halfway": halfway, "exponent": 10}
    verify(LightUnit(), normals, expected, constants=constants)


def test_black_light(verify, normal_pairs):
    """A light that is not there, all zero: no diffuse and no specular term."""
    normals = quantise(normal_pairs(np.random.default_rng(1), 200, 0.0)[0])
    zero = np.zeros(3, dtype=int)
    expected = {"diffuse": np.zeros(200, int), "specular": np.zeros(200, int)}
    verify(LightUnit(), normals, expected, constants={"direction": zero, "halfway": zero, "exponent": 1})
