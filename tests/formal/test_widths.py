"""Proofs that no word of a setup or a sum wraps: bit-accurate models run on bounds, or on every code."""

from functools import partial
from itertools import product

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.bisection_chain import BisectionChain
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.normals.middle_normal import MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.normals.quadratic_evaluator import QUADRATIC_FORMS, QuadraticEvaluator
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import SQ, UQ, Fixed
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.methods.chord_spans import ChordAccumulatorUnit
from blysk.hdl.methods.renormalise_interpolator import LineAccumulatorUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.line_setup import LineSetupUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit

from ..lists import FURTHER_MODELS, SPECULAR_MODELS
from .bounds import cut_by, registers_of, unknown, wrapped_by
from .widths import (
    of_bisection,
    of_bisection_chain,
    of_chord_setup,
    of_chord_sums,
    of_difference_setup,
    of_half_chord,
    of_line_setup,
    of_lines,
    of_middle_normal,
    of_normals,
    of_quadratic_evaluator,
    of_recurrence_prologue,
    of_recurrence_shifts,
    of_recurrence_slopes,
    of_renormaliser,
    of_segments,
    of_specular_slopes,
    of_true_lines,
)

pytestmark = [pytest.mark.prove, pytest.mark.usefixtures("wraps")]


UNITS = {
    **{f"middle_normal-{fit}": partial(MiddleNormalUnit, MiddleNormal(fit)) for fit in MIDDLE_NORMAL_FITS},
    "difference_setup": DifferenceSetupUnit,
    "difference_setup-published": partial(DifferenceSetupUnit, DifferenceSetup(True)),
    **{
        f"quadratic_evaluator-{form}": partial(QuadraticEvaluatorUnit, QuadraticEvaluator(form))
        for form in QUADRATIC_FORMS
    },
    **{f"chord_setup-{bits}": partial(ChordSetupUnit, ChordSetup(bits)) for bits in range(36, 47, 2)},
    "line_setup": LineSetupUnit,
}
"""Units of which it is checked that they wrap only in formats in which their models wrap.

Tests of `tests/hdl` show that both are equal to the bit.
"""


WHOLE = {
    **{f"middle_normal-{fit}": partial(of_middle_normal, fit) for fit in MIDDLE_NORMAL_FITS},
    "difference_setup": partial(of_difference_setup, False),
    "difference_setup-published": partial(of_difference_setup, True),
    **{f"quadratic_evaluator-{form}": partial(of_quadratic_evaluator, form) for form in QUADRATIC_FORMS},
    **{f"chord_setup-{bits}": partial(of_chord_setup, bits) for bits in range(36, 47, 2)},
    "line_setup": of_line_setup,
}
"""Runs of models on any codes of their operands."""


@pytest.mark.parametrize("name", WHOLE)
def test_no_word_wraps_whatever_the_operands(wraps, name):
    """By bounds: no word wraps for any code of every operand, so for vectors of any angle and length; 1 to
    4095 pixels."""
    WHOLE[name]()
    assert name not in UNITS or wrapped_by(UNITS[name]()) <= set(wraps)


@pytest.mark.parametrize("model", [*product((1, 2), (45, 90), (False, True))])
def test_no_word_of_a_bisection_wraps(wraps, model):
    """Every word of u up to the flag is tried, and words under 0, which vectors longer than 1 give."""
    of_bisection(*model)
    assert wrapped_by(BisectionUnit(Bisection(*model))) <= set(wraps)


@pytest.mark.parametrize("model", [*product((1, 2), (45, 90), (False, True))])
def test_no_word_of_a_chain_of_bisections_wraps(wraps, model):
    """Every word of u up to the flag is tried, through 15 levels. u and the weights saturate."""
    of_bisection_chain(*model)
    assert wrapped_by(BisectionChainUnit(BisectionChain(Bisection(*model)))) <= set(wraps)


def test_no_word_of_a_renormaliser_wraps(wraps):
    """Every squared length that the unit serves is tried, to the bits that it reads."""
    of_renormaliser()
    assert wrapped_by(RenormaliserUnit()) <= set(wraps)


def test_no_word_of_a_half_chord_wraps(wraps):
    """Every address and fraction of the table, and every word of z, is tried, up to a squared chord of 2."""
    of_half_chord()
    assert wrapped_by(HalfChordUnit()) <= set(wraps)


@pytest.mark.parametrize(
    "model", [m for m in SPECULAR_MODELS + FURTHER_MODELS if Specular(REFLECTION_MODELS[m]).slope_terms]
)
def test_slopes_of_the_specular_unit_do_not_wrap(wraps, model):
    """Every exponent is tried. Other models read a table."""
    of_specular_slopes(Specular(REFLECTION_MODELS[model]))
    assert wraps == [Specular.SLOPE_FORMAT]


