"""Accumulator: an adder and its register, which the sums of products of a data-flow graph share."""

from collections.abc import Sequence
from functools import reduce
from operator import add, or_
from typing import Any

from amaranth.hdl import Cat, Const, Signal, Value

from blysk.golden.number.fixed import UQ, Format
from blysk.hdl.core.dataflow import Dataflow, merged
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.formula import formula_of
from blysk.hdl.core.word import Word

__all__ = ["Accumulator", "half"]

_REGISTER = "sum"


def half(fraction_bits: int) -> FixedValue:
    """Half a step of a number with these fraction bits. A sum that begins with it is rounded by a cut."""
    return FixedValue.constant(UQ(0, fraction_bits + 1), 2.0 ** -(fraction_bits + 1))


class Accumulator:
    """Sums of products of a graph, in turns at one adder and its register.

    The graph has one multiplier, so at most one product a cycle. Each product is added on the cycle on which
    it is there. If the products of a sum come one after the other, the sum so far stays in the register. If a
    product of another sum comes between them, a copy of the sum so far waits.

    Parameters
    ----------
    graph : Dataflow
        Graph with an interval over 1, and with one multiplier.
    """

    def __init__(self, graph: Dataflow):
        self._graph = graph
        self._words: list[Word] = []
        self._width = 0

    def prefix(self, instance: int) -> str:
        """Name of the register. There is one instance."""
        return _REGISTER

    def sum(
        self,
        name: str,
        products: Sequence[Word],
        format: Format,
        begin: Word | FixedValue,
    ) -> Word:
        """Sum of products, each cut to the fraction bits of ``format``.

        The sum stays until the next product is added to any sum.

        Parameters
        ----------
        name : str
            Name of the sum.
        products : sequence of Word
            Products of the graph's multiplier.
        format : Format
            Signed format of the sum. It must hold the sum.
        begin : Word or FixedValue
            Number or constant that is added, with at most as many fraction bits.
        """
        self._width = max(self._width, format.width)
        total = begin
        for k, product in enumerate(products):
            total = self._added(f"{name}_{k}", total, product, format)
        return total

    def _added(self, name: str, before: Word | FixedValue, product: Word, format: Format) -> Word:
        """Sum of a product and of a word or constant."""
        operands = (before, product) if isinstance(before, Word) else (product,)
        word = Word(name, operands, 1, 1, self)
        word.trace = lambda *symbols: (formula_of(lambda *terms: reduce(add, terms), symbols), ())

        def make(build):
            if word.read != product.stage:
                raise ValueError(f"{product.name} cannot wait for the accumulator")
            word.lifetime = self._lifetime(word)
            adder = build.shared.setdefault(self, _Adder(build, self._graph, self._width))
            shift = format.fraction_bits - build.at(product, word.read).format.fraction_bits
            other = before
            if isinstance(before, Word):
                other = build.at(before, word.read)
                if before in self._words and other is build.values[before][before.stage]:
                    other = adder.total
            adder.use(build.when(word.read), shift, other, format.fraction_bits)
            return FixedValue(format, adder.total[: format.width])

        word.make = make
        self._words.append(word)
        return self._graph.add(word)

    def _lifetime(self, word: Word) -> int:
        """Cycles until the next product is added to any sum."""
        interval = self._graph.interval
        return min((other.stage - word.stage) % interval or interval for other in self._words)


class _Adder:
    """Hardware of an accumulator while it is being made."""

    def __init__(self, build: Any, graph: Dataflow, width: int):
        if graph.multiplier.count != 1:
            raise ValueError(f"an accumulator takes products of one multiplier, not {graph.multiplier.count}")
        self._build, self._graph = build, graph
        self.total = Signal(width, name=_REGISTER, reset_less=True)
        self._products: list[tuple[Value, int]] = []
        self._others: list[tuple[Value, Value]] = []
        self._aligned: dict[int, tuple[FixedValue, Value]] = {}

    def use(self, when: Value, shift: int, other: FixedValue | Signal, fraction_bits: int) -> None:
        """Add the product of a stage, shifted left by some places, to the sum so far or to a number."""
        self._products.append((when, shift))
        if other is not self.total:
            # A number of several uses stays one object, so that `merged` knows it.
            low = fraction_bits - other.format.fraction_bits
            _, other = self._aligned.setdefault(id(other), (other, self._extended(other, low)))
        self._others.append((when, other))

    def connect(self) -> None:
        """Connect the register and its summands."""
        product, m = self._build.result(self._graph.multiplier, 0), self._build.m
        placed = {
            shift: self._extended(product[-shift:].as_signed() if shift < 0 else product, max(shift, 0))
            for _, shift in self._products
        }
        term = merged([(when, placed[shift]) for when, shift in self._products])
        with m.If(reduce(or_, (when for when, _ in self._products))):
            m.d.sync += self.total.eq(term + merged(self._others))

    def _extended(self, number: FixedValue | Value, low: int) -> Value:
        """Code of a number behind ``low`` zeros, extended to the register's width."""
        code = Value.cast(number)
        sign = code[-1] if code.shape().signed else Const(0, 1)
        missing = max(len(self.total) - low - len(code), 0)
        return Cat(Const(0, low), code, sign.replicate(missing))[: len(self.total)]
