"""Record of the renormaliser."""

import numpy as np

from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED
from blysk.hdl.normals.renormaliser import RenormaliserUnit
from blysk.sim.units.operands import any_codes, component_words, dot, sphere, unit_codes, word_ends
from blysk.sim.units.record import Case, Record, Sample, Stimulus, Variant

__all__ = ["RECORD"]


def _codes(vectors):
    return np.clip(np.rint(vectors / COMPONENT.step), COMPONENT.min_code, COMPONENT.max_code).astype(np.int64)


def _vectors(rng, count, shortest, longest):
    return _codes(sphere(rng, count) * rng.uniform(shortest, longest, (count, 1)))


def _measure(rng, count):
    model, margin = Renormaliser(), 2.0**-15
    length = rng.uniform(np.sqrt(model.LOW) + margin, np.sqrt(model.HIGH) - margin, count)
    vector = _codes(sphere(rng, count) * length[:, np.newaxis])
    found, out_of_range = model.compute(*component_words(vector))
    value = vector * COMPONENT.step
    square = dot(value, value)
    offset = (square - model.LOW) * 2**model.SEGMENT_BITS
    segment = np.clip(np.floor(offset).astype(np.int64), 0, model.SEGMENTS - 1)
    u = (offset - segment) / 2**model.SEGMENT_BITS
    c0, c1, c2 = (c.values[segment] for c in model.coefficients)
    formula = value * (1 + c0 - u * (c1 - u * c2))[:, np.newaxis]
    exact = value * np.sqrt(ONE_SQUARED.values / square)[:, np.newaxis]
    kept = ~out_of_range
    return Sample(found.values[kept], exact[kept], formula[kept], np.sqrt(square)[kept, np.newaxis])


def _expect(unit, case):
    normal, out_of_range = unit.parameters.compute(*component_words(case.beats))
    return {"normal": normal.codes, "out_of_range": out_of_range}


def _lengths(unit, rng, count):
    """Vectors of lengths 0.5 to 1, and any words."""
    vector = np.rint(unit_codes(rng, count) * rng.uniform(0.5, 1, (count, 1))).astype(np.int64)
    vector[::8] = any_codes(rng, COMPONENT, *vector[::8].shape)
    return Case(vector)


def _corners(unit, rng, count):
    """Squares next to each border of a segment; axes; lengths 0 and 1 +- 1/256; ends of words."""
    model = unit.parameters
    borders = (model.LOW + np.arange(model.SEGMENTS + 1) / 2**model.SEGMENT_BITS) * 2.0**34
    x = np.floor(np.sqrt(borders) * 0.7).astype(np.int64)
    y = np.sqrt(borders - x * x).astype(np.int64)
    near = [np.stack([x, y + offset, np.zeros_like(x)], axis=1) for offset in (-1, 0, 1, 2)]
    axes = ONE * np.vstack([np.eye(3, dtype=np.int64), -np.eye(3, dtype=np.int64)])
    slanted = ONE * np.array([[0.6, 0.8, 0], [0.48, 0.6, 0.64]])
    slanted = [np.rint(slanted * length).astype(np.int64) for length in (1 - 1 / 256, 1, 1 + 1 / 256)]
    ends = np.array(np.meshgrid(*[[COMPONENT.min_code, -1, 0, 1, COMPONENT.max_code]] * 3)).reshape(3, -1).T
    few = np.vstack([*near, axes, axes - np.sign(axes), *slanted, *(-v for v in slanted), ends])
    return Case(rng.permutation(np.vstack([few, word_ends(rng, count, 3), _vectors(rng, count, 0.6, 1.1)])))


def _last_bits(unit, rng, count):
    """Many vectors, for the last bits of products; along an axis, where sums saturate at 1."""
    along = np.arange(90_000, COMPONENT.max_code, 3)[:, np.newaxis]
    axes = (along * axis for axis in np.eye(3, dtype=np.int64))
    return Case(np.vstack([_vectors(rng, count, 0.68, 1.02), *axes]))


RECORD = Record(
    name="renormaliser",
    title="Vector divided by its length",
    source="docs/theory/interpolation.md#renormaliser",
    variants={"": Variant(RenormaliserUnit, _measure, "lengths 0.685 to 1.0155")},
    expect=_expect,
    stimuli={
        "lengths": Stimulus(_lengths, 1000),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_last_bits, 300_000, stalled=False),
    },
    axis="length of the vector",
    waivers={
        "linear_term": (
            "Subtracted from a word that ends in zeros, the bit counts at an exact tie only, once in 2^20 "
            "vectors."
        ),
        "square_term": (
            "Subtracted from a constant half step, the bit counts at an exact tie only, by 2^-16 of a factor."
        ),
        "total_2": "The lowest of 18 bits that are cut off: it carries past them once in 2^18 sums.",
        "normal_?": (
            "It is for the saturation below -1, which no component reaches, as vectors get no longer than 1."
        ),
        "dot_product.*": "The dot product inside is accepted at once, so that its skid buffer never shows.",
    },
)
