"""Proofs that no word of a setup or a sum wraps: the bit-true twins, run on bounds or on every code."""

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import pytest

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.number.reciprocal import reciprocal_address
from blysk.golden.number.spans import LENGTH_BITS, pixels_of
from blysk.golden.number.unit_vector import CODE_LENGTH_ERROR, COMPONENT, ONE_SQUARED
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.methods.chord_interpolator import ChordAccumulatorUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit

from ..lists import FURTHER_MODELS, SPECULAR_MODELS
from .bounds import Bounds, cut_by, registers_of, unknown, word, wrapped_by

pytestmark = [pytest.mark.prove, pytest.mark.usefixtures("wraps")]

LENGTHS = np.arange(1, 1 << LENGTH_BITS)


def of_middle_normal(fit):
    MiddleNormal(fit).compute(word(COMPONENT, 1, 3), word(COMPONENT, 1, 3))


def of_difference_setup(as_published):
    DifferenceSetup(as_published).compute(word(GPQ.G_FORMAT, 1, 1), word(GPQ.P_FORMAT, 1, 1), LENGTHS)


def of_quadratic_evaluator(form):
    unit = QuadraticEvaluator(form)
    parameter = unit.parameter(unit.step(LENGTHS), Bounds(np.zeros(len(LENGTHS)), LENGTHS - 1))
    unit.evaluate(*(word(format, 1, 1) for format in (GPQ.G_FORMAT, GPQ.P_FORMAT, GPQ.Q_FORMAT)), parameter)


def of_local_chord_setup():
    unit = LocalChordSetup()
    unit.compute(word(unit.DIFFUSE_FORMAT, 1, 1, 3), word(unit.HIGHLIGHT_FORMAT, 1, 1, 3), LENGTHS)


def of_chord_differences(fraction_bits):
    unit = ChordSetup(fraction_bits=fraction_bits)
    slope, bend = word(unit.SLOPE_FORMAT, 1, 1), word(unit.CURVATURE_FORMAT, 1, 1)
    unit.differences(None, slope, bend, *unit.steps(LENGTHS))


def of_chord_setup(monkeypatch, terms, fraction_bits):
    """Every w that is not flagged.

    ``u_r - u_l`` is ``(|N_r|^2 - |N_l|^2)/2 - (N_r - N_l).H``, so it is at most the chord, ``sqrt(2 w)``,
    twice an error of the length, and what `Chord` cuts of two; ``f_r - f_l`` is at most the chord.
    """
    unit = ChordSetup(terms, fraction_bits)
    w = np.arange(unit.widest.codes + 1)
    chord = np.sqrt(2 * (w + 0.5) * unit.ANGLE_FORMAT.step)[:, np.newaxis]
    cut = 2 * np.sqrt(3) * COMPONENT.step + 3 * 2.0**-35
    one = 1 << 35
    u_left = unknown(0, (2 + cut) * one)
    u_right = (u_left + unknown(-one, one, chord + 2 * CODE_LENGTH_ERROR + 2 * cut)).known(0, (2 + cut) * one)
    f_left = unknown(-one / 2, one / 2)
    f_right = (f_left + unknown(-one / 2, one / 2, chord)).known(-one / 2, one / 2)
    chords = iter([Fixed(Chord.FORMAT, code) for code in (w << 15, u_left, u_right)])
    cosines = iter([Fixed(DotProduct().result_format, code) for code in (f_left, f_right)])
    monkeypatch.setattr(Chord, "compute", lambda *_: next(chords))
    monkeypatch.setattr(DotProduct, "compute", lambda *_: next(cosines))
    normals = (Fixed(COMPONENT, np.zeros((len(w), 3), dtype=np.int64)) for _ in range(2))
    vectors = (Fixed(COMPONENT, np.zeros((1, 3), dtype=np.int64)) for _ in range(2))
    unit.compute(*normals, *vectors, np.full(len(w), 2))


def parts_of_lengths():
    """All lengths, by some 100,000 pixels, and the pixels: their spans and places."""
    for lengths in np.array_split(LENGTHS, np.searchsorted(np.cumsum(LENGTHS), np.arange(1, 84) * 100_000)):
        yield lengths, *pixels_of(lengths)


def rows(bounds, lengths):
    """A row for every length."""
    return bounds + np.zeros((len(lengths), 1))


