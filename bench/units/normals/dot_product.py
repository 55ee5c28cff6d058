"""Record of the dot-product unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, component_words, dot
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["RECORD"]


def _measure(rng, count):
    a, b = (rng.integers(-ONE - 1, ONE + 1, (count, 3)) for _ in range(2))
    ends = [-ONE - 1, ONE, 0]
    a[:3], b[:3] = np.transpose([ends] * 3), -ONE - 1
    exact = dot(a * COMPONENT.step, b * COMPONENT.step)
    return Sample(DotProduct().compute(*component_words(a, b)).values, exact, exact, exact)


def _expect(unit, case):
    p = unit.model
    return p.compute(Fixed(p.a_format, case.beats["a"]), Fixed(p.b_format, case.beats["b"])).codes


def _words(unit, rng, count):
    """Words of every size, with the extreme codes."""
    p = unit.model
    return Case({"a": any_codes(rng, p.a_format, count, 3), "b": any_codes(rng, p.b_format, count, 3)})


def _corners(unit, rng, count):
    """Every combination of extreme codes in a and in the first component of b.

    The other components of b are those of a.
    """
    ends = [COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1]
    a0, a1, a2, b0 = (grid.ravel() for grid in np.meshgrid(ends, ends, ends, ends))
    return Case({"a": np.stack([a0, a1, a2], axis=1), "b": np.stack([b0, a1, a2], axis=1)})


RECORD = Record(
    name="dot_product",
    title="Product of two vectors",
    source="docs/theory/interpolation.md#dot-product; [T] figure 2.5",
    variants={
        "": Variant(DotProductUnit, _measure, "all vectors of SQ(1, 17)", note="exact"),
        "SQ(2, 4)": Variant(partial(DotProductUnit, DotProduct(SQ(2, 4), SQ(2, 4)))),
    },
    expect=_expect,
    stimuli={"words": Stimulus(_words, 2000), "corners": Stimulus(_corners)},
    axis="a · b",
)
