"""Proof by exhaustion of the gate at reduced width: it stops no span in which a pixel may be shaded."""

from math import isqrt

import numpy as np
import pytest

from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import MAX_EXPONENT, Specular
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.sim.engines.simulate import simulate

pytestmark = pytest.mark.prove

LIMITS = QuadraticInterpolator().gate_limits


def one_of(gate):
    """Code of length 1."""
    return gate.component_format.max_code


def reached(gate, left, right, halfway):
    """Highest threshold that the square of N.H reaches on the arc between two normals, by its definition.

    With a, b and c for the three dot products, c over that of a unit vector with itself, N.H at a share x of
    the arc is ``(a sin((1 - x) psi) + b sin(x psi)) / sin psi``, ``cos psi = c``. The largest is a, b, or,
    where ``b > a c`` and ``a > b c``, the root of ``(a^2 + b^2 - 2 a b c) / (1 - c^2)``. No pixel of the
    span, however long it is, has more. Here all are integers, and no word but the result is cut.
    """
    pairs = (left, halfway), (right, halfway), (left, right)
    a, b, c = (np.einsum("...i,...i->...", *pair) for pair in pairs)
    one = one_of(gate) ** 2
    inside = (np.abs(c) < one) & (b * one > a * c) & (a * one > b * c) & (a + b > 0)
    square = inside * one * (one * (a * a + b * b) - 2 * a * b * c)
    end = np.maximum(np.maximum(a, b), 0)
    highest = np.maximum(end * end, square // np.where(inside, one * one - c * c, 1))
    return highest >> 3 * gate.fraction_bits


def grid(gate, dimensions):
    """Every vector of codes, but the one most negative, which no unit vector has."""
    codes = np.arange(-one_of(gate), one_of(gate) + 1)
    return codes[np.indices((len(codes),) * dimensions).reshape(dimensions, -1).T]


def is_unit(gate, vectors, off):
    """Whether lengths are off 1 by less than so many steps."""
    return np.abs(np.linalg.norm(vectors, axis=-1) - one_of(gate)) < off


def is_near(gate, vectors):
    """Pairs of which the gate does not say that they are out of range, and some just out of it."""
    limit = (gate.widest.codes.item() + 2) << gate.fraction_bits - 1
    return one_of(gate) ** 2 - vectors @ vectors.T < limit


def in_a_plane(gate):
    """Ends of any codes up to 45 degrees apart, and of unit length to half a step at any angle; H on an axis.

    The plane is y = 0, and H is in it.
    """
    vectors = grid(gate, 2)
    unit = is_unit(gate, vectors, 0.5)
    left, right = np.nonzero(is_near(gate, vectors) | np.outer(unit, unit))
    vectors = np.insert(vectors, 1, 0, axis=1)
    return vectors[left], vectors[right], np.array([[0, 0, one_of(gate)]])


def off_the_plane(gate):
    """Ends of that plane, of unit length to half a step, up to 45 degrees apart; H, to 0.1 steps, x = 0."""
    vectors = grid(gate, 2)
    halfways = vectors[is_unit(gate, vectors, 0.1) & (vectors >= 0).all(axis=1)]
    vectors = vectors[is_unit(gate, vectors, 0.5)]
    left, right = np.nonzero(is_near(gate, vectors))
    vectors = np.insert(vectors, 1, 0, axis=1)
    return vectors[left], vectors[right], np.insert(halfways, 0, 0, axis=1)


def anywhere(gate):
    """Ends of unit length to 0.02 steps, up to 45 degrees apart; H one of them, of a 48th of the sphere."""
    units = grid(gate, 3)
    units = units[is_unit(gate, units, 0.02)]
    left, right = np.nonzero(is_near(gate, units))
    return units[left], units[right], units[(units[:, 0] >= 0) & (np.diff(units) >= 0).all(axis=1)]


def stopped(gate, left, right, halfways):
    """Share of the spans that the unit stops, at every word of its PROM; none reaches that threshold."""
    unit, beats = HighlightGateUnit(gate, initiation_interval=1), {"normal_left": left, "normal_right": right}
    words, exponents = np.unique(gate.thresholds.codes[1 : MAX_EXPONENT + 1], return_index=True)
    count = 0
    for halfway in halfways:
        highest = reached(gate, left, right, halfway)
        for threshold, exponent in zip(words, exponents + 1, strict=True):
            constants = {"halfway": halfway[np.newaxis], "exponent": exponent}
            run = simulate(unit, beats, count=len(left), constants=constants, engine="auto")
            stops = run.beats == 0
            # With a threshold of 0 all may be lit, where N.H is negative too.
            assert not stops[highest >= threshold].any(), f"lost highlights, exponent {exponent}"
            count += np.count_nonzero(stops)
    return count / (len(halfways) * len(words) * len(left))


@pytest.mark.parametrize(
    ("bits", "spans", "cases"),
    [(5, in_a_plane, 1_233_844), (6, off_the_plane, 30 * 33_476), (5, anywhere, 13 * 42_774)],
)
def test_no_span_that_reaches_a_threshold_is_stopped(bits, spans, cases):
    """Words of 5 or 6 fraction bits, all cases; at each of the words that the PROM has."""
    gate = HighlightGate(LIMITS, fraction_bits=bits)
    left, right, halfways = spans(gate)
    assert len(left) * len(halfways) == cases
    assert 0.5 < stopped(gate, left, right, halfways) < 0.9


def shades_nothing_under(gate):
    """The unit's term of the largest N.H under each threshold is 0."""
    thresholds, specular = gate.thresholds.codes.tolist(), gate.specular
    for exponent in np.flatnonzero(thresholds[: MAX_EXPONENT + 1]).tolist():
        under = isqrt((thresholds[exponent] << 68 - gate.fraction_bits) - 1)
        operand = Fixed(specular.operand_format, np.array([under]))
        term = specular.compute(operand, np.zeros(1, bool), exponent).codes.item()
        assert term == 0, f"lit under the threshold, exponent {exponent}"


@pytest.mark.parametrize("bits", [5, 6, 17])
def test_nothing_is_shaded_under_a_threshold(bits):
    """At any exponent, the term of the largest N.H under its threshold is 0; none is larger farther down."""
    shades_nothing_under(HighlightGate(LIMITS, fraction_bits=bits))


BUGS = {
    "thresholds a step too high": (
        "datapath",
        "p.thresholds.codes.tolist()",
        "[min(code + 1, (1 << p.fraction_bits) - 1) for code in p.thresholds.codes.tolist()]",
    ),
    "the angle is cut to half": (
        "_describe",
        "Mux((cut + 3)[f], angle.max_code, (cut + 3)[:f])[:f]",
        "Cat(cut[1:], Const(0, 1))",
    ),
    "no margin of the ends": ("_lit_by", "dot.truncate(f) + step", "dot.truncate(f)"),
    "one end is not looked at": ("_lit_by", "Mux(minus[-1], b, a)", "a"),
    "the inside is not looked at": ("_lit_by", "(inside & (exceeded | reached))", "0"),
    "a sign is dropped": ("_lit_by", "lambda w: w[-1]", "lambda w: ~w[f + 2 :].any()"),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(inject, bug):
    """Injected in the unit, each stops a span that reaches its threshold."""
    inject(HighlightGateUnit, *BUGS[bug])
    gate = HighlightGate(LIMITS, fraction_bits=6)
    with pytest.raises(AssertionError, match=r"^lost highlights"):
        stopped(gate, *off_the_plane(gate))


def test_bug_of_spans_out_of_range_is_found(inject):
    """Taken as others, they reach their thresholds where they are stopped."""
    inject(HighlightGateUnit, "_lit_by", "out_of_range | bright", "bright")
    gate = HighlightGate(LIMITS, fraction_bits=5)
    with pytest.raises(AssertionError, match=r"^lost highlights"):
        stopped(gate, *in_a_plane(gate))


@pytest.mark.parametrize(("bits", "steps"), [(5, 1), (6, 1), (17, 12)])
def test_bug_of_thresholds_is_found(monkeypatch, bits, steps):
    """Words of the PROM too high: by a step, or by more than the margin for the pixels' errors."""
    gate = HighlightGate(LIMITS, fraction_bits=bits)
    codes = gate.thresholds.codes
    high = np.minimum(codes + steps * (codes > 0), gate.level_format.max_code)
    monkeypatch.setitem(vars(gate), "thresholds", Fixed(gate.level_format, high))
    with pytest.raises(AssertionError, match=r"^lit under the threshold"):
        shades_nothing_under(gate)


def test_bug_of_the_cutoff_is_found(inject):
    """The specular unit shades as far as its parabola goes."""
    inject(Specular, "compute", "lit &= shifted <= self.boundaries[exponent]", "pass")
    with pytest.raises(AssertionError, match=r"^lit under the threshold"):
        shades_nothing_under(HighlightGate(LIMITS))
