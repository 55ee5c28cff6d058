"""Triangles to pixels: geometry, shading and depth test."""

from itertools import pairwise

from amaranth.hdl import Const, Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.build import Build
from blysk.golden.geometry.geometry import COUNTERS
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.render import Renderer
from blysk.golden.video.mesh_memory import BLOCK_WORDS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import LUT_WORDS, UNCOUNTED, connect_late_fifo
from blysk.hdl.core.serial_fifo import connect_serial_fifo
from blysk.hdl.core.single_register import connect_register
from blysk.hdl.core.stream import connect, moving
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.frame_constants import write_shape
from blysk.hdl.geometry.coarse_depth import CoarseDepthUnit
from blysk.hdl.geometry.depth_lanes import DepthLanesUnit
from blysk.hdl.geometry.depth_tester import DepthTesterUnit
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.geometry.light_adapter import LightAdapterUnit, with_components
from blysk.hdl.geometry.mirror_adapter import MirrorAdapterUnit
from blysk.hdl.geometry.span_adapter import connect_shading_span
from blysk.hdl.geometry.triangles import COUNTER_BITS, counters_shape, frame_shape, triangle_shape
from blysk.hdl.pipeline import SPACED, ShadingPipelineUnit
from blysk.hdl.port_descriptions import COUNTER_TEXTS, LANE_DESCRIPTIONS, TEXTURE_TEXTS

__all__ = [
    "PORT_DESCRIPTIONS",
    "STATUS",
    "WAITING_SPANS",
    "WAITING_WORDS",
    "RendererUnit",
    "port_descriptions",
    "waiting_spans",
]

STATUS = (*COUNTERS, "spans", "pixels", "hidden", "dropped", "out_of_range_spans")
"""Counters of `RendererUnit`."""

PORT_DESCRIPTIONS = {
    "i_x": "columns of the three corners; the corners have any order",
    "i_y": "rows of the three corners",
    "i_depth": "depths of the three corners; a smaller depth is nearer",
    "i_normal": "N/W of the corners; first index: corner, second index: component",
    "i_surface": "attributes of the surface, listed above; first index: corner, second index: attribute",
    **{f"i_{name}": text for name, text in TEXTURE_TEXTS.items()},
    "i_material": "index of the triangle's material; an index past the last material counts as the last",
    "i_two_sided": "read if back_faces is 2: 1 turns the normals of a back face, 0 culls the face",
    "o_x": "column of the pixel",
    "o_y": "row of the pixel",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_depth": "depth of the pixel",
    "write_address": "address of the frame constant to write, from the list above",
    "write_data": "code of the frame constant; the core accepts it when no span is inside",
    "constants_left": "first column of the picture on the grid; o_x counts from it",
    "constants_top": "first row of the picture on the grid; o_y counts from it",
    "constants_right": "column after the last column",
    "constants_bottom": "row after the last row",
    "constants_back_faces": "treatment of back faces: 0 flip, 1 show, 2 cull",
    "constants_limit": "largest chord between the unit normals of a span's ends, in 1/1024",
    "constants_picture": "bit; change it for each picture: a change clears the depths",
    **{f"status_{name}": COUNTER_TEXTS[name] for name in STATUS},
    "memory_read_place": "pixel whose depth is read",
    "memory_read_enable": "1 reads a depth; with 0 memory_read_data stays",
    "memory_read_data": "depth at memory_read_place, one clock later",
    "memory_write_place": "pixel whose depth is written",
    "memory_write_enable": "1 writes memory_write_data",
    "memory_write_data": "depth for memory_write_place; all ones while the core clears the memory",
}
"""Ports of a unit without a ``size`` (the memory of its depths is outside), for the table in Verilog."""


