"""Record of the recurrence setup."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    any_lengths,
    any_pairs,
    component_words,
    dot,
    light_constants,
    log_lengths,
    pixel_of,
    setup_spans,
    span_ends,
    unit_codes,
    vectors_near,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ
from blysk.golden.number.unit_vector import ONE
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.sim.engines.beats import dtype_of

__all__ = ["RECORD"]


def _measure(rng, count):
    """Cosine at any pixel, by the start values and the coefficient in exact arithmetic."""
    length = log_lengths(rng, count)
    left, right = span_ends(rng, count, 90.0)
    vector = vectors_near(rng, left, right)
    pixel = pixel_of(rng, length)
    words = component_words(left, right, vector)
    first, second, coefficient, shift, _ = RecurrenceSetup().compute(*words, length)
    steps, phase = np.divmod(pixel, 4)
    start, rise = (word.values[np.arange(count), phase] for word in (first, second))
    k = coefficient.values * 4 * 2.0**-shift
    angle = 2 * np.arcsin(np.sqrt(k) / 2)
    ratio = steps * np.sinc(steps * angle / np.pi) / np.sinc(angle / np.pi)
    found = start * np.cos(steps * angle) + (rise + start * k / 2) * ratio
    a, b = (dot(normal, vector) / ONE**2 for normal in (left, right))
    psi = 2 * np.arcsin(np.sqrt(dot(right - left, right - left)) / (2 * ONE))
    t = pixel / np.maximum(length - 1, 1)
    weights = (part * np.sinc(part * psi / np.pi) / np.sinc(psi / np.pi) for part in (1 - t, t))
    exact = sum(end * weight for end, weight in zip((a, b), weights, strict=True))
    return Sample(found, exact, exact, np.degrees(psi))


def _expect(unit, case):
    p, beats = unit.model, case.beats
    ends = component_words(beats["normal_left"], beats["normal_right"])
    expected = np.zeros(len(beats["length"]), dtype_of(unit.o.payload.shape()))
    for name, vectors in (("diffuse", "direction"), ("highlight", "halfway")):
        for light, vector in enumerate(component_words(*case.constants[vectors])):
            first, second, *of_span = p.compute(*ends, vector, beats["length"])
            expected["lights"][name]["first"][:, light] = first.codes
            expected["lights"][name]["second"][:, light] = second.codes
    coefficient, shift, expected["out_of_range"] = of_span
    expected["coefficient"], expected["length"] = coefficient.codes, beats["length"]
    if p.recurrence.form == "reinsch":
        expected["shift"] = shift
    return expected


def _vectors(unit, rng):
    return (unit_codes(rng, unit.lights) for _ in range(2))


def _spans(unit, rng, count):
    """Normals at any angle. The logarithm of span lengths is uniform. Every 16th pair has random codes."""
    left, right = any_pairs(rng, count)
    beats = {"normal_left": left, "normal_right": right, "length": any_lengths(rng, count)}
    return Case(beats, light_constants(unit, *_vectors(unit, rng)))


def _corners(unit, rng, count):
    """Angles up to and over 90 degrees, extreme codes, and N at the peak of a highlight.

    In ten spans both normals are at the peak.
    """
    beats = setup_spans(rng, count, 90, 90.1)
    direction, halfway = _vectors(unit, rng)
    beats["normal_left"][:50] = beats["normal_right"][:10] = halfway[0]
    return Case(beats, light_constants(unit, direction, halfway))


def _last_bits(unit, rng, count):
    """Many spans, because the last bits of products and sums rarely change a rounded result."""
    return Case(setup_spans(rng, count, 90, 90.1), light_constants(unit, *_vectors(unit, rng)))


DIRECT = RecurrenceSetup(Recurrence("direct", interleave=4, result_format=SQ(2, 25)))

RECORD = Record(
    name="recurrence_setup",
    title="Start values of the interleaved recurrence",
    source="docs/theory/interpolation.md#recurrence; [T] 3.1, 3.3",
    variants={
        "interval 4": Variant(
            RecurrenceSetupUnit,
            _measure,
            "spans to 90 degrees, 1 to 4095 pixels",
            note="error of cos gamma at any pixel; errors of the tables count as arithmetic error",
        ),
        "interval 1": Variant(partial(RecurrenceSetupUnit, initiation_interval=1), long=True),
        "interval 46": Variant(partial(RecurrenceSetupUnit, initiation_interval=46), long=True),
        "2 lights": Variant(partial(RecurrenceSetupUnit, lights=2), long=True),
        "direct, interval 3": Variant(partial(RecurrenceSetupUnit, DIRECT, initiation_interval=3), long=True),
    },
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 400),
        "corners": Stimulus(_corners, 400),
        "last bits": Stimulus(_last_bits, 3000, stalled=False, repeats=2),
    },
    waivers={
        "*_first": (
            "The bit is below the bits of a cosine, where the word has zeros. Or the fault changes the word "
            "after it has been read."
        ),
        "*_x_0": "The controlling bit is below the bits of a cosine, where x has zeros.",
        "span_aligned": (
            "Four times a sum of three squares of at most 2^34 is less than 2^38, so the bit is 0 already."
        ),
        "rho_rounded": "A word less than 1 is rounded to at most 1, so the bit of 2 is 0 already.",
    }
    | dict.fromkeys(
        ("reciprocal_square", "span_square_total"),
        "The fault changes the register only while the output is stalled. Its word has been read by then.",
    ),
    still={
        "a sum of three squares of at most 2^34 is not negative, and less than 2^36": (
            "span_square_partial[36] span_square_total[36-37] span_aligned[38-39]"
        ),
        "all words that are read from a table agree in this bit": (
            "chord_entry[12-13] chord_entry[34-35] chord_entry[49] "
            "step_entry[10-13] step_entry[34-35] step_entry[47-49] step_entry[71] "
            "phase_entry[10-13] phase_entry[35] "
            "chord_tables.port__data[12-13] chord_tables.port__data[34-35] chord_tables.port__data[49] "
            "step_tables.port__data[10-13] step_tables.port__data[34-35] step_tables.port__data[47-49] "
            "step_tables.port__data[71] phase_tables.port__data[10-13] phase_tables.port__data[35]"
        ),
        "psi^2/(2 q) - 1 is less than 1/4, and psi/sin psi - 1 is less than 1": (
            "chord_0_sum[20-22] chord_0_rounded[15-18] chord_0[15-16] chord_1_sum[22] chord_1_rounded[17-18]"
        ),
        "1 - k is less than 1/4 for d and less than 1/2 for 4 d, and 1 - sin d/d is less than 1/2": (
            "step_0_sum[20-22] step_0_rounded[15-18] step_0[15-16] "
            "step_1_sum[21-22] step_1_rounded[16-18] step_1[16] "
            "phase_0_sum[21-22] phase_0_rounded[16-18] phase_0[16]"
        ),
        "a reciprocal and its square are normalised, so their first bits are 1": (
            "reciprocal_entry[16] reciprocal_entry[33] reciprocal[16] reciprocal_square[16] "
            "reciprocals.port__data[16] reciprocals.port__data[33]"
        ),
        "a square is rounded up to 1 in only 1 of 2^17 spans": "psi_square_rounded[17]",
        "Q/8 is at most 0.31 and its word at least 1/2, so the word is always shifted": "step_fine[27]",
        "K is not negative, and is less than 1 even after rounding": (
            "*_coefficient_exact[34] *_coefficient_rounded[17-18]"
        ),
        "psi/sin psi - 1 is at least 1 - sin d/d": "excess_difference[17]",
        "rho is less than 2; its word is at least 1/2, and is rho/2 for a rho of 1 or more": (
            "rho_exact[35] rho_halved[35] rho_rounded[18] rho[16]"
        ),
        "a cosine has ten fraction bits less than x": (
            "top.spare[0-9] top.spare[368-377] {diffuse,highlight}_0_x_0[0-9] *_0_start_0_first[0-9]"
        ),
        "the values that these shifters take end in zeros": "shifter_{2-4}_0[0-12]",
        "the sum of a cosine and twice a difference is even": "*_0_sum_1[0]",
        "these multipliers multiply by rho, coefficients and fractions, and none of them is negative": (
            "multiplier_{8-11}_{1,b}[17]"
        ),
    },
)
