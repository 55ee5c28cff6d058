"""Lobe unit's bit-accurate model against float64: every argument, every address, monotone terms, the end of
light."""

import itertools
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from blysk.bench.lobe_errors import CASES, largest_error
from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.golden.lighting.power import Power
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.presets import LOBES
from blysk.golden.reference.lobes import BECKMANN, COPLANAR_PHONG, GGX, TabulatedModel
from blysk.golden.reference.reflection import BLINN, PHONG, REFLECTION_MODELS

CHORD = "one_minus_cosine"
LOBE = Lobe(operand=CHORD)
SIZES = ((8, 16), (12, 16), (12, 32), (14, 32), (15, 16), (15, 32), (20, 16), (1, 2), (3, 256), (24, 2))
RISING = TabulatedModel("rising", function=lambda c: 1 - c)
TENT = TabulatedModel.of_points("tent", [0, 0.3, 0.9, 1], [0.2, 1, 0.1, 0.6])
STEP = TabulatedModel("step", function=lambda c: (c > 0.7).astype(float))
DARK = TabulatedModel("dark", function=np.zeros_like)
FULL = TabulatedModel("full", function=np.ones_like)
FALLING = (
    *((BLINN, n) for n in (1, 2, 3, 10, 100, 1000)),
    *((BECKMANN, alpha**0.5) for alpha in (0.03, 0.1, 0.3, 0.6, 0.7)),
    *((GGX, alpha**0.5) for alpha in (0.0025, 0.01, 0.03, 0.1, 0.3, 0.6, 1)),
    *((COPLANAR_PHONG, p) for p in (1, 250)),
    *((model, None) for model in (STEP, DARK, FULL)),
    (REFLECTION_MODELS["cosquad"], 20),
)


def pieces(fraction_bits=25, length=1 << 21):
    """Every code of u under 1, in pieces."""
    for start in range(0, 1 << fraction_bits, length):
        yield np.arange(start, min(start + length, 1 << fraction_bits))


def shade(lobe, codes, table, dark=False):
    codes = np.asarray(codes)
    return lobe.compute(Fixed(lobe.operand_format, codes), np.full(codes.shape, dark), table)


def some_codes(lobe, rng, count=20_000):
    """Codes of u under 1: the ends of every step, and random codes, as many in each octave."""
    one = 1 << lobe.fraction_bits
    knots = np.ldexp(lobe.knots, lobe.fraction_bits).astype(np.int64)
    others = (one * 2.0 ** -rng.uniform(0, lobe.fraction_bits, count)).astype(np.int64)
    return np.unique(np.r_[knots[:-1], knots[1:] - 1, others, 0, one - 1])


@pytest.mark.long
@pytest.mark.parametrize(("octaves", "steps"), [(20, 16), (3, 256), *SIZES[:6], *SIZES[-1:]])
def test_address_of_every_argument(octaves, steps):
    """By the definition: the last entry at or before u, and the cut share of the way to the next entry."""
    lobe = Lobe(operand=CHORD, octaves=octaves, steps=steps)
    assert lobe.entries == (octaves + 1) * steps == len(lobe.knots) - 1
    knots = np.ldexp(lobe.knots, 25)
    assert (knots == np.rint(knots)).all()
    assert knots[0] == 0
    assert knots[-1] == 1 << 25
    # Relative distances are between 1/(2M) and 1/M, except in row 0.
    distance = np.diff(knots)
    assert (distance[steps:] <= knots[steps:-1] / steps).all()
    assert (distance[steps:] > knots[steps:-1] / (2 * steps)).all()
    assert (distance[:steps] == 2.0 ** (25 - octaves) / steps).all()
    bits = lobe.fraction_format.width
    for codes in pieces():
        entry, fraction = lobe.address(Fixed(UQ(1, 25), codes))
        np.testing.assert_array_equal(entry, np.searchsorted(knots, codes, side="right") - 1)
        share = (codes - knots[entry]) / distance[entry]
        np.testing.assert_array_equal(fraction.codes, np.floor(share * 2.0**bits))


