"""The block RAMs of a routed design that hold a scene, and their words in a configuration in text.

A build gives each memory of the scene random words in place of its own. So mapping, placement and routing do
not depend on the scene, and nothing is optimised for its words. Each column of bits is unique. So the routed
configuration shows which block RAM holds which bits of which memory. ``ecpbram`` finds blocks in the same
way, but for one memory at a time, and only while they hold its random words.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

__all__ = [
    "Block",
    "MemoryMap",
    "ScenePatterns",
    "blocks_of_netlist",
    "carried",
    "carrying",
    "changed_words",
    "memory_words",
    "packed",
    "unpacked",
    "without_words",
]

_SHAPES = {36: 512, 18: 1024, 9: 2048, 4: 4096, 2: 8192, 1: 16384}
"""Words of a block RAM by their width in bits."""

_NINES = 2048
"""Words of 9 bits of a block RAM in a configuration."""

_KEY = 64
"""Bits at the start of a column by which it is found. The other bits are compared afterwards."""

_COMMENT = ".comment blysk "

_INIT = re.compile(r"^\.bram_init (\d+)\n((?:[0-9a-f ]+\n)+)", re.MULTILINE)


def unpacked(words: Sequence[int], width: int) -> np.ndarray:
    """Bits of words: bool array, shape (words, width), the lowest bit first."""
    size = -(-width // 8)
    rows = np.frombuffer(b"".join(word.to_bytes(size, "little") for word in words), dtype=np.uint8)
    return np.unpackbits(rows.reshape(-1, size), axis=1, count=width, bitorder="little").astype(bool)


def packed(bits: np.ndarray) -> list[int]:
    """Words of `unpacked` bits."""
    return [int.from_bytes(row.tobytes(), "little") for row in np.packbits(bits, axis=1, bitorder="little")]


def changed_words(old: Sequence[int], new: Sequence[int]) -> int:
    """Number of words that differ."""
    return sum(a != b for a, b in zip(old, new, strict=True))


@dataclass
class ScenePatterns:
    """Random words for the memories of a scene, for `contents_from`. It keeps the words of the scene.

    Attributes
    ----------
    words : dict of str to (int, list of int)
        Width and words of each memory of the scene, by name.
    """

    words: dict[str, tuple[int, list[int]]] = field(default_factory=dict)

    def __call__(self, name: str, width: int, words: Sequence[int]) -> list[int]:
        """Random words in place of the scene's. They depend on name, width and number alone."""
        if name in self.words:
            raise ValueError(f"two memories have the name {name}")
        self.words[name] = width, list(words)
        return packed(self.bits(name))

    def bits(self, name: str) -> np.ndarray:
        """Bits of a memory's random words."""
        width, words = self.words[name]
        return np.random.default_rng(list(name.encode())).random((len(words), width)) < 0.5

    @property
    def contents(self) -> dict[str, list[int]]:
        """Words of the scene."""
        return {name: words for name, (_, words) in self.words.items()}


@dataclass(frozen=True)
class Block:
    """Place of a block RAM's words in a memory.

    Parameters
    ----------
    memory : str
        Name of the memory.
    first : int
        Address of its first word.
    columns : tuple of int
        For each bit of a word of the block, the bit of the memory's word, or -1.
    """

    memory: str
    first: int
    columns: tuple[int, ...]

    @property
    def width(self) -> int:
        """Bits of a word of the block."""
        return len(self.columns)

    @property
    def place(self) -> tuple[slice, list[int], list[int]]:
        """Addresses in the memory, bits of the memory's word, and the block's bits with these values."""
        used = [bit for bit, column in enumerate(self.columns) if column >= 0]
        return slice(self.first, self.first + _SHAPES[self.width]), [self.columns[bit] for bit in used], used