def walk(unit, start, first, second, span, step):
    """Sums of every pixel; and the differences, of all but the last."""
    unit.compute(start, first, second, span, step)
    before = np.flatnonzero(np.diff(span, append=-1) == 0)
    changes = first.codes[span[before]] + step[before, np.newaxis] * second.codes[span[before]]
    if unit.difference_format.width < unit.format.width:
        unit.difference_format.wrap(changes)


def of_normals(as_published, fits, format=DifferenceSetup.FORMAT):
    """Spans to 45 degrees, as of the middle normal's flag.

    By vectors of exactly unit length ``|N_r - N_l| = 2 sin(psi/2)``, ``|G| = 4 (1 - cos(psi/2))``, one across
    the other, and P is their difference; lengths are off, N_c is, and the flag is a little beyond.
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
    """Straight lines: any ends."""
    left, right = (unknown(COMPONENT.min_code, COMPONENT.max_code) for _ in range(2))
    p = (right - left).known(GPQ.P_FORMAT.min_code, GPQ.P_FORMAT.max_code)
    for lengths, span, step in parts_of_lengths():
        n, zero, p_rows = (rows(bounds, lengths) for bounds in (left, Bounds.of([[0]]), p))
        differences = DifferenceSetup().compute(
            Fixed(GPQ.G_FORMAT, zero), Fixed(GPQ.P_FORMAT, p_rows), lengths
        )
        walk(DifferenceAccumulator(format=format), Fixed(COMPONENT, n), *differences, span, step)


def of_segments(levels):
    """Any two ends; of those further apart than the word of a difference, left is on the other side of 0."""
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
    """Any slope and bend; starts of unit vectors: f from -1 to 1, u to 2 and what `Chord` cuts."""
    unit = ChordInterpolator(fraction_bits=fraction_bits)
    sums, setup = unit.accumulators[name], unit.setup
    if format is not None:
        sums = replace(sums, format=format)
    one = 1 << sums.start_format.fraction_bits
    start = unknown(*{"diffuse": (-one, one), "highlight": (0, 2.001 * one)}[name])
    slope, bend = (unknown(f.min_code, f.max_code) for f in (setup.SLOPE_FORMAT, setup.CURVATURE_FORMAT))
    for lengths, span, step in parts_of_lengths():
        words = Fixed(sums.start_format, rows(start, lengths)), Fixed(setup.SLOPE_FORMAT, slope)
        walk(
            sums,
            *setup.differences(*words, Fixed(setup.CURVATURE_FORMAT, bend), *setup.steps(lengths)),
            span,
            step,
        )


def of_bisection(degree, max_angle, as_published):
    unit = Bisection(degree, max_angle, as_published)
    unit.factor(Fixed(unit.ANGLE_FORMAT, np.arange(-2, unit.widest.codes + 1)))


def of_bisection_chain(degree, max_angle, as_published):
    """Every word of u up to the flag, through all levels: u alone decides the factors of each.

    Angles that a level gives to the bisection's factor are those of `of_bisection`.
    """
    unit = BisectionChain(Bisection(degree, max_angle, as_published))
    p, factor, levels = unit.bisection, unit.bisection.factor, (1 << unit.LEVEL_BITS) - 1
    # Of eight words one angle; from -2, as lengths may be over 1.
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
    unit = Renormaliser()
    offset = np.arange(unit.SEGMENTS << unit.OFFSET_FORMAT.width)
    unit.correction(Fixed(SQ(4, 34), offset + UQ(0, 22).code(unit.LOW) << 12))


def of_half_chord():
    for shift, count in ((0, 1 << 22), (1, 1 << 23)):
        for chord in np.array_split(np.arange(count) << 13 - 2 * shift, count >> 18):
            HalfChord().compute(Fixed(UQ(2, 34), chord), np.zeros(chord.shape, bool))


def of_specular_slopes(model):
    assert len(Specular(REFLECTION_MODELS[model]).slopes.codes) == 1 << Specular.EXPONENT_BITS


def sectors(degrees, one, like):
    """A and x of ``a^2 + x^2 <= 1``, for each sector between two radii: the box about it.

    No sector has an axis inside.
    """
    assert 90 % degrees == 0
    for low in range(-180, 180, degrees):
        ends = np.radians([low, low + degrees])
        yield tuple(unknown(*np.sort(one * f(ends)), np.ones((len(like), 1)))[:, 0] for f in (np.cos, np.sin))


def of_recurrence_slopes(monkeypatch):
    """Every word of q from 1/8 on, and of each shift after that the largest: others are within.

    With T a unit vector across N_l, ``N_r = (1 - q) N_l + sin(psi) T``, so ``b = (1 - q) a + sin(psi) x``,
    x = T.H. Of q the word is off by half a step, and by what `Chord` cuts; b by more than twice what lengths
    of codes are. The span has two pixels.
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
    """Every word of K, for steps to 90 degrees; K and D(0) may be off by 1 %, the setup's are by under 0.1 %.

    ``D(0) = x sin d - a K/2`` with x as in the slopes, ``a^2 + x^2 <= 1``: in sectors of 15 degrees. Where
    K is under 2^-7, D(0) may be off by 0.1: so it may be anything that ends a few codes apart give, whose
    lengths are off by as much as they differ.
    """
    unit = RecurrenceSetup().steps
    state = format or unit.state_format
    shift, low = (axis.ravel() for axis in np.indices((9, 1 << 12)))
    low = (low << 4) + (1 << 16)
    near = low * 2.0 ** (-15 - shift) <= 2.02
    # The last box stands for all K under 2^-7.
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
    """Places by which words are shifted: 65 words of q of the ends of its shifts, and 0; every length."""
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


