"""The whole twin against the same method in float64: how far a pixel's channel can be off, in LSB."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup, largest_span_angle
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.middle_normal import MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, halfway_vector, intensity, saturate
from blysk.golden.reference.reflection import REFLECTION_MODELS

from ..lists import FURTHER_MODELS, SPECULAR_MODELS

AMBIENT, DIFFUSE, SPECULAR = 0.1, 0.6, 0.5
LARGEST_ANGLE = 20.0
STEP = 2.0**-17

# Largest |twin - float64 * 255| in LSB, the half of the last rounding included, over 10^7 pixels of the sweep
# below, half of them about the highlight, rounded up.
MEASURED = {1: 0.51, 10: 0.52, 100: 0.62, 1000: 1.6}


def error_bounds(model, exponent):
    """Bounds of the error of N.L, and of a channel in LSB, summed from those of the devices.

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


def random_spans(rng, count, exponent, light, halfway, normal_pairs, largest=LARGEST_ANGLE):
    """Random normals; half of the spans pass near the highlight's peak, a tenth near the terminator."""
    angle = rng.uniform(0, largest, count)
    left, right = normal_pairs(rng, count, angle)
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


def sweep(rng, frames, count, model, exponent, normal_pairs):
    """Errors in LSB of the well-posed pixels, how many others there are, and how many pixels saturate."""
    errors, ill_posed, full = [], 0, 0
    band, _ = error_bounds(model, exponent)
    design = preset(model=model)
    material = Material(*((value,) * 3 for value in (AMBIENT, DIFFUSE, SPECULAR)), exponent)
    for _ in range(frames):
        light, viewer = normalise(rng.normal(size=(2, 3)))
        halfway = halfway_vector(light, viewer)
        left, right, length = random_spans(rng, count, exponent, light, halfway, normal_pairs)
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


@pytest.mark.parametrize("model", ["cosquad", "cosquad_lin"])
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error(model, exponent, normal_pairs):
    """Spans to 20 degrees, 1 to 64 pixels, 4e5 pixels a case."""
    rng = np.random.default_rng(exponent)
    errors, ill_posed, full = sweep(rng, 3, 4200, model, exponent, normal_pairs)
    assert len(errors) > 380_000
    assert full > 100
    check(errors, ill_posed, model, exponent)


@pytest.mark.long
@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", MEASURED)
def test_arithmetic_error_of_ten_million_pixels(model, exponent, normal_pairs):
    rng = np.random.default_rng(exponent + 1)
    errors, ill_posed, _ = sweep(rng, 62, 5000, model, exponent, normal_pairs)
    assert len(errors) > 9_900_000
    check(errors, ill_posed, model, exponent)
    print(f"{model} n = {exponent}: {errors.max():.3f} LSB, {ill_posed} of {len(errors)} at the terminator")


# The chord method.

# Largest |twin - float64 * 255| in LSB against the same fit, over 10^7 pixels, rounded up.
CHORD_MEASURED = {1: 0.51, 10: 0.51, 100: 0.53, 1000: 0.65}

# Against exactly normalised interpolation, by k_s: the largest over all exponents and models, rounded up.
NORMALISED_MEASURED = {0.5: 0.65, 1.0: 0.75}

# Largest error of the fit of N.L at the widest span, in LSB of a full channel.
DIFFUSE_FIT = 0.12

FITTED_MODELS = ("cosquad", "cosquad7", "cosquad_lin", "exp")
FITTED_MODELS += tuple(model for model in FURTHER_MODELS if model.startswith("lyon"))


def fitted(values, t):
    """The quadratic through values at 0, 1/2 and 1."""
    left, middle, right = values
    return (2 * right - 4 * middle + 2 * left) * t**2 + (4 * middle - right - 3 * left) * t + left


def chord_cosine_bound(exponent):
    """Bound of the error of N.L against the same fit in float64.

    `quantise` moves a vector by sqrt(3) steps across; what it moves along itself is in the bounds of
    `ChordSetup`. The weights of a quadratic's three values add up to 1.25 at most, and the middle moves by
    ``1/cos(psi/2)`` of the ends' mean.
    """
    angle = largest_span_angle(exponent)
    return moved_by(angle) + ChordSetup().diffuse_error(angle) + 2.0**-16 + 2.0**-26


