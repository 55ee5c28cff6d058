"""Record of the line setup."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import LONG, any_codes, any_lengths, log_lengths, pixel_of, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.line_setup import LineSetup, quantise_line
from blysk.golden.number.fixed import Fixed
from blysk.hdl.normals.line_setup import LineSetupUnit

__all__ = ["RECORD", "any_lines"]

_FORMAT = LineSetup.VECTOR_FORMAT


def any_lines(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes of the vectors at both ends of lines. Every eighth line has any codes.

    The other lines have any angle, and vectors of length 1/100 to 1.
    """
    ends = [sphere(rng, count) * 10.0 ** -rng.uniform(0, 2, (count, 1)) for _ in range(2)]
    left, right = quantise_line(*ends)
    left[::8], right[::8] = any_codes(rng, _FORMAT, 2, *left[::8].shape)
    return left, right


def _measure(rng, count):
    """Components of the vector at any pixel of a line."""
    left, right = quantise_line(*(sphere(rng, count) * rng.uniform(0.1, 1, (count, 1)) for _ in range(2)))
    length = log_lengths(rng, count, 2)
    pixel = pixel_of(rng, length)[:, np.newaxis]
    step = LineSetup().compute(Fixed(_FORMAT, left), Fixed(_FORMAT, right), length)
    exact = (left + (right - left) * (pixel / (length - 1)[:, np.newaxis])) * _FORMAT.step
    found = left * _FORMAT.step + pixel * step.values
    return Sample(found, exact, exact, pixel)


def _expect(unit, case):
    beats = case.beats
    left, right = (Fixed(_FORMAT, beats[f"normal_{side}"]) for side in ("left", "right"))
    step = unit.model.compute(left, right, beats["length"])
    return {"start": left.codes, "step": step.codes, "length": beats["length"]}


def _lengths(unit, rng, count):
    return np.maximum(any_lengths(rng, count) % (1 << unit.length_bits), 1)


def _lines(unit, rng, count):
    """Lines between vectors of length 1/100 to 1 at any angle, or between any codes. Spans of any length."""
    left, right = any_lines(rng, count)
    return Case({"normal_left": left, "normal_right": right, "length": _lengths(unit, rng, count)})


def _corners(unit, rng, count):
    """Extreme codes. In half of the lines the difference of the ends is next to a multiple of 2^7."""
    left, right = any_lines(rng, count)
    words = np.array([_FORMAT.min_code, -1, 0, 1, _FORMAT.max_code])
    left[: count // 2] = rng.choice(words, (count // 2, 3))
    right[: count // 4] = rng.choice(words, (count // 4, 3))
    near = slice(count // 2, count)
    right[near] = np.clip(
        left[near] + (rng.integers(-64, 65, left[near].shape) << 7) + rng.integers(-1, 2, left[near].shape),
        _FORMAT.min_code,
        _FORMAT.max_code,
    )
    return Case({"normal_left": left, "normal_right": right, "length": _lengths(unit, rng, count)})


RECORD = Record(
    name="line_setup",
    title="Step from pixel to pixel of a straight line between two vectors",
    source="docs/theory/interpolation.md#renormaliser",
    variants={
        "interval 4": Variant(LineSetupUnit, _measure, f"vectors of length 0.1 to 1 at any angle, {LONG}"),
        **{
            f"interval {interval}": Variant(partial(LineSetupUnit, initiation_interval=interval), long=True)
            for interval in (1, 2, 3, 5, 9)
        },
        "9 bits of length": Variant(partial(LineSetupUnit, length_bits=9), long=True),
    },
    expect=_expect,
    stimuli={
        "lines": Stimulus(_lines, 500),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_lines, 20_000, stalled=False),
    },
    axis="pixel of the span",
    logarithmic=True,
    still={
        "a reciprocal is normalised, so its first bit is 1": (
            "reciprocals_word[23] reciprocals.port__data[23]"
        ),
        "for a length of 12 bits the shift is at most 12": "shift[4]",
        "the upper word of a reciprocal has 17 bits and is not negative": "multiplier_{0,2}_{1,b}[17]",
        "the lower word of P, and of the reciprocal, has 7 bits": (
            "multiplier_1_{1,b}[7-17] multiplier_2_{0,a}[7-17]"
        ),
        "a product of 7 by 17 bits has 24 bits": "multiplier_2_product[24-35]",
        "the shifted word has three fraction bits more than 2 P r, with the reciprocal r": (
            "shifter_0_0[0-2]"
        ),
    },
)
