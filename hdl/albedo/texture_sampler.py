"""Texture sampler: address, texel memory and filter, with texels in the design or outside of it."""

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.hdl.albedo.texel_memory import TexelMemoryUnit, texel_write_shape, texels_shape
from blysk.hdl.albedo.texture_address import (
    TextureAddressUnit,
    descriptor_shape,
    texel_request_shape,
    texture_place_shape,
)
from blysk.hdl.albedo.texture_filter import TextureFilterUnit, albedo_shape
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.core.stream import connect

__all__ = ["TextureSamplerUnit"]

_INSIDE = 4
"""Depth of the FIFO of weights beside a memory inside. Three samples wait there at most."""


class TextureSamplerUnit(wiring.Component):
    """Colours of a texture at places of a surface, in the order of the places.

    `TextureSampler` is the bit-accurate model. The weights of a sample wait in a FIFO while its texels are
    read. So a memory outside may have any latency. The sampler keeps its rate if the latency is less than
    ``waiting`` cycles.

    Parameters
    ----------
    model : TextureSampler
        Bit-accurate model. With ``memory.external`` the memory is outside.
    initiation_interval : int
        Cycles from a sample to the next, at least 1: interval of the filter.
    waiting : int
        Largest number of samples whose texels are under way from a memory outside, at least 4.

    Raises
    ------
    ValueError
        If ``waiting`` is too small.

    Members
    -------
    i : :py:`In(stream.Signature(texture_place_shape(model.address)))`
        Places.
    o : :py:`Out(stream.Signature(albedo_shape()))`
        Colours.
    constants : :py:`In(descriptor_shape())`
        The texture, constant while samples are inside.
    write : :py:`In(stream.Signature(texel_write_shape()))`
        Writes of the memory, see `TexelMemoryUnit`. Only if the memory is inside, and not fixed.
    request : :py:`Out(stream.Signature(texel_request_shape(model.memory)))`
        Requests. Only if the memory is outside.
    response : :py:`In(stream.Signature(texels_shape()))`
        Texels of the requests, in their order. Only if the memory is outside.

    Attributes
    ----------
    latency : int
        Cycles from a place to its colour. A memory outside adds its own latency.

    Source: docs/theory/textures.md#texture-unit.
    """

    def __init__(self, model: TextureSampler | None = None, initiation_interval: int = 1, waiting: int = 16):
        self.model = p = model or TextureSampler()
        if waiting < 4:
            raise ValueError(f"waiting must be at least 4, not {waiting}")
        self.initiation_interval, self._waiting = initiation_interval, waiting
        self._address = TextureAddressUnit(p.address)
        self._filter = TextureFilterUnit(p.filter, initiation_interval)
        self._memory = None if p.memory.external else TexelMemoryUnit(p.memory)
        inside = 0 if self._memory is None else self._memory.latency
        self.latency = self._address.latency + inside + self._filter.latency
        members = {
            "i": In(stream.Signature(texture_place_shape(p.address))),
            "o": Out(stream.Signature(albedo_shape())),
            "constants": In(descriptor_shape()),
        }
        if p.memory.external:
            members["request"] = Out(stream.Signature(texel_request_shape(p.memory)))
            members["response"] = In(stream.Signature(texels_shape()))
        elif p.memory.written:
            members["write"] = In(stream.Signature(texel_write_shape()))
        super().__init__(members)

    def elaborate(self, platform):
        """The three units; a place goes on to the memory and to the FIFO on the same cycle."""
        m, p = Module(), self.model
        m.submodules.address, m.submodules.filter = address, texture_filter = self._address, self._filter
        connect(m, wiring.flipped(self.i), address.i)
        connect(m, texture_filter.o, wiring.flipped(self.o))
        m.d.comb += address.constants.eq(self.constants)
        if p.memory.external:
            request, response = self.request, self.response
        else:
            m.submodules.memory = memory = self._memory
            request, response = memory.i, memory.o
            if p.memory.written:
                connect(m, wiring.flipped(self.write), memory.write)
        weight = stream.Signature(address.o.payload.shape().members["weight"])
        waits, follows = weight.create(path=("waits",)), weight.create(path=("follows",))
        connect_wide_fifo(m, "weights", waits, follows, self._waiting if p.memory.external else _INSIDE)
        both = response.valid & follows.valid
        m.d.comb += [
            request.payload.eq(address.o.payload.address),
            waits.payload.eq(address.o.payload.weight),
            request.valid.eq(address.o.valid & waits.ready),
            waits.valid.eq(address.o.valid & request.ready),
            address.o.ready.eq(request.ready & waits.ready),
            texture_filter.i.payload.texels.eq(response.payload),
            texture_filter.i.payload.weight.eq(follows.payload),
            texture_filter.i.valid.eq(both),
            response.ready.eq(texture_filter.i.ready & follows.valid),
            follows.ready.eq(texture_filter.i.ready & response.valid),
        ]
        return m
