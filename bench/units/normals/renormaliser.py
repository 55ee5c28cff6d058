"""Record of the renormaliser."""

import numpy as np

from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.normals.renormaliser import RenormaliserUnit

__all__ = ["RECORD"]

_FORMAT = Renormaliser.VECTOR_FORMAT


def _vectors(rng, count, shortest=Renormaliser.SHORTEST * 1.8):
    length = shortest ** rng.random((count, 1))
    return np.rint(sphere(rng, count) * length * _FORMAT.max_code).astype(np.int64)


def _measure(rng, count):
    """Components of N."""
    vector = _vectors(rng, count)
    found, too_short = Renormaliser().compute(Fixed(_FORMAT, vector))
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    exact = vector / length
    kept = ~too_short
    return Sample(found.codes[kept] / ONE, exact[kept], None, length[kept] * _FORMAT.step)


def _expect(unit, case):
    normal, too_short = unit.model.compute(Fixed(_FORMAT, case.beats["vector"]))
    return {"normal": normal.codes, "out_of_range": too_short, "span": case.beats["span"]}


def _case(rng, vector):
    return Case({"vector": vector, "span": rng.integers(0, 2, len(vector))})


def _lengths(unit, rng, count):
    """Vectors of lengths 1/256 to 1, and arbitrary codes."""
    vector = _vectors(rng, count)
    vector[::8] = any_codes(rng, _FORMAT, *vector[::8].shape)
    return _case(rng, vector)


def _corners(unit, rng, count):
    """Extreme codes, 0, 1 and -1 as components; largest components next to powers of two; vectors on axes."""
    words = [_FORMAT.min_code, -1, 0, 1, _FORMAT.max_code]
    ends = np.array(np.meshgrid(*[words] * 3)).reshape(3, -1).T
    powers = (1 << np.arange(_FORMAT.fraction_bits))[:, np.newaxis] + np.arange(-1, 2)
    largest = np.where(rng.random(powers.size) < 0.5, powers.ravel(), -powers.ravel())
    others = np.rint(rng.uniform(-1, 1, (largest.size, 2)) * np.abs(largest)[:, np.newaxis]).astype(np.int64)
    near = np.column_stack([largest, others])
    near = np.vstack([np.roll(near, k, axis=1) for k in range(3)])
    axes = np.vstack([near * axis for axis in np.eye(3, dtype=np.int64)])
    return _case(rng, np.clip(np.vstack([ends, near, axes]), _FORMAT.min_code, _FORMAT.max_code))


def _segments(unit, rng, count):
    """Vectors whose squared length is next to a border of a segment or of an octave, for each border."""
    model = unit.model
    starts = 1 + np.arange(1 << model.SEGMENT_BITS) / (1 << model.SEGMENT_BITS)
    squares = np.ravel([starts * 2.0**octave for octave in (-2, -1, 0, 1)])
    squares = squares[squares < 2.9] * 2.0**44
    x = np.floor(np.sqrt(squares) * 0.58).astype(np.int64) // 32 * 32
    y = np.sqrt((squares - x * x) * 0.5).astype(np.int64) // 32 * 32
    z = np.sqrt(squares - x * x - y * y).astype(np.int64) // 32 * 32
    near = [np.stack([x, y, z + offset * 32], axis=1) for offset in (-1, 0, 1, 2)]
    near = np.clip(np.vstack(near), _FORMAT.min_code, _FORMAT.max_code)
    return _case(rng, near)


def _last_bits(unit, rng, count):
    """Many vectors, because the last bits of products rarely change a result."""
    return _case(rng, _vectors(rng, count))


RECORD = Record(
    name="renormaliser",
    title="Vector divided by its length",
    source="docs/theory/interpolation.md#renormaliser",
    variants={"": Variant(RenormaliserUnit, _measure, "lengths 1/142 to 1")},
    expect=_expect,
    stimuli={
        "lengths": Stimulus(_lengths, 1000),
        "corners": Stimulus(_corners, 500),
        "segments": Stimulus(_segments, 500),
        "last bits": Stimulus(_last_bits, 100_000, stalled=False),
    },
    axis="length of the vector",
    logarithmic=True,
    waivers={
        "dot_product.*": "The unit takes each dot product at once, so the skid buffer inside is never used.",
    },
    still={
        "c2 is at most 0.695, c1 at most 0.9988; c1 - x c2 is between 0 and 1, and r between 0 and 2": (
            "coefficients.port__data[35] coefficients.port__data[47] c1[16] c2[11] slope[16] "
            "exact_slope[17-18] exact_r[18] rounded_r[17-18]"
        ),
        "a squared length is at most 3": "square[25]",
        "a product is less than 1/16 if its factors are less than 1/16 and 1": (
            "square_term[28] linear_term[33]"
        ),
    },
)
