"""Depth test of several lanes: a beat of neighbouring pixels on every cycle."""

from functools import reduce
from itertools import pairwise
from operator import add
from typing import NamedTuple

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from blysk.golden.geometry.depth_lanes import DepthLanes
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.hdl.core.bits import select
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.depth_tester import DepthMemory, DepthTesterUnit, saturated
from blysk.hdl.geometry.triangles import COUNTER_BITS
from blysk.hdl.lighting.intensity import pixel_color_shape
from blysk.hdl.pixel_assembler import beat_shape

__all__ = ["DepthLanesUnit", "deep_beat_shape", "drawn_beat_shape"]


def deep_beat_shape(x_bits: int = 12, y_bits: int = 12, lanes: int = 2) -> data.StructLayout:
    """Shape of a beat with its span's depth and step, which are read with the span's first beat."""
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
    return data.StructLayout({"pixel": beat_shape(x_bits, y_bits, lanes)} | depth)


def drawn_beat_shape(x_bits: int = 12, y_bits: int = 12, lanes: int = 2) -> data.StructLayout:
    """Shape of the pixels to write of a beat.

    - ``x``, ``y``: coordinates of lane 0. Lane k has the pixel at ``x + k``.
    - ``present``: a bit for each lane with a pixel to write. At least one lane has a pixel.
    - ``colors``, ``depths``: colour and depth of each lane; 0 in a lane without a pixel.
    """
    members = dict(beat_shape(x_bits, y_bits, lanes).members)
    del members["last"]
    return data.StructLayout(members | {"depths": data.ArrayLayout(unsigned(DEPTH.width), lanes)})


class _Bank(NamedTuple):
    """Signals of a bank: pixels judged and drawn; the last stage; whether any stage has a pixel."""

    judged: Value
    drawn: Value
    last: data.View
    used: Value


