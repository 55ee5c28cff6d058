"""Reciprocal of a number from 1 to 2, as words of a graph: a table and two multiplications."""

from collections.abc import Callable

from amaranth.hdl import Cat, Module, Value, unsigned
from amaranth.lib import data
from amaranth.lib.memory import Memory

from blysk.golden.geometry.reciprocal import Reciprocal
from blysk.hdl.core.dataflow import Dataflow, FunctionalUnit
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.word import Word

__all__ = ["reciprocal_word", "shared_table"]


def _row_shape() -> data.StructLayout:
    formats = {"c0": Reciprocal.C0_FORMAT, "c1": Reciprocal.C1_FORMAT, "c2": Reciprocal.C2_FORMAT}
    return data.StructLayout({name: FixedShape(format) for name, format in formats.items()})


def shared_table(graph: Dataflow, module: Callable[[], Module]) -> FunctionalUnit:
    """The table of `Reciprocal` as a functional unit: 256 rows, two cycles.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the table.
    module : callable
        Returns the module that gets the table's memory. It is called when the hardware is built.

    Returns
    -------
    FunctionalUnit
        Takes a segment, gives a row with ``c0``, ``c1`` and ``c2``.
    """

    def make(register, address):
        columns = Reciprocal().coefficients
        rows = zip(*(column.values.tolist() for column in columns), strict=True)
        rows = [dict(zip(("c0", "c1", "c2"), row, strict=True)) for row in rows]
        m = module()
        m.submodules.reciprocals = table = Memory(shape=_row_shape(), depth=len(rows), init=rows)
        port = table.read_port()
        m.d.comb += port.addr.eq(address)
        return register(port.data, "row")

    return graph.share("table", (unsigned(Reciprocal.SEGMENT_BITS),), 2, make)


def reciprocal_word(graph: Dataflow, table: FunctionalUnit, name: str, x: Word) -> Word:
    """The word of `Reciprocal.compute`, by one use of the table and two multiplications.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    table : FunctionalUnit
        From `shared_table`.
    name : str
        Name of the result.
    x : Word
        Operand, UQ(1, 25), from 1 on.

    Returns
    -------
    Word
        ``1/x``, UQ(1, 25).
    """
    p, bits = Reciprocal, Reciprocal.OFFSET_FORMAT.width

    def offset(value):
        code = Value.cast(value)[:bits]
        return FixedValue(p.OFFSET_FORMAT, Cat(code[:-1], ~code[-1]))

    def segment(value):
        return (Value.cast(value)[bits : bits + p.SEGMENT_BITS],)

    row = graph.use(table, f"{name}_row", (x,), segment)
    square = graph.multiply(f"{name}_square", x, row, offset, lambda row: row.c2)
    slope = graph.register(
        f"{name}_slope",
        lambda row, square: (
            (row.c1 - square).round_half_up(p.SLOPE_FORMAT.fraction_bits).wrap(p.SLOPE_FORMAT)
        ),
        row,
        square,
    )
    linear = graph.multiply(f"{name}_linear", x, slope, offset)
    return graph.register(
        name,
        lambda row, linear: (row.c0 - linear).round_half_up(p.FORMAT.fraction_bits).wrap(p.FORMAT),
        row,
        linear,
    )
