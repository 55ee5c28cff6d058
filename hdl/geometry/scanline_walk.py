"""Walk along a scanline: which pixels a piece has, and the values of attributes at its ends.

Parts of `SpanAttributesUnit`. All attributes are computed on one cycle. In the *serial* form the same
adders compute one attribute after the other.
"""

from amaranth.hdl import Const, Module, Mux, Signal, Value, ValueLike
from amaranth.lib import stream

from blysk.golden.geometry.gradient_setup import GradientSetup
from blysk.golden.geometry.triangles import PIXEL_BITS
from blysk.hdl.core.ring import Ring, next_turn

__all__ = ["AttributeRing", "AttributeTurns", "ScanlineWalk"]

_BITS = GradientSetup.FORMAT.width


class AttributeTurns:
    """Control of the turns of ``count`` attributes: all on one cycle, or *serially* in as many turns.

    In the serial form the first attribute decides for all attributes whether a scanline comes in. The control
    of the walk moves on with the last attribute, `ends`. If ``ahead`` is set, registers tell whether the walk
    advances.

    In the other form `due` is high until a triangle's planes are read, and `reads` on the cycle on which
    registers take these planes. The triangle's first scanline comes in later. In the serial form `reads` is
    ``None``.
    """

    def __init__(
        self, m: Module, rows: stream.Interface, busy: Signal, serial: bool, ahead: bool, count: int
    ):
        self.serial, self.row_valid, self.count = serial, rows.valid, count
        ahead &= serial
        self.advance, self.leaves = Signal(name="advance", init=ahead), Signal(name="would_leave")
        self.lane, self.ends, self.steps = (
            Signal(range(count), name="lane"),
            Signal(name="ends"),
            Signal(name="steps"),
        )
        # ``accepts``: a scanline comes in, on a step of each attribute. ``goes``: the control moves on.
        # ``takes``: the control takes a scanline. ``loads``: the control takes a scanline with pixels.
        self.accepts, self.goes, self.takes = (Signal(name=name) for name in ("accepts", "goes", "takes"))
        self.loads, covered = Signal(name="loads_walk"), rows.payload.row.covered
        opens, self.reads = ~busy | self.leaves, None
        if not serial:
            moves = ~busy | self.advance
            self.due = due = Signal(name="planes_due", init=1)
            self.reads = Signal(name="reads")
            m.d.comb += [self.ends.eq(1), self.steps.eq(1), rows.ready.eq(opens & moves & ~due)]
            m.d.comb += [self.accepts.eq(rows.valid & rows.ready), self.takes.eq(self.accepts)]
            m.d.comb += self.reads.eq(rows.valid & opens & moves & due)
            with m.If(self.reads):
                m.d.sync += due.eq(0)
            with m.Elif(self.accepts):
                m.d.sync += due.eq(rows.payload.row.last)
            m.d.comb += self.goes.eq(self.accepts | (busy & self.advance))
            m.d.comb += self.loads.eq(self.takes & covered)
            return
        first, taken, moves = self.lane == 0, Signal(name="taken"), Signal(name="moves", init=ahead)
        m.d.comb += [
            rows.ready.eq(Mux(first, opens, taken) & moves),
            self.accepts.eq(Mux(first, rows.valid & opens, taken)),
            self.steps.eq(moves & Mux(first, busy | self.accepts, ~taken | rows.valid)),
            self.ends.eq(self.lane == count - 1),
            self.goes.eq(self.ends & moves & (~taken | rows.valid)),
            self.takes.eq(taken),
            self.loads.eq(taken & (has_pixels := Signal(name="has_pixels"))),
        ]
        with m.If(rows.valid):
            m.d.sync += has_pixels.eq(covered)
        if ahead:
            # A register tells a cycle before whether the output lets the walk advance.
            stays, advances = Signal(name="stays_busy"), Signal(name="advances")
            self.advances = advances
            m.d.comb += stays.eq(Mux(self.goes, self.loads | (busy & ~self.leaves), busy))
            m.d.sync += [self.advance.eq(advances), moves.eq(~stays | advances)]
        else:
            m.d.comb += moves.eq(~busy | self.advance)
        with m.If(self.steps):
            m.d.sync += [self.lane.eq(next_turn(self.lane, count)), taken.eq(self.accepts)]

    def late(self, m: Module, value: ValueLike, name: str) -> Value:
        """In the *serial* form the value on the step before, from a register. Else the value itself."""
        if not self.serial:
            return Value.cast(value)
        register = Signal(len(Value.cast(value)), name=name)
        with m.If(self.steps):
            m.d.sync += register.eq(value)
        return register


