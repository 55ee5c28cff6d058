"""A pipeline whose texels are in a test memory outside of the pipeline. The test memory answers late."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring

from blysk.golden.frame_constants import TEXEL_ADDRESS, TEXELS_ADDRESS
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.albedo.texel_memory import TexelMemoryUnit
from blysk.hdl.core.stream import connect, connect_fifo
from blysk.hdl.pipeline import ShadingPipelineUnit

__all__ = ["PipelineWithTexels"]

_REQUESTS = 8
"""Requests that wait in the memory."""


class PipelineWithTexels(wiring.Component):
    """A pipeline with its texel memory outside, connected to a test memory.

    The writes of frame constants load the memory, as they load a memory inside. Each request waits for a
    random number of cycles, four on average. Answers are in order.

    Parameters
    ----------
    model : ShadingPipeline
        Pipeline with texels outside.

    Members
    -------
    i, o, write, status
        Those of `ShadingPipelineUnit`.
    """

    def __init__(self, model: ShadingPipeline):
        assert model.albedo is not None
        assert model.albedo.texture is not None
        self.model = model
        self._pipeline = ShadingPipelineUnit(model)
        self._memory = TexelMemoryUnit(model.albedo.texture.memory)
        members = dict(self._pipeline.signature.members)
        del members["texel_request"], members["texel_response"]
        super().__init__(members)

    def elaborate(self, platform):
        """The pipeline, the memory, and a shift register that decides when a request goes on."""
        m = Module()
        m.submodules.pipeline, m.submodules.memory = pipeline, memory = self._pipeline, self._memory
        connect(m, wiring.flipped(self.i), pipeline.i)
        connect(m, wiring.flipped(self.write), pipeline.write)
        connect(m, pipeline.o, wiring.flipped(self.o))
        connect(m, memory.o, pipeline.texel_response)
        waits = pipeline.texel_request.signature.create(path=("waits",))
        connect_fifo(m, "requests", pipeline.texel_request, waits, _REQUESTS)
        random, goes = Signal(16, init=1, name="random"), Signal(name="goes")
        # A maximum-length sequence: x^16 + x^15 + x^13 + x^4 + 1.
        m.d.sync += random.eq(Cat(random[15] ^ random[14] ^ random[12] ^ random[3], random))
        with m.If(goes & waits.valid & memory.i.ready):
            m.d.sync += goes.eq(0)
        with m.Elif(random[:2].all()):
            m.d.sync += goes.eq(1)
        given = self.write.payload
        of_texels = (given.address == TEXELS_ADDRESS) | (given.address == TEXEL_ADDRESS)
        m.d.comb += [
            self.status.eq(pipeline.status),
            memory.i.payload.eq(waits.payload),
            memory.i.valid.eq(waits.valid & goes),
            waits.ready.eq(memory.i.ready & goes),
            memory.write.valid.eq(self.write.valid & self.write.ready & of_texels),
            memory.write.payload.begins.eq(given.address == TEXELS_ADDRESS),
            memory.write.payload.value.eq(given.data),
        ]
        return m
