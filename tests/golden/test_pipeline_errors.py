"""The model of the pipeline against the same method in float64: errors of a pixel's channel, in LSB."""

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, halfway_vector, intensity, saturate
from blysk.golden.reference.reflection import REFLECTION_MODELS

from ..lists import SPECULAR_MODELS

AMBIENT, DIFFUSE, SPECULAR = 0.1, 0.6, 0.5
LARGEST_ANGLE = 20.0
STEP = 2.0**-17

# Largest |model - float64 * 255| in LSB, with the half of the last rounding, rounded up. The sweep has 10^7
# pixels, half of them about the highlight.
MEASURED = {1: 0.51, 10: 0.52, 100: 0.62, 1000: 1.6}


def error_bounds(model, exponent):
    """Bounds of the error of N.L, and of a channel in LSB: sums of the units' bounds.

    `quantise` moves a vector by half a step along itself and by sqrt(3) steps across. If the ends turn a
    little, the curve between them turns, and its length changes at second order only. So only the lengths of
    the ends move a normal along itself. A move across changes a highlight by the sine of the largest angle
    with light, ``1 - cos gamma = 1/k``. The weights of the curve's three normals add up to at most 1.25, and
    the middle moves by ``1/cos(psi/2)`` of the mean of the ends. The middle adds `MiddleNormal.ERROR` a
    component, the setup three relative steps of G and one of P, the accumulator half a step a component.
    """
    k = REFLECTION_MODELS[model].slope(exponent)
    sine = np.sqrt(1 - max(1 - 1 / k, 0) ** 2)
    root = np.sqrt(3)
    half = np.radians(LARGEST_ANGLE) / 2
    setup = STEP * (2.12 * half + 3 * 4 * (1 - np.cos(half)))
    drift = DifferenceSetup.FORMAT.step * (64 + 64**2 / 2)
    common = root * MiddleNormal.ERROR + setup + root * (drift + STEP / 2)
    # The normal and the constant vector are both quantised.
    quantised = 1.25 / np.cos(half) + 1
    cosine = common + quantised * STEP * (0.5 + root)
    highlight_cosine = common + quantised * STEP * (0.5 + root * sine)
    # Lengths are ONE / 2^17, so cosines are 2^-16 too small.
    diffuse = cosine + 2.0**-16 + 2.0**-18
    # The square of a base of at most 1 doubles the error.
    specular = 2 * k * highlight_cosine + Specular.ERROR
    operands = 3 * Intensity.COLOR_FORMAT.step / 2
    return cosine, 0.5 + operands + 255 * (DIFFUSE * diffuse + SPECULAR * specular)


def random_spans(rng, count, exponent, light, halfway, largest=LARGEST_ANGLE):
    """Spans of random normals.

    Half of them pass near the highlight's peak, and a tenth near the terminator.
    """
    angle = rng.uniform(0, largest, count)
    left, right = pairs_at(rng, count, angle)
    near = count * 6 // 10
    aim = np.where(np.arange(near)[:, np.newaxis] < count // 2, halfway, 0)
    spread = np.where(np.arange(near) < count // 2, rng.uniform(0, 3 / np.sqrt(exponent), near), 1)
    target = normalise(aim + spread[:, np.newaxis] * rng.normal(size=(near, 3)))
    edge = target[count // 2 :]
    target[count // 2 :] = normalise(edge - (edge @ light)[:, np.newaxis] * light)
    side = normalise(np.cross(target, rng.normal(size=(near, 3))))
    turn, part = np.radians(angle[:near])[:, np.newaxis], rng.uniform(0, 1, (near, 1))
    left[:near] = target * np.cos(turn * part) - side * np.sin(turn * part)
    right[:near] = target * np.cos(turn * (1 - part)) + side * np.sin(turn * (1 - part))
    return left, right, rng.integers(1, 65, count)


def sweep(rng, frames, count, model, exponent):
    """Errors in LSB of the well-posed pixels, the number of other pixels, and the number of saturated
    pixels."""
    errors, ill_posed, full = [], 0, 0
    band, _ = error_bounds(model, exponent)
    design = preset("quadratic", model)
    material = Material(*((value,) * 3 for value in (AMBIENT, DIFFUSE, SPECULAR)), exponent)
    for _ in range(frames):
        light, viewer = normalise(rng.normal(size=(2, 3)))
        halfway = halfway_vector(light, viewer)
        left, right, length = random_spans(rng, count, exponent, light, halfway)
        constants = FrameConstants(
            exponent,
            Intensity.color(np.full(3, AMBIENT)),
            quantise(light)[np.newaxis],
            quantise(halfway)[np.newaxis],
            Intensity.color(np.full((1, 3), DIFFUSE)),
            Intensity.color(np.full((1, 3), SPECULAR)),
        )
        zero = np.zeros(count, dtype=int)
        pixels = design.compute(Spans(zero, zero, length, quantise(left), quantise(right)), constants)
        assert pixels.out_of_range_spans == 0
        span = np.repeat(np.arange(count), length)
        step = np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)
        np.testing.assert_array_equal(pixels.x, step)
        t = step / np.maximum(length - 1, 1)[span]
        normals = interpolate("quadratic", left[span], right[span], t)
        exact = intensity(normals, material, [Light(light)], (1, 1, 1), viewer, REFLECTION_MODELS[model])
        error = np.abs(pixels.color - 255 * saturate(exact)).max(axis=1)
        # At these pixels N.L may have either sign, so light and highlight may be on or off.
        terminator = np.abs(normals @ light) <= band
        errors.append(error[~terminator])
        ill_posed += np.count_nonzero(terminator)
        full += np.count_nonzero(exact[:, 0] > 1)
    return np.concatenate(errors), ill_posed, full


def check(errors, ill_posed, model, exponent):
    worst = errors.max()
    _, bound = error_bounds(model, exponent)
    assert worst <= bound
    assert worst <= MEASURED[exponent]
    # The bound alone promises one LSB up to exponent 100.
    if exponent <= 100:
        assert bound < 1
    assert worst > max(0.5, bound / 5)
    # For normals in all directions this is the share with N.L within 6e-5 of 0. A tenth of the spans are near
    # the terminator.
    assert 0 < ill_posed < 2e-3 * len(errors)


@pytest.mark.parametrize("model", ["cosquad", pytest.param("cosquad_lin", marks=pytest.mark.long)])
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error(exponent, model):
    """Spans of up to 20 degrees and 1 to 64 pixels, with 4e5 pixels a case."""
    rng = np.random.default_rng(exponent)
    errors, ill_posed, full = sweep(rng, 3, 4200, model, exponent)
    assert len(errors) > 380_000
    assert full > 100
    check(errors, ill_posed, model, exponent)


@pytest.mark.long
@pytest.mark.parametrize("model", SPECULAR_MODELS[:1])
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error_of_millions_of_pixels(exponent, model):
    rng = np.random.default_rng(exponent + 1)
    errors, ill_posed, _ = sweep(rng, 16, 5000, model, exponent)
    assert len(errors) > 2_500_000
    check(errors, ill_posed, model, exponent)
    print(f"{model}, n = {exponent}: {errors.max():.3f} LSB, {ill_posed} at the terminator")
