"""Record of the texel memory."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.albedo.texel_memory import BANKS, LoadedTextures, TexelMemory
from blysk.hdl.albedo.texel_memory import TexelMemoryUnit

__all__ = ["RECORD", "loaded_words"]


def loaded_words(memory, write):
    """Codes of the banks after some writes, shape (depth, 4, 3)."""
    words = np.zeros((memory.depth, BANKS), dtype=np.int64)
    begins = np.flatnonzero(write["begins"])
    for first, end in zip(begins, np.r_[begins[1:], len(write["begins"])], strict=True):
        low, high = write["value"][first + 1 : end][: (end - first - 1) // 2 * 2].reshape(-1, 2).T
        at = 2 * int(write["value"][first]) * BANKS
        words.reshape(-1)[at : at + len(low)] = low | high << 18
    bits = memory.CHANNEL_BITS
    return words[..., np.newaxis] >> bits * np.arange(3) & ((1 << bits) - 1)


def _expect(unit, case):
    if unit.model.fixed is not None:
        return unit.model.read(unit.model.fixed, case.beats)
    return loaded_words(unit.model, case.write)[case.beats, np.arange(BANKS)]


def _requests(unit, rng, count):
    """Any addresses. Before, the whole memory is written, and then two places are written again.

    The writes of one of these places end with half a word.
    """
    depth = unit.model.depth
    values = [rng.integers(0, 1 << 18, 2 * BANKS * depth)]
    indices = [0, *rng.integers(0, depth // 2, 2).tolist()]
    values += [rng.integers(0, 1 << 18, size) for size in (7, 2 * BANKS)]
    value = np.concatenate([np.r_[index, of] for index, of in zip(indices, values, strict=True)])
    begins = np.concatenate([np.arange(len(of) + 1) == 0 for of in values]).astype(np.int64)
    return Case(rng.integers(0, depth, (count, BANKS)), write={"value": value, "begins": begins})


def _fixed(unit, rng, count):
    """Any addresses of a memory with fixed texels, also behind the last texel."""
    return Case(rng.integers(0, unit.model.depth, (count, BANKS)))


def _fixed_memory() -> TexelMemory:
    """A memory of 24 words, of which 20 are fixed texels."""
    codes = np.random.default_rng(2026).integers(0, 1 << TexelMemory.CHANNEL_BITS, (20, BANKS, 3))
    return TexelMemory(24, fixed=LoadedTextures(codes, ()))


RECORD = Record(
    name="texel_memory",
    title="Texels of four banks, a request a cycle",
    source="docs/theory/textures.md#memory",
    variants={
        "24 words": Variant(partial(TexelMemoryUnit, TexelMemory(24)), note="exact"),
        "1536 words": Variant(partial(TexelMemoryUnit, TexelMemory(1536)), note="exact", long=True),
        "fixed texels": Variant(partial(TexelMemoryUnit, _fixed_memory()), note="exact", long=True),
    },
    expect=_expect,
    stimuli={
        "requests": Stimulus(_requests, 300, variants=("24 words", "1536 words")),
        "fixed": Stimulus(_fixed, 300, variants=("fixed texels",)),
    },
    axis="",
    waivers={
        "nothing": "In a run writes come without gaps. A test of the unit has writes with gaps.",
        "read*": "Nothing is written while requests are inside, so the fault changes no answer.",
    },
)
