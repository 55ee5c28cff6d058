"""Errors of bright light are in proportion to the largest channel of all terms together."""

import pytest

import blysk
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.reference.lighting import Light
from blysk.sim.api.render import prepare_rendering
from blysk.sim.api.settings import rendering_settings

LIGHTS = ((-0.5, 0.8, 0.7), (0.9, 0.2, 0.5))


@pytest.mark.parametrize("color", [1, 8, *(pytest.param(k, marks=pytest.mark.long) for k in range(2, 8))])
@pytest.mark.parametrize("method", ["chord-local", "renormalise"])
def test_errors_are_in_proportion(method, color):
    """One light and two, diffuse and shining surfaces, and exponents with many and few cuts.

    A dim material under a bright light equals a bright material under a dim light, because only the product
    counts. So the brightness goes to 8, the largest of a term.
    """
    for exponent, diffuse, number in ((1, 0.4, 1), (20, 0.2, 2), (200, 0.0, 1)):
        share = color / number
        lights = [Light(to, (share, share / 2, share)) for to in LIGHTS[:number]]
        scene = blysk.scene(
            "teapot",
            triangles=600,
            size=(160, 120),
            lights=lights,
            ambient=0,
            diffuse=diffuse,
            specular=1 - diffuse,
            exponent=exponent,
        )
        design = blysk.design(method=method, lights=number, transfer="linear")
        errors = compare(scene, design, model_frame(scene, design))
        assert 0.4 < errors.arithmetic_error.max_lsb <= 0.5 + color / 16
        bound = 0.5 + color / 16 + color / 4
        if method == "chord-local":
            term = 0.2 + 255 * (design.lobe.line_error(exponent) + design.lobe.ERROR)
            light = diffuse * (0.12 + 255 * 2.0**-18) + (1 - diffuse) * term
            bound = 0.5 + (1 + 2 * number) / 128 + color * light
        assert errors.bound_lsb == pytest.approx(bound)
        assert errors.method_error.max_lsb <= errors.bound_lsb


@pytest.mark.ci
@pytest.mark.long
def test_a_light_that_is_off_is_not_built():
    """A light that is off takes no hardware and needs no method, wherever it is."""
    key = Light((-0.5, 0.8, 0.7))
    off = [Light((0, 0, 1), (0, 0, 0)), Light(position=(1, 2, 3), color=(0, 0, 0))]
    settings = rendering_settings("teapot", {"lights": [key, *off], "size": (16, 12), "triangles": 220})
    ready = prepare_rendering(settings, engine="pysim")
    assert ready.scenes[0].lights == (key,)
    assert (ready.design.lights, ready.design.method) == (1, "quotient")
