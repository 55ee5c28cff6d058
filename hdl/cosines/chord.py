"""Chord unit: half the squared distance of two unit vectors, with three multipliers."""

from collections.abc import Callable

from amaranth.hdl import Cat, Const, Mux, Value
from amaranth.lib import data

from blysk.golden.cosines.chord import Chord
from blysk.golden.number.fixed import SQ
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.dot import dot
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.word import Word

__all__ = ["ChordUnit", "chord"]


def chord(
    graph: Dataflow, name: str, a: Word, b: Word | Callable[[], data.View], symbol: str | None = None
) -> Word:
    """Word of ``|a - b|^2 / 2`` in ``UQ(2, 35)``: three multiplications of the graph.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    name : str
        Name of the result.
    a : Word
        A unit vector.
    b : Word or callable
        The other unit vector, or a function that gives a unit vector that is constant while beats are inside.
    symbol : str or None
        Symbol of the other vector in formulas. ``None``: the symbol of its word.
    """
    differences = data.ArrayLayout(FixedShape(COMPONENT - COMPONENT), 3)

    def subtract(a, b):
        return differences(Cat(a[c] - b[c] for c in range(3)))

    def is_far(difference):
        tops = (Value.cast(difference[c])[-2:] for c in range(3))
        return Cat(top[0] ^ top[1] for top in tops).any()

    def halved(difference):
        far = is_far(difference)
        codes = (Value.cast(difference[c]) for c in range(3))
        return normal_shape()(Cat(Mux(far, code[1:], code[:-1]) for code in codes))

    def aligned(total, far):
        code = Value.cast(total)
        return FixedValue(SQ(6, 34), Mux(far, Cat(Const(0, 2), code), Cat(code, code[-1], code[-1])))

    formula = f"{a.symbol.text} − {symbol or (b.symbol.text if isinstance(b, Word) else 'B')}"
    if isinstance(b, Word):
        difference = graph.register(f"{name}_difference", subtract, a, b, formula=formula)
    else:
        difference = graph.register(f"{name}_difference", lambda a: subtract(a, b()), a, formula=formula)
    far = graph.register(f"{name}_far", is_far, difference)
    operand = graph.wire(f"{name}_operand", halved, difference, formula="Δ")
    square = dot(graph, f"{name}_square", operand, lambda v: v)
    square = graph.register(f"{name}_aligned", aligned, square, far, formula=f"|{formula}|²")
    half = graph.wire(f"{name}_half", lambda square: square.scale(-1), square)
    return graph.register(name, lambda square: square.saturate(Chord.FORMAT), half)


class ChordUnit(PipelinedUnit):
    """Half the squared chord ``u = |a - b|^2 / 2`` of two unit vectors; `Chord` is the bit-accurate model.

    The latency is 8 cycles (difference, operand, two for the product, two sums, alignment, saturation), the
    initiation interval 1. The unit has three multipliers of 18x18 bits.

    Parameters
    ----------
    model : Chord
        Bit-accurate model.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"a": ..., "b": ...})))`
        Two unit vectors of three components ``SQ(1, 17)``.
    o : :py:`Out(stream.Signature(UQ(1, 25)))`
        u, as the specular unit takes it.

    Source: docs/theory/chord.md#the-chord; [Lyon93].
    """

    def __init__(self, model: Chord | None = None):
        self.model = model or Chord()
        self._graph = graph = Dataflow(1)
        a, b = (graph.input(name, lambda operands, name=name: operands[name]) for name in "ab")
        u = chord(graph, "u", a, b)
        self._result = u
        super().__init__(
            data.StructLayout({"a": normal_shape(), "b": normal_shape()}),
            FixedShape(Chord.ARGUMENT_FORMAT),
            latency=u.stage,
        )

    def datapath(self, m, operands):
        """Describe the registers of the graph."""
        u = self._graph.build(m, self, operands)(self._result, self.latency)
        return u.truncate(Chord.ARGUMENT_FORMAT.fraction_bits).saturate(Chord.ARGUMENT_FORMAT)
