"""Record of the light adapter."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes, sphere
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.frame_constants import AXES_ADDRESS, AXIS_STRIDE, LIGHT_STRIDE
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.hdl.geometry.light_adapter import LightAdapterUnit

__all__ = ["RECORD"]


def _addresses(unit):
    """Address of each code of the axes, shape (lights, rows, 3)."""
    light, row, k = np.ogrid[1 : unit.lights + 1, : unit.rows, :3]
    return AXES_ADDRESS + LIGHT_STRIDE * light + AXIS_STRIDE * row + k


def _write(unit, codes):
    """Writes of axes. Writes to addresses of missing lights and of colours follow, and change no axis."""
    beyond = AXES_ADDRESS + (unit.lights + 1) * LIGHT_STRIDE
    address = [*_addresses(unit).ravel(), beyond, AXES_ADDRESS, LIGHT_STRIDE, 2 * LIGHT_STRIDE]
    return {"address": np.array(address), "data": np.r_[codes.ravel(), 1:5] & 0x3FFFF}


def _expect(unit, case):
    words = dict(zip(case.write["address"].tolist(), case.write["data"].tolist(), strict=True))
    codes = np.vectorize(words.get)(_addresses(unit)).reshape(-1, 3)
    spans = VectorSpans(**case.beats, triangle=np.zeros(0))
    return LightAdapter().compute(spans, LightAdapter.FORMAT.wrap(codes)).beats


def _case(unit, rng, length, codes, **vectors):
    count = len(length)
    beats = vectors | {"exponent": rng.integers(0, 16, count), "length": length}
    beats |= {name: rng.integers(0, 4096, count) for name in ("x", "y")}
    for name, format in (("depth", SPAN_DEPTH), ("depth_step", DEPTH_STEP)):
        beats[name] = any_codes(rng, format, count)
    return Case(beats | {"material": rng.integers(0, 1024, count)}, write=_write(unit, codes))


def _spans(unit, rng, count):
    """Vectors and steps no longer than 1, of spans of every length."""
    vectors = {
        name: np.rint(sphere(rng, count) * rng.uniform(0, 2**17 - 32, (count, 1))).astype(np.int64)
        for name in ("start", "step")
    }
    frames = np.linalg.qr(rng.normal(size=(unit.lights, 3, 3)))[0]
    codes = LightAdapter.codes_of(frames[:, : unit.rows])
    return _case(unit, rng, np.maximum(4095 >> rng.integers(0, 13, count), 1), codes, **vectors)


def _any(unit, rng, count):
    """Words of any codes. Vectors may be longer than 1, so sums wrap modulo 2. Most spans have one pixel."""
    vectors = {name: any_codes(rng, LightAdapter.FORMAT, count, 3) for name in ("start", "step")}
    codes = any_codes(rng, LightAdapter.FORMAT, unit.lights, unit.rows, 3)
    # The second component of an axis is the complement of the first. So every bit of the words changes.
    codes[..., 1] = ~codes[..., 0]
    return _case(unit, rng, 1 + (rng.random(count) < 0.3), codes, **vectors)


RECORD = Record(
    name="light_adapter",
    title="Vectors of spans in the frames of further lights",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(LightAdapterUnit, note="components within 1/2 step; axes of 18 bits"),
        "serial": Variant(
            partial(LightAdapterUnit, serial=True), note="components within 1/2 step", long=True
        ),
        "3 lights, serial": Variant(
            partial(LightAdapterUnit, 3, serial=True), note="components within 1/2 step", long=True
        ),
        "2 lights, no highlights": Variant(
            partial(LightAdapterUnit, 2, 1), note="components within 1/2 step", long=True
        ),
    },
    expect=_expect,
    stimuli={"spans": Stimulus(_spans, 600), "any": Stimulus(_any, 600)},
    axis="",
)
