"""Forward-difference accumulator ([T] figure 2.10): two accumulating adders for each component."""

from collections.abc import Iterator, Mapping

from amaranth.hdl import Module, ShapeLike, Signal, Value, ValueCastable
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.core.views import copy
from blysk.hdl.normals.difference_setup import difference_shape

__all__ = ["AccumulatorUnit", "DifferenceAccumulatorUnit"]


class AccumulatorUnit(wiring.Component):
    """Quadratics of a span by forward differences. Each gives a value in every cycle, first pixel first.

    `DifferenceAccumulator`, the bit-accurate model of each quadratic, has formats, rounding and bounds.

    A span of m pixels gives its first values 3 cycles after it was accepted. The values of the other pixels
    follow in the next m - 1 cycles, unless the output waits. The next span is accepted early enough to leave
    no gap. A span of length 0 takes one cycle and gives nothing. The unit has no multipliers.

    The accumulators load the words of a span a cycle after it was accepted. So a register drives all of their
    enables.

    Parameters
    ----------
    input_shape : StructLayout
        Shape of a prepared span, with a field ``length``.
    output_shape : ShapeLike
        Shape of the values of a pixel.
    ports : mapping of str to Member, optional
        Further members, by name.

    A subclass may carry further words of a span to its pixels, see `carried`. Words of a span may also come
    from another source, a cycle after the length, see `hold`.

    Members
    -------
    i : :py:`In(stream.Signature(input_shape))`
        Start, differences and length of a span.
    o : :py:`Out(stream.Signature(output_shape))`
        Values.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.10.
    """

    latency = 3

    def __init__(
        self,
        input_shape: data.StructLayout,
        output_shape: ShapeLike,
        ports: Mapping[str, wiring.Member] | None = None,
    ):
        members = {"i": In(stream.Signature(input_shape)), "o": Out(stream.Signature(output_shape))}
        super().__init__(members | dict(ports or {}))

    def quadratics(
        self, values: ValueCastable
    ) -> Iterator[tuple[str, DifferenceAccumulator, tuple, FixedValue]]:
        """For each quadratic: name, model, words (start, first, second), and element of ``values``."""
        raise NotImplementedError

    def carried(self, values: ValueCastable) -> Iterator[tuple[Value, Value]]:
        """Words of the span, and elements of ``values`` that hold them at each of its pixels."""
        yield from ()

    @property
    def span(self) -> data.View:
        """Words of the span that is taken in."""
        return self._span

    def hold(self, m: Module, load: Value) -> None:
        """Keep the words of an accepted span, for the cycle on which they are taken in.

        Parameters
        ----------
        m : Module
            Module that gets the register.
        load : Value
            Whether the words are taken in on this cycle.
        """
        self._span = Signal(self.i.payload.shape(), name="span", reset_less=True)
        with m.If(self.i.ready):
            m.d.sync += copy(self._span, self.i.payload)

    @classmethod
    def begin(cls, model: DifferenceAccumulator, start: FixedValue) -> FixedValue:
        """First value of an accumulator: the start plus half a step of the result. A cut then rounds."""
        return start + FixedValue.constant(model.format, model.result_format.step / 2)

    @classmethod
    def rounded(cls, model: DifferenceAccumulator, value: FixedValue) -> FixedValue:
        """The value before the result is cut. By default it is ``value``."""
        return value

    def elaborate(self, platform):
        """Accumulators, a pixel counter, and a register for the saturated values."""
        m = Module()
        advance, valid = Signal(), Signal()
        active, ends = count_down(m, self.i.valid, self.i.payload.length, advance)
        values = Signal(self.o.payload.shape())
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, values)),
            self.i.ready.eq(advance & ends),
        ]
        accepted, present, load = Signal(name="accepted"), Signal(name="present"), Signal()
        with m.If(advance):
            m.d.sync += [
                accepted.eq(self.i.valid & self.i.ready),
                present.eq(active),
                valid.eq(present),
            ]
        m.d.comb += load.eq(accepted & advance)
        self.hold(m, load)
        for index, (word, result) in enumerate(self.carried(values)):
            of_span = Signal(len(word), name=f"carried_{index}")
            with m.If(load):
                m.d.sync += of_span.eq(word)
            with m.If(advance):
                m.d.sync += result.eq(of_span)
        for name, p, (start, first, second), result in self.quadratics(values):
            value = Signal(FixedShape(p.format), name=name)
            difference = Signal(FixedShape(p.difference_format), name=f"{name}_difference")
            second_difference = Signal(FixedShape(p.difference_format), name=f"{name}_second_difference")
            with m.If(load):
                m.d.sync += [
                    value.eq(self.begin(p, start).wrap(p.format)),
                    difference.eq(first),
                    second_difference.eq(second),
                ]
            with m.Elif(advance):
                m.d.sync += [
                    value.eq((value + difference).wrap(p.format)),
                    difference.eq((difference + second_difference).wrap(p.difference_format)),
                ]
            with m.If(advance):
                exact = self.rounded(p, value)
                m.d.sync += result.eq(exact.truncate(p.result_format.fraction_bits).saturate(p.result_format))
        return m


class DifferenceAccumulatorUnit(AccumulatorUnit):
    """Normals of a span by ``N += W; W += 2 G dt^2``, three quadratics; see `AccumulatorUnit`.

    ``model``, a `DifferenceAccumulator`, is the bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(difference_shape()))`
        Start, differences and length of a span.
    o : :py:`Out(stream.Signature(ArrayLayout(SQ(1, 17), 3)))`
        Normals.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.10.
    """

    def __init__(self):
        self.model = DifferenceAccumulator()
        super().__init__(difference_shape(), normal_shape())

    def quadratics(self, values):
        """The components of the normal."""
        span = self.span
        for c in range(3):
            operands = span.start[c], span.first[c], span.second[c]
            yield f"normal_{c}", self.model, operands, values[c]
