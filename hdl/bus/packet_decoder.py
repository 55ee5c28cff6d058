"""Packet decoder: from bytes to words for memories. Wrong packets are counted, and write nothing."""

from amaranth.hdl import Array, Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.crc import Algorithm, Processor
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.packet_decoder import CHECK, COUNTERS, HEADER, PacketDecoder
from blysk.golden.bus.packets import END, ESCAPE, FLAG, FLIP, PAYLOAD
from blysk.hdl.geometry.triangles import count_events, counters_shape

__all__ = ["PacketDecoderUnit", "write_shape"]

_PLACES = 64
"""Bytes of the buffer."""


def write_shape(model: PacketDecoder) -> data.StructLayout:
    """Shape of a write: index of the memory, address, and bytes of the word, the lowest first."""
    target = unsigned(max((len(model.memories) - 1).bit_length(), 1))
    word = data.ArrayLayout(8, model.word_bytes)
    return data.StructLayout({"target": target, "address": unsigned(16), "data": word})


def _checked(start: int) -> Processor:
    """CRC-32 of a stream of bits, with the CRC of what is as if sent before."""
    first = int(f"{start ^ 0xFFFFFFFF:032b}"[::-1], 2)
    algorithm = Algorithm(
        crc_width=32,
        polynomial=0x04C11DB7,
        initial_crc=first,
        reflect_input=True,
        reflect_output=True,
        xor_output=0xFFFFFFFF,
    )
    return Processor(algorithm(1))


