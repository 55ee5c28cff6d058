"""Quadratic evaluators ([T] figures 2.9 a and b): the normals of a span by multiplication."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.number.fixed import SQ, UQ
from blysk.golden.number.reciprocal import reciprocal_table
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.reciprocal import reciprocal_words
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import choose, copy, copy_fields
from blysk.hdl.normals.gpq import curve_shapes

__all__ = ["QuadraticEvaluatorUnit"]


class QuadraticEvaluatorUnit(wiring.Component):
    """Normals ``N(t) = G t^2 + P t + Q`` of a span. The first pixel is at t = 0, the last at t = 1.

    `QuadraticEvaluator`, the bit-accurate model, has formats, rounding and error bound. The table of
    reciprocals holds 2048 words of 18 bits.

    ``direct`` (figure 2.9 a) has seven multipliers: one for t^2, and two for each component. (The figure
    draws one component, with three multipliers.) The first normal comes 14 cycles after its span was taken
    in. Then a normal comes in every cycle.

    ``horner`` (figure 2.9 b) has one multiplier, one adder and multiplexers for each component. The first
    normal comes 17 cycles after its span was taken in. Then a normal comes every two cycles.

    The step of the next span is prepared during the pixels of this span. Spans are taken in at least 7 cycles
    apart. If they have 7 pixels (``horner``: 4) or more, there is no gap between their pixels. A span of
    length 0 gives nothing.

    Parameters
    ----------
    model : QuadraticEvaluator
        Bit-accurate model, with the form.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"g", "p", "q", "length"})))`
        Coefficients in the formats of `GPQ`; length 0 to 4095.
    o : :py:`Out(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.

    Source: docs/theory/interpolation.md#quadratic-normals; [T] figures 2.9 a and b.
    """

    def __init__(self, model: QuadraticEvaluator | None = None):
        self.model = model or QuadraticEvaluator()
        direct = self.model.form == "direct"
        self.latency = 14 if direct else 17
        self.cycles_per_pixel = 1 if direct else 2
        span = data.StructLayout({**curve_shapes(), "length": unsigned(LENGTH_BITS)})
        super().__init__({"i": In(stream.Signature(span)), "o": Out(stream.Signature(normal_shape()))})

    def elaborate(self, platform):
        """Step of the span, sum of its steps and pixel counter, then the polynomial pixel by pixel."""
        m = Module()
        p = self.model
        m.submodules.step = step = _StepUnit(p)
        m.submodules.polynomial = polynomial = _DirectUnit() if p.form == "direct" else _HornerUnit()
        connect(m, wiring.flipped(self.i), step.i)
        connect(m, polynomial.o, wiring.flipped(self.o))

        span, pixel = step.o, polynomial.i
        total = Signal(FixedShape(p.SUM_FORMAT))
        step_held = Signal(FixedShape(p.STEP_FORMAT))
        coefficients = Signal(data.StructLayout(curve_shapes()))
        remaining = Signal(LENGTH_BITS)
        valid = Signal()
        advance = Signal()
        m.d.comb += [
            pixel.valid.eq(valid),
            advance.eq(~valid | pixel.ready),
            span.ready.eq(advance & (remaining == 0)),
            pixel.payload.minus_t.eq(total.truncate(17)),
            *copy_fields(pixel.payload, coefficients, ("g", "p", "q")),
        ]
        half_step = FixedValue.constant(p.SUM_FORMAT, COMPONENT.step / 2)
        with m.If(span.valid & span.ready):
            length = span.payload.length
            m.d.sync += [
                valid.eq(length != 0),
                remaining.eq(Mux(length == 0, 0, length - 1)),
                total.eq(half_step),
                step_held.eq(span.payload.step),
            ]
            m.d.sync += copy_fields(coefficients, span.payload, ("g", "p", "q"))
        with m.Elif(advance):
            m.d.sync += [
                valid.eq(remaining != 0),
                remaining.eq(Mux(remaining == 0, 0, remaining - 1)),
                total.eq((total - step_held).wrap(p.SUM_FORMAT)),
            ]
        return m


class _StepUnit(PipelinedUnit):
    """Step ``dt = 1/(m - 1)`` and the coefficients. With latency 8 and interval 7 a word has one register."""

    def __init__(self, model: QuadraticEvaluator):
        self.model = model
        span = {**curve_shapes(), "length": unsigned(LENGTH_BITS)}
        self._graph = Dataflow(7)
        self._words = self._describe(span)
        super().__init__(
            data.StructLayout(span),
            data.StructLayout({**span, "step": FixedShape(model.STEP_FORMAT)}),
            latency=self._words["step"].stage,
            initiation_interval=7,
        )

    def datapath(self, m, operands):
        """The graph, read at the stage of the step."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        m.d.comb += [copy(result[name], value(word, self.latency)) for name, word in self._words.items()]
        return result

    def _describe(self, span) -> dict:
        """Words of the results: the reciprocal, shifted in two stages, and the operands."""
        g, p = self._graph, self.model
        words = {name: g.input(name, lambda operands, name=name: operands[name]) for name in span}
        reciprocal, shift = reciprocal_words(g, words["length"], reciprocal_table(p.RECIPROCAL_FORMAT))
        coarse = g.register(
            "coarse",
            lambda x, shift: Value.cast(x.scale(1).extend(p.STEP_FORMAT)) >> Cat(Const(0, 2), shift[2:]),
            reciprocal,
            shift,
        )
        words["step"] = g.register(
            "step", lambda x, shift: FixedValue(p.STEP_FORMAT, x >> shift[:2]), coarse, shift
        )
        return words


def _pixel_shape() -> data.StructLayout:
    return data.StructLayout({**curve_shapes(), "minus_t": FixedShape(COMPONENT)})


def _with_half(value: FixedValue) -> FixedValue:
    """Component plus half its step, by wiring. A cut after the sum then rounds half up."""
    return FixedValue(SQ(1, 18), Cat(Const(1, 1), Value.cast(value)))


class _DirectUnit(PipelinedUnit):
    """Figure 2.9 a. Latency 5, initiation interval 1, seven multipliers."""

    def __init__(self):
        super().__init__(_pixel_shape(), normal_shape(), latency=5)

    def datapath(self, m, operands):
        """Square and linear products, -t^2 rounded, quadratic products, sum, saturation."""
        register = self.register
        minus_t = operands.minus_t
        square = register(m, minus_t * minus_t, "square")
        half = FixedValue.constant(UQ(-17, 18), COMPONENT.step / 2)
        minus_square = register(m, (half - square).truncate(17).wrap(COMPONENT), "minus_square")
        result = Signal(self.o.payload.shape())
        for c in range(3):
            g = register(m, register(m, operands.g[c], f"g_{c}"), f"g_late_{c}")
            q = register(m, operands.q[c], f"q_{c}")
            linear = register(m, operands.p[c] * minus_t, f"linear_{c}")
            partial = register(m, _with_half(q) - linear, f"partial_{c}")
            late = register(m, partial, f"partial_late_{c}")
            quadratic = register(m, g * minus_square, f"quadratic_{c}")
            total = register(m, late - quadratic, f"total_{c}").truncate(17)
            m.d.comb += result[c].eq(register(m, total.saturate(COMPONENT), f"normal_{c}"))
        return result


class _HornerUnit(PipelinedUnit):
    """Figure 2.9 b. Latency 8, initiation interval 2, one multiplier and one adder for each component."""

    def __init__(self):
        super().__init__(_pixel_shape(), normal_shape(), latency=8, initiation_interval=2)

    def datapath(self, m, operands):
        """Products issued at stages 1 and 4, sums at 3 and 6: two pixels share the parts."""
        at, register = self.at, self.register
        held = register(m, operands, "operands_3", when=at(2))
        q = register(m, held.q, "q_5", when=at(4))
        minus_t = register(m, choose(at(1), operands.minus_t, held.minus_t), "minus_t")
        result = Signal(self.o.payload.shape())
        for c in range(3):
            total = Signal(FixedShape(SQ(3, 34)), name=f"total_{c}")
            rounded = total.truncate(17).saturate(COMPONENT)
            first = Value.cast(operands.g[c].extend(COMPONENT))
            factor = register(m, Mux(at(1), first, Value.cast(rounded)), f"factor_{c}")
            product = register(m, FixedValue(COMPONENT, factor) * minus_t, f"product_{c}")
            addend = choose(at(3), held.p[c], q[c])
            m.d.sync += total.eq(_with_half(addend) - product)
            m.d.comb += result[c].eq(register(m, rounded, f"normal_{c}"))
        return result
