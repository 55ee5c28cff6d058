"""Attribute serialiser: a triangle's attributes one after the other, and a bound on its normals' length."""

from amaranth.hdl import Array, Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.golden.geometry.triangles import ATTRIBUTE, ATTRIBUTES, DEPTH
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.ring import next_turn
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.core.views import copy
from blysk.hdl.geometry.surface_words import attribute_count, corner_surface_shape
from blysk.hdl.geometry.triangles import in_order, order_shape

__all__ = ["AttributeSerialiserUnit", "corner_attributes_shape", "serial_attribute_shape"]

_CORNERS = ("first", "middle", "last")

_KNOWN = 8
"""Step from which on the bound is known."""


def corner_attributes_shape(surface: AttributeSpans | None = None) -> data.StructLayout:
    """Shape of the attributes of three corners, and the order of the corners."""
    component = FixedShape(ATTRIBUTE)
    return data.StructLayout(
        {
            "depth": data.ArrayLayout(FixedShape(DEPTH), 3),
            "normal": data.ArrayLayout(data.ArrayLayout(component, 3), 3),
            **corner_surface_shape(surface),
            **order_shape(),
        }
    )


def serial_attribute_shape() -> data.StructLayout:
    """Shape of one attribute: its values at the sorted corners, and the triangle's bound."""
    corners = {name: FixedShape(ATTRIBUTE) for name in _CORNERS}
    return data.StructLayout(corners | {"least": unsigned(AttributeSerialiser.BITS)})


