"""Record of the chain of bisections."""

from functools import partial

import numpy as np

from blysk.bench.units.normals.bisection import factor_of
from blysk.bench.units.operands import (
    AXIS,
    any_pairs,
    code_pairs_at,
    component_words,
    degrees_between,
    dot,
    pairs_chosen,
    span_ends,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED
from blysk.hdl.normals.bisection_chain import BisectionChainUnit

__all__ = ["RECORD"]

_LEVELS = (1 << BisectionChain.LEVEL_BITS) - 1
_LENGTH = ONE * COMPONENT.step
"""Length of a unit vector as a fixed-point number."""


def _weights(chain, cosine, level, limit):
    """Weights ``l`` and ``m`` of the ends in float64.

    If u is over the limit, the polynomial of the first step gives the factor.
    """
    model, u = chain.bisection, 1 - cosine
    weight_l, weight_m = np.zeros(len(u)), np.ones(len(u))
    for k in range(1, _LEVELS + 1):
        e = factor_of(model, 1 - u, (u * _LENGTH**2 > limit) & (model.max_angle == 90))
        weight_l = np.where(k <= level, (weight_l + 1) * (0.5 + e), weight_l)
        weight_m = np.where(k <= level, weight_m * (0.5 + e), weight_m)
        u = u / 2 - (2 - u) * e
    return weight_l, weight_m


def _measure(rng, count, chain):
    model = chain.bisection
    left, right = span_ends(rng, count, model.max_angle)
    level = rng.integers(1, _LEVELS + 1, count)
    found, _ = chain.compute(*component_words(left, right), level)
    a, b = left / ONE, right / ONE

    def vectors(of_left, of_right):
        return _LENGTH * (of_left[:, np.newaxis] * a + of_right[:, np.newaxis] * b)

    # Vectors of codes differ in length. So the exact normal has weights for a great circle between them.
    psi = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), dot(a, b))
    part = psi * 2.0**-level
    apart = psi > 0
    sine = np.where(apart, np.sin(psi), 1)
    exact = vectors(
        np.where(apart, np.sin(psi - part) / sine, 1 - 2.0**-level),
        np.where(apart, np.sin(part) / sine, 2.0**-level),
    )
    # Near the limit, rounding decides which polynomial the unit takes. The formula takes the same polynomial.
    limits = model.widest_narrow.values + np.array([-8, 8]) * model.ANGLE_FORMAT.step
    early, late = (
        np.clip(vectors(*_weights(chain, dot(a, b), level, limit)), -1, _LENGTH) for limit in limits
    )
    of_early, of_late = (np.abs(found.values - formula).max(axis=1) for formula in (early, late))
    formula = np.where((of_early < of_late)[:, np.newaxis], early, late)
    return Sample(found.values, exact, formula, degrees_between(left, right))


def _expect(unit, case):
    words = component_words(case.beats["normal_left"], case.beats["normal_right"])
    normal, out_of_range = unit.model.compute(*words, case.beats["level"])
    return {"normal": normal.codes, "out_of_range": out_of_range}


def _case(ends, level):
    left, right = ends
    return Case({"normal_left": left, "normal_right": right, "level": level})


def _spans(unit, rng, count):
    """Pairs of normals at angles of every size, and pairs of arbitrary codes. Most chains are short."""
    # A level takes 17 cycles, so most pairs have few levels.
    return _case(any_pairs(rng, count), 1 + (rng.zipf(2, count) - 1) % _LEVELS)


def _corners(unit, rng, count):
    """Pairs at 0, 45, 90, 180, small and up to 100 degrees; pairs of extreme codes. The level is any."""
    angles = np.r_[0, 45, 90, 180, 10.0 ** rng.uniform(-4, 0, count // 4), rng.uniform(0, 100, count)]
    ends = (
        np.vstack([end, word_ends(rng, count // 4, 3)]) for end in code_pairs_at(rng, len(angles), angles)
    )
    left, right = ends
    order = rng.permutation(len(left))
    return _case((left[order], right[order]), rng.integers(1, _LEVELS + 1, len(left)))


def _last_bits(unit, rng, count):
    """Spans of one level at the border of a rounding. There a single step of a product changes the result."""

    def at_border(u):
        # u is rounded to 20 and to 17 fraction bits. It is at the border of both roundings.
        return (abs((u - (7 << 13) + 20) % (1 << 17) - 20) < 20) & (u < ONE_SQUARED.codes)

    first = pairs_chosen(*code_pairs_at(rng, 2000, 90), at_border)
    # The result of level 1 is f times the sum of the ends. In these pairs a component is at the border.
    ends = code_pairs_at(rng, count, rng.uniform(0, 90, count))
    model = unit.model.bisection
    u = (ONE_SQUARED - DotProduct().compute(*component_words(*ends))).round_half_up(20)
    e, _ = model.factor(u.round_half_up(17).wrap(Bisection.ANGLE_FORMAT))
    f = (e.codes + (1 << 18) + 2) >> 2
    border = abs(f[:, np.newaxis] * (ends[0] + ends[1]) % (1 << 17) - (1 << 16)) < 20
    left, right = (np.vstack([a, end[border.any(axis=1)]]) for a, end in zip(first, ends, strict=True))
    return _case((left, right), np.ones(len(left), dtype=np.int64))


def _variants():
    for name, model in (("", Bisection()), ("as published", Bisection(as_published=True))):
        chain = BisectionChain(model)
        yield (
            name,
            Variant(
                partial(BisectionChainUnit, chain),
                partial(_measure, chain=chain),
                "spans to 90 degrees, levels 1 to 15",
                beat={"normal_left": AXIS, "normal_right": AXIS, "level": 1},
                note="latency and interval: for level 1",
                as_published=model.as_published,
            ),
        )
    yield "1, 45", Variant(partial(BisectionChainUnit, BisectionChain(Bisection(1, 45))))


RECORD = Record(
    name="bisection_chain",
    title="Normal at 1/2^k of a span's angle, by repeated bisection",
    source="docs/theory/interpolation.md#bisection; [T] 2.1",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 300),
        "corners": Stimulus(_corners, 400),
        "many spans": Stimulus(_corners, 2000, stalled=False),
        "last bits": Stimulus(_last_bits, 50_000, stalled=False),
    },
    waivers={
        "weight_l": (
            "The weight l starts at 0, and a step gives at most l/2 + 1. So l is never negative, stays less "
            "than 2, and never saturates."
        ),
        "factor": (
            "The fault changes the operands after the cycle on which they are read, or it sets to 0 the sign "
            "of m. The weight m is a product of factors, so its sign is 0 already."
        ),
    },
    still={
        "the weights l and m are not negative": "top.weight_{l,m}[21]",
    },
)
