"""Geometry ([T] figure 4.10): triangles to spans."""

from dataclasses import replace

from amaranth.hdl import Array, Cat, Module, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.build import Build
from blysk.golden.geometry.geometry import COUNTERS, Geometry
from blysk.golden.geometry.plane_assembler import PlaneAssembler
from blysk.golden.geometry.span_halver import SpanHalver
from blysk.golden.geometry.triangles import ATTRIBUTES
from blysk.golden.geometry.vector_adapter import VectorAdapter
from blysk.hdl.core.memory import LUT_WORDS, UNCOUNTED, connect_late_fifo, connect_wide_fifo
from blysk.hdl.core.ring import next_turn
from blysk.hdl.core.single_register import connect_register, hold_output
from blysk.hdl.core.stream import connect, moving
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.attribute_serialiser import AttributeSerialiserUnit, serial_attribute_shape
from blysk.hdl.geometry.edge_normals import EdgeNormalsUnit, true_spans_shape
from blysk.hdl.geometry.edge_setup import EdgeSetupUnit
from blysk.hdl.geometry.edge_walk import EdgeWalkUnit, walk_shape
from blysk.hdl.geometry.gradient_setup import GradientSetupUnit
from blysk.hdl.geometry.plane_assembler import PlaneAssemblerUnit, plane_shape, planes_shape
from blysk.hdl.geometry.plane_setup import PlaneSetupUnit, scales_shape
from blysk.hdl.geometry.serial_vectors import SerialVectorsUnit
from blysk.hdl.geometry.serial_vertex_sort import SerialVertexSortUnit
from blysk.hdl.geometry.span_adapter import LineAdapterUnit, line_spans_shape
from blysk.hdl.geometry.span_attributes import SpanAttributesUnit
from blysk.hdl.geometry.span_clip import SpanClipUnit
from blysk.hdl.geometry.span_halver import SpanHalverUnit
from blysk.hdl.geometry.surface_words import attribute_count, placement_of
from blysk.hdl.geometry.triangles import counters_shape, frame_shape, triangle_shape
from blysk.hdl.geometry.vector_adapter import VectorAdapterUnit, vector_spans_shape
from blysk.hdl.geometry.vertex_sort import VertexSortUnit, sorted_triangle_shape

__all__ = ["PORT_DESCRIPTIONS", "GeometryUnit"]

PORT_DESCRIPTIONS = {
    "normal_left": "first pixel: unit normal (in SQ(1, 17)) or N/W of a true line (in SQ(1, 22))",
    "normal_right": "last pixel: unit normal (in SQ(1, 17)) or N/W of a true line (in SQ(1, 22))",
    "start": "N/W at the first pixel, in the frame of the light",
    "step": "step of N/W to the next pixel, times 2^o_exponent",
    "exponent": "exponent of o_step, 0 to 15",
    "attributes_start": "attributes of the surface at the first pixel, times s; the last word is s",
    "attributes_step": "step of these words to the next pixel, times 2^o_attributes_exponent",
    "attributes_exponent": "exponent of o_attributes_step, 0 to 9",
    "attributes_base": "base of u or v: whole texel from which it is counted",
    "attributes_range": "range of u or v: the coordinate is base + attribute 2^range texels",
    "attributes_level": "level of the texture",
    "line_left": "N/W at the first pixel",
    "line_right": "N/W at the last pixel",
    "x": "column of the first pixel",
    "y": "row of the span",
    "length": "number of pixels of the span",
    "depth": "depth at the first pixel",
    "depth_last": "depth at the last pixel",
    "depth_step": "step of the depth from a pixel to the next",
    "flip": "1 if the span is of a back face, whose normals have been negated",
    "material": "index of the triangle's material",
}
"""Fields of a span, for the table in Verilog."""

BLOCK_WORDS = 64
"""Least number of words of a memory in a block RAM. A memory of fewer words takes look-up tables."""

_COMPACT_GRADIENT = 12
"""Initiation interval of an attribute in the compact style: the number of its products."""

