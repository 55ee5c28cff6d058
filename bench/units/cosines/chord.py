"""Record of the chord unit."""

import numpy as np

from blysk.bench.units.operands import (
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    dot,
    span_ends,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.chord import Chord
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.cosines.chord import ChordUnit

__all__ = ["RECORD"]


def _measure(rng, count):
    left, right = span_ends(rng, count, 180.0)
    exact = dot(right - left, right - left) / 2 * COMPONENT.step**2
    limit = Chord.ARGUMENT_FORMAT.max_code * Chord.ARGUMENT_FORMAT.step
    found = Chord().operand(*component_words(left, right)).values
    exact = np.minimum(exact, limit)
    return Sample(found, exact, exact, degrees_between(left, right)[:, 0])


def _expect(unit, case):
    return unit.model.operand(*component_words(case.beats["a"], case.beats["b"])).codes


def _pairs(unit, rng, count):
    """Pairs of unit vectors at any distance. Every sixteenth pair has any codes."""
    return Case(dict(zip("ab", any_pairs(rng, count), strict=True)))


def _corners(unit, rng, count):
    """Components that differ by 1, or by 1 plus or less a step; largest differences; extreme codes."""
    ends = word_ends(rng, count, 6)
    border = [[ONE, 0, 0, ONE - d, 0, 0] for d in (2**17 - 1, 2**17, 2**17 + 1)]
    border.append([COMPONENT.min_code] * 3 + [COMPONENT.max_code] * 3)
    words = np.vstack([ends, border, np.roll(border, 3, axis=1)])
    return Case({"a": words[:, :3], "b": words[:, 3:]})


def _last_bits(unit, rng, count):
    """Many pairs, because a carry out of the bits that are cut off is rare."""
    degrees = np.r_[10.0 ** rng.uniform(-4, 0, count // 4), rng.uniform(0, 180, count - count // 4)]
    return Case(dict(zip("ab", code_pairs_at(rng, count, degrees), strict=True)))


RECORD = Record(
    name="chord",
    title="Half the squared distance of two unit vectors",
    source="docs/theory/chord.md#the-chord; [Lyon93]",
    variants={"": Variant(ChordUnit, _measure, "angles 0 to 180 degrees")},
    expect=_expect,
    stimuli={
        "pairs": Stimulus(_pairs, 2000),
        "corners": Stimulus(_corners, 400),
        "last bits": Stimulus(_last_bits, 200_000, stalled=False),
    },
    waivers={
        "multiplier_?_product": (
            "Squares are 0 or 1 modulo 4, so the last two bits of three squares give no carry. The last ten "
            "bits of the sum are cut off."
        ),
        "u_aligned": "If a bit above the format of u is 1, u saturates. The other bits then have no effect.",
        "u": (
            "A saturated word has the inverted sign in all bits. The sign of a sum of squares is 0 already."
        ),
    },
    still={
        "a square is 0 or 1 modulo 4": "multiplier_*_product*[1]",
        "a sum of three squares of at most 2^34 is not negative, and less than 2^36": (
            "multiplier_*_product*[35] u_square_partial[36] u_square_total[36-37] u_aligned[38-39]"
        ),
    },
)
