"""The model of the pipeline: stiff spans, gates, published methods and refusals."""

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.transfer import encode

AMBIENT = 0.1
UP = np.array([0.0, 0.0, 1.0])


# Stiff cases of one span each.


def constants_of(lights, exponent=20, ambient=AMBIENT, viewer=UP):
    """The direction, diffuse colour and specular colour of each white light."""
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
    return preset("quadratic", model, lights=len(constants.direction)).compute(span, constants)


def tilted(degrees):
    angle = np.radians(degrees)
    return np.array([np.sin(angle), 0.0, np.cos(angle)])


@pytest.mark.parametrize(
    ("length", "exponent"), [(1, 1), (2, 2), (3, 3), (16, 10), (4095, 100), (3, 500), (4095, 1000)]
)
def test_flat_span_has_one_color(length, exponent):
    """With equal normals and the peak on every pixel, all pixels have the same colour."""
    pixels = shade(UP, UP, length, constants_of([(UP, 0.4, 0.3)], exponent))
    np.testing.assert_array_equal(pixels.color, np.full((length, 3), 204))
    np.testing.assert_array_equal(pixels.x, (7 + np.arange(length)) % 4096)
    np.testing.assert_array_equal(pixels.y, np.full(length, 9))
    np.testing.assert_array_equal(np.flatnonzero(pixels.last), [length - 1])


def test_terminator():
    """A light at a right angle gives nothing.

    One step further it gives a diffuse term and the whole highlight.

    The highlight begins with a jump: N.H is 0.707 there, and its term is not 0 for small exponents.
    """
    right_angle = constants_of([(np.array([1.0, 0, 0]), 1.0, 1.0)], 1)
    np.testing.assert_array_equal(shade(UP, UP, 3, right_angle).color, 26)
    lit = shade(tilted(0.01), tilted(0.01), 3, right_angle).color
    jump = 25.5 + 255 * (1 - 0.5 * (1 - np.sqrt(0.5))) ** 2
    assert abs(lit[0, 0] - jump) < 1
    np.testing.assert_array_equal(shade(tilted(-0.01), tilted(-0.01), 3, right_angle).color, 26)


@pytest.mark.parametrize("exponent", [1, 1000])
def test_light_opposite_the_viewer(exponent):
    """With ``L = -V`` there is no half-way vector and no highlight on any side. Nothing is divided by 0."""
    constants = constants_of([(-UP, 0.5, 8.0)], exponent)
    np.testing.assert_array_equal(shade(UP, UP, 2, constants).color, 26)
    np.testing.assert_array_equal(shade(-UP, -UP, 2, constants).color, round(255 * 0.6))


def test_highlight_wholly_inside_a_span():
    """At n = 1000 both ends are dark, and the peak is where the curve passes H."""
    constants = constants_of([(UP, 0.0, 1.0)], 1000, ambient=0)
    channel = shade(tilted(-10), tilted(10), 101, constants).color[:, 0].astype(int)
    # The curve is 1.8e-6 too short beside its middle. The middle itself is exact to 2^-18.
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
    # 16 (k_d + k_s) = 0.75, which is off by half a code of each of 32 operands.
    assert abs(int(shade(UP, UP, 2, dim).color[0, 0]) - 191.25) <= 0.5 + 32 * 2.0**-7 + 0.01


def test_ambient_only():
    for ambient in (0.3, 8.0):
        constants = constants_of([(UP, 0.0, 0.0)], ambient=ambient)
        expected = min(int(255 * ambient + 0.5), 255)
        np.testing.assert_array_equal(shade(UP, tilted(20), 5, constants).color, expected)


def test_encoded_pixels():
    """Ambient light with and without lights, and lit spans: each code follows from the curve in float64."""
    for lights, ambient in ((0, 0.001), (1, 0.02), (0, 0.3), (1, 8.0)):
        constants = constants_of([(UP, 0.0, 0.0)], ambient=ambient)
        if not lights:
            constants = FrameConstants(1, constants.ambient, *np.zeros((4, 0, 3), dtype=int))
        vectors = quantise(np.array([UP])), quantise(tilted(20)[None])
        spans = Spans(*(np.array([value]) for value in (7, 9, 5)), *vectors)
        design = preset("quadratic", "cosquad", lights=lights, transfer="srgb")
        expected = np.floor(255 * encode(Intensity.color(ambient) / 64 / 255) + 0.5)
        np.testing.assert_array_equal(design.compute(spans, constants).color, expected)
    lit = constants_of([(UP, 0.6, 0.2)])
    spans = Spans(*(np.array([value]) for value in (0, 0, 400)), quantise(tilted(-80)[None]), vectors[1])
    linear, encoded = (
        preset("quadratic", "cosquad", transfer=of).compute(spans, lit).color for of in ("linear", "srgb")
    )
    low, high = (255 * encode((linear + half) / 255) for half in (-0.51, 0.51))
    assert np.all((encoded >= low - 0.51) & (encoded <= high + 0.51))
    assert len(np.unique(encoded)) > 80


@pytest.mark.parametrize(("angle", "out_of_range"), [(0, 0), (1e-4, 0), (45, 0), (45.01, 1), (180, 1)])
def test_spans_out_of_range_are_counted(angle, out_of_range):
    assert shade(UP, tilted(angle), 5, constants_of([(UP, 0.5, 0.5)])).out_of_range_spans == out_of_range


