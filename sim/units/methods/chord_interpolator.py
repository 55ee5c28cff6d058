"""Record of the chord interpolator, and the operands of gated spans that it shares with the local one's."""

from functools import partial

import numpy as np
from amaranth.lib.wiring import Component

from blysk.golden.cosines.chord import Chord
from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import Operands
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise
from blysk.hdl.lighting.value_gate import ValueGateUnit
from blysk.hdl.methods.chord_interpolator import ChordInterpolatorUnit
from blysk.sim.units.cosines.span_limit import differences_about
from blysk.sim.units.lighting.specular import any_exponent
from blysk.sim.units.methods.interpolator import SPAN, long_lengths, operand_beats
from blysk.sim.units.operands import (
    any_pairs,
    component_words,
    degrees_between,
    dot,
    light_constants,
    short_lengths,
    span_lengths,
    sphere,
    spread_angles,
    turned,
    unit_codes,
    word_ends,
)
from blysk.sim.units.record import Case, Record, Sample, Stimulus, Variant

__all__ = [
    "EXPONENT",
    "RECORD",
    "STILL_SPANS",
    "gated",
    "gated_beats",
    "mixed_lengths",
    "spans_at_limits",
]

EXPONENT = 60
"""Exponent of a run that needs only one."""

STILL_SPANS = {
    "twice a number is even": "{diffuse,highlight}_0_second_difference[0]",
    "spans come while under 28 are counted inside, under 12 long ones, and three more before they count": (
        "spans_inside[5] lengths.inner_level[5] long_inside[4] behind[4]"
    ),
}
"""Register bits that cannot toggle, of the spans of both chord interpolators."""

_CHORD = ChordInterpolator()
_GROUPS = 32
"""Lights of a measurement: the spans are divided into as many parts, with a light each."""


# Variants.


def _measure(rng, count):
    """N·L and 1 - N·H along true spans, their middles off the bisector; 1 is the product of unit vectors."""

    def samples():
        for length in np.array_split(span_lengths(rng, count), _GROUPS):
            spans = len(length)
            light, halfway = unit_codes(rng, 1), unit_codes(rng, 1)
            around = np.repeat(normalise(halfway / ONE), spans, axis=0)
            left = turned(rng, around, rng.permutation(spread_angles(rng, spans, 180.0)))
            right = turned(rng, left, rng.permutation(spread_angles(rng, spans, 15.0)))
            # The ratio of the lengths of the interpolated normals at the two ends.
            ends = left, right * 1.05 ** rng.uniform(-1, 1, (spans, 1))
            codes = [quantise(v) for v in (left, normalise(ends[0] + ends[1]), right)]
            values = _CHORD.values(*component_words(*codes, light, halfway))
            operands = _CHORD.compute_values(values, length)
            found = np.stack([operands.cosine.values[:, 0], operands.highlight.values[:, 0]])
            span, pixel = pixels_of(length)
            t = (pixel / np.maximum(length - 1, 1)[span])[:, np.newaxis]
            normals = normalise((1 - t) * ends[0][span] + t * ends[1][span])
            exact = np.stack([normals @ normalise(light / ONE)[0], _chord(normals, halfway)])
            cosine, chord = _CHORD.exact_operands(values, length)
            formula = np.stack([cosine[:, 0], np.maximum(chord[:, 0], 0)])
            kept = ~operands.out_of_range[span]
            angle = degrees_between(codes[0], codes[2])[span[kept], 0]
            yield Sample(found[:, kept] / ONE_SQUARED.values, exact[:, kept], formula[:, kept], angle)

    return Sample.joined(samples())


def _chord(normals, halfway):
    difference = normals - normalise(halfway / ONE)
    return dot(difference, difference) / 2


def gated(lights: int, exponent: int | None = None, *, takes_threshold: bool = False) -> ValueGateUnit:
    """Gate of an interpolator.

    Parameters
    ----------
    lights : int
        Number of lights.
    exponent, takes_threshold
        As for `ValueGateUnit`.
    """
    return ValueGateUnit(ValueGate(), lights, exponent=exponent, takes_threshold=takes_threshold)


