"""Record of the packet decoder."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant, once
from blysk.golden.bus.packet_decoder import PacketDecoder
from blysk.golden.bus.packets import ESCAPE, FLAG, PAYLOAD, framed
from blysk.golden.video.memory_contents import MemoryContents
from blysk.hdl.bus.packet_decoder import PacketDecoderUnit

__all__ = ["RECORD"]

_MEMORIES = (("vertices", 108, 530), ("triangles", 30, 992), ("commands", 36, 500), ("coefficients", 61, 84))

_made = once(lambda unit, case: unit.model.compute(case.beats))


def _decoder(*memories) -> PacketDecoder:
    return PacketDecoder(tuple(MemoryContents(*memory) for memory in memories), 0x12345678)


def _packet(model, rng, words=None, target=None, address=None, extra=b"", length=None) -> bytes:
    """A packet of any words at any place of any memory, or with some wrong entries."""
    chosen = int(rng.integers(len(model.memories))) if target is None else target
    memory = model.memories[min(chosen, len(model.memories) - 1)]
    size = memory.word_bytes
    count = int(rng.integers(0, PAYLOAD // size + 1)) if words is None else words
    first = int(rng.integers(0, memory.depth - count + 1)) if address is None else address
    data = rng.bytes(count * size) + extra
    length = len(data) if length is None else length
    return framed(bytes((chosen, first & 255, first >> 8, length)) + data, model.start)


def _damaged(model, rng) -> bytes:
    """A packet with a wrong byte, without a byte, with a further byte, or that ends after an escape."""
    sent = bytearray(_packet(model, rng))
    place, kind = int(rng.integers(len(sent))), int(rng.integers(4))
    if kind == 0:
        sent[place] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del sent[place]
    elif kind == 2:
        sent.insert(place, int(rng.integers(256)))
    else:
        sent[-1:] = bytes((ESCAPE, FLAG))
    return bytes(sent)


def _wrong(model, rng) -> bytes:
    """A packet with a right CRC, and with a wrong memory, length or address."""
    memories, kind = model.memories, int(rng.integers(5))
    if kind == 0:
        return _packet(model, rng, target=int(rng.choice([len(memories), 255])), words=1, address=0)
    if kind == 1:
        # The last words, and a word behind them.
        target = int(rng.integers(len(memories)))
        depth = memories[target].depth
        address = depth - int(rng.integers(0, 2))
        return _packet(model, rng, words=1, target=target, address=int(rng.choice([address, 65535])))
    if kind == 2:
        return _packet(model, rng, length=int(rng.integers(256)))
    if kind == 3:
        return _packet(model, rng, extra=rng.bytes(int(rng.integers(1, 140))))
    return framed(rng.bytes(int(rng.integers(0, 12))), model.start)


def _case(unit, rng, count, damaged=0.0, wrong=0.0):
    model = unit.model
    # A short run has some words.
    sent = [bytes((FLAG,)), _packet(model, rng, 2, len(model.memories) - 1, 0)]
    while sum(map(len, sent)) < count:
        kind = rng.random()
        if kind < damaged:
            sent.append(_damaged(model, rng))
        elif kind < damaged + wrong:
            sent.append(_wrong(model, rng))
        else:
            sent.append(bytes((FLAG,)) * int(rng.integers(0, 3)) + _packet(model, rng))
    # The last packet is right, so that each run ends with a word.
    sent += [bytes((FLAG,)), _packet(model, rng, 1)]
    return Case(np.frombuffer(b"".join(sent), dtype=np.uint8).astype(np.int64))


def _packets(unit, rng, count):
    """Right packets of any length, with flags between them."""
    return _case(unit, rng, count)


def _faults(unit, rng, count):
    """Damaged packets, packets with wrong entries, and right packets, a third each."""
    return _case(unit, rng, count, 0.33, 0.33)


def _noise(unit, rng, count):
    """Any bytes, half of them flags, escapes and bytes near them, between right packets."""
    parts = [_case(unit, rng, 1).beats]
    for _ in range(count // 100):
        near = rng.choice([FLAG, ESCAPE, 0xFF, 0, FLAG ^ 0x20], 40)
        parts.append(np.where(rng.random(40) < 0.5, near, rng.integers(0, 256, 40)))
        parts.append(_case(unit, rng, 1).beats)
    return Case(np.concatenate(parts).astype(np.int64))


RECORD = Record(
    name="packet_decoder",
    title="Words for memories, from packets whose CRC is right",
    source="docs/theory/bus.md#loader",
    variants={
        "4 memories": Variant(partial(PacketDecoderUnit, _decoder(*_MEMORIES)), note="exact"),
        "1 memory": Variant(partial(PacketDecoderUnit, _decoder(("words", 8, 100))), note="exact", long=True),
    },
    expect=lambda unit, case: _made(unit, case)[0],
    status=lambda unit, case: _made(unit, case)[1],
    stimuli={
        "packets": Stimulus(_packets, 3000),
        "faults": Stimulus(_faults, 6000),
        "noise": Stimulus(_noise, 3000),
    },
    axis="",
    still={
        "a counter has room for more events than a run has": (
            "count_packets[6-31] count_damaged[7-31] count_unknown[3-31] count_lengths[4-31] "
            "count_beyond[2-31]"
        ),
    },
    remembers=True,
)
