"""Record of the recurrence unit."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import LONG, log_lengths, short_lengths, spread_angles
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.cosines.recurrence import RECURRENCE_FORMS, Recurrence
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.spans import pixels_of
from blysk.hdl.cosines.recurrence import RecurrenceUnit

__all__ = ["MEASURED", "RECORD", "spans_of"]

FUNCTIONS = ("diffuse", "highlight")


def _measure(rng, count, unit, shortcut=False):
    length = log_lengths(rng, max(count // 450, 8), 2)
    psi = np.radians(rng.permutation(spread_angles(rng, len(length), 90.0)))
    psi[2:4] = np.pi / 2  # The longest spans are also the widest.
    step = psi / (length - 1)
    phase = rng.uniform(-np.pi, np.pi, len(length))
    amplitude = rng.uniform(0, 1 - 2.0**-16, len(length))
    # The shortcut is cos d = 1 - (1 - cos psi)/(m - 1)^2. The sine of psi/2 gives d without loss of digits.
    taken = 2 * np.arcsin(np.sin(psi / 2) / (length - 1)) if shortcut else step
    states = unit.states(*unit.start(amplitude, phase, step), *unit.coefficient(taken), int(length.max()))
    k = np.arange(len(states.codes))[:, np.newaxis]
    inside = k < length
    exact = formula = (amplitude * np.cos(phase - k * step))[inside]
    if shortcut:
        first, second = (amplitude * np.cos(phase - n * step) for n in (0, 1))
        rise = second - first + 2 * first * np.square(np.sin(taken / 2))
        ratio = k * np.sinc(k * taken / np.pi) / np.sinc(taken / np.pi)
        # In a wide span the formula gives up to 1.1. The word of a result does not hold 1.1.
        limit = unit.result_format.max_code * unit.result_format.step
        formula = np.clip((first * np.cos(k * taken) + rise * ratio)[inside], -1, limit)
    pixel = np.broadcast_to(k, inside.shape)[inside]
    return Sample(unit.result(states).values[inside], exact, formula, pixel)


def _expect(unit, case):
    p, beats = unit.model, case.beats
    span, pixel = pixels_of(beats["length"])
    coefficient = Fixed(p.coefficient_format, beats["coefficient"])
    shift = beats.get("shift", np.zeros_like(beats["length"]))
    expected = {}
    for name in FUNCTIONS:
        start = (Fixed(p.state_format, beats[name][word]) for word in ("first", "second"))
        expected[name] = p.compute(*start, coefficient, shift, span, pixel).codes
    return {**expected, "last": (pixel == beats["length"][span] - 1).astype(np.uint8)}


def _beats(unit, starts, coefficient, shift, length) -> dict:
    beats = {"coefficient": coefficient, "length": length}
    if unit.model.form == "reinsch":
        beats["shift"] = shift
    return beats | {
        name: dict(zip(("first", "second"), words, strict=True))
        for name, words in zip(FUNCTIONS, starts, strict=True)
    }


def spans_of(unit: RecurrenceUnit, rng: np.random.Generator, length: np.ndarray) -> Case:
    """Input of spans of given lengths and angles up to 89 degrees. Their words do not wrap."""
    p, count = unit.model, len(length)
    step = np.radians(rng.uniform(0, 89, count)) / np.maximum(length - 1, 1)
    coefficient, shift = p.coefficient(step)
    starts = [
        [word.codes for word in p.start(rng.uniform(-1, 1, count), rng.uniform(-np.pi, np.pi, count), step)]
        for _ in FUNCTIONS
    ]
    return Case(_beats(unit, starts, coefficient.codes, shift, length))


def _spans(unit, rng, count):
    """Spans up to 89 degrees, whose words do not wrap. Most are short, and some have no pixel."""
    return spans_of(unit, rng, short_lengths(rng, count))


def _words(unit, rng, count):
    """Spans of 0 to 39 pixels. Every third span has random codes, and every 15th span has extreme codes."""
    beats = spans_of(unit, rng, rng.integers(0, 40, count // 20)).beats
    any_size = np.arange(0, len(beats["length"]), 3)
    p = unit.model
    format = p.coefficient_format
    beats["coefficient"][any_size] = rng.integers(format.min_code, format.max_code + 1, len(any_size))
    if "shift" in beats:
        beats["shift"][any_size] = rng.integers(0, 1 << p.SHIFT_BITS, len(any_size))
    format = p.state_format
    for name in FUNCTIONS:
        for word in beats[name].values():
            word[any_size] = rng.integers(format.min_code, format.max_code + 1, word[any_size].shape)
            word[any_size[::5]] = rng.choice([format.min_code, format.max_code], word[any_size[::5]].shape)
    return Case(beats)


def _longest(unit, rng, count):
    """Spans of the largest length."""
    return spans_of(unit, rng, np.full(count // 4095, 4095))


def _borders(unit, rng, count):
    """Spans of nearly no angle, at the border of a rounding. One step of a state changes the result."""
    p, length = unit.model, np.full(count // 12, 12)
    cut = p.state_format.fraction_bits - p.result_format.fraction_bits
    starts = []
    for _ in FUNCTIONS:
        difference = rng.choice([-1, 1], len(length)) << rng.integers(0, 8, len(length))
        border = rng.integers(-(1 << 17), 1 << 17, len(length)) * (1 << cut) + (1 << (cut - 1))
        first = border - rng.integers(1, 12, len(length)) * difference - rng.integers(0, 2, len(length))
        starts.append([first, difference])
    return Case(_beats(unit, starts, np.zeros_like(length), np.full_like(length, 63), length))


MEASURED = [f"{form}{phases}" for form in RECURRENCE_FORMS for phases in ("", ", interleaved")]
"""Variants that the tables of errors show."""


def _variants():
    for name in (*MEASURED, "reinsch, shortcut"):
        form, _, rest = name.partition(", ")
        unit, shortcut = Recurrence(form, interleave=4 if rest == "interleaved" else 1), rest == "shortcut"
        yield (
            name,
            Variant(
                partial(RecurrenceUnit, unit),
                partial(_measure, unit=unit, shortcut=shortcut),
                f"spans to 90 degrees, {LONG}",
                beat={"length": 64},
                note="the same unit, given cos d = 1 - (1 - cos psi)/(m - 1)^2" if shortcut else "",
                as_published=form == "direct" or shortcut,
                long=shortcut,
            ),
        )
    for name, unit in {
        "20 guard bits": Recurrence(guard_bits=20),
        "24 fraction bits": Recurrence("reinsch", 24, 20),
        "24 fraction bits, interleaved": Recurrence("reinsch", 24, 20, interleave=4),
        "25 bits of result, interleaved": Recurrence(interleave=4, result_format=SQ(2, 25)),
        "direct, 25 bits of result, interleaved": Recurrence("direct", interleave=4, result_format=SQ(2, 25)),
    }.items():
        yield name, Variant(partial(RecurrenceUnit, unit))


VARIANTS = dict(_variants())

RECORD = Record(
    name="recurrence",
    title="Two cosines of equally spaced angles by a recurrence",
    source="docs/theory/interpolation.md#recurrence; [T] 3.3, figure 3.5",
    variants=VARIANTS,
    expect=_expect,
    stimuli={
        "spans": Stimulus(_spans, 2000),
        "words": Stimulus(_words, 6000, variants=tuple(VARIANTS)),
        "longest spans": Stimulus(_longest, 6 * 4095, stalled=False, variants=tuple(MEASURED)),
        "borders of rounding": Stimulus(_borders, 1200, variants=tuple(MEASURED[:1])),
    },
    axis="pixel of the span",
    logarithmic=True,
    waivers={
        "result": "A state is at least -2. So in a negative state one of the two bits after the sign is 1.",
    }
    | dict.fromkeys(
        ("*_coarse", "*_product"),
        "The fault changes the register only while the output is stalled. Its word is 0, or has been read.",
    ),
    still={},
)
