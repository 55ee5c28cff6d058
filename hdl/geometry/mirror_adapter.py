"""The mirror adapter: y cos a and y sin a of the vectors of spans, for highlights of R·V."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.mirror_adapter import MirrorAdapter
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.geometry.light_adapter import with_components
from blysk.hdl.geometry.vector_adapter import vector_spans_shape

__all__ = ["MirrorAdapterUnit", "mirror_constants_shape"]


def mirror_constants_shape() -> data.StructLayout:
    """Shape of sin a and cos a. The angle a is half the angle between light and viewer."""
    return data.StructLayout({name: FixedShape(MirrorAdapter.FORMAT) for name in ("sine", "cosine")})


class MirrorAdapterUnit(wiring.Component):
    """Two components of vectors in place of y. `MirrorAdapter` is the bit-accurate model.

    Two multipliers take the start and then the step of a span. So the initiation interval is 2. For a span of
    one pixel it is 1. In the *serial* form one multiplier makes the four products, and the interval is 4. A
    span is taken in on the last cycle of its interval, and offered 3 cycles later.

    Parameters
    ----------
    serial : bool
        Whether one multiplier makes all products.
    shape : StructLayout or None
        Shape of a span, as for `LightAdapterUnit`. Its vectors may have components of further lights.

    Members
    -------
    i : :py:`In(stream.Signature(shape))`
        Spans of `VectorAdapterUnit` or `LightAdapterUnit`.
    o : :py:`Out(stream.Signature(with_components(shape, components + 1)))`
        The same spans. The components of a vector are x, y cos a, z, the components of further lights, and y
        sin a.
    constants : :py:`In(mirror_constants_shape())`
        sin a and cos a, constant while spans are inside.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    latency = 3

    def __init__(self, serial: bool = False, shape: data.StructLayout | None = None):
        self.serial = serial
        shape = vector_spans_shape() if shape is None else shape
        self._components = shape["start"].shape.length
        self.multipliers = 1 if serial else 2
        super().__init__(
            {
                "i": In(stream.Signature(shape)),
                "o": Out(stream.Signature(with_components(shape, self._components + 1))),
                "constants": In(mirror_constants_shape()),
            }
        )

    def elaborate(self, platform):
        """Turns of the operands, products, and their rounding. The last four products belong to a span."""
        m = Module()
        p, given = MirrorAdapter(), self.i.payload
        turns, bits = 4 // self.multipliers, p.FORMAT.fraction_bits
        result, valid = (
            Signal(self.o.payload.shape(), name="result", reset_less=True),
            Signal(3, name="valid"),
        )
        advance = skid_buffer(m, self.o, valid[-1], result)
        turn, last, single = (
            Signal(range(turns), name="turn"),
            Signal(name="last_turn"),
            Signal(name="single"),
        )
        m.d.comb += [
            single.eq(~given.length[1:].any()),
            last.eq((turn == turns - 1) | (single & (not self.serial))),
            self.i.ready.eq(advance & last),
        ]
        with m.If(advance):
            m.d.sync += valid.eq(Cat(self.i.valid & last, valid))
            with m.If(self.i.valid):
                m.d.sync += turn.eq(Mux(last, 0, turn + 1))

        def register(value, name):
            signal = Signal(Value.cast(value).shape(), name=name, reset_less=True)
            with m.If(advance):
                m.d.sync += signal.eq(value)
            return signal

        start, step = (Value.cast(given[name][1]) for name in ("start", "step"))
        y = register(Mux(turn[-1] & ~single, step, start).as_signed(), "y")
        cosine, sine = (Value.cast(self.constants[name]).as_signed() for name in ("cosine", "sine"))
        factors = [cosine, sine]
        if self.serial:
            factors = [register(Mux(turn[0], sine, cosine).as_signed(), "factor")]
        products = [register(y * factor, f"product_{k}") for k, factor in enumerate(factors)]
        rounded = [((product + (1 << (bits - 1))) >> bits)[: p.FORMAT.width] for product in products]
        words = self._delayed(register, given, single)
        if self.serial:
            made = list(rounded)
            for k in range(1, turns):
                made.append(register(made[-1], f"made_{k}"))
            ends = made[:1:-1], made[1::-1]
        else:
            before = [register(word, f"before_{k}") for k, word in enumerate(rounded)]
            alone = words["single"]
            ends = [Mux(alone, now, then) for now, then in zip(rounded, before, strict=True)], rounded
        with m.If(advance):
            for name, (along, across) in zip(("start", "step"), ends, strict=True):
                others = (words[f"{name}_{k}"] for k in range(2, self._components))
                vector = words[f"{name}_0"], along, *others, across
                m.d.sync += [
                    Value.cast(word).eq(code) for word, code in zip(result[name], vector, strict=True)
                ]
            m.d.sync += [
                Value.cast(result[name]).eq(words[name])
                for name in result.shape().members
                if name not in ("start", "step")
            ]
        return m

    def _delayed(self, register, given, single: Value) -> dict[str, Value]:
        """All words that are not multiplied, two stages later."""
        words = {
            name: Value.cast(given[name]) for name in given.shape().members if name not in ("start", "step")
        }
        kept = (0, *range(2, self._components))
        words |= {f"{name}_{k}": Value.cast(given[name][k]) for name in ("start", "step") for k in kept}
        words["single"] = single
        for age in range(1, 3):
            words = {name: register(word, f"{name}_{age}") for name, word in words.items()}
        return words
