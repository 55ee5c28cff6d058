"""Reciprocals of a span's number of steps, and their squares, as words of a data flow."""

from amaranth.hdl import Cat, Const, Mux, Value

from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.reciprocal import RECIPROCAL_FORMAT, reciprocal_table
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedValue
from blysk.hdl.core.word import Word

__all__ = ["checked_length_bits", "reciprocal_codes", "reciprocal_words", "square_words"]


def checked_length_bits(length_bits: int) -> int:
    """Bits of the lengths that a unit takes.

    Raises
    ------
    ValueError
        If the bits are not 2 to 12.
    """
    if length_bits not in range(2, LENGTH_BITS + 1):
        raise ValueError(f"length_bits must be 2 to {LENGTH_BITS}, not {length_bits!r}")
    return length_bits


def reciprocal_codes(length_bits: int = LENGTH_BITS, table: Fixed | None = None) -> list[int]:
    """Codes of the table for lengths of ``length_bits`` bits. They are a part of the whole table.

    Parameters
    ----------
    length_bits : int
        Bits of the length, 2 to 12.
    table : Fixed or None
        The whole table. ``None``: `reciprocal_table` in its own format.

    Returns
    -------
    list of int
        ``2^(length_bits - 1)`` codes.
    """
    codes = (reciprocal_table() if table is None else table).codes
    return codes[:: len(codes) >> (length_bits - 1)].tolist()


def reciprocal_words(
    graph: Dataflow,
    length: Word,
    table: Fixed | None = None,
    length_bits: int = LENGTH_BITS,
    since: int = 0,
) -> tuple[Word, Word]:
    """Reciprocal of a span's steps: ``dt = 1/(m - 1) = 2 reciprocal 2^-shift``; m is the span's length.

    Address and shift are those of `reciprocal_address`. The words take five cycles: m - 1, its leading one,
    the address, the table and its register. With fewer bits of the length the table has
    ``2^(length_bits - 1)`` words.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    length : Word
        m, 1 to ``2^length_bits - 1``; 1 counts as 2.
    table : Fixed or None
        A table of `reciprocal_table`. ``None``: the table in its own format.
    length_bits : int
        Bits of the length, 2 to 12.
    since : int or Word
        First stage that may hold m - 1: its number, or a word that is in this stage.

    Returns
    -------
    reciprocal, shift : Word
        The reciprocal in the table's format, and the shift, 0 to ``length_bits``.
    """
    table = reciprocal_table() if table is None else table
    top = length_bits - 1

    def leading(steps):
        # If the span has one pixel, m - 1 is 0 and has no leading one.
        position, below_top = Const(0, range(length_bits)), Const(top, range(length_bits))
        for bit in range(length_bits):
            position = Mux(steps[bit], Const(bit, range(length_bits)), position)
            below_top = Mux(steps[bit], Const(top - bit, range(length_bits)), below_top)
        return Cat(position, below_top)

    half = len(Const(0, range(length_bits)))
    steps = graph.register(
        "steps", lambda length: (length - 1)[:length_bits], length, since=since, formula="m − 1"
    )
    positions = graph.register("positions", leading, steps)
    address = graph.register("address", lambda steps, both: (steps << both[half:])[:top], steps, positions)
    codes = reciprocal_codes(length_bits, table)
    word = graph.look_up(
        "reciprocals", codes, table.format.width, address, registered=True, formula="1/(m − 1)"
    )
    reciprocal = graph.wire("reciprocal", lambda word: FixedValue(table.format, word), word, "dt")
    ragged = graph.register("ragged", lambda address: address.any(), address)
    shift = graph.register("shift", lambda both, ragged: both[:half] + ragged, positions, ragged)
    return reciprocal, shift


def square_words(graph: Dataflow, product: Word, shift: Word) -> tuple[Word, Word]:
    """Square of a reciprocal: ``dt^2 = 4 square 2^-square_shift``, as `step_words` rounds it. Two cycles.

    Parameters
    ----------
    graph : Dataflow
        Graph that gets the words.
    product : Word
        Exact square of a reciprocal in `RECIPROCAL_FORMAT`.
    shift : Word
        Shift of the reciprocal.

    Returns
    -------
    square, square_shift : Word
        The square in ``UQ(0, 17)``, and its shift, 0 to 25.
    """
    exact = UQ(0, 34)

    def normalised(product):
        code = Value.cast(product)[: exact.width]
        code = Mux(code[-1], code, Cat(Const(0, 1), code[:-1]))
        return FixedValue(exact, code).round_half_up(RECIPROCAL_FORMAT.fraction_bits)

    small = graph.register("square_small", lambda product: ~Value.cast(product)[exact.width - 1], product)
    rounded = graph.register("square_rounded", normalised, product, formula="dt²")
    square = graph.register("square", lambda x: x.saturate(RECIPROCAL_FORMAT), rounded, formula="dt²")
    return square, graph.register("square_shift", lambda small, shift: Cat(small, shift), small, shift)
