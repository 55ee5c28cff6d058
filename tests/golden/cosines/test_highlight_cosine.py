"""Highlight-cosine unit against float64 mathematics."""

from fractions import Fraction

import numpy as np
import pytest

from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.reference.curves import interpolate

UNIT = HighlightCosine()
TURN = 1 << 40


def values(phase, cos_beta, unit=UNIT, step=0, length=1):
    """Results of spans of one length, shape (spans, length)."""
    phase = np.atleast_1d(phase)
    count = len(phase)
    result = unit.compute(
        Fixed(unit.PHASE_FORMAT, phase),
        Fixed(unit.STEP_FORMAT, np.broadcast_to(step, count)),
        Fixed(unit.COS_BETA_FORMAT, np.broadcast_to(cos_beta, count)),
        np.repeat(np.arange(count), length),
        np.tile(np.arange(length), count),
    )
    return result.values.reshape(count, length)


def exact(phase, cos_beta):
    total = 1 - np.asarray(cos_beta) / 2.0**25 * np.cos(2 * np.pi * np.asarray(phase) / TURN)
    return np.minimum(total, UNIT.RESULT_FORMAT.max_code / 2.0**25)


def assert_errors_under_bounds(phase, cos_beta):
    """Check errors near the peak and elsewhere.

    The result has the shares of the bounds that the errors reach.
    """
    error = np.abs(values(phase, cos_beta)[:, 0] - exact(phase, cos_beta))
    # The last step before 1/32 may be rounded to either side.
    near = 1 - np.abs(np.cos(2 * np.pi * phase / TURN)) < 1 / 32 - 2.0**-20
    assert error[near].max() <= UNIT.NEAR_ERROR
    assert error.max() <= UNIT.ERROR
    return error[near].max() / UNIT.NEAR_ERROR, error.max() / UNIT.ERROR


@pytest.mark.parametrize(
    "cos_beta", [0.999, *(pytest.param(share, marks=pytest.mark.long) for share in (1.0, 0.5, 0.0))]
)
def test_arithmetic_error_over_every_angle(cos_beta):
    # All values of the bits that the unit reads, with the lower bits at the middle of their range.
    phase = (np.arange(-(1 << 20), 1 << 20) << 19) + (1 << 18)
    shares = assert_errors_under_bounds(phase, int(cos_beta * 2**25))
    assert cos_beta != 0.999 or min(shares) > 0.5


def test_random_operands():
    rng = np.random.default_rng(1)
    cos_beta = rng.integers(0, (1 << 25) + 1, 300_000)
    cos_beta[::4] = 1 << 25
    assert_errors_under_bounds(rng.integers(-(1 << 39), 1 << 39, len(cos_beta)), cos_beta)


def test_gain_of_interpolation():
    phase = np.arange(-(1 << 17), 1 << 17) << 22
    width = np.pi / 1024
    drawn, interpolated = (
        np.abs(values(phase, 1 << 25, HighlightCosine(interpolated=on))[:, 0] - exact(phase, 1 << 25)).max()
        for on in (False, True)
    )
    # Half a step where the wave is steepest, plus the multiplier's rounding.
    assert 0.97 * width / 2 < drawn < width / 2 + UNIT.ERROR
    assert interpolated < drawn / 100


@pytest.mark.parametrize("bits", [4, 6, 8, 10, 12])
def test_error_of_the_table_by_its_size(bits):
    phase = np.arange(-(1 << 17), 1 << 17) << 22
    unit = HighlightCosine(address_bits=bits)
    error = np.abs(values(phase, 1 << 25, unit)[:, 0] - exact(phase, 1 << 25)).max()
    width = np.pi / 2 / (1 << bits)
    fit = 0.0858 * width**2
    assert error <= fit + UNIT.ERROR
    if bits <= 6:
        assert error >= 0.95 * fit


def test_table_fits_one_block_ram():
    table, rises = UNIT.table
    assert table.format.width + rises.format.width == 36
    assert len(table.codes) == len(rises.codes) == 512


