"""Record of the texture address."""

from dataclasses import replace
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


def _case(unit, rng, count, descriptor):
    codes, level = any_places(rng, unit.model, descriptor, count)
    level[::50] = rng.integers(0, 16, len(level[::50]))
    return Case({"coordinates": codes, "level": level}, of_descriptor(descriptor))


def _places(unit, rng, count):
    """Places up to three images away, centres and borders of texels, and any places.

    A run has one descriptor of any size.
    """
    return _case(unit, rng, count, any_descriptor(rng, unit.model.memory))


def _small(unit, rng, count):
    """Places on images of one to four texels a side."""
    return _case(unit, rng, count, any_descriptor(rng, unit.model.memory, 2))


def _strips(unit, rng, count):
    """Places on images of 1024 texels on one side, and one to four texels on the other side."""
    sides = rng.permutation([10, rng.integers(3)]).tolist()
    descriptor = any_descriptor(rng, unit.model.memory, 2)
    return _case(unit, rng, count, replace(descriptor, width=sides[0], height=sides[1]))


def _alone(unit, rng, count):
    """Places on images of a single level that fills the memory."""
    sides = min(unit.model.memory.address_bits + 2, 20)
    width = int(rng.integers(max(sides - 10, 1), min(sides, 11)))
    descriptor = any_descriptor(rng, unit.model.memory, 2)
    case = _case(unit, rng, count, replace(descriptor, width=width, height=sides - width, base=0))
    case.beats["level"][:] = 0
    return case


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
        "strips": Stimulus(_strips, 600, stalled=False, repeats=24),
        "alone": Stimulus(_alone, 300, stalled=False, repeats=12),
    },
    axis="",
    still={"the address after level 0 depends only on the constants of a run": "behind[0-10]"},
)
