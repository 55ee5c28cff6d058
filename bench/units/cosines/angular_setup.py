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
from blysk.bench.units.record import Case, Record, Sample, Stimulus, Variant
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import ARCCOS_TABLES, SEGMENT_BOUNDS, Arccos
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.hdl.cosines.angular_setup import AngularSetupUnit

__all__ = ["RECORD", "half_angles"]


def half_angles(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine of half the angle between vectors of codes, each from the smaller of two chords."""
    chord, chord_to_opposite = (dot(v, v) / ONE**2 for v in (right - left, right + left))
    acute = chord_to_opposite >= chord
    sine = np.where(acute, np.sqrt(chord) / 2, np.sqrt(np.maximum(1 - chord_to_opposite / 4, 0)))
    return sine, np.where(acute, np.sqrt(np.maximum(1 - chord / 4, 0)), np.sqrt(chord_to_opposite) / 2)


def _measure(rng, count, unit):
    """Cosine of gamma at any pixel, from the setup's angles."""
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
    # At the border of two segments rounding chooses the segment. The formula takes the unit's segment.
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
    """Pairs of normals at any distance, with any vector and length. Every sixteenth pair has any codes."""
    return _case(*any_pairs(rng, count), unit_codes(rng, count), any_lengths(rng, count))


def _corners(unit, rng, count):
    """Equal, nearly equal, orthogonal, nearly opposite normals; H or L equal to N_l; extreme codes."""
    angles = [np.zeros(20), 10.0 ** rng.uniform(-5, 1, count), rng.uniform(0, 180, count), np.full(20, 90)]
    angles = np.concatenate([*angles, 180 - 10.0 ** rng.uniform(-5, 1, count // 5), np.full(20, 180)])
    left, right = (quantise(v) for v in pairs_at(rng, len(angles), rng.permutation(angles)))
    vector = quantise(sphere(rng, len(angles)))
    vector[::3] = left[::3]
    ends = word_ends(rng, count // 2, 9)
    # These are the largest positive and negative dot products.
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
                note="of cos gamma at any pixel; the tables count as arithmetic, except the table of arccos",
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
        "cordic_?_*": "The controlling bit is the sign of a word that is not negative.",
        "entry": "The slope of a root from 1/4 to 1 is 1/2 or more; at 0 it is multiplied by 0.",
        "factor": "The bit serves the saturation of a factor, but a factor is 0.636 to 0.708.",
        "steps": "Both readers of an inverted bit invert it again, or ignore it.",
    },
    still={
        "the second bit of a square is 0": "dot_1_?[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "dot_1_?[35] dot_0_total[36-37]"
        ),
        "two such sums, and the squared distance from them, are less than 2^37, the dot product 2^36": (
            "squares[37-38] chord_exact[37-40] cross[36-38]"
        ),
        "half the reciprocal of the sine, normalised, is not negative": (
            "inverse_roots_sum[22] inverse_roots_rounded[18]"
        ),
        "the correction is at most 0.4143": "corrections_sum[21] corrections_rounded[17-18]",
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "total[14-18] factor[14-16]",
        "inner sums of the polynomial are smaller still": "total_3[15-16] total_2[16]",
        "a root is 1 at most, and only by rounding": "root_sum[21] root_rounded[18]",
        "an axis is less than 2, and CORDIC makes the distance less than 4": (
            "cordic_x[27-29] cordic_x_*[28-29]"
        ),
        "the distance and its parts are 0 to 4, and parts shifted by 16 are less than 2^-14": (
            "gain_1_sum*[32-33] gain_16_sum[16-33] cos_beta_rounded[27-29]"
        ),
        "the shifted words end in zeros": "gain_1_sum[0]",
        "the last bits of the sum do not depend on the signs of CORDIC's steps": (
            "direction[0-26] direction_0[0-25] direction_{1,2}[1] direction_*[0]"
        ),
        "half an angle of 36 bits has 37": "phase[0-2] top.spare[36-38]",
        "an angle is half a turn at most, and a step is less": "psi_rounded[18] step[39] top.spare[115]",
        "a reciprocal is normalised, so that its first bit is 1": (
            "reciprocals.port__data[16] reciprocals_word[16]"
        ),
        "a length of 12 bits takes shifts up to 12": "shift[4]",
    },
)
