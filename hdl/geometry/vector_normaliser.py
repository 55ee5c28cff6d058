"""Vector normaliser: a vector of any length brought to unit length."""

from typing import ClassVar

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.geometry.vector_normaliser import VectorNormaliser
from blysk.golden.number.fixed import SQ
from blysk.golden.number.unit_vector import COMPONENT, ONE
from blysk.hdl.core.dataflow import MULTIPLIER_BITS, Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.word import Word
from blysk.hdl.geometry.booth import booth_term
from blysk.hdl.normals.dot_product import DotProductUnit

__all__ = ["SharedVectorNormaliserUnit", "VectorNormaliserUnit", "vectors_shape"]


def vectors_shape(model: VectorNormaliser) -> tuple[data.StructLayout, data.StructLayout]:
    """Shapes of a vector with the flag ``flip``, and of a unit vector with the flag ``lost``."""
    vector = data.ArrayLayout(FixedShape(model.format), 3)
    return (
        data.StructLayout({"vector": vector, "flip": unsigned(1)}),
        data.StructLayout({"normal": normal_shape(), "lost": unsigned(1)}),
    )


class VectorNormaliserUnit(PipelinedUnit):
    """Unit vector along a vector of any length. `VectorNormaliser` is the bit-accurate model.

    The latency is 18 cycles. Shift and rounding take four, `DotProductUnit` three, the segment one, the table
    two, ``c0 - c1 u`` three, e one, and ``v + e v`` four. The initiation interval is 1. There are six
    multipliers of 18x18 bits, for three squares and three scalings. ``c1 u`` is a sum of terms by Booth
    digits. The table holds 512 words of 32 bits.

    Parameters
    ----------
    model : VectorNormaliser
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"vector": ..., "flip": 1})))`
        A vector. ``flip``: its unit vector is negated.
    o : :py:`Out(stream.Signature(StructLayout({"normal": ..., "lost": 1})))`
        Unit vector, ``SQ(1, 17)``. ``lost``: the vector has no direction.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        r"(product|scaled)_(\d)": r"e·w_\2",
        r"total_(\d)": r"w_\1 + e·w_\1",
        r"normal_(\d)": r"N_\1",
        "product": "c_1·u",
        "f": "c_0 − c_1·u",
    }

    def __init__(self, model: VectorNormaliser | None = None):
        self.model = model or VectorNormaliser()
        self._dot, self.multipliers = DotProductUnit(), 6
        super().__init__(*vectors_shape(self.model), latency=self._dot.latency + 15)

    def datapath(self, m, operands):
        """Shift the vector, square its components, read the factor from the table, and scale the vector."""
        dot = self._dot
        m.submodules.dot_product = dot
        words, lost = self._shift(m, operands)
        m.d.comb += [dot.i.valid.eq(1), dot.o.ready.eq(1)]
        for side in (dot.i.payload.a, dot.i.payload.b):
            m.d.comb += [to.eq(word) for to, word in zip(side, words, strict=True)]
        at_factor = dot.latency + 11
        e = self._factor(m, dot.o.payload)
        late = [self._delay(m, word, f"v_{k}", at_factor - 4) for k, word in enumerate(words)]
        flip = self._delay(m, operands.flip, "flip", at_factor + 3)
        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += result.lost.eq(self._delay(m, lost, "lost", self.latency - 4))
        for k, word in enumerate(late):
            product = self.register(m, self.register(m, e * word, f"product_{k}"), f"scaled_{k}")
            word = self._delay(m, word, f"late_{k}", 2)
            total = self.register(m, word + product, f"total_{k}")
            m.d.comb += Value.cast(result.normal[k]).eq(
                self.register(m, _clipped(_turned(total, flip)), f"normal_{k}")
            )
        return result

    def _delay(self, m: Module, value, name: str, cycles: int):
        for k in range(cycles):
            value = self.register(m, value, f"{name}_{k}")
        return value

    def _shift(self, m: Module, operands) -> tuple[list[FixedValue], Value]:
        """Shifted components, rounded to 18 bits, and whether the vector is lost: at stage 4."""
        bits = self.model.format.width - 1
        codes = [Value.cast(component).as_signed() for component in operands.vector]
        ones = 0
        for code in codes:
            ones = ones | (code[:bits] ^ code[-1].replicate(bits))
        ones = self.register(m, ones, "ones_1")
        codes = [self.register(m, code, f"vector_1_{k}") for k, code in enumerate(codes)]
        for age, steps in ((2, (8, 4)), (3, (2, 1))):
            for step in steps:
                empty = ~ones[-step:].any()
                ones = Mux(empty, ones << step, ones)[:bits]
                codes = [Mux(empty, code << step, code)[: bits + 1].as_signed() for code in codes]
            ones = self.register(m, ones, f"ones_{age}")
            codes = [self.register(m, code, f"vector_{age}_{k}") for k, code in enumerate(codes)]
        lost = self.register(m, ~ones[-1], "lost")
        words = []
        for k, code in enumerate(codes):
            word = self.register(m, _component(code, bits), f"shifted_{k}")
            words.append(FixedValue(COMPONENT, word.as_signed()))
        return words, lost

    def _factor(self, m: Module, square: FixedValue) -> FixedValue:
        """``e`` of a squared length, 7 cycles later."""
        p, register = self.model, self.register
        s, large = _root_place(square)
        bits = p.OFFSET_FORMAT.width - 1
        segment = register(m, s[bits:], "segment")
        rest = register(m, s[:bits], "rest")
        large = self._delay(m, large, "large", 6)
        c0, c1 = self._coefficients(m, segment)
        # u counts half steps. u is always odd, because half a step stands for the dropped bits.
        u = self._delay(m, _offset(rest), "u", 2)
        # c1 is unsigned: a zero above it completes its last Booth digit.
        digits = Cat(Const(0, 1), Value.cast(c1), Const(0, 2))
        count = (len(Value.cast(c1)) + 2) // 2
        terms = [booth_term(u, digits[2 * k : 2 * k + 3]) << (2 * k) for k in range(count)]
        pairs = [register(m, sum(terms[k : k + 2]), f"pair_{k}") for k in range(0, count, 2)]
        c0 = self._delay(m, c0, "c0", 2)
        product = register(m, sum(pairs), "product")
        f = register(m, _root(p, Value.cast(c0), product), "f")
        return register(m, _excess(p, f, large), "e")

    def _coefficients(self, m: Module, segment: Value) -> tuple[FixedValue, FixedValue]:
        """``c0`` and ``c1`` of the segment.

        They take two cycles, because a block RAM's output is late in its cycle.
        """
        layout = _row_shape(self.model)
        rows = zip(*(column.values.tolist() for column in self.model.coefficients), strict=True)
        rows = [dict(zip(("c0", "c1"), row, strict=True)) for row in rows]
        m.submodules.roots = table = Memory(shape=layout, depth=len(rows), init=rows)
        port = table.read_port()
        m.d.comb += port.addr.eq(segment)
        row = self.register(m, port.data, "row")
        return row.c0, row.c1


class SharedVectorNormaliserUnit(PipelinedUnit):
    """`VectorNormaliserUnit` for vectors some cycles apart. Components and products take turns.

    One shifter and one unit for the last rounding serve the three components. Let I be the initiation
    interval. The seven multiplications take turns at ``ceil(7 / I)`` multipliers of 18x18 bits. The latency,
    `latency`, follows from the schedule: 30 cycles for an interval of 3 or 4.

    Parameters
    ----------
    model : VectorNormaliser
        Bit-accurate model.
    initiation_interval : int
        Least number of cycles from a vector to the next, at least 3.

    Raises
    ------
    ValueError
        If the interval is too short.

    Members
    -------
    i, o
        As in `VectorNormaliserUnit`.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, model: VectorNormaliser | None = None, initiation_interval: int = 4):
        if initiation_interval < 3:
            raise ValueError(f"initiation_interval must be at least 3, not {initiation_interval}")
        self.model = model or VectorNormaliser()
        self._graph = Dataflow(initiation_interval)
        self._results = self._describe()
        self.multipliers = self._graph.multiplier.count
        super().__init__(
            *vectors_shape(self.model),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
        )

    def _describe(self) -> dict[str, Word]:
        """Words of the results."""
        g, p = self._graph, self.model
        vector, flip = (g.input(name, lambda o, name=name: o[name]) for name in ("vector", "flip"))
        places = self._places(vector)
        shifter = self._shifter()
        words = [
            g.use(
                shifter,
                f"shifted_{k}",
                (vector, places),
                lambda v, places, k=k: (Value.cast(v[k]), places[:4]),
                lambda code: FixedValue(COMPONENT, code[: COMPONENT.width].as_signed()),
            )
            for k in range(3)
        ]
        squares = [g.multiply(f"square_{k}", word, word) for k, word in enumerate(words)]
        partial = g.register("partial_sum", lambda a, b: a + b, *squares[:2])
        square = g.register("sum", lambda a, b: a + b, partial, squares[2])
        offset_bits = p.OFFSET_FORMAT.width - 1
        place = g.register("place", lambda s: Cat(*_root_place(s)), square)
        segment = g.wire("segment", lambda s: s[offset_bits : offset_bits + p.SEGMENT_BITS], place)
        c0, c1 = (column.codes.tolist() for column in p.coefficients)
        low = p.C0_FORMAT.width
        table = [a | b << low for a, b in zip(c0, c1, strict=True)]
        row = g.look_up("roots", table, _row_shape(p).size, segment)
        slope = g.multiply(
            "slope",
            row,
            place,
            lambda row: FixedValue(p.C1_FORMAT, row[low:]),
            lambda place: FixedValue(p.OFFSET_FORMAT, _offset(place[:offset_bits])),
        )
        f = g.register("f", lambda row, slope: _root(p, row[:low], Value.cast(slope)), row, slope)
        e = g.register("e", lambda f, place: _excess(p, f, place[-1]), f, place)
        scaled = [g.multiply(f"scaled_{k}", e, word) for k, word in enumerate(words)]
        product = p.FACTOR_FORMAT * COMPONENT
        last = self._last(product)
        normals = [
            g.use(last, f"normal_{k}", (*pair, flip), lambda a, b, flip: (Value.cast(a), Value.cast(b), flip))
            for k, pair in enumerate(zip(scaled, words, strict=True))
        ]
        lost = g.wire("lost", lambda places: ~places[4], places)
        return {"lost": lost} | {f"normal_{k}": normal for k, normal in enumerate(normals)}

    def _places(self, vector: Word) -> Word:
        """Places of the shift, four bits. The bit above them tells whether a 1 comes to the top."""
        g, bits = self._graph, self.model.format.width - 1

        def ones(v):
            codes = [Value.cast(component).as_signed() for component in v]
            found = [code[:bits] ^ code[-1].replicate(bits) for code in codes]
            return found[0] | found[1] | found[2]

        def moved(word, step):
            # Shift by zero to three steps. Both bits of the number of steps follow from the unshifted word.
            empties = [~word[bits - (k + 1) * step : bits - k * step].any() for k in range(3)]
            two = empties[0] & empties[1]
            one = Mux(two, empties[2], empties[0])
            places = Mux(two, Mux(one, word << 3 * step, word << 2 * step), Mux(one, word << step, word))
            return places[:bits], one, two

        def coarse(word):
            return Cat(*moved(word, 4))

        def fine(word):
            word, above = word[:bits], word[bits:]
            word, one, two = moved(word, 1)
            return Cat(one, two, above, word[-1])

        return g.register("places", fine, g.register("coarse_ones", coarse, g.register("ones", ones, vector)))

    def _shifter(self):
        """Shift left by 0 to 15 places in two registers. A third register rounds to 18 bits."""
        width = self.model.format.width

        def shift(register, word, amount):
            coarse = register((word << Cat(Const(0, 2), amount[2:]))[:width].as_signed(), "coarse")
            fine = register(amount[:2], "fine_amount")
            shifted = register((coarse << fine)[:width].as_signed(), "shifted")
            return register(_component(shifted, width - 1), "rounded")

        return self._graph.share("shifter", (signed(width), unsigned(4)), 3, shift)

    def _last(self, format):
        """``v + e v``, negated if ``flip``, and rounded. This takes three registers."""

        def last(register, product, word, flip):
            total = register(FixedValue(COMPONENT, word) + FixedValue(format, product), "total")
            turned = register(_turned(total, register(flip, "flip")), "turned")
            return register(_clipped(turned), "normal")

        operands = signed(format.width), signed(MULTIPLIER_BITS), unsigned(1)
        return self._graph.share("last", operands, 3, last)

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape(), name="result")
        m.d.comb += [
            result.lost.eq(value(self._results["lost"], self.latency)),
            *(
                Value.cast(result.normal[k]).eq(value(self._results[f"normal_{k}"], self.latency))
                for k in range(3)
            ),
        ]
        return result