class AttributeSerialiserUnit(wiring.Component):
    """Gives the n attributes of each triangle one after the other. `AttributeSerialiser` is the model.

    n is 4, or more with a surface. The first attribute is offered n + 5 cycles after the triangle is taken
    in. The other attributes follow on the next cycles, unless the output waits. The next triangle is taken in
    on the cycle of the last attribute. So the initiation interval is 2 n + 4 cycles, 12 with four attributes.

    Without a skid buffer the unit keeps no attributes. They stay at the input until the last attribute has
    left. The first attribute is offered n + 4 cycles after the triangle is offered. The triangle is taken in
    on the cycle after the last attribute. The unit has no multipliers.

    Parameters
    ----------
    skid : bool
        Whether the unit has registers for a triangle, and a skid buffer at its output.
    surface : AttributeSpans or None
        Attributes of the surface that triangles bring.

    Members
    -------
    i : :py:`In(stream.Signature(corner_attributes_shape(surface)))`
        Attributes of triangles with corners in any order, and the order of the corners.
    o : :py:`Out(stream.Signature(serial_attribute_shape()))`
        Components x, y, z of N/W, the depth, then the surface.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, skid: bool = True, surface: AttributeSpans | None = None):
        self._skid, self._surface = skid, surface
        super().__init__(
            {
                "i": In(stream.Signature(corner_attributes_shape(surface))),
                "o": Out(stream.Signature(serial_attribute_shape())),
            }
        )

    def elaborate(self, platform):
        """The corners' words turn once for the bound and once more for the output, and are put in order."""
        m = Module()
        if self._skid:
            self._ring(m)
        else:
            self._choice(m)
        return m

    def _words(self, corner: int) -> list[Value]:
        """Attributes of a corner of the input."""
        given = self.i.payload
        # The depth minus half its range, made by inverting its first bit.
        depth = Value.cast(given.depth[corner])
        words = [*given.normal[corner], Cat(depth[:-1], ~depth[-1])]
        if self._surface is not None:
            words += list(given.surface[corner])
        return [Value.cast(word).as_unsigned() for word in words]

    def _choice(self, m: Module) -> None:
        """Choose each attribute at the input."""
        count, given, result = attribute_count(self._surface), self.i.payload, self.o.payload
        first = max(_KNOWN, count + ATTRIBUTES)
        step, turn = Signal(range(first + count + 1), name="step"), Signal(range(count), name="turn")
        words = [Array(self._words(corner))[turn] for corner in range(3)]
        heads = in_order(given.top, given.bottom, words)
        ends = step == first + count
        gives = (step >= first) & ~ends
        m.d.comb += [
            self.i.ready.eq(ends),
            self.o.valid.eq(gives),
            result.least.eq(self._least(m, step, heads)),
            *(Value.cast(result[name]).eq(head) for name, head in zip(_CORNERS, heads, strict=True)),
        ]
        with m.If(Mux((step == 0) | ends, self.i.valid, ~gives | self.o.ready)):
            m.d.sync += step.eq(Mux(ends, 0, step + 1))
        with m.If(((step != 0) & (step <= count)) | (gives & self.o.ready)):
            m.d.sync += turn.eq(next_turn(turn, count))

    def _ring(self, m: Module) -> None:
        """Turn rings of the corners' words."""
        count = attribute_count(self._surface)
        corners = [
            [Signal(FixedShape(ATTRIBUTE), name=f"corner_{k}_{a}") for a in range(count)] for k in range(3)
        ]
        first = max(_KNOWN, count + ATTRIBUTES)
        step, advance = Signal(range(first + count), name="step"), Signal(name="advance")
        valid, result = Signal(name="valid"), Signal(self.o.payload.shape(), name="result")
        top, bottom = (Signal(2, name=f"{name}_corner", reset_less=True) for name in order_shape())
        heads = [Signal(FixedShape(ATTRIBUTE), name=f"head_{name}") for name in _CORNERS]
        for head, word in zip(heads, in_order(top, bottom, [words[0] for words in corners]), strict=True):
            m.d.comb += Value.cast(head).eq(word)
        least = self._least(m, step, heads)
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid, result))
        rounds, gives = (step != 0) & (step <= count), step >= first
        free, ends = Signal(name="free", init=1), step == first + count - 1
        m.d.comb += self.i.ready.eq(free)
        with m.If(free):
            m.d.sync += [step.eq(self.i.valid), free.eq(~self.i.valid)]
            m.d.sync += [top.eq(self.i.payload.top), bottom.eq(self.i.payload.bottom)]
            for k, words in enumerate(corners):
                m.d.sync += [
                    Value.cast(word).eq(value) for word, value in zip(words, self._words(k), strict=True)
                ]
        with m.Else():
            with m.If(advance | ~gives):
                m.d.sync += [step.eq(Mux(ends, 0, step + 1)), free.eq(ends)]
            with m.If(rounds | (advance & gives)):
                for words in corners:
                    m.d.sync += [
                        copy(word, following)
                        for word, following in zip(words, [*words[1:], words[0]], strict=True)
                    ]
        with m.If(advance):
            m.d.sync += [valid.eq(gives), result.least.eq(least)]
            for name, head in zip(_CORNERS, heads, strict=True):
                m.d.sync += copy(result[name], head)

    def _least(self, m: Module, step: Signal, words: list) -> Signal:
        """The bound, from one component of each corner a cycle. It is known from step `_KNOWN` on."""
        bits = AttributeSerialiser.FRACTION_BITS + 1
        sign = Value.cast(words[0])[-1]
        turned = [(Value.cast(word)[-bits:] ^ sign.replicate(bits)).as_signed() for word in words]

        def register(value, name):
            kept = Signal.like(value, name=name)
            m.d.sync += kept.eq(value)
            return kept

        totals = [Signal(signed(bits + 2), name=f"total_{k}") for k in range(3)]
        with m.If(step == 0):
            m.d.sync += [total.eq(0) for total in totals]
        with m.Elif(step < ATTRIBUTES):
            m.d.sync += [total.eq(total + word) for total, word in zip(totals, turned, strict=True)]
        single = register(turned[2], "third")
        single = register(_least_of(register(_least_of(*turned[:2]), "pair"), single), "single")
        largest = Signal(signed(bits), name="largest_single")
        with m.If((step == 3) | ((step[1:] == 2) & (largest - single)[-1])):
            m.d.sync += largest.eq(single)
        low = register(_least_of(register(_least_of(*totals[:2]), "least_pair"), totals[2]), "least_total")
        scaled = register(((low << 3) + low) >> 4, "scaled")
        either = Mux(scaled > largest, scaled, largest)
        return register(Mux(either < 0, 0, either)[: AttributeSerialiser.BITS], "least")


def _least_of(a: Value, b: Value) -> Value:
    return Mux(a < b, a, b)
