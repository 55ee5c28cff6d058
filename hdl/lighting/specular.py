"""Specular unit: the cosine-quadratic model with its PROM cutoff, and related models."""

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.highlight_operand import HighlightOperand
from blysk.golden.lighting.specular import MAX_EXPONENT, Chords, Specular
from blysk.golden.number.fixed import UQ, Format
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word

__all__ = ["SlopeUnit", "SpecularUnit", "highlight_shape", "one_minus", "slope_shape"]

_SHIFT_BITS = 4


def highlight_shape(model: HighlightOperand) -> data.StructLayout:
    """Shape of a unit's input: the operand, and whether the beat is dark. A dark beat has the term 0."""
    return data.StructLayout({"operand": FixedShape(model.operand_format), "dark": unsigned(1)})


def slope_shape() -> data.StructLayout:
    """Shape of the output of a `SlopeUnit`: K, shift s + 1, and the largest shifted argument that is lit."""
    return data.StructLayout(
        {
            "scale": FixedShape(Specular.SCALE_FORMAT),
            "shift": unsigned(_SHIFT_BITS),
            "boundary": FixedShape(Specular.SHIFTED_FORMAT),
        }
    )


def one_minus(model: HighlightOperand, operand: FixedValue) -> FixedValue:
    """Exact ``1 - cos gamma`` of an operand of either kind."""
    if model.operand == "cosine":
        return FixedValue.constant(ONE_SQUARED.format, ONE_SQUARED.values.item()) - operand
    return operand


class SlopeUnit(wiring.Component):
    """Slope ``k = K 2^s`` and boundary of the cutoff: words of a `SpecularUnit` for an exponent.

    The bit-accurate models are `Specular.scale` and `Specular.boundaries`. ``slope`` follows the exponent
    after two cycles, the boundary after three.

    One unit serves all lights. The slope costs a multiplier by a constant, or no multiplier if
    ``k = n / 2^j``. For ``cosquad_q`` and the models by equal integrals it costs a table of 1024 words of 27
    bits. The PROM has 1024 words of 17 bits. The unit as published has no PROM.

    Parameters
    ----------
    model : Specular
        Bit-accurate model.

    Members
    -------
    exponent : :py:`In(10)`
        1 to 1000.
    slope : :py:`Out(slope_shape())`
        K in ``UQ(0, 17)``, s + 1 from 0 to 10, boundary in ``UQ(1, 16)``.

    Source: docs/theory/units.md#specular-unit; [T] figure 3.6; [C].
    """

    def __init__(self, model: Specular | None = None):
        self.model = model or Specular()
        super().__init__({"exponent": In(Specular.EXPONENT_BITS), "slope": Out(slope_shape())})

    def elaborate(self, platform):
        """Slope and PROM, then normalisation, a cycle each."""
        p = self.model
        m = Module()
        if p.slope_terms is None:
            code = self._look_up(m, "slopes", p.slopes.codes, p.SLOPE_FORMAT)
        else:
            exponent = FixedValue(UQ(p.EXPONENT_BITS, 0), self.exponent)
            a, b = (FixedValue.constant(term.format, term.values.item()) for term in p.slope_terms)
            code = Signal(p.SLOPE_FORMAT.width, name="slope_word", reset_less=True)
            m.d.sync += code.eq(((a * exponent).truncate(18) + b).wrap(p.SLOPE_FORMAT).as_value())
        # This register has no reset, so that synthesis can use a multiplier's own register for it.
        scale = Signal(FixedShape(p.SCALE_FORMAT), name="scale", reset_less=True)
        shift = Signal(_SHIFT_BITS, name="shift", reset_less=True)
        for s in range(-1, 10):
            with m.If(code[s + 17] if s >= 0 else 1):
                m.d.sync += [Value.cast(scale).eq((code << (9 - s))[10:27]), shift.eq(s + 1)]
        boundary = Const(p.SHIFTED_FORMAT.max_code, p.SHIFTED_FORMAT.width)
        if not p.as_published:
            word = self._look_up(m, "boundaries", p.boundaries.codes, p.SHIFTED_FORMAT)
            read, boundary = (
                Signal(p.SHIFTED_FORMAT.width, name=name, reset_less=True) for name in ("read", "boundary")
            )
            # The first register is inside an FPGA's memory, far from the logic that the second register
            # drives.
            m.d.sync += [read.eq(word), boundary.eq(read)]
        m.d.comb += [
            self.slope.scale.eq(scale),
            self.slope.shift.eq(shift),
            Value.cast(self.slope.boundary).eq(boundary),
        ]
        return m

    def _look_up(self, m: Module, name: str, codes, format: Format) -> Value:
        m.submodules[name] = table = Memory(shape=format.width, depth=len(codes), init=codes.tolist())
        port = table.read_port()
        m.d.comb += port.addr.eq(self.exponent)
        return port.data