def test_shifts_of_the_recurrence_setup_do_not_wrap():
    """No shift is less than 0, and all fit their registers."""
    of_recurrence_shifts()
    widths = {register.name: len(register) for register in registers_of(RecurrenceSetupUnit())}
    assert {widths[f"{name}_shift"] for name in ("step", "phase")} == {6}
    assert {widths[name] for name in ("span_exponent", "exponent")} == {6}
    assert {widths[f"{name}_shift"] for name in ("reciprocal", "rho")} == {4}


@pytest.mark.parametrize("bits", [(5, 4), (6, 3)])
def test_shifts_of_the_recurrence_a_bit_too_short_are_found(bits):
    """Registers with a bit fewer are found."""
    with pytest.raises(AssertionError, match=" wraps in "):
        of_recurrence_shifts(*bits)


CUTS = {
    "blysk.hdl.core.reciprocal.reciprocal_words": "the leading one of m - 1; m is 1 or more",
    "blysk.hdl.normals.adaptive_normaliser.AdaptiveNormaliserUnit._prepare_segment": "2^levels - 1",
    "blysk.hdl.normals.adaptive_normaliser.AdaptiveNormaliserUnit._bisect": "an address, 2^depth at most",
    "blysk.hdl.normals.adaptive_normaliser.AdaptiveNormaliserUnit._end_segment": "the same",
    "blysk.hdl.normals.renormaliser.RenormaliserUnit._scaled": "copies of the sign, above the leading one",
    "blysk.hdl.normals.renormaliser.RenormaliserUnit._factor": "the leading one of the octave",
    "blysk.hdl.normals.adaptive_normaliser.AdaptiveNormaliserUnit._reciprocal": "as of m - 1 above",
    "blysk.hdl.cosines.half_chord.normalised_words": "v: `test_angular_setup`",
    "blysk.hdl.cosines.half_chord.half_chord_words": "half a turn less psi, as the model wraps it",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._step_square": "shifts: `of_recurrence_shifts`",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._step_functions": "the same shifts",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._rho": "shifts: `of_recurrence_shifts`",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._steps": "the same; and the leading one of m - 1",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._normalised": "q; the model refuses",
    "blysk.hdl.cosines.recurrence_setup.RecurrenceSetupUnit._under_one": "under 1, times 2",
}
"""Functions in which hardware cuts bits of a sum, a shift or a choice.

The reason tells why the cut bits are 0, or are not wanted.
"""


def test_sums_are_cut_in_these_places_alone():
    """The units above, and those of their interpolators, cut only in these functions.

    `test_angular_setup` has the other units.
    """
    units = (
        *(make() for make in UNITS.values()),
        *(make() for make in (BisectionUnit, BisectionChainUnit, RenormaliserUnit, HalfChordUnit)),
        *(make() for make in (RecurrenceSetupUnit, RecurrenceUnit)),
        *(make() for make in (DifferenceAccumulatorUnit, AdaptiveNormaliserUnit)),
        ChordAccumulatorUnit(LocalChordInterpolator(), 1),
        LineAccumulatorUnit(RenormaliseInterpolator()),
    )
    assert set.union(*map(cut_by, units)) == set(CUTS)


def test_a_sum_that_is_cut_is_found(inject):
    """A slice, injected in place of the format of a word, is found."""
    inject(
        *(DifferenceAccumulatorUnit, "elaborate", "value.eq((value + difference).wrap(p.format))"),
        "value.as_value().eq((value + difference).as_value()[: p.format.width])",
    )
    assert cut_by(DifferenceAccumulatorUnit()) == {"blysk.hdl.normals.difference_accumulator.elaborate"}


@pytest.mark.seldom
def test_slopes_of_the_recurrence_setup_do_not_wrap(monkeypatch, wraps):
    """By bounds: no word wraps for every word of q, and neither does the first difference of spans of two
    pixels."""
    of_recurrence_slopes(monkeypatch)
    assert wrapped_by(RecurrenceSetupUnit()) <= set(wraps)


@pytest.mark.seldom
def test_first_steps_of_the_recurrence_do_not_wrap():
    """By bounds, for every word of K up to 90 degrees: the first difference, and x and D of the seven steps,
    fit."""
    of_recurrence_prologue()


@pytest.mark.parametrize("model", [{}, {"guard_bits": 20}, {"interleave": 4}])
def test_words_of_the_recurrence_wrap_in_the_format_of_its_state(model):
    """The recurrence wraps only in the format of its state.

    `test_recurrence` proves that this format holds x and D. A direct recurrence saturates.
    """
    model = Recurrence(**model)
    assert wrapped_by(RecurrenceUnit(model)) == {model.state_format}


@pytest.mark.seldom
@pytest.mark.parametrize(("as_published", "fits"), [(False, MIDDLE_NORMAL_FITS), (True, ("exact",))])
def test_sums_of_normals_do_not_wrap(as_published, fits):
    """By bounds, for spans up to 45 degrees: sums fit at every pixel of each length from 1 to 4095."""
    of_normals(as_published, fits)


