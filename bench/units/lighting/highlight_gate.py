"""Record of the highlight gate."""

from functools import partial

import numpy as np

from blysk.bench.units.lighting.specular import EXPONENT, any_exponent
from blysk.bench.units.operands import (
    component_words,
    degrees_between,
    exponents,
    sphere,
    spread_angles,
    turned,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Decisions
from blysk.golden.lighting.highlight_gate import HighlightGate
from blysk.golden.lighting.specular import Specular
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.dot_product import DotProduct
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import quantise
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit

__all__ = ["RECORD", "spans_about"]

_METHOD = QuadraticInterpolator()
_GATE = HighlightGate(_METHOD.gate_limits)


def _measure(rng, count):
    """Decisions whether the gate lets a span through, and whether a pixel of the span has a term over 0."""
    gate, interpolator = _GATE, _METHOD

    def samples():
        for exponent, share in exponents(rng, count):
            edge = np.degrees(np.arccos(np.sqrt(gate.thresholds.values[exponent])))
            halfway = sphere(rng, share)
            left = turned(rng, halfway, rng.uniform(0, 2, share) * edge)
            right = turned(rng, left, rng.permutation(spread_angles(rng, share, MAX_SPAN_ANGLE)))
            left, right, halfway = (quantise(v) for v in (left, right, halfway))
            length = np.floor(17 ** rng.random(share)).astype(np.int64)
            right[length == 1] = left[length == 1]
            lit = gate.compute(*component_words(left, right, halfway), exponent)
            normals, out_of_range = interpolator.normals(*component_words(left, right), length)
            span, pixel = pixels_of(length)
            cosine = DotProduct().compute(normals, *component_words(halfway[span]))
            term = gate.specular.compute(cosine, np.zeros(len(span), bool), exponent)
            shows = np.maximum.reduceat(term.codes, np.flatnonzero(pixel == 0)) > 0
            kept = ~out_of_range
            yield Decisions.of(lit[kept], shows[kept], degrees_between(left, right)[kept, 0])

    return Decisions.joined(samples())


def _exponent(unit, constants):
    return unit.exponent or constants["exponent"]


def _expect(unit, case):
    p, exponent = unit.model, _exponent(unit, case.constants)
    left, right = (Fixed(p.component_format, case.beats[f"normal_{end}"]) for end in ("left", "right"))
    lit = [
        p.compute(left, right, Fixed(p.component_format, halfway), exponent)
        for halfway in case.constants["halfway"]
    ]
    return np.stack(lit, axis=-1) @ (1 << np.arange(unit.lights))


def spans_about(rng, halfway, cosine, degrees, spread):
    """Unit normals of spans of given angles. The largest N·H on a span's great circle is near a cosine.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    halfway : array, shape (spans, 3)
        Unit vector H of each span.
    cosine : array, shape (spans,)
        The cosine of each span.
    degrees : array, shape (spans,)
        Angles of the spans.
    spread : float
        Standard deviation of the largest N·H from the cosine.

    Returns
    -------
    left, right : array, shape (spans, 3)
    """
    top = np.clip(cosine + rng.normal(size=len(halfway)) * spread, -1, 1)
    top = turned(rng, halfway, np.degrees(np.arccos(top)))
    # The span's great circle is at a right angle to the line from H to the nearest point.
    side = normalise(np.cross(top, halfway + 1e-9 * sphere(rng, len(halfway))))
    share = rng.uniform(-0.2, 1.2, len(halfway))
    ends = []
    for angle in (-share * np.radians(degrees), (1 - share) * np.radians(degrees)):
        ends.append(top * np.cos(angle)[:, np.newaxis] + side * np.sin(angle)[:, np.newaxis])
    return tuple(ends)


def _codes(unit, vectors):
    """Codes of vectors in the unit's format. For ``SQ(1, 17)`` they equal the codes of `quantise`."""
    return np.floor(vectors * unit.model.component_format.max_code + 0.5).astype(np.int64)


def _near(unit, rng, count, exponent, spread, degrees):
    p = unit.model
    exponent = unit.exponent or exponent
    halfway = normalise(sphere(rng, 1) + 0.3 * sphere(rng, unit.lights))
    light = np.arange(count) % unit.lights
    cosine = np.full(count, np.sqrt(p.thresholds.values[exponent] + p.margin))
    left, right = spans_about(rng, halfway[light], cosine, degrees, spread)
    beats = {"normal_left": _codes(unit, left), "normal_right": _codes(unit, right)}
    constants = {"halfway": _codes(unit, halfway)}
    return Case(beats, constants if unit.exponent else constants | {"exponent": exponent})


def _spans(unit, rng, count, exponent=EXPONENT):
    """Spans of up to 90 degrees. The largest N·H is near the threshold. Some ends have extreme codes."""
    degrees = rng.choice([0, 1e-3, 1, 10, 30, 44.9, 45.1, 75, 90], count)
    case = _near(unit, rng, count, exponent, 1e-3, degrees)
    format = unit.model.component_format
    corners = [format.min_code, format.max_code, 0, 1, -1]
    for ends in case.beats.values():
        ends[::8] = rng.choice(corners, ends[::8].shape)
    return case


def _any(unit, rng, count):
    """Spans near the threshold. Each run has another exponent: a power of two, the largest or any."""
    return _spans(unit, rng, count, any_exponent(rng))


def _last_bits(unit, rng, count):
    """Spans as near to the threshold as rounding allows, so the last bits of products and sums decide."""
    return _near(unit, rng, count, any_exponent(rng), 1e-5, np.geomspace(0.1, 45, count))


def _ties(unit, rng, count):
    """Spans, chosen from many, whose decision changes if a dot product changes by 2^9 steps."""
    p, exponent = unit.model, any_exponent(rng)
    case = _near(unit, rng, count, exponent, 1e-5, 45 * rng.random(count) ** rng.choice([1, 3]))
    left, right = (Fixed(p.component_format, case.beats[f"normal_{end}"]) for end in ("left", "right"))
    halfway = Fixed(p.component_format, case.constants["halfway"][0])
    pairs = (left, right), (left, halfway), (right, halfway)
    dots = [p.dot_product.compute(*pair) for pair in pairs]
    threshold = p.thresholds[_exponent(unit, case.constants)]
    decided = p.decide_by(*dots, threshold)
    kept = np.zeros(count, bool)
    for k, dot in enumerate(dots):
        for off in (-1 << 9, 1 << 9):
            other = Fixed(dot.format, np.clip(dot.codes + off, dot.format.min_code, dot.format.max_code))
            kept |= p.decide_by(*dots[:k], other, *dots[k + 1 :], threshold) != decided
    return Case({name: beats[kept] for name, beats in case.beats.items()}, case.constants)


def _variants():
    yield (
        "conservative",
        Variant(
            partial(HighlightGateUnit, _GATE),
            _measure,
            "spans to 45 degrees, 1 to 16 pixels, N_l within twice the highlight's radius of H, n 1 to 1000",
            "rate",
            note="shares of all spans; model error: let through without a lit pixel; arithmetic error: "
            "stopped with a lit pixel",
        ),
    )
    for interval in (1, 2, 3, 5, 8, 15):
        unit = partial(HighlightGateUnit, _GATE, initiation_interval=interval)
        yield f"interval {interval}", Variant(unit, long=True)
    p = HighlightGate(_METHOD.gate_limits, Specular(REFLECTION_MODELS["lyon2"]))
    yield "lyon2, interval 4", Variant(partial(HighlightGateUnit, p, initiation_interval=4), long=True)
    for bits in (5, 6, 9):
        p = HighlightGate(_METHOD.gate_limits, fraction_bits=bits)
        yield f"{bits} fraction bits", Variant(partial(HighlightGateUnit, p), long=bits != 6)
    for lights, exponent, interval in ((2, 60, 27), (3, None, 4), (1, 60, 6)):
        unit = partial(HighlightGateUnit, _GATE, lights, initiation_interval=interval, exponent=exponent)
        name = f"{lights} lights, interval {interval}" + f", exponent {exponent}" * (exponent is not None)
        yield name, Variant(unit, long=lights != 2)


RECORD = Record(
    name="highlight_gate",
    title="Whether a span can hold a visible highlight",
    source="docs/theory/units.md#highlight-gate; [T] 4.2 and figure 4.10",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 600),
        "exponents": Stimulus(_any, 600, stalled=False, repeats=20),
        "last bits": Stimulus(_last_bits, 3000, stalled=False, repeats=30),
        "ties": Stimulus(_ties, 100_000, stalled=False, repeats=20),
    },
    waivers={
        "a_0": (
            "The fault turns a negative cosine into 256 steps. In a span of up to 45 degrees the cosine then "
            "reaches less than 400 steps."
        ),
        "difference": "The bit is cut off. Its carry changes a kept bit in only 1 of 2^15 spans.",
        "partial_0": "T (2 - u) is not negative, and less than 2, so the controlling bit is 0.",
        "total_0": "The bit is cut off. Its carry changes a kept bit in only 1 of 2^14 spans.",
        "cut": "1 - N_l·N_r is less than 4 for any words of normals, so the bit is 0 already.",
        "$auto$ff.cc:*": (
            "The unit waits only on the turn on which its results come. So all beats begin on the same turn."
        ),
    },
    still={
        "the exponent is constant in a run, so no bit of its threshold falls": (
            "datapath.threshold[0-16] thresholds.port__data[0-16]"
        ),
        "T (2 - u) is not negative, and less than 2": "partial_0[36-48]",
    },
)
