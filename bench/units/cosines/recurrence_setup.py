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
from blysk.bench.units.record import Case, Record, Sample, Stimulus, Variant
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
    """Normals at any distance, lengths with a uniform logarithm. Every 16th pair has random codes."""
    left, right = any_pairs(rng, count)
    beats = {"normal_left": left, "normal_right": right, "length": any_lengths(rng, count)}
    return Case(beats, light_constants(unit, *_vectors(unit, rng)))


def _corners(unit, rng, count):
    """Angles about 90 degrees, extreme codes, N at the peak of a highlight, equal normals at the peak."""
    beats = setup_spans(rng, count, 90, 90.1)
    direction, halfway = _vectors(unit, rng)
    beats["normal_left"][:50] = beats["normal_right"][:10] = halfway[0]
    return Case(beats, light_constants(unit, direction, halfway))


def _last_bits(unit, rng, count):
    """Many spans, because the last bits of products and sums are rounded off and rarely matter."""
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
            note="of cos gamma at any pixel that its words lead to; the tables count as arithmetic",
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
        "*_first": "The bit is below a cosine's bits, where the word has zeros, or the word has been read.",
        "*_x_0": "The controlling bit is below the bits of a cosine, where x has zeros.",
        "reciprocal_square": "While the output is stalled, the register holds a word that has been read.",
        "span_aligned": "Three squares, each up to 2^34, times 4 at most, are less than 2^38: the bit is 0.",
        "span_square_total": "While the output is stalled, the register holds a word that has been read.",
        "rho_rounded": "A word under 1 is rounded to 1 at most, and the bit stands for 2: it is 0.",
    },
    still={
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "span_square_partial[36] span_square_total[36-37] span_aligned[38-39]"
        ),
        "all words that are read from a table have the same bit there": (
            "chord_entry[12-13] chord_entry[34-35] chord_entry[49] "
            "step_entry[10-13] step_entry[34-35] step_entry[47-49] step_entry[71] "
            "phase_entry[10-13] phase_entry[35] "
            "chord_tables.port__data[12-13] chord_tables.port__data[34-35] chord_tables.port__data[49] "
            "step_tables.port__data[10-13] step_tables.port__data[34-35] step_tables.port__data[47-49] "
            "step_tables.port__data[71] phase_tables.port__data[10-13] phase_tables.port__data[35]"
        ),
        "the excess of an angle's square is less than 1/4, and the excess of an angle less than 1": (
            "chord_0_sum[20-22] chord_0_rounded[15-18] chord_0[15-16] chord_1_sum[22] chord_1_rounded[17-18]"
        ),
        "for a step 1 - k is under 1/4 and 1 - sin d/d under 1/2; for four steps 1 - k is under 1/2": (
            "step_0_sum[20-22] step_0_rounded[15-18] step_0[15-16] "
            "step_1_sum[21-22] step_1_rounded[16-18] step_1[16] "
            "phase_0_sum[21-22] phase_0_rounded[16-18] phase_0[16]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "reciprocal_entry[16] reciprocal_entry[33] reciprocal[16] reciprocal_square[16] "
            "reciprocals.port__data[16] reciprocals.port__data[33]"
        ),
        "a square rounds up to 1 only in one span of 2^17": "psi_square_rounded[17]",
        "an eighth of Q is at most 0.31, so that its word, which is 1/2 or more, is shifted": "step_fine[27]",
        "K is not negative, and is less than 1 also when it is rounded": (
            "*_coefficient_exact[34] *_coefficient_rounded[17-18]"
        ),
        "psi/sin psi - 1 is at least 1 - sin d/d": "excess_difference[17]",
        "rho is less than 2; its word, halved where rho is 1 or more, is 1/2 or more": (
            "rho_exact[35] rho_halved[35] rho_rounded[18] rho[16]"
        ),
        "a cosine has ten bits less than x": (
            "top.spare[0-9] top.spare[368-377] {diffuse,highlight}_0_x_0[0-9] *_0_start_0_first[0-9]"
        ),
        "a value that is shifted ends in zeros": "shifter_{2-4}_0[0-12]",
        "a cosine and twice a difference are even": "*_0_sum_1[0]",
        "rho, coefficients and fractions, the only second operands of these multipliers, are not negative": (
            "multiplier_{8-11}_{1,b}[17]"
        ),
    },
)
