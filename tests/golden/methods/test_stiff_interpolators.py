"""Stiff and extreme cases of the interpolators: peaks, terminators, wrong normals, the ends of the words.

The reference is the method's own curve in float64, through the vectors of the codes, whatever their length;
the bounds are those that the docstrings of the devices state for spans to 45 degrees. What the colours of all
methods do in all groups of cases is in `stability`.
"""

import itertools

import numpy as np
import pytest

from blysk.bench.units.operands import pairs_at
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.specular import Specular
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.presets import METHODS
from blysk.golden.reference.curves import interpolate

STEP = COMPONENT.step
ONE_VALUE = float(ONE_SQUARED.values)
# Chords to H of normals that are not of unit length are no cosines; tests of their own have their bounds.
NAMES = [
    name
    for name, method in METHODS.items()
    if method.brings_ends and not (method.uses_chord and method.CURVE != "normalised")
]
NORMALS = [name for name in NAMES if name not in ("angular", "recurrence")]
ANGLES = [0, 1e-4, 1, 20, 44.9]


def bound(method, length, degrees):
    return METHODS[method].operand_error(length, degrees)


def reference(method, left, right, length, vector):
    """Cosines of the method's curve with a vector, at every pixel, in float64; the arguments are codes."""
    left, right, vector = (np.asarray(v) / ONE for v in (left, right, vector))
    span, index = pixels_of(length)
    t = index / np.maximum(length - 1, 1)[span]
    a, b = ((end * vector).sum(axis=-1)[span] for end in (left, right))
    curve = METHODS[method].CURVE
    if curve == "linear" or method == "renormalise":
        normals = interpolate(curve, left[span], right[span], t)
        return (normals * vector[span]).sum(axis=-1)
    r = np.minimum((left * right).sum(axis=-1), 1)[span]
    if curve == "quadratic":
        # Opposite normals are flagged.
        middle = (a + b) / np.sqrt(np.maximum(2 * (1 + r), STEP))
        return (2 * (a + b) - 4 * middle) * t**2 + (4 * middle - b - 3 * a) * t + a
    # The angle is that of the chord, so that the curve goes through both ends.
    psi = 2 * np.arcsin(np.minimum(np.linalg.norm(right - left, axis=-1) / 2, 1))[span]

    def weight(t):
        return t * np.sinc(t * psi / np.pi) / np.sinc(psi / np.pi)

    return a * weight(1 - t) + b * weight(t)


def operands(method, left, right, length, vector):
    """Cosines that a method finds for one vector as L and as H, in units of the code of length 1."""
    interpolator = METHODS[method]
    format = interpolator.END_FORMAT
    shift = format.fraction_bits - COMPONENT.fraction_bits
    ends = (Fixed(format, codes << shift) for codes in (left, right))
    vector = Fixed(COMPONENT, np.asarray(vector)[np.newaxis])
    found = interpolator.compute(*ends, length, vector, vector)
    scale = ONE_VALUE if method in NORMALS else 1.0
    cosine, highlight = (operand.values[:, 0] / scale for operand in (found.cosine, found.highlight))
    return cosine, highlight if interpolator.operand == "cosine" else 1 - highlight, found


def turned(rng, degrees, at, off=0.0):
    """A span about a fixed vector H: its peak at the share ``at``, H ``off`` degrees off its plane."""
    psi = np.radians(degrees)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    along, side, across = axes
    halfway = along * np.cos(np.radians(off)) + across * np.sin(np.radians(off))
    ends = [along * np.cos(a) + side * np.sin(a) for a in (-at * psi, (1 - at) * psi)]
    return [quantise(v)[np.newaxis] for v in ends], quantise(halfway)


