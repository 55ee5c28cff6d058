"""Proofs of the pipeline: spans go to all that take them or to none, constants stay under a running span."""

import pytest
from amaranth.hdl import Mux, Signal

from golden.frame_constants import FIELDS_OF_A_FRAME
from golden.pipeline import ShadingPipeline
from hdl.pipeline import ShadingPipelineUnit

from .prover import Harness
from .rules import pixels_follow, stays, taken

pytestmark = pytest.mark.prove

NARROW = {"x_bits": 2, "y_bits": 1, "length_bits": 2}


def of_writes(parameters):
    """Spans inside are those taken in whose last pixel has not left.

    Assumed, as `of_places` and the proofs of the assembler have it: a last pixel leaves only while a span is
    inside, and there are at most as many as the FIFO of places and the assembler hold.
    """
    h = Harness(unit := ShadingPipelineUnit(parameters))
    inside = Signal(6)
    admitted = taken(unit.i) & (unit.i.payload.length != 0)
    finished = taken(unit.o) & unit.o.payload.last
    h.m.d.sync += inside.eq(inside + admitted - finished)
    h.assume(~finished | inside.any())
    h.assume(inside <= unit._places + unit._assembler.PLACES)
    h.claim(~taken(unit.write) | ~inside.any())
    h.claim(~(taken(unit.write) & taken(unit.i)))
    # What makes it inductive.
    h.claim((h.register("inside") == inside) & (h.register("idle") == ~inside.any()))
    return h


def of_constants():
    """Without lights: a pixel's colour is that of the last write before its span was taken in."""
    h = Harness(unit := ShadingPipelineUnit(ShadingPipeline(lights=0, grey=True, **NARROW)))
    ambient, (address, _) = Signal(17), FIELDS_OF_A_FRAME["ambient"]
    write = unit.write.payload
    with h.m.If(taken(unit.write) & (write.address == address)):
        h.m.d.sync += ambient.eq(write.data)
    rounded = (ambient + 32) >> 6
    h.claim(~unit.o.valid | (unit.o.payload.r == Mux(rounded > 255, 255, rounded)))
    return h


def of_places(parameters):
    """Pixels, and spans that the interpolator takes."""
    h = Harness(unit := ShadingPipelineUnit(parameters))
    span = unit.i.payload

    def image(span, place, last, pixel):
        return (pixel.x == (span.x + place)[:2]) & (pixel.y == span.y) & (pixel.last == last)

    stays(h, unit.o)
    pixels_follow(h, unit.i, unit.o, span.length, 120, image)
    if parameters.lights:
        h.claim(taken(unit._interpolator.i) == (taken(unit.i) & (span.length != 0)))
    return h


AMBIENT = ShadingPipeline(lights=0, grey=True, **NARROW)
LINEAR = ShadingPipeline(method="linear", model=None, grey=True, **NARROW)
GATED = ShadingPipeline(method="linear", exponent=10, gate=True, grey=True, **NARROW)


@pytest.mark.parametrize("parameters", [AMBIENT, LINEAR, GATED], ids=["ambient", "linear", "gated"])
def test_writes_wait_for_spans(prove, parameters):
    """Inductive: no write is taken while a span is inside, nor on the clock on which one is taken in."""
    prove(of_writes(parameters))


def test_constants_stay(prove):
    """In 16 clocks, one channel: each pixel has the colour of the last write before its span was taken in."""
    prove(of_constants(), 16)


@pytest.mark.parametrize(("parameters", "clocks"), [(AMBIENT, 12), (LINEAR, 34)], ids=["ambient", "linear"])
def test_admission_is_to_all_or_to_none(prove, parameters, clocks):
    """In so many clocks, spans of 0 to 3 pixels: every span that is taken in goes to the interpolator and to
    the places round it, so that its pixels leave in order, each at its place, the last of them marked."""
    prove(of_places(parameters), clocks)


BUGS = {
    "constants change under a span": (of_writes, AMBIENT, "frame.hold.eq(~idle)", "frame.hold.eq(0)"),
    "a span is taken in beside a write": (of_writes, AMBIENT, "free.eq(~self.write.valid & ", "free.eq("),
    "the interpolator takes what waits": (of_places, LINEAR, "others, offered & free", "others, offered"),
    "empty spans are counted": (of_writes, AMBIENT, "self.i.valid & ~empty", "self.i.valid"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, plant, bug):
    """Planted in `ShadingPipelineUnit`, each refutes one of the claims."""
    claims, parameters, *change = BUGS[bug]
    plant(ShadingPipelineUnit, "elaborate", *change)
    refute(claims(parameters), 20)
