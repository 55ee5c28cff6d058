"""Proof by exhaustion of the gate with short words: it stops no span in which a pixel may be shaded."""

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
    """Largest threshold that the square of N.H reaches on the arc between two normals.

    Let a, b and c be the three dot products; c is divided by that of a unit vector with itself, so
    ``cos psi = c``. At a share x of the arc, N.H is ``(a sin((1 - x) psi) + b sin(x psi)) / sin psi``. Its
    maximum is a, or b. If ``b > a c`` and ``a > b c``, it is the root of
    ``(a^2 + b^2 - 2 a b c) / (1 - c^2)``. No pixel of a span, however long, has a larger N.H. This function
    computes with integers, and cuts only the result.
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
    """Every vector of codes, without the most negative code, which unit vectors do not have."""
    codes = np.arange(-one_of(gate), one_of(gate) + 1)
    return codes[np.indices((len(codes),) * dimensions).reshape(dimensions, -1).T]


def is_unit(gate, vectors, off):
    """Whether lengths differ from 1 by less than some steps."""
    return np.abs(np.linalg.norm(vectors, axis=-1) - one_of(gate)) < off


def is_near(gate, vectors):
    """Pairs that the gate does not flag as out of range, and some pairs just out of range."""
    limit = (gate.widest.codes.item() + 2) << gate.fraction_bits - 1
    return one_of(gate) ** 2 - vectors @ vectors.T < limit


def in_a_plane(gate):
    """Ends and H in the plane y = 0, with H on an axis.

    Ends have any codes if they are up to 45 degrees apart. At any angle, ends have unit length to half a
    step.
    """
    vectors = grid(gate, 2)
    unit = is_unit(gate, vectors, 0.5)
    left, right = np.nonzero(is_near(gate, vectors) | np.outer(unit, unit))
    vectors = np.insert(vectors, 1, 0, axis=1)
    return vectors[left], vectors[right], np.array([[0, 0, one_of(gate)]])


def off_the_plane(gate):
    """Ends in the plane y = 0, of unit length to half a step and up to 45 degrees apart.

    H has unit length to 0.1 steps, and x = 0.
    """
    vectors = grid(gate, 2)
    halfways = vectors[is_unit(gate, vectors, 0.1) & (vectors >= 0).all(axis=1)]
    vectors = vectors[is_unit(gate, vectors, 0.5)]
    left, right = np.nonzero(is_near(gate, vectors))
    vectors = np.insert(vectors, 1, 0, axis=1)
    return vectors[left], vectors[right], np.insert(halfways, 0, 0, axis=1)


def anywhere(gate):
    """Ends of unit length to 0.02 steps, up to 45 degrees apart.

    H is one of these vectors, in a 48th of the sphere.
    """
    units = grid(gate, 3)
    units = units[is_unit(gate, units, 0.02)]
    left, right = np.nonzero(is_near(gate, units))
    return units[left], units[right], units[(units[:, 0] >= 0) & (np.diff(units) >= 0).all(axis=1)]


def stopped(gate, left, right, halfways):
    """Share of the spans that the unit stops, over all words of its PROM.

    No stopped span may reach its threshold.
    """
    unit, beats = HighlightGateUnit(gate, initiation_interval=1), {"normal_left": left, "normal_right": right}
    words, exponents = np.unique(gate.thresholds.codes[1 : MAX_EXPONENT + 1], return_index=True)
    count = 0
    for halfway in halfways:
        highest = reached(gate, left, right, halfway)
        for threshold, exponent in zip(words, exponents + 1, strict=True):
            constants = {"halfway": halfway[np.newaxis], "exponent": exponent}
            run = simulate(unit, beats, count=len(left), constants=constants, engine="auto")
            stops = run.beats == 0
            # With a threshold of 0 every span may be lit, because a negative N.H may be lit, too.
            assert not stops[highest >= threshold].any(), f"lost highlights, exponent {exponent}"
            count += np.count_nonzero(stops)
    return count / (len(halfways) * len(words) * len(left))


@pytest.mark.parametrize(
    ("bits", "spans", "cases"),
    [(5, in_a_plane, 1_233_844), (6, off_the_plane, 30 * 33_476), (5, anywhere, 13 * 42_774)],
)
def test_no_span_that_reaches_a_threshold_is_stopped(bits, spans, cases):
    """Words of 5 or 6 fraction bits, for all cases and all words of the PROM."""
    gate = HighlightGate(LIMITS, fraction_bits=bits)
    left, right, halfways = spans(gate)
    assert len(left) * len(halfways) == cases
    assert 0.5 < stopped(gate, left, right, halfways) < 0.9


def shades_nothing_under(gate):
    """Check that the unit's term is 0 for the largest N.H under each threshold."""
    thresholds, specular = gate.thresholds.codes.tolist(), gate.specular
    for exponent in np.flatnonzero(thresholds[: MAX_EXPONENT + 1]).tolist():
        under = isqrt((thresholds[exponent] << 68 - gate.fraction_bits) - 1)
        operand = Fixed(specular.operand_format, np.array([under]))
        term = specular.compute(operand, np.zeros(1, bool), exponent).codes.item()
        assert term == 0, f"lit under the threshold, exponent {exponent}"


@pytest.mark.parametrize("bits", [5, 6, 17])
def test_nothing_is_shaded_under_a_threshold(bits):
    """At any exponent, the term of the largest N.H under the threshold is 0.

    Smaller N.H have no larger term.
    """
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
    """Each bug, injected in the unit, stops a span that reaches its threshold."""
    inject(HighlightGateUnit, *BUGS[bug])
    gate = HighlightGate(LIMITS, fraction_bits=6)
    with pytest.raises(AssertionError, match=r"^lost highlights"):
        stopped(gate, *off_the_plane(gate))


def test_bug_of_spans_out_of_range_is_found(inject):
    """If spans out of range are treated as other spans, some are stopped although they reach their
    threshold."""
    inject(HighlightGateUnit, "_lit_by", "out_of_range | bright", "bright")
    gate = HighlightGate(LIMITS, fraction_bits=5)
    with pytest.raises(AssertionError, match=r"^lost highlights"):
        stopped(gate, *in_a_plane(gate))


@pytest.mark.parametrize(("bits", "steps"), [(5, 1), (6, 1), (17, 12)])
def test_bug_of_thresholds_is_found(monkeypatch, bits, steps):
    """Words of the PROM that are too high are found: by one step, or by more than the margin for errors of
    pixels."""
    gate = HighlightGate(LIMITS, fraction_bits=bits)
    codes = gate.thresholds.codes
    high = np.minimum(codes + steps * (codes > 0), gate.level_format.max_code)
    monkeypatch.setitem(vars(gate), "thresholds", Fixed(gate.level_format, high))
    with pytest.raises(AssertionError, match=r"^lit under the threshold"):
        shades_nothing_under(gate)


def test_bug_of_the_cutoff_is_found(inject):
    """If the specular unit has no cutoff, it shades all of its parabola, and this is found."""
    inject(Specular, "compute", "lit &= shifted <= self.boundaries[exponent]", "pass")
    with pytest.raises(AssertionError, match=r"^lit under the threshold"):
        shades_nothing_under(HighlightGate(LIMITS))
