"""The model of the pipeline against the same method in float64: errors of a pixel's channel, in LSB."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, halfway_vector, intensity, saturate
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.sim.units.cosines.chord_setup import parabola
from blysk.sim.units.operands import pairs_at

from ..lists import FURTHER_MODELS, SPECULAR_MODELS

AMBIENT, DIFFUSE, SPECULAR = 0.1, 0.6, 0.5
LARGEST_ANGLE = 20.0
STEP = 2.0**-17

# Largest |model - float64 * 255| in LSB, the half of the last rounding included, over 10^7 pixels of the
# sweep below, half of them about the highlight, rounded up.
MEASURED = {1: 0.51, 10: 0.52, 100: 0.62, 1000: 1.6}


def error_bounds(model, exponent):
    """Bounds of the error of N.L, and of a channel in LSB, summed from those of the units.

    `quantise` moves a vector by half a step along itself and by sqrt(3) steps across. Ends that turn a little
    turn the curve between them, which keeps its length to second order: what moves a normal along itself are
    the ends' lengths alone. A highlight feels a move across times the sine of the largest angle that it
    reaches, ``1 - cos gamma = 1/k``. The weights of the curve's three normals add up to 1.25 at most, and the
    middle moves by ``1/cos(psi/2)`` of the ends' mean. The middle adds `MiddleNormal.ERROR` a component, the
    setup three relative steps of G and one of P, the accumulator half a step a component.
    """
    k = REFLECTION_MODELS[model].slope(exponent)
    sine = np.sqrt(1 - max(1 - 1 / k, 0) ** 2)
    root = np.sqrt(3)
    half = np.radians(LARGEST_ANGLE) / 2
    setup = STEP * (2.12 * half + 3 * 4 * (1 - np.cos(half)))
    drift = DifferenceSetup.FORMAT.step * (64 + 64**2 / 2)
    common = root * MiddleNormal.ERROR + setup + root * (drift + STEP / 2)
    # Both the normal and the constant vector are quantised.
    quantised = 1.25 / np.cos(half) + 1
    cosine = common + quantised * STEP * (0.5 + root)
    highlight_cosine = common + quantised * STEP * (0.5 + root * sine)
    # Lengths are ONE / 2^17: cosines come out 2^-16 short.
    diffuse = cosine + 2.0**-16 + 2.0**-18
    # Of a base of at most 1 the square doubles the error.
    specular = 2 * k * highlight_cosine + Specular.ERROR
    operands = 3 * Intensity.COLOR_FORMAT.step / 2
    return cosine, 0.5 + operands + 255 * (DIFFUSE * diffuse + SPECULAR * specular)


def random_spans(rng, count, exponent, light, halfway, largest=LARGEST_ANGLE):
    """Random normals; half of the spans pass near the highlight's peak, a tenth near the terminator."""
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
    """Errors in LSB of the well-posed pixels, how many others there are, and how many pixels saturate."""
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
        # Where N.L may have either sign, light and highlight may be there or not.
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
    # The promise: one LSB to exponent 100, from the bound alone.
    if exponent <= 100:
        assert bound < 1
    assert worst > max(0.5, bound / 5)
    # N.L is within 6e-5 of 0 for as large a share of normals all around; a tenth of the spans are about it.
    assert 0 < ill_posed < 2e-3 * len(errors)


# The chord method.

# Largest |model - float64 * 255| in LSB against the same fit, over 10^7 pixels, rounded up.
CHORD_MEASURED = {1: 0.51, 10: 0.51, 100: 0.53, 1000: 0.65}

# Against exactly normalised interpolation, by k_s: the largest over all exponents and models, rounded up.
NORMALISED_MEASURED = {0.5: 0.65, 1.0: 0.75}

# Largest error of the fit of N.L at the widest span, in LSB of a full channel.
DIFFUSE_FIT = 0.12

FITTED_MODELS = ("cosquad", "cosquad7", "cosquad_lin", "exp")
FITTED_MODELS += tuple(model for model in FURTHER_MODELS if model.startswith("lyon"))