@pytest.mark.parametrize(("length", "pixel"), [(2, 0), (3, 1), (17, 8), (17, 16), (16, 7.5), (513, 256)])
@pytest.mark.parametrize("method", NAMES)
def test_stiff_peak(method, length, pixel):
    """On a pixel, at an end, in the middle of all; exactly between two: the bound holds at every pixel."""
    rng, lengths = np.random.default_rng(length), np.array([length])
    for degrees, off in itertools.product(ANGLES, (0, 0.5, 30)):
        largest = bound(method, length, degrees)
        ends, halfway = turned(rng, degrees, pixel / (length - 1), off)
        cosine, highlight, found = operands(method, *ends, lengths, halfway)
        exact = reference(method, *ends, lengths, halfway[np.newaxis])
        assert not found.out_of_range.any()
        assert np.abs(cosine - exact).max() <= largest
        assert np.abs(highlight - np.clip(exact, -1, 1)).max() <= largest + 2.0**-25
        # Around the peak the curve is even: two pixels as far from it on either side are alike.
        around = [int(np.floor(pixel)), int(np.ceil(pixel))]
        if 0 < pixel < length - 1:
            around = [around[0] - (around[0] == pixel), around[1] + (around[1] == pixel)]
            # The ends' rounding turns the plane and moves the peak.
            assert abs(highlight[around[0]] - highlight[around[1]]) <= 2 * largest + 4 * STEP


@pytest.mark.parametrize("exponent", [500, 1000])
@pytest.mark.parametrize("method", NAMES)
def test_stiff_peak_narrower_than_a_pixel(method, exponent):
    """Steps of 20 degrees and a highlight of 5.1: full on the pixel that it meets, nothing anywhere else."""
    interpolator = METHODS[method]
    specular, rng = Specular(operand=interpolator.operand), np.random.default_rng(exponent)
    for at, lit in ((0.5, True), (0.25, False), (0.0, True)):
        ends, halfway = turned(rng, 40, at)
        found = operands(method, *ends, np.array([3]), halfway)[2]
        term = specular.compute(found.highlight[:, 0], np.zeros(3, bool), exponent).values
        peak = round(2 * at)
        assert (np.delete(term, peak) == 0).all()
        if not lit:
            assert term[peak] == 0
        elif interpolator.CURVE != "linear" or at == 0:
            # S falls by n an unit of N.H at its peak.
            assert term[peak] >= 1 - exponent * (bound(method, 3, 40) + 2 * STEP)
        else:
            # 1 - cos 20 degrees too short in the middle of the span: the highlight is lost.
            assert term[peak] == 0


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("method", NAMES)
def test_stiff_terminator(method, degrees):
    """N.L through 0 in the span: the sign is right where N.L is over the bound, and no error elsewhere."""
    length = np.array([64])
    largest = bound(method, 64, degrees)
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    psi = np.radians(degrees)
    ends = [quantise(axes[0] * np.cos(a) + axes[1] * np.sin(a))[np.newaxis] for a in (-psi / 2, psi / 2)]
    for turn in (0, 1e-5, -1e-5, 0.1, -0.1):
        direction = quantise(axes[1] * np.cos(turn) + axes[0] * np.sin(turn))
        cosine, _, found = operands(method, *ends, length, direction)
        exact = reference(method, *ends, length, direction[np.newaxis])
        assert np.abs(cosine - exact).max() <= largest
        dark = Diffuse.dark(found.cosine[:, 0])
        sure = np.abs(exact) > largest
        np.testing.assert_array_equal(dark[sure], exact[sure] <= 0)
        if degrees > 0.1 or abs(turn) == 0.1:
            assert sure.any()


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("method", NAMES)
def test_stiff_light_behind_and_at_the_viewer(method, degrees):
    """L behind: every pixel dark. L = V, so H = L: one value twice. L = -V: H is 0, and so is N.H.

    Half the squared chord from N to H is then 1/2, with no meaning: there a light has no specular colour.
    """
    rng, length = np.random.default_rng(4), np.array([33])
    ends, light = turned(rng, degrees, 0.5)
    cosine, highlight, _ = operands(method, *ends, length, light)
    if METHODS[method].uses_chord:
        assert np.abs(highlight - cosine).max() <= bound(method, 33, degrees)
    else:
        # 1 - N.H of the methods that have it saturates at 0.
        np.testing.assert_array_equal(cosine if method in NORMALS else np.minimum(cosine, 1), highlight)
    behind, _, found = operands(method, *ends, length, -light)
    assert Diffuse.dark(found.cosine).all()
    assert np.abs(behind + reference(method, *ends, length, light[np.newaxis])).max() <= bound(
        method, 33, degrees
    )
    none, also_none, found = operands(method, *ends, length, np.zeros(3, int))
    if METHODS[method].uses_chord:
        assert not none.any()
        assert np.abs(also_none - 0.5).max() <= bound(method, 33, degrees)
        return
    if method in NORMALS:
        assert not none.any()
        assert not also_none.any()
    assert max(np.abs(none).max(), np.abs(also_none).max()) <= bound(method, 33, degrees)
    # The lowest exponent of which the term at N.H = 0 is 0 is 2.
    specular = Specular(operand=METHODS[method].operand)
    assert not specular.compute(found.highlight[:, 0], np.zeros(33, bool), 3).codes.any()


