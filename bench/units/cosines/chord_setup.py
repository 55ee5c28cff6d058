"""Record of the chord setup, and values of spans for this record and the records of methods."""

from collections.abc import Callable
from functools import partial

import numpy as np

from blysk.bench.units.operands import (
    LONG,
    any_codes,
    any_lengths,
    dot,
    log_lengths,
    pixel_of,
    sphere,
    spread_angles,
    turned,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.sim.engines.beats import dtype_of

__all__ = [
    "FORMATS",
    "LOCAL",
    "RECORD",
    "any_factors",
    "any_values",
    "factors_of",
    "local_curves",
    "parabola",
    "three_values",
    "value_at",
    "value_beats",
    "values_of",
]

LOCAL = "lights and viewer at distances 2 to 4, spans up to 0.3 wide in space and to 15 degrees"
FORMATS = {"diffuse": ChordSetup.DIFFUSE_FORMAT, "highlight": ChordSetup.HIGHLIGHT_FORMAT}


def local_curves(rng: np.random.Generator, spans: int) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Function of span and t that gives N·L and ``1 - N·H``, with a point light and a near viewer."""
    start = rng.normal(size=(spans, 3))
    step = rng.uniform(0, 0.3, (spans, 1)) * sphere(rng, spans)
    to_viewer = sphere(rng, spans)
    to_light = turned(rng, to_viewer, rng.uniform(0, 120, spans))
    viewer, light = (start + rng.uniform(2, 4, (spans, 1)) * way for way in (to_viewer, to_light))
    left = turned(rng, normalise(to_viewer + to_light), rng.permutation(spread_angles(rng, spans, 90.0)))
    right = turned(rng, left, rng.permutation(spread_angles(rng, spans, 15.0)))

    def at(span, t):
        position = start[span] + t[:, np.newaxis] * step[span]
        ways = [normalise(point[span] - position) for point in (light, viewer)]
        normal = interpolate("normalised", left[span], right[span], t)
        return np.stack([dot(normal, ways[0]), 1 - dot(normal, normalise(ways[0] + ways[1]))])

    return at


def three_values(at, spans: int) -> tuple[np.ndarray, SpanValues]:
    """Exact values at the ends and in the middle, shape (2, spans, 3), and their codes for one light."""
    exact = np.stack([at(np.arange(spans), np.full(spans, t)) for t in (0.0, 0.5, 1.0)], axis=-1)
    return exact, SpanValues.quantise(*exact[:, :, np.newaxis])


def parabola(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Quadratic through the values at t = 0, 1/2 and 1, along the last axis."""
    left, middle, right = np.moveaxis(values, -1, 0)
    return left + t * (4 * middle - right - 3 * left + t * 2 * (left + right - 2 * middle))


def value_at(differences, pixel) -> np.ndarray:
    """Value of the quadratic of the first light at a pixel of each span, in float64, over `ONE_SQUARED`."""
    start, first, second = (word.values[:, 0] for word in differences)
    k = pixel.astype(np.float64)
    return (start + k * first + k * (k - 1) / 2 * second) / ONE_SQUARED.values


def _measure(rng, count):
    """N·L and u at any pixel, by the differences in exact arithmetic.

    The scale is chosen so that two equal unit vectors have the dot product 1.
    """
    length = log_lengths(rng, count, 2)
    pixel = pixel_of(rng, length)
    exact, values = three_values(local_curves(rng, count), count)
    words = (Fixed(format, codes) for format, codes in zip(FORMATS.values(), values, strict=True))
    *differences, out_of_range = ChordSetup().compute(*words, length)
    kept = ~out_of_range
    found = np.stack([value_at(words, pixel) for words in differences])[:, kept]
    exact = parabola(exact, pixel / (length - 1))[:, kept]
    return Sample(found, exact, exact, pixel[kept])


def values_of(beats) -> SpanValues:
    """Values from input beats. Without highlights u is 0."""
    values = beats["values"]
    diffuse = values["diffuse"]
    return SpanValues(diffuse, values["highlight"] if "highlight" in values.dtype.names else 0 * diffuse)


def factors_of(beats) -> np.ndarray | None:
    """Codes of the factors from input beats. ``None`` without factors."""
    return beats["factors"] if "factors" in beats.dtype.names else None


def _expect(unit, case):
    beats = case.beats
    words = (Fixed(format, code) for format, code in zip(FORMATS.values(), values_of(beats), strict=True))
    codes = factors_of(beats)
    factor = None if codes is None else Fixed(FORMATS["diffuse"], codes)
    *differences, out_of_range = unit.model.compute(*words, beats["length"], factor)
    expected = np.zeros(len(out_of_range), dtype_of(unit.o.payload.shape()))
    if factor is not None:
        of_factors = differences.pop()
        for field in ("first", "second"):
            expected["factors"][field] = getattr(of_factors, field).codes
    lights = expected["lights"]
    for name, of_function in zip(FORMATS, differences, strict=True):
        for field in ("first", "second") if name in lights.dtype.names else ():
            lights[name][field] = getattr(of_function, field).codes
    expected["out_of_range"] = out_of_range
    return expected


def any_values(rng: np.random.Generator, count: int, lights: int) -> SpanValues:
    """Three values of each function, on curves of every size. Every eighth span has arbitrary codes."""
    values = []
    for format in FORMATS.values():
        codes = any_codes(rng, format, count, lights, 3)
        change = 10.0 ** rng.uniform(-5, -0.5, (count, 1, 1)) * rng.uniform(-0.3, 0.3, (count, lights, 3))
        curve = np.clip(codes[..., :1] + change * format.max_code, format.min_code, format.max_code)
        values.append(np.where(np.arange(count)[:, None, None] % 8, curve.astype(np.int64), codes))
    return SpanValues(*values)


def any_factors(rng: np.random.Generator, count: int, factors: int) -> np.ndarray:
    """Codes of factors from 0 to 1 on curves of every size. Every eighth span has arbitrary codes."""
    format = FORMATS["diffuse"]
    codes = any_codes(rng, format, count, factors, 3)
    start = rng.uniform(0, 1, (count, factors, 1))
    size = 10.0 ** rng.uniform(-5, -0.5, (count, factors, 1)) * rng.choice([0, 1], (count, factors, 1))
    curve = np.clip(start + size * rng.uniform(-0.3, 0.3, (count, factors, 3)), 0, 1)
    curve = np.rint(curve * format.max_code).astype(np.int64)
    return np.where(np.arange(count)[:, None, None] % 8, curve, codes)


def value_beats(unit, values: SpanValues, length: np.ndarray) -> np.ndarray:
    """Input beats of a unit that takes values of spans. The values are the seed of random factors."""
    beats = np.zeros(len(length), dtype_of(unit.i.payload.shape()))
    for name, codes in zip(FORMATS, values, strict=True):
        if name in beats["values"].dtype.names:
            beats["values"][name] = codes
    if "factors" in beats.dtype.names:
        seed = int(np.abs(values.diffuse).sum() % (1 << 32))
        beats["factors"] = any_factors(np.random.default_rng(seed), *beats["factors"].shape[:2])
    beats["length"] = length
    return beats


def _lengths(unit, rng, count):
    return np.maximum(any_lengths(rng, count) % (1 << unit.length_bits), 1)


def _spans(unit, rng, count):
    """Curves of every size. The logarithm of span lengths is uniform. Every eighth span has random codes."""
    return Case(value_beats(unit, any_values(rng, count, unit.lights), _lengths(unit, rng, count)))


def _corners(unit, rng, count):
    """Curves whose terms P and G are in range, near their extreme codes, or out of range.

    Other curves have equal values or extreme codes.
    """
    values = []
    for format in FORMATS.values():
        start = rng.uniform(format.min_code * 0.9, format.max_code * 0.9, (count, unit.lights))
        size = 10.0 ** rng.uniform(-6, 0.1, (count, 1))
        slope = rng.uniform(-0.5, 0.5, start.shape) * size / format.step
        curvature = rng.uniform(-0.125, 0.125, start.shape) * size / format.step
        slope[:40] = 0.5 / format.step + rng.integers(-200, 200, (40, unit.lights))
        curvature[40:80] = 0.125 / format.step + rng.integers(-200, 200, (40, unit.lights))
        slope[20:60] *= -1
        curvature[60:80] *= -1
        codes = np.stack([start + t * (slope + t * curvature) for t in (0, 0.5, 1)], axis=2)
        codes = np.clip(np.rint(codes), format.min_code, format.max_code).astype(np.int64)
        codes[80:120] = rng.choice([format.min_code, format.max_code, 0, 1], (40, unit.lights, 3))
        codes[120:160] = codes[120:160, :, :1]
        values.append(codes)
    length = rng.integers(1, 1 << unit.length_bits, count)
    length[160:172] = np.minimum([1, 2, 3, 4, 5, 16, 17, 2048, 2049, 2050, 4094, 4095], length.max())
    return Case(rng.permutation(value_beats(unit, SpanValues(*values), length)))


def _last_bits(unit, rng, count):
    """Many spans, because the last bits of products and sums rarely change a rounded result."""
    return _corners(unit, rng, count)


def _variants():
    yield (
        "interval 3",
        Variant(
            ChordSetupUnit,
            _measure,
            f"{LOCAL}, {LONG}",
            note="errors of N.L and u at any pixel, by the differences; the quadratic counts as exact",
        ),
    )
    for lights, interval in (*((1, i) for i in (1, 2, 4, 6, 9, 18)), (2, 3), (3, 18)):
        unit = partial(ChordSetupUnit, None, lights, initiation_interval=interval)
        yield f"{lights} lights, interval {interval}", Variant(unit, long=lights == 1)
    for bits in (36, 40):
        yield f"{bits} fraction bits", Variant(partial(ChordSetupUnit, ChordSetup(bits)), long=bits == 40)
    yield "9 bits of length", Variant(partial(ChordSetupUnit, length_bits=9), long=True)
    unit = partial(ChordSetupUnit, None, 2, initiation_interval=2, highlights=False)
    yield "no highlights", Variant(unit)
    yield "2 lights, one fades", Variant(partial(ChordSetupUnit, None, 2, factors=1))


RECORD = Record(
    name="chord_setup",
    title="Forward differences of N·L and of half the squared chord from three values",
    source="docs/theory/chord.md#differences",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 500),
        "corners": Stimulus(_corners, 500),
        "last bits": Stimulus(_last_bits, 30_000, stalled=False),
    },
    axis="pixel of the span",
    logarithmic=True,
    waivers=dict.fromkeys(
        ("highlight_0_slope_out_of_range", "out_of_range"),
        "The fault writes the register too often. The word is read only on the cycle after the right write.",
    )
    | dict.fromkeys(
        ("diffuse_0_curvature_exact", "highlight_0_ends"),
        "The fault changes a word that is kept. The word is read only on the cycle after it was written.",
    )
    | {
        "multiplier_1_1": "A reciprocal and its square are normalised, so their first bits are 1 already.",
        "reciprocals_word": "A reciprocal is normalised, so its first bit is 1 already.",
        "o__payload": "A second difference is twice a number, so its last bit is 0 already.",
    },
    still={
        "a second difference is twice a number, so its last bit is 0": (
            "{diffuse,highlight}_0_second[0] top.spare[47] top.spare[141]"
        ),
        "a reciprocal and its square are normalised, so their first bits are 1": (
            "reciprocals_word[16] reciprocals.port__data[16] reciprocal[16] square[16] square_rounded[16]"
        ),
        "the largest square of a reciprocal is 62 steps less than 1": "square_rounded[17]",
        "for a length of 12 bits the shift is at most 12, and the square's shift at most 25": (
            "shift[4] square_shift[5]"
        ),
        "a reciprocal and its square have 17 bits, and are not negative": "multiplier_{0,1}_{1,b}[17]",
        "the shifter has five fraction bits more than the product of the slope of u and 1/(m - 1)": (
            "shifter_0_0[0-4]"
        ),
        "the shifter has twelve or thirteen fraction bits more than the other products": (
            "shifter_1_0[0-11]"
        ),
    },
)
