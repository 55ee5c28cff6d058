"""Span clip: RTL against its bit-accurate model."""

import numpy as np

from blysk.golden.geometry.edge_walk import Rows
from blysk.golden.geometry.span_clip import SpanClip
from blysk.golden.geometry.triangles import Frame
from blysk.hdl.geometry.span_clip import SpanClipUnit

from .drive import equals_model


def test_equals_model():
    rng = np.random.default_rng(1)
    unit = SpanClipUnit()
    count = 2500
    for frame in (
        Frame(-30, -20, 40, 50),
        Frame(-2048, -2048, 2047, 2047),
        Frame(-2047, 5, 2048, 6),
        Frame(2047, 2047, 2048, 2048),
    ):
        near = rng.integers(0, 2, count) == 0
        begin, end = np.where(near, rng.integers(-60, 80, (2, count)), rng.integers(-2048, 2049, (2, count)))
        y = np.where(near, rng.integers(-60, 80, count), rng.integers(-2048, 2048, count))
        borders = [frame.left, frame.right, frame.left - 1, frame.right + 1]
        begin[::9], end[::7] = rng.choice(borders, len(begin[::9])), rng.choice(borders, len(end[::7]))
        y[::5] = rng.choice([frame.top, frame.top - 1, frame.bottom - 1], len(y[::5]))
        # No scanline is below the picture.
        y = np.minimum(y, frame.bottom - 1)
        flags = rng.integers(0, 2, (4, count)).astype(bool)
        carry, last, right, flip = flags
        rows = Rows(np.arange(count), y, begin, end, carry, last, right, flip, rng.integers(0, 1024, count))
        equals_model(unit, rows.beats, SpanClip().compute(rows, frame).beats, constants=frame.codes)
