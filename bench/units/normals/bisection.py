"""Record of the bisection unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    dot,
    exact_middle,
    span_ends,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.bisection import Bisection
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED
from blysk.hdl.normals.bisection import BisectionUnit

__all__ = ["RECORD", "factor_of"]


def factor_of(model: Bisection, cosine: np.ndarray, first_step: np.ndarray) -> np.ndarray:
    """The factor ``e`` of a bisection, by its polynomials in float64.

    Parameters
    ----------
    model : Bisection
        The polynomials.
    cosine : array
        Cosine r of unit vectors of length 1.
    first_step : bool array, same shape
        Whether to use the polynomial of the first step.
    """
    results = []
    for first in (False, True):
        constant, rest = model.polynomial(first)
        x = (cosine if model.reads_cosine(first) else 1 - cosine) * ONE_SQUARED.values
        results.append(np.polynomial.polynomial.polyval(x, np.r_[constant.values, rest.values]))
    return np.where(first_step, results[1], results[0])


def _measure(rng, count, model):
    left, right = span_ends(rng, count, model.max_angle)
    found, u, _ = model.compute(*component_words(left, right))
    exact, cosine = exact_middle(left, right)
    first_step = (u > model.widest_narrow) & (model.max_angle == 90)
    factor = 0.5 + factor_of(model, cosine, first_step)
    formula = (left + right) * COMPONENT.step * factor[:, np.newaxis]
    # If the factor is too large, a component near 1 is outside the range of its word.
    formula = np.clip(formula, -1, 1 - COMPONENT.step)
    return Sample(found.values, exact, formula, degrees_between(left, right))


def _expect(unit, case):
    a, b = case.beats["normal_a"], case.beats["normal_b"]
    middle, u, out_of_range = unit.model.compute(*component_words(a, b))
    return {"normal_middle": middle.codes, "one_minus_cosine": u.codes, "out_of_range": out_of_range}


def _case(a, b):
    return Case({"normal_a": a, "normal_b": b})


def _pairs(unit, rng, count):
    """Pairs of normals at angles of every size, and pairs of arbitrary codes."""
    return _case(*any_pairs(rng, count))


def _corners(unit, rng, count):
    """Pairs at 0, 45, 90, 180, small and any angles; pairs of extreme codes; a tie of u; the least u."""
    angles = np.r_[np.zeros(20), np.full(20, 45), np.full(20, 90), 10.0 ** rng.uniform(-4, 0, 100)]
    angles = np.r_[angles, rng.uniform(0, 90, count), rng.uniform(90, 180, 60), 180]
    a, b = (np.vstack([end, word_ends(rng, 100, 3)]) for end in code_pairs_at(rng, len(angles), angles))
    order = rng.permutation(len(a))
    a, b = a[order], b[order]
    # A tie of the rounding of u: 1 - cosine is 180994.5 steps of 2^-17.
    a[0], b[0] = (35421, 119829, 39572), (-5993, -85566, 99107)
    a[1] = b[1] = COMPONENT.min_code
    return _case(a, b)


def _last_bits(unit, rng, count):
    """Many pairs, because the last bits of products and sums rarely change a rounded result.

    The first pairs are arbitrary. In later pairs u is nearer and nearer to a border of its rounding, down to
    a distance of 0.
    """
    a, b = code_pairs_at(rng, count, rng.uniform(0, 100, count))
    border = (ONE_SQUARED.codes - dot(a, b)) % (1 << 17) - (1 << 16)
    few = count // 50
    chosen = np.flatnonzero(abs(border) * np.arange(-few, count - few) < 1 << 28)
    return _case(a[chosen], b[chosen])


def _variants():
    models = [Bisection(degree, angle) for degree in (2, 1) for angle in (90, 45)]
    models += [Bisection(degree, angle, as_published=True) for degree in (2, 1) for angle in (90, 45)]
    for model in models:
        unit = partial(BisectionUnit, model)
        name = f"{model.degree}, {model.max_angle}" + ", as published" * model.as_published
        yield (
            name,
            Variant(
                unit,
                partial(_measure, model=model),
                f"spans to {model.max_angle} degrees",
                note=f"degree {model.degree}",
                as_published=model.as_published,
            ),
        )
    intervals = {Bisection(): (1, 2, 3, 4, 5, 7, 9), Bisection(2, 45): (1, 3, 8), Bisection(1, 45): (1, 2, 7)}
    intervals[Bisection(as_published=True)] = (1,)
    for model, chosen in intervals.items():
        for interval in chosen:
            name = f"{model.degree}, {model.max_angle}" + ", as published" * model.as_published
            unit = partial(BisectionUnit, model, initiation_interval=interval)
            short = (model.degree, interval) in ((2, 1), (2, 9), (1, 2)) and not model.as_published
            yield (
                f"{name}, interval {interval}",
                Variant(unit, as_published=model.as_published, long=not short),
            )


RECORD = Record(
    name="bisection",
    title="Normal half-way between two normals",
    source="docs/theory/interpolation.md#bisection; [T] 2.1, figure 2.6",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "pairs": Stimulus(_pairs, 500),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_last_bits, 1_000_000, stalled=False),
    },
    waivers={
        "operands": (
            "The fault changes operands while the output is stalled. The beat of these operands came four "
            "cycles before, and the unit does not read them any more."
        ),
    },
    still={"the first sum of a polynomial is 0.056, or 0.136 to 0.303, so its first bit is 0": "total_2[17]"},
)