UNITS = {
    **{f"middle_normal-{fit}": partial(MiddleNormalUnit, MiddleNormal(fit)) for fit in MIDDLE_NORMAL_FITS},
    "difference_setup": DifferenceSetupUnit,
    "difference_setup-documented": partial(DifferenceSetupUnit, DifferenceSetup(True)),
    **{
        f"quadratic_evaluator-{form}": partial(QuadraticEvaluatorUnit, QuadraticEvaluator(form))
        for form in QUADRATIC_FORMS
    },
    "local_chord_setup": LocalChordSetupUnit,
}
"""Units wrap in no other formats than their twins, to which they are equal to the bit (`tests/hdl`)."""


WHOLE = {
    **{f"middle_normal-{fit}": partial(of_middle_normal, fit) for fit in MIDDLE_NORMAL_FITS},
    "difference_setup": partial(of_difference_setup, False),
    "difference_setup-documented": partial(of_difference_setup, True),
    **{f"quadratic_evaluator-{form}": partial(of_quadratic_evaluator, form) for form in QUADRATIC_FORMS},
    "local_chord_setup": of_local_chord_setup,
    **{f"chord_setup-{bits}": partial(of_chord_differences, bits) for bits in range(36, 47, 2)},
}
"""Any codes of the operands: in the chord setup of P and G."""


@pytest.mark.parametrize("name", WHOLE)
def test_no_word_wraps_whatever_the_operands(wraps, name):
    """By bounds: any code of every operand, whatever angle and lengths vectors have; 1 to 4095 pixels."""
    WHOLE[name]()
    assert name not in UNITS or wrapped_by(UNITS[name]()) <= set(wraps)


@pytest.mark.parametrize(("terms", "bits"), [*product((1, 2, 3), (36, 46))])
def test_slopes_of_the_chord_setup_do_not_wrap(monkeypatch, wraps, terms, bits):
    """By bounds, for every word of w up to the flag; with the words above all of the chord setup."""
    of_chord_setup(monkeypatch, terms, bits)
    assert wrapped_by(ChordSetupUnit(parameters=ChordSetup(terms, bits))) <= set(wraps)


@pytest.mark.parametrize("parameters", [*product((1, 2), (45, 90), (False, True))])
def test_no_word_of_a_bisection_wraps(wraps, parameters):
    """Every word of u up to the flag, and those under 0 that lengths over 1 give."""
    of_bisection(*parameters)
    assert wrapped_by(BisectionUnit(Bisection(*parameters))) <= set(wraps)


@pytest.mark.parametrize("parameters", [*product((1, 2), (45, 90), (False, True))])
def test_no_word_of_a_chain_of_bisections_wraps(wraps, parameters):
    """Every word of u up to the flag, and what each of 15 levels makes of it; u and the weights saturate."""
    of_bisection_chain(*parameters)
    assert wrapped_by(BisectionChainUnit(BisectionChain(Bisection(*parameters)))) <= set(wraps)


