"""Textures: samples against a plain sum over texels, levels against means, and refused arguments."""

import math

import numpy as np
import pytest

from blysk.golden.reference.texture import WRAPS, Texture, wrapped

RNG = np.random.default_rng(2026)
IMAGE = RNG.random((4, 8, 3))


def texel(index, size, wrap):
    """Index of a texel, found by walking over the tiles of an image."""
    tile, inside = divmod(index, size)
    if wrap == "clamp":
        return 0 if tile < 0 else size - 1 if tile > 0 else inside
    return size - 1 - inside if wrap == "mirror" and tile % 2 else inside


@pytest.mark.parametrize("size", [1, 2, 8])
@pytest.mark.parametrize("wrap", WRAPS)
def test_indices_outside_the_image(wrap, size):
    index = np.arange(-3 * size - 1, 3 * size + 2)
    assert wrapped(index, size, wrap).tolist() == [texel(k, size, wrap) for k in index.tolist()]


@pytest.mark.parametrize("wrap", [("repeat", "clamp"), ("mirror", "repeat"), ("clamp", "mirror")])
def test_bilinear_is_the_sum_of_tents(wrap):
    places = RNG.uniform(-2, 3, (40, 2))
    found = Texture(IMAGE, wrap).sample(places, np.zeros(40, int))
    for (u, v), color in zip(places, found, strict=True):
        x, y, expected = 8 * u - 0.5, 4 * v - 0.5, np.zeros(3)
        for i in range(math.floor(x) - 1, math.floor(x) + 3):
            for j in range(math.floor(y) - 1, math.floor(y) + 3):
                tent = max(1 - abs(x - i), 0) * max(1 - abs(y - j), 0)
                expected += tent * IMAGE[texel(j, 4, wrap[1]), texel(i, 8, wrap[0])]
        assert color == pytest.approx(expected, abs=1e-12)


def test_nearest_is_the_texel_that_holds_the_place():
    texture = Texture(IMAGE, filter="nearest")
    assert (texture.sample([[0.126, 0.76], [-0.01, 1.01]], [0, 0]) == IMAGE[[3, 0], [1, 7]]).all()


def test_levels_are_means_down_to_one_texel():
    texture = Texture(IMAGE)
    assert [level.shape[:2] for level in texture.levels] == [(4, 8), (2, 4), (1, 2), (1, 1)]
    assert texture.levels[1][1, 2] == pytest.approx(IMAGE[2:4, 4:6].mean(axis=(0, 1)))
    assert texture.levels[3][0, 0] == pytest.approx(IMAGE.mean(axis=(0, 1)))
    assert len(Texture(IMAGE, mipmapped=False).levels) == 1


def test_level_is_the_nearest_power_of_two():
    step = np.array([0, 0.3, 1, 1.41, 1.42, 2.8, 2.9, 1e6])
    assert Texture(IMAGE).level_of(step).tolist() == [0, 0, 0, 0, 1, 1, 2, 3]
    assert Texture(IMAGE, mipmapped=False).level_of(step).tolist() == [0] * 8


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"texels": np.zeros((4, 4))}, r"texels must have shape \(height, width, 3\), not \(4, 4\)"),
        ({"texels": np.zeros((3, 4, 3))}, "a texture's sides must be powers of two to 1024, not 3"),
        ({"texels": np.full((1, 1, 3), np.nan)}, "texels must be 0 to 1"),
        ({"wrap": ("repeat", "border")}, "wrap must be two of repeat, mirror, clamp, not .*"),
        ({"filter": "cubic"}, "filter must be one of bilinear, nearest, not 'cubic'"),
    ],
)
def test_bad_arguments_are_refused(given, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        Texture(**{"texels": IMAGE} | given)
