"""Albedo unit: the colour of the surface at each pixel, from the attributes of spans."""

from amaranth.hdl import Module, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.albedo.attribute_spans import AttributeSpansUnit, attribute_span_shape
from blysk.hdl.albedo.attributes import AttributesUnit
from blysk.hdl.albedo.texel_memory import texel_write_shape, texels_shape
from blysk.hdl.albedo.texture_address import descriptor_shape, texel_request_shape
from blysk.hdl.albedo.texture_filter import albedo_shape
from blysk.hdl.albedo.texture_sampler import TextureSamplerUnit
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.memory import connect_wide_fifo
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy, copy_fields

__all__ = ["AlbedoUnit"]

_WAITING = 32
"""Room for vertex colours that wait for their texels.

If the memory is inside, a sample takes fewer cycles than this number.
"""


class _ColorProductUnit(PipelinedUnit):
    """Product of a vertex colour and the colour of a texture, rounded half up to 16 fraction bits."""

    def __init__(self, initiation_interval: int):
        self._graph = g = Dataflow(initiation_interval)
        self._albedo = []
        for channel, name in enumerate("rgb"):
            color, texel = (
                g.input(f"{of}_{name}", lambda operands, of=of, channel=channel: operands[of][channel])
                for of in ("color", "texel")
            )
            self._albedo.append(
                g.register(f"albedo_{name}", _rounded, g.multiply(f"product_{name}", color, texel))
            )
        super().__init__(
            data.StructLayout({"color": albedo_shape(), "texel": albedo_shape()}),
            albedo_shape(),
            latency=max(word.stage for word in self._albedo),
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        m.d.comb += [
            found.eq(at(word, self.latency)) for found, word in zip(result, self._albedo, strict=True)
        ]
        return result


def _rounded(product):
    # Both factors are at most 1, so the product is at most 1.
    format = Albedo.FORMAT
    return product.round_half_up(format.fraction_bits).wrap(format)


class AlbedoUnit(wiring.Component):
    """Albedo of every pixel of spans, first pixel first; `Albedo` is the bit-accurate model.

    Spans become words of pixels. Words become vertex colours and texture coordinates. A sampler makes colours
    of the texture from coordinates. If there are both colours, the vertex colour waits in a FIFO for the
    colour of the texture, and a unit multiplies them. At an initiation interval of 1 a pixel leaves on each
    cycle. A span of length 0 gives nothing.

    Parameters
    ----------
    model : Albedo
        Bit-accurate model.
    length_bits : int
        Bits of the length of a span.
    initiation_interval : int
        Cycles from a pixel to the next.
    waiting : int
        Largest number of samples under way to a texel memory outside, at least 4.
    spaced : bool
        As in `AttributeSpansUnit`.

    Members
    -------
    i : :py:`In(stream.Signature(attribute_span_shape(model.spans, length_bits)))`
        Spans.
    o : :py:`Out(stream.Signature(albedo_shape()))`
        Albedo of pixels.
    constants : :py:`In(descriptor_shape())`
        The texture, constant while spans are inside. Only with textures.
    write : :py:`In(stream.Signature(texel_write_shape()))`
        Writes of texels, while no span is inside. Only with a texel memory inside that is not fixed.
    request, response
        Those of `TextureSamplerUnit`, with a texel memory outside.

    Attributes
    ----------
    latency : int
        Cycles from a span to its first pixel. A texel memory outside adds its own latency. With ``spaced`` a
        step may add to them.

    Source: docs/theory/textures.md.
    """

    def __init__(
        self,
        model: Albedo | None = None,
        length_bits: int = LENGTH_BITS,
        initiation_interval: int = 1,
        waiting: int = 16,
        spaced: bool = False,
    ):
        self.model = p = model or Albedo()
        self.initiation_interval = initiation_interval
        self._spans = AttributeSpansUnit(p.spans, length_bits, spaced)
        self._attributes = AttributesUnit(p.attributes, initiation_interval)
        self._sampler = self._product = None
        members = {
            "i": In(stream.Signature(attribute_span_shape(p.spans, length_bits))),
            "o": Out(stream.Signature(albedo_shape())),
        }
        self.latency = self._spans.latency + self._attributes.latency
        if p.texture is not None:
            self._sampler = TextureSamplerUnit(p.texture, initiation_interval, waiting)
            members["constants"] = In(descriptor_shape())
            self.latency += self._sampler.latency
            if p.texture.memory.external:
                members["request"] = Out(stream.Signature(texel_request_shape(p.texture.memory)))
                members["response"] = In(stream.Signature(texels_shape()))
            elif p.texture.memory.written:
                members["write"] = In(stream.Signature(texel_write_shape()))
        if p.has_product:
            self._product = _ColorProductUnit(initiation_interval)
            self._waiting = max(waiting, _WAITING)
            self.latency += self._product.latency
        super().__init__(members)

    def elaborate(self, platform):
        """The units one after the other; if there are both colours, also a FIFO beside the sampler."""
        m = Module()
        m.submodules.spans, m.submodules.attributes = self._spans, self._attributes
        connect(m, wiring.flipped(self.i), self._spans.i)
        connect(m, self._spans.o, self._attributes.i)
        found, sampler = self._attributes.o, self._sampler
        if sampler is None:
            m.d.comb += [
                copy(self.o.payload, found.payload.colors),
                self.o.valid.eq(found.valid),
                found.ready.eq(self.o.ready),
            ]
            return m
        m.submodules.sampler = sampler
        m.d.comb += [
            sampler.constants.eq(self.constants),
            *copy_fields(sampler.i.payload, found.payload, ("coordinates", "level")),
        ]
        if self.model.texture.memory.external:
            connect(m, sampler.request, wiring.flipped(self.request))
            connect(m, wiring.flipped(self.response), sampler.response)
        elif self.model.texture.memory.written:
            connect(m, wiring.flipped(self.write), sampler.write)
        if self._product is None:
            m.d.comb += [sampler.i.valid.eq(found.valid), found.ready.eq(sampler.i.ready)]
            connect(m, sampler.o, wiring.flipped(self.o))
        else:
            self._multiply(m, found)
        return m

    def _multiply(self, m: Module, found: stream.Interface) -> None:
        """Pixels go to the sampler and to the FIFO on the same cycle. Their outputs meet at the product."""
        sampler = self._sampler
        m.submodules.product = product = self._product
        color = stream.Signature(albedo_shape())
        waits, follows = color.create(path=("waits",)), color.create(path=("follows",))
        connect_wide_fifo(m, "colors", waits, follows, self._waiting)
        m.d.comb += [
            copy(waits.payload, found.payload.colors),
            sampler.i.valid.eq(found.valid & waits.ready),
            waits.valid.eq(found.valid & sampler.i.ready),
            found.ready.eq(sampler.i.ready & waits.ready),
            copy(product.i.payload.color, follows.payload),
            copy(product.i.payload.texel, sampler.o.payload),
            product.i.valid.eq(sampler.o.valid & follows.valid),
            sampler.o.ready.eq(product.i.ready & follows.valid),
            follows.ready.eq(product.i.ready & sampler.o.valid),
        ]
        connect(m, product.o, wiring.flipped(self.o))
