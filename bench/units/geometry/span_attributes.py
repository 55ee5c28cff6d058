"""Record of the span attributes."""

from dataclasses import fields
from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant, first
from blysk.bench.units.triangles import Stages, random_triangles
from blysk.golden.geometry.gradient_setup import Gradients, GradientSetup
from blysk.golden.geometry.plane_assembler import Planes
from blysk.golden.geometry.span_attributes import SpanAttributes
from blysk.golden.geometry.span_clip import ClippedRows
from blysk.golden.geometry.triangles import ATTRIBUTES, GRID, FrameSettings
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.span_attributes import SpanAttributesUnit

__all__ = ["RECORD", "attributes_of"]


def _firsts(last):
    return np.r_[True, last[:-1]]


def _pieces(beats, whole):
    words = {field.name: beats["row"][field.name] for field in fields(ClippedRows)}
    rows, at = ClippedRows(**words), _firsts(words["last"])
    planes = {name: value[at] for name, value in beats["planes"].items()}
    formats = {"start": GradientSetup.START_FORMAT} | dict.fromkeys(
        ("short", "long", "inward"), GradientSetup.FORMAT
    )
    words = {name: Fixed(format, planes[name]) for name, format in formats.items()}
    return SpanAttributes(whole).compute(rows, Planes(Gradients(**words, size=np.zeros(0)), planes["piece"]))


def _rows_of(unit, beats):
    """Each scanline once, with the planes of its triangle, from the input beats of a unit."""
    if not unit.serial:
        return beats
    whole = len(beats["row"]["last"]) // ATTRIBUTES
    row = {name: value[: ATTRIBUTES * whole : ATTRIBUTES] for name, value in beats["row"].items()}
    planes = {
        name: value[: ATTRIBUTES * whole].reshape(whole, ATTRIBUTES)
        for name, value in beats["planes"].items()
    }
    return {"planes": planes | {"piece": planes["piece"][:, 0]}, "row": row}


def _beats_of(unit, planes, row):
    """Input beats of a unit: scanlines with their planes. A serial unit gets a beat for each attribute."""
    if unit.serial:
        row = {name: np.repeat(value, ATTRIBUTES) for name, value in row.items()}
        planes = {
            name: np.repeat(value, ATTRIBUTES) if name == "piece" else value.reshape(-1)
            for name, value in planes.items()
        }
    return {"planes": planes, "row": row}


def _expect(unit, case):
    beats = _pieces(_rows_of(unit, case.beats), unit.whole)[0].beats
    return attributes_of(beats) if unit.serial and unit.whole else beats


def attributes_of(spans):
    """Beats of whole spans, a beat for each attribute."""
    words = ("near", "far", "inward")
    return {
        name: value.reshape(-1) if name in words else np.repeat(value, ATTRIBUTES)
        for name, value in spans.items()
    }


def _status(unit, case):
    beats = _rows_of(unit, case.beats)
    counts, rows = _pieces(beats, unit.whole)[1], beats["row"]
    # The unit knows at the last scanline of a triangle whether the triangle is empty.
    begun = np.flatnonzero(_firsts(rows["last"]))[-1]
    unknown = not rows["last"][-1] and not rows["length"][begun:].any()
    counts["empty"] -= unknown
    return {"empty": counts["empty"]} if unit.whole else counts


def _case(unit, triangles, frame, count):
    # A few high triangles would fill the run, so only triangles lower than 64 pixels are kept.
    low = np.ptp(triangles.y, axis=1) < 64 * GRID.steps
    stages = Stages(triangles[low], frame)
    rows = stages.clipped
    triangle = np.cumsum(_firsts(rows.last)) - 1
    planes = {name: value[triangle] for name, value in stages.planes.beats.items()}
    return Case(first(_beats_of(unit, planes, rows.beats), count))


def _rows(unit, rng, count):
    """Scanlines of triangles of all kinds in a small picture. The limit cuts wide spans into pieces."""
    frame = FrameSettings(-18, -22, 21, 19, limit=100)
    return _case(unit, random_triangles(rng, count, spread=0.1), frame, count)


def _narrow(unit, rng, count):
    """Spans of few pixels that are not cut into pieces."""
    frame = FrameSettings(-18, -22, 21, 19, limit=1023)
    return _case(unit, random_triangles(rng, count, size=1.5, spread=0.0), frame, count)


def _any(unit, rng, count):
    """Planes of any codes, with pieces and spans of any length up to the largest.

    Sums wrap modulo 4, and words saturate.
    """
    triangles = rng.integers(1, 12, count)
    total = int(triangles.sum())
    last = np.zeros(total, dtype=bool)
    last[np.cumsum(triangles) - 1] = True
    flags = rng.integers(0, 2, (3, total)).astype(bool)
    length = (4095 >> rng.integers(0, 13, total)) - rng.integers(0, 2, total)
    skip = rng.integers(0, 4096 - length)
    covered = (length > 0) & (rng.random(total) < 0.9)
    rows = ClippedRows(
        x=np.where(covered, rng.integers(0, 4096 - length), 0),
        y=np.where(covered, rng.integers(0, 4096, total), 0),
        length=np.where(covered, length, 0),
        skip=np.where(covered & (rng.random(total) < 0.3), skip, 0),
        carry=flags[0],
        last=last,
        right=flags[1],
        flip=flags[2],
        material=rng.integers(0, 1024, total),
    )
    # Long spans with short pieces would give too many pieces.
    least = np.maximum(np.ceil(np.log2(np.maximum(length, 1))).astype(np.int64) - 3, 0)
    words = {"start": GradientSetup.START_FORMAT} | dict.fromkeys(
        ("short", "long", "inward"), GradientSetup.FORMAT
    )
    planes = {name: any_codes(rng, format, total, ATTRIBUTES) for name, format in words.items()}
    at = np.cumsum(_firsts(last)) - 1
    largest = np.zeros(count, dtype=np.int64)
    np.maximum.at(largest, at, least)
    planes["piece"] = np.minimum(largest + rng.integers(0, 4, count), 12)[at]
    return Case(_beats_of(unit, planes, rows.beats))


RECORD = Record(
    name="span_attributes",
    title="N/W and depth at both ends of each span, and of each piece of a wide span",
    source="docs/theory/geometry.md#normals",
    variants={
        "": Variant(SpanAttributesUnit, note="sums of the steps are exact"),
        "serial": Variant(partial(SpanAttributesUnit, serial=True), note="sums of the steps are exact"),
        "serial, whole": Variant(
            partial(SpanAttributesUnit, serial=True, whole=True),
            note="sums of the steps are exact",
            long=True,
        ),
        "whole": Variant(
            partial(SpanAttributesUnit, whole=True), note="sums of the steps are exact", long=True
        ),
    },
    expect=_expect,
    status=_status,
    stimuli={
        "rows": Stimulus(_rows, 1500),
        "narrow": Stimulus(_narrow, 1000),
        "any": Stimulus(_any, 100),
    },
    axis="",
    still={
        "a counter has room for more events than a run has": "count_empty[8-31] count_cut[9-31]",
        "a beat has all attributes side by side, so its flag of the last attribute is 1": "found[456]",
    },
)
