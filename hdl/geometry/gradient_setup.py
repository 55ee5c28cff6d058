"""Gradient setup: one attribute's start and steps along the long edge and along a scanline."""

from amaranth.hdl import Cat, Const, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data

from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.plane_setup import PlaneSetup
from blysk.golden.geometry.triangles import ATTRIBUTE
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.accumulator import Accumulator
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.views import choose
from blysk.hdl.geometry.plane_setup import scales_shape
from blysk.hdl.geometry.wide_product import three_products, wide_product

__all__ = ["LEAST_BITS", "GradientSetupUnit", "attribute_shape", "gradient_shape"]

LEAST_BITS = 12
"""Bits of the bound `AttributeSerialiser.least`."""

_PRODUCTS = 12
"""Multiplications of an attribute."""

_ROUND = 1
"""Further bits of a shifted word, for its rounding."""


def attribute_shape() -> data.StructLayout:
    """Shape of an attribute: its values at the sorted corners, the triangle's scales and its bound."""
    corners = {name: FixedShape(ATTRIBUTE) for name in ("first", "middle", "last")}
    return data.StructLayout(corners | scales_shape() | {"least": unsigned(LEAST_BITS)})


def gradient_shape() -> data.StructLayout:
    """Shape of `Gradients.beats` for one attribute, with the triangle's bound."""
    p = GradientSetup
    steps = {name: FixedShape(p.FORMAT) for name in ("short", "long", "inward")}
    rest = {"size": unsigned(p.SIZE_BITS), "least": unsigned(LEAST_BITS)}
    return data.StructLayout({"start": FixedShape(p.START_FORMAT)} | steps | rest)


