"""Gradient setup: RTL against its bit-accurate model."""

import numpy as np
import pytest

from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.triangles import ATTRIBUTE, Frame
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.golden.number.fixed import Fixed
from blysk.hdl.geometry.gradient_setup import GradientSetupUnit

from .drive import equals_model, random_triangles


def attributes(rng, count):
    """Beats of one attribute a triangle, and their gradients."""
    triangles = random_triangles(rng, count)
    drawn, _ = VertexSort().compute(triangles, Frame(-2048, -2048, 2047, 2047))
    edges = EdgeSetup().compute(drawn)
    scales = PlaneSetup().compute(drawn, edges)
    values = drawn.triangles.attributes[np.arange(len(drawn)), :, rng.integers(0, 4, len(drawn))]
    ends = rng.random(len(values)) < 0.05
    values[ends] = rng.choice([ATTRIBUTE.min_code, ATTRIBUTE.max_code, 0], (ends.sum(), 3))
    gradients = GradientSetup().compute(*(Fixed(ATTRIBUTE, values[:, k]) for k in range(3)), scales)
    least = rng.integers(0, 3457, len(drawn))
    corners = dict(zip(("first", "middle", "last"), values.T, strict=True))
    scales = {name: value for name, value in scales.beats.items() if name != "sliver"}
    return corners | scales | {"least": least}, gradients.beats | {"least": least}


@pytest.mark.parametrize(
    ("interval", "multipliers"), [(4, 3), (12, 1), pytest.param(6, 2, marks=pytest.mark.long)]
)
def test_equals_model(interval, multipliers):
    rng = np.random.default_rng(interval)
    unit = GradientSetupUnit(interval)
    assert unit.multipliers == multipliers
    beats, expected = attributes(rng, 4000)
    run = equals_model(unit, beats, expected, few=12)
    np.testing.assert_array_equal(run.input_cycles, np.arange(len(run.cycles)) * interval)
    np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)


def test_refusal():
    with pytest.raises(ValueError, match=r"^initiation_interval must be at least 4, not 3$"):
        GradientSetupUnit(3)
