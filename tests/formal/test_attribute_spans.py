"""Proofs of lines of attributes: the words of each pixel are exact sums, cut, and belong to its span."""

import pytest
from amaranth.hdl import Signal, Value, signed

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.hdl.albedo.attribute_spans import AttributeSpansUnit

from .prover import Harness
from .rules import answers, stays, taken

pytestmark = [pytest.mark.prove, pytest.mark.seldom]


def of_words():
    """Exact sums, in words that cannot wrap, move beside the sums of the unit, with the data of the span.

    The domain: at every pixel of a span the exact value fits the format of the sum.
    """
    p = AttributeSpans(colors=False, coordinates=True)
    h = Harness(unit := AttributeSpansUnit(p))
    m, span, comes = h.m, unit.i.payload, taken(unit.i)
    waits, left, active = stays(h, unit.o), Signal(len(span.length)), Signal()
    m.d.comb += active.eq(left.any())
    with m.If(comes):
        m.d.sync += left.eq(span.length)
    with m.Elif(~waits & active):
        m.d.sync += left.eq(left - 1)
    h.claim(unit.o.valid == (active | waits))
    h.claim(h.register("active") == active)
    h.claim(~active | (h.register("remaining") == left))
    h.claim(h.register("ends") == (left <= 1))
    answers(h, left > 1, taken(unit.o), 1, unit.o.ready)
    free = p.SUM_FORMAT.fraction_bits - p.WORD_FORMAT.fraction_bits
    given = {
        f"coordinates_{k}": (
            span.start.coordinates[k],
            span.step.coordinates[k],
            unit.o.payload.coordinates[k],
        )
        for k in range(2)
    }
    given["weight"] = span.start.weight, span.step.weight, unit.o.payload.weight
    for name, words in given.items():
        start, step, found = (Value.cast(word) for word in words)
        width = p.SUM_FORMAT.width + len(span.length) + 1
        exact, change = (Signal(signed(width), name=f"{name}_{word}") for word in ("exact", "change"))
        with m.If(comes):
            m.d.sync += [
                exact.eq((start << free) + (1 << (free - 1))),
                change.eq(step << (free - span.exponent)[:4]),
            ]
        with m.Elif(~waits):
            m.d.sync += exact.eq(exact + change)
        inside = (exact >= p.SUM_FORMAT.min_code) & (exact <= p.SUM_FORMAT.max_code)
        h.assume(~active | inside)
        for register, model in ((f"{name}_sum", exact), (f"{name}_step", change)):
            code = Value.cast(h.register(register)).as_unsigned()
            h.claim(~active | (code == model[: len(code)]))
        h.claim(~active | waits | (found == exact >> free))
    for name in ("base", "range", "level"):
        kept = Signal.like(Value.cast(span[name]), name=f"kept_{name}")
        with m.If(comes):
            m.d.sync += kept.eq(Value.cast(span[name]))
        h.claim(~active | waits | (Value.cast(unit.o.payload[name]) == kept))
    return h


def test_words_are_exact_sums(prove):
    """By induction, for all formats and lengths as built.

    While the output is ready, a pixel leaves in every cycle.
    """
    prove(of_words())


BUGS = {
    "no half step": ("Const(1 << (free - 1), free)", "Const(0, free)"),
    "a step without its sign": ("step).as_signed()", "step)"),
    "sums while it is stalled": ("with m.If(advance):", "with m.If(1):"),
    "the span changes too soon": ("with m.If(advance & ends):", "with m.If(advance):"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in `AttributeSpansUnit`, refutes a claim."""
    inject(AttributeSpansUnit, "elaborate", *BUGS[bug])
    refute(of_words(), 10)
