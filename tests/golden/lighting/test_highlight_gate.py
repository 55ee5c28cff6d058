"""Highlight gate: every decision with short words, and spans with full words through the pipeline's model."""

import numpy as np
import pytest

from blysk.bench.units.lighting.highlight_gate import spans_about
from blysk.bench.units.operands import code_pairs_at, component_words, pairs_at, sphere, unit_codes
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.reflection import REFLECTION_MODELS

from ...lists import FURTHER_MODELS, SPECULAR_MODELS

EXPONENTS = (2, 3, 5, 10, 30, 100, 300, 500, 1000)

METHOD = QuadraticInterpolator()
LIMITS = METHOD.gate_limits
MARGIN = HighlightGate(LIMITS).margin


def arc_maximum(a, b, angle, shares=513):
    """Largest N·H at points of the arc, by the sine formula, which the gate does not use."""
    x = np.linspace(0, 1, shares)
    largest = np.full(np.broadcast_shapes(np.shape(a), np.shape(b), np.shape(angle)), -np.inf)
    for share in x.tolist():
        largest = np.maximum(
            largest, (a * np.sin((1 - share) * angle) + b * np.sin(share * angle)) / np.sin(angle)
        )
    return largest


@pytest.mark.parametrize("bits", [5, 6])
def test_every_decision_at_reduced_width(bits):
    gate = HighlightGate(LIMITS, fraction_bits=bits)
    codes = np.arange(1 << bits)
    a, b = codes[:, np.newaxis, np.newaxis], codes[:, np.newaxis]
    lit_of_all = []
    for angle in range(1, gate.widest.codes.item() + 4):
        u = Fixed(gate.angle_format, angle)
        lit = gate.decide(
            Fixed(gate.level_format, a), Fixed(gate.level_format, b), u, Fixed(gate.level_format, codes)
        )
        psi = np.arccos(1 - u.values)
        maximum = arc_maximum(a / 2**bits, b / 2**bits, psi)
        threshold = codes / 2**bits
        # One of 513 points is within psi/1024 of the maximum, and lower by less than 4e-7.
        assert not (~lit & (maximum**2 >= threshold + 1e-12)).any()
        # Spans that the gate lets through are near the threshold: w is cut by 2^(1-F), M^2 = (d^2 + 2abu) /
        # (u (2 - u)).
        needless = lit & (maximum**2 < threshold - 2.0 ** (1 - bits) / (2 - u.values) - 4e-7)
        assert not needless.any()
        lit_of_all.append(lit.mean())
    assert 0.3 < np.mean(lit_of_all) < 0.8


def random_spans(rng, count, exponent, gate):
    """Normals and H for which the largest N·H of the arc is near the threshold, inside the arc or at an
    end."""
    degrees = rng.choice([0.0, 1e-4, 0.1, 1.0, 44.99, -1.0], count, p=[0.05, 0.05, 0.1, 0.1, 0.1, 0.6])
    degrees = np.where(degrees < 0, rng.uniform(0, 45, count), degrees)
    tau = np.sqrt(gate.thresholds.values[exponent])
    halfway = sphere(rng, count)
    near = spans_about(rng, halfway, tau, degrees, 10.0 ** rng.uniform(-5.3, -1, count) * (1 - tau))
    return *(quantise(ends) for ends in near), quantise(halfway)


def largest_cosine(interpolator, left, right, halfway, length):
    """Largest code of N·H over the pixels of each span, by the method's bit-accurate model."""
    normals, out_of_range = interpolator.normals(*component_words(left, right), length)
    assert not out_of_range.any()
    span, pixel = pixels_of(length)
    cosine = DotProduct().compute(normals, *component_words(halfway[span]))
    return Fixed(cosine.format, np.maximum.reduceat(cosine.codes, np.flatnonzero(pixel == 0)))


