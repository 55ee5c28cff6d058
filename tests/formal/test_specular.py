"""Proofs of the specular unit: SAT proves its argument; exhaustion proves that its term never rises and
ends."""

import numpy as np
import pytest
from amaranth.hdl import Cat, Fragment, Mux, Signal, Value
from amaranth.hdl._ast import Switch

import blysk.hdl.lighting.specular
from blysk.golden.lighting.specular import Specular
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.sim.engines.simulate import simulate

from ..lists import FURTHER_MODELS, KINDS, SPECULAR_MODELS
from .prover import Harness

pytestmark = pytest.mark.prove

OPERANDS = ("cosine", "one_minus_cosine")
MODELS = [
    pytest.param(name, marks=[pytest.mark.seldom] * (name not in (SPECULAR_MODELS[0], *KINDS)))
    for name in SPECULAR_MODELS + FURTHER_MODELS
]
"""All models that the unit serves. CI proves the first model, and one of each kind."""

# Exponents of all pairs of model and operand but the first: small exponents, those next to a power of two,
# where the scale jumps, and some others.
SOME = sorted(
    {*range(1, 12), *(2**k + step for k in range(4, 10) for step in (-1, 0, 1)), 100, 777, 999, 1000}
)


def assignments(statements):
    """All assignments, also those under a condition."""
    for statement in statements:
        if isinstance(statement, Switch):
            for _, inner, _ in statement.cases:
                yield from assignments(inner)
        else:
            yield statement


def words_of(unit, fragment):
    """Registers of the data path by name; names of those computed from ``1 - cos gamma``; names of the other
    registers computed from a beat."""
    (path,) = (inner for inner, name, _ in fragment.subfragments if name == "datapath")
    found = [one for statements in path.statements.values() for one in assignments(statements)]
    words = {signal.name: signal for one in found for signal in one.lhs._lhs_signals()}

    def made_of(signal):
        return {s.name for one in found if signal in one.rhs._rhs_signals() for s in one.lhs._lhs_signals()}

    first = "one_minus_cosine"
    return words, made_of(words[first]), made_of(Value.cast(unit.i.payload)) - {first}


def reads_one_word(unit, name):
    """Check that the operand is used only for ``1 - cos gamma``, and that only one register is computed from
    it."""
    _, made_of_operand, others = words_of(unit, Fragment.get(unit, None))
    assert made_of_operand == {name}, "more is made of 1 - cos gamma"
    assert len(others) == 1, "more is made of the operand"


def of_argument(unit, name, format, if_dark):
    """Claim that this register has the cut and limited argument two cycles later, or its own code for a dark
    beat."""
    h = Harness(unit)
    words, _, (dark,) = words_of(unit, h._fragment)
    argument, first, dark = words[name], words["one_minus_cosine"], words[dark]
    beat, stand = Signal(unit.i.payload.shape(), name="beat"), Signal(2, name="stand")
    past, past_dark = Signal.like(first, name="past"), Signal(name="past_dark")
    with h.m.If(~h.register("held")):
        h.m.d.sync += [beat.eq(unit.i.payload), past.eq(first), past_dark.eq(dark), stand.eq(Cat(1, stand))]
    exact = Value.cast(beat.operand)
    if unit.model.operand == "cosine":
        exact = ONE_SQUARED.codes.item() - exact
    cut = unit.model.operand_format.fraction_bits - format.fraction_bits
    exact = exact >> cut if cut > 0 else exact << -cut
    h.claim(~stand[0] | ((first == exact) & (dark == beat.dark)))
    raised = Mux(past < 0, 0, past)
    limited = Mux(raised > format.max_code, format.max_code, raised)
    h.claim(~stand[1] | (argument == Mux(past_dark, if_dark, limited)))
    return h


def of_specular(model, operand):
    return of_argument(
        SpecularUnit(Specular(REFLECTION_MODELS[model], operand)), "argument", Specular.ARGUMENT_FORMAT, 0
    )


def every_argument(unit, exponent):
    """One argument for each group that the unit cannot tell apart, up to a shifted argument of 2, and some
    larger arguments.

    The unit reads the bits of the shifted argument, and for ``coscos`` those bits that address its first
    table. Beyond 2 every term is 0.
    """
    _, shift = unit.scale(np.int64(exponent))
    step = 1 << min(9 - int(shift), 8 if unit.is_coscos else 9)
    last = unit.ARGUMENT_FORMAT.max_code
    reach = min(last, unit.SHIFTED_FORMAT.max_code + 2 << 9 - int(shift))
    beyond = np.r_[np.linspace(reach, last, 5000).astype(np.int64), np.maximum(reach, 1 << np.arange(26))]
    return np.r_[np.arange(0, reach, step), np.sort(beyond)]


def operands(unit, arguments):
    """Operands of the arguments.

    If the operand is a cosine: both ends of the cosines of each argument, and both ends of the word.
    """
    if unit.operand == "one_minus_cosine":
        return arguments
    step = 1 << unit.operand_format.fraction_bits - unit.ARGUMENT_FORMAT.fraction_bits
    ends = ONE_SQUARED.codes - step * arguments[:, np.newaxis] - [0, step - 1]
    return np.r_[unit.operand_format.max_code, ends.ravel(), unit.operand_format.min_code]