class AttributeRing:
    """A register of one attribute. *Serial*: a ring with a word of each attribute, moved on every step.

    A *late* word is replaced one step later, on its way round the ring, by values from
    `AttributeTurns.late`.
    """

    def __init__(self, m: Module, name: str, turns: AttributeTurns, late: bool = False):
        self.value = self._next = Signal(_BITS, name=name)
        self._domain = "sync"
        if turns.serial:
            ring = Ring(m, f"{name}_ring", _BITS, turns.count, turns.steps, turns.lane, late)
            self._next, self._domain = Signal(_BITS, name=f"{name}_next"), "comb"
            m.d.comb += self.value.eq(ring.first)
            m.d.comb += self._next.eq(turns.late(m, self.value, f"{name}_stays") if late else self.value)
            ring.takes(self._next)

    def becomes(self, m: Module, value: ValueLike) -> None:
        """Replace the word. A word that is not replaced stays."""
        m.d[self._domain] += self._next.eq(value)


class ScanlineWalk:
    """Control of the walk along a scanline: first pixels to skip, then pieces, one or two bits a step.

    A mask is the number of pixels of a whole piece, minus 1: ``loaded_mask`` for the span that comes in,
    ``mask`` for the span inside.
    """

    def __init__(
        self, m: Module, row, tag, loaded_mask: Value, mask: Signal, loads: Signal, busy: Signal, turns
    ):
        # ``left``: pixels of the span that are left, minus 1; ``bits``: bits of a number still to be walked.
        left, bits = Signal(PIXEL_BITS, name="left"), Signal(PIXEL_BITS, name="bits")
        self.pixels, begin = Signal(PIXEL_BITS, name="pixels"), Signal(PIXEL_BITS, name="begin")
        self.turns = turns
        self.emits, self.gives, self.cuts = (Signal(name=name) for name in ("emits", "gives", "cuts"))
        self.skipping, whole = Signal(name="skipping"), Signal(name="whole")
        self.moves, self.ends = Signal(name="moves"), Signal(name="ends", init=not turns.serial)
        radix = 2 if turns.serial else 1
        self.digit = Signal(radix, name="digit")
        self.single, self.double = Signal(name="single"), Signal(name="double") if turns.serial else Const(0)
        m.d.comb += [
            self.digit.eq(bits[:radix]),
            self.moves.eq(busy if turns.serial else busy & turns.advance),
            self.gives.eq(busy & self.ends & ~self.skipping),
            self.emits.eq(self.gives & turns.advance & turns.steps),
        ]
        # A whole piece that is not the last has one pixel more than the mask. So mask and 1 are subtracted.
        after = (left + ~mask)[:PIXEL_BITS]
        count = row.length - 1
        if turns.serial:
            # The scanline is there for three cycles before it is taken, and a step takes four cycles. So the
            # numbers that follow from the scanline and the step are computed one a cycle, with registers
            # between.
            def registered(value, name):
                register = Signal.like(value, name=name)
                m.d.sync += register.eq(value)
                return register

            waiting, whole_piece = (Signal(PIXEL_BITS, name=name) for name in ("waiting", "waiting_mask"))
            skip_ends = Signal(name="skip_ends")
            with m.If(turns.row_valid):
                m.d.sync += [
                    waiting.eq(count),
                    whole_piece.eq(loaded_mask),
                    skip_ends.eq(~row.skip[radix:].any()),
                ]
            pixels, more = _piece(waiting, whole_piece)
            count = waiting
            loaded_piece = registered(pixels, "waiting_pixels"), registered(more, "waiting_more")
            after = registered(Mux(self.skipping, left, after), "after")
            pixels, more = _piece(after, mask)
            next_piece = registered(pixels, "next_pixels"), registered(more, "next_more")
            loaded_ends, next_ends = (
                registered(~words[0][radix:].any(), "ends") for words in (loaded_piece, next_piece)
            )
            shift_ends = registered(~bits[2 * radix :].any(), "shift_ends")
            with m.If(turns.goes):
                with m.If(turns.loads):
                    m.d.sync += [
                        self.ends.eq(Mux(row.skips, skip_ends, loaded_ends)),
                        turns.leaves.eq(~row.skips & loaded_ends & ~loaded_piece[1]),
                    ]
                with m.Else():
                    m.d.sync += [
                        self.ends.eq(Mux(self.ends, next_ends, shift_ends)),
                        turns.leaves.eq(
                            Mux(self.ends, next_ends & ~next_piece[1], shift_ends & ~self.skipping & ~whole)
                        ),
                    ]
        else:
            following = Mux(self.skipping, left, after)
            loaded_piece, next_piece = _piece(count[:PIXEL_BITS], loaded_mask), _piece(following, mask)
            m.d.comb += turns.leaves.eq(self.ends & ~self.skipping & ~whole)
            self._tell_ends(m, row, (loaded_mask, mask), bits, following)
        first = Signal(name="first_piece")
        m.d.comb += self.cuts.eq(turns.goes & busy & self.ends & ~self.skipping & whole & first)
        with m.If(turns.goes):
            with m.If(turns.loads):
                m.d.sync += [
                    left.eq(count),
                    self.skipping.eq(row.skips),
                    bits.eq(Mux(row.skips, row.skip, loaded_piece[0])),
                    self.pixels.eq(loaded_piece[0]),
                    whole.eq(loaded_piece[1]),
                    first.eq(1),
                ]
            with m.Elif(~self.ends):
                m.d.sync += bits.eq(bits >> radix)
            with m.Else():
                m.d.sync += [
                    bits.eq(next_piece[0]),
                    self.pixels.eq(next_piece[0]),
                    whole.eq(next_piece[1]),
                    self.skipping.eq(0),
                ]
                with m.If(~self.skipping):
                    m.d.sync += [left.eq(after), first.eq(0)]
        slides = self.gives & ~tag.right
        if turns.serial:
            slides = registered(slides, "slides")
        with m.If(turns.goes & (turns.loads | slides)):
            m.d.sync += begin.eq(Mux(turns.loads, row.x, begin + self.pixels + 1))
        self.x = Mux(tag.right, begin + left - self.pixels, begin)[:PIXEL_BITS]

    def _tell_ends(self, m: Module, row, masks: tuple, bits: Signal, following: Value) -> None:
        """Drive ``ends`` a cycle ahead: whether the bits that are walked are the last bits of their number.

        A number has more bits if it is over 1. The number of a piece is over 1 if the mask is, and over two
        pixels are left.
        """
        (loaded_mask, mask), turns, radix = masks, self.turns, len(self.digit)
        over_two = row.length[2:].any() | row.length[:2].all()
        with m.If(turns.goes):
            with m.If(turns.loads):
                more = Mux(row.skips, row.skip[radix:].any(), loaded_mask[1] & over_two)
                m.d.sync += self.ends.eq(~more)
            with m.Elif(~self.ends):
                m.d.sync += self.ends.eq(~bits[2 * radix :].any())
            with m.Else():
                m.d.sync += self.ends.eq(~(mask[1] & following[radix:].any()))

    def values(
        self, m: Module, name: str, loads, base, inward, following_step, cuts: bool
    ) -> tuple[Value, Value]:
        """Values of an attribute at both ends of the piece.

        The attribute's step is ``inward`` when a span is loaded, and ``following_step`` later. Without
        ``cuts`` no piece follows another. So the values of a span are not read once the span is found.
        """
        # The sums take a whole cycle, so the choice between them comes after their registers.
        nears, totals = (
            AttributeRing(m, f"{name}_{word}", self.turns, late=True) for word in ("near", "total")
        )
        steps = AttributeRing(m, f"{name}_step", self.turns)
        near, total, step = nears.value, totals.value, steps.value
        far = (total + sum(Mux(bit, step << k, 0) for k, bit in enumerate(self.digit)))[:_BITS]
        if inward is following_step:
            with m.If(loads | self.moves):
                steps.becomes(m, Mux(loads | self.ends, inward, step << len(self.digit)))
        else:
            with m.If(loads):
                steps.becomes(m, inward)
            with m.Elif(self.moves):
                steps.becomes(m, Mux(self.ends, following_step, step << len(self.digit)))

        def late(value, word):
            return self.turns.late(m, value, f"{name}_late_{word}")

        loaded, moved, ended = late(loads, "loads"), late(self.moves, "moves"), late(self.ends, "ends")
        base, end = late(base, "base"), late(far, "far")
        following = end
        if cuts:
            whole = Mux(self.single, step, Mux(self.double, step << 2, step << 1))
            after = late((near + whole)[:_BITS], "following")
            following = Mux(late(self.skipping, "skipping"), end, after)
        with m.If(loaded):
            for word in (nears, totals):
                word.becomes(m, base)
        with m.Elif(moved):
            with m.If(~ended):
                totals.becomes(m, end)
            with m.Else():
                for word in (nears, totals):
                    word.becomes(m, following)
        return near, far


def _piece(left: Value, mask: Value) -> tuple[Value, Value]:
    """Pixels of the next piece, minus 1, and whether another piece follows."""
    more = (left & ~mask).any()
    return Mux(more, mask, left), more
