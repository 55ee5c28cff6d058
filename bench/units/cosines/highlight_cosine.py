"""Record of the highlight-cosine unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, log_lengths, pixel_of, short_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit

__all__ = ["RECORD", "spans_of"]

FORMATS = {
    "phase": HighlightCosine.PHASE_FORMAT,
    "step": HighlightCosine.STEP_FORMAT,
    "cos_beta": HighlightCosine.COS_BETA_FORMAT,
}


def _words(beats) -> tuple[Fixed, ...]:
    return tuple(Fixed(format, beats[name]) for name, format in FORMATS.items())


def _measure(rng, count, unit):
    length = log_lengths(rng, count)
    pixel = pixel_of(rng, length)
    phase = rng.integers(-(1 << 39), 1 << 39, count)
    step = np.floor(rng.uniform(0, 0.5, count) / np.maximum(length - 1, 1) * 2**40).astype(np.int64)
    beta = rng.integers(0, (1 << 25) + 1, count)
    beta[::4] = 1 << 25
    phase[::8] = (pixel * step)[::8] % (1 << 39)
    words = _words({"phase": phase, "step": step, "cos_beta": beta})
    found = unit.compute(*words, np.arange(count), pixel)
    turns = (phase - pixel * step) / 2.0**40
    # The formula: linear interpolation between the words of the table, without rounding.
    quarters = np.abs(turns - np.rint(turns)) * 4
    back = quarters > 1
    position = np.where(back, 2 - quarters, quarters) * 2**unit.address_bits
    address = np.minimum(np.floor(position), 2**unit.address_bits - 1).astype(np.int64)
    value, rise = (word.values[address] for word in unit.table)
    line = value + rise * (position - address)
    beta = beta * 2.0**-25
    largest = unit.RESULT_FORMAT.max_code * unit.RESULT_FORMAT.step
    exact, formula = (
        np.minimum(1 - beta * cosine, largest)
        for cosine in (np.cos(2 * np.pi * turns), np.where(back, line - 1, 1 - line))
    )
    return Sample(found.values, exact, formula, 360 * (turns % 1))


def _expect(unit, case):
    beats = case.beats
    return unit.model.compute(*_words(beats), *pixels_of(beats["length"])).codes


def _spans(unit, rng, count):
    """Spans of arbitrary codes. Most are short, and some have no pixel."""
    length = short_lengths(rng, count)
    beats = {name: any_codes(rng, format, len(length)) for name, format in FORMATS.items()}
    return Case({**beats, "length": length})


def spans_of(rng: np.random.Generator, length: np.ndarray) -> Case:
    """Input of spans of given lengths.

    Some phases are near a peak, at an end of a quarter of the wave, or extreme codes. Some steps are extreme
    codes, and some give a carry at the second pixel. cos beta is up to 2.
    """
    count = len(length)
    phase = rng.integers(-(1 << 39), 1 << 39, count)
    phase[1::4] = rng.normal(size=len(phase[1::4])) * 2.0**35
    phase[2::8] = rng.choice([-(1 << 39), (1 << 39) - 1, -(1 << 38), 1 << 38, -1, 0, 1], len(phase[2::8]))
    step = np.trunc(2.0 ** rng.uniform(0, 39, count)).astype(np.int64)
    step[::17] = rng.choice([0, (1 << 40) - 1, 1 << 38, 1 << 39], len(step[::17]))
    # At the second pixel a carry from the bits below the address changes the address.
    bit = rng.integers(0, 15, len(phase[4::8]))
    phase[4::8] = (phase[4::8] >> 15 << 15) + (1 << bit)
    step[4::8] = (1 << bit) + rng.integers(0, 2, len(bit))
    cos_beta = rng.integers(0, (1 << 25) + 1, count)
    cos_beta[3::8] = rng.choice([0, 1 << 25, (1 << 26) - 1, (1 << 26) - 256], len(cos_beta[3::8]))
    return Case({"phase": phase, "step": step, "cos_beta": cos_beta, "length": length})


def _corners(unit, rng, count):
    """Short spans. Phases are near a peak, at an end of a quarter, or any. Some steps give carries."""
    return spans_of(rng, rng.integers(0, 40, count // 20))


def _last_bits(unit, rng, count):
    """Spans whose lengths set every bit, and many short spans, as last bits rarely change a result."""
    powers = 1 << np.arange(12)
    return spans_of(rng, np.r_[powers, powers + 1, rng.integers(1, 4, count // 2)])


def _variant(interpolated, note):
    model = HighlightCosine(interpolated=interpolated)
    return Variant(
        partial(HighlightCosineUnit, model),
        partial(_measure, unit=model),
        "all angles, cos beta 0 to 1",
        beat={"length": 64},
        note=note,
        as_published=not interpolated,
    )


RECORD = Record(
    name="highlight_cosine",
    title="1 - cos gamma along a great circle by a table of cosines",
    source="docs/theory/interpolation.md#angular-method; [T] 3.2",
    variants={
        "interpolated": _variant(True, "model error: of linear interpolation in the table"),
        "table alone": _variant(False, "model error: of the table"),
        "64 words": Variant(partial(HighlightCosineUnit, HighlightCosine(address_bits=6))),
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 3000),
        "corners": Stimulus(_corners, 12_000, variants=("interpolated", "table alone", "64 words")),
        "last bits": Stimulus(_last_bits, 80_000, stalled=False),
    },
    axis="angle, degrees",
    waivers={},
    still={
        "the last value of the table and its whole rise have a sum of 1 less a step": "wave.v_6[22]",
        "a product is less than 2 if its factors are less than 1 and at most 1": "wave.term_10[26]",
    },
)
