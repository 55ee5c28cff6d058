"""Runs of bit-accurate models on bounds, or on every code, for proofs that no word wraps."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE_SQUARED

from .bounds import Bounds, unknown, word

LENGTHS = np.arange(1, 1 << LENGTH_BITS)


def of_middle_normal(fit):
    MiddleNormal(fit).compute(word(COMPONENT, 1, 3), word(COMPONENT, 1, 3))


def of_difference_setup(as_published):
    DifferenceSetup(as_published).compute(word(GPQ.G_FORMAT, 1, 1), word(GPQ.P_FORMAT, 1, 1), LENGTHS)


def of_quadratic_evaluator(form):
    unit = QuadraticEvaluator(form)
    parameter = unit.parameter(unit.step(LENGTHS), Bounds(np.zeros(len(LENGTHS)), LENGTHS - 1))
    unit.evaluate(*(word(format, 1, 1) for format in (GPQ.G_FORMAT, GPQ.P_FORMAT, GPQ.Q_FORMAT)), parameter)


def of_chord_setup(fraction_bits):
    """Any three values. P and G saturate if they do not fit."""
    unit = ChordSetup(fraction_bits)
    unit.compute(word(unit.DIFFUSE_FORMAT, 1, 1, 3), word(unit.HIGHLIGHT_FORMAT, 1, 1, 3), LENGTHS)


def of_line_setup():
    LineSetup().compute(*(word(LineSetup.VECTOR_FORMAT, 1, 3) for _ in range(2)), LENGTHS)


def parts_of_lengths():
    """All lengths in parts of about 100,000 pixels, each with the spans and positions of its pixels."""
    for lengths in np.array_split(LENGTHS, np.searchsorted(np.cumsum(LENGTHS), np.arange(1, 84) * 100_000)):
        yield lengths, *pixels_of(lengths)


def rows(bounds, lengths):
    """The bounds with a row for every length."""
    return bounds + np.zeros((len(lengths), 1))


def walk(unit, start, first, second, span, step):
    """Check the sums of every pixel, and the differences of every pixel but the last."""
    unit.compute(start, first, second, span, step)
    before = np.flatnonzero(np.diff(span, append=-1) == 0)
    changes = first.codes[span[before]] + step[before, np.newaxis] * second.codes[span[before]]
    if unit.difference_format.width < unit.format.width:
        unit.difference_format.wrap(changes)


def of_normals(as_published, fits, format=DifferenceSetup.FORMAT):
    """Spans up to 45 degrees, where the middle normal has its flag.

    For vectors of exactly unit length ``|N_r - N_l| = 2 sin(psi/2)`` and ``|G| = 4 (1 - cos(psi/2))``. Both
    are perpendicular, and P is their difference. ``error`` is for lengths that are off, for the error of N_c,
    and for angles a little beyond 45 degrees.
    """
    half = np.radians(MAX_SPAN_ANGLE) / 2
    error = 2.0**-12 + 4 * max(MiddleNormal(fit).error for fit in fits)
    most = np.array(
        [2 * np.sin(half), 4 * (1 - np.cos(half)), np.hypot(2 * np.sin(half), 4 * (1 - np.cos(half)))]
    )
    chord, bend, slope = ((most + error) / COMPONENT.step).tolist()
    left = unknown(COMPONENT.min_code, COMPONENT.max_code)
    g, d = unknown(-bend, bend), unknown(-chord, chord)
    p = (d - g).known(-slope, slope)
    for lengths, span, step in parts_of_lengths():
        n, g_rows, p_rows = (rows(bounds, lengths) for bounds in (left, g, p))
        g_word, p_word = Fixed(GPQ.G_FORMAT, g_rows), Fixed(GPQ.P_FORMAT, p_rows)
        differences = DifferenceSetup(as_published).compute(g_word, p_word, lengths)
        walk(DifferenceAccumulator(format=format), Fixed(COMPONENT, n), *differences, span, step)


def of_lines(format=DifferenceSetup.FORMAT):
    """Straight lines between any ends."""
    left, right = (unknown(COMPONENT.min_code, COMPONENT.max_code) for _ in range(2))
    p = (right - left).known(GPQ.P_FORMAT.min_code, GPQ.P_FORMAT.max_code)
    for lengths, span, step in parts_of_lengths():
        n, zero, p_rows = (rows(bounds, lengths) for bounds in (left, Bounds.of([[0]]), p))
        differences = DifferenceSetup().compute(
            Fixed(GPQ.G_FORMAT, zero), Fixed(GPQ.P_FORMAT, p_rows), lengths
        )
        walk(DifferenceAccumulator(format=format), Fixed(COMPONENT, n), *differences, span, step)


def of_true_lines(format=None):
    """Lines between any ends, before they are renormalised."""
    sums, ends = RenormaliseInterpolator().accumulator, RenormaliseInterpolator.END_FORMAT
    if format is not None:
        sums = replace(sums, format=format)
    left, right = (unknown(ends.min_code, ends.max_code) for _ in range(2))
    for lengths, span, step in parts_of_lengths():
        words = [Fixed(ends, rows(bounds, lengths)) for bounds in (left, right)]
        first = LineSetup().compute(*words, lengths)
        zero = Fixed(first.format, rows(Bounds.of([[0]]), lengths))
        walk(sums, words[0], first, zero, span, step)


def of_segments(levels):
    """Any two ends. If a component differs by more than its word holds, left is on the other side of 0."""
    unit = AdaptiveNormaliser()
    low, high = COMPONENT.min_code, COMPONENT.max_code
    left, right = (unknown(low, high) for _ in range(2))
    ends = (
        (left, (right - left).known(low, high)),
        (unknown(low, 0), Bounds.of([[high]])),
        (unknown(0, high), Bounds.of([[low]])),
    )
    for lengths, *_ in parts_of_lengths():
        each = np.full(len(lengths), levels)
        span, _, *positions = unit.positions(lengths, each)
        for pair in ends:
            words = (Fixed(COMPONENT, rows(bounds, span)) for bounds in pair)
            unit.walk(*words, lengths, each, span, *positions)


def of_chord_sums(name, fraction_bits, format=None):
    """Any values at the first pixel, and any P and G."""
    unit = LocalChordInterpolator(fraction_bits=fraction_bits)
    sums, setup = unit.accumulators[name], unit.setup
    if format is not None:
        sums = replace(sums, format=format)
    slope_format = {"diffuse": setup.DIFFUSE_SLOPE_FORMAT, "highlight": setup.SLOPE_FORMAT}[name]
    formats = sums.start_format, slope_format, setup.CURVATURE_FORMAT
    start, slope, curvature = (unknown(f.min_code, f.max_code) for f in formats)
    for lengths, span, step in parts_of_lengths():
        words = Fixed(sums.start_format, rows(start, lengths)), Fixed(slope_format, slope)
        walk(
            sums,
            *setup.differences(*words, Fixed(setup.CURVATURE_FORMAT, curvature), *setup.steps(lengths)),
            span,
            step,
        )


def of_bisection(degree, max_angle, as_published):
    unit = Bisection(degree, max_angle, as_published)
    unit.factor(Fixed(unit.ANGLE_FORMAT, np.arange(-2, unit.widest.codes + 1)))


def of_bisection_chain(degree, max_angle, as_published):
    """Every word of u up to the flag, through all levels. The factors of a level depend only on u.

    `of_bisection` covers the angles for which a level asks the factor of the bisection.
    """
    unit = BisectionChain(Bisection(degree, max_angle, as_published))
    p, factor, levels = unit.bisection, unit.bisection.factor, (1 << unit.LEVEL_BITS) - 1
    # Eight words of u have the same angle. The range begins at -2, because lengths may be over 1.
    u = np.arange(-2, p.widest.codes + 0.5, 1 / 8)
    u = Fixed.round(unit.WEIGHT_FORMAT, u * p.ANGLE_FORMAT.step)
    dot = Fixed(DotProduct().result_format, ONE_SQUARED.codes - (u.codes << 14))
    found = []

    def noted(_, angle):
        found.append(angle)
        assert angle.format == p.ANGLE_FORMAT
        assert -2 <= angle.codes.min() <= angle.codes.max() <= p.widest.codes, "no angle of a bisection"
        return factor(angle)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DotProduct, "compute", lambda *_: dot)
        patch.setattr(Bisection, "factor", noted)
        normal = Fixed(COMPONENT, np.zeros((1, 3), dtype=np.int64))
        unit.compute(normal, normal, np.full(len(dot.codes), levels))
    assert len(found) == levels


def of_renormaliser():
    """Every segment and every x in the four octaves of s."""
    unit, width = Renormaliser(), Renormaliser.SEGMENT_BITS + Renormaliser.OFFSET_FORMAT.width
    square = DotProduct().result_format
    codes = (1 << square.fraction_bits - 2) + (np.arange(1 << width) << square.fraction_bits - 2 - width)
    for octave in range(unit.OCTAVES):
        unit.factor(Fixed(square, codes << octave))


def of_half_chord():
    for shift, count in ((0, 1 << 22), (1, 1 << 23)):
        for chord in np.array_split(np.arange(count) << 13 - 2 * shift, count >> 18):
            HalfChord().compute(Fixed(UQ(2, 34), chord), np.zeros(chord.shape, bool))


def of_specular_slopes(model):
    assert len(model.slopes.codes) == 1 << model.EXPONENT_BITS


def sectors(degrees, one, like):
    """A and x with ``a^2 + x^2 <= 1``: for each sector between two radii, the box around the sector.

    No sector has an axis inside.
    """
    assert 90 % degrees == 0
    for low in range(-180, 180, degrees):
        ends = np.radians([low, low + degrees])
        yield tuple(unknown(*np.sort(one * f(ends)), np.ones((len(like), 1)))[:, 0] for f in (np.cos, np.sin))


def of_recurrence_slopes(monkeypatch):
    """Every word of q from 1/8 on, and the largest word of each further shift; all other words lie between
    them.

    Let T be the unit vector perpendicular to N_l, and x = T.H. Then ``N_r = (1 - q) N_l + sin(psi) T``, so
    ``b = (1 - q) a + sin(psi) x``. ``cut`` is for the errors: q is off by half a step and by the cuts of
    `Chord`. b has more than twice the error of the codes' lengths. The span has two pixels.
    """
    unit = RecurrenceSetup()
    word = np.r_[np.tile(np.arange(1 << 16, 1 << 17), 3), np.full(32, (1 << 17) - 1)]
    shift = np.r_[np.repeat(np.arange(3), 1 << 16), np.arange(3, 35)]
    q = word * 2.0 ** (-17 - shift)
    one = (1 << 34) * (1 + 2.0**-16)
    cut = unknown(-one, one, np.full((len(q), 1), 2.0**-14))[:, 0]
    vectors = [Fixed(COMPONENT, np.zeros((len(q), 3), dtype=np.int64)) for _ in range(3)]
    monkeypatch.setattr(Chord, "compute", lambda *_: Fixed(Chord.FORMAT, word << 18 >> shift))
    monkeypatch.setattr(Recurrence, "prologue", lambda _, first, second, *__: (first, second))
    for a, x in sectors(45, one, q):
        b = (a * (1 - q) + x * np.sqrt(q * (2 - q)) + cut).known(-one, one)
        cosines = iter([Fixed(unit.COSINE_FORMAT, code) for code in (a, b)])
        monkeypatch.setattr(RecurrenceSetup, "_cosine", lambda *_, cosines=cosines: next(cosines))
        unit.compute(*vectors, np.full(len(q), 2))


def of_recurrence_prologue(format=None):
    """Every word of K, for steps up to 90 degrees.

    K and D(0) may be off by 1 %; the setup's are off by under 0.1 %.

    ``D(0) = x sin d - a K/2`` with x as for the slopes and ``a^2 + x^2 <= 1``, in sectors of 15 degrees. If K
    is under 2^-7, D(0) may be off by 0.1. This covers ends that are a few codes apart, whose lengths are off
    by as much as the ends differ.
    """
    unit = RecurrenceSetup().steps
    state = format or unit.state_format
    shift, low = (axis.ravel() for axis in np.indices((9, 1 << 12)))
    low = (low << 4) + (1 << 16)
    near = low * 2.0 ** (-15 - shift) <= 2.02
    # The last box covers all K under 2^-7.
    shift, low, high = (
        np.append(x[near], last) for x, last in ((shift, 9), (low, 0), (low + 15, (1 << 17) - 1))
    )
    factor, k = Bounds(low, high), (low + high) * 2.0 ** (-16 - shift)
    left = (high + 1 - low) * 2.0 ** (-16 - shift) + 0.01 * k
    sine = np.sqrt(k * (1 - k / 4))
    one = (1 << 44) * (1 + 2.0**-16)
    off = unknown(-one, one, np.where(shift == 9, 0.1, 0.01 * sine + left)[:, np.newaxis])[:, 0]
    for a, x in sectors(15, one, k):
        second = x * sine - a * (k / 2) + off
        total = state.wrap(a + unit._half_operand)
        state.wrap(second)
        for step in range(7):
            total, second = unit._reinsch(total, second, factor, shift, step == 0)
            state.wrap(total)


def of_recurrence_shifts(bits=6, bits_of_length=4):
    """Shifts of words, for 65 words of q at the ends of its shifts, for q = 0, and for every length."""
    words = np.r_[0, np.arange(1 << 16, 1 << 17, 1 << 10), (1 << 17) - 1]
    word, shift, length = (axis.ravel() for axis in np.meshgrid(words, np.r_[0, 1, 2, 34], LENGTHS))
    shifts, decided = [], []

    def note(function):
        def noted(*operands):
            result = function(*operands)
            decided.append(result[1])
            return result

        return noted

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Chord, "compute", lambda *_: Fixed(Chord.FORMAT, word << 18 >> shift))
        patch.setattr(Recurrence, "prologue", lambda *operands: (operands[-1], shifts.append(operands[-1])))
        for name in ("_under_one", "_over_half"):
            patch.setattr(RecurrenceSetup, name, note(getattr(RecurrenceSetup, name)))
        vectors = [Fixed(COMPONENT, np.zeros((1, 3), dtype=np.int64)) for _ in range(3)]
        RecurrenceSetup().compute(*vectors, length)
    (step_shift,), (over, under, rho_over) = shifts, decided
    _, halvings = reciprocal_address(length - 1)
    exponent = step_shift + 1
    for places in (exponent - under, exponent, step_shift, np.maximum(exponent - 5, 0)):
        Fixed(UQ(bits, 0), Bounds.of(places))
    for places in (halvings, halvings - rho_over):
        Fixed(UQ(bits_of_length, 0), Bounds.of(places))
    assert set(over) == set(under) == {0, 1}
