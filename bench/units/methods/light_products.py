"""Record of the products of a normal with the vectors of every light."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import component_words, light_constants, unit_codes, word_ends
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.methods.light_products import LightProductsUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD"]


def _expect(unit, case):
    (normals,) = component_words(case.beats)
    vectors = component_words(case.constants["direction"], case.constants["halfway"])
    beats = np.zeros((len(case.beats), unit.lights), dtype_of(unit.o.payload.shape().elem_shape))
    for name, words in zip(("cosine", "highlight"), unit.model.products(normals, *vectors), strict=True):
        if name in beats.dtype.names:
            beats[name] = words.codes
    return beats


def _normals(unit, rng, count):
    """Unit normals. Some are equal or opposite to L or H of a light, and some have extreme codes.

    The first light has H = L, the second an H of 0, and the third has L and H along axes.
    """
    direction, halfway = (unit_codes(rng, unit.lights) for _ in range(2))
    halfway[0] = direction[0]
    halfway[1:2] = 0
    direction[2:3], halfway[2:3] = [0, 0, ONE], [0, -ONE, 0]
    normals = unit_codes(rng, count)
    some = rng.integers(0, unit.lights, count // 10)
    normals[: len(some)] = np.where(np.arange(len(some))[:, np.newaxis] % 2, direction[some], halfway[some])
    normals[len(some) : 2 * len(some)] = -normals[: len(some)]
    normals[-count // 5 :] = word_ends(rng, -(-count // 5), 3)
    return Case(rng.permutation(normals), light_constants(unit, direction, halfway))


def _corners(unit, rng, count):
    """Vectors and normals of extreme codes. Their differences and products are the largest."""
    vectors = (word_ends(rng, unit.lights, 3) for _ in range(2))
    return Case(word_ends(rng, count, 3), light_constants(unit, *vectors))


def _variants():
    chord = LinearInterpolator("one_minus_cosine")
    yield "of a chord", Variant(partial(LightProductsUnit, chord))
    yield "cosines", Variant(LightProductsUnit)
    for lights, interval in ((2, 3), (2, 1), (5, 1), (1, 3), (2, 12)):
        for name, method in (("of a chord", chord), ("cosines", LinearInterpolator())):
            unit = partial(LightProductsUnit, method, lights, initiation_interval=interval)
            yield f"{name}, {lights} lights, interval {interval}", Variant(unit, long=interval != 3)
    yield "no highlights", Variant(partial(LightProductsUnit, None, 2, highlights=False))


RECORD = Record(
    name="light_products",
    title="Products of a normal with L and H of every light",
    source="docs/theory/interpolation.md#dot-product; [T] figure 2.5",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={"normals": Stimulus(_normals, 1000, repeats=2), "corners": Stimulus(_corners, 300, repeats=16)},
    axis="",
    still={
        "L and H are constant in a run, so no bit of these factors falls": (
            "multiplier_?_b[0-17] multiplier_?[0-17]"
        ),
        "a square is 0 or 1 modulo 4": "multiplier_{3-5}_product[1]",
        "a sum of three squares of at most 2^34 is not negative, and less than 2^36": (
            "multiplier_{3-5}_product[35] highlight_0_square_partial[36] highlight_0_square_total[36-37] "
            "highlight_0_aligned[38-39]"
        ),
    },
)