@pytest.mark.parametrize("fraction_bits", [20, 25, 30, 34])
def test_address_with_other_fraction_bits(fraction_bits):
    lobe = Lobe(operand=CHORD, octaves=fraction_bits - 5, steps=32, fraction_bits=fraction_bits)
    codes = some_codes(lobe, np.random.default_rng(fraction_bits), 100_000)
    entry, fraction = lobe.address(Fixed(lobe.argument_format, codes))
    exact = [Fraction(code, 1 << fraction_bits) for code in codes[::97].tolist()]
    for u, k, f in zip(exact, entry[::97].tolist(), fraction[::97].codes.tolist(), strict=True):
        start, end = (Fraction(knot) for knot in lobe.knots[k : k + 2].tolist())
        assert start <= u < end
        assert f == (u - start) / (end - start) * 2**lobe.fraction_format.width // 1


@pytest.mark.parametrize(("octaves", "steps"), SIZES)
def test_falls_at_every_address(octaves, steps):
    """Every entry is at most the entry before. The last term of a word is not under the next entry."""
    for (model, parameter), cutoff in itertools.product(FALLING, (0, 2.0**-14, 0.01)):
        lobe = Lobe(model, CHORD, octaves, steps, cutoff=cutoff)
        table = lobe.table(parameter)
        assert (table.differences.codes <= 0).all()
        assert table.values.codes.min() >= 0
        last = np.ldexp(lobe.knots[1:], 25).astype(np.int64) - 1
        terms, first = (shade(lobe, codes, table).codes for codes in (last, np.r_[0, last[:-1] + 1]))
        np.testing.assert_array_equal(first, table.values.codes[:-1])
        assert (terms >= table.values.codes[1:]).all()
        assert (terms <= first).all()


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "parameter"), [(BLINN, 10), (BLINN, 1000), (BECKMANN, 0.3), (GGX, 0.05), (GGX, 0.9)]
)
def test_every_argument(model, parameter):
    """Terms fall over all 2^25 values of u.

    Their errors exceed those of samples by at most a step of 2^-17.
    """
    lobe = replace(LOBE, reflection=model)
    table, before, worst = lobe.table(parameter), 1 << 17, 0.0
    for codes in pieces():
        terms = shade(lobe, codes, table)
        assert terms.codes[0] <= before
        assert (np.diff(terms.codes) <= 0).all()
        before = terms.codes[-1]
        worst = max(worst, np.abs(terms.values - model.reflect(1 - codes * 2.0**-25, parameter)).max())
    sampled = largest_error(lobe, parameter)
    assert sampled <= 255 * worst <= 0.05
    assert 255 * worst <= sampled + 255 * 2.0**-17


@pytest.mark.parametrize(
    ("model", "parameter"), [*FALLING, (RISING, None), (TENT, None), (BECKMANN, 0.95), (BECKMANN, 1)]
)
@pytest.mark.parametrize(("octaves", "steps", "fraction_bits"), [(20, 16, 25), (12, 32, 25), (20, 16, 30)])
def test_arithmetic_error(model, parameter, octaves, steps, fraction_bits):
    """The model is compared with straight lines between the table's entries, and these with lines between
    entries that are not rounded."""
    lobe = Lobe(model, CHORD, octaves, steps, fraction_bits=fraction_bits)
    table = lobe.table(parameter)
    codes = some_codes(lobe, np.random.default_rng(1))
    line = np.interp(codes * 2.0**-fraction_bits, lobe.knots, table.values.values)
    off = shade(lobe, codes, table).values - line
    steepest = np.abs(table.differences.values).max()
    assert off.min() >= -(2.0**-17) - (steepest * 2.0**-17 if model in (RISING, TENT, BECKMANN) else 0)
    assert off.max() <= steepest * 2.0**-17
    assert np.abs(off).max() + 2.0**-17 <= Lobe.ERROR


