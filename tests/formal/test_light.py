"""Proofs of the light unit: no term is lost, and dark beats keep their places beside the specular unit."""

import pytest
from amaranth.hdl import Mux, Value

import blysk.hdl.lighting.light
from blysk.golden.lighting.diffuse import Diffuse
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.specular import SpecularUnit

from .prover import Harness
from .rules import answers, follows, stays, taken
from .stubs import short

pytestmark = pytest.mark.prove


def two_bits(light, term):
    """The specular term is the operand, or 0 for a dark beat."""
    yield Value.cast(term).eq(Mux(light.dark, 0, Value.cast(light.operand)[:2]))


@pytest.fixture
def make(monkeypatch):
    """A light unit with `two_bits` for specular terms, whose latency is one cycle more than the interval."""

    def make(interval):
        stub = short(SpecularUnit, two_bits, interval + 1)
        monkeypatch.setattr(blysk.hdl.lighting.light, "SpecularUnit", stub)
        return LightUnit(initiation_interval=interval)

    return make


def of_light(unit):
    """Claims on beats with one bit of N.L, its sign, and two bits of the specular operand."""
    h = Harness(unit)
    cosine, highlight = (Value.cast(unit.i.payload[name]) for name in ("cosine", "highlight"))
    step = unit.i.payload.cosine.format.fraction_bits - Diffuse.RESULT_FORMAT.fraction_bits
    h.assume((cosine[:step] == 0) & (cosine[step + 1 : -1] == 0) & (highlight[2:] == 0))

    def image(came, leaves):
        cosine, highlight = Value.cast(came.cosine), Value.cast(came.highlight)
        lit = ~cosine[-1] & cosine.any()
        diffuse = Value.cast(leaves.diffuse) == Mux(cosine[-1], 0, cosine[step])
        return diffuse & (Value.cast(leaves.specular) == Mux(lit, highlight[:2], 0))

    stays(h, unit.o)
    inside = follows(h, unit.i, unit.o, 6, image)
    late = unit.latency + 2 if unit.skips_dark else unit.latency - 1
    answers(h, inside.any(), taken(unit.o), late, unit.o.ready)
    return h


def test_both_units_move_in_lockstep(prove, make):
    """By induction, with an interval of 1: both terms of each beat leave once and in order, 2 cycles later.

    The specular term is 0 where N.L is not above 0. A beat that waits does not change, and no beat is stuck.
    """
    prove(of_light(make(1)))


@pytest.mark.parametrize("interval", [2, 3])
def test_dark_beats_keep_their_places(prove, make, interval):
    """Within 12 cycles, with specular terms in some cycles: both terms of each beat leave once and in order.

    The specular term is 0 where N.L is not above 0. A beat that waits does not change, and no beat is stuck.
    """
    prove(of_light(make(interval)), 12)


BUGS = {
    "a dark beat takes a term": ("specular.o.ready.eq(gives & ~skip)", "specular.o.ready.eq(gives)"),
    "a lit beat is not given": (
        "specular.i.valid.eq(full & takes & ~dark)",
        "specular.i.valid.eq(0)",
    ),
    "a dark beat is given": ("full & takes & ~dark", "full & takes"),
    "it leaves before its term is there": ("(skip | specular.o.valid)", "1"),
    "a term is lost while the light is stalled": (
        "specular.o.ready.eq(gives & ~skip)",
        "specular.o.ready.eq(1)",
    ),
    "what waits beside it is lost": ("terms.ready.eq(gives)", "terms.ready.eq(1)"),
    "a beat that comes is lost": ("m.Elif(taken)", "m.Elif(takes)"),
    "the term of a dark beat is kept": ("Mux(skip, 0, ", "Mux(0, 0, "),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, make, bug):
    """Each bug, injected in `LightUnit`, refutes a claim."""
    inject(LightUnit, "_skip", *BUGS[bug])
    refute(of_light(make(2)), 12)


LOCKSTEP_BUGS = {
    "the specular unit goes on alone": ("unit.o.ready.eq(o.ready)", "unit.o.ready.eq(unit is specular)"),
    "it takes what the light does not": (
        "self.i.ready.eq(diffuse.i.ready)",
        "self.i.ready.eq(diffuse.i.ready & self.o.ready)",
    ),
}


@pytest.mark.parametrize("bug", LOCKSTEP_BUGS)
def test_bugs_in_lockstep_are_found(refute, inject, make, bug):
    """Each bug, injected in `LightUnit`, refutes a claim."""
    inject(LightUnit, "elaborate", *LOCKSTEP_BUGS[bug])
    refute(of_light(make(1)), 12)