def _row_shape(p: VectorNormaliser) -> data.StructLayout:
    return data.StructLayout({"c0": FixedShape(p.C0_FORMAT), "c1": FixedShape(p.C1_FORMAT)})


def _clipped(code: Value) -> Value:
    """A component saturated to -ONE and ONE."""
    return Mux(code > ONE, ONE, Mux(code < -ONE, -ONE, code))[: COMPONENT.width]


def _component(code: Value, bits: int) -> Value:
    """A shifted component with ``bits`` bits below its sign, rounded half up to 18 bits."""
    places = bits - COMPONENT.fraction_bits
    return _clipped((code + (1 << (places - 1))) >> places)


def _root_place(square: FixedValue) -> tuple[Value, Value]:
    """``s'`` in 20 bits, which is s or s/4, and whether the squared length s is 1 or more."""
    s = Value.cast(square.truncate(22))
    large = s[22:].any()
    return Mux(large, s[2:], s)[2:22], large


def _offset(rest: Value) -> Value:
    """``u``: distance of s' from its segment's middle in half steps. The bits that were cut make it odd."""
    return Cat(Const(1, 1), rest[:-1], ~rest[-1]).as_signed()


def _root(p: VectorNormaliser, c0: Value, product: Value) -> Value:
    """Factor ``f = c0 - c1 u`` of the reciprocal root."""
    point = p.OFFSET_FORMAT.fraction_bits + p.C1_FORMAT.fraction_bits
    return (c0 - (product >> (point - p.C0_FORMAT.fraction_bits)))[: p.C0_FORMAT.width]


def _excess(p: VectorNormaliser, f: Value, large: Value) -> FixedValue:
    """Factor ``e = f - 1``, or ``f/2 - 1`` if ``large``, rounded. Before, in steps of 2^-21, f/2 is exact."""
    one = 1 << p.C0_FORMAT.fraction_bits
    e = FixedValue(SQ(2, 21), Mux(large, f - 2 * one, (f - one) << 1)[:23].as_signed())
    return e.round_half_up(17).wrap(p.FACTOR_FORMAT)


def _turned(total: FixedValue, flip: Value) -> Value:
    """A component of the result before it is clipped. It is negated if ``flip``, and rounded half up."""
    code = Value.cast(total)
    half = Value.cast(FixedValue.constant(SQ(2, 34), 0.5 * COMPONENT.step))
    turned = (code[:] ^ flip.replicate(len(code))).as_signed() + flip + half
    return turned >> (total.format.fraction_bits - COMPONENT.fraction_bits)
