"""Packets: what is sent arrives, and no damage writes a word."""

import zlib

import numpy as np
import pytest

from blysk.golden.bus.packet_decoder import RESIDUE, PacketDecoder
from blysk.golden.bus.packets import END, ESCAPE, FLAG, PAYLOAD, framed, packets_of, stream_of
from blysk.golden.video.memory_contents import MemoryContents

START = 0xCAFE


def contents(seed, *sizes):
    rng = np.random.default_rng(seed)
    return tuple(
        MemoryContents(
            f"memory {k}", width, depth, tuple(int(rng.integers(1 << width)) for _ in range(depth))
        )
        for k, (width, depth) in enumerate(sizes)
    )


SENT = contents(1, (36, 40), (9, 300), (61, 21))
DECODER = PacketDecoder(contents(2, (36, 40), (9, 300), (61, 21)), START)


def decoded(data):
    return DECODER.compute(np.frombuffer(data, dtype=np.uint8))


def test_sent_words_arrive():
    """All words of other memories arrive, whatever was sent before. Each packet has its largest length."""
    sent = stream_of(SENT, START, 5)
    writes, counts = decoded(b"\x00\x7d" + sent)
    assert DECODER.written(writes) == SENT
    # Before the first flag there is a packet that is none. Then comes the packet without words.
    assert counts == {"packets": 1 + 4 + 10 + 3, "damaged": 1, "unknown": 0, "lengths": 0, "beyond": 0}
    assert max(len(packet) for packet in packets_of(SENT)) > PAYLOAD


def test_bytes_of_a_packet():
    """The bytes by hand. Flags and end marks occur only as themselves."""
    words = MemoryContents("", 16, 3, (0x7E01, 0x7DFF, 2))
    (packet,) = packets_of([words])
    content = bytes((0, 0, 0, 6, 0x7E, 0x01, 0x7D, 0xFF, 0, 2))
    check = zlib.crc32(content).to_bytes(4, "little")
    assert packet[:13] == bytes((0, 0, 0, 6, 0x7D, 0x5E, 0x01, 0x7D, 0x5D, 0x7D, 0xDF, 0, 2))
    assert packet[-1] == FLAG
    assert zlib.crc32(content + check) == RESIDUE
    rest = packet[:-1].replace(bytes((ESCAPE,)), b"")
    assert not {FLAG, END} & set(rest)


def test_no_damage_writes():
    """An inverted bit, a byte that is left out, and a cut packet write nothing. The next packet is written.

    A damage may make two packets of one. Then both are wrong.
    """
    packet = next(packets_of(SENT, START))
    damages = [
        bytes(b ^ (k == n // 8) << n % 8 for k, b in enumerate(packet)) for n in range(8 * len(packet))
    ]
    damages += [packet[:k] + packet[k + 1 :] for k in range(len(packet) - 1)]
    damages += [packet[:k] + bytes((FLAG,)) for k in range(1, len(packet) - 1)]
    good = framed(bytes((1, 7, 0, 2)) + b"\1\2", START)
    for damage in damages:
        writes, counts = decoded(damage + bytes((FLAG,)) + good)
        assert writes["address"].tolist() == [7]
        assert counts["packets"] == 1
        assert 1 <= sum(counts.values()) - 1 <= 2


@pytest.mark.parametrize(
    ("content", "name"),
    [
        (bytes((3, 0, 0, 0)), "unknown"),
        (bytes((255, 0, 0, 5)) + bytes(5), "unknown"),
        (bytes((0, 39, 0, 5)) + bytes(5), "packets"),
        (bytes((0, 40, 0, 5)) + bytes(5), "beyond"),
        (bytes((0, 39, 0, 10)) + bytes(10), "beyond"),
        (bytes((0, 255, 255, 5)) + bytes(5), "beyond"),
        (bytes((0, 40, 0, 0)), "packets"),
        (bytes((0, 0, 0, 4)) + bytes(4), "lengths"),
        (bytes((0, 0, 0, 10)) + bytes(5), "lengths"),
        (bytes((0, 0, 0, 5)) + bytes(10), "lengths"),
        (bytes((0, 0, 0, 65)) + bytes(65), "lengths"),
        (bytes((0, 0)), "lengths"),
        # The first byte of its CRC is taken as the memory.
        (b"", "unknown"),
    ],
)
def test_wrong_entries_are_counted_by_their_kind(content, name):
    writes, counts = decoded(framed(content, START))
    assert {kind for kind, count in counts.items() if count} == {name}
    assert len(writes["target"]) == (name == "packets" and len(content) > 4)


def test_packets_of_another_design_are_damaged():
    _, counts = decoded(stream_of(SENT, START + 1))
    assert counts["packets"] == 0
    assert counts["damaged"] == 18


def test_sizes_that_packets_cannot_have():
    with pytest.raises(ValueError, match="a word of wide has over 63 bytes"):
        PacketDecoder((MemoryContents("wide", 505, 1),))
    with pytest.raises(ValueError, match="a word of few has 2 bits"):
        MemoryContents("few", 2, 1, (4,))
