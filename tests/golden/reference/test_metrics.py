import math

import numpy as np
import pytest

from blysk.golden.reference.metrics import error_figures, mnse_published, nmse


def test_by_hand():
    reference = np.full((10, 100, 3), 100.0)
    image = reference.copy()
    image[3, 7, 1] += 6
    image[4, 4, 0] -= 8
    figures = error_figures(image, reference)
    assert figures.max_lsb == 8
    # Of 3000 sorted errors the 99.9th percentile lies at index 2996.001, among the zeros.
    assert figures.p999_lsb == 0
    assert figures.rmse_lsb == pytest.approx(math.sqrt(100 / 3000), rel=1e-15)
    assert figures.psnr_db == pytest.approx(10 * math.log10(255**2 / (100 / 3000)), rel=1e-12)


def test_percentile_is_between_neighbours():
    # Of 1001 errors from 0 to 1000 the 99.9th percentile is the error at index 999.
    image = np.arange(1001.0).reshape(7, 143)
    assert error_figures(image, np.zeros((7, 143))).p999_lsb == pytest.approx(999, rel=1e-12)


def test_mask_counts_only_its_pixels():
    reference = np.zeros((4, 4, 3))
    image = reference.copy()
    image[0, 0] = 3
    image[3, 3] = 200
    mask = np.zeros((4, 4), dtype=bool)
    mask[0, :2] = True
    figures = error_figures(image, reference, mask)
    assert figures.max_lsb == 3
    assert figures.rmse_lsb == pytest.approx(math.sqrt(9 / 2))


def test_equal_images_and_unsigned_types():
    image = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    figures = error_figures(image, image.astype(np.float64))
    assert (figures.max_lsb, figures.rmse_lsb, figures.psnr_db) == (0, 0, math.inf)
    # 0 - 1 must not wrap to 255.
    assert error_figures(np.zeros((1, 1), np.uint8), np.ones((1, 1), np.uint8)).max_lsb == 1


def test_normalised_errors():
    reference = np.array([[0.0, 2.0, 4.0, 6.0]])
    image = np.array([[1.0, 2.0, 4.0, 4.0]])
    assert nmse(image, reference) == pytest.approx((1 + 4) / (9 + 1 + 1 + 9))
    value, share = mnse_published(image, reference)
    assert value == pytest.approx((1 / 9 + 0 + 0 + 4 / 9) / 4)
    assert share == 1
    # The middle value is the mean, where the printed form is undefined.
    value, share = mnse_published(np.array([1.0, 3.0, 3.0]), np.array([0.0, 2.0, 4.0]))
    assert value == pytest.approx((1 / 4 + 1 / 4) / 2)
    assert share == pytest.approx(2 / 3)


def test_scale_changes_no_normalised_error():
    rng = np.random.default_rng(11)
    image, reference = rng.uniform(size=(2, 20, 30, 3))
    assert nmse(255 * image, 255 * reference) == pytest.approx(nmse(image, reference), rel=1e-12)


@pytest.mark.parametrize("level", [0.0, 0.1, 77.3])
def test_flat_reference(level):
    flat = np.full((33, 31, 3), level)
    assert nmse(flat, flat) == 0
    assert nmse(flat + 1, flat) == math.inf
    value, share = mnse_published(flat + 1, flat)
    assert math.isnan(value)
    assert share == 0


def test_refusals():
    with pytest.raises(ValueError, match=r"one shape, not \(2, 2\) and \(2, 3\)"):
        error_figures(np.zeros((2, 2)), np.zeros((2, 3)))
    with pytest.raises(ValueError, match="the mask must hold at least one pixel"):
        error_figures(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 2), bool))
    with pytest.raises(ValueError, match=r"the mask must have shape \(2, 2\), not \(3,\)"):
        error_figures(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(3, bool))
    with pytest.raises(ValueError, match="the images must have at least one pixel"):
        nmse(np.zeros((0, 3)), np.zeros((0, 3)))
