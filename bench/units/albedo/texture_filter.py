"""Record of the texture filter."""

from functools import partial

import numpy as np

from blysk.bench.units.operands import any_codes
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_filter import TextureFilter
from blysk.golden.number.fixed import UQ, Fixed
from blysk.hdl.albedo.texture_filter import TextureFilterUnit

__all__ = ["RECORD"]

_TEXEL = UQ(TexelMemory.CHANNEL_BITS, 0)


def _weights(model, rng, count):
    """Codes of weights. A quarter of the weights are 0 or 1."""
    one = 1 << model.share_bits * model.bilinear
    weight = rng.integers(0, one + 1, (count, 2))
    return np.where(rng.random(weight.shape) < 0.25, one * rng.integers(0, 2, weight.shape), weight)


def _measure(rng, count):
    model = TextureFilter()
    texels, weight = any_codes(rng, _TEXEL, count, 4, 3), _weights(model, rng, count)
    across, down = weight.T[:, :, np.newaxis] * 2.0**-model.share_bits
    linear = TexelMemory.linear(texels).transpose(1, 0, 2)
    rows = [a + (b - a) * across for a, b in (linear[:2], linear[2:])]
    exact = rows[0] + (rows[1] - rows[0]) * down
    found = model.compute(texels, Fixed(UQ(1, model.share_bits), weight)).values
    return Sample(found, exact, exact, exact)


def _expect(unit, case):
    p = unit.model
    format = UQ(1, p.share_bits if p.bilinear else 0)
    return p.compute(case.beats["texels"], Fixed(format, case.beats["weight"])).codes


def _texels(unit, rng, count):
    """Any texels and weights. Some texels are equal. Some texels, and some weights, are 0 or 1."""
    texels = any_codes(rng, _TEXEL, count, 4, 3)
    texels[::4] = rng.choice([0, _TEXEL.max_code], texels[::4].shape)
    texels[1::8] = texels[1::8, :1]
    return Case({"texels": texels, "weight": _weights(unit.model, rng, count)})


RECORD = Record(
    name="texture_filter",
    title="Mean of four texels by two weights",
    source="docs/theory/textures.md#filter",
    variants={
        "": Variant(TextureFilterUnit, _measure, "any texels and weights"),
        "interval 3": Variant(partial(TextureFilterUnit, initiation_interval=3)),
        "nearest": Variant(partial(TextureFilterUnit, TextureFilter(bilinear=False))),
        "8 bits, interval 9": Variant(partial(TextureFilterUnit, TextureFilter(8), 9), long=True),
    },
    expect=_expect,
    stimuli={"texels": Stimulus(_texels, 2000)},
    axis="exact colour",
)