class DepthLanesUnit(DepthTesterUnit):
    """Drops pixels of beats behind the pixels drawn before. `DepthLanes` is the bit-accurate model.

    Column x is in bank ``x mod lanes``, at the bank's column ``x div lanes``. The pixels of a beat are
    neighbours, so each bank gets one of them, at any first column. A bank has a memory of depths, and tests
    its pixel as `DepthTesterUnit` does. It adds up the depths of its own pixels, ``lanes`` steps a beat. So
    the depths of a beat need no exchange before the test. A beat without a drawn pixel leaves no beat. The
    latency and the interval are those of `DepthTesterUnit`. With ``clears`` all banks are written at once.

    Parameters
    ----------
    x_bits, y_bits, size, clears
        As for `DepthTesterUnit`.
    lanes : int
        Pixels of a beat, a power of two.

    Members
    -------
    i : :py:`In(stream.Signature(deep_beat_shape(x_bits, y_bits, lanes)))`
        Beats of pixels.
    o : :py:`Out(stream.Signature(drawn_beat_shape(x_bits, y_bits, lanes)))`
        Beats of drawn pixels.
    status, picture
        Those of `DepthTesterUnit`.
    memory : :py:`Out(DepthMemory(x_bits - log2(lanes), y_bits)).array(lanes)`
        Memories of the depths in the banks. A column has at least one bit. Only if ``size`` is ``None``.

    Source: docs/theory/geometry.md#depth-lanes; not in the documents.
    """

    def __init__(
        self,
        x_bits: int = 12,
        y_bits: int = 12,
        size: tuple[int, int] | None = None,
        clears: bool = False,
        lanes: int = 2,
    ):
        self.model = DepthLanes(lanes)
        self._bits = (lanes - 1).bit_length()
        super().__init__(x_bits, y_bits, size, clears)

    @property
    def lanes(self) -> int:
        """Pixels of a beat."""
        return self.model.lanes

    def _input_shape(self) -> data.StructLayout:
        return deep_beat_shape(self.x_bits, self.y_bits, self.lanes)

    def _output_shape(self) -> data.StructLayout:
        return drawn_beat_shape(self.x_bits, self.y_bits, self.lanes)

    def _memory(self) -> wiring.Member:
        return Out(DepthMemory(max(self.x_bits - self._bits, 1), self.y_bits)).array(self.lanes)

    def elaborate(self, platform):
        """A stage for each of: depth of a pixel, the memory's word, their comparison; the banks at once."""
        m = Module()
        incoming, last = self.i.payload.pixel, self.latency - 1
        if self.size:
            width, height = self.size
            for number, port in enumerate(self.ports):
                # The first columns of a picture may be one more than the others in a bank.
                columns = max((width + self.lanes - 1 - number) >> self._bits, 1)
                self._remember(m, port, (columns, height), f"depths_{number}")
        advance, accept = Signal(name="advance"), Signal(name="accept")
        shape = {"x": self.x_bits, "y": self.y_bits}
        shape |= {"colors": data.ArrayLayout(pixel_color_shape(), self.lanes)}
        beats = [Signal(data.StructLayout(shape), name=f"beat_{k}") for k in range(self.latency)]
        step, first = Signal(FixedShape(DEPTH_STEP), name="step"), Signal(name="first", init=1)
        with m.If(accept):
            m.d.sync += first.eq(incoming.last)
            with m.If(first):
                m.d.sync += step.eq(self.i.payload.depth_step)
        banks = [self._bank(m, number, advance, accept, first, step) for number in range(self.lanes)]
        with m.If(advance):
            m.d.sync += [
                *copy_fields(beats[0], incoming, shape),
                *(copy(to, beat) for beat, to in pairwise(beats)),
            ]

        shown = Signal(self.o.payload.shape(), name="shown")
        m.d.comb += copy_fields(shown, beats[last], "xy")
        for lane in range(self.lanes):
            number = (beats[last].x + lane)[: self._bits]
            # A separate wire: Verilator reports a loop if a word of the text reads its own bits.
            on = Signal(name=f"shows_{lane}")
            m.d.comb += on.eq(select([bank.last.on for bank in banks], number))
            depth = select([bank.last.depth for bank in banks], number)
            m.d.comb += [
                shown.present[lane].eq(on),
                shown.depths[lane].eq(Mux(on, depth, 0)),
                Value.cast(shown.colors[lane]).eq(Mux(on, Value.cast(beats[last].colors[lane]), 0)),
            ]
        valid = Cat(bank.last.on for bank in banks).any()
        used = Cat(bank.used for bank in banks).any()
        missed = Signal(range(self.lanes + 1), name="missed")
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, shown)),
            self.i.ready.eq(advance & ~(held := Signal(name="held"))),
            accept.eq(self.i.valid & self.i.ready),
            self.idle.eq(~(used | self.o.valid | missed.any())),
        ]
        if self.clears:
            m.d.comb += held.eq(self._clear(m, ~used))
        hidden = reduce(add, (bank.judged & ~bank.drawn for bank in banks))
        m.d.sync += missed.eq(Mux(advance, hidden, 0))
        judged = Mux(advance, reduce(add, (bank.judged for bank in banks)), 0)
        for name, number in (("pixels", judged), ("hidden", missed)):
            count = Signal(COUNTER_BITS, name=f"count_{name}")
            m.d.sync += count.eq(count + number)
            m.d.comb += self.status[name].eq(count)
        return m

    def _columns(self) -> Value:
        """Columns of a bank in the picture."""
        return (self.picture.width + self.lanes - 1) >> self._bits

    def _bank(
        self, m: Module, number: int, advance: Value, accept: Value, first: Value, step: data.View
    ) -> _Bank:
        """The test of the pixels of a bank: depth; the memory's word; their comparison; the write."""
        port, incoming, bits = self.ports[number], self.i.payload, self._bits
        pixel, last = incoming.pixel, self.latency - 1
        place = dict(port.read_place.shape().members)
        first_shape = data.StructLayout({"on": 1} | place)
        shape = data.StructLayout(first_shape.members | {"depth": DEPTH.width})
        # The depth of a pixel is known a stage later.
        shapes = [first_shape, *[shape] * last]
        stages = [Signal(of_stage, name=f"bank_{number}_{k}") for k, of_stage in enumerate(shapes)]
        lane = (number - pixel.x[:bits])[:bits]
        column = (pixel.x + (self.lanes - 1 - number))[bits : self.x_bits]

        # The sum has a sign, and more bits than a depth or a step has.
        total = Signal(37, name=f"total_{number}")
        given = Value.cast(incoming.depth_step)
        ahead = reduce(add, (Mux(lane[k], given << k, 0) for k in range(bits)))
        begin, way = Mux(first, Value.cast(incoming.depth), total.as_signed()), Value.cast(step) << bits
        with m.If(accept):
            m.d.sync += total.eq((begin + Mux(first, ahead, way))[:37])

        # These words are written after the read, or on the same cycle.
        late = [stages[last]] + [Signal(shape, name=f"before_{number}_{k}") for k in range(last - 1)]
        judged, there = stages[last - 1], port.read_data
        if not self.size:
            there = Signal.like(port.read_data, name=f"there_{number}")
            with m.If(advance):
                m.d.sync += there.eq(port.read_data)
        nearer, drawn = Signal(name=f"nearer_{number}"), Signal(name=f"drawn_{number}")
        # The memory's word comes late in a cycle. So it is compared before the unit knows which depth counts.
        m.d.comb += [nearer.eq(judged.depth < there), drawn.eq(judged.on & nearer)]
        # The places are compared a cycle earlier.
        nexts, same = [judged, *late[:-1]], [Signal(name=f"same_{number}_{k}") for k in range(last)]
        for written, flag in reversed(list(zip(late, same, strict=True))):
            with m.If(written.on & flag):
                m.d.comb += nearer.eq(judged.depth < written.depth)
        with m.If(advance):
            m.d.sync += [
                stages[0].on.eq(accept & pixel.present.bit_select(lane, 1)),
                stages[0].x.eq(column),
                stages[0].y.eq(pixel.y),
                *copy_fields(stages[1], stages[0], first_shape.members),
                *(copy(to, stage) for stage, to in pairwise(stages[1:])),
                stages[1].depth.eq(saturated(total)),
                stages[last].on.eq(drawn),
                *(
                    flag.eq(Cat(stage.x, stage.y) == Cat(stages[last - 2].x, stages[last - 2].y))
                    for flag, stage in zip(same, nexts, strict=True)
                ),
                *(copy(to, stage) for stage, to in pairwise(late)),
            ]
        m.d.comb += [
            port.read_enable.eq(advance),
            port.write_enable.eq(advance & stages[last].on),
            port.write_data.eq(stages[last].depth),
            *copy_fields(port.read_place, stages[0], place),
            *copy_fields(port.write_place, stages[last], place),
        ]
        used = Cat(stage.on for stage in (*stages, *late[1:])).any()
        return _Bank(judged.on, drawn, stages[last], used)
