"""Record of the span limit."""

from functools import partial

import numpy as np

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.hdl.cosines.span_limit import SpanLimitUnit
from blysk.sim.units.operands import (
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    exponents,
    sphere,
    turned,
    word_ends,
)
from blysk.sim.units.record import Case, Decisions, Record, Stimulus, Variant

__all__ = ["RECORD", "differences_about"]

EXPONENT = 60
"""Exponent of a run that needs only one."""


def _measure(rng, count):
    """Whether a span is wide if it is lit, and whether its angle is over that of the octave."""

    def samples():
        for exponent, share in exponents(rng, count):
            limit = SpanLimit.angle(exponent)
            left, right = code_pairs_at(rng, share, rng.uniform(0, 2 * limit, share))
            _, wide = SpanLimit().exceeds(*component_words(left, right), np.full(share, exponent))
            degrees = degrees_between(left, right)[:, 0]
            yield Decisions.of(wide, degrees > limit, degrees)

    return Decisions.joined(samples())


def _expect(unit, case):
    beats = case.beats
    words = component_words(beats["normal_left"], beats["normal_right"])
    exponent = 1 if case.constants is None else case.constants
    wide, wide_if_lit = unit.parameters.exceeds(*words, np.full(len(words[0].codes), exponent))
    return {"wide": wide, "wide_if_lit": wide_if_lit if unit.highlights else wide}


def _case(unit, exponent, left, right):
    beats = {"normal_left": left, "normal_right": right}
    return Case(beats, exponent if unit.highlights else None)


def _spans(unit, rng, count, exponent=EXPONENT):
    """Pairs of unit normals at angles of every size, every sixteenth of arbitrary codes; ends of words."""
    left, right = any_pairs(rng, count)
    for ends in (left, right):
        ends[7::32] = word_ends(rng, len(ends[7::32]), 3)
    # The longest chord.
    left[7], right[7] = COMPONENT.max_code, COMPONENT.min_code
    return _case(unit, exponent, left, right)


def _limits(unit, rng, count):
    """Angles about the limit of the exponent and about the widest, off by the normals' rounding or more."""
    p, exponent = unit.parameters, int(rng.choice([1 << rng.integers(10), 1000, rng.integers(1, 1001)]))
    degrees = rng.choice([p.angle(exponent), p.WIDEST], count) + rng.normal(size=count) * 10.0 ** (
        rng.uniform(-5, 0, count)
    )
    left = sphere(rng, count)
    right = turned(rng, left, np.abs(degrees))
    return _case(unit, exponent, quantise(left), quantise(right))


def differences_about(rng: np.random.Generator, chord: np.ndarray) -> np.ndarray:
    """Differences of two normals whose half squared chord is a few codes, or a bit, off the given ones.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random generator.
    chord : int array, shape (normals,)
        Codes of `Chord.FORMAT`.

    Returns
    -------
    int array, shape (normals, 3)
        Codes of `COMPONENT`, none of them negative, the largest component first.
    """
    count = len(chord)
    rest = np.maximum(chord + rng.integers(-3, 4, count) * (1 << rng.integers(0, 20, count)), 0)
    difference = np.zeros((count, 3), dtype=np.int64)
    for c in range(3):
        # Half a squared difference of 34 fraction bits has 35.
        difference[:, c] = np.floor(np.sqrt(rest))
        rest -= difference[:, c] ** 2
    return difference


def _last_bits(unit, rng, count):
    """Half the squared chord a few codes about the two limits: every bit of a comparison decides."""
    p = unit.parameters
    exponent = 1 << int(rng.integers(10))
    limit = np.where(np.arange(count) % 2, p.chords.codes[exponent.bit_length()], p.widest.codes)
    difference = differences_about(rng, limit)
    left = difference // 2
    return _case(unit, exponent, left, left - difference)


def _variants():
    yield (
        "",
        Variant(
            SpanLimitUnit,
            _measure,
            "spans to twice the angle of the octave, n 1 to 1000",
            "rate",
            note="of all spans; model: flagged below the angle; arithmetic: not flagged above it",
        ),
    )
    yield "no highlights", Variant(partial(SpanLimitUnit, highlights=False))


RECORD = Record(
    name="span_limit",
    title="Whether the angle of a span is over the chord method's limits",
    source="docs/theory/chord.md#where-spans-are-cut",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 600),
        "limits": Stimulus(_limits, 600, stalled=False, repeats=30),
        "last bits": Stimulus(_last_bits, 2000, stalled=False, repeats=20),
    },
    still={
        "the exponent stays for a run: only bits of the word that is read after a reset fall": (
            "limit_octave[0-3] datapath.limit[{0,4,6-8,12,14,16-18,21,25,27-29}]"
        ),
        "half the squared chord of the widest lit span is less than 2^-4": "datapath.limit[31-36]",
        "the second bit of a square is 0": "multiplier_0_product[1] chord_square_0[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "multiplier_0_product[35] chord_square_0[35] square_partial[36] square_total[36-37] "
            "aligned[38-39]"
        ),
    },
)
