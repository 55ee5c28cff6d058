"""The curve of sRGB."""

import numpy as np

from blysk.golden.reference.srgb import linear_of_srgb


def test_the_curve_has_its_known_values():
    # IEC 61966-2-1: mid grey 188 is half of the light to the nearest code; both pieces meet.
    codes = np.array([0, 10, 188, 255]) / 255
    assert np.allclose(linear_of_srgb(codes), [0, 10 / 255 / 12.92, 0.502886, 1], rtol=0, atol=5e-7)
    below, above = linear_of_srgb([0.04045, np.nextafter(0.04045, 1)])
    assert 0 <= above - below < 1e-7
