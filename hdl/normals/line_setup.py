"""Line setup unit: the step from pixel to pixel of a straight line between two vectors."""

from amaranth.hdl import Cat, Const, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.normals.line_setup import LineSetup
from blysk.golden.number.fixed import SQ
from blysk.golden.number.reciprocal import reciprocal_table
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.reciprocal import checked_length_bits, reciprocal_words
from blysk.hdl.core.views import copy
from blysk.hdl.normals.renormaliser import vector_shape

__all__ = ["LineSetupUnit", "line_shape"]


_SHIFTED = SQ(5, LineSetup.FORMAT.fraction_bits + 1)


def line_shape(length_bits: int = LENGTH_BITS) -> data.StructLayout:
    """Shape of a prepared line: its start, the step, and its length in pixels."""
    step = data.ArrayLayout(FixedShape(LineSetup.FORMAT), 3)
    return data.StructLayout({"start": vector_shape(), "step": step, "length": unsigned(length_bits)})


class LineSetupUnit(PipelinedUnit):
    """First difference ``W = (N_r - N_l) / (m - 1)``; `LineSetup` is the bit-accurate model.

    m is the length. With the initiation interval I nine products share ``ceil(9 / I)`` multipliers. A table
    of ``2^(length_bits - 1)`` words of 24 bits holds the reciprocals. The attribute ``latency`` depends on I.

    Parameters
    ----------
    model : LineSetup
        Bit-accurate model.
    initiation_interval : int
        Cycles from an input to the next, 1 to 9.
    length_bits : int
        Bits of the length, 2 to 12.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"normal_left", "normal_right", "length"})))`
        Ends of a line, vectors in ``SQ(1, 22)``, and the length, at least 1.
    o : :py:`Out(stream.Signature(line_shape(length_bits)))`
        The line.

    Source: docs/theory/interpolation.md#renormaliser.
    """

    def __init__(
        self,
        model: LineSetup | None = None,
        *,
        initiation_interval: int = 4,
        length_bits: int = LENGTH_BITS,
    ):
        self.model = model or LineSetup()
        self.length_bits = checked_length_bits(length_bits)
        self._graph = Dataflow(initiation_interval)
        self._words = self._describe()
        self.multipliers = self._graph.multiplier.count
        ends = dict.fromkeys(("normal_left", "normal_right"), vector_shape())
        super().__init__(
            data.StructLayout(ends | {"length": unsigned(length_bits)}),
            line_shape(length_bits),
            latency=max(word.stage for word in self._words.values()),
            initiation_interval=initiation_interval,
        )

    def _describe(self) -> dict:
        """Words of the results."""
        g, p = self._graph, self.model
        left, right, length = (
            g.input(name, lambda operands, name=name: operands[name])
            for name in ("normal_left", "normal_right", "length")
        )
        reciprocal, shift = reciprocal_words(
            g, length, reciprocal_table(p.RECIPROCAL_FORMAT), length_bits=self.length_bits
        )
        shapes = FixedShape(_SHIFTED), unsigned(4)
        shifters = g.share("shifter", shapes, 3, self._shift)
        bits, words = p.LOW_FORMAT.width, {"start": left, "length": length}

        def half(format, which):
            return lambda value: FixedValue(format, Value.cast(value)[which])

        high, low = half(p.HIGH_FORMAT, slice(bits, None)), half(p.LOW_FORMAT, slice(bits))
        r_high = half(p.RECIPROCAL_HIGH_FORMAT, slice(bits, None))
        r_low = half(p.RECIPROCAL_LOW_FORMAT, slice(bits))
        for c in range(3):
            rise = g.register(f"rise_{c}", lambda a, b, c=c: b[c] - a[c], left, right)
            products = [
                g.multiply(f"product_{c}_{k}", rise, reciprocal, *halves)
                for k, halves in enumerate(((high, r_high), (high, r_low), (low, r_high)))
            ]
            partial = g.register(f"partial_{c}", lambda x, y: x + y, *products[:2])
            total = g.register(f"total_{c}", lambda x, y: x + y, partial, products[2])
            words["step", c] = g.use(shifters, f"step_{c}", (total, shift), self._shifted_operands)
        return words

    @staticmethod
    def _shifted_operands(total, shift):
        """``2 P r`` for the rise P and the reciprocal r, with a bit more than W for rounding; the shift."""
        return total.scale(1).extend(_SHIFTED), shift

    @staticmethod
    def _shift(register, value, amount):
        """Shift in two stages, then round half up to the format of W."""
        coarse = FixedValue(_SHIFTED, Value.cast(value) >> Cat(Const(0, 2), amount[2:]))
        coarse, fine = register(coarse, "coarse"), register(amount[:2], "fine_amount")
        shifted = register(FixedValue(_SHIFTED, Value.cast(coarse) >> fine), "shifted")
        format = LineSetup.FORMAT
        return register(shifted.round_half_up(format.fraction_bits).wrap(format), "rounded")

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        value = self._graph.build(m, self, operands)
        result = Signal(self.o.payload.shape())
        for name in ("start", "length"):
            m.d.comb += copy(result[name], value(self._words[name], self.latency))
        for c in range(3):
            m.d.comb += result.step[c].eq(value(self._words["step", c], self.latency))
        return result
