"""Several shading pipelines that take spans of different scanlines: more than one pixel a cycle."""

from collections.abc import Callable
from functools import reduce
from operator import and_

from amaranth.hdl import Module, ShapeLike, Signal, Value
from amaranth.lib import fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.hdl.core.memory import LATE_FIFO_LATENCY, connect_late_fifo
from blysk.hdl.core.stream import connect
from blysk.hdl.frame_constants import write_shape
from blysk.hdl.pipeline import ShadingPipelineUnit, span_shape, status_shape
from blysk.hdl.pixel_assembler import pixel_shape
from blysk.hdl.pixel_joiner import PixelJoinerUnit, joined_shape
from blysk.hdl.pixel_merger import PixelMergerUnit
from blysk.hdl.port_descriptions import PORT_DESCRIPTIONS

__all__ = [
    "WAITING_SPANS",
    "MergedPipelinesUnit",
    "PixelPipelinesUnit",
    "WidePipelinesUnit",
    "port_descriptions",
]

WAITING_SPANS = 512
"""Spans that wait before a pipeline in a memory.

Block RAMs hold 512 words. The logic around them takes less than a memory of 32 words in look-up tables. If
the spans of a mesh have about as many pixels as there are pipelines, the span port has no cycle to spare.
Each cycle on which a full FIFO stops this port is then lost. An example is the teapot of 10,712 triangles at
640x480. With 32 words four pipelines give 3.3 times the pixels of one pipeline in a cycle. With 512 words
they give 3.6 times the pixels.
"""


def port_descriptions(pipes: int) -> dict[str, str]:
    """Descriptions of the ports of `PixelPipelinesUnit`, for the table in its Verilog.

    Parameters
    ----------
    pipes : int
        Number of pipelines.
    """
    texts = dict(PORT_DESCRIPTIONS)
    pixels = {name: texts.pop(name) for name in PORT_DESCRIPTIONS if name.startswith("o_")}
    for pipe in range(pipes):
        texts |= {
            name.replace("o_", f"o_{pipe}_"): f"{text}, from pipeline {pipe}" for name, text in pixels.items()
        }
    return texts


_BEHIND = 2
"""Number of spans in the registers behind the memory of a FIFO."""


