"""Memories whose words depend on the scene, and other words for them."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

from amaranth.lib.memory import Memory

__all__ = ["Contents", "contents_from", "scene_memory"]

Contents = Callable[[str, int, Sequence[int]], Sequence[int]]
"""Gives the words of a `scene_memory` from its name, the bits of a word, and the words of its scene."""

_CONTENTS: ContextVar[Contents | None] = ContextVar("contents", default=None)


@contextmanager
def contents_from(chosen: Contents) -> Iterator[None]:
    """Within the block, the memories of `scene_memory` in components that are elaborated get other words.

    Parameters
    ----------
    chosen : callable
        Gives the words. There are as many words as in the memory.
    """
    token = _CONTENTS.set(chosen)
    try:
        yield
    finally:
        _CONTENTS.reset(token)


def scene_memory(name: str, width: int, depth: int, words: Sequence[int]) -> Memory:
    """Memory whose words after power-up depend on the scene. In an FPGA they may be replaced later.

    Parameters
    ----------
    name : str
        Name, which no other such memory of the design has.
    width, depth : int
        Bits of a word, and number of words.
    words : sequence of int
        First words of the scene. All others are zeros. `contents_from` replaces all words.
    """
    if chosen := _CONTENTS.get():
        words = chosen(name, width, [*words, *[0] * (depth - len(words))])
    return Memory(shape=width, depth=depth, init=words)