def scaled_spans(rng, count, scales):
    """Unit ends, 0 to 44 degrees apart, times their lengths; no component is over 0.95."""
    left, right = pairs_at(rng, 4 * count, rng.uniform(0, 44, 4 * count))
    inside = np.maximum(np.abs(left), np.abs(right)).max(axis=1) < 0.95
    ends = [end[inside][:count] for end in (left, right)]
    return [
        np.floor(end * scale * ONE + 0.5).astype(np.int64) for end, scale in zip(ends, scales, strict=True)
    ]


@pytest.mark.parametrize("scales", [(1 - 1 / 256,) * 2, (1 + 1 / 256,) * 2, (1 - 1 / 256, 1 + 1 / 256)])
@pytest.mark.parametrize("method", NAMES)
def test_stiff_normals_of_wrong_length(method, scales):
    """1 +- 1/256 at either end: the curve goes through the ends as they are, and the bound holds about it.

    `renormalise` gives unit normals, of any such ends. The bisection makes every middle of a level unit
    again, but not the ends, so that it is within the excess of them.
    """
    rng, length = np.random.default_rng(5), np.full(300, 9)
    left, right = scaled_spans(rng, 300, scales)
    vector = quantise(pairs_at(rng, 1, 0.0)[0])[0]
    cosine, highlight, found = operands(method, left, right, length, vector)
    exact = reference(method, left, right, length, vector[np.newaxis].repeat(300, 0))
    largest = bound(method, 9, 44) * (1 + 1 / 256)
    if method == "bisection":
        largest += 1 / 256
    assert not found.out_of_range.any()
    # 1 - cos gamma has a word from 0 to 2. The angular method has it of L too.
    held = exact if method in NORMALS else np.clip(exact, -1, 1)
    assert np.abs(cosine - (held if method == "angular" else exact)).max() <= largest
    assert np.abs(highlight - held).max() <= largest + 2.0**-25


LINE_ERROR = LineSetup.ERROR + np.sqrt(3) * LineSetup.VECTOR_FORMAT.step
"""Of a pixel's vector of the straight line, before it is renormalised."""


def shortest_of(left, right):
    """Shortest vector of the straight line of each span of 9 pixels."""
    t = np.linspace(0, 1, 9)[:, np.newaxis, np.newaxis]
    return np.linalg.norm((1 - t) * left + t * right, axis=2).min(axis=0) * STEP


def pairs_of(ends):
    """Every span between two of the vectors."""
    left, right = np.indices((len(ends), len(ends))).reshape(2, -1)
    return ends[left], ends[right]


def span_errors(method, left, right, vector):
    """Largest error of N.L in each span of 9 pixels, and which spans are flagged."""
    length = np.full(len(left), 9)
    cosine, _, found = operands(method, left, right, length, vector)
    exact = reference(method, left, right, length, vector[np.newaxis].repeat(len(left), 0))
    if method == "angular":
        exact = np.clip(exact, -1, 1)
    return np.abs(cosine - exact).reshape(-1, 9).max(axis=1), found.out_of_range