class PixelPipelinesUnit(wiring.Component):
    """Shading pipelines of one design. Pipeline k takes the spans of scanlines y with ``y mod pipes = k``.

    Each pipeline has its own stream of pixels, with its own back-pressure. So on a cycle each pipeline may
    give a pixel. `PixelPipelines` is the bit-accurate model. A scanline belongs to one pipeline, so its
    pixels keep the order of its spans. Between scanlines no order holds.

    On each cycle one span is accepted, into the FIFO before its pipeline. A full FIFO stops the port. So the
    pixels in a cycle are at most the mean number of pixels of a span. They are fewer if many spans in a row
    go to one pipeline. Spans triangle by triangle go from scanline to scanline, and keep all pipelines busy.
    A frame sorted by scanlines keeps only one pipeline busy if a scanline has more spans than a FIFO holds.

    A write goes to all pipelines. It is accepted when no span is in a FIFO or a pipeline. No span is accepted
    while a write waits. The first pixel leaves an idle unit `latency` cycles after its span was accepted.
    Every pipeline has its own frame constants. If the material changes, a pipeline waits only for its own
    spans.

    Counters of ``status`` are the sums of the pipelines' counters. Like the pipelines' counters they stop at
    their largest value. Each doubling of the number of pipelines adds a cycle to the latency of the sums.

    Parameters
    ----------
    model : PixelPipelines
        Bit-accurate model.
    waiting : int
        Spans that wait before a pipeline, 3 or more.

    Raises
    ------
    ValueError
        If the method is not built for the setup interval.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape(design)))`
        Spans.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits))).array(pipes)`
        Pixels of each pipeline.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants; see `FrameConstantsUnit` for the addresses.
    status : :py:`Out(status_shape())`
        Counters.

    Source: docs/theory/units.md#pipeline.
    """

    def __init__(self, model: PixelPipelines | None = None, waiting: int = WAITING_SPANS):
        self.model = p = model or PixelPipelines()
        self._waiting = waiting
        super().__init__(
            {
                "i": In(stream.Signature(span_shape(p.design))),
                "o": Out(stream.Signature(pixel_shape(p.design.x_bits, p.design.y_bits))).array(p.pipes),
                "write": In(stream.Signature(write_shape())),
                "status": Out(status_shape()),
            }
        )
        self.pipelines = tuple(ShadingPipelineUnit(p.design) for _ in range(p.pipes))
        first = self.pipelines[0]
        self.latency = LATE_FIFO_LATENCY + first.latency
        self.cycles_per_pixel, self.setup_interval = first.cycles_per_pixel, first.setup_interval

    @property
    def spans_inside(self) -> int:
        """Largest number of spans inside one pipeline and its FIFO."""
        return self.pipelines[0].spans_inside + self._waiting + _BEHIND

    def elaborate(self, platform):
        """A FIFO and a pipeline for each remainder of y, writes to all pipelines, and sums of counters."""
        m = Module()
        span, write = self.i, self.write
        pipe = span.payload.y[: (len(self.pipelines) - 1).bit_length()]
        drained, idle, room = Signal(), [], []
        for k, pipeline in enumerate(self.pipelines):
            m.submodules[f"pipeline_{k}"] = pipeline
            given = span.signature.create(path=(f"given_{k}",))
            m.d.comb += [
                given.payload.eq(span.payload),
                given.valid.eq(span.valid & ~write.valid & (pipe == k)),
                Value.cast(pipeline.write.payload).eq(write.payload.as_value()),
                pipeline.write.valid.eq(write.valid & drained),
            ]
            empty = connect_late_fifo(m, f"spans_{k}", given, pipeline.i, self._waiting)
            connect(m, pipeline.o, wiring.flipped(self.o[k]))
            idle.append(empty & pipeline.write.ready)
            room.append(given.ready | (pipe != k))
        m.d.comb += [
            # Ready does not depend on a payload that is not valid, because its bits may be unknown.
            span.ready.eq(~write.valid & (~span.valid | reduce(and_, room))),
            write.ready.eq(drained),
        ]
        # While a write waits, no span comes. So a drained pipeline stays drained.
        m.d.sync += drained.eq(write.valid & reduce(and_, idle))
        self._count(m)
        return m

    def _count(self, m: Module) -> None:
        """Sum the pipelines' counters in pairs, with a register for each sum."""
        each = [pipeline.status for pipeline in self.pipelines]
        for name in self.status.shape().members:
            counts = [status[name] for status in each]
            while len(counts) > 1:
                sums = []
                for a, b in zip(counts[::2], counts[1::2], strict=True):
                    total, size = Signal(len(a), name=f"sum_{name}"), len(a)
                    if size == 1:
                        m.d.sync += total.eq(a | b)
                    else:
                        m.d.sync += total.eq((a + b)[:size] | (a + b)[size].replicate(size))
                    sums.append(total)
                counts = sums
            m.d.comb += self.status[name].eq(counts[0])


class _JoinedPipelines(wiring.Component):
    """`PixelPipelinesUnit` with one output stream, which a unit makes from the pipelines' pixels.

    Parameters
    ----------
    model, waiting
        Those of `PixelPipelinesUnit`.
    joins : type
        Unit that joins the pixels. It takes the number of pipelines and the bits of x and of y.
    shape : callable
        Function that makes the shape of the stream's payload from the same three numbers.
    """

    def __init__(self, model, waiting: int, joins: type, shape: Callable[[int, int, int], ShapeLike]):
        self.pipelines = PixelPipelinesUnit(model, waiting)
        self.model = p = self.pipelines.model
        size = p.pipes, p.design.x_bits, p.design.y_bits
        self._join = joins(*size)
        # The FIFO of turns costs no cycle: a turn is there before the first pixel of its span comes.
        self.latency = self.pipelines.latency + self._join.latency
        members = dict(self.pipelines.signature.members)
        super().__init__(members | {"o": Out(stream.Signature(shape(*size)))})