# Largest errors in LSB. The first four sizes have those of float64 with entries on the curve, rounded to 16
# bits.
BOUNDS = {
    (8, 16): (
        (0.005, 0.07, 0.07, 0.06, 1.68),
        (7.2, 0.07, 0.07, 0.11, None),
        (None, 142, 24, 5.1, 0.41, 0.04, 0.04),
    ),
    (12, 16): (
        (0.005, 0.07, 0.07, 0.06, 0.06),
        (0.06, 0.06, 0.07, 0.11, None),
        (None, 10.5, 0.21, 0.04, 0.04, 0.04, 0.04),
    ),
    (12, 32): (
        (0.005, 0.02, 0.02, 0.02, 0.02),
        (0.02, 0.02, 0.02, 0.03, None),
        (None, 3.4, 0.05, 0.01, 0.01, 0.01, 0.01),
    ),
    (14, 32): (
        (0.005, 0.02, 0.02, 0.02, 0.02),
        (0.02, 0.02, 0.02, 0.03, None),
        (None, 0.26, 0.01, 0.01, 0.01, 0.01, 0.01),
    ),
    (20, 16): (
        (0.005, 0.05, 0.04, 0.04, 0.04),
        (0.04, 0.04, 0.04, 0.06, None),
        (0.04, 0.03, 0.03, 0.03, 0.03, 0.03, 0.03),
    ),
}


@pytest.mark.parametrize("size", BOUNDS)
def test_errors_by_size_and_lobe(size):
    for case, bounds in zip(CASES, BOUNDS[size], strict=True):
        for value, bound in zip(case.values, bounds, strict=False):
            error = largest_error(Lobe(case.reflection, CHORD, *size), case.parameter(value))
            assert bound is None or error <= bound, f"{case.reflection.name} {value}"
            assert error > 0.001


def test_moved_entries_halve_the_error():
    """Moved entries are compared with entries on the curve, which have the error of the lines, C / (8
    M^2)."""
    for case, largest in zip(CASES[::2], (4 * np.exp(-2), 3 / 8), strict=True):
        for value in (100, 1000) if case.reflection is BLINN else (0.01, 0.1):
            lobe, parameter = replace(LOBE, reflection=case.reflection), case.parameter(value)
            plain = lobe.reflection.reflect(1 - lobe.knots, parameter)
            u = np.linspace(lobe.knots[:-1], lobe.knots[1:], 65)
            off = np.interp(u, lobe.knots, plain) - lobe.reflection.reflect(1 - u, parameter)
            assert off.max() <= largest / (8 * 16**2)
            assert off.max() > 0.8 * largest / (8 * 16**2)
            assert largest_error(lobe, parameter) / 255 <= 0.55 * off.max() + Lobe.ERROR


def test_error_at_every_exponent():
    """The error is at most 0.05 LSB, at n = 2, and at most 0.04 LSB from n = 5 on."""
    errors = np.array([largest_error(LOBE, exponent, 16) for exponent in range(1, 1001)])
    assert np.argmax(errors) == 1
    assert errors[1] <= 0.05
    assert errors[4:].max() <= 0.04


def test_error_of_coplanar_phong_at_every_exponent():
    """With the size that `LOBES` gives it, a step begins beside the kink of exponent 1."""
    lobe = replace(LOBES["phong_coplanar"], operand=CHORD)
    assert max(largest_error(lobe, exponent, 16) for exponent in range(1, 1001, 3)) <= 0.06


def test_error_of_ggx_at_every_roughness():
    lobe = replace(LOBE, reflection=GGX)
    assert max(largest_error(lobe, roughness, 16) for roughness in np.linspace(0.05, 1, 191)) <= 0.036


