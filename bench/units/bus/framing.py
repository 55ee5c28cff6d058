"""Record of the framing of streams."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from blysk.bench.units.geometry.geometry import RECORD as GEOMETRY
from blysk.bench.units.pipeline import RECORD as SHADER
from blysk.bench.units.record import PAUSED, Case, Record, Stimulus, Variant, first, length_of, together
from blysk.bench.units.render import RECORD as RENDER
from blysk.golden.presets import preset
from blysk.hdl.bus.framing import FramingUnit

__all__ = ["RECORD"]

_RECORDS = {"span": SHADER, "frame": GEOMETRY, "run": RENDER}


def _core_cases(unit, case) -> list[Case]:
    """Input of the core inside a unit, a case for each frame. A frame does not depend on earlier frames."""
    data = np.asarray(case.beats["data"], dtype=np.uint8)
    beats = unit.model.given.unpack(data)
    ends = [*np.flatnonzero(case.beats["last"][:-1]) + 1, len(data)]
    constants = case.constants and {name: code for name, code in case.constants.items() if name != "keep"}
    return [
        replace(case, beats={name: codes[begin:end] for name, codes in beats.items()}, constants=constants)
        for begin, end in pairwise([0, *ends])
    ]


def _expect(unit, case):
    record = _RECORDS[unit.packets]
    frames = [record.expect(unit.core, each) for each in _core_cases(unit, case)]
    frame = np.repeat(np.arange(len(frames)), [length_of(each) for each in frames])
    made = unit.model.compute(together(frames), frame)
    # The last beat of a frame that has not ended is held back.
    begun = np.count_nonzero(case.beats["last"]) if not case.beats["last"][-1] else -1
    return first(made, len(frame) - int(len(frame) > 0 and frame[-1] == begun))


def _status(unit, case):
    record = _RECORDS[unit.packets]
    ended = int(np.count_nonzero(case.beats["last"]))
    misfits = int(np.count_nonzero(~unit.model.given.fits(np.asarray(case.beats["data"], np.uint8))))
    mine = {"frames": ended, "misfits": misfits, "busy": int(not case.beats["last"][-1])}
    counts = [record.status(unit.core, each) for each in _core_cases(unit, case)]
    # `overrun` is a flag. The other members are counters.
    flags = {"overrun": max}
    return {name: flags.get(name, sum)([each[name] for each in counts]) for name in counts[0]} | mine


def _case(unit, rng, count, length):
    record = _RECORDS[unit.packets]
    # For spans the stimulus counts pixels.
    count *= 10 if unit.packets == "span" else 1
    inner = next(iter(record.stimuli.values())).make(unit.core, rng, count)
    if unit.packets == "run":
        constants = {name: code for name, code in inner.constants.items() if name != "picture"}
        inner = replace(inner, constants=constants | {"keep": 0})
    data = unit.model.given.pack(unit.model.given.columns(inner.beats))
    ends = np.cumsum(rng.integers(1, 2 * length, len(data) + 1)) - 1
    last = np.isin(np.arange(len(data)), ends)
    # The last beat of the run, and of the run with pauses, ends a frame.
    last[[-1, min(PAUSED, len(last)) - 1]] = True
    return replace(inner, beats={"data": data, "last": last.astype(int)})


def _frames(unit, rng, count):
    """Frames of 1 to 47 beats. Some frames have no output."""
    return _case(unit, rng, count, 24)


def _short(unit, rng, count):
    """Frames of 1 to 3 beats."""
    return _case(unit, rng, count, 2)


def _misfits(unit, rng, count):
    """Frames in which a third of the beats have an inverted bit in any byte."""
    case = _frames(unit, rng, count)
    # The last beat of a run is not changed, so that every run ends with a beat.
    data = case.beats["data"]
    chosen = rng.random(len(data)) < 0.3
    chosen[[-1, min(PAUSED, len(data)) - 1]] = False
    byte, bit = rng.integers(0, data.shape[1], len(data)), rng.integers(0, 8, len(data))
    data[chosen, byte[chosen]] ^= (1 << bit[chosen]).astype(np.uint8)
    return case


def _variants():
    yield "shader", Variant(partial(FramingUnit, preset(model="cosquad", lights=0)))
    design = preset("linear", "cosquad", x_bits=5, y_bits=5)
    yield "render", Variant(partial(FramingUnit, design.built(top="render"), size=(32, 24)), long=True)
    yield "geometry", Variant(partial(FramingUnit, design.built(top="geometry")), long=True)


RECORD = Record(
    name="framing",
    title="A core between streams of bytes, with the borders of frames",
    source="docs/theory/bus.md#streams",
    variants=dict(_variants()),
    expect=_expect,
    status=_status,
    stimuli={
        "frames": Stimulus(_frames, 200),
        "short": Stimulus(_short, 60, repeats=2),
        "misfits": Stimulus(_misfits, 100),
    },
    axis="",
    remembers=True,
    still={
        "a coordinate has 12 bits in two bytes, and the byte after the colours is empty": (
            "top.{spare,word}[12-15] top.{spare,word}[28-31] top.{spare,word}[56-63]"
        ),
        "without lights the colour is a constant of the run": ("top.{spare,word}[32-55] held_back[24-47]"),
        "a counter has room for more events than a run has": "count_frames[5-31] count_misfits[3-31]",
    },
)
