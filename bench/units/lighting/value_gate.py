"""Record of the value gate."""

from functools import partial

import numpy as np

from blysk.bench.units.lighting.specular import any_exponent
from blysk.bench.units.operands import any_codes, exponents
from blysk.bench.units.record import Case, Decisions, Record, Stimulus, Variant
from blysk.golden.cosines.chord_setup import ChordSetup, SpanValues
from blysk.golden.lighting.power import Power
from blysk.golden.lighting.specular import Specular
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.lighting.value_gate import ValueGateUnit

__all__ = ["RECORD", "parabolas_near"]

EXPONENT = 60
"""Exponent of a run that needs only one exponent."""

THRESHOLD = "2 lights, threshold"
"""Variant that takes a threshold in place of the exponent."""

FORMAT = ChordSetup.HIGHLIGHT_FORMAT


def parabolas_near(rng: np.random.Generator, least: np.ndarray, largest_bulge: float = 2.0**-5) -> np.ndarray:
    """Codes of three values of u on parabolas of any size with given least values.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    least : float64 array, shape (count,)
        Least value of the parabola on each span.
    largest_bulge : float
        Largest ``|u_l + u_r - 2 u_m|``.
    """
    count = len(least)
    curvature = 2 * largest_bulge * 10.0 ** rng.uniform(-6, 0, count)
    curvature[::3] *= -1
    # The vertex is on the span, or far away from it. A parabola with a far vertex is nearly a line.
    vertex = rng.uniform(0, 1, count)
    vertex[::4] = rng.choice([-1, 1], len(vertex[::4])) * 10.0 ** rng.uniform(0, 2, len(vertex[::4]))
    three = curvature[:, None] * np.square(np.array([0, 0.5, 1]) - vertex[:, None])
    inside = (curvature > 0) & (vertex > 0) & (vertex < 1)
    lowest = np.where(inside, 0, np.minimum(three[:, 0], three[:, 2]))
    codes = np.rint((three + (least - lowest)[:, None]) / FORMAT.step).astype(np.int64)
    return np.clip(codes, 0, FORMAT.max_code)


def _measure(rng, count):
    """Decisions whether the gate lets a span through, and whether a pixel of the span has a term over 0."""
    gate, method = ValueGate(), LocalChordInterpolator()

    def samples():
        for exponent, share in exponents(rng, count):
            reach = gate.thresholds.values[exponent] / 2
            values = parabolas_near(rng, rng.uniform(0, 2, share) * reach)[:, np.newaxis]
            length = np.floor(2.5 + 17 ** rng.random(share)).astype(np.int64)
            lit = gate.compute(values, exponent)[:, 0]
            given = ChordSetup.DIFFUSE_FORMAT.max_code // 2 + 0 * values
            operands = method.compute_values(SpanValues(given, values), length)
            span, pixel = pixels_of(length)
            term = gate.specular.compute(operands.highlight[:, 0], np.zeros(len(span), bool), exponent)
            shows = np.maximum.reduceat(term.codes, np.flatnonzero(pixel == 0)) > 0
            kept = ~operands.out_of_range
            yield Decisions.of(lit[kept], shows[kept], exponent * values[kept, 0, 1] * FORMAT.step)

    return Decisions.joined(samples())


def _expect(unit, case):
    p = unit.model
    if unit.takes_threshold:
        lit = p.compute_by(case.beats, Fixed(p.THRESHOLD_FORMAT, np.int64(case.constants)))
    else:
        lit = p.compute(case.beats, unit.exponent or case.constants)
    return lit @ (1 << np.arange(unit.lights))


def _case(unit, values, exponent):
    if unit.takes_threshold:
        return Case(values, int(unit.model.thresholds.codes[exponent]))
    return Case(values, exponent if unit.exponent is None else None)


def _near(unit, rng, count, exponent, spread, largest_bulge=2.0**-5):
    exponent = unit.exponent or exponent
    # The largest word stands for a threshold that no u reaches.
    nearest = min(unit.model.thresholds.values[exponent] / 2, 2.0)
    least = nearest + rng.normal(size=count * unit.lights) * spread
    return parabolas_near(rng, least, largest_bulge).reshape(count, unit.lights, 3), exponent


