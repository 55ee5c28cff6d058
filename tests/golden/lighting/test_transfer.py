"""Model of the transfer unit against float64, for every input."""

import numpy as np
import pytest

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.transfer import Transfer
from blysk.golden.number.fixed import UQ, Fixed

INPUTS = np.arange(1 << 14)


def exact(light):
    """A second implementation of the curve: codes of light in LSB, before rounding."""
    share = np.minimum(np.asarray(light) / 255, 1)
    return 255 * np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)


@pytest.fixture(scope="module")
def codes():
    return Transfer().compute(Fixed(UQ(8, 6), INPUTS)).astype(int)


def test_every_input_is_correctly_rounded(codes):
    """The table adds no error to the half of the rounding.

    Both ends are right, and no step falls or rises by two codes.
    """
    error = np.abs(codes - exact(INPUTS / 64))
    assert 0.499 < error.max() <= 0.5
    assert (codes[0], codes[255 * 64], codes[-1]) == (0, 255, 255)
    assert set(np.diff(codes)) == {0, 1}
    assert Transfer().words.shape == (1024,)


def test_a_dark_gradient_steps_by_one_code_at_most():
    """From black to 10 LSB of light in steps of 1/4096 LSB, the intensity unit keeps the bits that the curve
    needs."""
    light = np.arange(10 * 4096) * 2.0**-12
    unit = Intensity(1, fraction_bits=6)
    color = np.full((1, 3), 10 * 64)
    diffuse = Fixed(Intensity.TERM_FORMAT, np.round(light / 10 * 2**17).astype(int)[:, np.newaxis])
    operands = (Fixed(Intensity.COLOR_FORMAT, of) for of in (np.zeros(3, int), color, color))
    levels = unit.compute(*operands, diffuse, Fixed(diffuse.format, 0 * diffuse.codes))
    assert levels.dtype == np.uint16
    red = Transfer().compute(Fixed(UQ(8, 6), levels[:, 0].astype(np.int64))).astype(int)
    assert set(np.diff(red)) == {0, 1}
    # 1/128 LSB of rounded light is a tenth of a code at black.
    assert np.abs(red - exact(light)).max() <= 0.5 + 12.92 * 1.01 / 128


def test_other_operands_are_refused():
    with pytest.raises(ValueError, match=r"^the operand must be UQ\(8, 6\), not UQ\(8, 0\)$"):
        Transfer().compute(Fixed(UQ(8, 0), [1]))
