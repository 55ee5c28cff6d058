"""Proofs of the highlight-cosine unit: all pixels of a span leave in order, each with its angle."""

import pytest
from amaranth.hdl import Cat, Value

from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken
from .stubs import short_wave

pytestmark = pytest.mark.prove

LATENCY = 3


@pytest.fixture(autouse=True)
def stub(monkeypatch):
    """A stub of the wave: two registers for two bits of the angle and a bit of cos beta."""

    def bits(theta, cos_beta):
        return Cat(theta[:2], Value.cast(cos_beta)[0])

    monkeypatch.setattr(HighlightCosineUnit, "latency", LATENCY)
    monkeypatch.setattr(HighlightCosineUnit, "_wave", short_wave(bits))


def of_pixels():
    """Claim on spans of 0 to 3 pixels, whose angles fall by one step of the word at each pixel."""
    unit = HighlightCosineUnit()
    h = Harness(unit)
    span = unit.i.payload
    h.assume((span.length <= 3) & (Value.cast(span.step) == 1))

    def image(span, place, last, value):
        phase = Value.cast(span.phase)[:2]
        return Value.cast(value)[:3] == Cat((phase - place)[:2], Value.cast(span.cos_beta)[0])

    stays(h, unit.o)
    owed = pixels_follow(h, unit.i, unit.o, span.length[:2], LATENCY + 3, image)
    answers(h, owed.any(), taken(unit.o), LATENCY - 1, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, 3, unit.o.ready)
    return h


def test_pixels(prove):
    """By induction, for lengths 0 to 3 and `LATENCY` cycles in place of 12: pixels leave in order and once
    each.

    Each pixel has its angle and its span's cos beta, and a pixel that waits does not change. While the output
    is ready, the first pixel leaves `LATENCY` cycles after its span was accepted, and then one in every
    cycle. A span is taken after at most 4 cycles.
    """
    prove(of_pixels())


BUGS = {
    "it moves while it is stalled": ("advance.eq(skid_buffer(", "advance.eq(1 | skid_buffer("),
    "a span is accepted while it is stalled": ("self.i.ready.eq(advance & ends)", "self.i.ready.eq(ends)"),
    "the angle moves while it is stalled": ("m.Elif(active)", "m.Elif(0)"),
    "a pixel is lost": ("Cat(active, valid[:-1])", "Cat(active, valid[:-1]) & ~2"),
    "the wave moves while it is stalled": ("EnableInserter(advance)", "EnableInserter(Value.cast(1))"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in `HighlightCosineUnit`, refutes a claim."""
    inject(HighlightCosineUnit, "elaborate", *BUGS[bug])
    refute(of_pixels(), 20)
