"""Packet decoder: from bytes to words for memories. Wrong packets are counted, and write nothing."""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from blysk.golden.bus.packets import END, ESCAPE, FLAG, FLIP, PAYLOAD
from blysk.golden.video.memory_contents import MemoryContents

__all__ = ["COUNTERS", "HEADER", "RESIDUE", "PacketDecoder"]

COUNTERS = ("packets", "damaged", "unknown", "lengths", "beyond")
"""Counters: right packets, and packets that were dropped for one of four reasons.

A packet is *damaged* if it ends after an escape, or its CRC is wrong. Else it is *unknown* if there is no
memory of its index. Else it is counted in ``lengths`` if its length is not the length of its words, is over
`PAYLOAD`, or is of no whole number of words. Else it is *beyond* if the memory has fewer words.
"""

HEADER = 4
"""Bytes before the words: target, address (two bytes), length."""

CHECK = 4
"""Bytes of the CRC."""

RESIDUE = 0x2144DF1C
"""CRC-32 of any content followed by its own CRC-32."""


@dataclass(frozen=True)
class PacketDecoder:
    """Decodes packets, and gives the words of each right packet.

    Packets are frames of RFC 1662: between flags, with escaped bytes and a CRC-32. After a wrong packet the
    next flag begins a new packet, so each later packet is decoded. A packet without bytes is not counted.

    The CRC of a packet begins as if other bytes had been sent before. A designer chooses these bytes, for
    example from the sizes of the memories. So packets for other sizes are damaged.

    Parameters
    ----------
    memories : tuple of MemoryContents
        The memories by their index. Only widths and depths are used.
    start : int
        CRC-32 of the bytes that are as if sent before each packet.

    Raises
    ------
    ValueError
        If there are no memories or over 256, a word has more bytes than a packet, or a depth is over 2^16.

    Source: RFC 1662, sections 4.2 and C.3; not in the documents.
    """

    memories: tuple[MemoryContents, ...]
    start: int = 0

    def __post_init__(self) -> None:
        if not 1 <= len(self.memories) <= 256:
            raise ValueError(f"packets name 1 to 256 memories, not {len(self.memories)}")
        for memory in self.memories:
            if memory.word_bytes > PAYLOAD:
                raise ValueError(f"a word of {memory.name} has over {PAYLOAD} bytes")
            if memory.depth > 1 << 16:
                raise ValueError(f"{memory.name} have over {1 << 16} words")

    @property
    def word_bytes(self) -> int:
        """Number of bytes of the longest word."""
        return max(memory.word_bytes for memory in self.memories)

    def frames(self, given: bytes) -> Iterator[bytes | None]:
        """Contents between flags without escapes. ``None`` for a frame that ends after an escape."""
        frame, escaped = bytearray(), False
        for byte in given:
            if byte in (FLAG, END):
                if frame or escaped:
                    yield None if escaped else bytes(frame)
                frame, escaped = bytearray(), False
            elif byte == ESCAPE and not escaped:
                escaped = True
            else:
                frame.append(byte ^ FLIP if escaped else byte)
                escaped = False

    def verdict(self, frame: bytes | None) -> str:
        """The name of the counter that counts a frame."""
        if frame is None or zlib.crc32(frame, self.start) != RESIDUE:
            return "damaged"
        if frame[0] >= len(self.memories):
            return "unknown"
        memory = self.memories[frame[0]]
        length = frame[3] if len(frame) > 3 else 0
        if len(frame) != HEADER + length + CHECK or length > PAYLOAD or length % memory.word_bytes:
            return "lengths"
        first = int.from_bytes(frame[1:3], "little")
        return "packets" if first + length // memory.word_bytes <= memory.depth else "beyond"

    def compute(self, given: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, int]]:
        """Bit-accurate writes, and the counters.

        Parameters
        ----------
        given : array of bytes, shape (B,)
            The bytes.

        Returns
        -------
        writes : dict
            ``target`` and ``address``, shape (W,), and ``data``, shape (W, `word_bytes`), the lowest byte
            first.
        counts : dict of str to int
            Counters of `COUNTERS`.
        """
        counts = dict.fromkeys(COUNTERS, 0)
        places: list[tuple[int, int]] = []
        words: list[bytes] = []
        for frame in self.frames(np.asarray(given, dtype=np.uint8).tobytes()):
            verdict = self.verdict(frame)
            counts[verdict] += 1
            if frame is None or verdict != "packets":
                continue
            size, first = self.memories[frame[0]].word_bytes, int.from_bytes(frame[1:3], "little")
            for k in range(frame[3] // size):
                places.append((frame[0], first + k))
                word = frame[HEADER + k * size :][:size]
                words.append(word[::-1].ljust(self.word_bytes, b"\0"))
        target, address = np.array(places, dtype=np.int64).reshape(-1, 2).T
        data = np.frombuffer(b"".join(words), dtype=np.uint8).reshape(-1, self.word_bytes)
        return {"target": target, "address": address, "data": data}, counts

    def written(self, writes: dict[str, np.ndarray]) -> tuple[MemoryContents, ...]:
        """The memories after writes, with all their words."""
        kept = [list(of.words) + [0] * (of.depth - len(of.words)) for of in self.memories]
        for target, address, data in zip(
            *(writes[name] for name in ("target", "address", "data")), strict=True
        ):
            mask = (1 << self.memories[target].width) - 1
            kept[target][address] = int.from_bytes(data.tobytes(), "little") & mask
        return tuple(
            MemoryContents(of.name, of.width, of.depth, tuple(words))
            for of, words in zip(self.memories, kept, strict=True)
        )