def test_no_word_of_a_renormaliser_wraps(wraps):
    """Every squared length that is served, to the bits that are read."""
    of_renormaliser()
    assert wrapped_by(RenormaliserUnit()) <= set(wraps)


def test_no_word_of_a_half_chord_wraps(wraps):
    """Every address and fraction of the table, every word of z, to a squared chord of 2."""
    of_half_chord()
    assert wrapped_by(HalfChordUnit()) <= set(wraps)


@pytest.mark.parametrize(
    "model", [m for m in SPECULAR_MODELS + FURTHER_MODELS if Specular(REFLECTION_MODELS[m]).slope_terms]
)
def test_slopes_of_the_specular_unit_do_not_wrap(wraps, model):
    """Every exponent; other models read a table."""
    of_specular_slopes(model)
    assert wraps == [Specular.SLOPE_FORMAT]


def test_shifts_of_the_recurrence_setup_do_not_wrap():
    """None is less than 0, and all fit their registers."""
    of_recurrence_shifts()
    widths = {register.name: len(register) for register in registers_of(RecurrenceSetupUnit())}
    assert {widths[f"{name}_shift"] for name in ("step", "phase")} == {6}
    assert {widths[name] for name in ("exponent_of_span", "exponent")} == {6}
    assert {widths[f"{name}_shift"] for name in ("place", "rho")} == {4}


@pytest.mark.parametrize("bits", [(5, 4), (6, 3)])
def test_shifts_of_the_recurrence_a_bit_too_short_are_found(bits):
    """A bit less."""
    with pytest.raises(AssertionError, match=" wraps in "):
        of_recurrence_shifts(*bits)


CUTS = {
    "blysk.hdl.core.reciprocal.reciprocal_words": "the leading one of m - 1; m is 1 or more",
    "blysk.hdl.normals.adaptive_normaliser.AdaptiveNormaliserUnit._prepare_segment": "2^levels - 1",
    "blysk.hdl.cosines.half_chord.normalised_words": "v: `test_angular_setup`",
    "blysk.hdl.cosines.half_chord.half_chord_words": "half a turn less psi, as the twin wraps it",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._describe": "shifts: `of_recurrence_shifts`",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._steps": "the same; and the leading one of m - 1",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._normalised": "q; the twin refuses",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._under_one": "under 1, times 2",
}
"""Where hardware cuts bits of a sum, a shift or a choice, and why what it cuts is 0, or not wanted."""


def test_sums_are_cut_in_these_places_alone():
    """Of units above, with those of their interpolators; `test_angular_setup` has the other."""
    units = (
        *(make() for make in UNITS.values()),
        *(make() for make in (BisectionUnit, BisectionChainUnit, RenormaliserUnit, HalfChordUnit)),
        *(make() for make in (ChordSetupUnit, RecurrenceSetupUnit, RecurrenceUnit)),
        *(make() for make in (DifferenceAccumulatorUnit, AdaptiveNormaliserUnit)),
        ChordAccumulatorUnit(),
    )
    assert set.union(*map(cut_by, units)) == set(CUTS)


def test_a_sum_that_is_cut_is_found(plant):
    """A slice, planted in place of the format that a word has."""
    plant(
        *(DifferenceAccumulatorUnit, "elaborate", "value.eq((value + difference).wrap(p.format))"),
        "value.as_value().eq((value + difference).as_value()[: p.format.width])",
    )
    assert cut_by(DifferenceAccumulatorUnit()) == {"blysk.hdl.normals.difference_accumulator.elaborate"}


def test_slopes_of_the_recurrence_setup_do_not_wrap(monkeypatch, wraps):
    """By bounds, for every word of q; and the first difference of spans of two pixels."""
    of_recurrence_slopes(monkeypatch)
    assert wrapped_by(RecurrenceSetupUnit()) <= set(wraps)


def test_first_steps_of_the_recurrence_do_not_wrap():
    """By bounds, for every word of K to 90 degrees: the first difference, and x and D of the seven steps."""
    of_recurrence_prologue()


@pytest.mark.parametrize("parameters", [{}, {"guard_bits": 20}, {"interleave": 4}])
def test_words_of_the_recurrence_wrap_in_the_format_of_its_state(parameters):
    """Of which it is proved that it holds them, in `test_recurrence`; a direct recurrence saturates."""
    parameters = Recurrence(**parameters)
    assert wrapped_by(RecurrenceUnit(parameters)) == {parameters.state_format}


