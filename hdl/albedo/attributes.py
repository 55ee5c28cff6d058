"""Attributes of a pixel: vertex colours and texture coordinates, by one reciprocal of 1/W."""

from collections.abc import Callable

from amaranth.hdl import Cat, Const, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.albedo.attributes import Attributes
from blysk.golden.number.fixed import SQ, UQ
from blysk.hdl.albedo.attribute_spans import attribute_words_shape
from blysk.hdl.core.bits import leading_zeros
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = ["AttributesUnit", "attributes_shape"]

_WEIGHT_BITS = AttributeSpans.WORD_FORMAT.fraction_bits
"""Bits of 1/W without its sign."""

_FRACTION = UQ(0, _WEIGHT_BITS - 1 - Attributes.TABLE_BITS)
"""Format of the place of x within an entry of the table."""


def attributes_shape(model: Attributes) -> data.StructLayout:
    """Shape of the attributes of a pixel: ``colors``, and ``coordinates`` and ``level``, if there are any.

    Parameters
    ----------
    model : Attributes
        Bit-accurate model, with the formats.
    """
    members = {}
    if model.spans.colors:
        members["colors"] = data.ArrayLayout(FixedShape(model.COLOR_FORMAT), 3)
    if model.spans.coordinates:
        members["coordinates"] = data.ArrayLayout(FixedShape(model.coordinate_format), 2)
        members["level"] = unsigned(model.spans.LEVEL_FORMAT.width)
    return data.StructLayout(members)


