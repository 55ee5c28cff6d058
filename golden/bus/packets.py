"""Packets of a loader: words of memories as bytes for a serial line or a flash."""

import zlib
from collections.abc import Iterable, Iterator

from blysk.golden.video.memory_contents import MemoryContents

__all__ = ["END", "ESCAPE", "FLAG", "FLIP", "PAYLOAD", "framed", "packets_of", "stream_of"]

FLAG, ESCAPE, END = 0x7E, 0x7D, 0xFF
"""Byte between two packets, byte before an escaped byte, and byte after the last packet.

The end is the value of erased flash.
"""

FLIP = 0x20
"""An escaped byte is sent with these bits inverted."""

PAYLOAD = 63
"""Largest number of bytes of words in a packet."""


def framed(content: bytes, start: int = 0) -> bytes:
    """A packet with its CRC-32 and its flag, escaped.

    Parameters
    ----------
    content : bytes
        Target, address, length, words.
    start : int
        Start of the CRC, see `PacketDecoder`.

    Source: RFC 1662, sections 4.2 and C.3.
    """
    checked = content + zlib.crc32(content, start).to_bytes(4, "little")
    escaped = (
        bytes((ESCAPE, byte ^ FLIP)) if byte in (FLAG, ESCAPE, END) else bytes((byte,)) for byte in checked
    )
    return b"".join(escaped) + bytes((FLAG,))


def packets_of(memories: Iterable[MemoryContents], start: int = 0) -> Iterator[bytes]:
    """Packets that write the words of memories.

    A packet has the index of its memory in a byte, the address of its first word in two bytes, the lower byte
    first, and the number of bytes of its words. Each word follows with its highest byte first.

    Parameters
    ----------
    memories : iterable of MemoryContents
        The memories, all of them, in the order of the loader.
    start : int
        As for `framed`.
    """
    for target, memory in enumerate(memories):
        size = memory.word_bytes
        together = PAYLOAD // size
        for first in range(0, len(memory.words), together):
            words = memory.words[first : first + together]
            data = b"".join(word.to_bytes(size, "big") for word in words)
            yield framed(bytes((target, first & 255, first >> 8, len(data))) + data, start)


def stream_of(memories: Iterable[MemoryContents], start: int = 0, flags: int = 0) -> bytes:
    """Bytes that a serial line or a flash gives to a loader.

    The first packet has no words. It stops the drawing, and flags follow until the drawing rests.

    Parameters
    ----------
    memories, start
        As for `packets_of`.
    flags : int
        Number of flags after the first packet.
    """
    mark = bytes((FLAG,))
    first = framed(bytes(4), start)
    return b"".join((mark, first, mark * flags, *packets_of(memories, start), bytes((END,))))
