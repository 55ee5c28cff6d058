"""Record of the angular setup."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    LONG,
    any_lengths,
    any_pairs,
    component_words,
    degrees_between,
    dot,
    log_lengths,
    pairs_at,
    pixel_of,
    span_ends,
    sphere,
    unit_codes,
    vectors_near,
    word_ends,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import ARCCOS_TABLES, SEGMENT_BOUNDS, Arccos
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.hdl.cosines.angular_setup import AngularSetupUnit

__all__ = ["RECORD", "half_angles"]


def half_angles(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine of half the angle between vectors of codes.

    They follow from the shorter of two chords: between the vectors, or to the opposite vector.
    """
    chord, chord_to_opposite = (dot(v, v) / ONE**2 for v in (right - left, right + left))
    acute = chord_to_opposite >= chord
    sine = np.where(acute, np.sqrt(chord) / 2, np.sqrt(np.maximum(1 - chord_to_opposite / 4, 0)))
    return sine, np.where(acute, np.sqrt(np.maximum(1 - chord / 4, 0)), np.sqrt(chord_to_opposite) / 2)


def _measure(rng, count, unit):
    """Cosine of gamma at any pixel, from the words of the setup."""
    left, right = span_ends(rng, count, 150.0)
    vector = vectors_near(rng, left, right)
    length = log_lengths(rng, count, 2)
    pixel = pixel_of(rng, length)
    _, phase, step, cos_beta, _ = unit.compute(*component_words(left, right, vector), length)
    found = cos_beta.values * np.cos(2 * np.pi * (phase.values - pixel * step.values))
    a, b = (dot(normal, vector) / ONE**2 for normal in (left, right))
    sine, cosine = half_angles(left, right)
    x = (a + b) / 2 / cosine
    y = np.divide(dot(right - left, vector) / ONE**2 / 2, sine, out=np.zeros(count), where=sine > 0)
    angle = 2 * np.arctan2(sine, cosine)
    early = late = angle
    if unit.angle == "arccos":
        cross = dot(left, right) / ONE**2
        at_bound = np.abs(np.abs(cross)[:, np.newaxis] - SEGMENT_BOUNDS[1:-1]).min(axis=1) < 2.0**-16
        early, late = (
            unit.arccos.polynomial(np.clip(cross + at_bound * way, -1, 1)) for way in (-(2.0**-16), 2.0**-16)
        )
    phases = (pixel / (length - 1) - 0.5) * np.stack([angle, early, late])
    exact, early, late = x * np.cos(phases) + y * np.sin(phases)
    # At the border of two segments of arccos, rounding chooses a segment. The formula takes this segment.
    formula = np.where(np.abs(found - early) < np.abs(found - late), early, late)
    return Sample(found, exact, formula, degrees_between(left, right)[:, 0])


def _expect(unit, case):
    beats = case.beats
    words = component_words(*(beats[name] for name in ("normal_left", "normal_right", "vector")))
    *angles, out_of_range = unit.model.compute(*words, beats["length"])
    found = dict(zip(("angle", "phase", "step", "cos_beta"), (word.codes for word in angles), strict=True))
    return {**found, "length": beats["length"], "out_of_range": out_of_range}


def _case(left, right, vector, length):
    return Case({"normal_left": left, "normal_right": right, "vector": vector, "length": length})


def _spans(unit, rng, count):
    """Pairs of normals at any angle, any vector, and spans of any length. Every 16th pair has any codes."""
    return _case(*any_pairs(rng, count), unit_codes(rng, count), any_lengths(rng, count))


