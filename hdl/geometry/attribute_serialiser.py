"""Attribute serialiser: a triangle's attributes one by one, and a bound on its normals' length."""

from itertools import pairwise

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.golden.geometry.triangles import ATTRIBUTE, ATTRIBUTES, DEPTH
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import hold_output, skid_buffer

__all__ = ["AttributeSerialiserUnit", "corner_attributes_shape", "serial_attribute_shape"]


def corner_attributes_shape() -> data.StructLayout:
    """Shape of the attributes of three sorted corners."""
    component = FixedShape(ATTRIBUTE)
    return data.StructLayout(
        {
            "depth": data.ArrayLayout(FixedShape(DEPTH), 3),
            "normal": data.ArrayLayout(data.ArrayLayout(component, 3), 3),
        }
    )


def serial_attribute_shape() -> data.StructLayout:
    """Shape of one attribute: its values at the sorted corners, and the triangle's bound."""
    corners = {name: FixedShape(ATTRIBUTE) for name in ("first", "middle", "last")}
    return data.StructLayout(corners | {"least": unsigned(AttributeSerialiser.BITS)})


class AttributeSerialiserUnit(wiring.Component):
    """Four attributes of each triangle in a row: those of `AttributeSerialiser`, the bit-accurate model.

    The attributes of a triangle taken in on one cycle are offered from 5 cycles later on, one a cycle unless
    the output waits; the next triangle is taken in with the last of them, so that one takes 7 cycles. No
    multipliers.

    Parameters
    ----------
    skid : bool
        Whether the output has a skid buffer; else the unit sees its ready on the same cycle.

    Members
    -------
    i : :py:`In(stream.Signature(corner_attributes_shape()))`
        Attributes of triangles with sorted corners.
    o : :py:`Out(stream.Signature(serial_attribute_shape()))`
        Components x, y, z of N/W, then the depth.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, skid: bool = True):
        self._drive = skid_buffer if skid else hold_output
        super().__init__(
            {
                "i": In(stream.Signature(corner_attributes_shape())),
                "o": Out(stream.Signature(serial_attribute_shape())),
            }
        )

    def elaborate(self, platform):
        """Three steps for the bound, then one for each attribute, the first of the corners' words."""
        m = Module()
        corners = [
            [Signal(FixedShape(ATTRIBUTE), name=f"corner_{k}_{a}") for a in range(ATTRIBUTES)]
            for k in range(3)
        ]
        step, advance = Signal(3, name="step"), Signal(name="advance")
        valid, result = Signal(name="valid"), Signal(self.o.payload.shape(), name="result")
        least = self._least(m, corners)
        m.d.comb += [
            advance.eq(self._drive(m, self.o, valid, result)),
            self.i.ready.eq((step == 0) | ((step == 7) & advance)),
        ]
        shifts = step >= 4
        with m.If((step != 0) & (advance | ~shifts)):
            m.d.sync += step.eq(step + 1)
        with m.If(self.i.ready):
            m.d.sync += step.eq(self.i.valid)
            for k, words in enumerate(corners):
                values = [Value.cast(value) for value in self.i.payload.normal[k]]
                # The depth less half its range: its first bit turned.
                depth = Value.cast(self.i.payload.depth[k])
                values.append(Cat(depth[:-1], ~depth[-1]))
                m.d.sync += [Value.cast(word).eq(value) for word, value in zip(words, values, strict=True)]
        with m.Elif(advance & shifts):
            for words in corners:
                m.d.sync += [
                    Value.cast(word).eq(Value.cast(following)) for word, following in pairwise(words)
                ]
        with m.If(advance):
            m.d.sync += [valid.eq(shifts), result.least.eq(least)]
            for name, words in zip(("first", "middle", "last"), corners, strict=True):
                m.d.sync += Value.cast(result[name]).eq(Value.cast(words[0]))
        return m

    def _least(self, m: Module, corners: list) -> Signal:
        """The bound, three registers behind the corners' words before they shift."""
        bits = AttributeSerialiser.FRACTION_BITS + 1
        first = [Value.cast(word)[-1] for word in corners[0][:3]]
        turned = [
            [
                (Value.cast(word)[-bits:] ^ sign.replicate(bits)).as_signed()
                for word, sign in zip(words, first, strict=False)
            ]
            for words in corners
        ]
        total, single = [], []
        for words in turned:
            kept = Signal.like(words[0] + words[1] + words[2], name=f"total_{len(total)}")
            m.d.sync += kept.eq(words[0] + words[1] + words[2])
            total.append(kept)
        for k, words in enumerate(zip(*turned, strict=True)):
            kept = Signal.like(words[0], name=f"single_{k}")
            m.d.sync += kept.eq(_choose(_choose(*words[:2]), words[2]))
            single.append(kept)
        low = _choose(_choose(*total[:2]), total[2])
        high = _choose(_choose(*single[:2], largest=True), single[2], largest=True)
        low_kept, high_kept = Signal.like(low, name="least_total"), Signal.like(high, name="largest_single")
        scaled = ((low_kept << 3) + low_kept) >> 4
        either = _choose(scaled, high_kept, largest=True)
        # Stands while the words shift.
        count = Signal(2, name="bound_step")
        least = Signal(AttributeSerialiser.BITS, name="least")
        m.d.sync += [low_kept.eq(low), high_kept.eq(high), count.eq(Mux(count == 0, 0, count + 1))]
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += count.eq(1)
        with m.If(count == 3):
            m.d.sync += least.eq(Mux(either < 0, 0, either))
        return least


def _choose(a: Value, b: Value, largest: bool = False) -> Value:
    return Mux((a > b) if largest else (a < b), a, b)
