"""Every operation of the NumPy model against exact rational arithmetic, by exhaustion of short words."""

import operator
from fractions import Fraction
from itertools import product
from math import floor

import numpy as np
import pytest

from blysk.golden.number.fixed import SQ, UQ, Fixed, Format

SMALL = [
    *(SQ(*bits) for bits in ((1, 0), (1, 3), (3, -1), (2, 2), (-1, 4))),
    *(UQ(*bits) for bits in ((0, 1), (0, 4), (2, 1), (3, -1), (-2, 5))),
]


def every(format: Format) -> Fixed:
    return Fixed(format, np.arange(format.min_code, format.max_code + 1))


def exact(fixed: Fixed) -> list[Fraction]:
    return [Fraction(int(code)) / Fraction(2) ** fixed.format.fraction_bits for code in fixed.codes.ravel()]


def in_range(fixed: Fixed) -> bool:
    return bool(np.all((fixed.codes >= fixed.format.min_code) & (fixed.codes <= fixed.format.max_code)))


@pytest.mark.parametrize("a", SMALL, ids=str)
@pytest.mark.parametrize("operation", [operator.add, operator.sub, operator.mul], ids=lambda o: o.__name__)
def test_arithmetic_is_exact_and_fits(operation, a):
    left = every(a)
    for b in SMALL:
        right = every(b)
        result = operation(Fixed(a, left.codes[:, None]), Fixed(b, right.codes[None, :]))
        assert exact(result) == [operation(x, y) for x, y in product(exact(left), exact(right))]
        assert in_range(result)
        assert result.format == operation(a, b)


@pytest.mark.parametrize("a", SMALL, ids=str)
@pytest.mark.parametrize(
    "comparison", [operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne]
)
def test_comparisons(comparison, a):
    left = every(a)
    for right in map(every, SMALL):
        result = comparison(Fixed(a, left.codes[:, None]), Fixed(right.format, right.codes[None, :]))
        assert result.ravel().tolist() == [comparison(x, y) for x, y in product(exact(left), exact(right))]


@pytest.mark.parametrize("format", SMALL, ids=str)
def test_unary_operations(format):
    numbers = every(format)
    assert exact(-numbers) == [-x for x in exact(numbers)]
    assert in_range(-numbers)
    for exponent in (-3, 0, 5):
        assert exact(numbers.scale(exponent)) == [x * Fraction(2) ** exponent for x in exact(numbers)]


@pytest.mark.parametrize("format", [SQ(3, 4), UQ(2, 5), SQ(-1, 6), UQ(-2, 8)], ids=str)
def test_rounding(format):
    numbers = every(format)
    for fraction_bits in range(1 - format.integer_bits, format.fraction_bits + 1):
        unit = Fraction(2) ** -fraction_bits
        truncated = numbers.truncate(fraction_bits)
        assert exact(truncated) == [floor(x / unit) * unit for x in exact(numbers)]
        rounded = numbers.round_half_up(fraction_bits)
        assert exact(rounded) == [floor(x / unit + Fraction(1, 2)) * unit for x in exact(numbers)]
        assert in_range(truncated)
        assert in_range(rounded)
        assert truncated.format.fraction_bits == rounded.format.fraction_bits == fraction_bits


@pytest.mark.parametrize("source", SMALL, ids=str)
def test_range_conversions(source):
    numbers = every(source)
    for target in SMALL:
        if source.fraction_bits == target.fraction_bits:
            low, high = (
                Fraction(c) / Fraction(2) ** target.fraction_bits for c in (target.min_code, target.max_code)
            )
            modulus = Fraction(2) ** target.integer_bits
            assert exact(numbers.saturate(target)) == [min(max(x, low), high) for x in exact(numbers)]
            assert exact(numbers.wrap(target)) == [(x - low) % modulus + low for x in exact(numbers)]
        else:
            for convert in (numbers.saturate, numbers.wrap):
                with pytest.raises(ValueError, match="needs equal fraction bits"):
                    convert(target)


@pytest.mark.parametrize("source", SMALL, ids=str)
def test_extend_is_exact_or_refused(source):
    for target in SMALL:
        representable = set(exact(every(source))) <= set(exact(every(target)))
        assert target.holds(source) == representable
        if representable:
            extended = every(source).extend(target)
            assert exact(extended) == exact(every(source))
            assert extended.format == target
        else:
            with pytest.raises(ValueError, match="does not hold every number"):
                every(source).extend(target)


def test_format_equality_and_hash():
    assert SQ(1, 17) == SQ(1, 17)
    assert len({SQ(1, 17), SQ(1, 17), SQ(2, 16), UQ(1, 17), SQ(1, 16)}) == 4
    assert (str(SQ(1, 17)), repr(UQ(-4, 21))) == ("SQ(1, 17)", "UQ(-4, 21)")


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: SQ(1, 63), ValueError, r"SQ\(1, 63\) is 64 bits wide; a width must be 1 to 63 bits"),
        (lambda: UQ(0, 0), ValueError, r"UQ\(0, 0\) is 0 bits wide"),
        (lambda: UQ(1.5, 0), TypeError, "integer_bits must be an integer, not 1.5"),
        (lambda: SQ(20, 20) * SQ(20, 20), ValueError, "80 bits wide"),
        (lambda: Fixed(SQ(1, 3), [8]), ValueError, r"codes from 8 to 8 exceed SQ\(1, 3\)"),
        (lambda: Fixed(SQ(1, 3), [0.5]), TypeError, "codes must be integers, not float64"),
        (lambda: Fixed(UQ(1, 3), [1]).truncate(4), ValueError, "has no 4 fraction bits to keep"),
        (lambda: SQ(1, 3).code(0.3), ValueError, r"0.3 is not a number of SQ\(1, 3\)"),
        (lambda: Fixed(SQ(2, 40), [0]) < Fixed(SQ(30, 1), [0]), ValueError, "bits wide"),
    ],
)
def test_refusals(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_round_takes_the_nearest_number():
    rounded = Fixed.round(SQ(2, 3), [0.0625, -0.0625, 0.06, 1.9, -2.0])
    assert rounded.codes.tolist() == [1, 0, 0, 15, -16]
    with pytest.raises(ValueError, match="exceed"):
        Fixed.round(SQ(1, 3), [1.0])


def test_widest_numbers_stay_exact():
    wide = Fixed(SQ(21, 42), [SQ(21, 42).min_code, SQ(21, 42).max_code, -1, 0, 1])
    for fraction_bits in (41, 20, 0):
        unit = Fraction(2) ** -fraction_bits
        assert exact(wide.truncate(fraction_bits)) == [floor(x / unit) * unit for x in exact(wide)]


@pytest.mark.parametrize(
    "format", [SQ(1, 17), UQ(0, 17), SQ(2, 42), UQ(2, 1), SQ(1, 0), SQ(1, 62), UQ(1, 62)]
)
def test_wrap_of_codes_of_any_size(format):
    """Wraps are compared with Python's integers: sums that overflow an int64, and integers that do not fit an
    int64."""
    rng = np.random.default_rng(format.width)
    a, b = rng.integers(-(2**63), 2**63, (2, 5000))
    low, modulus = format.min_code, 1 << format.width
    exact = [(int(x) + int(y) - low) % modulus + low for x, y in zip(a, b, strict=True)]
    assert format.wrap(a + b).tolist() == exact
    assert format.wrap(a.astype(object) + b.astype(object)).tolist() == exact
    assert format.wrap(np.array([low, format.max_code])).tolist() == [low, format.max_code]