def test_cosine_operand():
    """The term differs from that of the same u by the step of the argument and 2^-16 of u, times the
    slope."""
    for model, parameter, slope in ((BLINN, 1, 1), (BLINN, 100, 100), (BLINN, 1000, 1000), (GGX, 0.3, 494)):
        lobe = Lobe(model)
        table = lobe.table(parameter)
        u = np.r_[np.linspace(0, 1, 50_001), np.geomspace(2.0**-30, 1, 50_001)]
        codes = np.floor(ONE_SQUARED.codes * (1 - u)).astype(np.int64)
        exact = lobe.reflection.reflect(codes / ONE_SQUARED.codes, parameter)
        terms = shade(lobe, codes, table)
        chord = 255 * Lobe.ERROR + largest_error(replace(lobe, operand=CHORD), parameter)
        bound = chord / 255 + slope * 2.0**-25 + 0.4 * 2.0**-16
        # The last half step of 2^-16 is missing, because u in units of `ONE_SQUARED` never reaches 1.
        front = codes > 0
        assert np.abs(terms.values - exact)[front].max() <= bound
        order = np.argsort(codes)
        assert (np.diff(terms.codes[order]) >= 0).all()


@pytest.mark.parametrize("operand", ["cosine", CHORD])
@pytest.mark.parametrize("model", [FULL, TENT, BLINN])
def test_out_of_range(operand, model):
    """The term is 0 from u = 1 on and for dark beats. A negative u counts as 0."""
    lobe = Lobe(model, operand)
    table, format, one = lobe.table(1), lobe.operand_format, ONE_SQUARED.codes.item()
    beyond = [format.max_code, format.max_code - 1, 1 << 25, (1 << 25) + 1]
    if operand == "cosine":
        beyond = [format.min_code, -one, -1, 0, one - (1 << 34), one - (1 << 34) - 1]
        above = [one + 1, one + 10**6, format.max_code]
        assert (shade(lobe, above, table).codes == shade(lobe, one, table).codes).all()
    assert not shade(lobe, beyond, table).codes.any()
    peak, right_angle = (one, 0) if operand == "cosine" else (0, 1 << 25)
    assert shade(lobe, peak, table).codes == table.values.codes[0] > 0
    assert not shade(lobe, right_angle, table).codes
    before = shade(lobe, 1 if operand == "cosine" else right_angle - 1, table).codes
    assert (before > 2**14) == (model is not BLINN)
    assert not shade(lobe, [peak, right_angle], table, dark=True).codes.any()


def test_entry_of_one():
    """A curve that is 1 everywhere gives ``1 - 2^-17`` up to its end, and 0 from there on."""
    table = replace(LOBE, reflection=FULL).table()
    assert (shade(LOBE, [0, 1, 1 << 24, (1 << 25) - 1], table).codes == 2**17 - 1).all()
    assert shade(LOBE, 1 << 25, table).codes == 0


def test_rises_where_the_curve_rises():
    lobe = replace(LOBE, reflection=RISING)
    terms = shade(lobe, some_codes(lobe, np.random.default_rng(2)), lobe.table()).codes
    assert (np.diff(terms) >= 0).all()
    # For a curve of both kinds no term of a word is outside of its two entries.
    lobe = replace(LOBE, reflection=TENT)
    table, codes = lobe.table(), some_codes(lobe, np.random.default_rng(3))
    entry, _ = lobe.address(Fixed(UQ(1, 25), codes))
    ends = table.values.codes[entry], table.values.codes[entry + 1]
    terms = shade(lobe, codes, table).codes
    assert (terms >= np.minimum(*ends)).all()
    assert (terms <= np.maximum(*ends)).all()


def test_steps_and_kinks_do_not_move_their_neighbours():
    """If a curve jumps, or bends, at a place, the rest of the table still follows the curve."""
    for model in (STEP, TENT):
        lobe = replace(LOBE, reflection=model)
        off = np.abs(lobe.table().values.values - model.reflect(1 - np.minimum(lobe.knots, 1 - 2.0**-40)))
        assert (off > 2.0**-17).sum() <= 4


