"""Record of the draw commands."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.video.draw_commands import KINDS, DrawCommands
from blysk.hdl.video.draw_commands import DrawCommandsUnit

__all__ = ["RECORD"]


def _lists() -> DrawCommands:
    """Seven lists of any commands. The third has only an end."""
    rng = np.random.default_rng(2026)
    rows, starts = [], []
    for size in (5, 12, 0, 1, 7, 2, 20):
        starts.append(len(rows))
        kinds = rng.integers(1, len(KINDS), size)
        rows += [[kind, *rng.integers(0, (512, 4096, 4096))] for kind in kinds]
        rows.append([0, 0, 0, 0])
    return DrawCommands(np.array(rows, dtype=np.int64), tuple(starts))


def _expect(unit, case):
    lists = unit.model
    walks = zip(case.beats["start"].tolist(), case.beats["first_band"].tolist(), strict=True)
    words = np.concatenate([lists.compute(start, bool(first)) for start, first in walks])
    return dict(zip(("kind", "index", "first", "count"), words.T, strict=True))


def _walks(unit, rng, count):
    """Lists in any order, some for the first band of a frame."""
    starts = np.array(unit.model.starts)
    return Case({"start": rng.choice(starts, count), "first_band": rng.integers(0, 2, count)})


RECORD = Record(
    name="draw_commands",
    title="Lists of commands, walked for every band",
    source="docs/theory/video.md#bands",
    variants={"seven lists": Variant(partial(DrawCommandsUnit, _lists()), note="exact")},
    expect=_expect,
    stimuli={"walks": Stimulus(_walks, 150)},
    axis="",
)
