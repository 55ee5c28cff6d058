"""Lobe unit: any curve of 1 - N·H from a small table addressed by octaves, with one multiplier."""

from collections.abc import Callable, Sequence
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.lobe import Lobe, LobeTable
from blysk.hdl.core.bits import leading_zeros
from blysk.hdl.core.dataflow import Dataflow
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.memory import registered_read
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.word import Word
from blysk.hdl.lighting.specular import highlight_shape, one_minus

__all__ = ["LobeMemory", "LobeUnit", "lobe_read_signature", "lobe_write_shape"]

_FINE = 2
"""Low bits of the shift amount. The second stage shifts by them."""


def lobe_write_shape() -> data.StructLayout:
    """Shape of a write, 18 bits: a value, or the bank of the next values. See `LobeTable.writes`."""
    return data.StructLayout({"value": Lobe.VALUE_FORMAT.width, "begins": 1})


def lobe_read_signature(model: Lobe) -> wiring.Signature:
    """Read port. It gives the word of an ``address`` after two cycles with ``enable``.

    Without ``enable`` the word stays. On a cycle that writes to the address, it may also stay.
    """
    return wiring.Signature(
        {
            "address": Out(range(model.banks * model.entries)),
            "enable": Out(1),
            "word": In(Lobe.WORD_BITS),
        }
    )


class LobeMemory(wiring.Component):
    """Tables of `Lobe` in one memory, with a read port for each served unit.

    With E octaves of M steps there are ``banks (E + 1) M`` words of 35 bits, up to 512 in a block RAM of 512
    by 36. If the units of two lights read the same written tables, Yosys makes a copy for each port. Tables
    that are fixed at build time need no copy: up to 1024 words take two block RAMs of 1024 by 18 for both
    ports.

    A write is taken on every cycle. The first write of a table has ``begins``, and tells the bank. The values
    follow in order. Each value but the first makes the word of the value before it. This word is in the
    memory two cycles after the write was taken. Values beyond the end of a table are lost, and so are all
    values of a missing bank. An incomplete table keeps the other words of the table before. Reset ends a
    table, and clears no word. Write a bank only while no unit reads it.

    Parameters
    ----------
    model : Lobe
        Size of the tables, and their number.
    tables : sequence of LobeTable or None
        Tables fixed at build time, one for each bank. ``None``: the tables are written.
    ports : int
        Read ports, at least 1.

    Members
    -------
    write : :py:`In(stream.Signature(lobe_write_shape()))`
        Writes, unless the tables are fixed. Always ready.
    reads : :py:`In(lobe_read_signature(model)).array(ports)`
        Read ports.

    Raises
    ------
    ValueError
        If there are not as many tables as banks, or a table has another size.

    Source: docs/theory/units.md#lobe.
    """

    def __init__(self, model: Lobe | None = None, tables: Sequence[LobeTable] | None = None, ports: int = 1):
        self.model = p = model or Lobe()
        self.tables = _checked(p, tables)
        members = {"reads": In(lobe_read_signature(p)).array(ports)}
        if tables is None:
            members["write"] = In(stream.Signature(lobe_write_shape()))
        super().__init__(members)

    def elaborate(self, platform):
        """The memory, and the logic that makes its words from the values written."""
        p = self.model
        m = Module()
        words = [word for table in self.tables or [] for word in table.words.tolist()]
        m.submodules.words = memory = Memory(shape=Lobe.WORD_BITS, depth=p.banks * p.entries, init=words)
        write = memory.write_port() if self.tables is None else None
        for read in self.reads:
            word, _ = registered_read(m, memory, read.address, read.enable, write)
            m.d.comb += read.word.eq(word)
        if write is not None:
            self._write(m, write)
        return m

    def _write(self, m: Module, port: Any) -> None:
        """Write a word with each value but the first: the value before, and its difference to this value."""
        p, write = self.model, self.write.payload
        value, previous = (Signal.like(write.value, name=name) for name in ("value", "previous"))
        address, last = (Signal.like(port.addr, name=name) for name in ("address", "last"))
        follows, begins, holds, active = (
            Signal(name=name) for name in ("follows", "begins", "holds", "active")
        )
        # The register is close to the memory, because the write enable also decides whether the memory is
        # read.
        m.d.sync += [
            value.eq(write.value),
            follows.eq(self.write.valid & ~write.begins),
            begins.eq(self.write.valid & write.begins),
        ]
        m.d.comb += [
            self.write.ready.eq(1),
            port.en.eq(follows & holds & active),
            port.addr.eq(address),
            port.data.eq(Cat(previous, (value - previous)[: Lobe.DIFFERENCE_FORMAT.width])),
        ]
        with m.If(follows):
            m.d.sync += [previous.eq(value), holds.eq(1)]
            with m.If(holds):
                m.d.sync += [address.eq(address + 1), active.eq(active & (address != last))]
        with m.If(begins):
            m.d.sync += [holds.eq(0), active.eq(0)]
            with m.Switch(value):
                for bank in range(p.banks):
                    with m.Case(bank):
                        first = bank * p.entries
                        m.d.sync += [address.eq(first), last.eq(first + p.entries - 1), active.eq(1)]


