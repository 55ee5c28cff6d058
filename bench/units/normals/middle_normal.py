"""Record of the middle normal."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    SPANS_45,
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    exact_middle,
    pairs_chosen,
    span_ends,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.hdl.normals.middle_normal import MiddleNormalUnit

__all__ = ["RECORD"]


def _measure(rng, count, model):
    left, right = span_ends(rng, count, MAX_SPAN_ANGLE)
    found, _ = model.compute(*component_words(left, right))
    exact, cosine = exact_middle(left, right)
    u = (1 - cosine) * ONE_SQUARED.values
    coefficients = np.r_[0.5 + model.constant.values, model.coefficients.values]
    factor = np.polynomial.polynomial.polyval(u, coefficients)[:, np.newaxis]
    # If the factor is too large, a component near 1 is outside the range of its word.
    formula = (left + right) * COMPONENT.step * factor
    formula = np.clip(formula, -1, model.FORMAT.max_code * model.FORMAT.step)
    return Sample(found.values, exact, formula, degrees_between(left, right))


def _expect(unit, case):
    left, right = case.beats["normal_left"], case.beats["normal_right"]
    middle, out_of_range = unit.model.compute(*component_words(left, right))
    return {**case.beats, "normal_middle": middle.codes, "out_of_range": out_of_range}


def _case(left, right):
    return Case({"normal_left": left, "normal_right": right})


def _spans(unit, rng, count):
    """Pairs of normals at angles of every size, and pairs of arbitrary codes."""
    return _case(*any_pairs(rng, count))


def _corners(unit, rng, count):
    """Equal and opposite normals; angles below 45 degrees, of 45 degrees, and above; extreme codes."""
    angles = np.r_[np.zeros(20), rng.uniform(0, 45, count), np.full(20, 45), rng.uniform(45, 180, 60), 180]
    ends = (np.vstack([end, word_ends(rng, 100, 3)]) for end in code_pairs_at(rng, len(angles), angles))
    return _case(*ends)


def _last_bits(unit, rng, count):
    """Many pairs, because last bits rarely change a rounded result. Some u are at a border of rounding."""
    left, right = code_pairs_at(rng, count, rng.uniform(0, 60, count))
    few = left[:1500], right[:1500]
    border = pairs_chosen(*few, lambda u: (u < ONE_SQUARED.codes // 2) & ((u + 8) % (1 << 16) < 16))
    return _case(*(np.vstack(ends) for ends in zip((left, right), border, strict=True)))


def _variants():
    for fit in MIDDLE_NORMAL_FITS:
        model = MiddleNormal(fit)
        unit, measure = partial(MiddleNormalUnit, model), partial(_measure, model=model)
        yield fit, Variant(unit, measure, SPANS_45, as_published=fit == "as_published")
    for interval in (1, 2, 3, 4, 5, 7, 8, 9):
        unit = partial(MiddleNormalUnit, MiddleNormal(), initiation_interval=interval)
        measured = (partial(_measure, model=MiddleNormal()), SPANS_45) if interval == 1 else ()
        yield f"exact, interval {interval}", Variant(unit, *measured, long=interval not in (1, 3, 9))
    unit = partial(MiddleNormalUnit, MiddleNormal("minimax_3"), initiation_interval=1)
    yield "minimax_3, interval 1", Variant(unit)


RECORD = Record(
    name="middle_normal",
    title="Normal half-way between the ends of a span",
    source="docs/theory/interpolation.md#middle-normal; [T] 2.2",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 500),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_last_bits, 40_000, stalled=False),
    },
    waivers={
        "slot": "The fault turns slot 4 into slot 6. Slot 5 still follows. Only slots 0 and 5 have effects.",
        "turn": "The fault turns slot 4 into slot 6. Slot 5 still follows. Only slots 0 and 5 have effects.",
    },
    still={
        "products of the polynomial are at most 0.0127 and 0.0293": "rounded_2[13-16] rounded_1[14-16]",
        "sums of the polynomial are 0.0458 to 0.0586 and 0.1250 to 0.1544": "datapath.total_{1,2}[14-16]",
    },
)
