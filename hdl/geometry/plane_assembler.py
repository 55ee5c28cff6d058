"""Plane assembler: the gradients of a triangle's attributes, and the longest piece of its spans."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.geometry.attribute_serialiser import AttributeSerialiser
from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.plane_assembler import PlaneAssembler
from blysk.golden.geometry.triangles import ATTRIBUTES, LIMIT_BITS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import read_address, read_options
from blysk.hdl.core.ring import next_turn
from blysk.hdl.core.views import copy
from blysk.hdl.geometry.gradient_setup import gradient_shape
from blysk.hdl.geometry.triangles import frame_shape

__all__ = ["PIECE_BITS", "PlaneAssemblerUnit", "plane_shape", "planes_shape"]

PIECE_BITS = 4
"""Bits of a piece's exponent."""

_WORDS = ("start", "short", "long", "inward")


def planes_shape(count: int = ATTRIBUTES) -> data.StructLayout:
    """Shape of `Planes.beats`: gradients of ``count`` attributes, and the exponent of a piece."""
    p = GradientSetup
    steps = {name: data.ArrayLayout(FixedShape(p.FORMAT), count) for name in _WORDS[1:]}
    start = {"start": data.ArrayLayout(FixedShape(p.START_FORMAT), count)}
    return data.StructLayout(start | steps | {"piece": unsigned(PIECE_BITS)})


def plane_shape() -> data.StructLayout:
    """Shape of one attribute of `planes_shape`, with the exponent of a piece."""
    words = {name: FixedShape(GradientSetup.FORMAT) for name in _WORDS[1:]}
    start = {"start": FixedShape(GradientSetup.START_FORMAT)}
    return data.StructLayout(start | words | {"piece": unsigned(PIECE_BITS)})