@dataclass(frozen=True)
class MemoryMap:
    """Where a routed configuration keeps the memories of its scene.

    Parameters
    ----------
    sizes : dict of str to (int, int)
        Number of words and width of each memory, by name.
    blocks : dict of str to Block
        Block RAMs, by their numbers in the configuration.
    """

    sizes: dict[str, tuple[int, int]]
    blocks: dict[str, Block]

    @classmethod
    def found(cls, blocks: Mapping[str, np.ndarray], patterns: ScenePatterns) -> "MemoryMap":
        """The map of block RAMs that hold the random words of a scene's memories.

        Parameters
        ----------
        blocks : dict of str to int array
            Block RAMs as 2,048 words of 9 bits, by name.
        patterns : ScenePatterns
            The random words.

        Raises
        ------
        ValueError
            If block RAMs do not hold every bit of a memory. The message names the memory.
        """
        bits = {name: patterns.bits(name) for name in patterns.words}
        keys = {
            array[start : start + _KEY, column].tobytes(): (name, start, column)
            for name, array in ((name, np.pad(of, ((0, _KEY), (0, 0)))) for name, of in bits.items())
            for start in range(0, len(bits[name]), min(_SHAPES.values()))
            for column in range(array.shape[1])
        }
        found = {}
        covered = {name: np.zeros_like(array) for name, array in bits.items()}
        for number, words in blocks.items():
            block = _placed(words, bits, keys)
            if block is not None:
                found[number] = block
                rows, columns, _ = block.place
                covered[block.memory][rows, columns] = True
        for name, array in covered.items():
            if not array.all():
                raise ValueError(f"{(~array).sum():,} bits of the memory of {name} are not in block RAM")
        return cls({name: array.shape for name, array in bits.items()}, found)

    def replaced(self, configuration: str, contents: Mapping[str, Sequence[int]]) -> str:
        """The configuration with other words in its memories.

        Raises
        ------
        ValueError
            If there are more or fewer words than a memory has.
        """
        bits = {}
        for name, (depth, width) in self.sizes.items():
            if len(contents[name]) != depth:
                raise ValueError(f"the memory of {name} has {depth:,} words, not {len(contents[name]):,}")
            bits[name] = unpacked(contents[name], width)

        def text(match: re.Match[str]) -> str:
            block = self.blocks.get(match[1])
            if block is None:
                return match[0]
            rows, columns, used = block.place
            given = bits[block.memory][rows, columns]
            array = np.zeros((_SHAPES[block.width], block.width), dtype=bool)
            array[: len(given), used] = given
            words = [f"{word:03x}" for word in _nines(array)]
            lines = (" ".join(words[k : k + 8]) for k in range(0, _NINES, 8))
            return f".bram_init {match[1]}\n" + "".join(f"{line}\n" for line in lines)

        return _INIT.sub(text, configuration)

    def contents(self, configuration: str) -> dict[str, list[int]]:
        """Words of the memories in a configuration."""
        bits = {name: np.zeros(size, dtype=bool) for name, size in self.sizes.items()}
        arrays = memory_words(configuration)
        for number, block in self.blocks.items():
            rows, columns, used = block.place
            array = bits[block.memory]
            array[rows, columns] = _bits(arrays[number], block.width)[: len(array[rows]), used]
        return {name: packed(array) for name, array in bits.items()}

    def to_json(self) -> dict[str, Any]:
        """The map for a JSON text."""
        rows = {number: [block.memory, block.first, *block.columns] for number, block in self.blocks.items()}
        return {"sizes": self.sizes, "blocks": rows}

    @classmethod
    def from_json(cls, given: Mapping[str, Any]) -> "MemoryMap":
        """The map of `to_json`."""
        blocks = {number: Block(row[0], row[1], tuple(row[2:])) for number, row in given["blocks"].items()}
        return cls({name: (depth, width) for name, (depth, width) in given["sizes"].items()}, blocks)


def _placed(words: np.ndarray, bits: Mapping[str, np.ndarray], keys: Mapping[bytes, Any]) -> Block | None:
    """The memory, address and columns of a block RAM's words, in the one width in which they are found."""
    for width in _SHAPES:
        array = _bits(words, width)
        matches = [keys.get(array[:_KEY, bit].tobytes()) for bit in range(width)]
        there = [match for match in matches if match is not None]
        if not there:
            continue
        (name, first, _), *_ = there
        columns = tuple(-1 if match is None else match[2] for match in matches)
        block = Block(name, first, columns)
        rows, of, used = block.place
        given = bits[name][rows, of]
        expected = np.zeros_like(array)
        expected[: len(given), used] = given
        same = {match[:2] for match in there} == {(name, first)}
        if same and (array == expected).all():
            return block
    return None


def memory_words(configuration: str) -> dict[str, np.ndarray]:
    """Words of 9 bits of the block RAMs of a configuration in text, by their numbers."""
    found = _INIT.finditer(configuration)
    return {match[1]: np.array([int(word, 16) for word in match[2].split()]) for match in found}


def without_words(configuration: str) -> str:
    """A configuration in text without the words of its block RAMs."""
    return _INIT.sub("", configuration)


def carrying(configuration: str, given: Mapping[str, Any]) -> str:
    """A configuration in text with a comment that its bitstream carries."""
    device, end, rest = configuration.partition("\n")
    return f"{device}{end}{_COMMENT}{json.dumps(given)}\n{rest}"


def carried(configuration: str) -> dict[str, Any] | None:
    """What `carrying` wrote, or ``None``."""
    found = re.search(rf"^{re.escape(_COMMENT)}(.*)$", configuration, re.MULTILINE)
    if found is None:
        return None
    try:
        given: dict[str, Any] = json.loads(found[1])
    except ValueError:
        return None
    return given if isinstance(given, dict) else None


def blocks_of_netlist(netlist: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Words of 9 bits of the block RAMs of a netlist that Yosys mapped, by the names of the cells."""
    found = {}
    for name, cell in netlist["modules"]["top"]["cells"].items():
        if cell["type"] == "DP16KD":
            # Each of 64 parameters has 16 words of 18 bits, each with two bits of padding.
            texts = (cell["parameters"].get(f"INITVAL_{k:02X}", "") for k in range(64))
            values = [int(re.sub("[^01]", "0", text) or "0", 2) for text in texts]
            found[name] = np.array(
                [
                    value >> (20 * word + 9 * half) & 511
                    for value in values
                    for word in range(16)
                    for half in (0, 1)
                ]
            )
    return found


def _bits(words: np.ndarray, width: int) -> np.ndarray:
    """Bits of a block RAM's 2,048 words of 9 bits, as words of ``width`` bits."""
    bits = (words[:, np.newaxis] >> np.arange(9) & 1).astype(bool)
    # Narrow words leave the ninth bit out.
    return (bits if width >= 9 else bits[:, :8]).reshape(-1, width)


def _nines(bits: np.ndarray) -> list[int]:
    """Words of 9 bits of `_bits`."""
    rows = bits.reshape(_NINES, -1)
    found: list[int] = (rows << np.arange(rows.shape[1])).sum(axis=1).tolist()
    return found