@pytest.mark.parametrize("method", NAMES)
def test_stiff_axes_at_the_ends_of_the_words(method):
    """The smallest and the largest code along each axis, 0, 90 and 180 degrees apart: flagged, or right."""
    axes = np.vstack([COMPONENT.max_code * np.eye(3, dtype=int), COMPONENT.min_code * np.eye(3, dtype=int)])
    left, right = pairs_of(axes)
    cosine = (left * right).sum(axis=1)
    for vector in quantise(np.array([[0.48, 0.6, 0.64], [0.8, 0.0, -0.6], [0.0, 1.0, 0.0]])):
        error, out_of_range = span_errors(method, left, right, vector)
        # The smallest code is a step longer than the code of length 1.
        assert (error[~out_of_range] <= bound(method, 9, 90) + STEP).all()
        assert not out_of_range[cosine > 0].any()
        assert out_of_range[cosine < 0].all()
        # Of linear normals, a difference by the smallest code saturates.
        if method != "linear":
            assert (out_of_range[cosine == 0] == method.startswith("quadratic")).all()


@pytest.mark.parametrize("method", ["linear", "renormalise", "recurrence"])
def test_stiff_words_at_their_ends(method):
    """Components at the ends of the words, 0 and a step, lengths 0 to sqrt 3: flagged, or within the bound.

    The other methods count on unit normals: see `test_stiff_long_normals`.
    """
    codes = [COMPONENT.min_code, -1, 0, COMPONENT.max_code]
    left, right = pairs_of(np.stack(np.meshgrid(codes, codes, codes), axis=-1).reshape(-1, 3))
    if method == "renormalise":
        shortest = shortest_of(left, right)
        # A vector under 2^-8 has no normal; up to sqrt 3 times that it may have.
        surely = shortest < Renormaliser.SHORTEST - LINE_ERROR
        may = shortest <= np.sqrt(3) * Renormaliser.SHORTEST + LINE_ERROR
    flagged = 0
    for vector in quantise(np.array([[0.48, 0.6, 0.64], [0.8, 0.0, -0.6], [0.6, -0.8, 0.0]])):
        error, out_of_range = span_errors(method, left, right, vector)
        # P is up to sqrt 3 long, so 1/(m-1) counts so often.
        largest = bound(method, 9, 90) + (method == "linear") * 2 * STEP
        if method == "renormalise":
            own = Renormaliser.DIRECTION_ERROR + Renormaliser.LENGTH_ERROR
            largest = (LINE_ERROR / np.maximum(shortest, STEP) + own)[~out_of_range]
            assert out_of_range[surely].all()
            assert not out_of_range[~may].any()
        assert (error[~out_of_range] <= largest).all()
        flagged += np.count_nonzero(out_of_range)
    assert 0.05 < flagged / (3 * len(left)) < 0.99


@pytest.mark.parametrize(
    ("method", "lost"),
    [
        ("quadratic", 0.3),
        ("quadratic-eval", 0.3),
        ("quadratic-horner", 0.3),
        ("bisection", 0.3),
    ],
)
def test_stiff_long_normals(method, lost):
    """Ends sqrt 2 and sqrt 3 long: no flag, and no bound either. The error that a user gets out of range.

    The range is that of `test_stiff_normals_of_wrong_length`, a length within 1/256 of 1.
    """
    codes = [COMPONENT.min_code, 0, COMPONENT.max_code]
    ends = np.stack(np.meshgrid(codes, codes, codes), axis=-1).reshape(-1, 3)
    left, right = pairs_of(ends[(ends != 0).sum(axis=1) > 1])
    near = (left * right).sum(axis=1) * STEP**2 > 0.5
    if method == "bisection":
        # A chord of 2 has no angle.
        near &= np.square(right - left).sum(axis=1) * STEP**2 < 3.5
    vector = quantise(np.array([[0.48, 0.6, 0.64]]))[0]
    error, out_of_range = span_errors(method, left[near], right[near], vector)
    assert not out_of_range.any()
    assert error.max() > lost
