"""Model of the intensity unit against exact integers of any size."""

import numpy as np
import pytest

from blysk.golden.lighting.intensity import MAX_LIGHTS, Intensity
from blysk.golden.number.fixed import UQ, Fixed

COLOR, TERM = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT


def compute(ambient, diffuse_color, specular_color, diffuse, specular, fraction_bits=0):
    return Intensity(len(diffuse_color), fraction_bits=fraction_bits).compute(
        *(Fixed(COLOR, color) for color in (ambient, diffuse_color, specular_color)),
        *(Fixed(TERM, term) for term in (diffuse, specular)),
    )


def exact(ambient, diffuse_color, specular_color, diffuse, specular, fraction_bits=0):
    """Python integers, in units of 2^-23 LSB: half added, cut, limited."""
    ambient, diffuse_color, specular_color, diffuse, specular = (
        np.asarray(x).astype(object) for x in (ambient, diffuse_color, specular_color, diffuse, specular)
    )
    total = ambient * 2**17 + diffuse.dot(diffuse_color) + specular.dot(specular_color)
    cut = 23 - fraction_bits
    return np.minimum((total + (1 << cut - 1)) >> cut, (256 << fraction_bits) - 1).astype(np.uint16)


@pytest.mark.parametrize("lights", [1, 2, 7, 16])
@pytest.mark.parametrize("brightness", [0.5, 1.0, 8.0])
def test_is_exact_to_the_last_rounding(lights, brightness):
    rng = np.random.default_rng(lights)
    largest = int(brightness * 255 * 64 / (1 if brightness > 1 else lights))
    operands = (
        rng.integers(0, largest // 2 + 1, 3),
        *rng.integers(0, largest + 1, (2, lights, 3)),
        *rng.integers(0, TERM.max_code + 1, (2, 2000, lights)),
    )
    result = compute(*operands)
    assert result.dtype == np.uint8
    np.testing.assert_array_equal(result, exact(*operands))
    finer = compute(*operands, fraction_bits=6)
    assert finer.dtype == np.uint16
    np.testing.assert_array_equal(finer, exact(*operands, fraction_bits=6))
    assert len(np.unique(result)) > (30 if brightness < 8 else 0)


def test_halves_round_up():
    """A half LSB, and the code below it, about every channel value."""
    channel = np.arange(255)
    ambient = channel * 64
    for specular, expected in ((2**15, channel + 1), (2**15 - 1, channel)):
        # 2^15 of 2^17 times 2 LSB is a half.
        results = [
            compute(np.full(3, a), np.zeros((1, 3), int), np.full((1, 3), 128), [[0]], [[specular]])
            for a in ambient.tolist()
        ]
        np.testing.assert_array_equal(np.array(results)[:, 0, 0], expected)


def test_stiff_sums_of_the_largest_and_smallest_codes():
    """The largest codes of every word: 255, and no wrap; the same of one light eight times too bright."""
    color, term = COLOR.max_code, TERM.max_code
    for lights in (1, 16):
        colors, terms = np.full((lights, 3), color), np.full((4, lights), term)
        terms[1:3] = 0
        terms[3, 1:] = 0
        result = compute(np.full(3, color), colors, colors, terms, terms)
        np.testing.assert_array_equal(result, 255)
        dark = compute(np.zeros(3, int), colors, colors, terms, terms)
        np.testing.assert_array_equal(dark, np.where(terms.any(axis=1), 255, 0)[:, np.newaxis] * np.ones(3))


def test_ambient_only():
    """Every intensity of 255 channels, half-way values too, with black lights and bright terms."""
    intensity = np.linspace(0, 8, 4001)
    codes = Intensity.color(intensity)
    terms = np.full((1, 16), TERM.max_code)
    black = np.zeros((16, 3), dtype=int)
    for start in range(0, 3999, 3):
        triple = slice(start, start + 3)
        expected = np.clip(np.floor(np.round(intensity[triple] * 255 * 64) / 64 + 0.5), 0, 255)
        np.testing.assert_array_equal(compute(codes[triple], black, black, terms, terms)[0], expected)


def test_stiff_coefficients_that_add_up_to_more_than_one():
    """k_a + k_d + k_s = 1.2: the full channel where all terms are 1, unchanged where they are small."""
    ambient, diffuse, specular = (Intensity.color(np.full(3, k)) for k in (0.1, 0.6, 0.5))
    terms = np.array([[TERM.max_code], [2**16], [0]])
    result = compute(ambient, diffuse[np.newaxis], specular[np.newaxis], terms, terms)
    np.testing.assert_array_equal(result[:, 0], [255, round(255 * (0.1 + 0.55)), round(25.5 + 0.01)])


def test_color_is_rounded_to_a_128th_of_an_lsb():
    rng = np.random.default_rng(1)
    intensity = np.r_[0, 1, 8, rng.uniform(0, 8, 100_000)]
    error = np.abs(Intensity.color(intensity) / 64 - intensity * 255)
    assert 0.9 * 2.0**-7 < error.max() <= 2.0**-7
    assert Intensity.color(np.array([0, 1, 8])).tolist() == [0, 255 * 64, 8 * 255 * 64]


@pytest.mark.parametrize("intensity", [-1e-9, 8.0000001, np.nan, np.inf])
def test_other_intensities_are_refused(intensity):
    with pytest.raises(ValueError, match=r"^the intensity of a term must be 0 to 8$"):
        Intensity.color([0.5, intensity])


def test_bad_arguments_are_refused():
    for lights in (-1, MAX_LIGHTS + 1):
        with pytest.raises(ValueError, match=rf"^lights must be 0 to 16, not {lights}$"):
            Intensity(lights)
    with pytest.raises(ValueError, match=r"^channels must be 1 or 3, not 2$"):
        Intensity(channels=2)
    with pytest.raises(ValueError, match=r"^fraction_bits must be 0 or 6, not 5$"):
        Intensity(fraction_bits=5)
    ambient, color, term = Fixed(COLOR, [0, 0, 0]), Fixed(COLOR, [[0, 0, 0]]), Fixed(TERM, [[0]])
    other = Fixed(UQ(12, 5), [[0, 0, 0]])
    for colors in ((other, color, color), (ambient, other, color), (ambient, color, other)):
        with pytest.raises(ValueError, match=r"^colour operands must be UQ\(11, 6\), not UQ\(12, 5\)$"):
            Intensity().compute(*colors, term, term)
    for terms in ((other, term), (term, other)):
        with pytest.raises(ValueError, match=r"^terms must be UQ\(0, 17\), not UQ\(12, 5\)$"):
            Intensity().compute(ambient, color, color, *terms)


def test_clocks_of_the_compact_style():
    """Three for each term that is not 0, three for a pixel without any; by hand."""
    diffuse = Fixed(TERM, [[0, 0], [0, 0], [1, 0], [1, 0], [7, TERM.max_code], [0, 0]])
    specular = Fixed(TERM, [[0, 0], [0, 5], [0, 0], [1, 0], [3, TERM.max_code], [2, 2]])
    assert Intensity().cycles(diffuse, specular).tolist() == [3, 3, 3, 6, 12, 6]
    assert Intensity(channels=1).cycles(diffuse, specular).tolist() == [1, 1, 1, 2, 4, 2]
