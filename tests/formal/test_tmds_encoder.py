"""Proof of the TMDS encoder's balance: the disparity of its lane never exceeds the bound."""

import pytest
from amaranth.hdl import Cat, Mux, Signal, signed

from blysk.golden.video.tmds_encoder import BITS, MAX_DISPARITY
from blysk.hdl.video.tmds_encoder import TmdsEncoderUnit

from .prover import Harness

pytestmark = [pytest.mark.prove, pytest.mark.seldom]


def of_balance(bound):
    """Claims on the disparity: ones less zeros of the words since the last control word, counted from the
    bits themselves.

    The display takes a word in every cycle. The first claim makes the proof inductive. It says how the
    registers before the last register are related.
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
    """The disparity is within the bound for every stream of symbols, pauses and resets.

    A bound one step smaller is refuted.
    """
    prove(of_balance(MAX_DISPARITY))


def test_a_smaller_bound_is_refuted(refute):
    """The largest disparity occurs."""
    refute(of_balance(MAX_DISPARITY - 1))


@pytest.mark.parametrize(
    ("text", "bug"),
    [("xor + invert - 1", "xor - 1"), ("Mux(active, after, 0)", "after"), ("~xor, ", "xor, ")],
)
def test_bugs_are_found(refute, inject, text, bug):
    """Each bug, injected in the unit, refutes a claim."""
    inject(TmdsEncoderUnit, "datapath", text, bug)
    refute(of_balance(MAX_DISPARITY))
