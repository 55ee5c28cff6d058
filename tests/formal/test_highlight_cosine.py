"""Proofs of the highlight-cosine unit: a span's pixels, all and in order, each at its angle."""

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
    """Of the angle two bits, of cos beta one, through two registers."""

    def bits(theta, cos_beta):
        return Cat(theta[:2], Value.cast(cos_beta)[0])

    monkeypatch.setattr(HighlightCosineUnit, "latency", LATENCY)
    monkeypatch.setattr(HighlightCosineUnit, "_wave", short_wave(bits))


def of_pixels():
    """Spans of 0 to 3 pixels, whose angles fall by one step of the word a pixel."""
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
    """Inductive, lengths 0 to 3, `LATENCY` cycles in place of 12: what waits stays; a span's pixels leave in
    order, each once, each at its angle and with its span's cos beta.

    While the output is ready, the first leaves `LATENCY` cycles after its span was accepted, then one every
    cycle, and a span is taken in 3 cycles, and one.
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
    """Injected in `HighlightCosineUnit`, each refutes the claims."""
    inject(HighlightCosineUnit, "elaborate", *BUGS[bug])
    refute(of_pixels(), 20)
