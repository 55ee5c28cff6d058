"""Parts that the records of all interpolators share: spans, operands by the model, errors."""

from functools import partial

import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.units.operands import (
    AXIS,
    any_pairs,
    component_words,
    degrees_between,
    light_constants,
    setup_spans,
    short_lengths,
    span_lengths,
    sphere,
    spread_angles,
    turned,
    unit_codes,
)
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.methods.interpolator import Interpolator, Operands
from blysk.golden.number.spans import pixels_of
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.hdl.methods.registry import unit_of
from blysk.sim.engines.beats import dtype_of

__all__ = [
    "SPAN",
    "STIMULI",
    "case_of",
    "expect",
    "long_lengths",
    "measured",
    "of_setup",
    "operand_beats",
    "options",
    "status",
]

SPAN = {"normal_left": AXIS, "normal_right": AXIS, "length": 64}
"""Input beat of the simulation that finds latency and interval."""

_GROUPS = 32
"""Number of lights of a measurement. The spans are divided into as many parts, with a light each."""


# Variants.


def _measure(rng, count, method):
    """N·L and 1 - N·H along spans. The dot product of two equal unit vectors counts as 1."""

    def samples():
        for length in np.array_split(span_lengths(rng, count), _GROUPS):
            spans = len(length)
            light, halfway = sphere(rng, 1), sphere(rng, 1)
            around = np.repeat(halfway, spans, axis=0)
            left = turned(rng, around, rng.permutation(spread_angles(rng, spans, 180.0)))
            angles = rng.permutation(spread_angles(rng, spans, min(method.MAX_ANGLE, 45.0)))
            left, right = quantise(left), quantise(turned(rng, left, angles))
            light, halfway = quantise(light), quantise(halfway)
            operands = method.compute(*component_words(left, right), length, *component_words(light, halfway))
            cosine, highlight = (
                operand.values[:, 0] / method.COSINE_OF_ZERO
                for operand in (operands.cosine, operands.highlight)
            )
            found = np.stack([cosine, 1 - highlight if method.operand == "cosine" else highlight])
            span, pixel = pixels_of(length)
            t = pixel / np.maximum(length - 1, 1)[span]
            left, right, light, halfway = (normalise(v / ONE) for v in (left, right, light, halfway))
            curve = method.exact_normals(left[span], right[span], t)
            exact, formula = (
                np.stack([normals @ light[0], 1 - normals @ halfway[0]])
                for normals in (interpolate("normalised", left[span], right[span], t), curve)
            )
            if method.uses_chord:
                formula[1] = np.square(curve - halfway[0]).sum(axis=-1) / 2
            kept = ~operands.out_of_range[span]
            angle = degrees_between(left * ONE, right * ONE)[span[kept], 0]
            yield Sample(found[:, kept], exact[:, kept], formula[:, kept], angle)

    return Sample.joined(samples())


def measured(method: Interpolator, note: str = "", **facts) -> Variant:
    """Variant of a method for one light, with its errors.

    Parameters
    ----------
    method : Interpolator
        Bit-accurate model.
    note : str
        Further remark.
    **facts
        Further fields of `Variant`.
    """
    return Variant(
        partial(unit_of(method), method, 1),
        partial(_measure, method=method),
        f"spans to {min(method.MAX_ANGLE, 45):g} degrees, 1 to 4095 pixels",
        beat=SPAN,
        note=f"errors of N.L and 1 - N.H; normalised interpolation counts as exact{note}",
        **facts,
    )


def options(method: Interpolator, lights: int = 1, *, as_published: bool = False, **build) -> Variant:
    """Variant of a method with other options, which the long run simulates.

    Parameters
    ----------
    method : Interpolator
        Bit-accurate model.
    lights : int
        Number of lights.
    as_published : bool
        See `Variant`.
    **build
        Options of `InterpolatorUnit`.
    """
    unit = partial(unit_of(method), method, lights, **build)
    return Variant(unit, as_published=as_published, long=True)


# Expected results.


def operand_beats(unit: Component, operands: Operands, **others: np.ndarray) -> np.ndarray:
    """Output beats of a unit with these operands. ``others`` has the codes of further fields."""
    beats = np.zeros(operands.cosine.codes.shape, dtype_of(unit.o.payload.shape().elem_shape))
    for name in beats.dtype.names:
        if name == "factor":
            # Lights that do not fade have the factor 0.
            beats[name][:, list(unit.factors)] = operands.factor.codes
        else:
            beats[name] = others[name] if name in others else getattr(operands, name).codes
    return beats


