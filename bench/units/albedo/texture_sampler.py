"""Record of the texture sampler."""

from dataclasses import replace
from functools import partial

import numpy as np

from blysk.bench.units.albedo.texel_memory import loaded_words
from blysk.bench.units.albedo.textures import any_places, any_texture, of_descriptor
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.bench.units.sample import Sample
from blysk.golden.albedo.texel_memory import LoadedTextures, TexelMemory, TextureDescriptor
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.texture import Texture
from blysk.hdl.albedo.texture_sampler import TextureSamplerUnit

__all__ = ["RECORD"]

_MEMORY = TexelMemory(104)
"""A memory that has room for a texture of 16x16 texels and a small texture."""

_MODEL = TextureSampler(_MEMORY)


def _measure(rng, count, model):
    """Any texels of an image of 16x16, at exact coordinates."""
    texture = Texture(rng.random((16, 16, 3)), filter="bilinear" if model.bilinear else "nearest")
    loaded = _MEMORY.load([texture])
    codes, level = any_places(rng, model.address, loaded.descriptors[0], count)
    place = codes * 2.0**-model.share_bits / np.maximum(16 >> level, 1)[:, np.newaxis]
    found = model.sample(loaded, loaded.descriptors[0], Fixed(model.address.coordinate_format, codes), level)
    exact = texture.sample(place, level)
    return Sample(found.values, exact, None, exact)


def _expect(unit, case):
    p = unit.model
    coordinates = Fixed(p.address.coordinate_format, case.beats["coordinates"])
    loaded = LoadedTextures(loaded_words(p.memory, case.write), ())
    return p.sample(loaded, TextureDescriptor(**case.constants), coordinates, case.beats["level"]).codes


def _places(unit, rng, count):
    """Places up to three images away, centres and borders of texels, and any places.

    A run loads two textures of any size, and reads one of them.
    """
    textures = [any_texture(rng, largest) for largest in (4, 1)]
    loaded = unit.model.memory.load(textures)
    which = int(rng.random() < 0.2)
    descriptor = loaded.descriptors[which]
    codes, level = any_places(rng, unit.model.address, descriptor, count)
    level = np.minimum(level, len(textures[which].levels) - 1)
    return Case({"coordinates": codes, "level": level}, of_descriptor(descriptor), loaded.writes())


def _variants():
    models = {"": _MODEL, "interval 3": _MODEL, "nearest": replace(_MODEL, bilinear=False)}
    for name, model in models.items():
        unit = partial(TextureSamplerUnit, model, 3 if name == "interval 3" else 1)
        measure = partial(_measure, model=model)
        yield name, Variant(unit, measure, "any texels and places", long=bool(name))


RECORD = Record(
    name="texture_sampler",
    title="Colours of a texture at places of a surface",
    source="docs/theory/textures.md#texture-unit",
    variants=dict(_variants()),
    expect=_expect,
    stimuli={"places": Stimulus(_places, 400, repeats=10, pace=lambda unit: unit.initiation_interval)},
    axis="exact colour",
    still={
        "the memory inside takes three cycles, so the FIFO of weights is never full": (
            "weights_level[2] weights_room[0]"
        )
    },
)