def port_descriptions(lanes: int = 1) -> dict[str, str]:
    """`PORT_DESCRIPTIONS` of a unit with a number of lanes."""
    if lanes == 1:
        return PORT_DESCRIPTIONS
    texts = dict(PORT_DESCRIPTIONS)
    for name in ("o_r", "o_g", "o_b", "o_depth"):
        del texts[name]
    texts |= {
        "o_x": LANE_DESCRIPTIONS["o_x"],
        "o_y": LANE_DESCRIPTIONS["o_y"],
        "o_present": "a bit for each lane with a pixel to write; at least one lane has a pixel",
        "o_colors": LANE_DESCRIPTIONS["o_colors"],
        "o_depths": "depth of the pixel of a lane; 0 without a pixel",
    }
    for name in [name for name in texts if name.startswith("memory_")]:
        text, beside = texts.pop(name), f"; x is its column div {lanes}" if name.endswith("place") else ""
        for bank in range(lanes):
            of_bank = f"memory_{bank}_"
            texts[name.replace("memory_", of_bank)] = text.replace("memory_", of_bank) + beside
    return texts


_DEEP = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
"""Words of a span for the depth test. Shading does not take them."""

_COMPONENTS = 3
"""Components of a vector of geometry."""

WAITING_SPANS = 512
"""Spans that may wait between geometry and shading, in a FIFO of block RAMs.

While geometry sets up small triangles or cuts spans, shading works on the waiting spans. While shading works
on long spans, geometry goes on. The compact style has another FIFO if spans have vectors (`WAITING_WORDS`).
In other compact designs this FIFO is there only with a coarse test. Without the test one span waits in a
register.
"""

WAITING_WORDS = BLOCK_WORDS
"""Words of a span's parts that may wait in the compact style, if spans have vectors: a single block RAM.

Geometry then takes 13 cycles or more for a span. So parts of spans are written and read one a cycle. The
block RAM holds 85 spans, or 42 with vertex colours. Whole spans would take 6 or 12 block RAMs.
"""

_OF_LANES = 4
"""Factor of `WAITING_SPANS` for several lanes of triangle setup in the throughput style.

They are faster than shading except in runs of triangles of few pixels. For these runs more spans wait.
"""

_BEHIND = 511
"""Limit of the number of spans that are inside behind the FIFO of spans."""


def waiting_spans(build: Build) -> int:
    """Spans that may wait between geometry and shading: `WAITING_SPANS`, or more with several lanes of setup.

    Parameters
    ----------
    build : Build
        Build options of a core from triangles to pixels.
    """
    several = build.setups > 1 and not build.compact_geometry
    return WAITING_SPANS * (_OF_LANES if several else 1)


