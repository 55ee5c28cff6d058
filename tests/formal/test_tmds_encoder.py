"""Proof of the TMDS encoder's balance: what its lane has sent never leans further than the bound."""

import pytest
from amaranth.hdl import Cat, Mux, Signal, signed

from blysk.golden.video.tmds_encoder import BITS, MAX_DISPARITY
from blysk.hdl.video.tmds_encoder import TmdsEncoderUnit

from .prover import Harness

pytestmark = [pytest.mark.prove, pytest.mark.seldom]


def of_balance(bound):
    """Ones less zeros of the words that left since the last control word, counted from the bits themselves.

    The display takes a word on every cycle.
    The first claim leads the way: what the registers before the last one say of each other.
    """
    unit = TmdsEncoderUnit()
    h = Harness(unit)
    h.assume(unit.o.ready)
    h.claim(~unit.at(2) | (unit.excess == sum(unit.chain) - 4))
    word, lean = unit.o.payload, Signal(signed(8), name="lean")
    active = Signal(unit.latency, name="active")
    h.m.d.sync += active.eq(Cat(unit.i.payload.active, active))
    total = Signal(signed(8), name="total")
    h.m.d.comb += total.eq(Mux(active[-1], lean + (sum(word) << 1) - BITS, 0))
    with h.m.If(unit.o.valid):
        h.m.d.sync += lean.eq(total)
    h.claim(Mux(unit.o.valid, total, lean) == unit.disparity)
    h.claim((unit.disparity <= bound) & (unit.disparity >= -bound))
    return h


def test_balance(prove):
    """Within the bound for every stream of symbols, pauses and resets; the bound less a step is refuted."""
    prove(of_balance(MAX_DISPARITY))


def test_a_smaller_bound_is_refuted(refute):
    """The largest disparity is reached."""
    refute(of_balance(MAX_DISPARITY - 1))


@pytest.mark.parametrize(
    ("text", "bug"),
    [("xor + invert - 1", "xor - 1"), ("Mux(active, after, 0)", "after"), ("~xor, ", "xor, ")],
)
def test_bugs_are_found(refute, inject, text, bug):
    """Injected in the unit, each refutes the claims."""
    inject(TmdsEncoderUnit, "datapath", text, bug)
    refute(of_balance(MAX_DISPARITY))
