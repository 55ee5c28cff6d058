"""Value gate: it never loses a highlight; how near its decisions are; what a pixel's u may be off by."""

import numpy as np
import pytest

from blysk.bench.units.lighting.value_gate import parabolas_near
from blysk.bench.units.operands import any_codes
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.reflection import REFLECTION_MODELS

METHOD = LocalChordInterpolator()
FORMAT = ChordSetup.HIGHLIGHT_FORMAT
EXPONENTS = (1, 2, 3, 4, 5, 8, 10, 31, 32, 60, 100, 255, 256, 500, 999, 1000)
GATES = {
    name: ValueGate(specular)
    for name, specular in (
        *(
            (m, Specular(REFLECTION_MODELS[m], "one_minus_cosine"))
            for m in ("cosquad", "lyon2", "exp", "coscos2")
        ),
        ("power", Power("one_minus_cosine")),
    )
}


def operands_of(u, length, method=METHOD):
    """u of every pixel of spans with three values each, as the specular unit takes it; their spans."""
    values = SpanValues(np.zeros_like(u)[:, np.newaxis], u[:, np.newaxis])
    operands = method.compute_values(values, length)
    return operands.highlight[:, 0], pixels_of(length)[0], operands.out_of_range


def lost(gate, u, length, exponent, method=METHOD):
    """Spans that are not lit and have a pixel with a term; how many are not lit, how many have no term."""
    lit = gate.compute(u, exponent)
    operand, span, out_of_range = operands_of(u, length, method)
    term = gate.specular.compute(operand, np.zeros(len(span), bool), exponent).codes
    shows = np.bincount(span, term > 0, len(u)) > 0
    # Words that hold P and G: a gated span is never out of range.
    return np.flatnonzero(~lit & (shows | out_of_range)), np.count_nonzero(~lit), np.count_nonzero(~shows)


def assert_none_lost(gate, u, length, exponent, least=1, method=METHOD):
    spans, dark, _ = lost(gate, u, length, exponent, method)
    assert not len(spans), (u[spans[:3]], np.asarray(length)[spans[:3]], exponent)
    assert dark >= least
    return dark


def lengths_of(rng, count):
    """Most short, some of every size up to the longest."""
    length = rng.integers(3, 40, count)
    length[::50] = np.floor(4096 ** rng.uniform(0.5, 1, len(length[::50])))
    return length


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("name", GATES)
def test_no_highlight_is_lost(name, exponent):
    """Parabolas of every size with the least u about the threshold, off by 2^-25 to its size; any words."""
    gate, rng, count = GATES[name], np.random.default_rng(exponent), 6000
    nearest = gate.thresholds.values[exponent] / 2
    least = min(nearest, 2.0) + rng.choice([-1, 1], count) * 10.0 ** rng.uniform(-7.5, 0, count)
    u = parabolas_near(rng, np.clip(least, 0, 2), 2.0**-4)
    u[::10] = any_codes(rng, FORMAT, len(u[::10]), 3)
    dark = assert_none_lost(gate, u, lengths_of(rng, count), exponent, 300 * (nearest < 1.9))
    if nearest > 2:
        # There is no u from which on the term is 0.
        assert dark == 0