def check_spans(gate, rng, count, shaded_share=1 / 20, method=METHOD):
    """Check some spans. The last bits of the comparison decide most of them."""
    dark, shaded = 0, 0
    for exponent in EXPONENTS:
        left, right, halfway = random_spans(rng, count // len(EXPONENTS), exponent, gate)
        length = rng.choice([1, 2, 3, 5, 8, 16], len(left), p=[0.1, 0.3, 0.3, 0.2, 0.08, 0.02])
        lit = gate.compute(*component_words(left, right, halfway), exponent)
        cosine = largest_cosine(method, left, right, halfway, length)
        # The specular term falls as N·H falls, so the term of the largest N·H is the largest.
        term = gate.specular.compute(cosine, np.zeros(len(lit), bool), exponent)
        assert not term.codes[~lit].any()
        dark += np.count_nonzero(~lit)
        shaded += np.count_nonzero(term.codes)
    assert dark > count / 10
    assert shaded > count * shaded_share


def test_no_pixel_is_suppressed():
    check_spans(HighlightGate(LIMITS), np.random.default_rng(1), 100_000)


@pytest.mark.parametrize("model", ["cosquad7", "lyon3", "exp"])
def test_no_pixel_is_suppressed_in_other_models(model):
    check_spans(HighlightGate(LIMITS, Specular(REFLECTION_MODELS[model])), np.random.default_rng(2), 20_000)


def test_no_pixel_is_suppressed_with_other_middle_normals():
    steps = {}
    for fit in MIDDLE_NORMAL_FITS:
        method = QuadraticInterpolator(middle_normal=MiddleNormal(fit))
        gate = HighlightGate(method.gate_limits)
        steps[fit] = gate.margin * 2**17
        # With a wide margin, spans about the threshold seldom have a visible highlight.
        check_spans(gate, np.random.default_rng(10), 20_000, shaded_share=1 / 100, method=method)
    assert steps["exact"] * 2.0**-17 == MARGIN
    others = sorted(steps.values())[1:]
    assert (others[0], others[-1]) == (135, 875)


def test_margin_of_the_default_fit_is_not_enough_for_others():
    """With a normal that is 0.38 % too long, the margin of the default fit would lose highlights."""
    gate, other = HighlightGate(LIMITS), QuadraticInterpolator(middle_normal=MiddleNormal("minimax_2"))
    rng = np.random.default_rng(11)
    left, right, halfway = random_spans(rng, 20_000, 300, gate)
    cosine = largest_cosine(other, left, right, halfway, np.full(20_000, 5))
    term = gate.specular.compute(cosine, np.zeros(20_000, bool), 300)
    assert term.codes[~gate.compute(*component_words(left, right, halfway), 300)].any()


@pytest.mark.long
def test_no_pixel_of_ten_million_spans_is_suppressed():
    rng = np.random.default_rng(3)
    for _ in range(50):
        check_spans(HighlightGate(LIMITS), rng, 200_007)


def test_long_spans():
    """The rounding of the differences is largest at pixel 4095."""
    gate, rng = HighlightGate(LIMITS), np.random.default_rng(4)
    for exponent in (10, 1000):
        left, right, halfway = random_spans(rng, 150, exponent, gate)
        length = np.full(150, 4095)
        lit = gate.compute(*component_words(left, right, halfway), exponent)
        cosine = largest_cosine(METHOD, left, right, halfway, length)
        assert not gate.specular.compute(cosine, np.zeros(150, bool), exponent).codes[~lit].any()
        assert 10 < np.count_nonzero(lit) < 140


def test_steps_1_and_2_of_the_proof():
    """Checks the curve by the weights of its ends, its length inside the unit circle, and the bound on
    N.H."""
    rng = np.random.default_rng(7)
    angle = np.r_[1e-3, rng.uniform(0, 45, 1998), 45]
    left, right = pairs_at(rng, 2000, angle)
    psi, t = np.radians(angle)[:, np.newaxis], np.linspace(0, 1, 101)
    h = 1 / np.sqrt(2 * (1 + np.cos(psi)))
    k = 4 * h - 2
    alpha, beta = (1 - t) * (1 + k * t), t * (1 + k * (1 - t))
    assert min(alpha.min(), beta.min(), k.min()) >= 0
    middle = h * (left + right)
    g, p = 2 * right - 4 * middle + 2 * left, 4 * middle - right - 3 * left
    # Step 5 has these as its largest values.
    assert 0.304 < np.linalg.norm(g, axis=1).max() < 0.305
    assert 0.82 < np.linalg.norm(p, axis=1).max() < 0.83
    curve = (g[:, np.newaxis] * t[:, np.newaxis] + p[:, np.newaxis]) * t[:, np.newaxis] + left[:, np.newaxis]
    weighted = alpha[:, :, np.newaxis] * left[:, np.newaxis] + beta[:, :, np.newaxis] * right[:, np.newaxis]
    assert np.abs(curve - weighted).max() < 1e-14
    s, c = 2 * t - 1, np.cos(psi / 2)
    squared = 1 - (1 - c) ** 2 * s**2 * (1 - s**2)
    assert np.abs((curve**2).sum(axis=-1) - squared).max() < 1e-13
    assert squared.max() <= 1
    # A vector p of the plane with any projections, also negative ones. The maximum over the arc comes from
    # its points.
    a, b = rng.uniform(-1, 1, (2, 2000, 1))
    maximum = np.maximum(arc_maximum(a, b, psi), np.maximum(a, b))
    peak = np.sqrt((a - b) ** 2 + 2 * a * b * (1 - np.cos(psi))) / np.sin(psi)
    # Between two of 513 points the maximum may be higher by (psi/1024)^2/2 of the peak.
    slack = peak * (psi / 1024) ** 2 / 2
    assert np.all(alpha * a + beta * b <= np.maximum(0, maximum + slack) + 1e-12)


def test_step_3_of_the_proof():
    """The maximum over the arc grows with psi, and with a and b that are not negative.

    The words are at least the exact values.
    """
    rng = np.random.default_rng(8)
    count = 200_000
    a, b = rng.uniform(0, 1, (2, count))
    psi = rng.uniform(1e-3, np.pi / 3, count)
    more = rng.uniform(0, 0.1, (3, count))

    def largest(a, b, psi):
        x = np.maximum(a, b)
        inside = np.minimum(a, b) > x * np.cos(psi)
        square = ((a - b) ** 2 + 2 * a * b * (1 - np.cos(psi))) / np.sin(psi) ** 2
        return np.where(inside, np.sqrt(square), x)

    base = largest(a, b, psi)
    for grown in (largest(a + more[0], b, psi), largest(a, b + more[1], psi), largest(a, b, psi + more[2])):
        assert np.all(grown >= base * (1 - 1e-9))
    # The cut of u and the square of the code of length 1 take less than 2.2 of the 3 steps.
    gate = HighlightGate(LIMITS)
    omega = gate.one_squared.codes.item()
    exact = rng.integers(0, int(omega * (1 - np.cos(np.radians(45)))), count)
    word = (exact >> 16) + 3
    over = word * 2.0**-18 - exact / omega
    assert over.min() > 0.8 * 2.0**-18
    assert over.max() <= 3 * 2.0**-18
    # The same for a and b. If a word saturates, its square is over every threshold.
    dot = Fixed(DotProduct().result_format, rng.integers(-(2**34), 2**34, count))
    level = gate._level(dot).values
    assert np.all((level >= dot.values) | (level == gate.level_format.max_code * gate.level_format.step))
    top = (gate.level_format.max_code * gate.level_format.step) ** 2
    for model in SPECULAR_MODELS + FURTHER_MODELS:
        assert HighlightGate(LIMITS, Specular(REFLECTION_MODELS[model])).thresholds.values.max() < top


@pytest.mark.parametrize("model", SPECULAR_MODELS + FURTHER_MODELS)
def test_the_term_is_0_everywhere_below(model):
    """There is no second lobe: from N.H = -1 up to the threshold less its margin the unit gives 0."""
    gate, rng = HighlightGate(LIMITS, Specular(REFLECTION_MODELS[model])), np.random.default_rng(9)
    for exponent in (2, 3, 5, 10, 20, 100, 500, 1000):
        # T was cut, so the root is under tau.
        tau = np.sqrt(gate.thresholds.values[exponent])
        if tau == 0:
            continue
        highest = int((tau + gate.margin) * 2.0**34)
        codes = np.r_[rng.integers(-(2**34), highest, 50_000), highest - np.arange(2000), -(2**34)]
        operand = Fixed(gate.specular.operand_format, codes)
        assert not gate.specular.compute(operand, np.zeros(len(codes), bool), exponent).codes.any()


def test_margin_covers_the_pipeline():
    """Checks the sum of step 5 of the proof, and how near pixels come to it."""
    k = 4094
    terms = [
        np.sqrt(3) * MiddleNormal.ERROR,
        2.0**-17 * 0.83 + (2.0**-16 + 2.0**-17 + 2.0**-34) * 0.305,
        np.sqrt(3) * 2.0**-42 * (k + k * k / 2),
        np.sqrt(3) * 2.0**-18,
    ]
    assert 4.2 * 2.0**-17 < sum(terms) < 4.45 * 2.0**-17 < MARGIN
    rng, gate = np.random.default_rng(5), HighlightGate(LIMITS)
    worst = 0
    for exponent in (10, 1000):
        left, right, halfway = random_spans(rng, 20_000, exponent, gate)
        cosine = largest_cosine(METHOD, left, right, halfway, rng.integers(1, 20, len(left)))
        one = ONE_SQUARED.values
        a, b = (np.einsum("ij,ij->i", end, halfway) * 2.0**-34 for end in (left, right))
        r = np.einsum("ij,ij->i", left, right) * 2.0**-34 / one
        maximum = np.maximum(arc_maximum(a, b, np.arccos(np.minimum(r, 1 - 1e-12)), 101), np.maximum(a, b))
        worst = max(worst, (cosine.values - maximum).max())
        # Spans that the gate lets through are near the threshold, so the margins cost little.
        lit = gate.compute(*component_words(left, right, halfway), exponent)
        assert (maximum[lit] ** 2 > gate.thresholds.values[exponent] - 9 * 2.0**-17).all()
    assert MARGIN / 8 < worst < MARGIN


@pytest.mark.long
def test_thresholds_lie_under_what_the_unit_shades():
    for model in SPECULAR_MODELS + FURTHER_MODELS:
        gate = HighlightGate(LIMITS, Specular(REFLECTION_MODELS[model]))
        lowest = gate.thresholds.values
        for exponent in (1, 2, 3, 10, 100, 500, 999, 1000):
            # Bisection finds the largest N·H whose term is 0.
            low, high = -ONE_SQUARED.codes.item(), ONE_SQUARED.codes.item()
            operand = gate.specular.operand_format
            shade = lambda code, gate=gate, n=exponent, operand=operand: gate.specular.compute(  # noqa: E731
                Fixed(operand, np.array([code])), np.zeros(1, bool), n
            ).codes[0]
            assert shade(high) > 0
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (middle, high) if shade(middle) == 0 else (low, middle)
            tau = low * 2.0**-34 - MARGIN if shade(low) == 0 else -1.0
            if tau <= 0:
                assert lowest[exponent] == 0
            else:
                assert tau**2 - 2.0**-17 < lowest[exponent] <= tau**2


def test_stiff_spans():
    """Equal and opposite normals, spans out of range, ends of the words, a highlight inside a span."""
    gate, rng = HighlightGate(LIMITS), np.random.default_rng(6)

    def lit(left, right, halfway, exponent):
        return gate.compute(*component_words(*map(np.asarray, (left, right, halfway))), exponent)

    for angle in (45.1, 89.9, 90.0, 90.1, 180.0):
        left, right = code_pairs_at(rng, 300, angle)
        halfway = unit_codes(rng, 300)
        for exponent in (1, 10, 1000):
            assert lit(left, right, halfway, exponent).all()
    # Away from H nothing is lit, at H everything is lit.
    left, right = code_pairs_at(rng, 300, rng.choice([0, 1e-4, 1, 30], 300))
    assert not lit(left, right, -left, 3).any()
    assert lit(left, right, left, 1000).all()
    assert lit(left, right, right, 1000).all()
    # A highlight of 5 degrees is in the middle of a span of 40 degrees.
    half = np.radians(20)
    ends = quantise(np.array([[-np.sin(half), 0, np.cos(half)], [np.sin(half), 0, np.cos(half)]]))
    for exponent in (100, 1000):
        assert lit(ends[:1], ends[1:], [0, 0, ONE], exponent)
        assert not lit(ends[:1], ends[:1], [0, 0, ONE], exponent)
    # An exponent that lights everything: n = 1.
    assert lit(left, right, -left, 1).all()
    corners = rng.choice([-(2**17), 2**17 - 1, 0], (3, 500, 3))
    lit(*corners, 10)


def test_bad_arguments_are_refused():
    for bits in (4, 18):
        with pytest.raises(ValueError, match=rf"^fraction_bits must be 5 to 17, not {bits}$"):
            HighlightGate(LIMITS, fraction_bits=bits)
    zero = Fixed(COMPONENT, [[0, 0, 0]])
    for exponent in (0, 1001):
        with pytest.raises(ValueError, match=r"^exponents must be 1 to 1000$"):
            HighlightGate(LIMITS).compute(zero, zero, zero, exponent)
    with pytest.raises(ValueError, match=r"^operands must be SQ\(1, 17\) and SQ\(1, 17\), not "):
        HighlightGate(LIMITS).compute(zero, Fixed(MiddleNormal.FORMAT, [[0, 0, 0]]), zero, 10)
