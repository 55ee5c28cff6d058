"""Record of the chord setup."""

from functools import partial

import numpy as np

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.sim.engines.beats import dtype_of
from blysk.sim.units.operands import (
    LONG,
    any_lengths,
    any_pairs,
    component_words,
    degrees_between,
    dot,
    light_constants,
    log_lengths,
    pixel_of,
    setup_spans,
    span_ends,
    unit_codes,
    vectors_near,
)
from blysk.sim.units.record import Case, Record, Sample, Stimulus, Variant

__all__ = ["RECORD", "difference_beats", "value_at"]


def difference_beats(unit, words, length, out_of_range) -> np.ndarray:
    """Output beats of a setup of differences: those of N·L and, if it has them, of u; length and flag."""
    expected = np.zeros(len(length), dtype_of(unit.o.payload.shape()))
    for name, differences in zip(("diffuse", "highlight"), words, strict=True):
        if name in expected["lights"].dtype.names:
            for field in ("start", "first", "second"):
                expected["lights"][name][field] = getattr(differences, field).codes
    expected["length"], expected["out_of_range"] = length, out_of_range
    return expected


def value_at(differences, pixel) -> np.ndarray:
    """Value of the first light's quadratic at a pixel of each span, in float64, in units of `ONE_SQUARED`."""
    start, first, second = (word.values[:, 0] for word in differences)
    k = pixel.astype(np.float64)
    return (start + k * first + k * (k - 1) / 2 * second) / ONE_SQUARED.values


def _measure(rng, count):
    """N·L and u at any pixel, by the differences in exact arithmetic; 1 is the product of unit vectors."""
    length = log_lengths(rng, count, 2)
    left, right = span_ends(rng, count, ChordSetup.MAX_ANGLE)
    light, halfway = unit_codes(rng, count), vectors_near(rng, left, right)
    pixel = pixel_of(rng, length)
    # Each span has lights of its own.
    lights = (vector[:, np.newaxis] for vector in (light, halfway))
    diffuse, highlight, _ = ChordSetup().compute(*component_words(left, right, *lights), length)
    t = pixel / (length - 1)
    normals = interpolate("quadratic", *(normalise(end / ONE) for end in (left, right)), t)
    exact = np.stack([dot(normals, normalise(light / ONE)), 1 - dot(normals, normalise(halfway / ONE))])
    found = np.stack([value_at(words, pixel) for words in (diffuse, highlight)])
    return Sample(found, exact, exact, degrees_between(left, right)[:, 0])


def _expect(unit, case):
    beats = case.beats
    words = (beats["normal_left"], beats["normal_right"])
    words += (case.constants["direction"], case.constants["halfway"])
    *differences, out_of_range = unit.parameters.compute(*component_words(*words), beats["length"])
    return difference_beats(unit, differences, beats["length"], out_of_range)


def _spans(unit, rng, count):
    """Pairs of normals at any distance, every sixteenth of any words; lengths by their logarithm."""
    left, right = any_pairs(rng, count)
    beats = {"normal_left": left, "normal_right": right, "length": any_lengths(rng, count)}
    beats["length"] %= 1 << unit.length_bits
    beats["length"] = np.maximum(beats["length"], 1)
    return Case(beats, light_constants(unit, *(unit_codes(rng, unit.lights) for _ in range(2))))


def _corners(unit, rng, count):
    """Angles about the widest, ends of words, the largest differences, N that is H, N - H of -1."""
    beats = setup_spans(rng, count, 22.4, 22.6)
    beats["normal_left"][100:104], beats["normal_right"][100:104] = COMPONENT.max_code, COMPONENT.min_code
    direction, halfway = (unit_codes(rng, unit.lights) for _ in range(2))
    halfway = np.abs(halfway)
    # Near the peak of a highlight u and its differences are small.
    beats["normal_left"][:50] = halfway[0]
    # The largest difference of components that is not halved.
    less = np.repeat(np.vstack([np.eye(3, dtype=np.int64), [1, 1, 1]]) << 17, 10, axis=0)
    beats["normal_left"][50:90] = beats["normal_right"][60:100] = halfway[0] - less
    return Case(beats, light_constants(unit, direction, halfway))


def _last_bits(unit, rng, count):
    """Many spans: the last bits of products and of sums are rounded off and rarely matter."""
    beats = setup_spans(rng, count, 22.4, 22.6)
    return Case(beats, light_constants(unit, *(unit_codes(rng, unit.lights) for _ in range(2))))


def _variants():
    for interval in (4, 1, 26):
        yield (
            f"interval {interval}",
            Variant(
                partial(ChordSetupUnit, ChordSetup(), 1, initiation_interval=interval),
                _measure,
                f"spans to 22.5 degrees, {LONG}",
                note="of N.L and u at any pixel that the differences lead to; exact: the quadratic",
                long=interval != 4,
            ),
        )
    for lights, interval in ((1, 2), (1, 3), (1, 5), (1, 7), (1, 13), (2, 4)):
        unit = partial(ChordSetupUnit, ChordSetup(), lights, initiation_interval=interval)
        yield f"{lights} lights, interval {interval}", Variant(unit, long=lights == 1)
    for terms, bits, interval in ((1, 36, 4), (2, 46, 5), (3, 40, 1)):
        unit = partial(ChordSetupUnit, ChordSetup(terms, bits), 1, initiation_interval=interval)
        yield f"{terms} terms, {bits} bits", Variant(unit, long=True)
    unit = partial(ChordSetupUnit, ChordSetup(), 1, length_bits=9)
    yield "9 bits of length", Variant(unit, long=True)
    yield "no highlights", Variant(partial(ChordSetupUnit, ChordSetup(), 1, highlights=False), long=True)


RECORD = Record(
    name="chord_setup",
    title="Forward differences of N·L and of half the squared chord from N to H",
    source="docs/theory/chord.md#differences",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 500),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_last_bits, 5000, stalled=False, repeats=4),
    },
    waivers={
        "f_*_rise": "The slope wraps to -1/2 to 1/2 and is rounded: the bits above and below are cut off.",
        "u_*_rise": "The slope wraps to -1/2 to 1/2: the sign, three bits above its own, is cut off.",
        "square": "The square of a reciprocal is normalised: its first bit is 1 already.",
        "*_far": "A difference of 1 or more, halved, makes w at least 1/8, too, where it saturates.",
    },
    still={
        "the second bit of a square is 0": "*_square_2[1] u_?_right_square_0[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "*_square_2[35] u_?_right_square_0[35] *_square_partial[36] *_square_total[36-37] "
            "*_aligned[38-39]"
        ),
        "from the unit vector H to three components up to 1 the squared distance is less than 8": (
            "u_*_aligned[37]"
        ),
        "a reciprocal and its square are normalised, so that their first bit is 1": (
            "reciprocals.port__data[16] reciprocal[16] square_rounded[16] square[16]"
        ),
        "no square of the table rounds to 1": "square_rounded[17]",
        "a length of 12 bits takes shifts up to 12, and of a square up to 25": "shift[4] square_shift[5]",
        "inner sums of the polynomial are 0.046 to 0.050, and 0.125 to 0.132": (
            "horner_2[14-16] horner_1[12-16]"
        ),
        "the polynomial is less than 0.017": "e_rounded[18]",
        "twice a number is even": "*_second[0] top.spare[83] top.spare[214]",
    },
)