class LobeUnit(PipelinedUnit):
    """A lobe of 1 - N·H by its table. The term is 0 for a dark beat and where N·H is not positive.

    `Lobe`, the bit-accurate model, has table, formats and error bounds.

    With an initiation interval of 1 the latency is 10 cycles: one minus, saturation, leading one, two for the
    shift, two for the word, operands, product, sum. With the operand ``place`` it is 8 cycles: two for the
    choice, three for the word, operands, product, sum. A longer interval takes 2 cycles more, for a register
    at the input and for the multiplexers before the multiplier. At every interval there is one multiplier of
    18 by 18 bits. A beat that is dark, or whose N·H is not positive, works as if its argument were 0. From
    one of these beats to the next only the input and the first registers toggle.

    Parameters
    ----------
    model : Lobe
        Size and number of the tables, and the operand.
    initiation_interval : int
        Cycles from an input to the next, at least 1.
    tables : sequence of LobeTable or None
        Tables fixed at build time, one for each bank. ``None``: the tables are written.
    shares_memory : bool
        Whether a `LobeMemory` outside has the tables, in place of a memory in the unit.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"operand": ..., "dark": 1})))`
        ``N·H`` in ``SQ(4, 34)``, ``1 - N·H`` in ``UQ(1, B)`` or a place in `quotient.place_format`. ``dark``:
        the light is behind the surface, or the span has no highlight. The term is then 0.
    o : :py:`Out(stream.Signature(UQ(0, 17)))`
        Specular term.
    constants : :py:`In(StructLayout({"bank": ...}))`
        Number of the bank, constant while beats are inside. Only with several banks.
    write : :py:`In(stream.Signature(lobe_write_shape()))`
        Only if the unit has a memory of its own that is written; see `LobeMemory`.
    table : :py:`Out(lobe_read_signature(model))`
        Only if the memory is outside.

    Raises
    ------
    ValueError
        In one of these cases:

        - the interval is out of range;
        - tables are given for a memory outside;
        - there are not as many tables as banks;
        - a table has another size.

    Source: docs/theory/units.md#lobe.
    """

    def __init__(
        self,
        model: Lobe | None = None,
        initiation_interval: int = 1,
        *,
        tables: Sequence[LobeTable] | None = None,
        shares_memory: bool = False,
    ):
        self.model = p = model or Lobe()
        if tables is not None and shares_memory:
            raise ValueError("a unit that shares a memory has no tables of its own")
        self.tables, self.shares_memory = _checked(p, tables), shares_memory
        self._graph = Dataflow(initiation_interval)
        self._read = lobe_read_signature(p).create(path=("table",))
        self._result = self._describe()
        ports = {}
        if shares_memory:
            ports["table"] = Out(lobe_read_signature(p))
        elif tables is None:
            ports["write"] = In(stream.Signature(lobe_write_shape()))
        bank = data.StructLayout({"bank": range(p.banks)})
        super().__init__(
            highlight_shape(p),
            FixedShape(p.RESULT_FORMAT),
            latency=self._result.stage,
            initiation_interval=initiation_interval,
            constants=bank if p.banks > 1 else None,
            ports=ports,
        )

    def elaborate(self, platform):
        """The pipeline and the memory beside it. The memory is also written while the pipeline is stalled."""
        m = super().elaborate(platform)
        m.d.comb += self._read.enable.eq(self.advance)
        if self.shares_memory:
            wiring.connect(m, wiring.flipped(self.table), self._read)
        else:
            m.submodules.memory = memory = LobeMemory(self.model, self.tables)
            wiring.connect(m, self._read, memory.reads[0])
            if self.tables is None:
                wiring.connect(m, wiring.flipped(self.write), memory.write)
        return m

    def datapath(self, m, operands):
        """Describe the registers of the graph, and read its results in the last stage."""
        p = self.model
        self._base = Const(0, 1)
        if p.banks > 1 and p.operand != "place":
            self._base = Signal(range(p.banks * p.rows), name="base")
            with m.Switch(self.constants.bank):
                for bank in range(p.banks):
                    with m.Case(bank):
                        m.d.sync += self._base.eq(bank * p.rows)
        self._module = m
        return self._graph.build(m, self, operands)(self._result, self.latency)

    def _describe(self) -> Word:
        """Words from the operand to the result."""
        p, g = self.model, self._graph
        operand = g.input("operand", lambda operands: operands.operand)
        dark = g.input("dark", lambda operands: operands.dark)

        def is_lit(operand, dark):
            code = Value.cast(operand)
            return ~(dark | code[-1] | (~code.any() if p.operand == "cosine" else 0))

        lit = g.register("lit", is_lit, operand, dark)
        shapes = unsigned(len(self._read.address)), unsigned(p.fraction_format.width)
        memory = g.share("memory", shapes, 2, self._look_up)
        address = self._placed if p.operand == "place" else self._addressed
        return self._interpolate(g.use(memory, "word", *address(operand, lit)), lit)

    def _placed(self, operand: Word, lit: Word) -> tuple[tuple[Word], Callable]:
        """Word of a place, and the function from it to the address and the fraction."""
        p, fraction = self.model, self.model.fraction_format.width

        def placed(place, lit):
            return Mux(lit, Value.cast(place)[:-1], 0)

        def place(code):
            # A bank has a power of two of words.
            return Cat(code[fraction:], self.constants.bank if p.banks > 1 else ()), code[:fraction]

        return (self._graph.register("placed", placed, operand, lit, formula="place"),), place

    def _addressed(self, operand: Word, lit: Word) -> tuple[tuple[Word], Callable]:
        """Word of 1 - N·H shifted by its leading zeros, and the function from it to address and fraction."""
        p, g = self.model, self._graph
        bits, top = p.fraction_bits, p.fraction_bits - 1

        def limited(wide, lit):
            # If lit, u is under 1.
            return Mux(lit, Value.cast(wide.saturate(p.argument_format))[:bits], 0)[:bits]

        def coarse(argument, zeros):
            # This stage shifts by the upper bits of the amount. The second stage shifts by the last bits.
            shift = Cat(Mux(zeros == p.octaves, p.octaves - 1, zeros), Const(0, _FINE))
            normal = (argument << Cat(Const(0, _FINE), shift[_FINE:]))[:top]
            row = (self._base + p.octaves - zeros)[: len(self._read.address) - p.step_bits]
            return Cat(normal, shift[:_FINE], row)

        def place(word):
            fine, row = word[top : top + _FINE], word[top + _FINE :]
            normal = (word[:top] << fine)[:top]
            step, rest = normal[top - p.step_bits :], normal[: top - p.step_bits]
            return Cat(step, row), rest[len(rest) - p.fraction_format.width :]

        argument = g.register(
            "one_minus_cosine", lambda x: one_minus(p, x).truncate(bits), operand, formula="u"
        )
        argument = g.register("argument", limited, argument, lit, formula="u")
        zeros = g.register("zeros", lambda code: leading_zeros(code[bits - p.octaves :]), argument)
        shifted = g.register("shifted", coarse, argument, zeros, formula="2^zeros·u")
        return (shifted,), place

    def _look_up(self, register: Callable[[Any, str], Any], address: Value, fraction: Value) -> Value:
        """Word at an address, and the fraction, delayed by the same two cycles."""
        self._module.d.comb += self._read.address.eq(address)
        return Cat(self._read.word, register(register(fraction, "fraction_read"), "fraction"))

    def _interpolate(self, word: Word, lit: Word) -> Word:
        """Term ``v + D f`` of a word with value v and difference D, at the fraction f."""
        p, g = self.model, self._graph
        formats = {"value": p.VALUE_FORMAT, "difference": p.DIFFERENCE_FORMAT, "fraction": p.fraction_format}
        parts, first = [], 0
        for (name, format), symbol in zip(formats.items(), "vDf", strict=True):
            bits = slice(first, first + format.width)

            def part(code, format=format, bits=bits):
                return FixedValue(format, code[bits])

            parts.append(g.wire(name, part, word, symbol))
            first += format.width
        value, difference, fraction = parts
        if g.interval == 1:
            # Registers that the multiplier block can take in.
            difference = g.register("difference", lambda x: x, difference)
            fraction = g.register("fraction", lambda x: x, fraction)
            product = g.register("product", lambda x, y: x * y, difference, fraction)
        else:
            product = g.multiply("product", difference, fraction)

        def term(value, product, lit):
            # The term lies between two entries, so it does not wrap.
            total = (value + product.truncate(17)).wrap(p.RESULT_FORMAT)
            return FixedValue(p.RESULT_FORMAT, Mux(lit, Value.cast(total), 0))

        return g.register("term", term, value, product, lit, formula="v + D·f")


def _checked(model: Lobe, tables: Sequence[LobeTable] | None) -> list[LobeTable] | None:
    if tables is None:
        return None
    if len(tables) != model.banks:
        raise ValueError(f"there must be a table for each of {model.banks} banks, not {len(tables)}")
    for table in tables:
        model.check(table)
    return list(tables)
