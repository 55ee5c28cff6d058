"""Operands of the interpolators at peaks and terminators, within the bound that each method states.

The reference is the method's own curve in float64, through the vectors of the codes. `stability` has the
colours of all methods in all groups of stiff and extreme cases. The tests of the units have wrong lengths and
the ends of words.
"""

import itertools

import numpy as np
import pytest

from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.presets import METHODS
from blysk.golden.reference.curves import interpolate

STEP = COMPONENT.step
ONE_VALUE = float(ONE_SQUARED.values)
# If normals do not have unit length, their chords to H are no cosines. Tests of their own have bounds for
# these normals.
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
    """Cosines between the method's curve and a vector, at every pixel in float64. The arguments are codes."""
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
    # The angle is that of the chord, so the curve goes through both ends.
    psi = 2 * np.arcsin(np.minimum(np.linalg.norm(right - left, axis=-1) / 2, 1))[span]

    def weight(t):
        return t * np.sinc(t * psi / np.pi) / np.sinc(psi / np.pi)

    return a * weight(1 - t) + b * weight(t)


def operands(method, left, right, length, vector):
    """Cosines that a method finds for the same vector as L and as H, in units of the code of length 1."""
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
    """A span about a fixed vector H: its peak is at the share ``at``, and H is ``off`` degrees away from its
    plane."""
    psi = np.radians(degrees)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    along, side, across = axes
    halfway = along * np.cos(np.radians(off)) + across * np.sin(np.radians(off))
    ends = [along * np.cos(a) + side * np.sin(a) for a in (-at * psi, (1 - at) * psi)]
    return [quantise(v)[np.newaxis] for v in ends], quantise(halfway)


@pytest.mark.parametrize(("length", "pixel"), [(2, 0), (3, 1), (17, 8), (17, 16), (16, 7.5), (513, 256)])
@pytest.mark.parametrize("method", NAMES)
def test_stiff_peak(method, length, pixel):
    """The peak is on a pixel, at an end, in the middle of the span, and exactly between two pixels.

    The bound holds at every pixel.
    """
    rng, lengths = np.random.default_rng(length), np.array([length])
    for degrees, off in itertools.product(ANGLES, (0, 0.5, 30)):
        largest = bound(method, length, degrees)
        ends, halfway = turned(rng, degrees, pixel / (length - 1), off)
        cosine, highlight, found = operands(method, *ends, lengths, halfway)
        exact = reference(method, *ends, lengths, halfway[np.newaxis])
        assert not found.out_of_range.any()
        assert np.abs(cosine - exact).max() <= largest
        assert np.abs(highlight - np.clip(exact, -1, 1)).max() <= largest + 2.0**-25
        # The curve is symmetric about the peak, so two pixels at equal distances from it have equal values.
        around = [int(np.floor(pixel)), int(np.ceil(pixel))]
        if 0 < pixel < length - 1:
            around = [around[0] - (around[0] == pixel), around[1] + (around[1] == pixel)]
            # The rounding of the ends turns the plane and moves the peak.
            assert abs(highlight[around[0]] - highlight[around[1]]) <= 2 * largest + 4 * STEP


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("method", NAMES)
def test_stiff_terminator(method, degrees):
    """N.L goes through 0 in the span. Its sign is right wherever N.L is over the bound."""
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
