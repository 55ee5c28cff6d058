"""Record of the diffuse unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE, ONE_SQUARED
from blysk.hdl.lighting.diffuse import DiffuseUnit

__all__ = ["RECORD"]


def _measure(rng, count):
    unit = Diffuse()
    codes = rng.integers(-ONE * ONE, ONE * ONE + 1, count)
    codes[:3] = -ONE * ONE, 0, ONE * ONE
    cosine = Fixed(unit.operand_format, codes)
    exact = codes / ONE**2
    found = unit.compute(cosine).values
    return Sample(found, np.maximum(exact, 0), np.maximum(cosine.values, 0), exact)


def _expect(unit, case):
    return unit.model.compute(Fixed(unit.model.operand_format, case.beats)).codes


def _words(unit, rng, count):
    """Cosines from -1 to 1, and words of every size with extreme codes."""
    codes = any_codes(rng, unit.model.operand_format, count)
    codes[::2] = rng.integers(-ONE * ONE, ONE * ONE, len(codes[::2]), endpoint=True)
    return Case(codes)


def _corners(unit, rng, count):
    """Cosines of 0 and 1, ties of rounding, and saturated words; codes next to all these; extreme codes."""
    format, step = unit.model.operand_format, 1 << 17
    centres = np.array([0, ONE_SQUARED.codes.item(), 1 << 34, (1 << 34) - step, step // 2, 3 * step // 2])
    codes = np.r_[(centres[:, np.newaxis] + [-1, 0, 1]).ravel(), format.min_code, format.max_code]
    return Case(rng.permutation(codes))


def _variants():
    yield "", Variant(DiffuseUnit, _measure, "N.L -1 to 1")
    for latency, interval in ((7, 1), (3, 2), (10, 2), (11, 3), (10, 6)):
        unit = partial(DiffuseUnit, latency=latency, initiation_interval=interval)
        is_long = (latency, interval) != (11, 3)
        yield f"latency {latency}, interval {interval}", Variant(unit, long=is_long)


RECORD = Record(
    name="diffuse",
    title="Lambert term of N·L",
    source="docs/theory/models.md#lighting; [B] 4, [T] 6",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={"words": Stimulus(_words, 2000), "corners": Stimulus(_corners, 20)},
    axis="N · L",
)