def chord_cosine_bound(exponent):
    """Bound of the error of N.L against the same fit in float64.

    `quantise` moves a vector by sqrt(3) steps across; what it moves along itself is in the bounds of
    `ChordValues`. The weights of a quadratic's three values add up to 1.25 at most.
    """
    angle = largest_span_angle(exponent)
    own = 1.25 * ChordValues.diffuse_error() + ChordSetup().diffuse_error(*words(angle))
    return MOVED + own + 2.0**-16 + 2.0**-26


MOVED = 1.25 * 2 * np.sqrt(3) * STEP
"""A normal's move across and a light's."""


def words(angle):
    """Largest P and G of spans of an angle."""
    chord = 2 * np.sin(np.radians(angle) / 2)
    return chord + chord**2, chord**2


def chord_bound(model, exponent):
    """Bound of the error of a channel in LSB, against the same fit in float64.

    u of an end feels a move across times the sine of its angle to H, and its square. An end is up to an angle
    of the span outside of the cone where ``1 - cos gamma < 1/k``, in which a pixel is lit. Lengths are
    ONE / 2^17, so u comes out 2^-16 short.
    """
    k, angle = REFLECTION_MODELS[model].slope(exponent), largest_span_angle(exponent)
    outside = min(np.arccos(max(1 - 1 / k, -1)) + np.radians(angle), np.pi)
    sine = 1.0 if outside > np.pi / 2 else np.sin(outside)
    square = (2 * np.sqrt(3) * STEP) ** 2
    highlight = 1.25 * ChordValues.highlight_error(1 - np.cos(outside)) + 2.0**-26
    highlight += ChordSetup().highlight_error(*words(angle))
    specular = 2 * k * (MOVED * sine + square + highlight + 2.0**-16 / k) + Specular.ERROR
    operands = 3 * Intensity.COLOR_FORMAT.step / 2
    diffuse = chord_cosine_bound(exponent) + 2.0**-18
    return 0.5 + operands + 255 * (DIFFUSE * diffuse + SPECULAR * specular)


def chord_frame(rng, count, exponent):
    """Spans as wide as the chord method should be given, and what shading needs of them in float64.

    Returns the model's spans and vectors, N.L and u of each pixel by the fit, and the same of exactly
    normalised interpolation.
    """
    light, viewer = normalise(rng.normal(size=(2, 3)))
    halfway = halfway_vector(light, viewer)
    angle = largest_span_angle(exponent)
    left, right, length = random_spans(rng, count, exponent, light, halfway, angle)
    zero = np.zeros(count, dtype=int)
    middle = quantise(normalise(left + right))
    spans = Spans(zero, zero, length, quantise(left), quantise(right), normal_middle=middle)
    span, step = pixels_of(length)
    t = step / np.maximum(length - 1, 1)[span]
    normals = interpolate("normalised", left[span], right[span], t)

    def of(n):
        return n @ light, ((n - halfway) ** 2).sum(axis=-1) / 2

    three = zip(*(of(n) for n in (left, normalise(left + right), right)), strict=True)
    fit = [parabola(np.stack(values, axis=-1)[span], t) for values in three]
    return spans, (quantise(light), quantise(halfway)), fit, of(normals)


def chord_errors(frame, model, exponent, reference, diffuse, specular):
    """Errors of the model's red in LSB against a reference, of the pixels where N.L is not near 0."""
    spans, (direction, halfway), *references = frame
    constants = FrameConstants(
        exponent,
        Intensity.color(np.full(3, AMBIENT)),
        direction[np.newaxis],
        halfway[np.newaxis],
        Intensity.color(np.full((1, 3), diffuse)),
        Intensity.color(np.full((1, 3), specular)),
    )
    pixels = preset("chord", model).compute(spans, constants)
    assert pixels.out_of_range_spans == 0
    f, u = references[reference]
    # Where N.L may have either sign, light and highlight may be there or not.
    band = chord_cosine_bound(exponent) + (reference == NORMALISED) * DIFFUSE_FIT / 255
    well_posed = np.abs(f) > band
    exact = (
        AMBIENT
        + diffuse * np.maximum(f, 0)
        + specular * REFLECTION_MODELS[model].reflect(1 - u, exponent) * (f > 0)
    )
    return np.abs(pixels.color[:, 0] - 255 * np.minimum(exact, 1))[well_posed], well_posed


