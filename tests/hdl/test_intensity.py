"""Intensity unit: RTL against its twin, clock by clock, for numbers of lights."""

import numpy as np
import pytest

from golden.fixed import Fixed
from golden.intensity import Intensity
from hdl.intensity import IntensityUnit


@pytest.mark.parametrize("lights", [1, 2, 3, 16])
def test_equals_twin(verify, lights):
    rng = np.random.default_rng(lights)
    color, term = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT
    for brightness in (1, 8):
        ambient = rng.integers(0, 255 * 64 * brightness, 3)
        colors = rng.integers(0, 255 * 64 * brightness, (2, lights, 3))
        terms = rng.integers(0, term.max_code + 1, (2, 800, lights))
        terms[:, :50] = term.max_code
        terms[:, 50:100] = 0
        expected = Intensity(lights).compute(
            Fixed(color, ambient),
            Fixed(color, colors[0]),
            Fixed(color, colors[1]),
            Fixed(term, terms[0]),
            Fixed(term, terms[1]),
        )
        verify(
            IntensityUnit(Intensity(lights)),
            {"diffuse": terms[0], "specular": terms[1]},
            {name: expected[:, channel] for channel, name in enumerate("rgb")},
            constants={"ambient": ambient, "diffuse": colors[0], "specular": colors[1]},
        )
