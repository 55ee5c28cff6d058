"""Perceived differences: published colour pairs, equal pictures, and changes that an eye sees or does not
see."""

import sys

import numpy as np
import pytest

from blysk.bench.report.perception import Perceived, identical_to_the_eye, perceived
from blysk.sim.errors import InputError

# Sharma, Wu, Dalal 2005, table 1, pairs of colours within sRGB: L, a, b, L, a, b, difference.
PAIRS = [
    (50, 0, 0, 50, -1, 2, 2.3669),
    (50, 2.5, 0, 50, 0, -2.5, 4.3065),
    (50, 2.5, 0, 73, 25, -18, 27.1492),
    (50, 2.5, 0, 61, -5, 29, 22.8977),
    (50, 2.5, 0, 58, 24, 15, 19.4535),
    (50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000),
    (50, 2.5, 0, 50, 3.2972, 0, 1.0000),
    (50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000),
    (50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000),
    (60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644),
    (61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731),
    (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373),
    (36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146),
    (90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441),
    (90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381),
    (6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377),
    (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
]


def srgb(lightness, a, b):
    """An sRGB colour in LSB, from CIELAB under D65 (IEC 61966-2-1)."""
    y = (lightness + 16) / 116
    x, y, z = (
        t**3 if t > 6 / 29 else 3 * (6 / 29) ** 2 * (t - 4 / 29) for t in (y + a / 500, y, y - b / 200)
    )
    # Columns: XYZ of the primaries at xy = (0.64, 0.33), (0.30, 0.60), (0.15, 0.06), scaled so that their sum
    # is white.
    primaries = np.array([[0.64, 0.30, 0.15], [0.33, 0.60, 0.06], [0.03, 0.10, 0.79]])
    white = np.array([0.95047, 1, 1.08883])
    to_linear = np.linalg.inv(primaries * np.linalg.solve(primaries, white))
    linear = to_linear @ (white * (x, y, z))
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.abs(linear) ** (1 / 2.4) - 0.055)


def plain(color, shape=(16, 20)):
    return np.broadcast_to(np.asarray(color, dtype=np.float64), (*shape, 3))


def everywhere(picture):
    return np.ones(picture.shape[:2], dtype=bool)


@pytest.mark.parametrize("pair", PAIRS)
def test_published_colour_differences(pair):
    first, second = (plain(srgb(*color)) for color in (pair[:3], pair[3:6]))
    found = perceived(first, second, everywhere(first))
    # The library's matrix has six decimals. The matrix from the primaries is exact.
    assert found.ciede2000_max == pytest.approx(pair[6], rel=2e-4, abs=1e-3)
    assert found.ciede2000_p99 == pytest.approx(found.ciede2000_max, abs=1e-9)


def test_equal_pictures_do_not_differ():
    picture = np.random.default_rng(1).integers(0, 256, (24, 32, 3), dtype=np.uint8)
    found = perceived(picture, picture.astype(np.float64), everywhere(picture))
    assert found == Perceived(0, 0, 0, 0)
    assert identical_to_the_eye(0, found)


def test_black_is_not_white():
    black, white = plain((0, 0, 0)), plain((255, 255, 255))
    found = perceived(black, white, everywhere(black))
    # Black and white are 100 apart in CIELAB, by definition. FLIP's largest value is 1.
    assert found.ciede2000_max == pytest.approx(100, abs=1e-3)
    assert 0.9 < found.flip_p99 <= found.flip_max <= 1
    assert not identical_to_the_eye(255, found)


def ball(exponent=40):
    """A shaded ball, in LSB: its diffuse part, its highlight, and the mask of its pixels."""
    y, x = np.mgrid[-1:1:96j, -1:1:96j]
    mask = x * x + y * y < 0.95
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    diffuse = np.where(mask, 20 + 100 * z, 0)
    highlight = np.where(mask, 130 * np.maximum(0.9 * z - 0.4 * x - 0.17 * y, 0) ** exponent, 0)
    return (np.repeat(part[..., np.newaxis], 3, axis=-1) for part in (diffuse, highlight, mask))


def test_noise_of_one_step_is_not_seen():
    diffuse, highlight, mask = ball()
    exact = np.round(diffuse + highlight)
    noisy = exact + np.random.default_rng(2).integers(-1, 2, exact.shape) * mask
    found = perceived(noisy, exact, mask[..., 0])
    assert found.ciede2000_max > 0
    assert identical_to_the_eye(np.abs(noisy - exact).max(), found)


def test_a_slight_change_of_all_is_not_seen():
    """A change of more than a step is over the first limit, and FLIP and CIEDE2000 let it through."""
    diffuse, highlight, mask = ball()
    exact = diffuse + highlight
    found = perceived(exact + 1.5 * mask, exact, mask[..., 0])
    assert identical_to_the_eye(1.5, found)


def test_a_cut_highlight_is_seen():
    diffuse, highlight, mask = ball()
    cut = diffuse + np.minimum(highlight, 65)
    found = perceived(cut, diffuse + highlight, mask[..., 0])
    assert found.flip_max > 0.1
    assert not identical_to_the_eye(65, found)


def test_only_the_mask_counts():
    diffuse, _, _ = ball()
    other = diffuse.copy()
    other[:8, :8] = 255
    mask = np.zeros(diffuse.shape[:2], dtype=bool)
    mask[40:60, 40:60] = True
    assert perceived(other, diffuse, mask) == Perceived(0, 0, 0, 0)
    mask[0, 0] = True
    found = perceived(other, diffuse, mask)
    # One pixel in 401 counts only in the largest value.
    assert found.ciede2000_max > 90
    assert found.ciede2000_p99 == 0


@pytest.mark.parametrize(
    ("largest", "figures", "same"),
    [
        (1.0, (1, 1, 100, 100), True),
        (1.001, (0.05, 0.10, 1.0, 2.3), True),
        (1.001, (0.0501, 0.10, 1.0, 2.3), False),
        (1.001, (0.05, 0.1001, 1.0, 2.3), False),
        (1.001, (0.05, 0.10, 1.001, 2.3), False),
        (1.001, (0.05, 0.10, 1.0, 2.301), False),
    ],
)
def test_limits(largest, figures, same):
    assert identical_to_the_eye(largest, Perceived(*figures)) is same


def test_bad_pictures():
    picture = plain((1, 2, 3))
    with pytest.raises(ValueError, match="pictures of"):
        perceived(picture, picture[:4], everywhere(picture))
    with pytest.raises(ValueError, match="pictures of"):
        perceived(picture, picture, everywhere(picture[:4]))
    with pytest.raises(ValueError, match="at least one pixel"):
        perceived(picture, picture, np.zeros(picture.shape[:2], dtype=bool))
    with pytest.raises(ValueError, match="0 to 255"):
        perceived(picture, picture - 2, everywhere(picture))


@pytest.mark.parametrize(
    ("module", "name"), [("flip_evaluator", "flip-evaluator"), ("skimage", "scikit-image")]
)
def test_missing_library_is_one_line(monkeypatch, module, name):
    monkeypatch.setitem(sys.modules, module, None)
    picture = plain((1, 2, 3))
    with pytest.raises(InputError, match=f"{name} is not installed"):
        perceived(picture, picture, everywhere(picture))