def _corners(unit, rng, count):
    """Normals that are equal, nearly equal, orthogonal, nearly opposite or opposite, and extreme codes.

    Every third vector is equal to N_l.
    """
    angles = [np.zeros(20), 10.0 ** rng.uniform(-5, 1, count), rng.uniform(0, 180, count), np.full(20, 90)]
    angles = np.concatenate([*angles, 180 - 10.0 ** rng.uniform(-5, 1, count // 5), np.full(20, 180)])
    left, right = (quantise(v) for v in pairs_at(rng, len(angles), rng.permutation(angles)))
    vector = quantise(sphere(rng, len(angles)))
    vector[::3] = left[::3]
    ends = word_ends(rng, count // 2, 9)
    # The first two rows have the largest and the smallest dot product.
    ends[:2], ends[1, 3:6] = COMPONENT.min_code, COMPONENT.max_code
    left, right, vector = (
        np.vstack([v, ends[:, 3 * k : 3 * k + 3]]) for k, v in enumerate((left, right, vector))
    )
    length = rng.integers(1, 4096, len(left))
    length[:40] = np.tile([1, 2, 3, 4, 5, 2048, 2049, 2050, 4094, 4095], 4)
    return _case(left, right, vector, length)


def _variants():
    setups = {"half chord": AngularSetup()}
    setups |= {f"arccos {table}": AngularSetup("arccos", Arccos(table)) for table in ARCCOS_TABLES}
    for name, setup in setups.items():
        yield (
            name,
            Variant(
                partial(AngularSetupUnit, setup),
                partial(_measure, unit=setup),
                f"spans to 150 degrees, {LONG}",
                note="error of cos gamma at any pixel; only the table of arccos counts as model error",
                as_published=name == "arccos as_published",
                long=name != "half chord",
            ),
        )
    for name, intervals in (("half chord", (1, 2, 3, 4, 5, 26)), ("arccos refitted", (1, 2, 3, 4, 5, 21))):
        for interval in intervals:
            unit = partial(AngularSetupUnit, setups[name], initiation_interval=interval)
            yield f"{name}, interval {interval}", Variant(unit, long=True)


RECORD = Record(
    name="angular_setup",
    title="Angles of a span's great circle to a fixed vector",
    source="docs/theory/interpolation.md#angular-method; [T] 3.1",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={"spans": Stimulus(_spans, 800), "corners": Stimulus(_corners, 600)},
    waivers={
        "cordic_?_*": "The controlling bit is the sign of a word that is never negative, so it is 0.",
        "entry": (
            "From 1/4 to 1 the slope of a root is at least 1/2, so its first bit is 1 already. At 0 the "
            "slope is multiplied by 0."
        ),
        "factor": "The bit says whether a factor saturates. A factor is 0.636 to 0.708, so the bit is 0.",
        "steps": "Two places read an inverted bit. Each of them inverts it again, or does not use it.",
    },
    still={
        "a square is 0 or 1 modulo 4": "dot_1_?[1]",
        "a sum of three squares of at most 2^34 is not negative, and less than 2^36": (
            "dot_1_?[35] dot_0_total[36-37]"
        ),
        "two sums of squares and a squared chord are less than 2^37, a dot product less than 2^36": (
            "squares[37-38] chord_exact[37-40] cross[36-38]"
        ),
        "half of the reciprocal of the normalised sine is not negative": (
            "inverse_roots_sum[22] inverse_roots_rounded[18]"
        ),
        "the correction is at most 0.4143": "corrections_sum[21] corrections_rounded[17-18]",
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "total[14-18] factor[14-16]",
        "in the factor's polynomial the sum total_3 is less than 1/16, and total_2 less than 1/8": (
            "total_3[15-16] total_2[16]"
        ),
        "a root is at most 1, and reaches 1 only by rounding": "root_sum[21] root_rounded[18]",
        "x is less than 2 before the steps of CORDIC, and less than 4 after them": (
            "cordic_x[27-29] cordic_x_*[28-29]"
        ),
        "the distance and its parts are 0 to 4, and parts shifted by 16 bits are less than 2^-14": (
            "gain_1_sum*[32-33] gain_16_sum[16-33] cos_beta_rounded[27-29]"
        ),
        "the terms of the sum gain_1_sum end in zeros": "gain_1_sum[0]",
        "the last bits of a direction are the same for all signs of CORDIC's steps": (
            "direction[0-26] direction_0[0-25] direction_{1,2}[1] direction_*[0]"
        ),
        "half of an angle has 37 fraction bits, and the phase has 40": "phase[0-2] top.spare[36-38]",
        "an angle is at most half a turn, and a step is less than half a turn": (
            "psi_rounded[18] step[39] top.spare[115]"
        ),
        "a reciprocal is normalised, so its first bit is 1": (
            "reciprocals.port__data[16] reciprocals_word[16]"
        ),
        "for a length of 12 bits the shift is at most 12": "shift[4]",
    },
)
