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
    """The sum in Python integers, in units of 2^-23 LSB: half is added, the sum is cut and limited."""
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
    """About every channel value, half an LSB and the code below it are tried."""
    channel = np.arange(255)
    ambient = channel * 64
    for specular, expected in ((2**15, channel + 1), (2**15 - 1, channel)):
        # 2^15 of 2^17 times 2 LSB is half an LSB.
        results = [
            compute(np.full(3, a), np.zeros((1, 3), int), np.full((1, 3), 128), [[0]], [[specular]])
            for a in ambient.tolist()
        ]
        np.testing.assert_array_equal(np.array(results)[:, 0, 0], expected)


def test_stiff_sums_of_the_largest_and_smallest_codes():
    """The largest codes of every word give 255 and do not wrap.

    A single light that is eight times too bright gives the same.
    """
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
    """Every intensity of 255 channels is tried, also half-way values, with black lights and bright terms."""
    intensity = np.linspace(0, 8, 4001)
    codes = Intensity.color(intensity)
    terms = np.full((1, 16), TERM.max_code)
    black = np.zeros((16, 3), dtype=int)
    for start in range(0, 3999, 3):
        triple = slice(start, start + 3)
        expected = np.clip(np.floor(np.round(intensity[triple] * 255 * 64) / 64 + 0.5), 0, 255)
        np.testing.assert_array_equal(compute(codes[triple], black, black, terms, terms)[0], expected)


def test_stiff_coefficients_that_add_up_to_more_than_one():
    """k_a + k_d + k_s = 1.2 gives the full channel if all terms are 1. Small terms do not change."""
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
    """Cycles counted by hand: three for each term that is not 0, and three for a pixel without terms."""
    diffuse = Fixed(TERM, [[0, 0], [0, 0], [1, 0], [1, 0], [7, TERM.max_code], [0, 0]])
    specular = Fixed(TERM, [[0, 0], [0, 5], [0, 0], [1, 0], [3, TERM.max_code], [2, 2]])
    assert Intensity().cycles(diffuse, specular).tolist() == [3, 3, 3, 6, 12, 6]
    assert Intensity(channels=1).cycles(diffuse, specular).tolist() == [1, 1, 1, 2, 4, 2]


# These have an albedo.


