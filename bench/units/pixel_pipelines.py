"""Record of the shading pipelines for different scanlines, with their merged stream."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.operands import short_lengths
from blysk.bench.units.pipeline import spans_of
from blysk.bench.units.pipeline_spans import any_constants, any_spans, constants_written, ends_for
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.frame_constants import MATERIAL_ADDRESS, writes_of
from blysk.golden.pipeline import Spans
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.presets import preset
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats

__all__ = ["RECORD"]

_COUNTED = (1 << 16) + 2
"""Number of spans that is larger than the largest value of a counter of 16 bits."""

_DEFAULT = "2 pipelines, without lights"

_MOST = 65535
"""Largest value of a counter."""


def _pixels(unit, case):
    design = unit.model.design
    return unit.model.compute(spans_of(design, case.beats), constants_written(design, case.write))


def _status(unit, case):
    length, pixels = case.beats["length"], _pixels(unit, case)
    return {
        "out_of_range_spans": min(pixels.out_of_range_spans, _MOST),
        "empty_spans": min(int(np.count_nonzero(length == 0)), _MOST),
        "overrun": int(np.any(case.beats["x"] + length > 1 << unit.model.design.x_bits)),
    }


def _case(unit, rng, spans: Spans) -> Case:
    design = unit.model.design
    constants = any_constants(rng, design, spans)
    return Case(beats_of(unit, ends_for(design, spans)), write=writes_of(constants))


def _spans(unit, rng, count):
    """Spans of every length and angle on any scanline, some of them empty."""
    return _case(unit, rng, any_spans(rng, unit.model.design, short_lengths(rng, count)))


def _scanlines(unit, rng, count):
    """40 spans for one pipeline, then 40 spans for the next pipeline. FIFOs fill up and run empty."""
    pipes, design = unit.model.pipes, unit.model.design
    spans = any_spans(rng, design, rng.integers(0, 16, count // 8))
    turn = np.arange(len(spans)) // 40
    return _case(unit, rng, replace(spans, y=(spans.y // pipes * pipes + turn) % (1 << design.y_bits)))


def _constants(unit, rng, count):
    """Constants of any codes, written over other constants. The material changes often."""
    design = unit.model.design
    spans = any_spans(rng, design, rng.integers(0, 5, count))
    spans = replace(spans, material=np.arange(count) // 7 % design.materials)
    constants = [
        replace(
            each,
            exponent=int(rng.integers(1, 1 << 10)),
            ambient=rng.integers(0, 1 << rng.integers(10, 18), 3),
        )
        for each in any_constants(rng, design, spans)
    ]
    write = writes_of(constants)
    others = rng.integers(0, 1 << 18, (6, len(write["data"])))
    # The index of a material is not changed, because the material must exist.
    others = np.where(write["address"] == MATERIAL_ADDRESS, write["data"], others)
    address = np.tile(write["address"], len(others) + 1)
    beats = beats_of(unit, ends_for(design, spans))
    return Case(beats, write={"address": address, "data": np.r_[others.ravel(), write["data"]]})


def _counters(unit, rng, count):
    """More empty spans in all pipelines than a counter holds. The last span goes past the last column."""
    design, pipes = unit.model.design, unit.model.pipes
    kinds = any_spans(rng, design, np.array([0, 2]))
    spans = kinds[np.r_[np.zeros(_COUNTED, dtype=int), 1]]
    spans.x[-1] = (1 << design.x_bits) - 1
    return _case(unit, rng, replace(spans, y=np.arange(len(spans)) % pipes))


def _variants():
    few = {"x_bits": 6, "y_bits": 3, "length_bits": 4}
    for name, pipes, waiting, design in (
        (_DEFAULT, 2, 5, preset(model="cosquad", lights=0, materials=2, **few)),
        ("4 pipelines, linear", 4, 9, preset("linear", "cosquad", y_bits=4)),
        ("4 pipelines, quotient, 3 materials", 4, 33, preset(materials=3)),
        ("8 pipelines, quadratic, compact", 8, 17, preset("quadratic", "cosquad", style="compact")),
    ):
        unit = partial(MergedPipelinesUnit, PixelPipelines(design.built(pipes=pipes)), waiting)
        yield name, Variant(unit, long=pipes > 2)


RECORD = Record(
    name="pixel_pipelines",
    title="Several pipelines, each for spans of other scanlines, and their pixels in the order of the spans",
    source="docs/theory/units.md#pipeline",
    variants=dict(_variants()),
    expect=lambda unit, case: pixel_beats(_pixels(unit, case)),
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 1500),
        "scanlines": Stimulus(_scanlines, 1500),
        "constants": Stimulus(_constants, 250, repeats=12, variants=(_DEFAULT,)),
        "counters": Stimulus(_counters, stalled=False),
    },
    axis="",
    waivers={
        "pixel_assembler.$signal$*": (
            "All scanlines of a pipeline have the same remainder of y, so the bit is 0 already."
        ),
    },
    still={
        "without an interpolator no span is out of range": "pipelines.sum_out_of_range_spans[0-15]",
        "a counter stays at its largest value, and a flag stays 1": "sum_empty_spans[15] sum_overrun[0]",
        "all scanlines of a pipeline have the same remainder of y": "pipelines.{read,word}[6]",
    },
)
