"""Narrow streams: the words of payloads on the way in and out, with pauses, against a reshaped array."""

import numpy as np
import pytest
from amaranth.hdl import Cat, Module
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from blysk.golden.build import STREAMS, TOPS
from blysk.golden.bus.stream_width import MISSING, gathered, split
from blysk.golden.presets import preset
from blysk.hdl.bus.bus import AxiStream, core_of
from blysk.hdl.bus.stream_width import gather_words, split_words

SIZE = 16
"""Bytes of a payload."""


class Both(wiring.Component):
    """Words to payloads, and payloads to words."""

    def __init__(self, size):
        payload = data.StructLayout({"data": data.ArrayLayout(8, SIZE), "last": 1})
        made = data.StructLayout({"data": data.ArrayLayout(8, SIZE), "last": 1, "first": 1, "end": 1})
        super().__init__(
            {
                "given": In(AxiStream(size)),
                "payloads": Out(stream.Signature(payload)),
                "made": In(stream.Signature(made)),
                "words": Out(AxiStream(size, 2)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        gather_words(m, self.given, self.payloads)
        split_words(m, self.made, self.words)
        return m


def number(row):
    return int.from_bytes(bytes(row.tolist()), "little")


def rows(numbers, size):
    return np.array([list(number.to_bytes(size, "little")) for number in numbers], dtype=np.uint8)


async def send(context, beats, valid, ready, put, rng):
    """Offer beats with pauses. An offered beat stays until it is taken."""
    for beat in beats:
        while rng.random() < 0.3:
            await context.tick()
        put(context, beat)
        context.set(valid, 1)
        while not (await context.tick().sample(ready))[-1]:
            pass
        context.set(valid, 0)


async def take(context, count, valid, ready, get, rng):
    """Take beats with pauses."""
    found = []
    while len(found) < count:
        context.set(ready, int(rng.random() < 0.7))
        *_, there, took, beat = await context.tick().sample(valid, ready, get)
        if there and took:
            found.append(beat)
    context.set(ready, 0)
    return found


@pytest.mark.parametrize("bits", STREAMS)
def test_words_and_payloads(bits):
    """Frames end at payloads and within them. Marks are at the first or at the last word of a payload."""
    rng, size = np.random.default_rng(bits), bits // 8
    words = {"data": rng.integers(0, 256, (60, size), dtype=np.uint8), "last": rng.random(60) < 0.1}
    words["last"][-1] = True
    wanted = gathered(words, SIZE)
    marks = {name: rng.integers(0, 2, 20) for name in ("last", "first", "end")}
    given = {"data": rng.integers(0, 256, (20, SIZE), dtype=np.uint8), **marks}
    parts = split(given, size)
    unit, found = Both(size), {}

    def put_word(context, k):
        context.set(unit.given.tdata, number(words["data"][k]))
        context.set(unit.given.tlast, int(words["last"][k]))

    def put_payload(context, k):
        bytes_of = dict(enumerate(given["data"][k].tolist()))
        context.set(unit.made.payload.data, [bytes_of[i] for i in range(SIZE)])
        for name, flag in marks.items():
            context.set(unit.made.payload[name], int(flag[k]))

    simulator = Simulator(unit)
    simulator.add_clock(1e-8)
    of = {name: np.random.default_rng(k) for k, name in enumerate("abcd")}

    async def words_in(context):
        port = unit.given
        await send(context, range(60), port.tvalid, port.tready, put_word, of["a"])

    async def payloads_out(context):
        port = unit.payloads
        word = port.payload.as_value()
        found["payloads"] = await take(context, len(wanted["last"]), port.valid, port.ready, word, of["b"])

    async def payloads_in(context):
        port = unit.made
        await send(context, range(20), port.valid, port.ready, put_payload, of["c"])

    async def words_out(context):
        port = unit.words
        word = Cat(port.tdata, port.tlast, port.tuser)
        found["words"] = await take(context, len(parts["data"]), port.tvalid, port.tready, word, of["d"])

    for process in (words_in, payloads_out, payloads_in, words_out):
        simulator.add_testbench(process)
    simulator.run()
    flags = [wanted["last"].tolist()], [parts[name].tolist() for name in ("last", "first", "end")]
    for name, data_of, size_of, bits_of in (
        ("payloads", wanted["data"], SIZE, flags[0]),
        ("words", parts["data"], size, flags[1]),
    ):
        low = [beat & (1 << 8 * size_of) - 1 for beat in found[name]]
        np.testing.assert_array_equal(rows(low, size_of), data_of)
        for k, flag in enumerate(bits_of):
            assert [beat >> 8 * size_of + k & 1 for beat in found[name]] == flag


@pytest.mark.parametrize("top", TOPS)
@pytest.mark.parametrize(
    "design", [preset(), preset("linear", "cosquad"), preset("quotient", "phong", 4, materials=5)], ids=str
)
def test_a_frame_that_ends_early_is_counted(design, top):
    """Bytes that are missing do not fit their fields, so ``misfits`` counts the beat."""
    for bits in STREAMS:
        unit = core_of(design.built(top=top, bus="axi", stream=bits))
        layout = unit.framing.model.given
        assert layout.size % (bits // 8) == 0
        payload = np.zeros((1, layout.size), dtype=np.uint8)
        assert layout.fits(payload).all()
        payload[:, -bits // 8 :] = MISSING
        assert not layout.fits(payload).any()
