"""Triangles to pixels: geometry, shading and depth test."""

from amaranth.hdl import Module, Shape, Signal
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.geometry import COUNTERS
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.render import Renderer
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import connect, connect_fifo
from blysk.hdl.frame_constants import write_shape
from blysk.hdl.geometry.depth_test import DepthMemory, DepthTestUnit, drawn_pixel_shape
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.geometry.span_adapter import connect_shading_span
from blysk.hdl.geometry.triangles import counters_shape, frame_shape, triangle_shape
from blysk.hdl.pipeline import ShadingPipelineUnit

__all__ = ["STATUS", "WAITING_SPANS", "RenderUnit"]

STATUS = (*COUNTERS, "pixels", "hidden", "out_of_range_spans")
"""Counters of `RenderUnit`."""

WAITING_SPANS = 33
"""Spans between geometry and shading: a memory of 32 words, and a register behind it."""


class RenderUnit(wiring.Component):
    """Triangles to the pixels that are to be written: `Renderer` is the bit-accurate model.

    `GeometryUnit`, `ShadingPipelineUnit` and `DepthTestUnit` in a row; spans wait between the first two in a
    FIFO, and their depths pass the pipeline in another. Each takes as long as it would alone, at the same
    time as the others: a frame as many cycles as the slowest, if none of them waits for long. The compact
    style is that of the design's build, of shading and of geometry.

    Frame constants are written while no span is inside; spans of another material than the one before wait
    for the pipeline to be empty, see `ShadingPipelineUnit`.

    Parameters
    ----------
    parameters : Renderer
        Bit-accurate model.
    size : (int, int) or None
        As `DepthTestUnit` has it.

    Members
    -------
    i : :py:`In(stream.Signature(triangle_shape(grid)))`
        Triangles.
    o : :py:`Out(stream.Signature(drawn_pixel_shape(x_bits, y_bits)))`
        Pixels to be written.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants of the shading pipeline.
    constants : :py:`In(frame_shape())`
        The picture; stays while triangles are inside.
    status : :py:`Out(counters_shape(*STATUS))`
        Counters since the reset.
    memory : :py:`Out(DepthMemory(x_bits, y_bits))`
        Depths so far; only without a ``size``.

    Source: docs/theory/geometry.md#composition; [T] figure 4.10.
    """

    def __init__(self, parameters: Renderer | None = None, size: tuple[int, int] | None = None):
        self.parameters = parameters or Renderer()
        design, grid = self.parameters.design, self.parameters.geometry.grid
        self.geometry = GeometryUnit(grid, design.build.style == "compact")
        self.pipeline = ShadingPipelineUnit(design)
        self.depth = DepthTestUnit(design.x_bits, design.y_bits, size)
        members = {
            "i": In(stream.Signature(triangle_shape(grid))),
            "o": Out(stream.Signature(drawn_pixel_shape(design.x_bits, design.y_bits))),
            "write": In(stream.Signature(write_shape())),
            "constants": In(frame_shape()),
            "status": Out(counters_shape(*STATUS)),
        }
        if size is None:
            members["memory"] = Out(DepthMemory(design.x_bits, design.y_bits))
        super().__init__(members)

    def elaborate(self, platform):
        """The three units; a span goes to the pipeline, and its depth to a FIFO, on the same cycle."""
        m = Module()
        geometry, pipeline, depth = self.geometry, self.pipeline, self.depth
        m.submodules.geometry, m.submodules.pipeline, m.submodules.depth = geometry, pipeline, depth
        m.d.comb += geometry.constants.eq(self.constants)
        connect(m, wiring.flipped(self.i), geometry.i)
        connect(m, wiring.flipped(self.write), pipeline.write)
        connect(m, depth.o, wiring.flipped(self.o))
        if depth.size is None:
            wiring.connect(m, depth.memory, wiring.flipped(self.memory))

        deep = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
        span = stream.Signature(data.StructLayout({"span": pipeline.i.payload.shape(), **deep}))
        made, ready = span.create(path=("made",)), span.create(path=("ready",))
        connect_shading_span(m, geometry.o.payload, made.payload.span)
        m.d.comb += [
            *(made.payload[name].eq(geometry.o.payload[name]) for name in deep),
            made.valid.eq(geometry.o.valid),
            geometry.o.ready.eq(made.ready),
        ]
        connect_fifo(m, "spans", made, ready, depth=WAITING_SPANS)
        shape = data.StructLayout(deep)
        m.submodules.depths = depths = fifo.SyncFIFOBuffered(
            width=Shape.cast(shape).width, depth=pipeline.spans_inside + 1
        )
        word = Signal(shape, name="depth_word")
        waiting, pixel = data.View(shape, depths.r_data), pipeline.o
        moves = depth.i.valid & depth.i.ready
        m.d.comb += [
            pipeline.i.payload.eq(ready.payload.span),
            *(word[name].eq(ready.payload[name]) for name in deep),
            depths.w_data.eq(word),
            depths.w_en.eq(ready.valid & pipeline.i.ready),
            pipeline.i.valid.eq(ready.valid & depths.w_rdy),
            ready.ready.eq(pipeline.i.ready & depths.w_rdy),
            depth.i.payload.pixel.eq(pixel.payload),
            *(depth.i.payload[name].eq(waiting[name]) for name in deep),
            depth.i.valid.eq(pixel.valid & depths.r_rdy),
            pixel.ready.eq(depth.i.ready & depths.r_rdy),
            depths.r_en.eq(moves & pixel.payload.last),
            *(self.status[name].eq(geometry.status[name]) for name in COUNTERS),
            *(self.status[name].eq(depth.status[name]) for name in ("pixels", "hidden")),
            self.status.out_of_range_spans.eq(pipeline.status.out_of_range_spans),
        ]
        return m
