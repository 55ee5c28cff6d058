"""The registers of a core, with an answer for each access of a bus."""

from amaranth.hdl import Const, Module, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.bus.registers import (
    ADDRESS_BITS,
    CONSTANTS,
    ERRORS,
    IDENTITY,
    VERSION,
    WORD_BITS,
    Register,
    RegisterMap,
)
from blysk.hdl.core.views import copy
from blysk.hdl.frame_constants import write_shape

__all__ = ["RegistersUnit", "access_shape", "answer_shape", "front_members"]


def access_shape() -> data.StructLayout:
    """Shape of an access: byte address, whether it is a write, the word, and a strobe for each byte."""
    return data.StructLayout(
        {"address": ADDRESS_BITS, "write": 1, "data": WORD_BITS, "strobe": WORD_BITS // 8}
    )


def answer_shape() -> data.StructLayout:
    """Shape of an answer: the read word (0 for a write), and whether the access is refused."""
    return data.StructLayout({"data": WORD_BITS, "error": 1})


def front_members(bus: wiring.Signature) -> dict[str, wiring.Member]:
    """Members of an adapter from a bus: the bus, its accesses ``i``, and their answers ``o``."""
    return {
        "bus": In(bus),
        "i": Out(stream.Signature(access_shape())),
        "o": In(stream.Signature(answer_shape())),
    }


class RegistersUnit(wiring.Component):
    """Registers behind a bus. `RegisterFile` is the bit-accurate model.

    An access is answered 2 cycles after it was accepted. The next access is accepted when the answer has been
    taken. A refused access changes only the registers ``errors`` and ``refused``. Registers of the picture
    and frame constants are written as whole words, while ``busy`` is low. A written 1 clears its bit of
    ``errors`` at any time, also in a write of single bytes. A written 1 above the bits of ``errors`` has no
    effect. A read of a byte gets the whole word.

    Parameters
    ----------
    model : RegisterMap
        The registers.

    Members
    -------
    i : :py:`In(stream.Signature(access_shape()))`
        Accesses.
    o : :py:`Out(stream.Signature(answer_shape()))`
        Answers to the accesses.
    constants : :py:`In(...)`
        State of the core: ``busy``, and the core's counters by name.
    picture : :py:`Out(...)`
        Registers of the picture by name, if there are any.
    load : :py:`Out(...)`
        A frame constant. It is written on the cycle on which ``valid`` is high.

    Source: docs/theory/bus.md#registers.
    """

    def __init__(self, model: RegisterMap):
        self.model = model
        said = {"busy": unsigned(1)} | {name: unsigned(width) for name, width, _ in model.counters}
        load = {"valid": unsigned(1)} | dict(write_shape().members)
        members = {
            "i": In(stream.Signature(access_shape())),
            "o": Out(stream.Signature(answer_shape())),
            "constants": In(data.StructLayout(said)),
            "load": Out(data.StructLayout(load)),
        }
        if model.picture:
            shape = {register.name: _shape(register) for register in model.picture}
            members["picture"] = Out(data.StructLayout(shape))
        super().__init__(members)

    def elaborate(self, platform):
        """The access in a register, its decoding, and its answer in another register."""
        m = Module()
        access, full = Signal(self.i.payload.shape(), name="access"), Signal(name="full")
        answer, answered = Signal(self.o.payload.shape(), name="answer"), Signal(name="answered")
        m.d.comb += [
            self.i.ready.eq(~full & ~answered),
            self.o.valid.eq(answered),
            copy(self.o.payload, answer),
        ]
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [copy(access, self.i.payload), full.eq(1)]
        with m.If(self.o.ready):
            m.d.sync += answered.eq(0)
        refused, errors = Signal(ADDRESS_BITS, name="refused"), Signal(len(ERRORS), name="errors")
        cause, word = self._decide(m, access, {"errors": errors, "refused": refused})
        with m.If(full):
            m.d.sync += [full.eq(0), answered.eq(1), answer.error.eq(cause.any()), answer.data.eq(word)]
            with m.If(cause.any()):
                m.d.sync += [refused.eq(access.address), errors.eq(errors | cause)]
        accepted, whole = full & access.write & ~cause.any(), access.strobe.all()
        with m.If(accepted & access.strobe[0] & _is_at(access, self.model["errors"])):
            m.d.sync += errors.eq(errors & ~access.data[: len(ERRORS)])
        for register in self.model.picture:
            value = Signal(_shape(register), name=f"picture_{register.name}")
            m.d.comb += self.picture[register.name].eq(value)
            with m.If(accepted & whole & _is_at(access, register)):
                m.d.sync += value.eq(access.data)
        m.d.comb += [
            self.load.valid.eq(accepted & whole & (access.address >= CONSTANTS)),
            self.load.address.eq((access.address - CONSTANTS) >> 2),
            self.load.data.eq(access.data),
        ]
        return m

    def _decide(self, m: Module, access, held) -> tuple[Signal, Signal]:
        """One bit for each cause to refuse the held access, and the word that a read gets."""
        cause, word = Signal(len(ERRORS), name="cause"), Signal(WORD_BITS, name="word")
        found, fits = Signal(name="found"), Signal(name="fits")
        readable, writable, clears = (Signal(name=name) for name in ("readable", "writable", "clears"))
        said = {"identity": IDENTITY, "version": VERSION, "state": self.constants.busy} | held
        said |= {name: self.constants[name] for name, *_ in self.model.counters}
        with m.Switch(access.address[2:]):
            for register in self.model.registers:
                with m.Case(register.address >> 2):
                    reads, writes = register.access != "write-only", register.access != "read-only"
                    m.d.comb += [found.eq(1), readable.eq(reads), writable.eq(writes)]
                    if writes:
                        m.d.comb += [
                            fits.eq(_fits(register, access.data)),
                            clears.eq(register.access == "clear"),
                        ]
                    if reads:
                        value = said[register.name] if register.name in said else self.picture[register.name]
                        read = Value.cast(value) if isinstance(value, Value) else Const(value, register.width)
                        with m.If(~access.write):
                            m.d.comb += word.eq(read.as_signed() if register.signed else read)
        some, whole = access.write & access.strobe.any(), access.write & access.strobe.all()
        names = ("unmapped", "read_only", "write_only", "strobe", "value", "busy")
        wrong = (
            ~found | (whole & access.address[:2].any()),
            some & ~writable,
            ~access.write & ~readable,
            some & ~clears & ~whole,
            some & ~clears & ~fits,
            some & ~clears & self.constants.busy,
        )
        before = Const(0)
        for name, one in zip(names, wrong, strict=True):
            m.d.comb += cause[list(ERRORS).index(name)].eq(one & ~before)
            before = before | one
        return cause, word


def _shape(register: Register):
    return signed(register.width) if register.signed else unsigned(register.width)


def _fits(register: Register, word: Value) -> Value:
    """Whether a word of 32 bits is a value of the register's range, extended by its sign or by zeros."""
    above, fits = word[register.width :], Const(1)
    if len(above):
        fits = above == (word[register.width - 1].replicate(len(above)) if register.signed else 0)
    if register.range is not None:
        code, (low, high) = Value.cast(word[: register.width]), register.range
        code = code.as_signed() if register.signed else code
        # If every code passes, there is no comparison, because Verilator would warn of it.
        fits &= Const(1) if low == 0 and not register.signed else code >= low
        fits &= code <= high
    return fits


def _is_at(access, register: Register) -> Value:
    """Whether the address is in the register's word."""
    return access.address[2:] == register.address >> 2
