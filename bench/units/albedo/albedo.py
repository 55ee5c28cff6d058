"""Record of the albedo unit."""

from functools import partial

import numpy as np

from blysk.bench.units.albedo.attribute_spans import quantised_spans
from blysk.bench.units.albedo.texel_memory import loaded_words
from blysk.bench.units.albedo.textures import any_texture, of_descriptor
from blysk.bench.units.operands import log_lengths, short_lengths
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.albedo.texel_memory import LoadedTextures, TexelMemory, TextureDescriptor
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.spans import pixels_of
from blysk.hdl.albedo.albedo import AlbedoUnit
from blysk.sim.frames.frame import attribute_beats

__all__ = ["RECORD", "any_attributes", "attributes_in"]

_MEMORY = TexelMemory(104)
"""A memory that has room for a texture of 16x16 texels and a small texture."""

_BOTH = Albedo(texture=TextureSampler(_MEMORY))
_TEXELS = Albedo(colors=False, texture=TextureSampler(_MEMORY), perspective=False)


def any_attributes(rng: np.random.Generator, model: Albedo, length: np.ndarray) -> SpanAttributes:
    """Attributes of spans of given lengths. An empty span gets the attributes of a span of 1 pixel."""
    return quantised_spans(rng, model.spans, np.maximum(length, 1))[0]


def attributes_in(model: Albedo, beats: np.ndarray) -> SpanAttributes:
    """Attributes of the spans that beats describe."""
    lines = []
    for member in ("start", "step"):
        words = beats[member]
        parts = [words[name] for name in ("colors", "coordinates") if name in words.dtype.names]
        weight = words["weight"].astype(np.int64) if model.perspective else None
        lines.append((np.column_stack(parts).astype(np.int64), weight))
    (start, weight_start), (step, weight_step) = lines
    names = ("exponent", "base", "range", "level") if model.texture else ("exponent",)
    exponent, *of_span = (beats[name].astype(np.int64) for name in names)
    return SpanAttributes(start, step, exponent, weight_start, weight_step, *of_span)


def _measure(rng, count):
    """Vertex colours along spans."""
    model, length = Albedo(), log_lengths(rng, max(count // 450, 16))
    spans, (left, right), (near, far) = quantised_spans(rng, model.spans, length)
    found = model.compute(spans, length, np.zeros(len(length), dtype=np.int64))
    span, index = pixels_of(length)
    t = (index / np.maximum(length - 1, 1)[span])[:, np.newaxis]
    near, far = (1 - t) * near[span, np.newaxis], t * far[span, np.newaxis]
    exact = (near * left[span] + far * right[span]) / (near + far)
    return Sample(found.values, exact, None, length[span][:, np.newaxis])


def _expect(unit, case):
    p, beats = unit.model, case.beats[case.beats["length"] > 0]
    spans, length = attributes_in(p, beats), beats["length"].astype(np.int64)
    textures = {}
    if p.texture is not None:
        loaded = LoadedTextures(loaded_words(p.texture.memory, case.write), ())
        textures = {"textures": [TextureDescriptor(**case.constants)], "texels": loaded}
    return p.compute(spans, length, np.zeros(len(length), dtype=np.int64), **textures).codes


def _spans(unit, rng, count):
    """Spans of every length, some empty, with any colours. Places are anywhere on any level of a texture."""
    p, length = unit.model, short_lengths(rng, count)
    beats = attribute_beats(unit.i.payload.shape(), any_attributes(rng, p, length))
    beats["length"] = length
    if p.texture is None:
        return Case(beats)
    textures = [any_texture(rng, largest) for largest in (4, 1)]
    loaded = p.texture.memory.load(textures)
    beats["level"] %= len(textures[0].levels)
    return Case(beats, of_descriptor(loaded.descriptors[0]), loaded.writes())


RECORD = Record(
    name="albedo",
    title="The colour of the surface at each pixel, from attributes of spans",
    source="docs/theory/textures.md",
    variants={
        "colours": Variant(AlbedoUnit, _measure, "depths to 1:16, 1 to 4095 pixels", beat={"length": 64}),
        "both": Variant(partial(AlbedoUnit, _BOTH)),
        "textures, orthographic, interval 3": Variant(partial(AlbedoUnit, _TEXELS, initiation_interval=3)),
        "both, interval 3": Variant(partial(AlbedoUnit, _BOTH, initiation_interval=3), long=True),
    },
    expect=_expect,
    stimuli={"spans": Stimulus(_spans, 1000, repeats=3)},
    axis="pixels of the span",
    logarithmic=True,
)
