"""The light adapter: vectors of spans in the frames of further lights."""

from amaranth.hdl import Array, Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory, ReadPort
from amaranth.lib.wiring import In, Out

from blysk.golden.frame_constants import LIGHT_STRIDE
from blysk.golden.geometry.light_adapter import LightAdapter
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import read_domain, word_in_register
from blysk.hdl.core.views import copy
from blysk.hdl.frame_constants import write_shape
from blysk.hdl.geometry.vector_adapter import vector_spans_shape

__all__ = ["LightAdapterUnit", "with_components"]

_AXES = 3
"""Number of components of a vector of geometry."""

_LOW = LIGHT_STRIDE.bit_length() - 1
"""Bits of an address within a light."""


def with_components(shape: data.StructLayout, components: int) -> data.StructLayout:
    """Shape of a span whose vectors have another number of components."""
    vector = data.ArrayLayout(FixedShape(LightAdapter.FORMAT), components)
    return data.StructLayout(shape.members | {"start": vector, "step": vector})


class LightAdapterUnit(wiring.Component):
    """Components of vectors for the lights after the first light. `LightAdapter` is the model.

    Each component of start and step has a multiplier. It takes x, y and z in turns, and the products are
    added. So the initiation interval is 3. In the *serial* form one multiplier makes all components one after
    the other. Each component takes 6 cycles. A span is taken in on the last cycle of its interval, and
    offered 4 cycles later. If a span still waits at the output when the next span is made, the next span
    waits a cycle longer.

    Axes are in memories, so they take no registers. Reset does not clear them.

    Parameters
    ----------
    lights : int
        Number of further lights, at least 1.
    rows : int
        Components of a light, 1 to 3.
    serial : bool
        Whether one multiplier makes all components.
    shape : StructLayout or None
        Shape of a span: ``start`` and ``step`` of three components, ``length``, and words that pass
        unchanged. ``None``: `vector_spans_shape`.

    Members
    -------
    i : :py:`In(stream.Signature(shape))`
        Spans with vectors in the frame of the first light.
    o : :py:`Out(stream.Signature(with_components(shape, 3 + lights * rows)))`
        The same spans, with the components of further lights behind the components of the first light.
    write : :py:`In(stream.Signature(write_shape()))`
        Writes of frame constants, always accepted. The unit takes the axes, see `FrameConstants.writes`. They
        are constant while spans are inside.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    latency = 4

    def __init__(
        self, lights: int = 1, rows: int = 3, serial: bool = False, shape: data.StructLayout | None = None
    ):
        self.lights, self.rows, self.serial = lights, rows, serial
        shape = vector_spans_shape() if shape is None else shape
        made = lights * rows
        self.multipliers = 1 if serial else 2 * made
        self.initiation_interval = 2 * _AXES * made // self.multipliers
        super().__init__(
            {
                "i": In(stream.Signature(shape)),
                "o": Out(stream.Signature(with_components(shape, _AXES + made))),
                "write": In(stream.Signature(write_shape())),
            }
        )

    def elaborate(self, platform):
        """Turns, operands, products, sums, and words that wait beside them. The last sum ends a span."""
        m = Module()
        given, made = self.i.payload, self.lights * self.rows
        result = Signal(self.o.payload.shape(), name="result")
        valid, advance = Signal(self.latency - 1, name="valid"), Signal(name="advance")
        self._offer(m, valid, advance, result)
        axis, last = Signal(range(_AXES), name="axis"), Signal(name="last_turn")
        ends_row = Signal(name="ends_row")
        m.d.comb += [
            ends_row.eq(axis == _AXES - 1),
            self.i.ready.eq(advance & last),
            self.write.ready.eq(1),
        ]
        turns = self.i.valid & advance
        with m.If(turns):
            m.d.sync += axis.eq(Mux(ends_row, 0, axis + 1))
        with m.If(advance):
            m.d.sync += valid.eq(Cat(self.i.valid & last, valid))

        def register(value, name, when=1):
            signal = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            with m.If(advance & when):
                m.d.sync += signal.eq(value)
            return signal

        def in_register(port, name):
            word = word_in_register(m, port, advance, lambda data: register(data.as_signed(), name))
            return word.as_signed()

        # In a span of one pixel the step has no meaning, and the start takes its place.
        single = ~given.length[1:].any()
        start, step = (
            Array(Value.cast(given[name][k]).as_signed() for k in range(_AXES))[axis]
            for name in ("start", "step")
        )
        step = Mux(single, start, step).as_signed()
        begins = register(register(axis == 0, "begins_1"), "begins_2")
        address = self.write.payload.address
        of_light, of_axes = address[_LOW:-1], address[-1]
        if self.serial:
            of_step, row, light = (
                Signal(name="of_step"),
                Signal(range(_AXES), name="row"),
                Signal(range(self.lights + 1), name="light", init=1),
            )
            ends_light, ends_all = row == self.rows - 1, light == self.lights
            m.d.comb += last.eq(ends_row & ends_light & ends_all & of_step)
            with m.If(turns & ends_row):
                m.d.sync += row.eq(Mux(ends_light, 0, row + 1))
                with m.If(ends_light):
                    m.d.sync += light.eq(Mux(ends_all, 1, light + 1))
                    with m.If(ends_all):
                        m.d.sync += of_step.eq(~of_step)
            # The low bits of a light's number that distinguish all lights.
            place = Cat(axis, row, light[: (self.lights - 1).bit_length()])
            axes = self._axes(m, "axes", place, of_axes & (of_light > 0) & (of_light <= self.lights))
            vector = register(Mux(of_step, step, start).as_signed(), "vector")
            product = register(vector * in_register(axes, "code"), "product")
            chain = [self._sum(m, advance, product, begins, "sum")]
            done = ends_row
            for stage in range(1, 4):
                done = register(done, f"done_{stage}")
            # Results wait in a chain of registers, which moves on with each result.
            for k in range(1, 2 * made):
                chain.append(register(chain[-1], f"made_{k}", done))
            sums = chain[::-1]
        else:
            m.d.comb += last.eq(ends_row)
            vectors = register(start, "start"), register(step, "step")
            codes = []
            for light in range(1, self.lights + 1):
                for row in range(self.rows):
                    chosen = of_axes & (of_light == light) & (address[2:_LOW] == row)
                    axes = self._axes(m, f"axes_{light}_{row}", axis, chosen)
                    codes.append(in_register(axes, f"code_{light}_{row}"))
            sums = []
            for vector, name in zip(vectors, ("start", "step"), strict=True):
                for k, code in enumerate(codes):
                    product = register(vector * code, f"product_{name}_{k}")
                    sums.append(self._sum(m, advance, product, begins, f"sum_{name}_{k}"))
        # Ends of spans are at least three cycles apart, so one register is enough for their other words.
        words = {
            name: register(Value.cast(given[name]), f"kept_{name}", self.i.valid & last)
            for name in given.shape().members
        }
        for number, name in enumerate(("start", "step")):
            words[name] = Cat(words[name], *sums[number * made : (number + 1) * made])
        m.d.comb += [Value.cast(result[name]).eq(word) for name, word in words.items()]
        return m

    def _offer(self, m: Module, valid: Signal, advance: Signal, result) -> None:
        """The output register. The unit stops while a result has no place.

        Results are three cycles apart, so one register is enough.
        """
        offered, waits = Signal(name="offered"), Signal(name="waits")
        output = Signal.like(result, name="output", reset_less=True)
        still = offered & ~self.o.ready
        m.d.comb += [
            advance.eq(~(valid[-1] & waits)),
            self.o.valid.eq(offered),
            copy(self.o.payload, output),
        ]
        moves = valid[-1] & ~waits
        m.d.sync += [waits.eq(still), offered.eq(still | moves)]
        with m.If(moves):
            m.d.sync += copy(output, result)

    def _axes(self, m: Module, name: str, place: Value, chosen: Value) -> ReadPort:
        """Read port of a memory of axes. ``chosen`` tells whether a write is for this memory."""
        write, width = self.write, LightAdapter.FORMAT.width
        m.submodules[name] = memory = Memory(shape=width, depth=1 << len(place), init=[])
        writes, reads = memory.write_port(), memory.read_port(domain=read_domain())
        m.d.comb += [
            writes.addr.eq(write.payload.address),
            writes.data.eq(write.payload.data),
            writes.en.eq(write.valid & chosen),
            reads.addr.eq(place),
        ]
        return reads

    @staticmethod
    def _sum(m: Module, advance: Value, product: Value, begins: Value, name: str) -> Value:
        """Sum of the products of three turns, rounded half up, in `LightAdapter.FORMAT`."""
        bits, width = LightAdapter.FORMAT.fraction_bits, LightAdapter.FORMAT.width
        total = Signal(bits + width, name=name, reset_less=True)
        with m.If(advance):
            m.d.sync += total.eq(Mux(begins, 1 << (bits - 1), total) + product)
        return total[bits:]