_INSIDE_BITS = 10
"""Bits of the counters of triangles.

The counters wrap. Their difference is right, because fewer than 2^10 triangles are inside the unit.
"""


_ADDED = "sliver", "empty"
"""Counters of several units, or of several lanes."""


class _TriangleSetup(wiring.Component):
    """A lane of `GeometryUnit`. From sorted triangles it makes planes, and edges for the walk.

    Parameters
    ----------
    model : Geometry
        Bit-accurate model.
    compact : bool
        Whether the unit has the compact style.
    """

    def __init__(self, model: Geometry, compact: bool):
        self._compact, skid = compact, not compact
        grid, surface, cuts = model.grid, model.surface, not (model.lines or model.vectors)
        self._count = attribute_count(surface)
        self._serialiser = AttributeSerialiserUnit(skid, surface)
        self._edges = EdgeSetupUnit(grid, 1 if compact else 3, 2, skid=skid)
        interval = self._edges.initiation_interval
        self._planes = PlaneSetupUnit(grid, interval, skid)
        self._gradients = GradientSetupUnit(_COMPACT_GRADIENT if compact else interval // ATTRIBUTES)
        self.interval = max(interval, self._count * self._gradients.initiation_interval)
        self._assembler = PlaneAssemblerUnit(PlaneAssembler(cuts=cuts), compact, self._count)
        self.multipliers = self._planes.multipliers + self._gradients.multipliers
        super().__init__(
            {
                "i": In(stream.Signature(sorted_triangle_shape(grid, surface))),
                "walks": Out(stream.Signature(walk_shape(grid))),
                "planes": Out(stream.Signature(plane_shape() if compact else planes_shape(self._count))),
                "constants": In(frame_shape()),
                "sliver": Out(1),
                **({"again": In(1)} if compact else {}),
            }
        )

    def elaborate(self, platform):
        """The units, and the FIFOs or registers between them."""
        m = Module()
        for name in ("serialiser", "edges", "planes", "gradients", "assembler"):
            m.submodules[name] = getattr(self, f"_{name}")
        serialiser, edges, planes = self._serialiser, self._edges, self._planes
        drawn = wiring.flipped(self.i)
        m.d.comb += copy(self._assembler.constants, self.constants)
        if self._compact:
            # The serialiser takes a triangle some cycles later than the edge setup.
            _fork_apart(m, drawn, edges.i, serialiser.i)
        else:
            _fork(m, drawn, edges.i, serialiser.i)
        for to in (edges.i.payload, serialiser.i.payload):
            m.d.comb += copy_fields(to, drawn.payload)

        # Largest number of triangles whose edges wait for their planes at once.
        delay = planes.latency + self._gradients.latency + self._count * self._gradients.initiation_interval
        inside = delay // self.interval + 3
        corners, walks = _between("corners", planes.i), _between("walk", self.walks)
        _fork(m, edges.o, corners, walks)
        for to in (corners.payload, walks.payload):
            m.d.comb += copy_fields(to, edges.o.payload)
        # These registers end the combinational chain of readies from the assembler to the sort.
        connect_register(m, "waiting_corners", corners, planes.i)
        if self._compact:
            connect_register(m, "waiting_walk", walks, wiring.flipped(self.walks))
        else:
            depth = max(inside + UNCOUNTED, BLOCK_WORDS)
            connect_late_fifo(m, "waiting_walks", walks, wiring.flipped(self.walks), depth)

        ahead = (edges.latency + planes.latency) // self.interval + 3
        attributes, scales = _between("attribute", serialiser.o), _between("scale", planes.o)
        if self._compact:
            # The first attributes of a triangle have left before those of the next but one come.
            depth = max(self._count * (ahead - 1), LUT_WORDS)
            connect_wide_fifo(m, "waiting_attributes", serialiser.o, attributes, depth)
        else:
            depth = max(self._count * ahead + UNCOUNTED, BLOCK_WORDS)
            connect_late_fifo(m, "waiting_attributes", serialiser.o, attributes, depth)
        # While the gradients of a triangle are computed, the plane setup goes on with the next triangle.
        connect_register(m, "waiting_scale", planes.o, scales)
        to, turn = self._gradients.i, Signal(range(self._count), name="turn")
        moves = to.valid & to.ready
        with m.If(moves):
            m.d.sync += turn.eq(next_turn(turn, self._count))
        m.d.comb += [
            to.valid.eq(attributes.valid & scales.valid),
            attributes.ready.eq(to.ready & scales.valid),
            scales.ready.eq(moves & (turn == self._count - 1)),
            *copy_fields(to.payload, attributes.payload, serial_attribute_shape().members),
            *copy_fields(to.payload, scales.payload, scales_shape()),
        ]
        m.d.sync += self.sliver.eq(scales.ready & scales.payload.sliver)
        connect(m, self._gradients.o, self._assembler.i)
        connect(m, self._assembler.o, wiring.flipped(self.planes))
        if self._compact:
            m.d.comb += self._assembler.again.eq(self.again)
        return m


class GeometryUnit(wiring.Component):
    """Triangles to spans, a triangle in 4, 8 or 16 cycles and up to a span a cycle. `Geometry` is the model.

    The unit has the units of this package in a row. The corners of a sorted triangle go to the edge setup.
    They also go to a FIFO, one attribute after the other. There the attributes wait for the scales of their
    triangle. The edges wait in a FIFO for the planes of their triangle. With several lanes a triangle waits
    before each lane, so no lane keeps the other lane from its turn.

    In the *compact* style one divider serves all edges. One multiplier serves the gradients of all
    attributes. Attributes also take turns along the spans, and the normals of a span take turns. With vectors
    one unit cuts a span and makes the words of its pieces. In this style only the attributes have a FIFO in
    the setup. The planes of two triangles are in a memory, and other words wait in registers. The sort keeps
    a triangle until all its attributes are in the FIFO.

    The units work on several triangles at the same time, and the slowest unit sets the pace. A triangle
    takes:

    - in the setup `interval` cycles if it is drawn: 16, or 48 in the compact style, divided by the number of
      lanes. Each attribute of a surface, and its 1/W, adds 4 cycles, or 12 in the compact style. A triangle
      that the sort drops takes a cycle (`VertexSortUnit`), or 5 to 15 in the compact style
      (`SerialVertexSortUnit`);
    - in the walk `row_cycles` for each scanline without pixels in the picture: 1, or the number of attributes
      in the compact style. In the throughput style a triangle takes one more cycle there;
    - for a span or piece of p pixels as many cycles as ``p - 1`` has bits. The least is 1 cycle for 1 pixel,
      2 cycles for 2 pixels and 3 cycles for more. With ``lines`` or ``vectors`` the least is 1 cycle for any
      number of pixels. So a span takes no more cycles than it has pixels. Only with ``vectors`` spans of one
      pixel take up to 1.5 cycles each, because the halver takes two spans in three cycles. If n pixels are
      cut off at the long edge, the scanline takes one more cycle for each bit of n. In the compact style a
      scanline takes a cycle for each attribute, four without a surface, and as many more for every two of
      these bits. At the same time the normals take three cycles each. With ``vectors`` a span takes three
      more cycles for each piece behind the first, and each time that a piece does not fit (`SpanHalverUnit`).
      In the compact style a piece takes 13 cycles or more at the same time, and with a surface 3 more for
      each of its attributes (`SerialVectorsUnit`).

    The number of multipliers is `multipliers`: 16, or 5 in the compact style. With ``lines`` or ``vectors``
    it is 10, or 2 in the compact style. Each further lane adds 4, or 2 in the compact style.

    Parameters
    ----------
    model : Geometry
        Bit-accurate model: grid, and kind of spans.
    build : Build
        Style of the geometry, and ``setups``: the number of lanes, which triangles take in turns. A lane goes
        from the edges to the planes.

    Members
    -------
    i : :py:`In(stream.Signature(triangle_shape(grid, model.surface)))`
        Triangles.
    o : :py:`Out(stream.Signature(true_spans_shape()))`
        Spans of the triangles. Their shape is `line_spans_shape` with ``lines``, and
        `vector_spans_shape` with ``vectors``.
    constants : :py:`In(frame_shape())`
        The frame, constant while triangles are inside.
    status : :py:`Out(counters_shape(*COUNTERS))`
        Counters since the reset.

    Attributes
    ----------
    idle : Signal
        High while no triangle and no span is inside. It rises one cycle after the last triangle or
        span has left.

    Source: docs/theory/geometry.md#composition; [T] figure 4.10.
    """

    def __init__(self, model: Geometry | None = None, build: Build | None = None):
        model, build = model or Geometry(), build or Build(top="geometry")
        self.grid, self.compact = model.grid, build.compact_geometry
        sort = SerialVertexSortUnit if self.compact else VertexSortUnit
        self.model = replace(model, tested=sort.tested)
        self.row_cycles = attribute_count(self.model.surface) if self.compact else 1
        self.lines, self.vectors = self.model.lines, self.model.vectors
        self.rotates = self.model.rotates
        grid, compact, lines, vectors = self.grid, self.compact, self.lines, self.vectors
        self._surface = surface = self.model.surface
        self._sort = sort(grid, surface)
        self._lanes = [_TriangleSetup(self.model, compact) for _ in range(build.setups)]
        self.interval = -(-self._lanes[0].interval // build.setups)
        self._attributes, self._walk, self._clip = (
            SpanAttributesUnit(compact, vectors, surface),
            EdgeWalkUnit(grid, skid=not compact),
            SpanClipUnit(skid=not compact),
        )
        if lines:
            self._normals, shape = LineAdapterUnit(), line_spans_shape()
        elif vectors:
            shape = vector_spans_shape(surface)
            if compact:
                # One unit cuts spans and makes their words.
                self._normals = self._halver = SerialVectorsUnit(self.rotates, surface)
            else:
                self._normals = VectorAdapterUnit(VectorAdapter(self.rotates), surface)
                self._halver = SpanHalverUnit(SpanHalver(self.rotates), surface)
        else:
            self._normals, shape = EdgeNormalsUnit(compact=compact), true_spans_shape()
        normaliser = 0 if lines or vectors else self._normals.multipliers
        self.multipliers = sort.multipliers + sum(lane.multipliers for lane in self._lanes) + normaliser
        super().__init__(
            {
                "i": In(stream.Signature(triangle_shape(grid, surface))),
                "o": Out(stream.Signature(shape)),
                "constants": In(frame_shape()),
                "status": Out(counters_shape(*COUNTERS)),
            }
        )
        self.idle = Signal(name="idle")

    def elaborate(self, platform):
        """The units, the FIFOs between them, and the counters."""
        m = Module()
        for name in ("sort", "attributes", "walk", "clip", "normals"):
            m.submodules[name] = getattr(self, f"_{name}")
        for k, lane in enumerate(self._lanes):
            m.submodules[f"setup_{k}"] = lane
        for unit in (self._sort, self._walk, self._clip, *self._lanes):
            m.d.comb += copy(unit.constants, self.constants)
        connect(m, wiring.flipped(self.i), self._sort.i)
        if self.compact:
            # Whether the scanline is not the last of its triangle.
            self._again = Signal(name="again")
            m.d.comb += [lane.again.eq(self._again) for lane in self._lanes]
        walks, planes = self._set_up(m)
        connect(m, walks, self._walk.i)
        connect(m, self._walk.o, self._clip.i)
        rows = self._walk_planes(m, planes)
        made = self._attributes.o
        if self.vectors and not self.compact:
            m.submodules.halver = self._halver
            connect(m, made, self._halver.i)
            made = self._halver.o
        connect(m, made, self._normals.i)
        connect(m, self._normals.o, wiring.flipped(self.o))
        self._count(m)
        self._watch(m, rows)
        return m

    def _set_up(self, m: Module) -> tuple[stream.Interface, stream.Interface]:
        """Connect the sort and the lanes. Returns the edges for the walk and the planes, merged in turns."""
        drawn = _between("drawn", self._sort.o)
        connect(m, self._sort.o, drawn)
        drawn = self._put_placement_aside(m, drawn)
        lanes = self._lanes
        if len(lanes) == 1:
            connect(m, drawn, lanes[0].i)
            return lanes[0].walks, lanes[0].planes
        turn = _turns(m, "lane", drawn, len(lanes))
        # A triangle waits before each lane. Without these registers, lanes that accept on the same cycles
        # would together have the rate of one lane.
        dealt = [_between(f"dealt_{k}", drawn) for k in range(len(lanes))]
        for k, (to, lane) in enumerate(zip(dealt, lanes, strict=True)):
            m.d.comb += [to.payload.eq(drawn.payload), to.valid.eq(drawn.valid & (turn == k))]
            connect_register(m, f"waiting_{k}", to, lane.i)
        m.d.comb += drawn.ready.eq(Array(to.ready for to in dealt)[turn])
        merged = []
        for name in ("walks", "planes"):
            sources = [getattr(lane, name) for lane in lanes]
            joined = _between(name, sources[0])
            serial = self.compact and name == "planes"
            last = ~self._again if serial else None
            turn = _turns(m, name, joined, len(lanes), ATTRIBUTES if serial else 1, last)
            m.d.comb += [
                joined.valid.eq(Array(source.valid for source in sources)[turn]),
                Value.cast(joined.payload).eq(Array(Value.cast(source.payload) for source in sources)[turn]),
                *(source.ready.eq(joined.ready & (turn == k)) for k, source in enumerate(sources)),
            ]
            merged.append(joined)
        return tuple(merged)

    def _put_placement_aside(self, m: Module, drawn: stream.Interface) -> stream.Interface:
        """Sorted triangles. The place of their textures waits in a FIFO until the triangle is walked."""
        members, self._placements = placement_of(self._surface), None
        if not members:
            return drawn
        goes = _between("placed", drawn)
        waits = stream.Signature(data.StructLayout(members))
        entering, self._placements = waits.create(path=("placement",)), waits.create(path=("placement_out",))
        _fork(m, drawn, goes, entering)
        m.d.comb += [copy(goes.payload, drawn.payload), *copy_fields(entering.payload, drawn.payload)]
        connect_late_fifo(m, "placements", entering, self._placements, BLOCK_WORDS)
        return goes

    def _walk_planes(self, m: Module, planes: stream.Interface) -> stream.Interface:
        """Connect scanlines and planes to the attributes; a triangle's first scanline waits for its planes.

        Returns the scanlines as the attributes take them.
        """
        rows, to = self._clip.o, self._attributes.i
        if self.compact:
            clipped, rows = rows, _between("row", rows)
            full, row = Signal(name="row_full"), Signal.like(clipped.payload, name="row", reset_less=True)
            free = hold_output(m, rows, full, row)
            m.d.comb += clipped.ready.eq(free)
            with m.If(free):
                m.d.sync += [full.eq(clipped.valid), row.eq(clipped.payload)]
            count = attribute_count(self._surface)
            lane = Signal(range(count), name="lane")
            with m.If(to.valid & to.ready):
                m.d.sync += lane.eq(next_turn(lane, count))
            m.d.comb += [
                copy(to.payload.planes, planes.payload),
                to.valid.eq(rows.valid & planes.valid),
                rows.ready.eq(to.ready & planes.valid & (lane == count - 1)),
                planes.ready.eq(to.ready & rows.valid),
                self._again.eq(~rows.payload.last),
            ]
        else:
            # The planes leave a cycle before the scanline, so that their place is free for the next planes.
            m.d.comb += [
                copy(to.payload.planes, planes.payload),
                to.valid.eq(rows.valid & (planes.valid | ~self._attributes.due)),
                rows.ready.eq(to.ready),
                planes.ready.eq(self._attributes.reads),
            ]
        if self._placements is None:
            m.d.comb += copy(to.payload.row, rows.payload)
        else:
            # The planes of a triangle come many cycles after its placement.
            m.d.comb += [
                *copy_fields(to.payload.row, rows.payload, rows.payload.shape().members),
                *copy_fields(to.payload.row, self._placements.payload, placement_of(self._surface)),
                self._placements.ready.eq(rows.valid & rows.ready & rows.payload.last),
            ]
        return rows

    def _watch(self, m: Module, rows: stream.Interface) -> None:
        """Drive `idle`. Triangles are inside until their last scanline, and pieces until they leave."""
        sort = self._sort
        dropped = sum(sort.status[name] for name in ("empty", "zero_area", "culled"))[:_INSIDE_BITS]
        taken, walked = (Signal(_INSIDE_BITS, name=name) for name in ("taken", "walked"))
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += taken.eq(taken + 1)
        with m.If(rows.valid & rows.ready & rows.payload.last):
            m.d.sync += walked.eq(walked + 1)
        made, idle = self._attributes, self._attributes.idle
        if self.vectors:
            made, idle = self._halver, idle & self._halver.idle
        if made is not self._normals:
            idle &= ~moving(m, "pieces", made.o, self.o)
        idle &= ~self._changes.any()
        m.d.comb += self.idle.eq(((taken - walked)[:_INSIDE_BITS] == dropped) & idle)

    def _count(self, m: Module) -> None:
        """Counters of the units. A counter that two units have is counted again from their lowest bits.

        So only this bit of a unit's counter takes cells, unless the other bits are used elsewhere.
        """
        sliver, empty = (Signal(unsigned(len(self.status[name])), name=f"{name}s") for name in _ADDED)
        sort, attributes = self._sort.status, self._attributes.status
        lowest, before = Cat(sort.empty[0], attributes.empty[0]), Signal(2, name="counted")
        self._changes = lowest ^ before
        m.d.sync += [
            before.eq(lowest),
            sliver.eq(sliver + sum(lane.sliver for lane in self._lanes)),
            empty.eq(empty + sum(self._changes)),
        ]
        m.d.comb += [
            self.status.empty.eq(empty),
            self.status.zero_area.eq(sort.zero_area),
            self.status.culled.eq(sort.culled),
            self.status.sliver.eq(sliver),
            self.status.cut.eq(self._halver.status.cut if self.vectors else attributes.cut),
            self.status.repaired.eq(0 if self.lines or self.vectors else self._normals.status.repaired),
        ]


def _between(name: str, port: stream.Interface) -> stream.Interface:
    """A stream between two units, with the payload shape of ``port``."""
    return stream.Signature(port.payload.shape()).create(path=(name,))


def _turns(
    m: Module, name: str, moving: stream.Interface, count: int, each: int = 1, counts: Value | None = None
) -> Signal:
    """Index of the lane whose turn it is. The next lane follows after ``each`` payloads, a power of two.

    If ``counts`` is given, other payloads do not count.
    """
    passed = Signal(range(count * each), name=f"turn_of_{name}")
    moves = moving.valid & moving.ready
    with m.If(moves if counts is None else moves & counts):
        m.d.sync += passed.eq(passed + 1)
    return passed[each.bit_length() - 1 :]


def _fork(m: Module, source: stream.Interface, first: stream.Interface, second: stream.Interface) -> None:
    """Fork a stream: two streams take its payload on the same cycle. The caller connects the fields."""
    m.d.comb += [
        first.valid.eq(source.valid & second.ready),
        second.valid.eq(source.valid & first.ready),
        source.ready.eq(first.ready & second.ready),
    ]


def _fork_apart(m: Module, source: stream.Interface, *streams: stream.Interface) -> None:
    """Fork a stream: others take its payload, each on its own cycle. The caller connects the fields."""
    done = []
    for k, to in enumerate(streams):
        taken = Signal(name=f"taken_{k}")
        m.d.comb += to.valid.eq(source.valid & ~taken)
        done.append(taken | to.ready)
        m.d.sync += taken.eq(source.valid & done[-1] & ~source.ready)
    m.d.comb += source.ready.eq(Cat(done).all())