def _variant(lights=1, fraction_bits=46, scale=0, long=True, **build):
    unit = partial(ChordInterpolatorUnit, ChordInterpolator(fraction_bits, scale), lights, **build)
    return Variant(unit, beat=SPAN | {"normal_middle": SPAN["normal_left"]}, long=long)


class _Gated:
    """Makes the unit with a gate; a unit belongs to one interpolator."""

    def __init__(self, lights, exponent=None, **build):
        self.arguments = lights, exponent, build

    def __call__(self):
        lights, exponent, build = self.arguments
        gate = gated(lights, exponent, takes_threshold=build.get("takes_threshold", False))
        return ChordInterpolatorUnit(_CHORD, lights, gate=gate, **build)


# Expected results.


def gated_beats(
    unit: Component,
    operands: Operands,
    values: SpanValues,
    length: np.ndarray,
    exponent: int,
    threshold: int | None = None,
) -> np.ndarray:
    """Output beats of a unit with these operands, and the decisions of its gate, if it has one.

    The gate decides a pixel of a span of one or two pixels by its own u, the pixels of a longer span
    together. It uses the threshold's code, if there is one, in place of the exponent.
    """
    if unit.gate is None:
        return operand_beats(unit, operands)
    span, pixel = pixels_of(length)
    u = values.highlight[span].astype(np.int64)
    own = np.where(pixel[:, np.newaxis] == 0, u[..., 0], u[..., 2])
    u = np.where((length[span] < 3)[:, np.newaxis, np.newaxis], own[..., np.newaxis], u)
    gate = unit.gate.parameters
    if threshold is None:
        lit = gate.compute(u, unit.gate.exponent or exponent)
    else:
        lit = gate.compute_by(u, Fixed(gate.THRESHOLD_FORMAT, np.int64(threshold)))
    return operand_beats(unit, operands, gated=~lit)


def _values(unit, case):
    beats, lights = case.beats, case.constants["lights"]
    normals = (beats[f"normal_{place}"] for place in ("left", "middle", "right"))
    return unit.parameters.values(*component_words(*normals, lights["direction"], lights["halfway"]))


def _exponent(case):
    return int(case.constants.get("exponent", 1))


def _expect(unit, case):
    values, length = _values(unit, case), case.beats["length"]
    operands = unit.parameters.compute_values(values, length)
    return gated_beats(unit, operands, values, length, _exponent(case), case.constants.get("threshold"))


def _status(unit, case):
    values, length = _values(unit, case), case.beats["length"]
    ends = component_words(case.beats["normal_left"], case.beats["normal_right"])
    exponent = np.full(len(length), _exponent(case))
    threshold = None
    if unit.takes_threshold:
        threshold = Fixed(ValueGate.THRESHOLD_FORMAT, np.full(len(length), case.constants["threshold"]))
    wide = SpanLimit().compute(*ends, values, length, exponent, unit.highlights, threshold)
    if not unit.highlights:
        # Without highlights there is no word of u that could be out of range.
        values = SpanValues(values.diffuse, 0 * values.highlight)
    flags = {"out_of_range": unit.parameters.compute_values(values, length).out_of_range, "wide": wide}
    return {name: int(np.count_nonzero(flag)) for name, flag in flags.items()}


# Stimuli.


