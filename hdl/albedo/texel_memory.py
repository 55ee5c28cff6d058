"""Texel memory: four banks of texels behind a stream of requests and a stream of texels."""

import numpy as np
from amaranth.hdl import Cat, Signal, Value, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In

from blysk.golden.albedo.texel_memory import BANKS, TexelMemory
from blysk.hdl.albedo.texture_address import texel_request_shape
from blysk.hdl.core.memory import registered_read
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.scene_memory import scene_memory

__all__ = ["TexelMemoryUnit", "texel_write_shape", "texels_shape"]


def texel_write_shape() -> data.StructLayout:
    """Shape of a write: 18 bits of a word, or with ``begins`` an index. See `LoadedTextures.writes`."""
    return data.StructLayout({"value": 18, "begins": 1})


def texels_shape() -> data.ArrayLayout:
    """Shape of a response: the texel of each bank, with codes of red, green and blue."""
    return data.ArrayLayout(data.ArrayLayout(unsigned(TexelMemory.CHANNEL_BITS), 3), BANKS)


class TexelMemoryUnit(PipelinedUnit):
    """Gives the texel of each bank at the bank's own address, one request a cycle.

    The latency is 2 cycles: the memory's register and the register behind it. A memory outside of a design
    has the same streams, and any latency. It answers requests in their order.

    A write is taken on every cycle. A write with ``begins`` gives an address, divided by 2. The values after
    it are halves of words, first the lower half. The words go to banks 0, 1, 2, 3, then to the next address.
    Values past the end of the banks must not come. Reset begins at address 0, and clears no word. Write only
    while no request is inside, because the registers stand still on the cycle of a write. If the texels are
    fixed at build time, there are no writes.

    Parameters
    ----------
    model : TexelMemory
        The memory.

    Members
    -------
    i : :py:`In(stream.Signature(texel_request_shape(model)))`
        Requests.
    o : :py:`Out(stream.Signature(texels_shape()))`
        Texels.
    write : :py:`In(stream.Signature(texel_write_shape()))`
        Writes. Always ready. Only if the texels are not fixed.

    Source: docs/theory/textures.md#memory.
    """

    def __init__(self, model: TexelMemory | None = None):
        self.model = p = model or TexelMemory()
        super().__init__(
            texel_request_shape(p),
            texels_shape(),
            latency=2,
            ports={"write": In(stream.Signature(texel_write_shape()))} if p.fixed is None else {},
        )

    def elaborate(self, platform):
        """The pipeline's control, and the banks, which are also written while the pipeline stands still."""
        p = self.model
        self._words = [Signal(p.WORD_BITS, name=f"texel_{bank}") for bank in range(BANKS)]
        m = super().elaborate(platform)
        if p.fixed is not None:
            words = np.zeros((p.depth, BANKS), dtype=np.int64)
            words[: len(p.fixed.codes)] = p.fixed.words
            for number, found in enumerate(self._words):
                given = words[:, number].tolist()
                m.submodules[f"bank_{number}"] = memory = scene_memory(
                    f"texels_{number}", p.WORD_BITS, p.depth, given
                )
                word, _ = registered_read(m, memory, self.i.payload[number], self.advance)
                m.d.comb += found.eq(word)
            return m
        lower, upper = Signal(18, name="lower"), Signal(name="upper")
        bank, address = Signal(range(BANKS), name="bank"), Signal(p.address_bits, name="address")
        value, writes = self.write.payload.value, Signal(name="writes")
        m.d.comb += [
            self.write.ready.eq(1),
            writes.eq(self.write.valid & ~self.write.payload.begins & upper),
        ]
        with m.If(self.write.valid):
            with m.If(self.write.payload.begins):
                m.d.sync += Cat(upper, bank, address).eq(value << 4)
            with m.Else():
                m.d.sync += Cat(upper, bank, address).eq(Cat(upper, bank, address) + 1)
                m.d.sync += lower.eq(value)
        for number, found in enumerate(self._words):
            m.submodules[f"bank_{number}"] = memory = Memory(shape=p.WORD_BITS, depth=p.depth, init=[])
            port = memory.write_port()
            m.d.comb += [
                port.addr.eq(address),
                port.data.eq(Cat(lower, value)),
                port.en.eq(writes & (bank == number)),
            ]
            word, _ = registered_read(m, memory, self.i.payload[number], self.advance & ~writes)
            m.d.comb += found.eq(word)
        return m

    def datapath(self, m, operands):
        """The texels behind the banks."""
        texels = Signal(texels_shape())
        m.d.comb += Value.cast(texels).eq(Cat(self._words))
        return texels
