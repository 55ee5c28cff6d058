"""Record of the serial vectors."""

from dataclasses import replace
from functools import partial, wraps

import numpy as np

from blysk.bench.units.geometry.span_attributes import attributes_of
from blysk.bench.units.geometry.span_halver import RECORD as HALVER
from blysk.bench.units.record import Record, Stimulus, Variant, once
from blysk.golden.geometry.span_attributes import SPAN_STEP, WholeSpans
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import ATTRIBUTES
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.serial_vectors import SerialVectorsUnit

__all__ = ["RECORD"]


@once
def _pieces(unit, case):
    count = len(case.beats["x"]) // ATTRIBUTES
    beats = {name: value[: ATTRIBUTES * count] for name, value in case.beats.items()}
    words = {name: value[::ATTRIBUTES] for name, value in beats.items()}
    for name in ("near", "far", "inward"):
        words[name] = Fixed(SPAN_STEP, beats[name].reshape(count, ATTRIBUTES))
    words |= {name: words[name].astype(bool) for name in ("right", "flip")}
    return SpanHalver(unit.rotates).compute(WholeSpans(**words, triangle=np.zeros(count, dtype=np.int64)))


def _serial(stimulus):
    """Function that makes a stimulus of the span halver, with a beat for each attribute."""

    @wraps(stimulus.make)
    def make(unit, rng, count):
        case = stimulus.make(unit, rng, -(-count // ATTRIBUTES))
        return replace(case, beats=attributes_of(case.beats))

    return make


RECORD = Record(
    name="serial_vectors",
    title="Spans that come attribute by attribute, cut into pieces, as words of the quotient method",
    source="docs/theory/geometry.md#composition",
    variants={
        "": Variant(SerialVectorsUnit, note="words within 1/2 step"),
        "several lights": Variant(
            partial(SerialVectorsUnit, rotates=True), note="words within 1/2 step", long=True
        ),
    },
    expect=lambda unit, case: VectorAdapter(unit.rotates).compute(_pieces(unit, case)[0]).beats,
    status=lambda unit, case: {"cut": _pieces(unit, case)[1]},
    stimuli={
        name: Stimulus(_serial(stimulus), ATTRIBUTES * stimulus.count, variants=stimulus.variants)
        for name, stimulus in HALVER.stimuli.items()
    },
    axis="",
    still={
        "a counter has room for more than a run has": "count_cut[10-31]",
        "the output takes the exponent from a register of its own": "result[108-111]",
    },
)