class WidePipelinesUnit(_JoinedPipelines):
    """`PixelPipelinesUnit` with one wide stream of the pixels of all pipelines, for simulation.

    No pipeline waits for another. The first pixel leaves an idle unit `latency` cycles after its span was
    accepted.

    Parameters
    ----------
    model, waiting
        Those of `PixelPipelinesUnit`.

    Members
    -------
    i, write, status
        Those of `PixelPipelinesUnit`.
    o : :py:`Out(stream.Signature(joined_shape(pipes, x_bits, y_bits)))`
        Pixels that leave on one cycle.

    Source: docs/theory/units.md#pipeline.
    """

    def __init__(self, model: PixelPipelines | None = None, waiting: int = WAITING_SPANS):
        super().__init__(model, waiting, PixelJoinerUnit, joined_shape)

    def elaborate(self, platform):
        """The pipelines, and the unit that joins the pixels of a cycle to one beat."""
        m = Module()
        m.submodules.pipelines, m.submodules.lanes = pipelines, lanes = self.pipelines, self._join
        connect(m, wiring.flipped(self.i), pipelines.i)
        connect(m, wiring.flipped(self.write), pipelines.write)
        m.d.comb += self.status.eq(pipelines.status)
        for pixels, lane in zip(pipelines.o, lanes.i, strict=True):
            connect(m, pixels, lane)
        connect(m, lanes.o, wiring.flipped(self.o))
        return m


class MergedPipelinesUnit(_JoinedPipelines):
    """`PixelPipelinesUnit` with one stream of pixels, in the order in which one pipeline gives them.

    The unit gives at most a pixel a cycle. So several pipelines gain speed only if each takes several cycles
    for a pixel, as in the compact style.

    Parameters
    ----------
    model, waiting
        Those of `PixelPipelinesUnit`.

    Members
    -------
    i, write, status
        Those of `PixelPipelinesUnit`.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels.

    Source: docs/theory/units.md#pipeline.
    """

    def __init__(self, model: PixelPipelines | None = None, waiting: int = WAITING_SPANS):
        super().__init__(model, waiting, PixelMergerUnit, lambda pipes, *bits: pixel_shape(*bits))
        self.cycles_per_pixel = self.pipelines.cycles_per_pixel
        self.setup_interval = self.pipelines.setup_interval

    def elaborate(self, platform):
        """The pipelines, a FIFO of the pipelines that the spans went to, and the merger."""
        m = Module()
        m.submodules.pipelines, m.submodules.merger = pipelines, merger = self.pipelines, self._join
        turn = merger.turns.payload
        m.submodules.turns = turns = fifo.SyncFIFOBuffered(width=len(turn), depth=pipelines.spans_inside)
        m.d.comb += [
            Value.cast(pipelines.i.payload).eq(self.i.payload.as_value()),
            pipelines.i.valid.eq(self.i.valid & turns.w_rdy),
            self.i.ready.eq(pipelines.i.ready & turns.w_rdy),
            turns.w_data.eq(self.i.payload.y),
            turns.w_en.eq(self.i.valid & pipelines.i.ready & (self.i.payload.length != 0)),
            turn.eq(turns.r_data),
            merger.turns.valid.eq(turns.r_rdy),
            turns.r_en.eq(merger.turns.ready),
            self.status.eq(pipelines.status),
        ]
        connect(m, wiring.flipped(self.write), pipelines.write)
        for pixels, lane in zip(pipelines.o, merger.i, strict=True):
            connect(m, pixels, lane)
        connect(m, merger.o, wiring.flipped(self.o))
        return m
