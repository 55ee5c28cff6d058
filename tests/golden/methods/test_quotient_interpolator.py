"""The quotient method against float64: its bound on every span, and the limits of its rules."""

from functools import partial

import numpy as np
import pytest

from blysk.golden.cosines.quotient_spans import SpanVectors
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.methods.quotient_interpolator import QuotientErrors, QuotientInterpolator
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light_frame import light_frame
from blysk.golden.reference.reflection import BLINN, PHONG

TABLE = 0.1 / 255
"""Error of the tables of `QuotientLobe`, and of its arithmetic."""


def _ends(rng, count, ratio, degrees):
    """Vectors of spans, some about the z axis.

    Their lengths have a ratio up to a limit, their angles are up to a number of degrees.
    """
    left = normalise(
        np.array([0, 0, 1.0]) + rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 1, (count, 1))
    )
    across = normalise(np.cross(left, rng.normal(size=(count, 3))))
    angle = np.radians(degrees * rng.uniform(0, 1, (count, 1)) ** 2)
    right = left * np.cos(angle) + across * np.sin(angle)
    return left, right * ratio ** rng.uniform(-1, 1, (count, 1))


def _found(method, frame, left, right, length, exponents):
    """N·L and terms of the exponents, as found and exact, and the exact N·L.

    Pixels with a highlight near N·H = 0 are left out.
    """
    spans = method.spans(1, True)
    kinds = (1, frame.cosine, 1) if method.mirror else (1, 1, 1)

    def components(vector):
        further = [vector[:, 1] * frame.sine] if method.mirror else []
        return np.stack([*(vector * kinds).T, *further], axis=-1)

    vectors = SpanVectors.quantise(components(left), components(right), length)
    codes = np.zeros((1, 3), dtype=np.int64)
    codes[:, ::2] = spans.codes_of(frame.sine, frame.cosine)
    operands = method.compute_vectors(spans, vectors, length, codes)
    assert not operands.out_of_range.any()
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    normal = normalise((1 - t) * left[span] + t * right[span])
    cosine = normal @ frame.direction
    height = normal[:, 2]
    if method.mirror:
        height = 2 * cosine * (normal @ (frame.direction * (-1, 1, 1))) - (frame.cosine**2 - frame.sine**2)
    lobe = QuotientLobe(PHONG if method.mirror else BLINN)
    dark = np.zeros(operands.highlight.shape, dtype=bool)
    terms = {
        n: (lobe.compute(operands.highlight, dark, lobe.table(n)).values[:, 0], np.maximum(height, 0) ** n)
        for n in exponents
    }
    return vectors, operands.cosine.values[:, 0], cosine, terms, height


@pytest.mark.parametrize("mirror", [False, True])
def test_bound_of_every_span(mirror):
    """In spans of 1 to 4095 pixels the errors of N·L and of terms are within the bound of their span."""
    rng = np.random.default_rng(11)
    method = QuotientInterpolator(mirror)
    for length, count in ((1, 200), (3, 200), (17, 100), (257, 20), (4095, 4)):
        for light in normalise(rng.normal(size=(2, 3))):
            frame = light_frame(light, normalise(rng.normal(size=3)))
            lengths = np.full(count, length)
            left, right = _ends(rng, count, 2.0, 90.0)
            found = partial(_found, method, frame, left, right, lengths)
            vectors, cosine, exact, terms, height = found((1, 2, 10, 100, 1000))
            span = np.repeat(np.arange(count), length)
            for n, (term, true) in terms.items():
                off = np.abs(term - true)
                # At 90 degrees a power of 1 has a kink.
                off[np.abs(height) < 1e-5] = 0
                worst = int(span[off.argmax()])
                errors = QuotientErrors.of(vectors[worst : worst + 1], lengths[:1], mirror)
                model = PHONG if mirror else BLINN
                assert off.max() <= errors.highlight(model, n) + TABLE
            off = np.abs(cosine - exact)
            worst = int(span[off.argmax()])
            assert off.max() <= QuotientErrors.of(vectors[worst : worst + 1], lengths[:1], mirror).cosine


@pytest.mark.parametrize("mirror", [False, True])
def test_bound_of_a_further_light(mirror):
    """The words of a further light are rounded by themselves, and q comes from the first light.

    Near N·H = 0 at n = 1 this makes up to 1 LSB.
    """
    rng = np.random.default_rng(5)
    method, count, length = QuotientInterpolator(mirror), 1500, 9
    spans, lobe = method.spans(2, True), QuotientLobe(PHONG if mirror else BLINN)
    viewer = np.array([0.0, 0.0, 1.0])
    lengths, largest = np.full(count, length), 0.0
    for lights in normalise(rng.normal(size=(12, 2, 3))):
        frames = [light_frame(light, viewer) for light in lights]
        axes = np.concatenate([f.axes * [[1], [f.cosine if mirror else 1], [1]] for f in frames])
        if mirror:
            axes = np.vstack([axes, frames[0].sine * frames[0].axes[1]])
        left, right = _ends(rng, count, 2.0, 90.0)
        vectors = SpanVectors.quantise(left @ axes.T, right @ axes.T, lengths)
        codes = np.zeros((2, 3), dtype=np.int64)
        codes[:, ::2] = spans.codes_of(*(np.array([f[k] for f in frames]) for k in (1, 2)))
        operands = method.compute_vectors(spans, vectors, lengths, codes)
        span, index = pixels_of(lengths)
        t = (index / (length - 1))[:, np.newaxis]
        normal = normalise((1 - t) * left[span] + t * right[span])
        cosine, height = normal @ lights[1], normal @ frames[1].axes[2]
        if mirror:
            height = 2 * cosine * (normal @ viewer) - lights[1] @ viewer
        errors = QuotientErrors.of(vectors, lengths, mirror, further=True)
        assert np.abs(operands.cosine.values[:, 1] - cosine).max() <= errors.cosine
        dark = np.zeros(operands.highlight.shape, dtype=bool)
        for n in (1, 2, 100):
            off = np.abs(
                lobe.compute(operands.highlight, dark, lobe.table(n)).values[:, 1]
                - np.maximum(height, 0) ** n
            )
            off[np.abs(height) < 1e-5] = 0
            worst = slice(span[off.argmax()], span[off.argmax()] + 1)
            errors = QuotientErrors.of(vectors[worst], lengths[worst], mirror, further=True)
            assert off.max() <= errors.highlight(lobe.reflection, n) + TABLE
            largest = max(largest, 255 * off.max())
    assert mirror or largest > 0.8