def moved_by(angle):
    return 1.25 * (1 / np.cos(np.radians(angle) / 2) + 1) * np.sqrt(3) * STEP


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
    highlight = ChordSetup().highlight_error(angle, 1 - np.cos(outside)) + 2.0**-26
    specular = 2 * k * (moved_by(angle) * sine + square + highlight + 2.0**-16 / k) + Specular.ERROR
    operands = 3 * Intensity.COLOR_FORMAT.step / 2
    diffuse = chord_cosine_bound(exponent) + 2.0**-18
    return 0.5 + operands + 255 * (DIFFUSE * diffuse + SPECULAR * specular)


def chord_frame(rng, count, exponent, normal_pairs):
    """Spans as wide as the chord method should be given, and what shading needs of them in float64.

    Returns the twin's spans and vectors, N.L and u of each pixel by the fit, and the same of exactly
    normalised interpolation.
    """
    light, viewer = normalise(rng.normal(size=(2, 3)))
    halfway = halfway_vector(light, viewer)
    angle = largest_span_angle(exponent)
    left, right, length = random_spans(rng, count, exponent, light, halfway, normal_pairs, angle)
    zero = np.zeros(count, dtype=int)
    spans = Spans(zero, zero, length, quantise(left), quantise(right))
    span, step = pixels_of(length)
    t = step / np.maximum(length - 1, 1)[span]
    normals = interpolate("normalised", left[span], right[span], t)

    def of(n):
        return n @ light, ((n - halfway) ** 2).sum(axis=-1) / 2

    three = zip(*(of(n) for n in (left, normalise(left + right), right)), strict=True)
    fit = [fitted([value[span] for value in values], t) for values in three]
    return spans, (quantise(light), quantise(halfway)), fit, of(normals)


def chord_errors(frame, model, exponent, reference, diffuse, specular):
    """Errors of the twin's red in LSB against a reference, of the pixels where N.L is not near 0."""
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


def chord_sweep(rng, frames, count, model, exponent, normal_pairs):
    errors, ill_posed = [], 0
    for _ in range(frames):
        frame = chord_frame(rng, count, exponent, normal_pairs)
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
    assert bound < 1.5
    assert worst > 0.5
    # A tenth of the spans are about the terminator, and the narrower they are the more of each.
    assert 0 < ill_posed < 4e-3 * len(errors)


@pytest.mark.parametrize("model", ["cosquad", "cosquad_lin"])
@pytest.mark.parametrize("exponent", CHORD_MEASURED)
def test_arithmetic_error_of_the_chord_method(model, exponent, normal_pairs):
    """Spans to the widest for the exponent, 1 to 64 pixels, 4e5 pixels a case."""
    rng = np.random.default_rng(exponent)
    errors, ill_posed = chord_sweep(rng, 3, 4200, model, exponent, normal_pairs)
    assert len(errors) > 380_000
    check_chord(errors, ill_posed, model, exponent)


@pytest.mark.long
@pytest.mark.parametrize("model", SPECULAR_MODELS)
@pytest.mark.parametrize("exponent", CHORD_MEASURED)
def test_arithmetic_error_of_the_chord_method_over_ten_million_pixels(model, exponent, normal_pairs):
    rng = np.random.default_rng(exponent + 1)
    errors, ill_posed = chord_sweep(rng, 62, 5000, model, exponent, normal_pairs)
    assert len(errors) > 9_900_000
    check_chord(errors, ill_posed, model, exponent)


@pytest.mark.parametrize("exponent", [1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000])
def test_chord_method_against_normalised_interpolation(exponent, normal_pairs):
    """Rounding, arithmetic and interpolation together: at most 1 LSB, every model, at half and full k_s.

    Of that rounding is 0.5, and the fit ``0.12 k_d + 0.25 k_s``.
    """
    rng = np.random.default_rng(exponent)
    worst = {}
    for _ in range(2):
        frame = chord_frame(rng, 1500, exponent, normal_pairs)
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


# Stiff cases, one span each.

UP = np.array([0.0, 0.0, 1.0])


def constants_of(lights, exponent=20, ambient=AMBIENT, viewer=UP):
    """(direction, diffuse, specular) of each light, white."""
    count = len(lights)
    halfway = np.array([halfway_vector(direction, viewer) for direction, _, _ in lights])
    present = halfway.any(axis=1)
    codes = np.zeros((count, 3), dtype=int)
    codes[present] = quantise(halfway[present])
    specular = np.array([[light[2]] * 3 for light in lights]) * present[:, np.newaxis]
    return FrameConstants(
        exponent,
        Intensity.color(np.full(3, ambient)),
        quantise(np.array([light[0] for light in lights], dtype=float)),
        codes,
        Intensity.color(np.array([[light[1]] * 3 for light in lights])),
        Intensity.color(specular),
    )


