# amaranth: UnusedElaboratable=no
"""Proofs about the vertex sort: no triangle is lost, mixed with another, or stuck."""

import pytest
from amaranth.hdl import Cat, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.geometry.triangles import MATERIAL_BITS, Grid
from blysk.hdl.geometry import triangles, vertex_sort
from blysk.hdl.geometry.vertex_sort import VertexSortUnit

from .prover import Harness
from .rules import answers, stays, taken

pytestmark = pytest.mark.prove

LATENCY = 14
"""Cycles of a triangle with wide products."""

CYCLES = 20
"""From power-up. The memory of triangles, of 8 words here, is filled twice."""


@pytest.fixture(autouse=True)
def few_words(monkeypatch):
    """The memories have 8 and 4 words, because each of their bits is a register of the proof.

    For the same reason a corner has no normal, and factors have 14 bits.
    """
    monkeypatch.setattr(vertex_sort, "FACTOR_BITS", 14)
    monkeypatch.setattr(vertex_sort, "WAITING_TRIANGLES", 8)
    monkeypatch.setattr(vertex_sort, "_KEPT", 4)

    def corners_shape(grid, surface):
        return {name: shape for name, shape in triangles.corners_shape(grid).items() if name != "normal"}

    def triangle_shape(grid, surface):
        flags = {"material": unsigned(MATERIAL_BITS), "two_sided": unsigned(1)}
        return data.StructLayout(corners_shape(grid, surface) | flags)

    monkeypatch.setattr(vertex_sort, "corners_shape", corners_shape)
    monkeypatch.setattr(vertex_sort, "triangle_shape", triangle_shape)


def of_triangles():
    """Claims on triangles, whose material is their number. The depth of a corner repeats the number."""
    h = Harness(VertexSortUnit(Grid(4)))
    given, found = h.unit.i, h.unit.o
    number, left = Signal(5, name="number"), Signal(5, name="left")
    dropped = sum(h.unit.status[name] for name in ("empty", "zero_area", "culled"))[:5]
    words = Cat(Value.cast(depth)[:5] for depth in given.payload.depth)
    h.assume((given.payload.material == number) & (words == number.replicate(3)))
    h.m.d.sync += number.eq(number + taken(given))
    following = Signal(5, name="following")
    with h.m.If(taken(found)):
        h.m.d.sync += [left.eq(left + 1), following.eq(found.payload.material + 1)]
    inside = (number - left - dropped)[:5]
    h.claim(inside <= 16)
    h.claim(~found.valid | (found.payload.material >= following) & (found.payload.material < number))
    h.claim(~found.valid | inside.any())
    for depth in found.payload.depth:
        h.claim(~found.valid | (Value.cast(depth)[:5] == found.payload.material))
    gone, before = Signal(5, name="gone"), Signal(5, name="before")
    h.m.d.comb += gone.eq(left + dropped)
    h.m.d.sync += before.eq(gone)
    answers(h, inside.any(), gone != before, LATENCY + 4, found.ready)
    return h


def test_triangles_keep_their_order_and_words(prove):
    """In 20 cycles: a triangle leaves or is dropped once, in order, with its own words, and in time."""
    prove(of_triangles(), CYCLES)


def test_a_triangle_that_waits_stays(prove):
    """By induction: a valid triangle stays, with its words, until it is accepted."""
    h = Harness(VertexSortUnit(Grid(4)))
    stays(h, h.unit.o)
    prove(h)


BUGS = {
    "a waiting triangle is overwritten": ("_keep", "WAITING_TRIANGLES - _RESERVED", "WAITING_TRIANGLES"),
    "a triangle is read before its result": ("_keep", "wanted & some", "wanted"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each injected bug refutes the claims. Bugs of full memories take more cycles than `CYCLES`."""
    inject(VertexSortUnit, *BUGS[bug])
    refute(of_triangles(), CYCLES)
