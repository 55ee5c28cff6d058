"""Record of the mirror adapter."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.geometry.mirror_adapter import MirrorAdapter
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.geometry.vector_adapter import VectorSpans
from blysk.hdl.geometry.mirror_adapter import MirrorAdapterUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    spans = VectorSpans(**case.beats, triangle=np.zeros(0))
    return MirrorAdapter().compute(spans, case.constants["sine"], case.constants["cosine"]).beats


def _case(rng, length, angle):
    count, format = len(length), MirrorAdapter.FORMAT
    vectors = {
        name: np.maximum(any_codes(rng, format, count, 3), -format.max_code) for name in ("start", "step")
    }
    beats = vectors | {"exponent": rng.integers(0, 16, count), "length": length}
    beats |= {name: rng.integers(0, 4096, count) for name in ("x", "y")}
    depths = ("depth", SPAN_DEPTH), ("depth_step", DEPTH_STEP)
    beats |= {name: any_codes(rng, format, count) for name, format in depths}
    constants = {
        name: int(np.rint(value * (format.max_code - 1)))
        for name, value in (("sine", np.sin(angle)), ("cosine", np.cos(angle)))
    }
    return Case(beats | {"material": rng.integers(0, 1024, count)}, constants)


def _spans(unit, rng, count):
    """Spans of every length. The angle a is 26 degrees, whose sine and cosine have odd codes."""
    return _case(rng, np.maximum(4095 >> rng.integers(0, 13, count), 1), np.radians(26))


def _points(unit, rng, count):
    """Spans of one pixel, seldom of two. The angle a is 80 degrees."""
    return _case(rng, 1 + (rng.random(count) < 0.1), np.radians(80))


RECORD = Record(
    name="mirror_adapter",
    title="y cos a and y sin a of the vectors of spans, for highlights of R·V",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(MirrorAdapterUnit, note="products within 1/2 step"),
        "serial": Variant(
            partial(MirrorAdapterUnit, serial=True), note="products within 1/2 step", long=True
        ),
    },
    expect=_expect,
    stimuli={"spans": Stimulus(_spans, 600), "points": Stimulus(_points, 600)},
    axis="",
)
