"""Vertex sort: RTL against its bit-accurate model."""

import numpy as np
import pytest

from blysk.golden.geometry.triangles import Frame, Grid
from blysk.golden.geometry.vertex_sort import VertexSort
from blysk.golden.reference.scene import BACK_FACES
from blysk.hdl.geometry.vertex_sort import VertexSortUnit

from .drive import equals_model, random_triangles, small_frame


@pytest.mark.parametrize("bits", [4, 8])
@pytest.mark.parametrize("back_faces", BACK_FACES)
def test_equals_model(bits, back_faces):
    rng = np.random.default_rng(bits + len(back_faces))
    grid = Grid(bits)
    unit = VertexSortUnit(grid)
    for frame in (small_frame(rng, back_faces), Frame(-2048, -2048, 2047, 2047, back_faces)):
        triangles = random_triangles(rng, 1500, grid)
        drawn, counts = VertexSort(grid).compute(triangles, frame)
        assert 0 < len(drawn) < len(triangles)
        equals_model(unit, triangles.beats, drawn.beats, constants=frame.codes, status=counts)
