"""Record of the recurrence interpolator."""

import numpy as np

from blysk.bench.units.cosines.recurrence_setup import RECORD as SETUP
from blysk.bench.units.methods.interpolator import (
    STIMULI,
    case_of,
    expect,
    measured,
    of_setup,
    options,
    status,
)
from blysk.bench.units.operands import code_pairs_at, unit_codes, word_ends
from blysk.bench.units.record import Record, Stimulus
from blysk.golden.methods.recurrence_interpolator import PUBLISHED, RecurrenceInterpolator

__all__ = ["RECORD"]

_RECURRENCE = RecurrenceInterpolator()


def _words(unit, rng, count):
    """L and H of extreme codes. Results saturate, and must not change a later span."""
    ends = word_ends(rng, 2, count, 3)
    ends[:, ::2] = unit_codes(rng, 2 * len(ends[0, ::2])).reshape(2, -1, 3)
    case = case_of(unit, rng, *ends, rng.integers(1, 20, count))
    case.constants["direction"], case.constants["halfway"] = (
        word_ends(rng, unit.lights, 3) for _ in range(2)
    )
    return case


def _radian(unit, rng, count):
    """Spans of one radian. Half of the square of the angle is 1/2. Rounding makes some words 1."""
    return case_of(unit, rng, *code_pairs_at(rng, count, np.degrees(1)), rng.integers(1, 20, count))


RECORD = Record(
    name="recurrence_interpolator",
    title="Cosines at equal steps on the great circle, one product for each cosine",
    source="docs/theory/interpolation.md#recurrence; [T] 3.3, figure 3.5",
    variants={
        "recurrence": measured(_RECURRENCE),
        "recurrence, interval 1": options(_RECURRENCE, 2, setup_interval=1),
        "recurrence, interval 46, no highlights": options(_RECURRENCE, setup_interval=46, highlights=False),
        **{method.name: options(method, as_published=True) for method in PUBLISHED},
    },
    expect=expect,
    status=status,
    stimuli=STIMULI
    | {
        "corners": of_setup(SETUP),
        "words": Stimulus(_words, 200, repeats=2),
        "radian": Stimulus(_radian, 300, stalled=False),
    },
    waivers=SETUP.waivers
    | {
        "phase_entry": (
            "The fault changes the register only while the output is stalled. By then all fields of its word "
            "have been read, except the value."
        ),
        "recurrence_0.*": "The signal marks the last pixel of a span. Nothing reads this signal.",
    },
    still={
        "a cosine has ten fraction bits less than x": "top.{spare,payload}[0-9] top.{spare,payload}[368-377]",
    },
)
