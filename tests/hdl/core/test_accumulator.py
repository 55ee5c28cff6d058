# amaranth: UnusedElaboratable=no
"""Accumulators of data-flow graphs: sums of products against NumPy, cycle by cycle."""

import numpy as np
import pytest

from blysk.golden.number.fixed import SQ, Fixed
from blysk.hdl.core.accumulator import Accumulator, half
from blysk.hdl.core.fixed import FixedShape

from .test_dataflow import OPERAND, GraphUnit, beats_of, verify

EXACT, CUT, PLACE = SQ(4, 34), SQ(4, 20), 18


APART = "exact_0", "exact_1", "exact_2", "cut_0", "cut_1"
MIXED = "exact_0", "cut_0", "exact_1", "cut_1", "exact_2"
"""Orders of the products. In the second order products of one sum come between products of the other."""


def sums_of(order):
    """Graph of the sums ``a + a b + b b + a a``, exact, and ``a b + a a``, of cut products, rounded."""

    def describe(g, a, b, n):
        sums = Accumulator(g)
        factors = {"exact_0": (a, b), "exact_1": (b, b), "exact_2": (a, a), "cut_0": (a, b), "cut_1": (a, a)}
        products = {name: g.multiply(f"product_{name}", *factors[name]) for name in order}
        exact = sums.sum("exact", [products[f"exact_{k}"] for k in range(3)], EXACT, a)
        cut = sums.sum("cut", [products[f"cut_{k}"] for k in range(2)], CUT, half(PLACE))
        return {
            "exact": g.register("exact_word", lambda v: v, exact),
            "cut": g.register("cut_word", lambda v: v.truncate(PLACE), cut),
        }, {"exact": FixedShape(EXACT), "cut": FixedShape(SQ(CUT.integer_bits, PLACE))}

    return describe


@pytest.mark.parametrize("order", [APART, MIXED])
@pytest.mark.parametrize("interval", [5, 8])
def test_sums(order, interval):
    beats = beats_of(np.random.default_rng(2026))
    a, b = (Fixed(OPERAND, beats[name]) for name in "ab")
    exact = a * b + b * b + a * a + a
    cut = ((a * b).truncate(20) + (a * a).truncate(20)).round_half_up(PLACE)
    unit = GraphUnit(interval, sums_of(order))
    assert unit.graph.multiplier.count == 1
    verify(unit, beats, {"exact": exact.codes, "cut": cut.codes})


def test_two_multipliers_are_refused():
    with pytest.raises(ValueError, match="products of one multiplier, not 2"):
        GraphUnit(3, sums_of(APART)).elaborate(None)
