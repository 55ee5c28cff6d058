"""Record of the span clip."""

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.triangles import WHOLE, frame_of
from blysk.golden.geometry.edge_walk import Rows
from blysk.golden.geometry.span_clip import SpanClip
from blysk.golden.geometry.triangles import FrameSettings
from blysk.hdl.geometry.span_clip import SpanClipUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    rows = Rows(triangle=np.zeros(0), **case.beats)
    return SpanClip().compute(rows, frame_of(case.constants)).beats


def _rows(rng, count, frame):
    near = rng.integers(0, 2, count) == 0
    begin, end = np.where(near, rng.integers(-60, 80, (2, count)), rng.integers(-2048, 2049, (2, count)))
    y = np.where(near, rng.integers(-60, 80, count), rng.integers(-2048, 2048, count))
    borders = [frame.left, frame.right, frame.left - 1, frame.right + 1]
    begin[::9], end[::7] = rng.choice(borders, len(begin[::9])), rng.choice(borders, len(end[::7]))
    y[::5] = rng.choice([frame.top, frame.top - 1, frame.bottom - 1], len(y[::5]))
    flags = rng.integers(0, 2, (4, count)).astype(bool)
    beats = dict(zip(("carry", "last", "right", "flip"), flags, strict=True))
    # No scanline is below the picture.
    y = np.minimum(y, frame.bottom - 1)
    beats |= {"y": y, "begin": begin, "end": end, "material": rng.integers(0, 1024, count)}
    return Case(beats, frame.codes)


def _small(unit, rng, count):
    """Scanlines about the borders of a small picture, and far from the picture."""
    return _rows(rng, count, FrameSettings(-30, -20, 40, 50))


def _whole(unit, rng, count):
    """A picture of nearly all the grid."""
    return _rows(rng, count, WHOLE)


def _row(unit, rng, count):
    """A picture of one scanline."""
    return _rows(rng, count, FrameSettings(-2047, 5, 2048, 6))


def _pixel(unit, rng, count):
    """A picture of the grid's last pixel."""
    return _rows(rng, count, FrameSettings(2047, 2047, 2048, 2048))


RECORD = Record(
    name="span_clip",
    title="Scanlines of triangles, clipped to the picture",
    source="[T] figure 4.10",
    variants={"": Variant(SpanClipUnit, note="exact")},
    expect=_expect,
    stimuli={
        "small": Stimulus(_small, 2000),
        "whole": Stimulus(_whole, 1000),
        "row": Stimulus(_row, 1000),
        "pixel": Stimulus(_pixel, 500),
    },
    axis="",
)