class SpecularUnit(PipelinedUnit):
    """Specular term ``max(1 - k (1 - cos gamma), 0)^2`` or a higher power. It is 0 for a dark beat.

    The bit-accurate model `Specular` has models, formats, PROM and error bound. A beat is dark if
    the light is behind the surface, or if a highlight gate tells that its span has no highlight. A dark beat
    has the argument 0. So from one dark beat to the next only the input and the first register toggle.

    With an initiation interval I of 1 the latency is 7 cycles (difference from 1, saturation, shift,
    saturation, product, base, square). Each of M products has a multiplier of 17 by 17 bits. Multipliers of
    the chords have 17 by 11 and 14 by 11 bits for ``coscos``, and 13 by 11 for ``exp``. With a longer
    interval the products share ``ceil(M / I)`` multipliers of 18 by 18 bits. A product then takes two cycles
    more, for its operands and the registers around the multiplier (`registered_product`). It also waits
    for its slot.

    ============= = ===== == == == == =====================================================
    model         M I = 1 2  3  4  6  beside slope and square
    ============= = ===== == == == == =====================================================
    line, squared 2 7     13 12 13 12
    lyon2         3 8     15 16 18 15 a square
    lyon3         4 9     19 19 23 19 two squares
    exp           2 9     15 14 15 14 64 words of 32 bits and a shift, no square
    coscos2       5 11    20 21 21 21 a product, 128 words of 36 bits, 64 of 33, and chords
    coscos4       6 12    23 24 25 24 the same and a square
    as published  1 8     11 11 11 11 the slope's multiplier is of 18 by 17 bits, never shared
    ============= = ===== == == == == =====================================================

    Slope and PROM cost the same as in a `SlopeUnit`.

    Parameters
    ----------
    model : Specular
        Bit-accurate model: reflection model, kind of operand, form.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    exponent : int or None
        Exponent, 1 to 1000, fixed at build time. There is then no PROM, the shift is constant, and the
        slope's multiplier multiplies by a constant, so M is one less. ``None``: the exponent is a port.
    shares_slope : bool
        Whether slope and boundary come from a `SlopeUnit` outside. If not, and ``exponent`` is ``None``, the
        unit has a `SlopeUnit` of its own.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"operand": ..., "dark": 1})))`
        ``cos gamma`` in ``SQ(4, 34)`` or ``1 - cos gamma`` in ``UQ(1, 25)``. ``dark``: the light is behind
        the surface, or the span has no highlight. The term is then 0.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Specular term.
    constants : :py:`In(StructLayout({"exponent": 10}))` or :py:`In(slope_shape())`
        Exponent, 1 to 1000, or the output of a `SlopeUnit`. The exponent is constant while beats are inside,
        the slope from two cycles after the first beat on, the boundary from three cycles. With a fixed
        exponent there is no port.

    Raises
    ------
    ValueError
        If the interval or the exponent is out of range, or a unit with a fixed exponent has ``shares_slope``.

    Source: docs/theory/units.md#specular-unit; [T] figures 3.6 and 3.7; [C].
    """

    def __init__(
        self,
        model: Specular | None = None,
        *,
        initiation_interval: int = 1,
        exponent: int | None = None,
        shares_slope: bool = False,
    ):
        self.model = p = model or Specular()
        if exponent is not None and not 1 <= exponent <= MAX_EXPONENT:
            raise ValueError(f"exponent must be 1 to {MAX_EXPONENT}, not {exponent}")
        if exponent is not None and shares_slope:
            raise ValueError("a unit with an exponent of its own shares no slope")
        self.exponent, self.shares_slope = exponent, shares_slope
        self._multiplies_slope = exponent is None and not p.as_published
        self._graph = Dataflow(initiation_interval)
        self._result = self._describe()
        constants = None
        if shares_slope:
            constants = slope_shape()
        elif exponent is None:
            constants = data.StructLayout({"exponent": unsigned(p.EXPONENT_BITS)})
        super().__init__(
            highlight_shape(p),
            FixedShape(p.RESULT_FORMAT),
            latency=self._result.stage,
            initiation_interval=initiation_interval,
            constants=constants,
        )

    @staticmethod
    def multiplications(model: Specular, exponent: int | None = None) -> int:
        """Multiplications M, as in the table above. An initiation interval of M needs one multiplier."""
        chords = 3 if model.is_coscos else int(model.is_exponential)
        by_slope = exponent is None and not model.as_published
        return by_slope + model.squarings + chords

    def datapath(self, m, operands):
        """The registers of the graph, and the words of slope and boundary."""
        self._slope = self._frame_values(m)
        return self._graph.build(m, self, operands)(self._result, self.latency)

    def _frame_values(self, m: Module) -> tuple[FixedValue, Value, FixedValue]:
        """K, s + 1 and the boundary. They are constants, or words of a `SlopeUnit` outside or inside."""
        p = self.model
        if self.exponent is not None:
            (scale, shift), boundary = p.scale(self.exponent), p.boundaries[self.exponent]
            return (
                FixedValue.constant(scale.format, scale.values.item()),
                Const(int(shift) + 1, _SHIFT_BITS),
                FixedValue.constant(boundary.format, boundary.values.item()),
            )
        if self.shares_slope:
            slope = self.constants
        else:
            m.submodules.slope = unit = SlopeUnit(p)
            m.d.comb += unit.exponent.eq(self.constants.exponent)
            slope = unit.slope
        return slope.scale, slope.shift, slope.boundary

    def _describe(self) -> Word:
        """Words from the operand to the result."""
        p, g = self.model, self._graph
        operand = g.input("operand", lambda operands: operands.operand)
        self._dark = dark = g.input("dark", lambda operands: operands.dark)

        def saturated(argument, dark):
            argument = Value.cast(argument.saturate(p.ARGUMENT_FORMAT))
            return FixedValue(p.ARGUMENT_FORMAT, Mux(dark, 0, argument)[: p.ARGUMENT_FORMAT.width])

        def shifted(argument):
            return FixedValue(UQ(10, 26), (Value.cast(argument) << self._slope[1])[:36]).truncate(16)

        def is_lit(wide, dark):
            # Whether the saturated argument is at most the boundary. This is always so if the boundary is the
            # largest code.
            boundary = self._slope[2]
            return ((wide <= boundary) | Value.cast(boundary).all()) & ~dark

        argument = g.register(
            "one_minus_cosine", lambda x: one_minus(p, x).truncate(25), operand, formula="u"
        )
        argument = g.register("argument", saturated, argument, dark, formula="u")
        wide = g.register("shifted_wide", shifted, argument, formula="2^k·u")
        format = p.PUBLISHED_FORMAT if p.as_published else p.SHIFTED_FORMAT
        operand = g.register("shifted", lambda wide: wide.saturate(format), wide)
        if self._multiplies_slope:
            product = self._multiply(
                "product", operand, operand, right=lambda _: self._slope[0], formula="n·u"
            )
        else:
            product = g.register("product", lambda x: x * self._slope[0], operand, formula="n·u")
        if p.as_published:
            return self._as_published(product)
        lit = g.register("lit", is_lit, wide, dark)
        if p.is_exponential:
            return self._exponential(product, lit)

        def below_one(product):
            # Below the boundary the product is under 1.
            return Value.cast(product.truncate(17))[:17]

        if p.is_coscos:
            base = self._cosine(argument, product, below_one, lit)
        else:
            # 1 - 2^-17 - product is the product with inverted bits.
            base = g.register(
                "base",
                lambda product, lit: FixedValue(p.BASE_FORMAT, Mux(lit, ~below_one(product), 0)[:17]),
                product,
                lit,
                formula="1 − n·u",
            )
        root = base.symbol.within(2)
        for name, power in tuple(zip(("square", "square_2", "square_3"), "²⁴⁸", strict=True))[: p.squarings]:
            base = self._multiply(name, base, base, _cut, _cut, root + power)
        return g.wire("result", _cut, base)

    def _multiply(
        self,
        name: str,
        a: Word,
        b: Word,
        left: Callable[[Any], FixedValue] = lambda value: value,
        right: Callable[[Any], FixedValue] = lambda value: value,
        formula: str | None = None,
    ) -> Word:
        """Word of an exact product.

        With a multiplier of its own the product takes one cycle. Otherwise it is issued to a shared
        multiplier.
        """
        g = self._graph
        if g.interval == 1:
            return g.register(name, lambda x, y: left(x) * right(y), a, b, formula=formula)
        format: list[Format] = []

        def operands(x, y, dark):
            x, y = left(x), right(y)
            format.append(x.format * y.format)
            return tuple(Mux(dark, 0, Value.cast(value)) for value in (x, y))

        def product(code):
            return FixedValue(format[-1], code[: format[-1].width])

        return g.use(g.multiplier, name, (a, b, self._dark), operands, product, formula=formula)

    def _as_published(self, product: Word) -> Word:
        """Base of either sign, its square, and the comparator on the square."""
        p, g = self.model, self._graph

        def base(product, dark):
            code = Value.cast(product.truncate(17))
            base = Mux(code[18], p.BASE_FORMAT.max_code, Mux(code[17], code[:17], ~code[:17]))
            return FixedValue(p.BASE_FORMAT, Mux(dark, 0, base)[:17])

        def result(square):
            square = square.truncate(17)
            bright = square >= FixedValue.constant(p.RESULT_FORMAT, p.CUTOFF**2)
            return FixedValue(p.RESULT_FORMAT, Mux(bright, Value.cast(square), 0))

        base = g.register("base", base, product, self._dark, formula="1 − n·u")
        return g.register("result", result, self._multiply("square", base, base))

    def _cosine(self, argument: Word, product: Word, below_one: Callable, lit: Word) -> Word:
        """Base of ``coscos``: e and the product p at the same time, then ``p + p e``, then the cosine."""
        p, g = self.model, self._graph
        code = g.wire("excess_code", lambda x: Value.cast(x)[8:], argument)
        e = self._interpolate("excess", p.excess, code)
        product = g.wire("p", lambda product: FixedValue(p.BASE_FORMAT, below_one(product)), product)
        more = self._multiply("more", product, e, right=lambda e: e.truncate(16))
        w = g.register("w", lambda product, more: (product + more).truncate(17), product, more)
        # If lit, w is under 1.
        code = g.wire("chords_code", lambda w: Value.cast(w)[:17], w)
        return self._interpolate("chords", p.chords, code, lit)

    def _exponential(self, product: Word, lit: Word) -> Word:
        """``2^-power``: chords, then the shift."""
        p, g = self.model, self._graph

        def power(product):
            return Value.cast(product.truncate(21).scale(4))

        def result(value, whole, lit):
            shifted = Mux(lit, Value.cast(value)[2:] >> whole, 0)
            return FixedValue(p.RESULT_FORMAT, shifted[: p.RESULT_FORMAT.width])

        whole = g.wire("whole", lambda product: power(product)[17:21], product)
        value = self._interpolate(
            "chords", p.chords, g.wire("f", lambda product: power(product)[:17], product)
        )
        return g.register("result", result, value, whole, lit, formula="2^−(n·u)")

    def _interpolate(self, name: str, chords: Chords, code: Word, lit: Word | None = None) -> Word:
        """`Chords.compute` by table, product and sum. The result is 0 unless ``lit``."""
        g = self._graph
        format, step_format = chords.start.format, chords.step.format
        words = (chords.start.codes | chords.step.codes << format.width).tolist()
        bits = chords.INTERPOLATION_FORMAT.width
        address = g.wire(f"{name}_address", lambda code: code[bits:], code)
        word = g.look_up(name, words, format.width + step_format.width, address)
        within = g.register(
            f"{name}_within", lambda code: FixedValue(chords.INTERPOLATION_FORMAT, code[:bits]), code
        )
        way = self._multiply(
            f"{name}_way",
            word,
            within,
            lambda word: FixedValue(step_format, word[format.width :]),
            formula="step·t",
        )
        start = g.wire(f"{name}_start", lambda word: FixedValue(format, word[: format.width]), word)

        def value(start, way, lit=None):
            way = way.truncate(format.fraction_bits)
            value = (start + way if chords.rising else start - way).wrap(format)
            return value if lit is None else FixedValue(format, Mux(lit, Value.cast(value), 0))

        formula = "start + step·t" if chords.rising else "start − step·t"
        given = [start, way, *([] if lit is None else [lit])]
        return g.register(f"{name}_value", value, *given, formula=formula)


def _cut(value: FixedValue) -> FixedValue:
    """Cut to the 17 fraction bits of a base and of the result."""
    return value.truncate(17)