@pytest.mark.parametrize(
    "lobe", [LOBE, replace(LOBE, octaves=6, steps=4), replace(LOBE, octaves=1, steps=256)]
)
@pytest.mark.parametrize("cutoff", [0, 2.0**-14, 1 / 510])
@pytest.mark.parametrize(
    ("model", "parameter"), [*FALLING[:-1:2], (RISING, None), (TENT, None), (STEP, None), (DARK, None)]
)
def test_last_lit_argument(model, parameter, cutoff, lobe):
    """The last lit argument is exact: its term is over 0, and the terms of all larger arguments are 0."""
    lobe = replace(lobe, reflection=model, cutoff=cutoff)
    table = lobe.table(parameter)
    last = table.last_lit_argument
    assert -1 <= last < 1 << 25
    assert last < 0 or shade(lobe, last, table).codes > 0
    assert (last < 0) == (model is DARK)
    codes = np.r_[
        np.arange(last + 1, min(last + 200_000, 1 << 25)), some_codes(lobe, np.random.default_rng(4))
    ]
    assert not shade(lobe, codes[codes > last], table).codes.any()


@pytest.mark.parametrize("fraction_bits", [20, 22, 28, 34])
def test_last_lit_argument_with_other_fraction_bits(fraction_bits):
    """In steps of 2^-25, this argument has a term and the next argument has none."""
    for exponent in (3, 77, 1000):
        lobe = Lobe(BLINN, CHORD, 15, 16, fraction_bits=fraction_bits)
        table = lobe.table(exponent)
        codes = some_codes(lobe, np.random.default_rng(5))
        last = table.last_lit_argument
        scale = 2.0 ** (25 - fraction_bits)
        assert not shade(lobe, codes[codes * scale >= last + 1], table).codes.any()
        edge = int(np.ceil((last + 1) / scale)) - 1
        assert shade(lobe, np.arange(max(edge - 2**10, 0), edge + 1), table).codes.any()


def test_last_lit_arguments_by_exponent():
    """They are those of the power by products, which ends at 2^-17. Here half of 2^-17 is rounded up."""
    arguments = LOBE.last_lit_arguments
    assert arguments.shape == (1024,)
    assert (np.diff(arguments[1:]) <= 0).all()
    for exponent in (1, 2, 20, 1000):
        assert arguments[exponent] == LOBE.table(exponent).last_lit_argument
        exact = -np.expm1(-18 * np.log(2) / exponent) * 2**25
        assert arguments[exponent] == pytest.approx(exact, rel=0.07)
    assert (arguments[1:] <= 1.06 * Power(CHORD).last_lit_arguments[1:]).all()
    with pytest.raises(
        ValueError, match=r"^ggx has no exponent, by which a gate could look up its threshold$"
    ):
        _ = replace(LOBE, reflection=GGX).last_lit_arguments


def test_long_tails_end_where_they_are_cut():
    """From alpha = 0.044 on ggx is over 0 up to a right angle. A cutoff of half an LSB ends it earlier."""
    right_angle = (1 << 25) - 1
    for alpha, reaches in ((0.04, False), (0.045, True), (0.3, True)):
        lobe = replace(LOBE, reflection=GGX)
        table = lobe.table(alpha**0.5)
        assert (table.last_lit_argument == right_angle) == reaches
    for intensity in (1, 8):
        cutoff = 1 / (510 * intensity)
        table = replace(lobe, cutoff=cutoff).table(0.1**0.5)
        last = table.last_lit_argument
        assert (last < right_angle / 3) == (intensity == 1)
        codes = some_codes(lobe, np.random.default_rng(6))
        off = shade(lobe, codes, lobe.table(0.1**0.5)).values - shade(lobe, codes, table).values
        assert off.min() >= 0
        assert off.max() <= cutoff