def _operands(unit: Component, case: Case) -> Operands:
    beats = case.beats
    ends = component_words(beats["normal_left"], beats["normal_right"])
    vectors = component_words(case.constants["direction"], case.constants["halfway"])
    return unit.model.compute(*ends, beats["length"], *vectors)


def expect(unit: Component, case: Case) -> np.ndarray:
    """Operands of every pixel by the bit-accurate model."""
    return operand_beats(unit, _operands(unit, case))


def status(unit: Component, case: Case) -> dict[str, int]:
    """Number of spans that the model flags as out of range."""
    return {"out_of_range": int(np.count_nonzero(_operands(unit, case).out_of_range))}


# Stimuli.


def case_of(
    unit: Component, rng: np.random.Generator, left: np.ndarray, right: np.ndarray, length: np.ndarray
) -> Case:
    """Spans between given normals, with lights on any side. H of the first light is one of the normals."""
    length = np.maximum(length % (1 << unit.length_bits), 1)
    direction, halfway = (unit_codes(rng, unit.lights) for _ in range(2))
    halfway[0] = left[len(left) // 2]
    beats = {"normal_left": left, "normal_right": right, "length": length}
    return Case(beats, light_constants(unit, direction, halfway))


def _spans(unit, rng, count):
    """Normals at angles of every size. Every sixteenth pair has any codes. Most spans are short."""
    length = short_lengths(rng, count, 1)
    return case_of(unit, rng, *any_pairs(rng, len(length)), length)


def _angles(unit, rng, count):
    """Short spans with equal normals, with angles up to the largest and over it, and with extreme codes."""
    largest = min(unit.model.MAX_ANGLE, 179)
    spans = setup_spans(rng, count, largest, largest)
    return case_of(unit, rng, spans["normal_left"], spans["normal_right"], rng.integers(1, 8, count))


def long_lengths(rng: np.random.Generator, pixels: int) -> np.ndarray:
    """Lengths of spans of about ``pixels`` pixels in all.

    Every span of 3000 to 4095 pixels is followed by a shorter span.
    """
    length = rng.integers(3000, 4096, (pixels // 3800, 2))
    length[:, 1] = np.floor(2000 ** rng.random(len(length)))
    length[:2, 0] = 4095
    return length.ravel()


def _long_spans(unit, rng, count):
    """Spans of 3000 to 4095 pixels in range, in which last bits of differences count; and shorter spans."""
    length = long_lengths(rng, count)
    left = sphere(rng, len(length))
    angles = unit.model.MAX_ANGLE * 10.0 ** rng.uniform(-3, 0, len(length))
    return case_of(unit, rng, quantise(left), quantise(turned(rng, left, angles)), length)


def _last_bits(unit, rng, count):
    """Many short spans, because a last bit changes a rounded result only once in thousands."""
    left = sphere(rng, count)
    angles = unit.model.MAX_ANGLE * rng.choice([10.0 ** rng.uniform(-5, 0, count), rng.random(count)])
    return case_of(unit, rng, quantise(left), quantise(turned(rng, left, angles)), rng.integers(1, 8, count))


def _of_setup(unit, rng, count, *, make):
    """The corner cases of the setup, in short spans."""
    case = make(unit, rng, count)
    case.beats["length"][:] = rng.integers(1, 8, len(case.beats["length"]))
    return case


def of_setup(record: Record, count: int = 500) -> Stimulus:
    """The stimulus ``corners`` of a setup's record, for a unit with the same input.

    Parameters
    ----------
    record : Record
        Record of the setup.
    count : int
        Number of spans.
    """
    return Stimulus(partial(_of_setup, make=record.stimuli["corners"].make), count, repeats=6)


STIMULI: dict[str, Stimulus] = {
    "spans": Stimulus(_spans, 2000),
    "angles": Stimulus(_angles, 500),
    "long spans": Stimulus(_long_spans, 60_000, stalled=False),
    "last bits": Stimulus(_last_bits, 4000, stalled=False),
}
"""Stimuli of every method that takes normals."""