class RendererUnit(wiring.Component):
    """Turns triangles into the pixels to write. `Renderer` is the bit-accurate model.

    `GeometryUnit` turns triangles into spans, `ShadingPipelineUnit` turns spans into pixels, and
    `DepthTesterUnit` drops hidden pixels. With several lanes a beat has several pixels of a span, and
    `DepthLanesUnit` drops hidden pixels. Spans wait for the pipeline in a FIFO or a register
    (`waiting_spans`, `WAITING_WORDS`). The depths of the spans go beside the pipeline, in another FIFO. With
    a coarse depth test a span also waits for the test's answer. Then the pipeline takes the span, or the unit
    drops it in one cycle. The units work at the same time. If no unit waits for long, a frame takes as many
    cycles as the slowest unit alone. The design's `Build` has the styles, the lanes of triangle setup and the
    coarse test.

    Frame constants are written while no span is inside. If the material changes from a span to the next, the
    next span waits until the pipeline is empty, see `ShadingPipelineUnit`.

    Geometry makes the vectors of a span for the first light. Behind the FIFO up to two units add components:

    - `LightAdapterUnit` for further lights. It has its own memories for their axes;
    - `MirrorAdapterUnit` for highlights of R·V. It reads L of the first light.

    Write the axes and L before the frame's first triangle.

    Parameters
    ----------
    model : Renderer
        Bit-accurate model.
    size : (int, int) or None
        As for `DepthTesterUnit`.
    clears : bool
        Whether the unit clears the memory of depths for each picture, see `DepthTesterUnit`. If it does not,
        it draws only one picture, unless you clear the memory outside between pictures.

    Members
    -------
    i : :py:`In(stream.Signature(triangle_shape(grid, surface)))`
        Triangles.
    o : :py:`Out(stream.Signature(drawn_pixel_shape(x_bits, y_bits)))`
        Pixels to write. With several lanes the payload is ``drawn_beat_shape(x_bits, y_bits, lanes)``.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants of the shading pipeline.
    constants : :py:`In(frame_shape())`
        The picture's borders and options, constant while triangles are inside. If there is a coarse depth
        test or the unit clears the depths, also a bit ``picture``, which changes from picture to picture.
    status : :py:`Out(counters_shape(*STATUS))`
        Counters since the reset.
    memory : :py:`Out(DepthMemory(x_bits, y_bits))`
        Port of the memory of depths. Only without a ``size``. With several lanes a memory for each bank of
        columns, see `DepthLanesUnit`.

    Attributes
    ----------
    idle : Signal
        High while no triangle, span or pixel is inside. It rises a cycle after the last triangle, span or
        pixel has left.

    Source: docs/theory/geometry.md#composition; [T] figure 4.10.
    """

    def __init__(
        self,
        model: Renderer | None = None,
        size: tuple[int, int] | None = None,
        clears: bool = False,
    ):
        self.model = model or Renderer()
        design, geometry = self.model.design, self.model.geometry
        self.geometry = GeometryUnit(geometry, design.build)
        self._serial = self.geometry.compact and self.geometry.vectors
        # A span has six parts or more in the FIFO, so spans leave it eight cycles apart or more.
        self.pipeline = ShadingPipelineUnit(design, SPACED if self._serial else 1)
        self._adapters()
        coarse, bits = self.model.coarse, (design.x_bits, design.y_bits)
        self.coarse = None if coarse is None else CoarseDepthUnit(coarse, *bits)
        self.depth = (
            DepthTesterUnit(*bits, size, clears)
            if design.build.lanes == 1
            else DepthLanesUnit(*bits, size, clears, design.build.lanes)
        )
        members = {
            "i": In(stream.Signature(triangle_shape(geometry.grid, geometry.surface))),
            "o": Out(self.depth.o.signature),
            "write": In(stream.Signature(write_shape())),
            "constants": In(_constants_shape(clears or coarse is not None)),
            "status": Out(counters_shape(*STATUS)),
        }
        if size is None:
            members["memory"] = self.depth.signature.members["memory"]
        super().__init__(members)
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """Connect the three units. On the same cycle a span goes to the pipeline, and its depth to a FIFO."""
        m = Module()
        geometry, pipeline, depth = self.geometry, self.pipeline, self.depth
        m.submodules.geometry, m.submodules.pipeline, m.submodules.depth = geometry, pipeline, depth
        m.d.comb += copy_fields(geometry.constants, self.constants, frame_shape().members)
        connect(m, wiring.flipped(self.i), geometry.i)
        connect(m, wiring.flipped(self.write), pipeline.write)
        connect(m, depth.o, wiring.flipped(self.o))
        if depth.size is None:
            outside = self.memory if len(depth.ports) > 1 else [self.memory]
            for port, memory in zip(depth.ports, outside, strict=True):
                wiring.connect(m, port, wiring.flipped(memory))
        if depth.clears:
            given = self.constants
            m.d.comb += [
                depth.picture.number.eq(given.picture),
                depth.picture.width.eq(given.right - given.left),
                depth.picture.height.eq(given.bottom - given.top),
            ]

        span = stream.Signature(data.StructLayout({"span": self._span, **_DEEP}))
        made, ready = span.create(path=("made",)), span.create(path=("ready",))
        source = geometry.o
        connect_shading_span(m, source.payload, made.payload.span)
        m.d.comb += [
            *copy_fields(made.payload, source.payload, _DEEP),
            made.valid.eq(source.valid & (room := Signal(name="room"))),
            source.ready.eq(made.ready & room),
        ]
        known, drops = self._judge(m, source, room, made.ready, ready)
        room_for = waiting_spans(self.model.design.build)
        if geometry.compact and not geometry.vectors and self.coarse is None:
            # Geometry is slower than shading here, so spans hardly wait. The look-up tables of a FIFO would
            # cost as much as the register that it replaces.
            connect_register(m, "waiting_span", made, ready)
        elif self._serial:
            connect_serial_fifo(m, "spans", made, ready, WAITING_WORDS)
        else:
            connect_late_fifo(m, "spans", made, ready, room_for)
        given, dropped = Signal(name="given"), Signal(name="dropped")
        count = Signal(COUNTER_BITS, name="count_spans")
        with m.If(pipeline.i.valid & pipeline.i.ready):
            m.d.sync += count.eq(count + 1)
        pixel_last = Signal(name="pixel_last")
        spans = moving(m, "spans", made, depth.i, pixel_last, dropped, room_for + _BEHIND)
        m.d.comb += [
            pixel_last.eq(depth.i.payload.pixel.last),
            self.idle.eq(geometry.idle & depth.idle & ~spans),
        ]
        waits = stream.Signature(data.StructLayout(_DEEP))
        entering, waiting = waits.create(path=("entering",)), waits.create(path=("waiting",))
        # There is room whenever the pipeline takes a span. Spans that are apart take fewer words.
        words = LUT_WORDS if self._serial else pipeline.spans_inside + 1 + UNCOUNTED
        connect_late_fifo(m, "depths", entering, waiting, words)
        pixel = pipeline.o
        if compact := self.model.design.build.compact:
            pixel = stream.Signature(pipeline.o.payload.shape()).create(path=("pixel",))
            connect_register(m, "waiting_pixel", pipeline.o, pixel)
        moves = depth.i.valid & depth.i.ready
        taken, there = moves & pixel.payload.last, waiting.valid
        if compact:
            # Pixels are some cycles apart, so a span's depth leaves on the cycle after its last pixel.
            goes = Signal(name="depth_goes")
            m.d.sync += goes.eq(taken)
            taken, there = goes, there & ~goes
        kept = stream.Signature(ready.payload.shape()).create(path=("kept",))
        shaded = self._components(m, kept)
        m.d.comb += [
            copy(kept.payload, ready.payload),
            given.eq(ready.valid & known),
            dropped.eq(given & drops),
            kept.valid.eq(given & ~drops),
            ready.ready.eq(known & (drops | kept.ready)),
            copy(pipeline.i.payload, shaded.payload.span),
            *copy_fields(entering.payload, shaded.payload, _DEEP),
            entering.valid.eq(shaded.valid & pipeline.i.ready),
            pipeline.i.valid.eq(shaded.valid & entering.ready),
            shaded.ready.eq(pipeline.i.ready & entering.ready),
            copy(depth.i.payload.pixel, pixel.payload),
            *copy_fields(depth.i.payload, waiting.payload, _DEEP),
            depth.i.valid.eq(pixel.valid & there),
            pixel.ready.eq(depth.i.ready & there),
            waiting.ready.eq(taken),
            *copy_fields(self.status, geometry.status, COUNTERS),
            self.status.spans.eq(count),
            *copy_fields(self.status, depth.status, ("pixels", "hidden")),
            self.status.out_of_range_spans.eq(pipeline.status.out_of_range_spans),
        ]
        return m

    def _adapters(self) -> None:
        """Make the units for the components of vectors that geometry does not have."""
        span, rows, design = self.pipeline.i.payload.shape(), self.model.rows, self.model.design
        compact, lights = design.build.compact_geometry, design.lights
        self._lights = self._mirror = None
        self._span = span
        if not (rows or self.model.mirrors):
            return
        self._span = with_components(span, _COMPONENTS)
        shape = data.StructLayout(self._span.members | _DEEP)
        if rows:
            self._lights = LightAdapterUnit(lights - 1, rows // (lights - 1), compact, shape)
        if self.model.mirrors:
            self._mirror = MirrorAdapterUnit(compact, with_components(shape, _COMPONENTS + rows))

    def _components(self, m: Module, span: stream.Interface) -> stream.Interface:
        """Spans with all components of their vectors, also for further lights and highlights of R·V."""
        units = []
        if self._lights is not None:
            m.submodules.lights = self._lights
            write = self._lights.write
            m.d.comb += [
                write.payload.eq(self.write.payload),
                write.valid.eq(self.write.valid & self.write.ready),
            ]
            units.append(self._lights)
        if self._mirror is not None:
            m.submodules.mirror = self._mirror
            sine, _, cosine = self.pipeline.direction
            constants = self._mirror.constants
            m.d.comb += [constants.sine.eq(sine), constants.cosine.eq(cosine)]
            units.append(self._mirror)
        if not units:
            return span
        last = units[-1].o
        members = {"span": self.pipeline.i.payload.shape(), **_DEEP}
        made = stream.Signature(data.StructLayout(members)).create(path=("shaded",))
        for (source, of_source), (sink, of_sink) in (
            ((span, _nested), (units[0].i, _flat)),
            *(((before.o, _flat), (after.i, _flat)) for before, after in pairwise(units)),
            ((last, _flat), (made, _nested)),
        ):
            taken, given = of_source(source.payload), of_sink(sink.payload)
            m.d.comb += [
                *copy_fields(given, taken),
                sink.valid.eq(source.valid),
                source.ready.eq(sink.ready),
            ]
        return made

    def _judge(
        self, m: Module, span: stream.Interface, room: Signal, taken: Value, head: stream.Interface
    ) -> tuple[Value, Value]:
        """Whether the first waiting span has its answer of the coarse depth test, and whether it is hidden.

        The coarse depth test also gets the spans of geometry, while it has ``room``. Without the test every
        span counts as answered and visible.
        """
        if self.coarse is None:
            m.d.comb += room.eq(1)
            return Const(1), Const(0)
        m.submodules.coarse = coarse = self.coarse
        place = coarse.i.payload
        # ``number`` changes with the first span of each picture. ``picture`` itself does not serve. After a
        # picture without spans it may have the value that it had at the last span.
        number, before, turned = (Signal(name=name) for name in ("number", "picture_before", "turned"))
        turns = turned | (self.constants.picture != before)
        m.d.sync += [before.eq(self.constants.picture), turned.eq(turns)]
        with m.If(coarse.i.valid & coarse.i.ready):
            m.d.sync += [number.eq(place.picture), turned.eq(0)]
        answers = stream.Signature(1).create(path=("answers",))
        connect_late_fifo(m, "answers", coarse.o, answers, waiting_spans(self.model.design.build))
        m.d.comb += [
            # A design may have fewer bits of coordinates than geometry.
            *(place[name].eq(span.payload[name]) for name in ("x", "y", "length")),
            *copy_fields(place, span.payload, ("depth", "depth_step")),
            place.picture.eq(number ^ turns),
            coarse.i.valid.eq(span.valid & taken),
            room.eq(coarse.i.ready),
            answers.ready.eq(head.valid & head.ready),
            self.status.dropped.eq(count := Signal(COUNTER_BITS, name="count_dropped")),
        ]
        with m.If(answers.ready & answers.valid & answers.payload):
            m.d.sync += count.eq(count + head.payload.span.length)
        return answers.valid, answers.payload


def _flat(payload: data.View) -> dict[str, Value]:
    """Fields by name, of a payload that has a span's words and depths in one structure."""
    return {name: payload[name] for name in payload.shape().members}


def _nested(payload: data.View) -> dict[str, Value]:
    """Fields by name, of a payload that has a span's words in a member ``span``, and the depths beside it."""
    return _flat(payload.span) | {name: payload[name] for name in _DEEP}


def _constants_shape(picture: bool) -> data.StructLayout:
    shape = frame_shape()
    return data.StructLayout(shape.members | {"picture": unsigned(1)}) if picture else shape