@pytest.mark.parametrize("degrees", [0, 1e-4, 1, 45, 89.9, 90, 120, 179])
@pytest.mark.parametrize("position", [-0.7, 0.0, 0.3, 0.5, 1.0, 1.6])
@pytest.mark.parametrize("length", [2, 3, 37, 4095])
def test_stiff_spans_follow_the_great_circle(degrees, position, length):
    """Spans are compared with slerp of the normals.

    The highlight is inside the span, at its ends, and outside.
    """
    psi = np.radians(degrees)
    left, right = np.array([1.0, 0, 0]), np.array([np.cos(psi), np.sin(psi), 0])
    beta, phase = 0.3, position * psi
    halfway = np.array([np.cos(beta) * np.cos(phase), np.cos(beta) * np.sin(phase), np.sin(beta)])
    code = int(np.floor(phase / (2 * np.pi) * TURN + 0.5))
    found = values(
        (code + TURN // 2) % TURN - TURN // 2,
        int(np.cos(beta) * 2**25),
        step=int(psi / (length - 1) / (2 * np.pi) * TURN),
        length=length,
    )[0]
    normals = interpolate("slerp", left, right, np.arange(length) / (length - 1))
    # The cut of the step adds less than 2^-40 turns a pixel, and the cut of cos beta 2^-25.
    bound = UNIT.ERROR + 2.0**-25 + 2 * np.pi * (length - 1) * 2.0**-40 + 1e-9
    assert np.abs(found - (1 - normals @ halfway)).max() <= bound


def test_stiff_opposite_normals():
    """Half a turn past the pole has no plane for slerp; the accumulator goes on."""
    length = 4095
    step = round(TURN / 2 / (length - 1))
    found = values(TURN // 4, 1 << 25, step=step, length=length)[0]
    target = 1 - np.cos(np.pi / 2 - np.pi * np.arange(length) / (length - 1))
    assert np.abs(found - target).max() <= UNIT.ERROR + np.pi * length * 2.0**-40


def test_stiff_peak_narrower_than_a_pixel():
    """In 4 pixels of 179 degrees the peak lies between the two middle pixels, and neither shows it."""
    step = round(179 / 360 / 3 * TURN)
    found = values(step + step // 2, 1 << 25, step=step, length=4)[0]
    target = 1 - np.cos(2 * np.pi * step / TURN * np.array([1.5, 0.5, 0.5, 1.5]))
    assert np.abs(found - target).max() <= UNIT.ERROR
    assert found.min() > 0.1


def test_stiff_peak_on_a_pixel_is_exact_and_between_pixels_even():
    step = 1234567890
    for cos_beta in (1 << 25, 30000001, 12345):
        found = values(7 * step, cos_beta, step=step, length=15)[0]
        assert found[7] == found.min() == 1 - cos_beta / 2.0**25
        # Bits are inverted on one side of the wave, so both sides may differ by a step of the table's
        # fraction.
        assert found[:7] == pytest.approx(found[:7:-1], abs=2.0**-21)
    step = 1 << 30
    found = values(7 * step + step // 2, 1 << 25, step=step, length=16)[0]
    assert found[7] == pytest.approx(found[8], abs=2.0**-21)
    assert found[7] == pytest.approx(1 - np.cos(np.pi * step / TURN), abs=UNIT.NEAR_ERROR)


def test_stiff_equal_normals_give_one_value():
    found = values(123456789012, 20000000, step=0, length=4095)
    assert len(np.unique(found)) == 1


def test_stiff_drift_over_the_longest_span():
    """The sum is exact. Only the rounding of the step adds up, to 4094 halves of 2^-40 turns."""
    worst = 0
    for degrees in (60, 90, 179.99, 0.001):
        turns = Fraction(degrees) / 360
        step = round(turns / 4094 * TURN)
        # The circle is steepest against H a quarter turn from it.
        phase = TURN // 4 + 4094 * step
        phase = (phase + TURN // 2) % TURN - TURN // 2
        last = values(phase, 1 << 25, step=step, length=4095)[0, -1]
        drift = abs(4094 * Fraction(step, TURN) - turns)
        assert drift <= Fraction(4094, 2 * TURN)
        assert abs(last - 1) <= UNIT.ERROR
        worst = max(worst, drift)
    assert worst > Fraction(4094, 8 * TURN)
    assert 2 * np.pi * 4094 / (2 * TURN) < 1.2e-8


def test_stiff_overlong_cos_beta():
    """cos beta up to sqrt 2, as normals that differ only by rounding can give, makes no word wrap."""
    phase = np.arange(-(1 << 15), 1 << 15) << 24
    code = int(np.sqrt(2) * 2**25)
    target = np.clip(1 - np.sqrt(2) * np.cos(2 * np.pi * phase / TURN), 0, 2)
    assert np.abs(values(phase, code)[:, 0] - target).max() <= 1.42 * UNIT.ERROR


def test_refuses():
    with pytest.raises(ValueError, match=r"^address_bits must be 4 to 12, not 3$"):
        HighlightCosine(address_bits=3)
    operands = (Fixed(format, [0]) for format in (SQ(1, 39), SQ(0, 40), SQ(0, 40)))
    message = r"^operands must be SQ\(0, 40\), UQ\(0, 40\), UQ\(1, 25\), not SQ\(1, 39\)"
    with pytest.raises(ValueError, match=message):
        UNIT.compute(*operands, [0], [0])