def shade(left, right, length, constants, model="cosquad"):
    span = Spans(
        np.array([7]), np.array([9]), np.array([length]), quantise(left[None]), quantise(right[None])
    )
    return preset(model=model, lights=len(constants.direction)).compute(span, constants)


def tilted(degrees):
    angle = np.radians(degrees)
    return np.array([np.sin(angle), 0.0, np.cos(angle)])


@pytest.mark.parametrize(
    ("length", "exponent"), [(1, 1), (2, 2), (3, 3), (16, 10), (4095, 100), (3, 500), (4095, 1000)]
)
def test_flat_span_has_one_color(length, exponent):
    """Angle 0 with the peak on every pixel: one colour, of one normal."""
    pixels = shade(UP, UP, length, constants_of([(UP, 0.4, 0.3)], exponent))
    np.testing.assert_array_equal(pixels.color, np.full((length, 3), 204))
    np.testing.assert_array_equal(pixels.x, (7 + np.arange(length)) % 4096)
    np.testing.assert_array_equal(pixels.y, np.full(length, 9))
    np.testing.assert_array_equal(np.flatnonzero(pixels.last), [length - 1])


def test_terminator():
    """A light at right angles gives nothing; a step further it gives a diffuse term, and the highlight whole.

    The highlight comes with a jump: N.H is 0.707 there, whose term is not 0 for small exponents.
    """
    right_angle = constants_of([(np.array([1.0, 0, 0]), 1.0, 1.0)], 1)
    np.testing.assert_array_equal(shade(UP, UP, 3, right_angle).color, 26)
    lit = shade(tilted(0.01), tilted(0.01), 3, right_angle).color
    jump = 25.5 + 255 * (1 - 0.5 * (1 - np.sqrt(0.5))) ** 2
    assert abs(lit[0, 0] - jump) < 1
    np.testing.assert_array_equal(shade(tilted(-0.01), tilted(-0.01), 3, right_angle).color, 26)


@pytest.mark.parametrize("exponent", [1, 1000])
def test_light_opposite_the_viewer(exponent):
    """``L = -V``: no half-way vector and no highlight, on any side; nothing is divided by 0."""
    constants = constants_of([(-UP, 0.5, 8.0)], exponent)
    np.testing.assert_array_equal(shade(UP, UP, 2, constants).color, 26)
    np.testing.assert_array_equal(shade(-UP, -UP, 2, constants).color, round(255 * 0.6))


def test_second_lobe_is_dark():
    """n = 20 at 60 degrees: the parabola is 16, the highlight 0."""
    constants = constants_of([(UP, 0.0, 1.0)], 20, ambient=0)
    assert not shade(tilted(60), tilted(60), 3, constants).color.any()
    assert shade(tilted(20), tilted(20), 3, constants).color.all()


def test_highlight_wholly_inside_a_span():
    """n = 1000: both ends are dark, the peak is where the curve passes it."""
    constants = constants_of([(UP, 0.0, 1.0)], 1000, ambient=0)
    channel = shade(tilted(-10), tilted(10), 101, constants).color[:, 0].astype(int)
    # The curve is 1.8e-6 short at its middle's sides, not there: the middle is exact to 2^-18.
    assert channel[50] >= 253
    assert channel.argmax() == 50
    assert (np.diff(channel[:51]) >= 0).all()
    assert np.abs(channel - channel[::-1]).max() <= 1
    assert not channel[[0, 100]].any()


def test_sixteen_lights_over_full_brightness():
    bright = constants_of([(UP, 8.0, 8.0)] * 16)
    np.testing.assert_array_equal(shade(UP, UP, 2, bright).color, 255)
    np.testing.assert_array_equal(shade(-UP, -UP, 2, bright).color, 26)
    dim = constants_of([(UP, 1 / 32, 1 / 64)] * 16, ambient=0)
    # 16 (k_d + k_s) = 0.75, off by 32 operands' halves.
    assert abs(int(shade(UP, UP, 2, dim).color[0, 0]) - 191.25) <= 0.5 + 32 * 2.0**-7 + 0.01


def test_ambient_only():
    for ambient in (0.3, 8.0):
        constants = constants_of([(UP, 0.0, 0.0)], ambient=ambient)
        expected = min(int(255 * ambient + 0.5), 255)
        np.testing.assert_array_equal(shade(UP, tilted(20), 5, constants).color, expected)


