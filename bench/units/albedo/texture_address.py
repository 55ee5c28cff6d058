"""Record of the texture address."""

from functools import partial

from blysk.bench.units.albedo.textures import any_descriptor, any_places, of_descriptor
from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.albedo.texel_memory import TexelMemory, TextureDescriptor
from blysk.golden.albedo.texture_address import TextureAddress
from blysk.golden.number.fixed import Fixed
from blysk.hdl.albedo.texture_address import TextureAddressUnit

__all__ = ["RECORD"]


def _expect(unit, case):
    p = unit.model
    descriptor = TextureDescriptor(**case.constants)
    coordinates = Fixed(p.coordinate_format, case.beats["coordinates"])
    address, weight = p.compute(descriptor, coordinates, case.beats["level"])
    return {"address": address, "weight": weight.codes}


def _case(unit, rng, count, largest):
    descriptor = any_descriptor(rng, largest, max(unit.model.memory.depth // 2, 1))
    codes, level = any_places(rng, unit.model, descriptor, count)
    level[::50] = rng.integers(0, 16, len(level[::50]))
    return Case({"coordinates": codes, "level": level}, of_descriptor(descriptor))


def _places(unit, rng, count):
    """Places over three images each way, their borders, and any; one descriptor of any size a run."""
    return _case(unit, rng, count, 10)


def _small(unit, rng, count):
    """The same of images of one to four texels a side."""
    return _case(unit, rng, count, 2)


RECORD = Record(
    name="texture_address",
    title="Addresses and weights of the four texels around a place",
    source="docs/theory/textures.md#addresses",
    variants={
        "": Variant(TextureAddressUnit, note="exact"),
        "nearest": Variant(partial(TextureAddressUnit, TextureAddress(bilinear=False)), note="exact"),
        "8 bits, large memory": Variant(
            partial(TextureAddressUnit, TextureAddress(TexelMemory(1 << 19), 8)), note="exact", long=True
        ),
    },
    expect=_expect,
    stimuli={
        "places": Stimulus(_places, 400, repeats=30),
        "small": Stimulus(_small, 300, stalled=False, repeats=20),
    },
    axis="",
)