class PacketDecoderUnit(wiring.Component):
    """Checks packets, and gives the words of right packets. `PacketDecoder` is the bit-accurate model.

    The words wait in a buffer of 64 bytes until the CRC is right. So a packet is written as a whole, or not
    at all. A byte takes 10 cycles, because the CRC takes a bit a cycle. After the last flag a packet takes a
    cycle, a cycle for each byte of its words, and a cycle for each word. In these cycles no byte is accepted.
    The unit has no multipliers.

    Parameters
    ----------
    model : PacketDecoder
        Bit-accurate model, with the memories.

    Members
    -------
    i : :py:`In(stream.Signature(8))`
        Bytes.
    o : :py:`Out(stream.Signature(write_shape(model)))`
        Words to write.
    status : :py:`Out(counters_shape(*COUNTERS))`
        Counters since the reset.

    Attributes
    ----------
    accepted, dropped : Signal
        High for a cycle after a right packet, and after a wrong packet.

    Source: RFC 1662, sections 4.2 and C.3; not in the documents.
    """

    def __init__(self, model: PacketDecoder):
        self.model = model
        super().__init__(
            {
                "i": In(stream.Signature(8)),
                "o": Out(stream.Signature(write_shape(model))),
                "status": Out(counters_shape(*COUNTERS)),
            }
        )
        self.accepted, self.dropped = Signal(name="accepted"), Signal(name="dropped")

    def elaborate(self, platform):
        """Bytes without escapes, their CRC and their places, then the words from the buffer."""
        m = Module()
        m.submodules.crc = self._crc = crc = _checked(self.model.start)
        m.submodules.payload = buffer = Memory(shape=8, depth=_PLACES, init=[])
        self._write, self._read = buffer.write_port(), buffer.read_port(domain="comb")
        self._value, self._bit = Signal(8, name="value"), Signal(3, name="bit")
        # The number of bytes stays at its largest value, which is the length of no right packet.
        self._count, self._place = Signal(7, name="count"), Signal(4, name="place")
        self._target, self._unknown = (
            Signal.like(self.o.payload.target, name="target"),
            Signal(name="unknown"),
        )
        self._address, self._length = Signal(16, name="address"), Signal(8, name="length")
        self._end, self._aborted = Signal(17, name="end"), Signal(name="aborted")
        word_bytes = Array(of.word_bytes for of in self.model.memories)[self._target]
        self._whole = Signal(name="whole")
        m.d.comb += self._whole.eq(self._place + 1 == word_bytes)
        with m.FSM(name="state"):
            self._receive(m)
            with m.State("check"):
                m.d.comb += [crc.valid.eq(1), crc.data.eq(self._value[0])]
                m.d.sync += [self._value.eq(self._value.rotate_right(1)), self._bit.eq(self._bit + 1)]
                with m.If(self._bit.all()):
                    m.next = "store"
            self._store(m)
            events = self._judge(m)
            self._give(m)
        count_events(m, self.status, **events)
        return m

    def _receive(self, m: Module) -> None:
        """State that takes a byte."""
        escaped, byte = Signal(name="escaped"), self.i.payload
        with m.State("receive"):
            m.d.comb += self.i.ready.eq(1)
            m.d.sync += self._value.eq(byte ^ Mux(escaped, FLIP, 0))
            with m.If(self.i.valid):
                m.d.sync += escaped.eq(0)
                with m.If((byte == FLAG) | (byte == END)):
                    m.d.sync += self._aborted.eq(escaped)
                    with m.If(escaped | self._count.any()):
                        m.next = "judge"
                with m.Elif((byte == ESCAPE) & ~escaped):
                    m.d.sync += escaped.eq(1)
                with m.Else():
                    m.next = "check"

    def _store(self, m: Module) -> None:
        """State that puts a byte into its place."""
        count, value, place = self._count, self._value, self._place
        inside = count < self._length + HEADER
        m.d.comb += [
            self._write.addr.eq((count - HEADER)[: len(self._write.addr)]),
            self._write.data.eq(value),
        ]
        with m.State("store"):
            with m.If(~count.all()):
                m.d.sync += count.eq(count + 1)
            with m.Switch(count):
                with m.Case(0):
                    m.d.sync += [self._target.eq(value), self._unknown.eq(value >= len(self.model.memories))]
                with m.Case(1):
                    m.d.sync += self._address[:8].eq(value)
                with m.Case(2):
                    m.d.sync += self._address[8:].eq(value)
                with m.Case(3):
                    m.d.sync += [self._length.eq(value), self._end.eq(self._address)]
                with m.Default(), m.If(inside):
                    m.d.comb += self._write.en.eq(1)
                    m.d.sync += place.eq(Mux(self._whole, 0, place + 1))
                    with m.If(self._whole):
                        m.d.sync += self._end.eq(self._end + 1)
            m.next = "receive"

    def _judge(self, m: Module) -> dict[str, Value]:
        """State that accepts or drops a packet. The result has the event of each counter."""
        count, length = self._count, self._length
        depth = Array(of.depth for of in self.model.memories)[self._target]
        wrong = (
            self._aborted | ~self._crc.match_detected,
            self._unknown,
            (count != length + HEADER + CHECK) | (length > PAYLOAD) | self._place.any(),
            self._end > depth,
        )
        judges, events = Signal(name="judges"), {}
        fine = judges
        for name, reason in zip(COUNTERS[1:], wrong, strict=True):
            events[name] = fine & reason
            fine = fine & ~reason
        m.d.comb += [self.accepted.eq(fine), self.dropped.eq(judges & ~fine)]
        with m.State("judge"):
            m.d.comb += [judges.eq(1), self._crc.start.eq(1)]
            m.d.sync += [count.eq(0), self._place.eq(0)]
            m.next = "receive"
            with m.If(fine & length.any()):
                m.next = "read"
        return {"packets": fine, **events}

    def _give(self, m: Module) -> None:
        """States that gather the bytes of a word, and give it."""
        word = Signal(self.o.payload.data.shape(), name="word")
        bits, index = Value.cast(word), Signal(range(_PLACES), name="index")
        m.d.comb += [
            self._read.addr.eq(index),
            self.o.payload.target.eq(self._target),
            self.o.payload.address.eq(self._address),
            self.o.payload.data.eq(word),
        ]
        with m.State("read"):
            m.d.sync += [bits.eq(Cat(self._read.data, bits)), index.eq(index + 1)]
            m.d.sync += self._place.eq(self._place + 1)
            with m.If(self._whole):
                m.d.sync += self._place.eq(0)
                m.next = "give"
        with m.State("give"):
            m.d.comb += self.o.valid.eq(1)
            with m.If(self.o.ready):
                m.d.sync += [self._address.eq(self._address + 1), bits.eq(0)]
                m.next = "read"
                with m.If(index == self._length):
                    m.d.sync += index.eq(0)
                    m.next = "receive"