def mixed_lengths(rng: np.random.Generator, count: int) -> np.ndarray:
    """Lengths of 1 to 4 pixels in runs and mixed, and every tenth up to 40."""
    length = rng.integers(1, 5, count)
    runs = rng.integers(1, 5, count // 12 + 1).repeat(12)[:count]
    length[: count // 2] = runs[: count // 2]
    length[::10] = rng.integers(1, 41, len(length[::10]))
    return length


def _middles(rng, left, right):
    """Normals in the middle: the bisector, that of a line of any lengths, near those, or any."""
    total = left * 2.0 ** rng.uniform(-1, 1, (len(left), 1)) + right
    total[::4] = left[::4] + right[::4]
    total = np.where(total.any(axis=1, keepdims=True), total, left)
    middle = quantise(
        normalise(normalise(total) + 1e-2 * (rng.random((len(left), 1)) < 0.2) * sphere(rng, len(left)))
    )
    middle[5::16] = unit_codes(rng, len(middle[5::16]))
    middle[7::32] = word_ends(rng, len(middle[7::32]), 3)
    return middle


def _case(unit, rng, left, right, length, exponent=None):
    """Input of spans under lights from anywhere; every second light has an H that is one of the normals."""
    length = np.maximum(length % (1 << unit.length_bits), 1)
    direction, halfway = (unit_codes(rng, unit.lights) for _ in range(2))
    halfway[::2] = left[rng.integers(0, len(left), len(halfway[::2]))]
    constants = {"lights": light_constants(unit, direction, halfway)}
    if unit.highlights:
        constants["exponent"] = exponent or EXPONENT
    if unit.takes_threshold:
        # That of a lobe goes with no exponent.
        constants["threshold"] = int(ValueGate().thresholds.codes[any_exponent(rng)])
    beats = {"normal_left": left, "normal_middle": _middles(rng, left, right), "normal_right": right}
    return Case(beats | {"length": length}, constants)


def _spans(unit, rng, count):
    """Pairs of normals at any angle, any middles, every sixteenth of arbitrary codes; most spans short."""
    length = short_lengths(rng, count, 1)
    return _case(unit, rng, *any_pairs(rng, len(length)), length)


def _short_spans(unit, rng, count):
    """Spans of 1 to 4 pixels in runs and mixed, of every angle to 60 degrees about H; any exponent."""
    around = sphere(rng, 1).repeat(count, axis=0)
    left = turned(rng, around, rng.permutation(spread_angles(rng, count, 90.0)))
    right = turned(rng, left, rng.permutation(spread_angles(rng, count, 60.0)))
    return _case(unit, rng, quantise(left), quantise(right), mixed_lengths(rng, count), any_exponent(rng))


def _limits(unit, rng, count):
    """Angles about the limits of the exponent, H at the edge of what is lit, lights behind and in front."""
    limit, exponent = SpanLimit(), any_exponent(rng)
    halfway = sphere(rng, 1).repeat(count, axis=0)
    # The angle to H at which a highlight ends.
    edge = np.degrees(np.arccos(np.clip(1 - limit.lit(exponent), -1, 1)))
    left = turned(rng, halfway, edge * rng.uniform(0.8, 1.2, count))
    degrees = rng.choice([limit.angle(exponent), limit.WIDEST], count) + 0.1 * rng.normal(size=count)
    left, right = quantise(left), quantise(turned(rng, left, np.abs(degrees)))
    case = _case(unit, rng, left, right, rng.integers(2, 7, count), exponent)
    lights = case.constants["lights"]
    lights["halfway"] = quantise(halfway[:1])
    # L about a right angle to the normals.
    lights["direction"] = quantise(turned(rng, halfway[: unit.lights], rng.uniform(60, 120, unit.lights)))
    return case


def spans_at_limits(rng: np.random.Generator, count: int, exponent: int) -> dict[str, np.ndarray]:
    """Spans whose angle, N·L and u are by a few codes or a bit off the limits of `SpanLimit`.

    L is a coordinate axis, from which the normals of a span have nearly the same component. A third of the
    spans begins at the edge of the highlight and goes away from it.

    Parameters
    ----------
    rng : numpy.random.Generator
        Random generator.
    count : int
        Number of spans.
    exponent : int
        Specular exponent.

    Returns
    -------
    dict of int arrays
        ``left``, ``middle``, ``right``: normals, shape (count, 3); ``direction``, ``halfway``: L and H, shape
        (3,). Codes of `COMPONENT`; the vectors are no unit vectors.
    """
    limit = SpanLimit()
    narrow = limit.chords.codes[exponent.bit_length()]
    difference = differences_about(rng, np.where(np.arange(count) % 2, narrow, limit.widest.codes))
    turn = rng.uniform(0, 2 * np.pi)
    # Short of 1, so that there is room for the widest differences on both sides.
    halfway = quantise(np.array([np.cos(turn), np.sin(turn), 0.0])) * 7 // 10
    along = rng.choice([-1, 1], (count, 1)) * (1 << rng.integers(0, 16, (count, 1)))
    left = halfway + difference // 2
    left[:, 2:] += np.int64(limit.BEHIND.values * ONE) + along
    right = left - difference
    middle = (left + right) >> 1
    edge = np.full(len(left[::3]), np.int64(limit.lit(exponent) / Chord.FORMAT.step))
    left[::3] = halfway + differences_about(rng, edge)
    right[::3] = left[::3] + differences_about(rng, np.full_like(edge, narrow * 1.1))
    middle[::3] = -halfway
    left, right = (np.clip(normal, COMPONENT.min_code, ONE) for normal in (left, right))
    vectors = {"direction": np.array([0, 0, ONE]), "halfway": halfway}
    return {"left": left, "middle": middle, "right": right} | vectors


def _decisions(unit, rng, count):
    """Spans at the limits: every bit of a comparison decides."""
    exponent = any_exponent(rng)
    at = spans_at_limits(rng, count, exponent)
    case = _case(unit, rng, at["left"], at["right"], rng.integers(4, 7, count), exponent)
    case.beats["normal_middle"] = at["middle"]
    lights = case.constants["lights"]
    for name in ("direction", "halfway"):
        lights[name][0] = at[name]
    return case


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels in range, where the last bits of the differences count; shorter ones."""
    length = long_lengths(rng, count)
    left = sphere(rng, len(length))
    right = turned(rng, left, 15 * 10.0 ** rng.uniform(-3, 0, len(length)))
    return _case(unit, rng, quantise(left), quantise(right), length)


def _last_bits(unit, rng, count):
    """Many short spans: a bit that is rounded off decides a result once in thousands."""
    left = sphere(rng, count)
    angles = 15 * rng.choice([10.0 ** rng.uniform(-5, 0, count), rng.random(count)])
    return _case(unit, rng, quantise(left), quantise(turned(rng, left, angles)), rng.integers(1, 8, count))


RECORD = Record(
    name="chord_interpolator",
    title="N·L and half the squared chord from N to H, from three normals a span",
    source="docs/theory/chord.md#differences",
    variants={
        "chord": Variant(
            partial(ChordInterpolatorUnit, _CHORD, 1),
            _measure,
            "spans to 15 degrees, 1 to 4095 pixels, lengths of the ends within 5 % of each other",
            beat=SPAN | {"normal_middle": SPAN["normal_left"]},
            note="of N.L and 1 - N.H; exact: normalised interpolation",
        ),
        "2 lights, interval 9": _variant(2, setup_interval=9),
        "interval 18, no highlights": _variant(setup_interval=18, highlights=False, length_bits=9),
        "36 bits, interval 3": _variant(fraction_bits=36, setup_interval=3),
        "gated": Variant(_Gated(1)),
        "2 lights, interval 9, gated, exponent 60": Variant(_Gated(2, 60, setup_interval=9), long=True),
        "threshold": _variant(long=False, takes_threshold=True),
        "scale 5": _variant(scale=5),
        "2 lights, gated, threshold": Variant(_Gated(2, takes_threshold=True), long=True),
    },
    expect=_expect,
    status=_status,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "short spans": Stimulus(_short_spans, 800, repeats=3),
        "limits": Stimulus(_limits, 500, stalled=False, repeats=30),
        "decisions": Stimulus(_decisions, 1000, stalled=False, repeats=20),
        "long spans": Stimulus(_long_spans, 60_000, stalled=False),
        "last bits": Stimulus(_last_bits, 4000, stalled=False),
    },
    waivers={
        "chord_accumulator.values": "It is for the saturation at 2; a quadratic of values up to 1 is less.",
        "level": "It is the table's entry of exponents under 1, and there are none.",
        "u_?_exact_square_partial": (
            "Squares end in 00 or 01, so the last bits of three never carry past the second bit; ten are cut."
        ),
        "chord_values.datapath.result": (
            "The value of the saturation is the inverted sign, and a sum of squares is not negative."
        ),
    },
    still=STILL_SPANS
    | {
        "the exponent stays for a run: only bits of the level that is read after a reset fall": (
            "level_octave[0-3] top.level[{0-25,27}] excess_0[0]"
        ),
        "levels are 4, 2 or less than 1, and not negative": "top.level[26] top.level[29]",
    },
)
