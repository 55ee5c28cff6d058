"""Quotients: the root over its whole table, s and N·L against float64, both parts of a lobe's table."""

import numpy as np
import pytest

from blysk.golden.cosines.quotient import OCTAVES, STEPS, Quotient
from blysk.golden.cosines.quotient_spans import PixelWords, QuotientSpans
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.number.fixed import Fixed


def test_root_is_within_its_bound_at_every_word():
    """Every shifted word of q, 21 bits, is compared with float64, and some words of every shift."""
    unit = Quotient()
    for shift in range(8):
        normal = np.arange(1 << 19, 1 << 21, 41 if shift else 1)
        square = (normal << 15) >> 2 * shift
        root, found, too_small = unit.root(square)
        assert (found == shift).all()
        assert not too_small.any()
        exact = 1 / np.sqrt(np.ldexp(square.astype(float), 2 * shift - 34))
        assert np.abs(root * 2.0**-17 / exact - 1).max() <= Quotient.ROOT_ERROR
    assert unit.root(np.array([0, (1 << 20) - 1, 1 << 20]))[2].tolist() == [True, True, False]


def _pixels(spans, m, w, line):
    format = spans.square_format
    return PixelWords(
        Fixed.round(format, m[:, np.newaxis]),
        Fixed.round(format, w),
        Fixed.round(spans.LINE_FORMAT, line[:, np.newaxis]),
        np.zeros((len(m), 1), dtype=bool),
    )


@pytest.mark.parametrize("mirror", [False, True])
def test_quotients_against_float64(mirror):
    """N·L and s are within the stated errors. s is found from the row and step of the place."""
    rng = np.random.default_rng(5)
    count, unit = 200_000, Quotient(QuotientSpans(mirror=mirror))
    square = 4.0 ** rng.uniform(-3, 0, count)
    s = np.where(rng.random(count) < 0.5, 2.0 ** -rng.uniform(0, 30, count), rng.uniform(0, 1, count))
    s = np.where(rng.random(count) < 0.3, 1 - s, s)
    cosine = rng.uniform(-1, 1, count)
    m, w = s * square, (1 - s) * square
    found, place, too_small = unit.compute(_pixels(unit.spans, m, w, cosine * np.sqrt(square) * 0.9999))
    assert not too_small.any()
    atol = Quotient.COSINE_ERROR + found.format.step
    np.testing.assert_allclose(found.values[:, 0], 0.9999 * cosine, rtol=0, atol=atol)
    codes = place.codes[:, 0]
    past = codes >= unit.parts * (OCTAVES + 1) * STEPS << 12
    part, at = np.divmod(codes / 4096, (OCTAVES + 1) * STEPS)
    lobe = QuotientLobe()
    value = np.interp(at, np.arange(len(lobe.knots)), lobe.knots)
    if mirror:
        assert (past == (s >= 0.5))[np.abs(s - 0.5) > 1e-4].all()
    else:
        assert not past.any()
        # They are compared in steps of 2^-18.
        assert ((part == 1) == (s > 0.5))[np.abs(s - 0.5) * square > 2.0**-18].all()
    exact = np.where(part == 1, 1 - s, s)
    # Words of m and w have steps of 2^-40, those of row 0 steps of 2^-31.
    floor = 2.0**-31 + 2 * 2.0**-40 / square
    assert (np.abs(value - exact) <= Quotient.SINE_ERROR * exact + floor)[~past].all()


def test_a_negative_numerator_is_the_peak():
    """At the peak m may drift below 0. Then s is 0."""
    unit = Quotient()
    _, place, _ = unit.compute(_pixels(unit.spans, np.array([-(2.0**-33)]), np.array([0.5]), np.zeros(1)))
    assert place.codes.tolist() == [[0]]


def test_z_below_0_and_no_highlight_are_past_the_end():
    unit = Quotient()
    pixels = _pixels(unit.spans, np.array([0.01]), np.array([0.5]), np.zeros(1))
    _, place, _ = unit.compute(pixels._replace(away=np.ones((1, 1), dtype=bool)))
    assert place.codes.tolist() == [[512 << 12]]
    lobe = QuotientLobe()
    assert lobe.compute(place, np.zeros((1, 1), dtype=bool), lobe.table(1)).codes.tolist() == [[0]]