class PlaneAssemblerUnit(wiring.Component):
    """Collects the gradients of a triangle, and finds ``piece``. `PlaneAssembler` is the bit-accurate model.

    The first gradient of a triangle starts the product of bound and limit, which takes two bits of the limit
    a cycle. The third gradient starts the search for ``piece``, which finds one bit a cycle. If gradients are
    at least 4 cycles apart, a triangle is offered 3 cycles after its last gradient was taken in. One cycle
    after the offer the first gradient of the next triangle can be taken in. So gradients that come every four
    cycles never wait. If spans are not cut, there is neither product nor search. The unit has no multipliers.

    In the *serial* form the attributes of a triangle are offered one after the other, once for each scanline.
    They are in a memory, which takes the next triangle in at the same time.

    Parameters
    ----------
    model : PlaneAssembler
        Bit-accurate model.
    serial : bool
        Whether attributes are offered one after the other.
    count : int
        Attributes of a triangle, 4 or more.

    Members
    -------
    i : :py:`In(stream.Signature(gradient_shape()))`
        Gradients of N/W by component, then of the depth and of the surface.
    o : :py:`Out(stream.Signature(planes_shape(count)))`
        Planes of triangles. If ``serial``, the plane of one attribute at a time, in `plane_shape`.
    constants : :py:`In(frame_shape())`
        The frame, of which the unit reads ``limit``. Constant while triangles are inside.

    Attributes
    ----------
    again : Signal
        Only in the serial form, driven by the parent. If it is high when the last plane is taken, the planes
        are offered once more.

    Source: docs/theory/geometry.md#normals; not in the documents.
    """

    def __init__(self, model: PlaneAssembler | None = None, serial: bool = False, count: int = ATTRIBUTES):
        self.model, self.serial, self.count = model or PlaneAssembler(), serial, count
        super().__init__(
            {
                "i": In(stream.Signature(gradient_shape())),
                "o": Out(stream.Signature(plane_shape() if serial else planes_shape(count))),
                "constants": In(frame_shape()),
            }
        )
        if serial:
            self.again = Signal(name="again")

    def elaborate(self, platform):
        """Collected words, bound times limit, sum and maximum of the sizes, and the search."""
        m = Module()
        if self.serial:
            self._keep(m)
            return m
        gradient, result = self.i.payload, Signal(planes_shape(self.count), name="result")
        count, full, accept = Signal(range(self.count), name="count"), Signal(name="full"), Signal()
        m.d.comb += [self.i.ready.eq(~full), accept.eq(self.i.valid & ~full)]
        moves = self.o.valid & self.o.ready
        with m.If(accept):
            m.d.sync += [count.eq(next_turn(count, self.count)), full.eq(count == self.count - 1)]
            for name in _WORDS:
                words = [Value.cast(word) for word in result[name]]
                m.d.sync += [
                    word.eq(other)
                    for word, other in zip(words, [*words[1:], Value.cast(gradient[name])], strict=True)
                ]
        found = self._find(m, accept, count, result.piece)
        offers = Signal(name="offers")
        m.d.comb += [self.o.valid.eq(offers), copy(self.o.payload, result)]
        m.d.sync += offers.eq(full & found & ~moves)
        with m.If(moves):
            m.d.sync += full.eq(0)
        return m

    def _keep(self, m: Module) -> None:
        """Keep the planes of two triangles in a memory: one is taken in while the other is offered."""
        count, turn = (Signal(range(self.count), name=name) for name in ("count", "turn"))
        full, offers, bank = Signal(name="full"), Signal(name="offers"), Signal(name="bank")
        accept, swaps = self.i.valid & ~full, Signal(name="swaps")
        piece, kept = (Signal(PIECE_BITS, name=name) for name in ("piece", "kept_piece"))
        words = [Value.cast(self.i.payload[name]) for name in _WORDS]
        m.submodules.planes = memory = Memory(shape=sum(map(len, words)), depth=2 << len(count), init=[])
        write, read = memory.write_port(), memory.read_port(**read_options(memory))
        found, moves, last = self._find(m, accept, count, piece), offers & self.o.ready, self.count - 1
        leaves = moves & (turn == last) & ~self.again
        following = Mux(moves, next_turn(turn, self.count), turn)
        m.d.comb += [
            self.i.ready.eq(~full),
            write.addr.eq(Cat(count, bank)),
            write.data.eq(Cat(words)),
            write.en.eq(accept),
            swaps.eq(full & found & (~offers | leaves)),
            read.addr.eq(read_address(Cat(turn, ~bank), Cat(following[: len(turn)], bank ^ ~swaps))),
            self.o.valid.eq(offers),
            Cat(Value.cast(self.o.payload[name]) for name in _WORDS).eq(read.data),
            self.o.payload.piece.eq(kept if self.model.cuts else piece),
        ]
        m.d.sync += [turn.eq(following), offers.eq(swaps | (offers & ~leaves))]
        with m.If(accept):
            m.d.sync += [count.eq(next_turn(count, self.count)), full.eq(count == last)]
        with m.If(swaps):
            m.d.sync += [full.eq(0), bank.eq(~bank)]
            if self.model.cuts:
                m.d.sync += kept.eq(piece)

    def _find(self, m: Module, accept: Value, count: Signal, piece: Value) -> Value:
        """Find the exponent of a piece. Returns whether it is found."""
        if not self.model.cuts:
            m.d.comb += piece.eq(PlaneAssembler.LARGEST)
            return Const(1)
        given = self.i.payload
        allowed, multiplied = self._allowed(m, accept & (count == 0), given.least)
        return self._search(m, accept, count, given.size, allowed, multiplied, piece)

    def _allowed(self, m: Module, begins: Value, least: Value) -> tuple[Signal, Value]:
        """Bound times limit, two bits of the limit a cycle, and whether the product is finished."""
        bits = AttributeSerialiser.BITS + LIMIT_BITS
        allowed, factor = Signal(bits, name="allowed"), Signal(AttributeSerialiser.BITS, name="factor")
        rest, left = Signal(LIMIT_BITS, name="rest"), Signal(range(LIMIT_BITS // 2 + 1), name="left")
        with m.If(begins):
            m.d.sync += [
                allowed.eq(0),
                factor.eq(least),
                rest.eq(self.constants.limit),
                left.eq(LIMIT_BITS // 2),
            ]
        with m.Elif(left != 0):
            term = Mux(rest[-1], factor << 1, 0) + Mux(rest[-2], factor, 0)
            m.d.sync += [allowed.eq((allowed << 2) + term), rest.eq(rest << 2), left.eq(left - 1)]
        return allowed, left == 0

    @staticmethod
    def _search(m: Module, accept, count, size, allowed, multiplied, piece) -> Signal:
        """Find the largest exponent that fits, from its first bit on.

        Returns whether the search is finished.
        """
        bits = GradientSetup.SIZE_BITS
        largest, total = Signal(bits, name="largest"), Signal(bits + 2, name="total")
        norm, step = Signal(max(bits + 2, len(allowed)), name="norm"), Signal(3, name="search_step")
        found, exponent = Signal(name="found"), Signal(PIECE_BITS, name="exponent")
        with m.If(accept & (count < 3)):
            first = count == 0
            m.d.sync += [
                largest.eq(Mux(first | (largest - size)[-1], size, largest)),
                total.eq(Mux(first, 0, total) + size),
                step.eq(count == 2),
                found.eq(0),
            ]
        with m.Elif((step == 1) & multiplied):
            m.d.sync += step.eq(2)
        with m.Elif(step >= 2):
            last = step == 1 + PIECE_BITS
            m.d.sync += [step.eq(Mux(last, 0, step + 1)), found.eq(last)]
        with m.If(step == 1):
            m.d.sync += [norm.eq(largest + total), exponent.eq(0)]
        with m.Elif(step != 0):
            # Shifts by 8, 4, 2 and 1 places are tried. The answers are the bits of the exponent, first bit
            # first.
            turn = (step - 2)[:2]
            more = Mux(turn[1], Mux(turn[0], norm << 1, norm << 2), Mux(turn[0], norm << 4, norm << 8))
            # A subtraction gets a carry chain. The mapper would make look-up tables of a comparison.
            fits = ~(allowed - more)[-1]
            m.d.sync += exponent.eq(Cat(fits, exponent))
            with m.If(fits):
                m.d.sync += norm.eq(more)
        m.d.comb += piece.eq(Mux(exponent > PlaneAssembler.LARGEST, PlaneAssembler.LARGEST, exponent))
        return found
