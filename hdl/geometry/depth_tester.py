"""Depth test: the depth of every pixel of spans, and whether it is in front of the pixels before it."""

from itertools import pairwise

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.depth_tester import DepthTester
from blysk.golden.geometry.span_attributes import DEPTH_STEP, SPAN_DEPTH
from blysk.golden.geometry.triangles import DEPTH
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.geometry.triangles import count_events, counters_shape
from blysk.hdl.pixel_assembler import pixel_shape

__all__ = [
    "DepthMemory",
    "DepthTesterUnit",
    "deep_pixel_shape",
    "drawn_pixel_shape",
    "is_inside",
    "picture_shape",
    "saturated",
]


def deep_pixel_shape(x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a pixel with its span's depth and step, which are read with the span's first pixel."""
    depth = {"depth": FixedShape(SPAN_DEPTH), "depth_step": FixedShape(DEPTH_STEP)}
    return data.StructLayout({"pixel": pixel_shape(x_bits, y_bits)} | depth)


def drawn_pixel_shape(x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a pixel to write: place, colour and depth."""
    members = dict(pixel_shape(x_bits, y_bits).members)
    del members["last"]
    return data.StructLayout(members | {"depth": unsigned(DEPTH.width)})


def picture_shape(x_bits: int, y_bits: int) -> data.StructLayout:
    """Shape of a picture's words: its size, and a number that changes from one picture to the next."""
    return data.StructLayout({"number": 1, "width": x_bits + 1, "height": y_bits + 1})


def is_inside(place: data.View, size: tuple[int, int]) -> Value:
    """Whether a place is in a picture. A side of the picture that no code can exceed needs no comparison."""
    sides = [
        place[name] < side for name, side in zip("xy", size, strict=True) if side >> len(place[name]) == 0
    ]
    return Cat(sides).all() if sides else Const(1)


class DepthMemory(wiring.Signature):
    """Port to a memory of depths, one word for each pixel. The word of a read comes on the next cycle.

    If the same place is read and written on the same cycle, the read gets the old word. ``read_data`` keeps
    its value while ``read_enable`` is low. Before each picture every word is `DepthTester.CLEARED`. A
    `DepthTesterUnit` with ``clears`` writes these words. Otherwise the owner of the memory writes them.

    Parameters
    ----------
    x_bits, y_bits : int
        Bits of a column and of a scanline.
    """

    def __init__(self, x_bits: int = 12, y_bits: int = 12):
        place = data.StructLayout({"x": unsigned(x_bits), "y": unsigned(y_bits)})
        super().__init__(
            {
                "read_place": Out(place),
                "read_enable": Out(1),
                "read_data": In(DEPTH.width),
                "write_place": Out(place),
                "write_enable": Out(1),
                "write_data": Out(DEPTH.width),
            }
        )


class DepthTesterUnit(wiring.Component):
    """Drops pixels behind the pixels drawn before. `DepthTester` is the bit-accurate model.

    The initiation interval is 1. The latency of a drawn pixel, `latency`, is 3 cycles. With a memory outside
    of the unit, words come through a register, and the latency is 4. A pixel is also compared with the pixels
    of the last two or three cycles at the same place. These earlier pixels are not in the memory yet. The
    unit has no multipliers.

    With ``clears`` the unit writes `DepthTester.CLEARED` to each place of the picture, one a cycle. It does
    so when the first pixel comes after a reset, and after each change of ``picture.number``. Pixels wait
    meanwhile. Without ``clears`` the unit draws one picture only. Clear the memory outside before
    each further picture.

    Parameters
    ----------
    x_bits, y_bits : int
        Bits of a column and of a scanline.
    size : (int, int) or None
        Width and height of a memory inside the unit, at most 2^x_bits and 2^y_bits. The memory is clear at
        power-up. A pixel outside this memory changes no depth, and is compared only with the last pixels at
        its place. ``None``: the memory is outside, at the port ``memory``.
    clears : bool
        Whether the unit clears the memory.

    Members
    -------
    i : :py:`In(stream.Signature(deep_pixel_shape(x_bits, y_bits)))`
        Pixels.
    o : :py:`Out(stream.Signature(drawn_pixel_shape(x_bits, y_bits)))`
        Drawn pixels.
    status : :py:`Out(counters_shape("pixels", "hidden"))`
        Number of pixels, and number of dropped pixels among them, since the reset.
    memory : :py:`Out(DepthMemory(x_bits, y_bits))`
        Memory of the depths. Only if ``size`` is ``None``.
    picture : :py:`In(picture_shape(x_bits, y_bits))`
        Size of the picture, constant while pixels come, and a number that changes before the first pixel of
        each next picture. Only if the unit clears.

    Attributes
    ----------
    idle : Signal
        High while no pixel is inside.
    ports : sequence of interfaces
        Ports of the memory, or of each of several memories.

    Source: docs/theory/geometry.md#depth; not in the documents.
    """

    def __init__(
        self, x_bits: int = 12, y_bits: int = 12, size: tuple[int, int] | None = None, clears: bool = False
    ):
        self.x_bits, self.y_bits, self.size, self.clears = x_bits, y_bits, size, clears
        self.latency = 3 if size else 4
        memory = self._memory()
        members = {
            "i": In(stream.Signature(self._input_shape())),
            "o": Out(stream.Signature(self._output_shape())),
            "status": Out(counters_shape("pixels", "hidden")),
        }
        if size is None:
            members["memory"] = memory
        if clears:
            members["picture"] = In(picture_shape(x_bits, y_bits))
        super().__init__(members)
        if size:
            ports = range(*memory.dimensions) if memory.dimensions else [""]
            self.ports = [memory.signature.create(path=(f"port{number}",)) for number in ports]
        else:
            self.ports = self.memory if memory.dimensions else [self.memory]
        self.idle = Signal(name="idle")

    def _input_shape(self) -> data.StructLayout:
        """Shape of an input beat."""
        return deep_pixel_shape(self.x_bits, self.y_bits)

    def _output_shape(self) -> data.StructLayout:
        """Shape of an output beat."""
        return drawn_pixel_shape(self.x_bits, self.y_bits)

    def _memory(self) -> wiring.Member:
        """The member for the memory of the depths."""
        return Out(DepthMemory(self.x_bits, self.y_bits))

    def elaborate(self, platform):
        """Depth of the pixel; the memory's word; their comparison; the write."""
        m = Module()
        port, incoming = self.ports[0], self.i.payload
        if self.size:
            self._remember(m, port, self.size)
        advance, accept = Signal(name="advance"), Signal(name="accept")
        last = self.latency - 1
        stages = [Signal(self.o.payload.shape(), name=f"pixel_{k}") for k in range(self.latency)]
        valid = [Signal(name=f"valid_{k}") for k in range(self.latency)]
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid[last], stages[last])),
            self.i.ready.eq(advance & ~(held := Signal(name="held"))),
            accept.eq(self.i.valid & self.i.ready),
        ]
        missed = Signal(name="missed")
        m.d.comb += self.idle.eq(~(Cat(valid).any() | self.o.valid | missed))

        # The sum has a sign, and more bits than a depth or a step has.
        first, total = Signal(name="first", init=1), Signal(37, name="total")
        step = Signal(FixedShape(DEPTH_STEP), name="step")
        begin = Value.cast(incoming.depth)
        going = (total.as_signed() + Value.cast(step))[:37]
        with m.If(accept):
            m.d.sync += [first.eq(incoming.pixel.last), total.eq(Mux(first, begin, going))]
            with m.If(first):
                m.d.sync += step.eq(incoming.depth_step)

        depth = saturated(total)
        nearer, drawn = Signal(name="nearer"), Signal(name="drawn")
        # These words are written after the read, or on the same cycle.
        late = [(valid[last], stages[last])] + [
            (Signal(name=f"before_valid_{k}"), Signal.like(stages[last], name=f"before_{k}"))
            for k in range(last - 1)
        ]
        judged, there = stages[last - 1], port.read_data
        if not self.size:
            there = Signal.like(port.read_data, name="there")
            with m.If(advance):
                m.d.sync += there.eq(port.read_data)
        # The memory's word comes late in a cycle. So it is compared before the unit knows which depth counts.
        m.d.comb += [nearer.eq(judged.depth < there), drawn.eq(valid[last - 1] & nearer)]
        # The places are compared a cycle earlier.
        nexts = [judged, *(pixel for _, pixel in late[:-1])]
        same = [Signal(name=f"same_{k}") for k in range(last)]
        for (written, pixel), flag in reversed(list(zip(late, same, strict=True))):
            with m.If(written & flag):
                m.d.comb += nearer.eq(judged.depth < pixel.depth)
        with m.If(advance):
            m.d.sync += [
                valid[0].eq(accept),
                *copy_fields(stages[0], incoming.pixel, "xyrgb"),
                *(copy(to, pixel) for pixel, to in pairwise(stages)),
                *(to.eq(passes) for passes, to in pairwise(valid)),
                stages[1].depth.eq(depth),
                valid[last].eq(drawn),
                *(
                    flag.eq(_place(pixel) == _place(stages[last - 2]))
                    for flag, pixel in zip(same, nexts, strict=True)
                ),
                *(
                    copy(to, word)
                    for earlier, later in pairwise(late)
                    for word, to in zip(earlier, later, strict=True)
                ),
            ]
        m.d.comb += [
            port.read_enable.eq(advance),
            port.write_enable.eq(advance & valid[last]),
            port.write_data.eq(stages[last].depth),
            *copy_fields(port.read_place, stages[0], "xy"),
            *copy_fields(port.write_place, stages[last], "xy"),
        ]
        if self.clears:
            # An empty unit has no pixel left that could be compared with pixels of the next picture.
            empty = ~Cat(valid, *(written for written, _ in late)).any()
            m.d.comb += held.eq(self._clear(m, empty))
        m.d.sync += missed.eq(advance & valid[last - 1] & ~drawn)
        count_events(m, self.status, pixels=advance & valid[last - 1], hidden=missed)
        return m

    def _clear(self, m: Module, empty: Value) -> Value:
        """Write to every place of a picture before its first pixel. Returns whether pixels are held back."""
        picture = self.picture
        before, stale, sweeps = Signal(name="number"), Signal(name="stale", init=1), Signal(name="sweeps")
        place = Signal(self.ports[0].write_place.shape(), name="place")
        turns = picture.number != before
        # In a picture larger than the coordinates, the largest coordinate is the last place.
        ends = {
            name: place[name].all() | (place[name] + 1 >= size)
            for name, size in (("x", self._columns()), ("y", picture.height))
        }
        m.d.sync += [before.eq(picture.number), stale.eq(stale | turns)]
        with m.If(sweeps):
            for port in self.ports:
                m.d.comb += [
                    port.write_enable.eq(1),
                    copy(port.write_place, place),
                    port.write_data.eq(DepthTester.CLEARED),
                ]
            m.d.sync += place.x.eq(Mux(ends["x"], 0, place.x + 1))
            with m.If(ends["x"]):
                m.d.sync += [place.y.eq(Mux(ends["y"], 0, place.y + 1)), sweeps.eq(~ends["y"])]
        with m.Elif(stale & self.i.valid & empty):
            m.d.sync += [sweeps.eq(1), stale.eq(turns)]
        return stale | turns | sweeps

    def _columns(self) -> Value:
        """Columns of the picture."""
        return self.picture.width

    def _remember(self, m: Module, port, size: tuple[int, int], name: str = "depths") -> None:
        """A memory of a size at a port. The memory holds inverted depths."""
        # Inverted, so that a cleared memory holds zeros.
        width, height = size
        m.submodules[name] = memory = Memory(shape=DEPTH.width, depth=width * height, init=[])
        read, write = memory.read_port(), memory.write_port()
        outside = Signal(name="read_outside")
        with m.If(port.read_enable):
            m.d.sync += outside.eq(~is_inside(port.read_place, size))
        m.d.comb += [
            read.addr.eq(port.read_place.y * width + port.read_place.x),
            read.en.eq(port.read_enable),
            port.read_data.eq(Mux(outside, DepthTester.CLEARED, ~read.data)),
            write.addr.eq(port.write_place.y * width + port.write_place.x),
            write.en.eq(port.write_enable & is_inside(port.write_place, size)),
            write.data.eq(~port.write_data),
        ]


def saturated(total: Value) -> Value:
    """Depth of a pixel from the sum of a span's depth and steps."""
    code = total.as_signed() >> SPAN_DEPTH.fraction_bits
    return Mux(code < 0, 0, Mux(code > DepthTester.FARTHEST, DepthTester.FARTHEST, code))


def _place(pixel) -> Value:
    return Cat(pixel.x, pixel.y)
