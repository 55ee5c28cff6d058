"""Record of the vector adapter."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH, SPAN_NORMAL, SPAN_STEP, Pieces
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.vector_adapter import VectorAdapterUnit

__all__ = ["RECORD"]

_FORMATS = {
    "start": SPAN_NORMAL,
    "right": SPAN_NORMAL,
    "step": SPAN_STEP,
    "depth": SPAN_DEPTH,
    "depth_step": DEPTH_STEP,
}

_VECTORS = "start", "right", "step"


def _expect(unit, case):
    words = {name: value for name, value in case.beats.items() if name not in ("start", "shift")}
    words |= {name: Fixed(format, case.beats[name]) for name, format in _FORMATS.items() if name in words}
    words |= {name: words[name].astype(bool) for name in ("flip", "turned")}
    # The model reads `right` only to compute the shift. So here `right` is any vector that gives the shift.
    start = Fixed(SPAN_NORMAL, case.beats["start"])
    reach = 1 << (SPAN_NORMAL.fraction_bits - 1 - case.beats["shift"])
    right = Fixed(SPAN_NORMAL, np.repeat(reach[:, np.newaxis], 3, axis=1))
    pieces = Pieces(**words, left=start, right=right, depth_last=words["depth"], triangle=np.zeros(0))
    return unit.model.compute(pieces).beats


def _case(rng, **vectors):
    count = len(vectors["start"])
    ends = (Fixed(SPAN_NORMAL, vectors[name]) for name in ("start", "right"))
    beats = {"start": vectors["start"], "step": vectors["step"], "shift": SpanHalver().shift(*ends)}
    for name in ("depth", "depth_step"):
        beats[name] = any_codes(rng, _FORMATS[name], count)
    beats |= {name: rng.integers(0, 4096, count) for name in ("x", "y")}
    beats["length"] = vectors.get("length", rng.integers(1, 4096, count))
    flags = {name: rng.integers(0, 2, count) for name in ("flip", "turned")}
    return Case(beats | flags | {"material": rng.integers(0, 1024, count)})


def _lines(unit, rng, count):
    """Spans of 1 to 4095 pixels. At both ends N/W has any length, and the step leads from end to end."""
    start = sphere(rng, count) * 2.0 ** rng.uniform(-14, 0, (count, 1))
    end = start + np.linalg.norm(start, axis=1, keepdims=True) * rng.uniform(-0.5, 0.5, (count, 3))
    length = 4095 >> rng.integers(0, 12, count)
    step = (end - start) / np.maximum(length - 1, 1)[:, np.newaxis]
    vectors = {}
    for name, value in zip(_VECTORS, (start, end, step), strict=True):
        vectors[name] = Fixed.round(_FORMATS[name], np.clip(value, -1, 1 - 2.0**-26)).codes
    return _case(rng, length=length, **vectors)


def _any(unit, rng, count):
    """Any codes of vectors and steps, extreme codes among them."""
    return _case(rng, **{name: any_codes(rng, _FORMATS[name], count, 3) for name in _VECTORS})


def _sizes(unit, rng, count):
    """Vectors whose largest component is a power of two, or a step less. They decide each bit of a shift."""
    beats = {}
    for name in _VECTORS:
        bits = _FORMATS[name].width - 1
        largest = rng.integers(0, bits, (count, 1))
        codes = rng.integers(0, 1 << largest, (count, 3), endpoint=True)
        codes[:, 0] = (1 << largest[:, 0]) - rng.integers(0, 2, count)
        codes = np.where(rng.random((count, 3)) < 0.5, codes, ~codes)
        beats[name] = rng.permuted(codes, axis=1)
    return _case(rng, **beats)


RECORD = Record(
    name="vector_adapter",
    title="N/W at the first pixel of a span and its step, as words of the quotient method",
    source="docs/theory/geometry.md#composition",
    variants={
        "": Variant(VectorAdapterUnit, note="words within 1/2 step; shifts are exact"),
        "several lights": Variant(
            partial(VectorAdapterUnit, VectorAdapter(rotates=True)), note="words within 1/2 step", long=True
        ),
    },
    expect=_expect,
    stimuli={
        "lines": Stimulus(_lines, 1000),
        "any": Stimulus(_any, 1000),
        "sizes": Stimulus(_sizes, 1000),
    },
    axis="",
)
