"""Tolerances of 1 - N·H for highlights, against the slopes of the models."""

import numpy as np
import pytest

from blysk.golden.frames.highlight_limits import HighlightLimits, highlight_tolerance
from blysk.golden.presets import MODELS

EXPONENTS = [1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000]


@pytest.mark.parametrize("model", MODELS)
def test_highlight_tolerance(model):
    """The tolerance is the steepest chord of each model in float64, times 1.25."""
    for n in EXPONENTS:
        worst = 0.0
        for end in (2.0, min(2.0, 12 / n)):
            u = np.linspace(0, end, 20_001)
            slope = np.abs(np.diff(MODELS[model].reflection.reflect(1 - u, n)) / np.diff(u))
            worst = max(worst, (255 * slope * highlight_tolerance(n, u[:-1])).max())
        assert worst <= HighlightLimits.TOLERANCE * (1.6 if n == 1 else 1.25)
        assert worst >= HighlightLimits.TOLERANCE * 0.75