def exact_colored(operands, albedo, emission, tinted):
    """The pixel in Python integers: the light on the surface in 64ths of an LSB, the sum in units of 2^-23
    LSB."""
    ambient, diffuse_color, specular_color, diffuse, specular, albedo, emission = (
        np.asarray(x).astype(object) for x in (*operands, albedo, emission)
    )
    light, shine = ambient * 2**17 + diffuse.dot(diffuse_color), specular.dot(specular_color)
    light = np.minimum(((light + shine if tinted else light) + 2**16) // 2**17, 2**18 - 1)
    total = light * albedo * 2 + emission * 2**17 + (0 if tinted else shine)
    return np.minimum((total + 2**22) // 2**23, 255).astype(np.uint8)


def colored(operands, albedo, emission, tinted=False, **options):
    *colors, diffuse, specular = operands
    unit = Intensity(len(colors[1]), has_albedo=True, **options)
    return unit.compute(
        *(Fixed(COLOR, color) for color in colors),
        *(Fixed(TERM, term) for term in (diffuse, specular)),
        Fixed(unit.ALBEDO_FORMAT, albedo),
        Fixed(COLOR, emission),
        tinted,
    )


def any_operands(rng, lights, largest, pixels=2000):
    return (
        rng.integers(0, largest // 2 + 1, 3),
        *rng.integers(0, largest + 1, (2, lights, 3)),
        *rng.integers(0, TERM.max_code + 1, (2, pixels, lights)),
    )


@pytest.mark.parametrize("tinted", [False, True])
@pytest.mark.parametrize(("lights", "brightness"), [(0, 8.0), (1, 1.0), (2, 0.5), (16, 8.0)])
def test_albedo_is_exact_to_both_roundings(lights, brightness, tinted):
    """With 16 lights of 8 full channels the light on the surface reaches its limit."""
    rng = np.random.default_rng([lights, tinted])
    operands = any_operands(rng, lights, int(brightness * 255 * 64))
    # The sum of the light beside the albedo still has room for the light of the surface.
    operands[2][...] >>= 8
    albedo = rng.integers(0, 1 << 16, (2000, 3), endpoint=True) >> rng.integers(0, 8, (2000, 1))
    emission = rng.integers(0, 64 * 64, 3)
    found = colored(operands, albedo, emission, tinted, tints=True)
    np.testing.assert_array_equal(found, exact_colored(operands, albedo, emission, tinted))
    assert len(np.unique(found)) > 30


@pytest.mark.parametrize("tinted", [False, True])
def test_error_of_a_colored_pixel(tinted):
    """The error against float64 is at most half an LSB, and 2^-7 LSB of the light on the surface."""
    rng = np.random.default_rng(5)
    operands = any_operands(rng, 2, 40 * 64, 20_000)
    albedo, emission = rng.integers(0, 1 << 16, (20_000, 3), endpoint=True), rng.integers(0, 20 * 64, 3)
    ambient, diffuse_color, specular_color, diffuse, specular = (np.asarray(x, float) for x in operands)
    shine, light = specular @ specular_color / 2**23, ambient / 64 + diffuse @ diffuse_color / 2**23
    light, beside = (light + shine, 0) if tinted else (light, shine)
    exact = albedo / 65536 * light + beside + emission / 64
    error = np.abs(colored(operands, albedo, emission, tinted, tints=True) - exact).max()
    assert 0.5 < error <= 0.5 + 2.0**-7


def test_white_albedo_changes_a_rounding_only():
    """With a white albedo the sum is that of a unit without albedo, rounded to 2^-6 LSB beforehand."""
    rng = np.random.default_rng(6)
    operands = any_operands(rng, 1, 120 * 64)
    found = colored(operands, np.full((2000, 3), 1 << 16), np.zeros(3, int))
    differs = np.abs(found.astype(int) - compute(*operands))
    assert differs.max() <= 1
    assert np.mean(differs) < 2.0**-6


def test_cycles_of_the_compact_style_with_albedo():
    """Cycles counted by hand: one a channel for the albedo and each term, two for the sum of a single
    channel."""
    diffuse = Fixed(TERM, [[0, 0], [0, 0], [1, 0], [1, 0], [7, TERM.max_code], [0, 0]])
    specular = Fixed(TERM, [[0, 0], [0, 5], [0, 0], [1, 0], [3, TERM.max_code], [2, 2]])
    assert Intensity(2, has_albedo=True).cycles(diffuse, specular).tolist() == [3, 6, 6, 9, 15, 9]
    single = Intensity(2, channels=1, has_albedo=True, tints=True)
    assert single.cycles(diffuse, specular).tolist() == [1, 2, 4, 5, 7, 3]
    assert single.cycles(diffuse, specular, tinted=True).tolist() == [1, 4, 4, 5, 7, 5]


def test_bad_arguments_of_an_albedo_are_refused():
    for options in ({"has_albedo": False}, {"has_albedo": True, "has_specular": False}):
        with pytest.raises(ValueError, match=r"^tints need an albedo and specular terms$"):
            Intensity(tints=True, **options)
    operands = any_operands(np.random.default_rng(1), 1, 100, 1)
    fixed = [Fixed(COLOR, color) for color in operands[:3]] + [Fixed(TERM, term) for term in operands[3:]]
    albedo, emission = Fixed(Intensity.ALBEDO_FORMAT, [[0, 0, 0]]), Fixed(COLOR, [0, 0, 0])
    for unit, further in (
        (Intensity(), (albedo,)),
        (Intensity(), (None, emission)),
        (Intensity(has_albedo=True), ()),
    ):
        with pytest.raises(ValueError, match=r"^the unit has (an|no) albedo, its operands"):
            unit.compute(*fixed, *further)
    with pytest.raises(ValueError, match=r"^the albedo must be UQ\(1, 16\), not UQ\(11, 6\)$"):
        Intensity(has_albedo=True).compute(*fixed, emission)
    with pytest.raises(ValueError, match=r"^the unit has no tints, and the material is tinted$"):
        Intensity(has_albedo=True).compute(*fixed, albedo, emission, True)
