"""Pixels of a simulated pipeline, held against those of its model."""

import numpy as np

from blysk.golden.pipeline import Pixels
from blysk.sim.engines.simulate import Run

__all__ = ["assert_pixels"]


def assert_pixels(run: Run, pixels: Pixels) -> None:
    """Hold what came out against pixels: coordinates, colours, ends of spans."""
    np.testing.assert_array_equal(run.beats["x"], pixels.x)
    np.testing.assert_array_equal(run.beats["y"], pixels.y)
    for channel, name in enumerate("rgb"):
        np.testing.assert_array_equal(run.beats[name], pixels.color[:, channel])
    np.testing.assert_array_equal(run.beats["last"], pixels.last)
