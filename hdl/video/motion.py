"""Motion: the matrices of meshes that turn, by a table of sines."""

from typing import ClassVar

from amaranth.hdl import Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.video.motion import ANGLE_BITS, ENTRIES, Motion
from blysk.golden.video.vertex_unit import ENTRY, OFFSET
from blysk.hdl.core.bits import times_constant
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.scene_memory import scene_memory, word_write_shape, write_words

__all__ = ["MotionUnit", "entry_shape", "turn_shape"]

_STEPS = 5
"""Cycles of an entry before its output."""

_FIRST_OFFSET, _LAST_OFFSET = 9, 11


def turn_shape(slots: int) -> data.StructLayout:
    """Shape of a request for a matrix: its slot, and the angle."""
    return data.StructLayout(
        {"slot": unsigned(max((slots - 1).bit_length(), 1)), "angle": unsigned(ANGLE_BITS)}
    )


def entry_shape() -> data.StructLayout:
    """Shape of an entry: its index in the matrix, and its value.

    An offset is in the format `OFFSET`. The low bits of every other value are in the format `ENTRY`.
    """
    return data.StructLayout({"index": range(ENTRIES), "value": FixedShape(OFFSET)})


class MotionUnit(wiring.Component):
    """Computes a matrix, one entry after the other. `Motion` is the bit-accurate model.

    A matrix takes three cycles for cosine and sine, then seven cycles for each entry. The unit has one
    multiplier.

    Parameters
    ----------
    model : Motion
        Bit-accurate model with the coefficients after power-up.
    loads : bool
        Whether the memory of the coefficients can be written.

    Members
    -------
    i : :py:`In(stream.Signature(turn_shape(slots)))`
        Requests.
    write : :py:`In(stream.Signature(word_write_shape(21 slots, 61)))`
        Words to write, accepted while no matrix is computed. Only with ``loads``.
    o : :py:`Out(stream.Signature(entry_shape()))`
        21 entries for each request.

    Source: docs/theory/video.md#vertices; not in the documents.
    """

    multipliers = 1

    FORMULAS: ClassVar[dict[str, str]] = {
        "product": "a·b",
        "total": "Σ a·b",
    }

    def __init__(self, model: Motion, loads: bool = False):
        self.model, self.loads = model, loads
        write = word_write_shape(ENTRIES * model.slots, model.WORD_BITS)
        super().__init__(
            {
                "i": In(stream.Signature(turn_shape(model.slots))),
                "o": Out(stream.Signature(entry_shape())),
                **({"write": In(stream.Signature(write))} if loads else {}),
            }
        )

    def elaborate(self, platform):
        """Cosine and sine, then for each entry two products and their sum."""
        m = Module()
        model = self.model
        rows = model.words
        m.submodules.coefficients = memory = scene_memory("coefficients", model.WORD_BITS, len(rows), rows)
        read = memory.read_port()
        sines = model.table.codes.tolist()
        m.submodules.sines = table = Memory(shape=ENTRY.width - 1, depth=len(sines), init=sines)
        look = table.read_port()

        angle, index = Signal(ANGLE_BITS, name="angle"), Signal(range(ENTRIES), name="entry")
        address, step = Signal(range(len(rows)), name="address"), Signal(range(_STEPS), name="step")
        if self.loads:
            waits = Signal(name="waits")
            m.d.comb += read.en.eq(~write_words(m, memory, read, address, self.write, waits))
        else:
            m.d.comb += read.addr.eq(address)
        cosine, sine = (Signal(signed(ENTRY.width), name=name) for name in ("cosine", "sine"))
        bits = model.TABLE_BITS
        code = Mux(step == 0, angle + (1 << bits), angle)[:ANGLE_BITS]
        negative = Signal(name="negative")
        looked = Mux(negative, -look.data, look.data)[: ENTRY.width].as_signed()
        m.d.comb += look.addr.eq(code[:bits] ^ code[bits].replicate(bits))
        m.d.sync += negative.eq(code[-1])

        a, b = (Signal(signed(ENTRY.width), name=f"factor_{name}") for name in "ab")
        product = Signal(signed(2 * ENTRY.width), name="product")
        total = Signal(signed(_TOTAL.width), name="total")
        c0, c1, c2 = (
            read.data[shift:][:width].as_signed()
            for shift, width in zip(_SHIFTS, (OFFSET.width, ENTRY.width, ENTRY.width), strict=True)
        )
        m.d.sync += product.eq(a * b)
        with m.FSM(name="state"):
            with m.State("wait"):
                m.d.comb += self.i.ready.eq(1)
                if self.loads:
                    m.d.comb += waits.eq(1)
                m.d.sync += [step.eq(0), index.eq(0), angle.eq(self.i.payload.angle)]
                with m.If(self.i.valid):
                    m.d.sync += address.eq(times_constant(self.i.payload.slot, ENTRIES))
                    m.next = "turn"
            with m.State("turn"):
                m.d.sync += step.eq(step + 1)
                with m.If(step == 1):
                    m.d.sync += cosine.eq(looked)
                with m.If(step == 2):
                    m.d.sync += [sine.eq(looked), step.eq(0)]
                    m.next = "entry"
            with m.State("entry"):
                m.d.sync += step.eq(step + 1)
                with m.Switch(step):
                    with m.Case(0):
                        m.d.sync += [a.eq(c1), b.eq(cosine)]
                    with m.Case(1):
                        m.d.sync += [a.eq(c2), b.eq(sine), total.eq(c0 << _ALIGN)]
                    with m.Case(2, 3):
                        m.d.sync += total.eq(total + product)
                    with m.Case(4):
                        m.d.sync += step.eq(0)
                        m.next = "give"
            with m.State("give"):
                m.d.comb += self.o.valid.eq(1)
                with m.If(self.o.ready):
                    m.d.sync += [index.eq(index + 1), address.eq(address + 1)]
                    m.next = "next"
                    with m.If(index == ENTRIES - 1):
                        m.next = "wait"
            with m.State("next"):
                m.next = "entry"
        exact = FixedValue(_TOTAL, total)
        fine, coarse = (
            Value.cast(exact.round_half_up(format.fraction_bits).saturate(format))
            for format in (OFFSET, ENTRY)
        )
        is_offset = (index >= _FIRST_OFFSET) & (index <= _LAST_OFFSET)
        m.d.comb += [
            self.o.payload.index.eq(index),
            Value.cast(self.o.payload.value).eq(Mux(is_offset, fine, coarse)),
        ]
        return m


_SHIFTS = (0, OFFSET.width, OFFSET.width + ENTRY.width)
_ALIGN = 2 * ENTRY.fraction_bits - OFFSET.fraction_bits
_TOTAL = OFFSET + (ENTRY * ENTRY + ENTRY * ENTRY)