def check(unit, exponent):
    """Check terms: no term is larger than that of a smaller argument, and all equal the model's terms.

    A term is 0 where the exact term is under 2^-14, and over 0 where the exact term is larger; a hundredth of
    2^-14 is left open. A dark beat at the peak has the term 0.
    """
    model = unit.model
    codes = operands(model, every_argument(model, exponent))
    codes, dark = np.r_[codes, codes[0]], np.arange(len(codes) + 1) == len(codes)
    run = simulate(unit, {"operand": codes, "dark": dark}, count=len(codes), constants={"exponent": exponent})
    operand, terms = Fixed(model.operand_format, codes), run.beats.astype(np.int64)
    assert terms[0] >= 2**17 - 9, "no peak"
    assert not terms[-1], "a dark beat is lit"
    assert (np.diff(terms) <= 0).all(), "a term rises"
    cosine = operand.values + (1 - ONE_SQUARED.values)
    if model.operand == "one_minus_cosine":
        cosine = 1 - operand.values
    exact = model.reflection.reflect(np.maximum(cosine, -1), exponent) * 2.0**14
    assert not terms[exact < 0.99].any(), "a term goes on past the cutoff"
    assert terms[~dark & (exact > 1.01)].all(), "a term ends before the cutoff"
    np.testing.assert_array_equal(terms, model.compute(operand, dark, exponent).codes)


@pytest.mark.parametrize("operand", OPERANDS)
@pytest.mark.parametrize("model", MODELS)
def test_term_follows_from_the_argument(prove, model, operand):
    """By induction, for every operand: a term depends only on ``1 - cos gamma``, cut and limited.

    So the term never rises while the cosine falls. If the operand is 1 - cos gamma, it is the argument
    itself. So statements about the terms of all arguments hold for both operands. A dark beat has the
    argument 0.
    """
    reads_one_word(SpecularUnit(Specular(REFLECTION_MODELS[model], operand)), "argument")
    prove(of_specular(model, operand))


@pytest.mark.parametrize("operand", OPERANDS)
@pytest.mark.parametrize("model", MODELS)
def test_term_never_rises(model, operand):
    """Every argument is tried.

    The first model with 1 - cos gamma has every exponent, the others have `SOME`.
    """
    unit = SpecularUnit(Specular(REFLECTION_MODELS[model], operand))
    is_first = (model, operand) == (SPECULAR_MODELS[0], "one_minus_cosine")
    for exponent in range(1, 1001) if is_first else SOME:
        check(unit, exponent)


BUGS_OF_ARGUMENT = {
    "1 is not that of unit vectors": (
        blysk.hdl.lighting.specular,
        "one_minus",
        "ONE_SQUARED.values.item()",
        "1",
    ),
    "it wraps": (SpecularUnit, "_describe", "argument.saturate", "argument.wrap"),
    "a dark beat has an argument": (SpecularUnit, "_describe", "Mux(dark, 0, argument)", "argument"),
}


@pytest.mark.parametrize("bug", BUGS_OF_ARGUMENT)
def test_bugs_of_the_argument_are_found(refute, inject, bug):
    """Each bug, injected in the unit, refutes a claim."""
    inject(*BUGS_OF_ARGUMENT[bug])
    refute(of_specular("cosquad", "cosine"), 4)


def test_bug_of_another_word_is_found(inject):
    """A shifted word that also depends on the operand, injected in the unit, is found."""
    text = 'g.register("shifted_wide", shifted, argument'
    bug = 'g.register("shifted_wide", lambda x, _: shifted(x), argument, operand'
    inject(SpecularUnit, "_describe", text, bug)
    with pytest.raises(AssertionError, match=r"^more is made of the operand"):
        reads_one_word(SpecularUnit(), "argument")


BUGS = {
    "nothing is cut off": (
        "((wide <= boundary) | Value.cast(boundary).all()) & ~dark",
        "~dark",
        "a term rises",
    ),
    "the cutoff is late": (
        "(wide <= boundary)",
        "(Value.cast(wide) <= Value.cast(boundary) + 16)",
        "a term goes on",
    ),
    "the cutoff is early": (
        "(wide <= boundary)",
        "(Value.cast(wide) <= Value.cast(boundary) - 16)",
        "a term ends",
    ),
    "the second lobe comes through": (
        "(wide <= boundary)",
        "(Value.cast(wide)[:18] <= Value.cast(boundary))",
        "a term rises",
    ),
    "the largest shift loses a bit": (
        "<< self._slope[1])[:36]",
        "<< self._slope[1])[:36] & 0x7FFFFFFFF",
        "a term rises",
    ),
    "a dark beat is lit": (".all()) & ~dark", ".all())", "a dark beat is lit"),
}


@pytest.mark.parametrize("operand", OPERANDS)
@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(inject, bug, operand):
    """Each bug, injected in the unit, breaks a claim."""
    text, change, claim = BUGS[bug]
    inject(SpecularUnit, "_describe", text, change)
    unit = SpecularUnit(Specular(REFLECTION_MODELS["cosquad"], operand))
    with pytest.raises(AssertionError, match=f"^{claim}"):
        check(unit, 1000)