def test_coefficients_over_one_saturate():
    constants = constants_of([(UP, 0.6, 0.5)])
    channel = shade(tilted(-20), tilted(20), 41, constants).color[:, 0]
    assert channel[20] == 255
    assert channel[0] < 255


@pytest.mark.parametrize(("angle", "out_of_range"), [(0, 0), (1e-4, 0), (45, 0), (45.01, 1), (180, 1)])
def test_wide_spans_are_counted(angle, out_of_range):
    assert shade(UP, tilted(angle), 5, constants_of([(UP, 0.5, 0.5)])).out_of_range_spans == out_of_range


def test_empty_spans_give_nothing():
    zero = np.zeros(2, dtype=int)
    spans = Spans(zero, zero, zero, quantise(np.array([UP, UP])), quantise(np.array([UP, UP])))
    assert len(spans) == 2
    pixels = preset().compute(spans, constants_of([(UP, 0.5, 0.5)]))
    assert pixels.color.shape == (0, 3)


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"^method must be one of .*quadratic.*, not 'unknown'$"):
        preset(method="unknown")
    with pytest.raises(ValueError, match=r"^model must be one of cosquad, .*, blinn, .*, ggx, not 'phong'$"):
        preset(model="phong")
    with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
        preset(operand="sine")
    for method in ("angular", "chord"):
        with pytest.raises(ValueError, match=rf"^method {method} finds no normals, and gives 1 - cos gamma$"):
            preset(method, operand="cosine")
    with pytest.raises(ValueError, match=r"^lights must be 0 to 16, not -1$"):
        preset(lights=-1)
    spans = Spans(*np.zeros((3, 1), dtype=int), np.array([[0, 0, ONE]]), np.array([[0, 0, 2**17]]))
    spans.length[:] = 2
    constants = constants_of([(UP, 0.5, 0.5)])
    with pytest.raises(ValueError, match=r"exceed SQ\(1, 17\)$"):
        preset().compute(spans, constants)
    with pytest.raises(ValueError, match=r"^the constants are for 1 lights, not 2$"):
        preset(lights=2).compute(spans, constants)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"terms": 3}, "method quadratic has no option terms"),
        ({"materials": 0}, "materials must be 1 to 1024, not 0"),
        ({"materials": 1025}, "materials must be 1 to 1024, not 1025"),
        ({"gate": True, "model": None}, "without specular light there is nothing to gate"),
        ({"gate": True, "method": "chord-local"}, "method chord-local has no normals for a gate"),
        ({"exponent": 0}, "exponent must be 1 to 1000, not 0"),
        ({"exponent": 1001}, "exponent must be 1 to 1000, not 1001"),
        ({"x_bits": 0}, "x_bits must be 1 to 12, not 0"),
        ({"y_bits": 13}, "y_bits must be 1 to 12, not 13"),
        ({"length_bits": 1}, "length_bits must be 2 to 12, not 1"),
    ],
)
def test_parameters_that_no_pipeline_has(given, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        preset(**given)


@pytest.mark.parametrize(
    ("given", "changed", "message"),
    [
        ({"materials": 2}, {}, "the constants are for 1 materials, not 2"),
        ({"exponent": 30}, {}, "the exponent is fixed at 30, not 20"),
        ({}, {"material": -1}, "material must be 0 to 0"),
        ({}, {"material": 1}, "material must be 0 to 0"),
        ({}, {"x": 4096}, "x must be 0 to 4095"),
        ({"y_bits": 3}, {"y": 8}, "y must be 0 to 7"),
        ({}, {"length": 4096}, "length must be 0 to 4095"),
        ({"method": "chord-local"}, {}, "method chord-local takes spans with values for 1 lights"),
    ],
)
def test_spans_that_a_pipeline_does_not_take(given, changed, message):
    normal = np.array([[0, 0, ONE]])
    words = {"x": 0, "y": 0, "length": 1, "material": 0} | changed
    words = {name: np.array([code]) for name, code in words.items()}
    spans = Spans(**words, normal_left=normal, normal_right=normal)
    constants = constants_of([(UP, 0.5, 0.5)])
    with pytest.raises(ValueError, match=f"^{message}$"):
        preset(**given).compute(spans, constants)


def spans_near_a_highlight(rng, halfway, level, angle):
    """Ends of arcs whose great circle comes as near to H as a cosine says, there or a bit before or after."""
    count = len(level)
    side = normalise(np.cross(halfway, rng.normal(size=(count, 3))))
    top = halfway * level[:, np.newaxis] + side * np.sqrt(1 - level**2)[:, np.newaxis]
    along = np.cross(halfway, side)
    first = -rng.choice([0.0, 0.5, 1.0, rng.uniform(-0.2, 1.2)], count) * angle
    ends = (first, first + angle)
    return [quantise(top * np.cos(end)[:, np.newaxis] + along * np.sin(end)[:, np.newaxis]) for end in ends]


GATED = [(method, None) for method in METHODS if method != "chord-local"] + [
    (method, "one_minus_cosine") for method in ("linear", "bisection", "quadratic", "renormalise")
]


@pytest.mark.parametrize("model", ["cosquad", "coscos4", "exp", "blinn"])
@pytest.mark.parametrize(("method", "operand"), GATED)
def test_gated_spans_have_no_highlight(method, operand, model):
    """About the threshold of each exponent, where the gate has to let spans through that seem dark."""
    rng = np.random.default_rng(3)
    design = preset(method, model, operand=operand)
    gate = design.highlight_gate
    suppressed = shaded = 0
    for exponent in (3, 20, 150, 1000):
        last = design.specular.last_lit_arguments[exponent] * 2.0**-25
        for _ in range(2):
            halfway = quantise(normalise(rng.normal(size=3)))
            count = 400
            level = 1 - last + last * 10.0 ** rng.uniform(-5, -0.3, count) * rng.choice([-1, 1], count)
            angle = np.radians(rng.uniform(0, gate.interpolator.gate_angle, count))
            angle[::7] = 0
            level = np.clip(level, -1, 1)
            codes = spans_near_a_highlight(rng, halfway / np.linalg.norm(halfway), level, angle)
            length = rng.choice([1, 2, 3, 5, 16, 200], count, p=[0.1, 0.3, 0.2, 0.2, 0.15, 0.05])
            left, right = (Fixed(COMPONENT, end) for end in codes)
            vector = Fixed(COMPONENT, halfway)
            lit = gate.compute(left, right, vector, exponent)
            vectors = Fixed(COMPONENT, halfway[np.newaxis])
            operands = design.interpolator.compute(left, right, length, vectors, vectors)
            assert not (operands.out_of_range & ~lit).any()
            dark = np.zeros((len(operands.highlight.codes), 1), dtype=bool)
            term = design.specular.compute(operands.highlight, dark, exponent)
            of_span = np.bincount(pixels_of(length)[0], weights=term.codes[:, 0])
            assert not of_span[~lit].any()
            suppressed += np.count_nonzero(~lit)
            shaded += np.count_nonzero(of_span)
    assert suppressed > 150
    assert shaded > 100


@pytest.mark.parametrize(
    ("printed", "method", "degrees", "factor"),
    [
        ("bisection-published", "bisection", 5.0, 10),
        ("quadratic-published", "quadratic", 40.0, 10),
        ("angular-published", "angular-corrected", 40.0, 2),
        ("angular-corrected", "angular", 5.0, 1000),
        ("recurrence-direct", "recurrence", 5.0, 10),
    ],
)
def test_what_the_documents_print_is_worse(printed, method, degrees, factor, normal_pairs):
    """N.L against the curve that both stand for, in float64: the mended method is so much nearer to it."""
    rng = np.random.default_rng(8)
    left, right = (quantise(end) for end in normal_pairs(rng, 300, rng.uniform(0.5, degrees, 300)))
    vector = quantise(normalise(left[:1] + rng.normal(size=3) * ONE / 8))
    length = np.full(300, 40)
    span, place = pixels_of(length)
    ends = (normalise(codes)[span] for codes in (left, right))
    exact = preset(method).interpolator.exact_normals(*ends, place / 39)
    exact = np.sum(exact * normalise(vector), axis=-1)
    worst = {}
    for name in (printed, method):
        design = preset(name)
        words = [Fixed(COMPONENT, codes) for codes in (left, right)]
        vectors = Fixed(COMPONENT, vector)
        found = design.interpolator.compute(*words, length, vectors, vectors).cosine.values[:, 0]
        worst[name] = np.abs(found / ONE_SQUARED.values - exact).max()
    assert worst[printed] > factor * worst[method]


def test_printed_methods_serve_no_gate():
    for name in PUBLISHED:
        assert not preset(name).interpolator.serves_gate
        with pytest.raises(ValueError, match=f"^method {name} has no error bound for a gate$"):
            preset(name, gate=True)
