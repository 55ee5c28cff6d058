"""Record of the G/P/Q unit."""

import numpy as np

from blysk.bench.units.operands import (
    SPANS_45,
    any_codes,
    any_pairs,
    component_words,
    degrees_between,
    span_ends,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.gpq import GPQUnit

__all__ = ["RECORD"]


def _measure(rng, count):
    left, right = component_words(*span_ends(rng, count, MAX_SPAN_ANGLE))
    middle, _ = MiddleNormal().compute(left, right)
    found = GPQ().compute(left, middle, right)
    n_l, n_c, n_r = left.values, middle.values, right.values
    exact = np.stack([2 * n_r - 4 * n_c + 2 * n_l, 4 * n_c - n_r - 3 * n_l, n_l])
    at = degrees_between(left.codes, right.codes)
    return Sample(np.stack([word.values for word in found]), exact, exact, at)


def _expect(unit, case):
    left, right = component_words(case.beats["normal_left"], case.beats["normal_right"])
    middle = Fixed(MiddleNormal.FORMAT, case.beats["normal_middle"])
    coefficients = unit.model.compute(left, middle, right)
    return {name: word.codes for name, word in zip("gpq", coefficients, strict=True)}


def _normals(unit, rng, count):
    """End normals at angles of every size, or any codes. The middle is their middle normal, or any codes."""
    left, right = any_pairs(rng, count)
    middle = any_codes(rng, MiddleNormal.FORMAT, count, 3)
    middle[::2] = MiddleNormal().compute(*component_words(left, right))[0].codes[::2]
    return Case({"normal_left": left, "normal_middle": middle, "normal_right": right})


def _corners(unit, rng, count):
    """Extreme codes, for which G and P saturate. Half of the middles are near the mean of their ends.

    For these G and P do not saturate.
    """
    left, right = word_ends(rng, count, 3), word_ends(rng, count, 3)
    format = MiddleNormal.FORMAT
    middle = rng.choice([format.min_code, format.max_code, 0], (count, 3))
    left[::2] = rng.integers(COMPONENT.min_code, COMPONENT.max_code, left[::2].shape, endpoint=True)
    near = left[::2] + rng.integers(-40_000, 40_000, left[::2].shape)
    right[::2] = np.clip(near, COMPONENT.min_code, COMPONENT.max_code)
    middle[::2] = 2 * (left + right)[::2] + rng.integers(-9000, 9000, left[::2].shape)
    middle = np.clip(middle, format.min_code, format.max_code)
    return Case({"normal_left": left, "normal_middle": middle, "normal_right": right})


RECORD = Record(
    name="gpq",
    title="Coefficients of the quadratic normal curve",
    source="docs/theory/interpolation.md#quadratic-normals; [T] figure 2.8",
    variants={"": Variant(GPQUnit, _measure, SPANS_45, note="exact")},
    expect=_expect,
    stimuli={"normals": Stimulus(_normals, 1000), "corners": Stimulus(_corners, 2000)},
)
