"""Highlight gate: normals that are not unit vectors, and methods for which the gate then fails."""

import numpy as np
import pytest

from blysk.bench.units.lighting.highlight_gate import spans_about
from blysk.bench.units.operands import component_words, pairs_at, sphere, unit_codes
from blysk.golden.cosines.chord import Chord
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.normal_interpolator import NormalInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS

LIMITS = QuadraticInterpolator().gate_limits


def suppressed(model, left, right, halfway, length, exponent, method="quadratic", operand=None):
    """Which spans the gate stops, and which of these have a term other than 0 in the pipeline of a method."""
    pipeline = preset(method, model, operand=operand)
    interpolator = pipeline.interpolator
    gate = HighlightGate(interpolator.gate_limits, pipeline.specular)
    left, right, halfway = component_words(left, right, halfway)
    lit = gate.compute(left, right, halfway, exponent)
    span, _ = pixels_of(length)
    if isinstance(interpolator, NormalInterpolator):
        normals, _ = interpolator.normals(left, right, length)
        product = Chord().operand if interpolator.uses_chord else DotProduct().compute
        highlight = product(normals, halfway[span])
    else:
        # Spans are computed one at a time, because all spans of a call share H.
        found = [
            interpolator.compute(left[k], right[k], length[k], halfway[k], halfway[k]).highlight
            for k in (slice(k, k + 1) for k in range(len(length)))
        ]
        highlight = Fixed(found[0].format, np.concatenate([part.codes[:, 0] for part in found]))
    term = pipeline.specular.compute(highlight, np.zeros(len(span), bool), exponent).codes
    lost = np.bincount(span, weights=(term > 0) & ~lit[span], minlength=len(lit)) > 0
    return ~lit, lost


def codes_of(vectors):
    """Codes of vectors of any length, saturated."""
    codes = np.floor(vectors * ONE + 0.5).astype(np.int64)
    return np.clip(codes, COMPONENT.min_code, COMPONENT.max_code)


def spans_of_length(rng, count, low, high, threshold):
    """Ends with the given lengths, 0 to 60 degrees apart, and H a little farther away than a threshold."""
    degrees = rng.choice([0, 1e-4, 1, -1], count, p=[0.1, 0.1, 0.1, 0.7])
    degrees = np.where(degrees < 0, rng.uniform(0, 60, count), degrees)
    lengths = rng.uniform(low, high, (2, count, 1))
    lengths[:, ::3] = high
    level = threshold / lengths.max(axis=0)[:, 0] - 10.0 ** rng.uniform(-5, -1, count)
    halfway = sphere(rng, count)
    left, right = spans_about(rng, halfway, level, degrees, 0)
    return codes_of(left * lengths[0]), codes_of(right * lengths[1]), quantise(halfway)


def saturating_spans(rng, count, excess, threshold):
    """Ends ``(1, y, z)`` and ``(1, y, -z)``, too long by up to ``excess``, and H near the y axis.

    The middle normal would have a first component over 1. It saturates. If H leans the other way, pixels in
    the middle are then nearer to H than the curve is. H can be near the middle only for y over the threshold.
    """
    beyond = np.sqrt((1 + excess * rng.uniform(0.9, 1, count)) ** 2 - 1)
    share = rng.uniform(0, np.pi / 2, count)
    y, z = beyond * np.sin(share), beyond * np.cos(share)
    y, z = y[y > threshold], z[y > threshold]
    one, other = np.ones(len(y)), z * rng.uniform(0.8, 1, len(y))
    level = threshold - 10.0 ** rng.uniform(-5.5, -3, len(y))
    lean = np.arccos(np.clip(level / np.hypot(y, 1), -1, 1)) - np.arctan2(1, y)
    halfway = quantise(np.stack([-np.sin(lean), np.cos(lean), np.zeros(len(y))], axis=1))
    return codes_of(np.stack([one, y, z], axis=1)), codes_of(np.stack([one, y, -other], axis=1)), halfway


@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_stiff_normals_of_wrong_length(exponent):
    """With ends off by up to 1/256, or too short by any amount, no stopped span has a term, at any angle.

    Steps 1 to 4 of the proof hold for ends of any length, because they follow the codes. A wrong length
    changes only step 5. G and P fit their words up to a length of 1.075. Before that, a component of the
    middle normal over 1 saturates, which needs ends over 1: see `test_stiff_normals_too_long`.
    """
    rng, threshold = (
        np.random.default_rng(exponent),
        np.sqrt(HighlightGate(LIMITS).thresholds.values[exponent]),
    )
    dark = 0
    for low, high in ((1 - 1 / 256, 1 - 1 / 256), (1 - 1 / 256, 1 + 1 / 256), (0.5, 1.0)):
        spans = spans_of_length(rng, 20_000, low, high, threshold)
        not_lit, lost = suppressed("cosquad", *spans, rng.choice([1, 2, 3, 5, 9], 20_000), exponent)
        assert not lost.any()
        dark += np.count_nonzero(not_lit)
    assert (dark > 5000) == (exponent > 1)
    # Opposite normals, and normals at right or nearly right angles, also of wrong length, are over 45 degrees
    # apart. So the gate lets them through.
    out_of_range = pairs_at(rng, 900, np.repeat([89.9, 90, 180], 300))
    for scale in (1 - 1 / 256, 1 + 1 / 256):
        not_lit, _ = suppressed(
            "cosquad",
            *(codes_of(n * scale) for n in out_of_range),
            quantise(out_of_range[0]),
            np.full(900, 3),
            exponent,
        )
        assert not not_lit.any()


