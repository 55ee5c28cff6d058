"""Edge setup: RTL against its bit-accurate model."""

import numpy as np
import pytest

from blysk.golden.geometry.edge_setup import EdgeSetup
from blysk.golden.geometry.triangles import Frame, Grid
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.hdl.geometry.edge_setup import EdgeSetupUnit

from .drive import equals_model, random_triangles


def sorted_triangles(rng, count, grid, size=12.0):
    frame = Frame(-2048, -2048, 2047, 2047, "flip")
    return VertexSort(grid).compute(random_triangles(rng, count, grid, size), frame)[0]


def edge_beats(drawn):
    beats = drawn.beats
    return {name: beats[name] for name in ("x", "y", "area", "right", "flip", "material")}


def expected_edges(drawn, grid):
    edges = EdgeSetup(grid).compute(drawn)
    beats, y = drawn.beats, drawn.triangles.y
    tag = {name: beats[name] for name in ("area", "right", "flip", "material")}
    return edges.beats | tag | {"knee": y[:, 1] - y[:, 0], "long_height": edges.height[:, 0]}


LONG = pytest.mark.long


@pytest.mark.parametrize(
    ("bits", "dividers", "bits_per_cycle", "interval"),
    [
        (8, 3, 2, 16),
        (8, 1, 1, 67),
        pytest.param(4, 3, 2, 16, marks=LONG),
        pytest.param(8, 1, 2, 37, marks=LONG),
        pytest.param(4, 1, 1, 55, marks=LONG),
        pytest.param(8, 3, 1, 32, marks=LONG),
    ],
)
def test_equals_model(bits, dividers, bits_per_cycle, interval):
    rng = np.random.default_rng(bits + dividers)
    grid = Grid(bits)
    unit = EdgeSetupUnit(grid, dividers, bits_per_cycle)
    assert unit.initiation_interval == unit.least_interval == interval
    drawn = sorted_triangles(rng, 1200, grid)
    equals = equals_model(unit, edge_beats(drawn), expected_edges(drawn, grid), few=8)
    np.testing.assert_array_equal(equals.input_cycles, np.arange(len(drawn)) * interval)
    np.testing.assert_array_equal(equals.cycles, equals.input_cycles + unit.latency)