FIT, NORMALISED = 0, 1


def chord_sweep(rng, frames, count, model, exponent):
    errors, ill_posed = [], 0
    for _ in range(frames):
        frame = chord_frame(rng, count, exponent)
        error, well_posed = chord_errors(frame, model, exponent, FIT, DIFFUSE, SPECULAR)
        errors.append(error)
        ill_posed += np.count_nonzero(~well_posed)
    return np.concatenate(errors), ill_posed


def check_chord(errors, ill_posed, model, exponent):
    worst, bound = errors.max(), chord_bound(model, exponent)
    print(f"chord, {model}, n = {exponent}: {worst:.3f} LSB, {bound:.3f} allowed")
    assert worst <= bound
    assert worst <= CHORD_MEASURED[exponent]
    if exponent <= 100:
        assert bound < 0.75
    assert bound < 1.51
    assert worst > 0.5
    # A tenth of the spans are about the terminator, and the narrower they are the more of each.
    assert 0 < ill_posed < 4e-3 * len(errors)


METHOD_SWEEPS = {"quadratic": (sweep, check), "chord": (chord_sweep, check_chord)}


@pytest.mark.parametrize("method", METHOD_SWEEPS)
@pytest.mark.parametrize("model", ["cosquad", pytest.param("cosquad_lin", marks=pytest.mark.long)])
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error(exponent, model, method):
    """Spans to 20 degrees, or the widest of the chord method, 1 to 64 pixels, 4e5 pixels a case."""
    rng = np.random.default_rng(exponent)
    run, hold = METHOD_SWEEPS[method]
    errors, ill_posed, *full = run(rng, 3, 4200, model, exponent)
    assert len(errors) > 380_000
    assert all(count > 100 for count in full)
    hold(errors, ill_posed, model, exponent)


@pytest.mark.long
@pytest.mark.parametrize("method", METHOD_SWEEPS)
@pytest.mark.parametrize("model", SPECULAR_MODELS[:1])
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error_of_ten_million_pixels(exponent, model, method):
    rng = np.random.default_rng(exponent + 1)
    run, hold = METHOD_SWEEPS[method]
    errors, ill_posed, *_ = run(rng, 62, 5000, model, exponent)
    assert len(errors) > 9_900_000
    hold(errors, ill_posed, model, exponent)
    print(f"{method}, {model}, n = {exponent}: {errors.max():.3f} LSB, {ill_posed} at the terminator")


@pytest.mark.parametrize(
    "exponent",
    [1, 10, 100, 1000, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 3, 5, 20, 50, 200, 500))],
)
def test_chord_method_against_normalised_interpolation(exponent):
    """Rounding, arithmetic and interpolation together: at most 1 LSB, every model, at half and full k_s.

    Of that rounding is 0.5, and the fit ``0.12 k_d + 0.25 k_s``.
    """
    rng = np.random.default_rng(exponent)
    worst = {}
    for _ in range(2):
        frame = chord_frame(rng, 1500, exponent)
        for model in FITTED_MODELS:
            for diffuse, specular in ((0.5, 0.5), (0.0, 1.0)):
                errors, _ = chord_errors(frame, model, exponent, NORMALISED, diffuse, specular)
                assert len(errors) > 30_000
                worst[specular] = max(worst.get(specular, 0), errors.max())
    print(f"n = {exponent}: {worst[0.5]:.2f} LSB at k_d = k_s = 0.5, {worst[1.0]:.2f} at k_s = 1")
    assert worst[0.5] <= NORMALISED_MEASURED[0.5]
    assert worst[1.0] <= NORMALISED_MEASURED[1.0]
    assert max(worst.values()) <= 1
    assert min(worst.values()) > 0.5