class AttributesUnit(PipelinedUnit):
    """Attributes of a pixel, ``A = U/w``: vertex colours, and texture coordinates in texels.

    `Attributes`, the bit-accurate model, has formats, table and error bounds.

    One product makes the reciprocal from the table, and each attribute has a product: 4 for colours, 3 for
    texture coordinates, 6 for both. With an initiation interval of 1 each product has a multiplier. With a
    longer interval the products share ``ceil(products / initiation_interval)`` multipliers. Without
    perspective there are neither products nor a table. The latency follows from the graph. At intervals of 1
    to 6 it is 12, 16, 17, 17, 17, 20 cycles with both kinds of attributes. With colours alone it is 11, 15,
    15, 17, 17, 17 cycles. Without perspective it is 2 at an interval of 1.

    Parameters
    ----------
    model : Attributes
        Bit-accurate model.
    initiation_interval : int
        Cycles from an input to the next, at least 1.

    Members
    -------
    i : :py:`In(stream.Signature(attribute_words_shape(model.spans)))`
        Words of a pixel.
    o : :py:`Out(stream.Signature(attributes_shape(model)))`
        Attributes.

    Source: docs/theory/textures.md#quotient.
    """

    def __init__(self, model: Attributes | None = None, initiation_interval: int = 1):
        self.model = p = model or Attributes()
        self._graph = Dataflow(initiation_interval, memories=True)
        self._results = self._describe()
        super().__init__(
            attribute_words_shape(p.spans),
            attributes_shape(p),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        at = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for name in result.shape().members:
            if name == "level":
                m.d.comb += result.level.eq(at(self._results["level"], self.latency))
                continue
            for index, found in enumerate(result[name]):
                m.d.comb += found.eq(at(self._results[f"{name}_{index}"], self.latency))
        return result

    def _product(
        self, name: str, a: Word, b: Word, left: Callable = lambda x: x, right: Callable = lambda x: x
    ) -> Word:
        """Product, with registers that the multiplier block can take in."""
        g = self._graph
        if g.interval > 1:
            return g.multiply(name, a, b, left, right)
        a, b = g.register(f"{name}_a", left, a), g.register(f"{name}_b", right, b)
        return g.register(name, lambda x, y: x * y, a, b)

    def _describe(self) -> dict[str, Word]:
        """All words, from the words of a pixel to the results."""
        p, g = self.model.spans, self._graph
        names = [f"colors_{k}" for k in range(3 * p.colors)]
        names += [f"coordinates_{k}" for k in range(2 * p.coordinates)]
        numerators = {}
        for name in names:
            member, index = name.split("_")
            numerators[name] = g.input(
                name, lambda operands, member=member, index=int(index): operands[member][index], "U"
            )
        if p.perspective:
            numerators = self._quotients(numerators)
        results = {}
        for name, word in numerators.items():
            if name.startswith("colors"):
                results[name] = self._color(name, word)
        if p.coordinates:
            range_ = g.input("range", lambda operands: operands.range)
            for k in range(2):
                name = f"coordinates_{k}"
                base = g.input(f"base_{k}", lambda operands, k=k: operands.base[k], "base")
                results[name] = self._coordinate(name, numerators[name], range_, base)
            results["level"] = g.input("level", lambda operands: operands.level)
        return results

    def _quotients(self, numerators: dict[str, Word]) -> dict[str, Word]:
        """Words of A from the words of U."""
        g = self._graph
        weight = g.input("weight", lambda operands: operands.weight, "w")

        def zeros(weight):
            return leading_zeros(Value.cast(weight)[_WEIGHT_BITS - Attributes.SHIFTS : _WEIGHT_BITS])

        shift = g.register("shift", zeros, weight)

        def normalised(weight, shift):
            return (Value.cast(weight)[:_WEIGHT_BITS] << shift)[: _WEIGHT_BITS - 1]

        normal = g.register("normal", normalised, weight, shift, formula="x")
        rest, halves, bend = self._reciprocal(normal)
        results = {}
        for name, numerator in numerators.items():

            def shifted(numerator, shift):
                return FixedValue(SQ(2, 23), (Value.cast(numerator) << shift)[:25])

            # The shifted word is made as late as the reciprocal allows, because a word that waits is copied.
            moved = g.register(f"{name}_shifted", shifted, numerator, shift, since=bend, formula="U' = 2^k·U")
            if name.startswith("colors"):
                moved = operand = g.register(f"{name}_inside", lambda u: u.saturate(UQ(0, 23)), moved)
                total, left = UQ(1, 23), lambda u: u.truncate(17)
            else:
                operand = g.register(
                    f"{name}_operand", lambda u: u.round_half_up(17).saturate(SQ(1, 17)), moved
                )
                total, left = Attributes.QUOTIENT_FORMAT, lambda u: u
            product = self._product(f"{name}_product", operand, rest, left)
            whole = g.register(f"{name}_whole", self._whole, moved, halves, formula="2·c·U'")

            def quotient(whole, product, total=total):
                return (whole + product.scale(1).truncate(23)).wrap(total)

            results[name] = g.register(f"{name}_quotient", quotient, whole, product, formula="A")
        return results

    @staticmethod
    def _whole(numerator: FixedValue, halves: Value) -> FixedValue:
        """U plus no, one or two halves of U."""
        code, format = Value.cast(numerator), numerator.format
        more = Mux(halves[1], code, Mux(halves[0], code >> 1, 0))
        format = type(format)(format.signed, format.integer_bits + 1, format.fraction_bits)
        return FixedValue(format, (code + more)[: format.width])

    def _reciprocal(self, normal: Word) -> tuple[Word, Word, Word]:
        """Words of the reciprocal (see `Attributes`): d, c as a number of halves, and the table's product."""
        p, g = self.model, self._graph
        bits = p.BASE_FORMAT.width + p.SLOPE_FORMAT.width
        base, slope = (word.codes for word in p.table)
        mask = (1 << p.BASE_FORMAT.width) - 1
        words = [int(b) & mask | int(s) << p.BASE_FORMAT.width for b, s in zip(base, slope, strict=True)]
        address = g.wire("address", lambda normal: normal[_FRACTION.width :], normal)
        entry = g.look_up("reciprocals", words, bits, address, registered=True)
        fraction = g.wire("fraction", lambda normal: normal[: _FRACTION.width], normal, "f")
        bend = self._product(
            "bend",
            entry,
            fraction,
            lambda word: FixedValue(p.SLOPE_FORMAT, word[p.BASE_FORMAT.width :]),
            lambda fraction: FixedValue(_FRACTION, fraction),
        )

        def rounded(word, bend):
            base = FixedValue(p.BASE_FORMAT, word[: p.BASE_FORMAT.width])
            rest = base - bend.truncate(p.BASE_FORMAT.fraction_bits)
            return rest.truncate(p.RECIPROCAL_FORMAT.fraction_bits).wrap(p.RECIPROCAL_FORMAT)

        rest = g.register("rest", rounded, entry, bend, formula="d")

        def halves(address):
            return Cat((address >= p.WHOLE) & (address < p.HALF), address < p.WHOLE)

        return rest, g.register("halves", halves, address), bend

    def _color(self, name: str, word: Word) -> Word:
        """Word of a colour, from its quotient, or without perspective from its line."""
        p, g = self.model, self._graph
        if not p.spans.perspective:
            word = g.register(f"{name}_inside", lambda u: u.saturate(UQ(0, 23)), word)

        def saturated(quotient):
            code = Value.cast(quotient.round_half_up(p.COLOR_FORMAT.fraction_bits))
            one = code[p.COLOR_FORMAT.fraction_bits :].any()
            return FixedValue(p.COLOR_FORMAT, Cat(Mux(one, 0, code[: p.COLOR_FORMAT.fraction_bits]), one))

        return g.register(name, saturated, word, formula="A")

    def _coordinate(self, name: str, word: Word, range_: Word, base: Word) -> Word:
        """Word of a texture coordinate, from its quotient, or without perspective from its line."""
        p, g = self.model, self._graph
        format = p.coordinate_format
        dropped = Attributes.QUOTIENT_FORMAT.fraction_bits - p.share_bits

        def spread(offset, range_):
            # There is one bit more than in the result, for the rounding.
            return (Value.cast(offset) << range_)[dropped - 1 :][: format.width + 1]

        def placed(offset, base):
            whole = Cat(Const(0, p.share_bits), Value.cast(base))
            return FixedValue(format, (whole + offset[1:] + offset[0])[: format.width])

        offset = g.register(f"{name}_offset", spread, word, range_, formula="2^range·A")
        return g.register(name, placed, offset, base, formula="base + 2^range·A")