def test_words_and_writes():
    lobe = replace(LOBE, banks=5)
    for model in (BLINN, TENT):
        table = replace(lobe, reflection=model).table(20)
        value, difference = table.words & 0x1FFFF, table.words >> 17
        difference -= (difference >> 17) << 18
        np.testing.assert_array_equal(value, table.values.codes[:-1])
        np.testing.assert_array_equal(value + difference, table.values.codes[1:])
        assert table.words.max() < 1 << Lobe.WORD_BITS == 1 << 35
        writes = table.writes(3)
        assert len(writes["value"]) == lobe.entries + 2 == 338
        assert writes["value"][0] == 3
        assert writes["begins"].tolist() == [1] + 337 * [0]
        np.testing.assert_array_equal(writes["value"][1:], table.values.codes)
        assert writes["value"].max() < 1 << 17


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"reflection": PHONG},
            r"^a table holds a lobe of N·H, but phong has R·V; take phong_coplanar$",
        ),
        ({"operand": "angle"}, r"^operand must be 'cosine' or 'one_minus_cosine', not 'angle'$"),
        ({"octaves": 0}, r"^octaves must be 1 to 21 with 16 steps and 25 fraction bits, not 0$"),
        ({"octaves": 22}, r"^octaves must be 1 to 21 with 16 steps and 25 fraction bits, not 22$"),
        ({"steps": 12}, r"^steps must be a power of two from 2 to 256, not 12$"),
        ({"steps": 1}, r"^steps must be a power of two from 2 to 256, not 1$"),
        ({"banks": 0}, r"^banks must be 1 to 64, not 0$"),
        ({"banks": 65}, r"^banks must be 1 to 64, not 65$"),
        ({"fraction_bits": 35}, r"^fraction_bits must be 20 to 34, not 35$"),
        ({"cutoff": -0.1}, r"^cutoff must be at least 0 and under 1, not -0.1$"),
        ({"cutoff": 1}, r"^cutoff must be at least 0 and under 1, not 1$"),
        ({"fixed": (20, 30)}, r"^2 tables are fixed, of 1 banks$"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Lobe(**options)


def test_bad_arguments_are_refused():
    table = LOBE.table(20)
    with pytest.raises(ValueError, match=r"^operand must be UQ\(1, 25\), not SQ\(2, 34\)$"):
        LOBE.compute(ONE_SQUARED, np.array(False), table)
    other = replace(LOBE, octaves=8)
    with pytest.raises(ValueError, match=r"^the table has 20 octaves of 16 steps, the unit 8 of 16$"):
        shade(other, 0, table)
    with pytest.raises(ValueError, match=r"^a table of blinn needs its exponent$"):
        LOBE.table()
    with pytest.raises(ValueError, match=r"^a table of ggx needs its roughness$"):
        replace(LOBE, reflection=GGX).table()
    with pytest.raises(ValueError, match=r"^roughness must be greater than 0 and at most 1, not 20"):
        replace(LOBE, reflection=GGX).table(20)
    with pytest.raises(ValueError, match=r"^a lobe needs a table; constants_of gives"):
        shade(LOBE, 0, 20)
    with pytest.raises(ValueError, match=r"^bank must be 0 to 0, not 1$"):
        table.writes(1)
    with pytest.raises(
        ValueError, match=r"^a table has 337 values of UQ\(0, 17\), not \(336,\) of UQ\(0, 17\)$"
    ):
        LobeTable(LOBE, table.values[1:])


def test_octaves_keep_narrow_lobes_that_equal_steps_lose():
    """The figures of docs/guide/pica200.md: 256 values of 12 bits in equal steps of N·H, and the table."""
    lobe = Lobe(BLINN, operand="one_minus_cosine")
    code = np.unique(np.r_[np.arange(1 << 14), 2 ** np.linspace(0, 25, 50_000)].astype(np.int64))[:-1]
    operand = Fixed(lobe.operand_format, code)
    cosine, knots, found = 1 - operand.values, np.arange(257) / 256, []
    for exponent in (10, 50, 100, 1000):
        exact, values = cosine**exponent, np.round(knots**exponent * 4096) / 4096
        values[:256] = np.minimum(values[:256], 4095 / 4096)
        ours = lobe.compute(operand, np.zeros(len(code), dtype=bool), lobe.table(exponent)).values
        errors = np.abs([np.interp(cosine, knots, values) - exact, ours - exact]).max(axis=1)
        found.append((255 * errors).tolist())
    equal, octaves = np.transpose(found)
    assert equal == pytest.approx([0.06, 1.1, 4.0, 103], rel=0.1)
    assert octaves.max() < 0.04
