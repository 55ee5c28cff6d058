"""Block RAMs of a configuration in text: found by random words, rewritten, read back."""

import json

import numpy as np
import pytest

from blysk.bench.tools.memory_map import (
    MemoryMap,
    ScenePatterns,
    blocks_of_netlist,
    carried,
    carrying,
    changed_words,
    memory_words,
    without_words,
)

HEAD = ".device LFE5U-25F\n\n.tile R1C1:PLC2\narc: A0 B0\n\n"


def nine_bits(bits, width):
    """Words of 9 bits of a block RAM: each holds one word of 9 bits, a part of a wider word, or, without its
    ninth bit, several narrower words."""
    words = [0] * 2048
    for address, row in enumerate(bits):
        for bit in range(width):
            if row[bit]:
                if width >= 9:
                    words[address * (width // 9) + bit // 9] |= 1 << bit % 9
                else:
                    place = address * width + bit
                    words[place // 8] |= 1 << place % 8
    return words


def section(number, words):
    """Text of a block RAM."""
    rows = (words[k : k + 8] for k in range(0, 2048, 8))
    return f".bram_init {number}\n" + "".join(" ".join(f"{word:03x}" for word in row) + "\n" for row in rows)


def laid_out(memories, width, shuffled):
    """Words of 9 bits of the block RAMs of memories, by number: blocks of one width, their bits shuffled."""
    depth = {36: 512, 18: 1024, 9: 2048, 4: 4096, 2: 8192, 1: 16384}[width]
    found, numbers = {}, iter(shuffled.permutation(200).tolist())
    for words, bits in memories:
        for first in range(0, len(words), depth):
            for low in range(0, bits, width):
                chosen = shuffled.permutation(range(low, min(low + width, bits)))
                rows = [[word >> int(bit) & 1 for bit in chosen] for word in words[first : first + depth]]
                rows = [row + [0] * (width - len(row)) for row in rows]
                found[next(numbers)] = nine_bits(rows, width)
    return found


def scene(sizes, seed=0):
    """Patterns of memories with random words of a scene."""
    random, patterns = np.random.default_rng(seed), ScenePatterns()
    replaced = {}
    for name, (depth, width) in sizes.items():
        words = [int.from_bytes(random.bytes(20), "little") % (1 << width) for _ in range(depth)]
        replaced[name] = patterns(name, width, words)
    return patterns, replaced


@pytest.mark.parametrize("width", [36, 18, 9, 4, 2, 1])
def test_words_are_found_replaced_and_read_back(width):
    """Each memory is in blocks of one shape, with its bits in any order. The last block is not full.

    The other block RAMs keep their words.
    """
    sizes = {"vertices": (600, 41), "triangles": (70, 30)} if width >= 9 else {"texels": (1500, 3)}
    patterns, random_words = scene(sizes)
    layout = [(random_words[name], bits) for name, (_, bits) in sizes.items()]
    shuffled = np.random.default_rng(1)
    blocks = laid_out(layout, width, shuffled) | {300: [5] * 2048, 301: [0] * 2048}
    text = HEAD + "\n".join(section(*block) for block in blocks.items())
    made = MemoryMap.found(memory_words(text), patterns)
    made = MemoryMap.from_json(json.loads(json.dumps(made.to_json())))
    assert made.blocks.keys() == {str(number) for number in blocks} - {"300", "301"}
    assert made.contents(text) == random_words
    filled = made.replaced(text, patterns.contents)
    assert made.contents(filled) == patterns.contents
    expected = laid_out(
        [(patterns.contents[name], sizes[name][1]) for name in sizes], width, np.random.default_rng(1)
    )
    expected |= {300: [5] * 2048, 301: [0] * 2048}
    assert filled == HEAD + "\n".join(section(*block) for block in expected.items())
    assert without_words(filled) == without_words(text)


def test_a_memory_that_is_not_in_block_ram():
    patterns, words = scene({"commands": (512, 36), "triangles": (512, 40)})
    blocks = laid_out([(words["commands"], 36), (words["triangles"], 36)], 36, np.random.default_rng(1))
    given = {str(number): np.array(block) for number, block in blocks.items()}
    with pytest.raises(ValueError, match=r"^2,048 bits of the memory of triangles are not in block RAM$"):
        MemoryMap.found(given, patterns)
    with pytest.raises(ValueError, match="two memories have the name commands"):
        patterns("commands", 1, [0])


def test_other_numbers_of_words_are_refused():
    made = MemoryMap({"triangles": (4, 9)}, {})
    with pytest.raises(ValueError, match="the memory of triangles has 4 words, not 3"):
        made.replaced("", {"triangles": [0, 0, 0]})


def test_block_rams_of_a_mapped_netlist():
    """Parameters have 16 words of 18 bits, each with two bits of padding. Undefined bits are 0."""
    values = {0: {0: 0x2A5C7}, 1: {15: 0x15555}}
    parameters = {}
    for row, words in values.items():
        text = "".join(f"{words.get(k, 0):020b}" for k in reversed(range(16)))
        parameters[f"INITVAL_{row:02X}"] = text.replace("0", "x", 1)
    cells = {"a": {"type": "DP16KD", "parameters": parameters}, "b": {"type": "LUT4", "parameters": {}}}
    found = blocks_of_netlist({"modules": {"top": {"cells": cells}}})
    assert found.keys() == {"a"}
    assert len(found["a"]) == 2048
    assert {k: int(word) for k, word in enumerate(found["a"]) if word} == {
        0: 0x2A5C7 & 511,
        1: 0x2A5C7 >> 9,
        62: 0x15555 & 511,
        63: 0x15555 >> 9,
    }


def test_a_configuration_carries_a_comment():
    text = carrying(HEAD, {"room": [1, 2]})
    assert text.splitlines()[:2] == [".device LFE5U-25F", '.comment blysk {"room": [1, 2]}']
    assert carried(text) == {"room": [1, 2]}
    assert carried(HEAD) is None
    assert carried(".comment blysk [1]\n") is None
    assert carried(".comment blysk {\n") is None


def test_changed_words():
    assert changed_words([1, 2, 3], [1, 3, 2]) == 2