class GradientSetupUnit(PipelinedUnit):
    """Start and steps of an attribute. `GradientSetup` is the bit-accurate model.

    Let I be the initiation interval. The twelve multiplications of an attribute take turns at ``ceil(12 /
    I)`` multipliers of 18x18 bits: 3 for an interval of 4, 1 for 12. With one multiplier most sums of
    products take turns at an adder. Three words take turns at a shifter. The sum of the start takes four
    turns at an accumulator, with two bits of both factors in each turn. The latency, `latency`, follows from
    the schedule: 39 cycles for an interval of 4, 51 for 12.

    Parameters
    ----------
    initiation_interval : int
        Least number of cycles from an attribute to the next, at least 4.

    Raises
    ------
    ValueError
        If the interval is too short.

    Members
    -------
    i : :py:`In(stream.Signature(attribute_shape()))`
        Attributes.
    o : :py:`Out(stream.Signature(gradient_shape()))`
        Gradients of the attributes.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, initiation_interval: int = 4):
        if initiation_interval < 4:
            raise ValueError(f"initiation_interval must be at least 4, not {initiation_interval}")
        self._single = initiation_interval >= _PRODUCTS
        self._graph = Dataflow(initiation_interval, merges=self._single)
        self._results = self._describe()
        self.multipliers = self._graph.multiplier.count
        super().__init__(
            attribute_shape(),
            gradient_shape(),
            latency=max(word.stage for word in self._results.values()),
            initiation_interval=initiation_interval,
            stands=True,
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, GradientSetup
        point = p.PRODUCT_FORMAT.fraction_bits
        sums = Accumulator(g) if self._single else None
        first, middle, last, reciprocal, knee, width, row_shift, column_shift, fraction, right = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in (
                *("first", "middle", "last", "height_reciprocal", "knee", "width_reciprocal"),
                *("row_shift", "column_shift", "fraction", "right"),
            )
        )
        least = g.input("least", lambda operands: operands.least)
        difference = g.register("difference", lambda a, b: (b - a).wrap(p.DIFFERENCE_FORMAT), first, last)
        along = wide_product(
            g,
            "along",
            difference,
            reciprocal,
            p.DIFFERENCE_LOW,
            PlaneSetup.RECIPROCAL_LOW,
            point,
            p.PRODUCT_FORMAT,
            sums,
        )
        at_knee = wide_product(
            g, "at_knee", along, knee, p.PRODUCT_LOW, PlaneSetup.HEIGHT_LOW, point, lambda value: value, sums
        )
        rise = g.register("rise", lambda a, b: (b - a).extend(SQ(3, point)), first, middle, since=at_knee)
        across = g.register("across", lambda a, b: (a - b).saturate(p.PRODUCT_FORMAT), rise, at_knee)
        inward = wide_product(
            g, "inward_word", across, width, p.PRODUCT_LOW, p.WIDTH_LOW, point, p.PRODUCT_FORMAT, sums
        )
        f = g.wire("fraction_word", lambda f: FixedValue(p.FRACTION_FORMAT, Cat(Const(1, 1), f)), fraction)
        high, crossed = three_products(g, "part", f, inward, p.FRACTION_LOW, p.PRODUCT_LOW, 40)
        part = g.register("part", lambda a, b: (a + b).wrap(SQ(2, 40)), high, crossed)

        # The other two words are shifted later, because their operands are narrower and cheaper to keep.
        shifter = self._shifter()
        part = g.use(shifter, "part_shifted", (part, column_shift), self._to_shift)
        row, step = (
            g.use(shifter, name, (word, shift), self._to_shift, since=part)
            for name, word, shift in (("row", along, row_shift), ("step", inward, column_shift))
        )
        short = g.register("short", lambda a, b, right: choose(right, a + b, a - b), row, part, right)
        long = g.register("long", lambda a, b, right: choose(right, a - b, a + b), short, step, right)
        start = self._start(first, short, step, right)

        def cut_size(step):
            code = Value.cast(step).as_unsigned()
            kept = (code ^ code[-1].replicate(len(code)))[p.FORMAT.fraction_bits - p.SIZE_BITS :]
            return Cat(kept[: p.SIZE_BITS], kept[p.SIZE_BITS :].any())

        def size(kept):
            kept, large = kept[:-1], kept[-1]
            return Mux(large | kept.all(), (1 << p.SIZE_BITS) - 1, kept + 1)[: p.SIZE_BITS]

        return {
            "start": start,
            "short": g.wire("short_word", lambda v: v.wrap(p.FORMAT), short),
            "long": g.wire("long_word", lambda v: v.wrap(p.FORMAT), long),
            "inward": g.register("inward", lambda v: v.wrap(p.FORMAT), step),
            "size": g.register("size", size, g.register("cut_size", cut_size, step)),
            "least": least,
        }

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        self._module = m
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape(), name="result")
        for name, word in self._results.items():
            m.d.comb += result[name].eq(value(word, self.latency, 1 + self.stands))
        return result

    def _shifter(self):
        """Shift right by 0 to 31 places in two registers. A third register rounds half up."""
        format = GradientSetup.SHIFTED_FORMAT
        bits = format.width + _ROUND

        def shift(register, word, amount):
            coarse = register((word >> Cat(Const(0, 2), amount[2:]))[:bits].as_signed(), "coarse")
            fine = register(amount[:2], "fine_amount")
            shifted = register((coarse >> fine)[:bits].as_signed(), "shifted")
            return register(FixedValue(format, ((shifted + 1) >> 1)[: format.width]), "rounded")

        return self._graph.share("shifter", (signed(bits), unsigned(PlaneSetup.SHIFT_BITS)), 3, shift)

    @staticmethod
    def _to_shift(value: FixedValue, amount: Value):
        word = value.scale(8).extend(GradientSetup.SHIFTED_FORMAT)
        return Cat(Const(0, _ROUND), Value.cast(word)).as_signed(), amount

    def _start(self, first, short, step, right):
        """``(k short + n inward) / 256`` with ``down`` as k: four digits of two bits, then n's upper bits."""
        g, p = self._graph, GradientSetup
        point = p.START_FORMAT.fraction_bits
        down, along = (g.input(name, lambda o, name=name: o[name]) for name in ("down", "along"))
        n = g.register(
            "n", lambda along, right: Mux(right, 256 - along, along)[:10].as_signed(), along, right
        )
        wide = signed(SQ(11, point).width)

        def cut(value):
            return Value.cast(value.truncate(point)).as_signed()

        def digit(register, short, step, of_short, of_step, begins):
            terms = [
                register(sum(Mux(bit, word << place, 0) for place, bit in enumerate(digit)), f"of_{name}")
                for name, word, digit in (("short", short, of_short), ("step", step, of_step))
            ]
            begins = register(register(begins, "begins_1"), "begins_2")
            term = register(sum(terms), "digit")
            # A quarter of the sum stays for the next digit.
            total = Signal(signed(len(term) - 1), name="total", reset_less=True)
            self._module.d.sync += total.eq((term + Mux(begins, 0, total)) >> 2)
            return total

        # The digits of an attribute come on consecutive cycles: no other use shares the accumulator.
        digits = g.share("digit", (wide, wide, unsigned(2), unsigned(2), unsigned(1)), 3, digit)
        for k in range(4):
            low = slice(2 * k, 2 * k + 2)
            total = g.use(
                digits,
                f"digit_{k}",
                (short, step, down, n),
                lambda short, step, down, n, low=low, k=k: (
                    *(cut(short), cut(step), down[low], n[low]),
                    Const(int(k == 0), 1),
                ),
            )

        def begin(first, step, n):
            # The upper bits of n are -1, 0 or 1. The 1 of a negation comes in through a bit below.
            minus, some = n[9], n[8]
            word = Mux(some, step ^ minus.replicate(len(step)), 0)
            words = (
                Cat(minus, code)[: p.START_FORMAT.width + 1]
                for code in (Value.cast(first.extend(SQ(2, point))), word)
            )
            return sum(words)[1 : p.START_FORMAT.width + 1].as_signed()

        begin = g.register("begin", begin, first, g.wire("step_cut", cut, step), n, since=total)
        return g.register(
            "start", lambda a, b: FixedValue(p.START_FORMAT, (a + b)[: p.START_FORMAT.width]), total, begin
        )