def test_empty_spans_give_nothing():
    zero = np.zeros(2, dtype=int)
    spans = Spans(zero, zero, zero, quantise(np.array([UP, UP])), quantise(np.array([UP, UP])))
    assert len(spans) == 2
    pixels = preset(model="cosquad").compute(spans, constants_of([(UP, 0.5, 0.5)]))
    assert pixels.color.shape == (0, 3)


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match=r"^operand must be 'cosine' or 'one_minus_cosine', not 'sine'$"):
        preset("quadratic", "cosquad", operand="sine")
    for method in ("angular", "chord-local", "quotient"):
        with pytest.raises(ValueError, match=rf"^method {method} finds no normals, so it has one operand$"):
            preset(method, "cosquad", operand="cosine")
    with pytest.raises(ValueError, match=r"^lights must be 0 to 16, not -1$"):
        preset(lights=-1)
    spans = Spans(*np.zeros((3, 1), dtype=int), np.array([[0, 0, ONE]]), np.array([[0, 0, 2**17]]))
    spans.length[:] = 2
    constants = constants_of([(UP, 0.5, 0.5)])
    with pytest.raises(ValueError, match=r"exceed SQ\(1, 17\)$"):
        preset("quadratic", "cosquad").compute(spans, constants)
    with pytest.raises(ValueError, match=r"^the constants are for 1 lights, not 2$"):
        preset(model="cosquad", lights=2).compute(spans, constants)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"terms": 3}, "method renormalise has no option terms"),
        ({"method": "quadratic", "fraction_bits": 36}, "method quadratic has no option fraction_bits"),
        ({"materials": 0}, "materials must be 1 to 1024, not 0"),
        ({"materials": 1025}, "materials must be 1 to 1024, not 1025"),
        ({"gate": True, "model": None}, "without specular light there is nothing to gate"),
        ({"gate": True, "method": "renormalise"}, "method renormalise has no error bound for a gate"),
        ({"exponent": 0}, "exponent must be 1 to 1000, not 0"),
        ({"exponent": 1001}, "exponent must be 1 to 1000, not 1001"),
        ({"x_bits": 0}, "x_bits must be 1 to 12, not 0"),
        ({"y_bits": 13}, "y_bits must be 1 to 12, not 13"),
        ({"length_bits": 1}, "length_bits must be 2 to 12, not 1"),
        ({"transfer": "gamma"}, "transfer must be one of srgb, linear, not 'gamma'"),
    ],
)
def test_parameters_that_no_pipeline_has(given, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        preset(**{"model": "cosquad"} | given)


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
        preset(**{"model": "cosquad"} | given).compute(spans, constants)


def spans_near_a_highlight(rng, halfway, level, angle):
    """Ends of arcs whose great circle comes as near to H as a cosine says: within the arc, or a little
    outside."""
    count = len(level)
    side = normalise(np.cross(halfway, rng.normal(size=(count, 3))))
    top = halfway * level[:, np.newaxis] + side * np.sqrt(1 - level**2)[:, np.newaxis]
    along = np.cross(halfway, side)
    first = -rng.choice([0.0, 0.5, 1.0, rng.uniform(-0.2, 1.2)], count) * angle
    ends = (first, first + angle)
    return [quantise(top * np.cos(end)[:, np.newaxis] + along * np.sin(end)[:, np.newaxis]) for end in ends]


BY_NORMALS = [name for name, of in METHODS.items() if of.serves_gate]
GATED = [(name, None) for name in BY_NORMALS] + [
    (name, "one_minus_cosine") for name in ("linear", "bisection", "quadratic")
]


@pytest.mark.parametrize("model", ["cosquad", "coscos4", "exp", "blinn_product"])
@pytest.mark.parametrize(("method", "operand"), GATED)
def test_gated_spans_have_no_highlight(method, operand, model):
    """Spans about the threshold of each exponent, where the gate has to let spans through that seem dark."""
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
            angle = np.radians(rng.uniform(0, gate.limits.angle, count))
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
    ("published", "method", "degrees", "factor"),
    [
        ("bisection-published", "bisection", 5.0, 10),
        ("quadratic-published", "quadratic", 40.0, 10),
        ("angular-published", "angular-corrected", 40.0, 2),
        ("angular-corrected", "angular", 5.0, 1000),
        ("recurrence-direct", "recurrence", 5.0, 10),
    ],
)
def test_published_methods_are_worse(published, method, degrees, factor):
    """N.L is compared in float64 with the curve that both methods stand for.

    The corrected method is nearer by a factor.
    """
    rng = np.random.default_rng(8)
    left, right = (quantise(end) for end in pairs_at(rng, 300, rng.uniform(0.5, degrees, 300)))
    vector = quantise(normalise(left[:1] + rng.normal(size=3) * ONE / 8))
    length = np.full(300, 40)
    span, place = pixels_of(length)
    ends = (normalise(codes)[span] for codes in (left, right))
    exact = preset(method, "cosquad").interpolator.exact_normals(*ends, place / 39)
    exact = np.sum(exact * normalise(vector), axis=-1)
    worst = {}
    for name in (published, method):
        design = preset(name, "cosquad")
        words = [Fixed(COMPONENT, codes) for codes in (left, right)]
        vectors = Fixed(COMPONENT, vector)
        found = design.interpolator.compute(*words, length, vectors, vectors).cosine.values[:, 0]
        worst[name] = np.abs(found / ONE_SQUARED.values - exact).max()
    assert worst[published] > factor * worst[method]


def test_published_methods_serve_no_gate():
    for name in PUBLISHED:
        assert not preset(name, "cosquad").interpolator.serves_gate
        with pytest.raises(ValueError, match=f"^method {name} has no error bound for a gate$"):
            preset(name, "cosquad", gate=True)