@pytest.mark.parametrize("step", [9, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", GATES)
def test_every_exponent_at_its_threshold(name, step):
    """Three equal values, at the threshold and a code less: not lit and dark; lit."""
    gate = GATES[name]
    for exponent in range(1, 1001, step):
        code = -(-gate.thresholds[exponent].extend(gate.LEVEL_FORMAT).codes.item() // 2)
        if code > FORMAT.max_code:
            continue
        u = np.full((2, 3), code)
        u[1] -= 1
        assert gate.compute(u, exponent).tolist() == [False, True]
        assert_none_lost(gate, u, np.array([3, 3]), exponent)


@pytest.mark.parametrize("exponent", [20, 1000])
def test_every_small_parabola(exponent):
    """All bulges and rises of some codes about the threshold, at lengths of 3 to 20 pixels and long ones."""
    gate = ValueGate()
    code = gate.thresholds[exponent].extend(gate.LEVEL_FORMAT).codes.item() // 2
    left, bulge, rise = (grid.ravel() for grid in np.mgrid[-24:25, -16:17, -8:9])
    left = code + left
    right = left + rise
    u = np.stack([left, (left + right - bulge) // 2, right], axis=1)
    for length in (*range(3, 21), 129, 1025):
        part = slice(None) if length < 21 else slice(None, None, 101)
        assert_none_lost(gate, u[part], np.full(len(u[part]), length), exponent, 10)


@pytest.mark.parametrize("fraction_bits", [36, 46])
def test_margin(fraction_bits):
    """The distance of a pixel's u from the quadratic through the codes, of spans that are held."""
    rng, gate, count = np.random.default_rng(3), ValueGate(), 4000
    method = LocalChordInterpolator(fraction_bits)
    t = ValueGate
    worst = 0.0
    for longest in (
        3,
        9,
        *rng.integers(10, 128, 12).tolist(),
        *rng.integers(64, method.setup.longest, 12).tolist(),
    ):
        rise = rng.integers(-t.LARGEST_RISE + 1, t.LARGEST_RISE, count)
        bulge = rng.integers(-t.LARGEST_BULGE + 2, t.LARGEST_BULGE - 1, count)
        rise[::2] = rng.choice([-1, 1], len(rise[::2])) * (t.LARGEST_RISE - 1)
        bulge[::3] = rng.choice([-1, 1], len(bulge[::3])) * (t.LARGEST_BULGE - 2)
        left = rng.integers(FORMAT.max_code // 4, FORMAT.max_code // 2, count)
        right = left + rise
        u = np.stack([left, (left + right - bulge) // 2, right], axis=1)
        few = slice(0, 40_000 // longest)
        length = np.full(len(u[few]), longest)
        operand, span, out_of_range = operands_of(u[few], length, method)
        assert not out_of_range.any()
        step = np.concatenate([np.arange(longest)] * len(length)) / (longest - 1)
        left, middle, right = (u[few][span, k] * FORMAT.step for k in range(3))
        curvature = 2 * (left + right - 2 * middle)
        exact = left + step * (right - left - curvature + step * curvature)
        worst = max(worst, np.abs(operand.values - exact).max())
    # Half a step of the operand is in the margin.
    assert worst <= gate.margin
    assert worst > gate.margin / 4


def test_what_is_not_held_is_lit():
    """Bulges of 2^-5 and rises of 1/8, far from every highlight: lit from there on, not before."""
    gate, far = ValueGate(), 1 << 26
    bulge, rise = ValueGate.LARGEST_BULGE, ValueGate.LARGEST_RISE
    for off, lit in ((-2, False), (0, True), (2, True)):
        for sign in (1, -1):
            curved = np.array([far, far - sign * (bulge + off) // 2, far])
            assert gate.compute(curved, 1000) == lit
            sloped = np.array([far, far + sign * (rise + off) // 2, far + sign * (rise + off)])
            assert gate.compute(sloped, 1000) == lit
    # Their words hold any span that is not lit.
    assert ChordSetup.CURVATURE_FORMAT.max_code * ChordSetup.CURVATURE_FORMAT.step > 2 * bulge * FORMAT.step
    assert ChordSetup.SLOPE_FORMAT.max_code * ChordSetup.SLOPE_FORMAT.step > (rise + 2 * bulge) * FORMAT.step


@pytest.mark.parametrize("exponent", [10, 100, 1000])
def test_few_dark_spans_are_lit(exponent):
    """Of spans whose least u is over 1.05 times the last lit one none is lit; straight ones a step on."""
    gate, rng = ValueGate(), np.random.default_rng(exponent)
    last = (gate.specular.last_lit_arguments[exponent] + 1) * 2.0**-25
    least = last * rng.uniform(1.05, 1.5, 4000)
    u = parabolas_near(rng, least, min(2.0**-5, 0.05 * last))
    held = np.abs(u[:, 2] - u[:, 0]) < ValueGate.LARGEST_RISE
    assert held.mean() > 0.7
    assert not gate.compute(u[held], exponent).any()
    straight = np.rint(
        np.full((1, 3), last * 1.001 + 2e-6 + ValueGate.THRESHOLD_FORMAT.step / 2) / FORMAT.step
    ).astype(np.int64)
    assert not gate.compute(straight, exponent).any()


def test_lights_and_exponents_broadcast():
    gate = ValueGate()
    u = np.zeros((2, 3, 3), dtype=np.int64)
    u[:, 1] = FORMAT.max_code // 2
    found = gate.compute(u, np.array([[1000], [1]]))
    assert found.tolist() == [[True, False, True], [True, True, True]]


@pytest.mark.parametrize("exponent", [0, 1001])
def test_refuses(exponent):
    with pytest.raises(ValueError, match=r"^exponents must be 1 to 1000$"):
        ValueGate().compute(np.zeros((1, 3), dtype=np.int64), exponent)
    assert ValueGate().compute(np.zeros((0, 3), dtype=np.int64), np.zeros(0, int)).shape == (0,)
