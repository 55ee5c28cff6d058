"""Memory contents: the memories of a drawing that hold a mesh, and their words."""

from dataclasses import dataclass

__all__ = ["MemoryContents"]


@dataclass(frozen=True)
class MemoryContents:
    """A memory of a drawing, with the words that it holds after power-up.

    Parameters
    ----------
    name : str
        Name of the memory.
    width, depth : int
        Bits of a word, and number of words.
    words : tuple of int
        The first words. All further words are 0.

    Raises
    ------
    ValueError
        If there are more words than the memory holds, or a word has more bits.
    """

    name: str
    width: int
    depth: int
    words: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if len(self.words) > self.depth:
            raise ValueError(f"{self.name} hold {self.depth} words, not {len(self.words)}")
        if self.words and not 0 <= min(self.words) <= max(self.words) < 1 << self.width:
            raise ValueError(f"a word of {self.name} has {self.width} bits")

    @property
    def word_bytes(self) -> int:
        """Number of bytes of a word."""
        return -(-self.width // 8)