@pytest.mark.parametrize(("as_published", "fits"), [(False, MIDDLE_NORMAL_FITS), (True, ("exact",))])
def test_sums_of_normals_do_not_wrap(as_published, fits):
    """By bounds, for spans to 45 degrees: at every pixel of each length from 1 to 4095."""
    of_normals(as_published, fits)


def test_sums_of_straight_lines_do_not_wrap(wraps):
    """The same, for any two ends of which no component of the difference is over 1."""
    of_lines()
    assert wrapped_by(DifferenceAccumulatorUnit()) <= set(wraps)


@pytest.mark.parametrize("levels", range(AdaptiveNormaliser(2.0**-14).depth + 1))
def test_sums_of_segments_do_not_wrap(wraps, levels):
    """The same, for any two ends of a segment, and as many segments as there can be."""
    of_segments(levels)
    formats = wrapped_by(AdaptiveNormaliserUnit()) - wrapped_by(BisectionUnit())
    assert AdaptiveNormaliser.ACCUMULATOR_FORMAT in formats <= set(wraps)


@pytest.mark.parametrize(("name", "bits"), [("diffuse", 46), ("highlight", 36), ("highlight", 46)])
def test_sums_of_chords_do_not_wrap(wraps, name, bits):
    """The same, for unit vectors and any P and G; so differences of a pixel to the next. Local chords too."""
    of_chord_sums(name, bits)
    assert wrapped_by(ChordAccumulatorUnit(ChordInterpolator(fraction_bits=bits))) <= set(wraps)


def test_bounds_hold():
    """What twins give for random codes is within what they give for bounds, and not far within."""
    rng, unit = np.random.default_rng(1), ChordSetup()
    lengths = np.repeat(rng.integers(1, 4096, 100), 1000)
    words = [Fixed(f, rng.integers(f.min_code, f.max_code + 1, (len(lengths), 1))) for f in FORMATS]
    bounds = [Fixed(f, unknown(f.min_code, f.max_code)) for f in FORMATS]
    results = [unit.differences(None, *pair, *unit.steps(lengths))[1:] for pair in (words, bounds)]
    for found, known in zip(*results, strict=True):
        low, high = (end.reshape(100, 1000) for end in (known.codes.low[:, 0], known.codes.high[:, 0]))
        codes = found.codes.reshape(100, 1000)
        assert ((codes >= low) & (codes <= high)).all()
        assert (codes.max(axis=1) - codes.min(axis=1) > 0.8 * (high - low)[:, 0]).all()


FORMATS = ChordSetup.SLOPE_FORMAT, ChordSetup.CURVATURE_FORMAT

SHORTER_FORMATS = {
    "differences": (WHOLE["difference_setup"], DifferenceSetup, "FORMAT", SQ(1, 42)),
    "G of the documented order": (
        WHOLE["difference_setup-documented"],
        DifferenceSetup,
        "CURVATURE_FORMAT",
        SQ(-1, 18),
    ),
    "t": (WHOLE["quadratic_evaluator-horner"], QuadraticEvaluator, "SUM_FORMAT", SQ(0, 29)),
    "differences of chords": (
        WHOLE["chord_setup-46"],
        ChordSetup,
        "format",
        property(lambda p: SQ(0, p.fraction_bits)),
    ),
    "differences of local chords": (
        WHOLE["local_chord_setup"],
        ChordSetup,
        "format",
        property(lambda p: SQ(0, p.fraction_bits)),
    ),
    # It stays between the ends of the segment, so that of its two integer bits one is to spare.
    "sum of a segment": (partial(of_segments, 2), AdaptiveNormaliser, "ACCUMULATOR_FORMAT", SQ(0, 32)),
    "step of a segment": (partial(of_segments, 2), AdaptiveNormaliser, "STEP_FORMAT", SQ(0, 32)),
    "slope": (partial(of_specular_slopes, "cosquad"), Specular, "SLOPE_FORMAT", UQ(8, 18)),
    "factor of the renormaliser": (of_renormaliser, Renormaliser, "FACTOR_FORMAT", SQ(-1, 18)),
}


