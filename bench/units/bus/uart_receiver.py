"""Record of the UART receiver."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.bus.uart_receiver import UartReceiver
from blysk.hdl.bus.uart_receiver import UartReceiverUnit

__all__ = ["RECORD"]

_WORST = 1.02
"""Length of a sender's bits, relative to the receiver's bits."""


def _lengths(model, length=1.0):
    """Cycles of each of ten bits, the last five of them longer by up to a cycle."""
    ends = np.floor(np.arange(11) * model.divisor * length / 16).astype(np.int64)
    return np.diff(ends)


def _case(unit, rng, count, length=1.0, breaks=0.0, glitches=0.0):
    lengths, levels = _lengths(unit.model, length), []
    while sum(map(len, levels)) < count:
        bits = np.r_[0, rng.integers(0, 2, 8), rng.random() >= breaks]
        # The first byte has no pause, so that a short run has a byte.
        pause = int(rng.integers(0, 3 * lengths[0])) if levels and rng.random() < 0.5 else 0
        line = np.repeat(bits, lengths)
        if levels and rng.random() < glitches:
            # Too short for the middle of a start bit.
            line = np.r_[0, np.ones(2 * lengths[0], dtype=np.int64)]
        levels.append(np.r_[np.ones(pause, dtype=np.int64), line])
    # The line is idle at the end, so that the last byte ends.
    return Case(np.concatenate([*levels, np.ones(12 * lengths[0], dtype=np.int64)]).astype(np.int64))


def _bytes(unit, rng, count):
    """Bytes, half of them with a pause before."""
    return _case(unit, rng, count)


def _long(unit, rng, count):
    """Bytes of a sender whose bits are 2 % longer."""
    return _case(unit, rng, count, _WORST)


def _short(unit, rng, count):
    """Bytes of a sender whose bits are 2 % shorter."""
    return _case(unit, rng, count, 2 - _WORST)


def _faults(unit, rng, count):
    """A fifth of the bytes without a stop bit, and zeros of one cycle in place of a fifth of the bytes."""
    return _case(unit, rng, count, breaks=0.2, glitches=0.2)


def _noise(unit, rng, count):
    """Levels at random, each for some cycles."""
    levels = np.repeat(rng.integers(0, 2, count), rng.integers(1, 9, count))[:count]
    start = _case(unit, rng, 1).beats
    return Case(np.concatenate([start, levels, np.ones(200, dtype=np.int64)]))


RECORD = Record(
    name="uart_receiver",
    title="Bytes of a serial line",
    source="docs/theory/bus.md#loader",
    variants={
        "55/16 cycles a bit": Variant(partial(UartReceiverUnit, UartReceiver(55)), note="exact"),
        "17.5 cycles a bit": Variant(partial(UartReceiverUnit, UartReceiver(280)), note="exact"),
    },
    expect=lambda unit, case: unit.model.compute(case.beats)[0],
    status=lambda unit, case: {"framing": unit.model.compute(case.beats)[1]},
    stimuli={
        "bytes": Stimulus(_bytes, 3000),
        "long": Stimulus(_long, 3000),
        "short": Stimulus(_short, 3000),
        "faults": Stimulus(_faults, 3000),
        "noise": Stimulus(_noise, 2000),
    },
    axis="",
    still={"a counter has room for more events than a run has": "count_framing[4-31]"},
)
