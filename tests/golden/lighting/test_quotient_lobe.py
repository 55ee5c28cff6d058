"""Lobes of the quotient method against float64, over both parts of their tables; dark beats, ends, and
refusals."""

import numpy as np
import pytest

from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.lobes import BECKMANN, GGX
from blysk.golden.reference.reflection import BLINN, PHONG, REFLECTION_MODELS

SPACING = 61
"""Codes from one place to the next. The number is odd, so that all positions within a step occur."""


def places(lobe):
    """Codes of places where s, or 1 - s, is up to 1/2, and the cosine in the middle of each code."""
    inside = (lobe.octaves * lobe.steps) << 12
    codes = np.r_[np.arange(0, inside, SPACING), inside - 1]
    s = np.interp((codes + 0.5) / 4096, np.arange(len(lobe.knots)), lobe.knots)
    if lobe.reflection.MIRROR:
        return codes, 1 - 2 * s
    part = (lobe.octaves + 1) * lobe.steps << 12
    return np.r_[codes, codes + part], np.r_[np.sqrt(1 - s), np.sqrt(s)]


def shade(lobe, codes, table, dark=False):
    return lobe.compute(Fixed(lobe.operand_format, codes), np.full(codes.shape, dark), table)


@pytest.mark.parametrize(
    ("model", "parameters", "lsb"),
    [
        (BLINN, (1, 2, 3, 10, 100, 1000), 0.06),
        (PHONG, (1, 2, 3, 10, 100, 1000), 0.06),
        (GGX, (0.1, 0.3, 0.6, 1), 0.04),
        (BECKMANN, (0.1, 0.3, 0.6), 0.1),
        (REFLECTION_MODELS["cosquad"], (5, 20, 1000), 0.12),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_error_of_the_lines(model, parameters, lsb):
    """The largest error over both parts is within the statement of the docstring of `QuotientLobe`, in
    LSB."""
    lobe = QuotientLobe(model)
    codes, cosine = places(lobe)
    for parameter in parameters:
        found = shade(lobe, codes, lobe.table(parameter)).values
        assert np.abs(found - model.reflect(cosine, parameter)).max() * 255 <= lsb, parameter


def test_sharp_lobes_lose_their_error():
    """ggx at roughness 0.05 is off by 5.3 LSB, as stated."""
    lobe = QuotientLobe(GGX)
    codes, cosine = places(lobe)
    error = np.abs(shade(lobe, codes, lobe.table(0.05)).values - GGX.reflect(cosine, 0.05)).max() * 255
    assert error == pytest.approx(5.3, abs=0.05)


def test_phong_ends_in_a_kink_at_a_half():
    """At power 1 the line up to ``s = 1/2`` ends at exactly 0, and all places beyond are dark."""
    lobe = QuotientLobe(PHONG)
    table, end = lobe.table(1), (lobe.octaves * lobe.steps) << 12
    last = shade(lobe, np.array([end - 4096, end - 2048, end - 1]), table).values * 255
    assert last == pytest.approx([255 / 32, 255 / 64, 0], abs=0.06)
    assert not shade(lobe, np.array([end, end + 4095, lobe.operand_format.max_code]), table).codes.any()


@pytest.mark.parametrize("model", [BLINN, PHONG])
def test_dark_and_past_the_end(model):
    lobe = QuotientLobe(model)
    table, end = lobe.table(1), lobe.rows * lobe.steps << 12
    assert not shade(lobe, np.array([end, end + 1, lobe.operand_format.max_code]), table).codes.any()
    codes, _ = places(lobe)
    assert not shade(lobe, codes[::1000], table, dark=True).codes.any()


def test_lobes_beyond_a_right_angle_are_refused():
    text = (
        "^cosquad with exponent 1 is 0.25 beyond a right angle of N and H, where the method quotient has no "
    )
    with pytest.raises(ValueError, match=text):
        QuotientLobe(REFLECTION_MODELS["cosquad"]).table(1)
    with pytest.raises(ValueError, match=r"^operand must be UQ\(10, 12\), not UQ\(9, 12\)$"):
        QuotientLobe().argument(Fixed(QuotientLobe(PHONG).operand_format, np.zeros(1, dtype=int)))
