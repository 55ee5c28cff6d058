"""Record of the serialiser."""

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.hdl.video.serialiser import SerialiserUnit

__all__ = ["RECORD"]


def _words(unit, rng, count):
    """Random words in every lane."""
    return Case(rng.integers(0, 1024, (count, unit.model.lanes)))


RECORD = Record(
    name="serialiser",
    title="Words of four lanes as pairs of bits",
    source="docs/theory/video.md#tmds",
    variants={"": Variant(SerialiserUnit, note="exact")},
    expect=lambda unit, case: unit.model.compute(case.beats),
    stimuli={"words": Stimulus(_words, 400)},
    axis="",
)