@pytest.mark.parametrize("mirror", [False, True])
def test_errors_are_those_of_the_guide(mirror):
    """The guide states the largest error of terms in 2,000 spans up to 1:2, 90 degrees and 257 pixels, in
    LSB."""
    rng = np.random.default_rng(12)
    method, count = QuotientInterpolator(mirror), 2000
    length = np.maximum((2 ** rng.uniform(1.6, 8, count)).astype(int), 3)
    frame = light_frame(normalise(np.array([0.6, 0.3, 1.0])), np.array([0.0, 0.0, 1.0]))
    left, right = _ends(rng, count, 2.0, 90.0)
    *_, terms, height = _found(method, frame, left, right, length, (10, 100, 1000))
    limits = {10: 0.05, 100: 0.06, 1000: 0.12} if mirror else {10: 0.05, 100: 0.06, 1000: 0.08}
    for n, (term, true) in terms.items():
        assert 255 * np.abs(term - true)[np.abs(height) > 1e-5].max() <= limits[n]


def _corner(light, viewer, left, right, length, mirror):
    frame = light_frame(np.asarray(light, float), np.asarray(viewer, float))
    left, right = (np.atleast_2d(np.asarray(end, float)) @ frame.axes.T for end in (left, right))
    return _found(QuotientInterpolator(mirror), frame, left, right, np.array([length]), (1, 10, 1000))


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("length", [1, 3, 4095])
def test_corners(mirror, length):
    """The limits are L = V, a light behind the horizon, the terminator, steps under a unit, and m clamped at
    the peak."""
    z, x = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    behind = normalise(np.array([1.0, 0.0, -0.9]))
    cases = [
        (z, z, z, z),
        (z, z, (1e-7, 0, 1), (-1e-7, 0, 1)),
        (behind, z, normalise(np.array([1.0, 0.2, -0.4])), normalise(np.array([1.0, -0.2, -0.45]))),
        (x, z, (0, 1, 0), (1e-3, 1, 0)),
        (x, z, (1, 0, 1), (1, 1e-6, 1)),
        (x, z, (-1, 0, -1), (-1, 0, -0.5)),
    ]
    for light, viewer, left, right in cases:
        _, cosine, exact, terms, height = _corner(light, viewer, left, right, length, mirror)
        assert np.abs(np.maximum(cosine, 0) - np.maximum(exact, 0)).max() < 1e-4
        # The sign is that of the accumulator's word.
        clear = np.abs(exact) > 2.0**-15
        assert ((cosine > 0) == (exact > 0))[clear].all()
        for term, true in terms.values():
            assert np.abs(term - true)[np.abs(height) > 1e-5].max(initial=0) < 0.5 / 255


def test_an_opposite_viewer():
    """With L = -V Blinn's model has no H.

    R·V is -1 + 2 (N x L)^2, which is largest where N is perpendicular to L.
    """
    _, cosine, exact, terms, height = _corner((1, 0, 0), (-1, 0, 0), (0.1, 1, 0), (-0.1, 1, 0.2), 17, True)
    assert np.abs(cosine - exact).max() < 1e-4
    for term, true in terms.values():
        assert np.abs(term - true)[np.abs(height) > 1e-5].max() < 0.5 / 255


def test_vectors_through_0_are_flagged():
    """A span that should have been cut and was not is counted."""
    method = QuotientInterpolator()
    spans = method.spans(1, True)
    ends = np.array([[1.0, 0, 0], [0, 0, 1.0]])
    vectors = SpanVectors.quantise(ends, -ends, np.array([9, 9]))
    codes = np.array([[0, 0, spans.ONE]])
    assert method.compute_vectors(spans, vectors, np.array([9, 9]), codes).out_of_range.all()


@pytest.mark.parametrize("mirror", [False, True])
def test_lines_about_spans_begin_with_their_port(mirror):
    """A core that takes triangles leaves out lines that begin with ``i_``. No other line is about spans."""
    lines = QuotientInterpolator(mirror).input_lines(2, True, ())
    kept = [line for line in lines if not line.startswith("i_")]
    assert len(kept) < len(lines)
    assert not [line for line in kept if "i_" in line or " span" in line or "SQ(" in line]
