"""Record of the vector normaliser."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.geometry.span_attributes import SPAN_NORMAL
from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.geometry.vector_normaliser import SharedVectorNormaliserUnit, VectorNormaliserUnit

__all__ = ["RECORD", "deciding_vectors"]


def _expect(unit, case):
    normal, lost = unit.model.compute(Fixed(SPAN_NORMAL, case.beats["vector"]), case.beats["flip"])
    return {"normal": normal.codes, "lost": lost}


def _codes(vectors):
    return np.clip(np.rint(vectors), SPAN_NORMAL.min_code, SPAN_NORMAL.max_code).astype(np.int64)


def _vectors(unit, rng, count):
    """Vectors of all lengths. Some have any codes, and some have no direction."""
    vector = _codes(sphere(rng, count) * 2.0 ** rng.uniform(8, 26.5, (count, 1)))
    vector[::8] = any_codes(rng, SPAN_NORMAL, *vector[::8].shape)
    return Case({"vector": vector, "flip": rng.integers(0, 2, count)})


def _corners(unit, rng, count):
    """Squared lengths next to the borders of the table's segments, vectors along axes, extreme codes."""
    squared = (np.arange(128, 512) / 512)[:, np.newaxis] + np.arange(-2, 3) * 2.0**-20
    length = np.sqrt(np.r_[squared.ravel(), 4 * squared.ravel()])
    direction = sphere(rng, len(length))
    direction /= np.maximum(np.abs(direction).max(axis=1), 1 / np.sqrt(3))[:, np.newaxis] ** 0
    near = _codes(direction * length[:, np.newaxis] * 2.0**26)
    ends = (
        np.array(np.meshgrid(*[[SPAN_NORMAL.min_code, -1, 0, 1, SPAN_NORMAL.max_code]] * 3)).reshape(3, -1).T
    )
    steps = np.eye(3, dtype=np.int64)[np.newaxis] << np.arange(26)[:, np.newaxis, np.newaxis]
    steps = steps.reshape(-1, 3)
    vector = rng.permutation(np.vstack([near, ends, steps, -steps, steps - 1]))
    return Case({"vector": vector, "flip": rng.integers(0, 2, len(vector))})


def deciding_vectors(rng: np.random.Generator, draws: int) -> np.ndarray:
    """Random vectors v of length 1 whose unit vector depends on a single bit. About 1 in 3,000 is chosen.

    A vector is chosen if one step more or less of its squared length changes the factor e. It is also chosen
    if a component of ``v + e v`` is a tie of the rounding, or differs from a tie in one bit.

    Parameters
    ----------
    rng : Generator
        Random generator.
    draws : int
        Number of vectors to choose from.

    Returns
    -------
    int64 array, shape (V, 3), SQ(1, 26)
    """
    model = VectorNormaliser()
    vector = _codes(sphere(rng, draws) * 2.0**26)
    v, _ = model.shifted(Fixed(SPAN_NORMAL, vector))
    square = DotProduct().compute(v, v)
    e = model.factor(square)
    steps = (model.factor(Fixed(square.format, square.codes + step)) for step in (-1, 1))
    decides = np.any([e.codes != other.codes for other in steps], axis=0)
    total = v + Fixed(e.format, e.codes[:, np.newaxis]) * v
    cut = total.format.fraction_bits - COMPONENT.fraction_bits
    from_tie = (total.codes + (1 << (cut - 1))) & ((1 << cut) - 1)
    return vector[decides | (from_tie & (from_tie - 1) == 0).any(axis=1)]


def _deciding(unit, rng, count):
    """Vectors whose unit vector depends on a single bit. The flag ``flip`` negates most of them."""
    vector = deciding_vectors(rng, count)
    return Case({"vector": vector, "flip": (rng.random(len(vector)) < 0.9).astype(np.int64)})


def _measure(rng, count):
    vector = _codes(sphere(rng, count) * 2.0 ** rng.uniform(14, 26, (count, 1)))
    length = np.linalg.norm(vector, axis=1)
    normal, _ = VectorNormaliser().compute(Fixed(SPAN_NORMAL, vector), np.zeros(count, dtype=bool))
    exact = vector / length[:, np.newaxis]
    return Sample(normal.codes / ONE, exact, None, np.log2(length * 2.0**-26)[:, np.newaxis])


RECORD = Record(
    name="vector_normaliser",
    title="Vector of any length divided by its length",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(VectorNormaliserUnit, _measure, "lengths 2^-12 to 1", note="components divided by ONE"),
        "interval 4": Variant(partial(SharedVectorNormaliserUnit, initiation_interval=4), long=True),
        "interval 7": Variant(partial(SharedVectorNormaliserUnit, initiation_interval=7)),
    },
    expect=_expect,
    stimuli={
        "vectors": Stimulus(_vectors, 1000),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_vectors, 100_000, stalled=False),
        "ties": Stimulus(_deciding, 2_000_000, stalled=False),
    },
    axis="log2 of the vector's length",
    still={
        "u counts half steps; half a step stands for its dropped bits, so u is odd": "u[0]",
        "pair_2 is a multiple of 16, and pair_4 of 256": "pair_2[0-3] pair_4[0-7]",
    },
)
