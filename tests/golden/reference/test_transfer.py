"""The curve of sRGB: values that its standard prints, its inverse, its slope."""

import numpy as np
import pytest

from blysk.golden.reference.transfer import LARGEST_SLOPE, TRANSFERS, color_of_text, decode, encode, slope


def test_values_of_the_standard():
    """Ends, the joint of line and power, and codes of a mid grey, as tables of sRGB print them."""
    np.testing.assert_allclose(encode([0, 0.0031308, 1]), [0, 0.04045, 1], atol=1e-7)
    # A fifth of the light has the code 124, and half of the light the code 188.
    assert np.round(255 * encode([0.2, 0.5, 0.214041])).tolist() == [124, 188, 127]
    np.testing.assert_allclose(
        decode(np.array([10, 11, 128, 188]) / 255), [0.003035, 0.003347, 0.215861, 0.502886], atol=1e-6
    )


def test_decode_is_the_inverse():
    light = np.linspace(0, 1, 10_001)
    np.testing.assert_allclose(decode(encode(light)), light, atol=1e-7)
    assert np.round(255 * encode(decode(np.arange(256) / 255))).tolist() == list(range(256))
    assert np.all(np.diff(encode(light)) > 0)


def test_texts_of_colours():
    """Codes of sRGB are decoded, and numbers are linear light."""
    assert color_of_text("#ff8000") == pytest.approx([1, 0.215861, 0], abs=1e-6)
    assert color_of_text("#FFFFFF") == [1, 1, 1]
    assert color_of_text("0.5") == [0.5, 0.5, 0.5]
    assert color_of_text("0.1,2,3") == [0.1, 2, 3]
    for text in ("#ff80", "red", "#gggggg"):
        with pytest.raises(ValueError, match="could not convert"):
            color_of_text(text)


def test_values_outside_are_limited():
    for transfer in TRANSFERS:
        assert encode([-1, 2], transfer).tolist() == decode([-1, 2], transfer).tolist() == [0, 1]


def test_linear_light_stays():
    light = np.linspace(0, 1, 11)
    np.testing.assert_array_equal(encode(light, "linear"), light)
    np.testing.assert_array_equal(decode(light, "linear"), light)
    assert slope(0, "linear") == slope(1, "linear") == 1


def test_slope_is_the_largest_of_all_brighter_light():
    """The slope is compared with differences. It never rises, so the least light has the largest slope."""
    light = np.r_[np.linspace(0, 0.01, 400), np.linspace(0.011, 1, 400)]
    found = np.array([slope(x) for x in light])
    assert found[0] == LARGEST_SLOPE
    assert np.all(np.diff(found) <= 0)
    steps = np.diff(encode(light)) / np.diff(light)
    assert np.all(steps <= found[:-1] * (1 + 1e-9))
    assert np.all(steps >= found[1:] * (1 - 1e-4))


@pytest.mark.parametrize("function", [encode, decode, slope])
def test_other_transfers_are_refused(function):
    with pytest.raises(ValueError, match=r"^transfer must be one of srgb, linear, not 'gamma'$"):
        function(0.5, "gamma")
