"""Proofs of the quadratic evaluator: a span's pixels, all and in order, each at its t."""

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

# Of each form, with the stubs: pixels inside at most, and cycles for which a span waits at most.
FORMS = {"direct": (12, 4), "horner": (11, 7)}


def steps(span, gives):
    """A step of t is one of a component."""
    step = QuadraticEvaluator.STEP_FORMAT
    yield Value.cast(gives.step).eq(1 << (step.fraction_bits - COMPONENT.fraction_bits))
    yield from (gives[name].eq(span[name]) for name in ("g", "p", "q", "length"))


def tag(coefficients):
    """A bit of each."""
    return Cat(Value.cast(coefficients[name][0])[0] for name in "gpq")


def polynomials(pixel, normal):
    """Two bits of t beside the tag."""
    yield Value.cast(normal[0]).eq(Cat(Value.cast(pixel.minus_t)[:2], tag(pixel)))


@pytest.fixture(autouse=True)
def stubs(monkeypatch):
    """Units for the step, in a clock, and for the polynomial, in two, hand on tags."""
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
    """Spans of 0 to 3 pixels."""
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
    """Inductive, lengths 0 to 3: what waits stays; a span's pixels leave in order, each once, each with its t
    and its span's coefficients; while the output is ready, one leaves in 4 cycles, the stubs' latency and
    one, and a span is taken in as many as `FORMS` says, and one."""
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
    """Injected in `QuadraticEvaluatorUnit`, each refutes the claims."""
    inject(QuadraticEvaluatorUnit, "elaborate", *BUGS[bug])
    refute(of_pixels("direct"), 20)
