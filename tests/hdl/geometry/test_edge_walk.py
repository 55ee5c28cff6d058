"""Edge walk: RTL against its bit-accurate model, and its rate."""

import numpy as np
import pytest

from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.edge_walk import EdgeWalk
from blysk.golden.geometry.triangles import Frame, Grid
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.hdl.geometry.edge_walk import EdgeWalkUnit, walk_shape

from .drive import equals_model, random_triangles, small_frame


def walked(rng, count, grid, frame):
    drawn, _ = VertexSort(grid).compute(random_triangles(rng, count, grid), frame)
    edges = EdgeSetup(grid).compute(drawn)
    beats = drawn.beats | edges.beats
    return (
        drawn,
        {name: beats[name] for name in walk_shape(grid).members},
        EdgeWalk().compute(edges, drawn, frame),
    )


@pytest.mark.parametrize("bits", [8, pytest.param(4, marks=pytest.mark.long)])
def test_equals_model(bits):
    rng = np.random.default_rng(bits)
    grid = Grid(bits)
    unit = EdgeWalkUnit(grid)
    for frame in (small_frame(rng), Frame(-2048, -2048, 2047, 2047), Frame(-2048, 8, 2047, 2047)):
        drawn, beats, rows = walked(rng, 300, grid, frame)
        run = equals_model(unit, beats, rows.beats, constants=frame.codes, few=12)
        # A scanline a cycle, from the first triangle on.
        np.testing.assert_array_equal(run.cycles, unit.latency + np.arange(len(rows)))
        assert run.input_cycles[0] == 0
        assert len(drawn) > 20
