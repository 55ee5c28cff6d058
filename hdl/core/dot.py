"""Dot products in a data flow: three products, and two sums that may be shared."""

from collections.abc import Callable
from typing import Any

from blysk.golden.number.fixed import Format
from blysk.hdl.core.dataflow import Dataflow, FunctionalUnit
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.formula import Formula, component
from blysk.hdl.core.word import Word

__all__ = ["dot", "shared_sums"]


def shared_sums(graph: Dataflow, product: Format) -> FunctionalUnit:
    """Shared adders for the three products of a dot product. Each product has the format ``product``.

    The adders take two cycles; see `dot`.
    """
    shapes = FixedShape(product + product), FixedShape(product)
    return graph.share("sum", shapes, 1, lambda register, x, y: register(x + y, "total"))


def dot(
    graph: Dataflow,
    name: str,
    a: Word,
    b: Word | Callable[[Any], Any],
    sums: FunctionalUnit | None = None,
    symbol: str | None = None,
) -> Word:
    """Exact dot product of two vectors: three multiplications of the graph, and two sums.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    name : str
        Name of the result.
    a : Word
        A vector.
    b : Word or callable
        The other vector, or a function that makes it from the value of ``a``.
    sums : FunctionalUnit or None
        From `shared_sums`. ``None``: the sums have registers of their own.
    symbol : str or None
        Symbol of the other vector in formulas. ``None``: the symbol of its word, or of ``a``.
    """
    left = a.symbol
    right = Formula(symbol) if symbol else b.symbol if isinstance(b, Word) else left

    def factors(c):
        if isinstance(b, Word):
            return a, b, lambda v: v[c], lambda v: v[c]
        return a, a, lambda v: v[c], lambda v: b(v)[c]

    def product(c, since=0):
        formula = (component(left, c) * component(right, c)).text
        return graph.multiply(f"{name}_{c}", *factors(c), since=since, formula=formula)

    total = f"{left.within(2)}·{right.within(2)}" if left is not right else f"|{left.text}|²"
    products = [product(c) for c in range(2)]
    if sums is not None:
        products.append(product(2))
        return graph.use(sums, f"{name}_total", products, lambda x, y, z: (x + y, z), formula=total)
    partial = graph.register(f"{name}_partial", lambda x, y: x + y, *products)
    # An operand that waits takes fewer registers than a product that waits.
    last = product(2, since=partial)
    return graph.register(f"{name}_total", lambda x, y: x + y, partial, last, formula=total)
