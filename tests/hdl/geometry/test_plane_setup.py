"""Plane setup: RTL against its bit-accurate model."""

import numpy as np
import pytest

from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.triangles import Frame, Grid
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.hdl.geometry.plane_setup import PlaneSetupUnit

from .drive import equals_model, random_triangles


@pytest.mark.parametrize(
    ("bits", "interval"), [(8, 16), (8, 24), pytest.param(4, 16, marks=pytest.mark.long)]
)
def test_equals_model(bits, interval):
    rng = np.random.default_rng(bits)
    grid = Grid(bits)
    unit = PlaneSetupUnit(grid, interval)
    assert unit.multipliers == 1
    triangles = random_triangles(rng, 1500, grid)
    drawn, _ = VertexSort(grid).compute(triangles, Frame(-2048, -2048, 2047, 2047))
    edges, y = EdgeSetup(grid).compute(drawn), drawn.triangles.y
    scales = PlaneSetup(grid).compute(drawn, edges)
    assert 0 < scales.sliver.sum() < len(scales) / 2
    beats = {
        "long_height": edges.height[:, 0],
        "knee": y[:, 1] - y[:, 0],
        "area": drawn.area,
        "fraction": edges.fraction,
        "down": edges.down,
        "along": edges.along,
        "right": drawn.right,
    }
    run = equals_model(unit, beats, scales.beats, few=8)
    np.testing.assert_array_equal(run.input_cycles, np.arange(len(drawn)) * interval)
    np.testing.assert_array_equal(run.cycles, run.input_cycles + unit.latency)
