"""Formulas of traced functions, and functions without a formula."""

import pytest
from amaranth.hdl import Cat, Value

from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.dot import dot
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.formula import Formula, component, formula_of

A, B, N = Formula("a"), Formula("b"), Formula("N_l")
ONE = FixedValue.constant(UQ(1, 4), 1)


@pytest.mark.parametrize(
    ("function", "text"),
    [
        (lambda a, b: a + b - a, "a + b − a"),
        (lambda a, b: a - (b - a), "a − (b − a)"),
        (lambda a, b: ONE - a * b, "1 − a·b"),
        (lambda a, b: (ONE - a) * b, "(1 − a)·b"),
        (lambda a, b: (a + b).scale(-1).round_half_up(3), "(a + b)/2"),
        (lambda a, b: (a + b) * (a + b), "(a + b)²"),
        (lambda a, b: a.scale(-12) > b.truncate(2).saturate(SQ(1, 2)), "2⁻¹²·a > b"),
        (lambda a, b: -a * b, "(−a)·b"),
        (lambda a, b: a[2], "a_2"),
        (lambda a, b: N[2], "N_l,z"),
    ],
)
def test_operations(function, text):
    assert formula_of(function, (A, B)).text == text


@pytest.mark.parametrize(
    "function", [lambda a, b: Value.cast(a) + 1, lambda a, b: Cat(a, b), lambda a, b: a[1:], lambda a: a]
)
def test_bits_have_no_formula(function):
    assert formula_of(function, (A, B)) is None


def test_what_is_written_binds_as_it_reads():
    assert (Formula.read("1 − n·u") * A).text == "(1 − n·u)·a"
    assert (Formula.read("N·L") + A).text == "N·L + a"
    assert (Formula.read("(a + b)") * A).text == "(a + b)·a"
    assert component(Formula("f"), 1).text == "f_1"


def test_words_of_a_graph():
    g = Dataflow(1)
    a, b, m = (g.input(name, lambda i, name=name: i[name]) for name in ("normal_a", "normal_b", "length"))
    cosine = dot(g, "cosine", a, b)
    assert cosine.formula.text == "N_a·N_b"
    assert dot(g, "square", a, a).formula.text == "|N_a|²"
    u = g.register("u", lambda x: ONE - x, cosine)
    assert u.formula.text == "1 − N_a·N_b"
    # A symbol stands for itself. So does the name of a word that is long or has no formula.
    steps = g.register("steps", lambda m: m.all(), m)
    long = g.register("long", lambda u, x: u + x - u + x, u, cosine)
    assert g.multiply("product", u, steps).formula.text == "u·steps"
    assert g.wire("half", lambda x: x.scale(-1), long).formula.text == "long/2"