@pytest.mark.parametrize("method", ["linear", "quadratic-eval", "quadratic-horner"])
def test_stiff_normals_of_wrong_length_by_other_methods(method):
    """Other methods behave as the quadratic method by differences if their N.H comes from normals that follow
    the ends' lengths."""
    rng = np.random.default_rng(13)
    for exponent in (2, 10, 100, 1000):
        threshold = np.sqrt(HighlightGate(LIMITS).thresholds.values[exponent])
        for low, high in ((1 - 1 / 256, 1 + 1 / 256), (0.5, 1.0)):
            spans = spans_of_length(rng, 3000, low, high, threshold)
            not_lit, lost = suppressed("cosquad", *spans, rng.choice([3, 5], 3000), exponent, method)
            assert not lost.any()
            assert np.count_nonzero(not_lit) > 150


@pytest.mark.parametrize(
    ("method", "operand", "short", "long"),
    [
        pytest.param("bisection", None, True, False, marks=pytest.mark.long),
        ("quadratic", "one_minus_cosine", True, False),
        pytest.param("angular", None, False, True, marks=pytest.mark.long),
        ("recurrence", None, False, True),
    ],
)
def test_stiff_normals_of_wrong_length_lose_highlights(method, operand, short, long):
    """For lengths off by 1/256 the gate fails with these methods, which count on unit normals.

    The gate takes the N.H of the codes. A bisection makes short normals longer, so a pixel may be up to 1/256
    nearer to H than the gate computes. If normals are too long, the angle of a half chord is wider than that
    of the dot product. With lengths off to the other side nothing is lost, and with unit normals nothing is
    lost.
    """
    # One call for each span costs more than the arithmetic.
    count = 120 if method in ("angular", "recurrence") else 4000
    threshold = np.sqrt(HighlightGate(LIMITS).thresholds.values[100])
    for scale, loses in ((1 - 1 / 256, short), (1.0, False), (1 + 1 / 256, long)):
        rng = np.random.default_rng(14)
        spans = spans_of_length(rng, count, scale, scale, threshold)
        if scale == 1:
            spans = [quantise(normalise(codes.astype(float))) for codes in spans]
        not_lit, lost = suppressed("cosquad", *spans, rng.choice([3, 5], count), 100, method, operand)
        assert np.count_nonzero(not_lit) > count / 10
        assert lost.any() == loses


@pytest.mark.parametrize("exponent", [1, 2, 3, 10, 100, 500, 1000])
def test_stiff_normals_of_length_0_and_corners(exponent):
    """A vector 0 counts as 90 degrees.

    Every corner, edge and face of the words' cube is tried in N_l, N_r and H.
    """
    rng = np.random.default_rng(exponent)
    unit = unit_codes(rng, 500)
    zero = np.zeros_like(unit)
    for left, right in ((zero, zero), (zero, unit), (unit, zero)):
        not_lit, _ = suppressed("cosquad", left, right, unit, np.full(500, 3), exponent)
        assert not not_lit.any()
    codes = [COMPONENT.min_code, 0, COMPONENT.max_code]
    ends = np.stack(np.meshgrid(codes, codes, codes), axis=-1).reshape(-1, 3)
    vectors = (ends[k.ravel()] for k in np.indices((27, 27, 27)))
    not_lit, lost = suppressed("cosquad", *vectors, np.full(27**3, 5), exponent)
    assert not lost.any()
    assert np.count_nonzero(not_lit) == (3532 if exponent > 1 else 0)


@pytest.mark.parametrize(("model", "exponent"), [("cosquad", 2), ("lyon3", 6), ("exp", 10)])
def test_stiff_normals_too_long(model, exponent):
    """Up to a length of 1 + 1/128 no highlight is lost, and at 1 + 1/16 some are.

    Where the middle normal saturates, the three wide models with the lowest threshold over 0 are the first to
    lose highlights.
    """
    threshold = np.sqrt(HighlightGate(LIMITS, Specular(REFLECTION_MODELS[model])).thresholds.values[exponent])
    assert 0 < threshold < 0.07
    rng = np.random.default_rng(12)
    for excess, safe in ((1 / 256, True), (1 / 128, True), (1 / 16, False)):
        spans = saturating_spans(rng, 40_000, excess, threshold)
        length = rng.choice([3, 5, 9], len(spans[0]))
        not_lit, lost = suppressed(model, *spans, length, exponent)
        assert np.count_nonzero(not_lit) > 3000
        assert lost.any() != safe