def _spans(unit, rng, count, exponent=EXPONENT):
    """Parabolas of every size, with the least u near the threshold. Every eighth span has any codes."""
    values, exponent = _near(unit, rng, count, exponent, 1e-3, 2.0**-4)
    values[::8] = any_codes(rng, FORMAT, *values[::8].shape)
    return _case(unit, values, exponent)


def _exponents(unit, rng, count):
    """Spans near the threshold, with another exponent in each run: a power of two, the largest, or any."""
    return _spans(unit, rng, count, any_exponent(rng))


def _last_bits(unit, rng, count):
    """Spans whose least u is a few codes from the threshold, so the last bits of the sums decide."""
    values, exponent = _near(unit, rng, count, any_exponent(rng), 2 * FORMAT.step)
    return _case(unit, values, exponent)


def _borders(unit, rng, count):
    """Spans far from every highlight. A bulge or a rise differs from its limit by up to 3 units of a bit."""
    p, shape = unit.model, (count, unit.lights)
    left = rng.integers(FORMAT.max_code // 2, FORMAT.max_code // 4 * 3, shape)
    off = rng.integers(-3, 4, (2, *shape)) << rng.integers(0, 22, (2, *shape))
    bulge = rng.choice([-1, 1], shape) * (p.LARGEST_BULGE + off[0])
    rise = rng.choice([-1, 1], shape) * (p.LARGEST_RISE + off[1])
    which = rng.integers(0, 3, shape)
    bulge, rise = np.where(which == 1, bulge // 16, bulge), np.where(which == 2, rise // 16, rise)
    right = left + rise
    return _case(unit, np.stack([left, (left + right - bulge) // 2, right], axis=-1), unit.exponent or 1000)


def _thresholds(unit, rng, count):
    """Thresholds that no exponent has, with the extreme codes. The least u is near the threshold."""
    format = unit.model.THRESHOLD_FORMAT
    code = rng.choice([0, 1, format.max_code, rng.integers(format.max_code), 1 << rng.integers(format.width)])
    nearest = min(code * format.step / 2, 2.0)
    spread = rng.choice([1e-3, 2 * FORMAT.step])
    values = parabolas_near(rng, nearest + rng.normal(size=count * unit.lights) * spread)
    return Case(values.reshape(count, unit.lights, 3), int(code))


def _variants():
    yield (
        "cosquad",
        Variant(
            ValueGateUnit,
            _measure,
            "spans of 3 to 19 pixels, least u to twice the highlight's, n 1 to 1000",
            "rate",
            note="shares of all spans; model error: let through without a lit pixel; arithmetic error: "
            "stopped with a lit pixel",
        ),
    )
    for name, specular in (
        ("lyon2", Specular(REFLECTION_MODELS["lyon2"], "one_minus_cosine")),
        ("exact power", Power("one_minus_cosine")),
    ):
        yield name, Variant(partial(ValueGateUnit, ValueGate(specular)), long=True)
    yield "3 lights", Variant(partial(ValueGateUnit, None, 3))
    yield "2 lights, exponent 60", Variant(partial(ValueGateUnit, None, 2, exponent=60))
    yield THRESHOLD, Variant(partial(ValueGateUnit, None, 2, takes_threshold=True))


RECORD = Record(
    name="value_gate",
    title="Whether a span of chord-local can hold a visible highlight",
    source="docs/theory/units.md#highlight-gate",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 600),
        "exponents": Stimulus(_exponents, 600, stalled=False, repeats=40),
        "last bits": Stimulus(_last_bits, 3000, stalled=False, repeats=40),
        "borders": Stimulus(_borders, 3000, stalled=False),
        "thresholds": Stimulus(_thresholds, 300, stalled=False, repeats=20, variants=(THRESHOLD,)),
    },
    axis="n u in the middle of the span",
    logarithmic=True,
    waivers={
        "threshold": (
            "The controlling bit is 1 only in a threshold of 4 or more. No exponent has this threshold."
        ),
        "least_0": "The fault changes the sign of the bulge only for a single value, a power of two.",
    },
    still={
        "the exponent is constant in a run, so no bit of its threshold falls": (
            "threshold[0-16] thresholds.port__data[0-16]"
        ),
        "an exponent of 1 or more has a threshold less than 4": "threshold[17] thresholds.port__data[17]",
    },
)
