"""Proofs of the quadratic evaluator: all pixels of a span leave in order, each with its t."""

import pytest
from amaranth.hdl import Cat, Value

import blysk.hdl.normals.quadratic_evaluator
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit

from .prover import Harness
from .rules import answers, pixels_follow, stays, taken
from .stubs import short

pytestmark = [pytest.mark.prove, pytest.mark.seldom]

# For each form, with the stubs: the most pixels inside, and the most cycles for which a span waits.
FORMS = {"direct": (12, 4), "horner": (11, 7)}


def steps(span, gives):
    """A step of t is one step of a component."""
    step = QuadraticEvaluator.STEP_FORMAT
    yield Value.cast(gives.step).eq(1 << (step.fraction_bits - COMPONENT.fraction_bits))
    yield from (gives[name].eq(span[name]) for name in ("g", "p", "q", "length"))


def tag(coefficients):
    """One bit of each coefficient."""
    return Cat(Value.cast(coefficients[name][0])[0] for name in "gpq")


def polynomials(pixel, normal):
    """Two bits of t, and the tag."""
    yield Value.cast(normal[0]).eq(Cat(Value.cast(pixel.minus_t)[:2], tag(pixel)))


@pytest.fixture(autouse=True)
def stubs(monkeypatch):
    """Stubs that pass on tags: for the step, in one cycle, and for the polynomial, in two cycles."""
    for name, hand_on, latency, interval in (
        ("_StepUnit", steps, 1, 1),
        ("_DirectUnit", polynomials, 2, 1),
        ("_HornerUnit", polynomials, 2, 2),
    ):
        unit = getattr(blysk.hdl.normals.quadratic_evaluator, name)
        monkeypatch.setattr(
            blysk.hdl.normals.quadratic_evaluator, name, short(unit, hand_on, latency, interval)
        )


def of_pixels(form):
    """Claims on spans of 0 to 3 pixels."""
    unit = QuadraticEvaluatorUnit(QuadraticEvaluator(form))
    h = Harness(unit)
    span, (capacity, waits) = unit.i.payload, FORMS[form]
    h.assume(span.length <= 3)

    def image(span, place, last, normal):
        return Value.cast(normal[0])[:5] == Cat((-place)[:2], tag(span))

    stays(h, unit.o)
    owed = pixels_follow(h, unit.i, unit.o, span.length[:2], capacity, image)
    answers(h, owed.any(), taken(unit.o), 3, unit.o.ready)
    answers(h, unit.i.valid, unit.i.ready, waits, unit.o.ready)
    return h


@pytest.mark.parametrize("form", FORMS)
def test_pixels(prove, form):
    """By induction, for lengths 0 to 3: pixels leave in order and once each, with their t and coefficients.

    A pixel that waits does not change. While the output is ready, a pixel leaves within 5 cycles (the latency
    of the stubs is 4). A span is taken within one cycle more than `FORMS` states.
    """
    prove(of_pixels(form))


BUGS = {
    "it moves while the polynomial is stalled": ("advance.eq(~valid | pixel.ready)", "advance.eq(1)"),
    "a span takes another's place": ("span.ready.eq(advance & (remaining == 0))", "span.ready.eq(advance)"),
    "a span is lost while it is stalled": (
        "span.ready.eq(advance & (remaining == 0))",
        "span.ready.eq(remaining == 0)",
    ),
    "t stays": ("total - step_held", "total"),
    "a pixel too many": ("length - 1", "length"),
    "a span of no pixels has one": ("valid.eq(length != 0)", "valid.eq(1)"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in `QuadraticEvaluatorUnit`, refutes a claim."""
    inject(QuadraticEvaluatorUnit, "elaborate", *BUGS[bug])
    refute(of_pixels("direct"), 20)
