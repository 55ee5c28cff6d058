"""Record of the transfer unit."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.lighting.transfer import Transfer
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.transfer import encode
from blysk.hdl.lighting.transfer import TransferUnit

__all__ = ["RECORD"]

FORMAT = Transfer.OPERAND_FORMAT


def _measure(rng, count):
    """Every input."""
    light = np.arange(FORMAT.max_code + 1)
    level = np.minimum(light * FORMAT.step, 255)
    found = Transfer().compute(Fixed(FORMAT, light)).astype(np.float64)
    return Sample(found, 255 * encode(level / 255), None, level)


def _expect(unit, case):
    names = "rgb"[: unit.channels]
    codes = [unit.model.compute(Fixed(FORMAT, case.beats[name])) for name in names]
    return dict(zip("rgb", codes * (3 // len(codes)), strict=True))


def _beats(rng, light):
    """Beats with the same values of light in each channel, in another order in each channel."""
    return Case({name: rng.permutation(light) for name in "rgb"})


def _octaves(unit, rng, count):
    """Light in every octave, and at both ends of each octave."""
    ends = 1 << np.arange(FORMAT.width)
    light = np.r_[0, ends, ends - 1, FORMAT.max_code, 2 ** rng.uniform(0, FORMAT.width, count)]
    return _beats(rng, light[:count].astype(np.int64))


def _every_input(unit, rng, count):
    """Every input of every channel."""
    return _beats(rng, np.arange(count))


def _variants():
    yield "", Variant(TransferUnit, _measure, "every input", "LSB", exhaustive=True)
    yield "interval 3", Variant(partial(TransferUnit, initiation_interval=3))
    yield "1 channel", Variant(partial(TransferUnit, channels=1), long=True)


RECORD = Record(
    name="transfer",
    title="The sRGB codes of a pixel, from linear light",
    source="docs/theory/textures.md#transfer; IEC 61966-2-1",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={
        "octaves": Stimulus(_octaves, 600),
        "every input": Stimulus(_every_input, FORMAT.max_code + 1, stalled=False),
    },
    axis="linear light, LSB",
)
