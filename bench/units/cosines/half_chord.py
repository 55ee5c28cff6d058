"""Record of the half-chord unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, dot, span_ends
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.cosines.half_chord import HalfChordUnit

__all__ = ["RECORD", "chord_of"]

FORMAT = HalfChord.OPERAND_FORMAT
LARGEST = 1 << 35
"""Code of 2, the squared chord of a right angle. For a larger angle the unit gets the supplement's chord."""


def chord_of(left: np.ndarray, right: np.ndarray) -> tuple[Fixed, np.ndarray]:
    """Squared chord between two vectors, or to the opposite vector if this chord is shorter.

    The second result is a flag for the opposite vector.
    """
    obtuse = dot(left, right) < 0
    chord = np.where(obtuse[:, np.newaxis], left + right, left - right)
    return Fixed(FORMAT, np.minimum(dot(chord, chord), LARGEST)), obtuse


def _measure(rng, count):
    chord, obtuse = chord_of(*span_ends(rng, count, 180.0))
    unit = HalfChord()
    found = unit.compute(chord, obtuse)
    # The formula: interpolated table and polynomial, from the words of the hardware, without rounding.
    z = chord.codes * 2.0**-36
    halvings = np.clip(np.floor(-np.frexp(z)[1] / 2), 0, 17)
    position = z * 4.0**halvings * 2**unit.ADDRESS_BITS
    address = np.minimum(np.floor(position), 2**unit.ADDRESS_BITS - 1).astype(np.int64)
    value, slope = (word.values[address] for word in unit.roots)
    root = value + slope * (position - address) / 2**unit.ADDRESS_BITS
    factor = np.polynomial.polynomial.polyval(z, np.r_[unit.constant.values, unit.coefficients.values])
    exact = np.arcsin(np.sqrt(chord.codes) / (2 * ONE)) / np.pi
    turns = np.stack([exact, root * factor / 2 * 2.0**-halvings])
    exact, formula = np.where(obtuse, 0.5 - turns, turns)
    return Sample(found.values, exact, formula, 360 * exact)


def _expect(unit, case):
    chord = Fixed(FORMAT, case.beats["chord_squared"])
    return unit.model.compute(chord, case.beats["supplement"]).codes


def _case(rng, chord):
    return Case({"chord_squared": chord, "supplement": rng.random(len(chord)) < 0.4})


def _chords(unit, rng, count):
    """Squared chords of every size up to a right angle."""
    return _case(rng, np.minimum(any_codes(rng, FORMAT, count), LARGEST))


def _corners(unit, rng, count):
    """Powers of two, the codes before them, the largest chords, chords over 2, and chords of every size."""
    powers = 1 << np.arange(36)
    ends = np.r_[0, powers, powers - 1, FORMAT.max_code, LARGEST + 1, LARGEST - 2, LARGEST + (1 << 17)]
    size = np.trunc(2.0 ** rng.uniform(0, 36, count)).astype(np.int64)
    return _case(rng, np.r_[ends, size, rng.integers(0, LARGEST, count // 4)])


def _last_bits(unit, rng, count):
    """Many chords, because the last bits of table, products and sums rarely change a rounded result."""
    size = np.trunc(2.0 ** rng.uniform(0, 35, count // 4)).astype(np.int64)
    return _case(rng, np.r_[size, rng.integers(0, LARGEST, count - len(size))])


RECORD = Record(
    name="half_chord",
    title="Angle between two unit vectors from their squared chord",
    source="docs/theory/interpolation.md#half-chord; [T] 3.3",
    variants={
        "": Variant(
            HalfChordUnit,
            _measure,
            "angles 0 to 180 degrees",
            "turn",
            note="model error: of the root by linear interpolation, and of the factor by its polynomial",
        ),
        **{
            f"interval {interval}": Variant(partial(HalfChordUnit, initiation_interval=interval))
            for interval in range(1, 6)
        },
    },
    expect=_expect,
    stimuli={
        "chords": Stimulus(_chords, 2000),
        "corners": Stimulus(_corners, 2000),
        "last bits": Stimulus(_last_bits, 200_000, stalled=False),
    },
    axis="angle, degrees",
    waivers={
        "operands": (
            "The fault changes operands only while the output is stalled. By then they have been read."
        ),
        "multiplier_0_?_0": "No operand of the multiplier is negative, so the sign is 0 already.",
    },
    still={
        "operands are not negative, and less than 1": ("multiplier_0_?[17] multiplier_0_product*[34-35]"),
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "total[14-18] factor[14-16]",
        "in the factor's polynomial the sum total_3 is less than 1/16, and total_2 less than 1/8": (
            "total_3[15-16] total_2[16]"
        ),
        "a root is at most 1, and reaches 1 only by rounding": "root_sum[21] root_rounded[18]",
    },
)
