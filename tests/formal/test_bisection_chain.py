"""Proofs of the chain of bisections: it holds one span at a time, and offers it once, when it is due."""

import pytest
from amaranth.hdl import Cat, Mux, Signal

from blysk.hdl.normals.bisection_chain import BisectionChainUnit

from .prover import Harness
from .rules import follows, stays

pytestmark = [pytest.mark.prove, pytest.mark.seldom]


def of_spans():
    """A model counts the cycles until a span is due."""
    unit = BisectionChainUnit()
    h = Harness(unit)
    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, 1)
    ends, a_round = unit.latency(0), unit.latency(1) - unit.latency(0)

    def rounds(level):
        # A level of 0 counts as 16.
        return sum(Mux(bit, a_round << place, 0) for place, bit in enumerate(Cat(level, level == 0)))

    left = Signal(range(unit.latency(16)), name="left")
    with h.m.If(~inside.any()):
        h.m.d.sync += left.eq(ends - 1 + rounds(unit.i.payload.level))
    with h.m.Elif(left.any()):
        h.m.d.sync += left.eq(left - 1)
    h.claim(unit.o.valid == (inside.any() & ~left.any()))
    h.claim(unit.i.ready == ~inside.any())
    # These claims make the proof inductive: the states, and the cycles from each state to the end.
    state, step, remaining = (h.register(name) for name in ("fsm_state", "step", "remaining"))
    h.claim((state == 0) == ~inside.any())
    to_come = [ends - 1 + rounds(remaining) - step, 10 + rounds(remaining) - step, 10 - step, 0]
    for number, cycles in enumerate(to_come, 1):
        h.claim((state != number) | (left == cycles))
    h.claim(state <= len(to_come))
    return h


def test_spans(prove):
    """By induction, for all levels: a span that is taken is offered once, `latency` cycles later.

    Until it is taken, no other span is offered, and it does not change.
    """
    prove(of_spans())


BUGS = {
    "it does not wait": ("elaborate", 'm.State("done"), m.If(self.o.ready)', 'm.State("done")'),
    "it offers another": ("elaborate", "self.o.valid.eq(0)", "self.o.valid.eq(self.i.valid)"),
    "a round too few": ("_halve", "r.remaining == 1", "1"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in `BisectionChainUnit`, refutes a claim."""
    inject(BisectionChainUnit, *BUGS[bug])
    refute(of_spans())
