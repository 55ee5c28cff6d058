# amaranth: UnusedElaboratable=no
"""Proof that each sample of a shared edge is drawn exactly once, with two triangles that are walked side by
side.

The edge is the long edge of one triangle, on its right, and the upper short edge of the other triangle, on
its left. The edge setup gives both the same numbers, because it takes the corners of an edge from top to
bottom in every triangle. Everything else of both triangles is free. Only the number of scanlines of the edge
is reduced, to `ROWS`.
"""

import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.triangles import Grid
from blysk.hdl.geometry.edge_walk import EdgeWalkUnit, rows_shape, walk_shape
from blysk.hdl.geometry.triangles import frame_shape

from .prover import Harness

pytestmark = pytest.mark.prove

GRID, ROWS = Grid(4), 3
LONG, UPPER = 0, 1
"""Edges of a triangle in the walk."""

OF_AN_EDGE = "x", "error", "step", "error_step", "height"


class Neighbours(wiring.Component):
    """Two walks that begin in the same cycle."""

    i: In(stream.Signature(data.StructLayout({"left": walk_shape(GRID), "right": walk_shape(GRID)})))
    constants: In(frame_shape())
    left: Out(rows_shape())
    right: Out(rows_shape())
    both: Out(1)

    def elaborate(self, platform):
        m = Module()
        m.submodules.left, m.submodules.right = walks = EdgeWalkUnit(GRID), EdgeWalkUnit(GRID)
        given = (self.i.payload.left, self.i.payload.right)
        m.d.comb += self.i.ready.eq(walks[0].i.ready & walks[1].i.ready)
        for walk, triangle, row in zip(walks, given, (self.left, self.right), strict=True):
            m.d.comb += [
                walk.i.payload.eq(triangle),
                walk.i.valid.eq(self.i.valid & self.i.ready),
                walk.constants.eq(self.constants),
                walk.o.ready.eq(1),
                row.eq(walk.o.payload),
            ]
        m.d.comb += self.both.eq(walks[0].o.valid & walks[1].o.valid)
        return m


def covers(row, sample):
    return (row.begin <= sample) & (sample < row.end)


def covers_its_end(row, sample):
    return (row.begin <= sample) & (row.end >= sample)


def of_neighbours(covers):
    """Claims on the scanlines that both triangles have."""
    harness = Harness(unit := Neighbours())
    left, right = unit.i.payload.left, unit.i.payload.right
    for name in OF_AN_EDGE:
        harness.assume(left[name][LONG] == right[name][UPPER])
    rows = left.upper + left.lower
    # The edge setup gives this if the upper edge has no scanlines.
    for triangle in (left, right):
        harness.assume(triangle.flat == (triangle.upper == 0))
    harness.assume((left.first == right.first) & (rows == right.upper) & (rows != 0) & (rows <= ROWS))
    harness.assume((right.lower <= 1) & left.right & right.right)
    sample = harness.free(unit.left.begin.shape(), "sample")
    harness.claim(~unit.both | (unit.left.y == unit.right.y))
    inside = (unit.left.begin <= unit.right.begin) & (unit.left.end <= unit.right.end)
    of_both = (unit.left.begin <= sample) & (sample < unit.right.end)
    once = covers(unit.left, sample) ^ covers(unit.right, sample)
    harness.claim(~(unit.both & inside & of_both) | once)
    return harness


def walks_on(harness):
    """Claim that both triangles have no common scanline after the first. This claim is to be refuted."""
    other, seen = harness.without_claims(), Signal()
    other.m.d.sync += seen.eq(harness.unit.both)
    other.claim(~(seen & harness.unit.both))
    return other


CYCLES = 10
"""Cycles in which a counterexample is searched."""


def test_each_sample_is_drawn_once(prove, refute):
    """By induction, for any pairs of triangles one after the other.

    A second claim, which is refuted, shows that both walk on.
    """

    harness = of_neighbours(covers)
    prove(harness)
    refute(walks_on(harness), CYCLES)


def test_an_end_that_counts_twice_is_found(refute):
    """``>=`` in place of ``>`` at the right end is found."""
    refute(of_neighbours(covers_its_end), CYCLES)


def test_another_rounding_of_the_long_edge_is_found(refute, inject):
    """``>`` in place of ``>=`` at the carry of the long edge is found."""
    fault = "edge.carry.eq(less > 0 if name == 'long' else less >= 0)"
    inject(EdgeWalkUnit, "_edge", "edge.carry.eq(less >= 0)", fault)
    refute(of_neighbours(covers), CYCLES)