@pytest.mark.parametrize("word", SHORTER_FORMATS)
def test_formats_a_bit_too_short_are_found(monkeypatch, word):
    """An integer bit less than what is needed, planted in the parameters."""
    prove, *change = SHORTER_FORMATS[word]
    monkeypatch.setattr(*change)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


@pytest.mark.parametrize("format", ["SLOPE_FORMAT", "HIGH_FORMAT"])
def test_slopes_a_bit_too_short_are_found(monkeypatch, format):
    """The same."""
    full = getattr(ChordSetup, format)
    monkeypatch.setattr(ChordSetup, format, SQ(full.integer_bits - 1, full.fraction_bits))
    with pytest.raises(AssertionError, match=" wraps in "):
        of_chord_setup(monkeypatch, 3, 46)


def test_slope_of_the_recurrence_a_bit_too_short_is_found(monkeypatch):
    """The same."""
    monkeypatch.setattr(RecurrenceSetup, "SLOPE_FORMAT", SQ(1, 28))
    with pytest.raises(AssertionError, match=" wraps in "):
        of_recurrence_slopes(monkeypatch)


SHORTER_WORDS = {
    "sums of the middle normal": (
        WHOLE["middle_normal-exact"],
        *(MiddleNormal, "compute"),
        "(u * total.wrap(self.SUM_FORMAT)).round_half_up(21)",
        "(u * total.wrap(UQ(-3, 19))).round_half_up(21)",
    ),
    "-t^2": (
        WHOLE["quadratic_evaluator-direct"],
        *(QuadraticEvaluator, "evaluate", "wrap(COMPONENT)", "wrap(SQ(0, 17))"),
    ),
    "sums of the bisection": (
        partial(of_bisection, 2, 90, False),
        *(Bisection, "factor", "wrap(self.SUM_FORMAT)", "wrap(SQ(-1, 18))"),
    ),
    "factor of the bisection": (
        partial(of_bisection, 2, 90, False),
        *(Bisection, "factor", "wrap(self.FACTOR_FORMAT)", "wrap(SQ(-2, 19))"),
    ),
    "sums of the chain": (
        partial(of_bisection_chain, 2, 90, False),
        *(Bisection, "factor", "wrap(self.SUM_FORMAT)", "wrap(SQ(-1, 18))"),
    ),
    "factor of the chain": (
        partial(of_bisection_chain, 2, 90, False),
        *(Bisection, "factor", "wrap(self.FACTOR_FORMAT)", "wrap(SQ(-2, 19))"),
    ),
    "slope of the renormaliser": (
        of_renormaliser,
        *(Renormaliser, "correction", "wrap(self.C1_FORMAT)", "wrap(UQ(0, 16))"),
    ),
    "sums of the half chord": (
        of_half_chord,
        HalfChord,
        "compute",
        "wrap(self.SUM_FORMAT)",
        "wrap(UQ(-3, 19))",
    ),
    "rise of the half chord": (of_half_chord, HalfChord, "compute", "wrap(UQ(0, 21))", "wrap(UQ(-10, 21))"),
}


@pytest.mark.parametrize("word", SHORTER_WORDS)
def test_words_a_bit_too_short_are_found(plant, word):
    """An integer bit less, planted in the twin."""
    prove, *change = SHORTER_WORDS[word]
    plant(*change)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


def test_angles_beyond_the_proof_are_found(plant):
    """A level that takes too much off u, planted in the chain."""
    plant(BisectionChain, "compute", "u.scale(-1) - e - ", "u.scale(-1) - e - e - e - ")
    with pytest.raises(AssertionError, match="no angle of a bisection"):
        of_bisection_chain(2, 45, False)


SHORTER_SUMS = {
    "normal": partial(of_normals, False, ("exact",), SQ(1, 42)),
    "straight line": partial(of_lines, SQ(1, 42)),
    "N.L": partial(of_chord_sums, "diffuse", 46, SQ(1, 46)),
    "u": partial(of_chord_sums, "highlight", 46, SQ(2, 46)),
    "first steps of the recurrence": partial(of_recurrence_prologue, SQ(1, 44)),
}


@pytest.mark.parametrize("word", SHORTER_SUMS)
def test_sums_a_bit_too_short_are_found(word):
    """The same; of N.L two bits less, as its sum has the format of that of u."""
    with pytest.raises(AssertionError, match=" wraps in "):
        SHORTER_SUMS[word]()
