"""Pixels of a simulated pipeline, held against those of its twin."""

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.pipeline import Pixels, Spans
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.frame import beats_of

__all__ = ["assert_equals_twin", "assert_pixels"]


def assert_pixels(run: Run, pixels: Pixels) -> None:
    """Hold what came out against pixels: places, colours, ends of spans."""
    np.testing.assert_array_equal(run.beats["x"], pixels.x)
    np.testing.assert_array_equal(run.beats["y"], pixels.y)
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(run.beats[name], pixels.color[:, channel])
    np.testing.assert_array_equal(run.beats["last"], pixels.last)


def assert_equals_twin(
    unit: ShadingPipelineUnit, spans: Spans, constants: FrameConstants, pixels: Pixels, **stalls: np.ndarray
) -> Run:
    """Run spans in the compiled engine; hold the twin's pixels, of several colours, and its wide spans."""
    assert len(np.unique(pixels.color)) > 1
    beats, write = beats_of(unit, spans), constants.writes()
    run = simulate(unit, beats, count=len(pixels.x), write=write, engine="auto", **stalls)
    assert_pixels(run, pixels)
    assert run.status["out_of_range_spans"] == pixels.out_of_range_spans
    return run