@pytest.mark.seldom
def test_sums_of_straight_lines_do_not_wrap(wraps):
    """By bounds: the same for any two ends whose difference has no component over 1."""
    of_lines()
    assert wrapped_by(DifferenceAccumulatorUnit()) <= set(wraps)


@pytest.mark.seldom
def test_sums_of_lines_before_they_are_renormalised_do_not_wrap(wraps):
    """By bounds: the same for any two ends of any length."""
    of_true_lines()
    assert wrapped_by(LineAccumulatorUnit(RenormaliseInterpolator())) <= set(wraps)


@pytest.mark.seldom
@pytest.mark.parametrize("levels", range(AdaptiveNormaliser(2.0**-14).depth + 1))
def test_sums_of_segments_do_not_wrap(wraps, levels):
    """By bounds: the same for any two ends of a segment, and the largest number of segments."""
    of_segments(levels)
    formats = wrapped_by(AdaptiveNormaliserUnit()) - wrapped_by(BisectionUnit())
    assert AdaptiveNormaliser.ACCUMULATOR_FORMAT in formats <= set(wraps)


@pytest.mark.parametrize(("name", "bits"), [("diffuse", 46), ("highlight", 36), ("highlight", 46)])
def test_sums_of_chords_do_not_wrap(wraps, name, bits):
    """By bounds: the same for any values, P and G, and for the differences from pixel to pixel."""
    of_chord_sums(name, bits)
    assert wrapped_by(ChordAccumulatorUnit(LocalChordInterpolator(fraction_bits=bits), 1)) <= set(wraps)


def test_bounds_hold():
    """Results of models for random codes are within their results for bounds, and near the ends of the
    bounds."""
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
    "G of the published order": (
        WHOLE["difference_setup-published"],
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
    "high word of the slope of chords": (WHOLE["chord_setup-46"], ChordSetup, "HIGH_FORMAT", SQ(-1, 18)),
    "differences of lines": (WHOLE["line_setup"], LineSetup, "FORMAT", SQ(1, 40)),
    "high word of a line": (WHOLE["line_setup"], LineSetup, "HIGH_FORMAT", SQ(1, 15)),
    # The result lies between the ends of the segment, so one of its two integer bits is spare.
    "sum of a segment": (partial(of_segments, 2), AdaptiveNormaliser, "ACCUMULATOR_FORMAT", SQ(0, 32)),
    "step of a segment": (partial(of_segments, 2), AdaptiveNormaliser, "STEP_FORMAT", SQ(0, 32)),
    "slope": (partial(of_specular_slopes, Specular()), Specular, "SLOPE_FORMAT", UQ(8, 18)),
}


@pytest.mark.parametrize("word", SHORTER_FORMATS)
def test_formats_a_bit_too_short_are_found(monkeypatch, word):
    """One integer bit fewer than needed, injected in the parameters, is found."""
    prove, *change = SHORTER_FORMATS[word]
    monkeypatch.setattr(*change)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


def test_slope_of_the_recurrence_a_bit_too_short_is_found(monkeypatch):
    """The same is found for other sums."""
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
    # The word stays under 1, so its integer bit is spare.
    "slope of the renormaliser": (
        of_renormaliser,
        *(Renormaliser, "factor", "wrap(self.C1_FORMAT)", "wrap(UQ(-1, 16))"),
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
def test_words_a_bit_too_short_are_found(inject, word):
    """One integer bit fewer, injected in the model, is found."""
    prove, *change = SHORTER_WORDS[word]
    inject(*change)
    with pytest.raises(AssertionError, match=" wraps in "):
        prove()


def test_angles_beyond_the_proof_are_found(inject):
    """A level that takes too much off u, injected in the chain, is found."""
    inject(BisectionChain, "compute", "u.scale(-1) - e - ", "u.scale(-1) - e - e - e - ")
    with pytest.raises(AssertionError, match="no angle of a bisection"):
        of_bisection_chain(2, 45, False)


SHORTER_SUMS = {
    "normal": partial(of_normals, False, ("exact",), SQ(1, 42)),
    "straight line": partial(of_lines, SQ(1, 42)),
    "N.L": partial(of_chord_sums, "diffuse", 46, SQ(1, 46)),
    "u": partial(of_chord_sums, "highlight", 46, SQ(2, 46)),
    "true lines": partial(of_true_lines, SQ(0, 40)),
    "first steps of the recurrence": partial(of_recurrence_prologue, SQ(1, 44)),
}


@pytest.mark.parametrize("word", SHORTER_SUMS)
def test_sums_a_bit_too_short_are_found(word):
    """One integer bit fewer is found.

    For N.L it takes two bits, because its sum has the format of the sum of u.
    """
    with pytest.raises(AssertionError, match=" wraps in "):
        SHORTER_SUMS[word]()
