"""Spans of ``chord-local``: differences from three values of a span, and accumulators for its pixels."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Module, Signal, Value, ValueLike, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.memory import first_in_turn, words_in_turn
from blysk.hdl.core.stream import FIFO_LATENCY, connect
from blysk.hdl.core.views import copy
from blysk.hdl.cosines.chord_setup import (
    ChordSetupUnit,
    chord_differences_shape,
    light_values_shape,
    span_operands_shape,
)
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordSpansUnit"]

_LONG = 3
"""Number of pixels of the shortest span that has differences."""


class ChordAccumulatorUnit(AccumulatorUnit):
    """Accumulators of ``N . L`` and u of each light, and of factors: a quadratic each, see `AccumulatorUnit`.

    The words of a span come a cycle after the span was accepted.

    Parameters
    ----------
    model : LocalChordInterpolator
        Bit-accurate model, with the formats.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is specular light, and so u.
    factors : sequence of int
        Indices of the lights that fade. Each of them has one more quadratic.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"length": 12})))`
        Lengths of spans, 1 or more.
    words : :py:`In(StructLayout({"start": ..., "lights": ...}))`
        First values of the span that is taken in, and its differences. If lights fade, there are also
        ``factor_start`` and ``factors``.
    taken : :py:`Out(1)`
        High on the cycle on which the words of the accepted span are taken in.
    o : :py:`Out(stream.Signature(operands_shape(model, lights, highlights=highlights, ...)))`
        Operands of the pixels.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.10.
    """

    def __init__(
        self,
        model: LocalChordInterpolator | None = None,
        lights: int = 1,
        *,
        highlights: bool = True,
        factors: Sequence[int] = (),
    ):
        self.model = p = model or LocalChordInterpolator()
        self.factors = tuple(factors)
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        differences = chord_differences_shape(lights, highlights, p.setup, len(self.factors))
        words = {
            "start": light_values_shape(lights, highlights=highlights),
            "lights": differences["lights"].shape,
        }
        if self.factors:
            start = data.ArrayLayout(FixedShape(p.setup.DIFFUSE_FORMAT), len(self.factors))
            words |= {"factor_start": start, "factors": differences["factors"].shape}
        self.words_shape = data.StructLayout(words)
        super().__init__(
            data.StructLayout({"length": unsigned(LENGTH_BITS)}),
            operands_shape(p, lights, highlights=highlights, factored=bool(self.factors)),
            {"words": In(self.words_shape), "taken": Out(1)},
        )

    @classmethod
    def begin(cls, model, start):
        """The start plus half a step of the result. If this takes an adder, `rounded` adds the half step."""
        return start.extend(model.format) if cls._adds_late(model) else super().begin(model, start)

    @classmethod
    def rounded(cls, model, value):
        """The value, with half a step of the result if `begin` has not added it."""
        return super().begin(model, value) if cls._adds_late(model) else value

    @staticmethod
    def _adds_late(model: DifferenceAccumulator) -> bool:
        """Whether the start has a bit at the place of half a step of the result."""
        return model.start_format.fraction_bits > model.result_format.fraction_bits

    @property
    def span(self):
        """Words of the span that is taken in."""
        return self.words

    def hold(self, m, load):
        """Keep nothing, because the words are on the port when they are taken in."""
        m.d.comb += self.taken.eq(load)

    def quadratics(self, values):
        """Quadratics of each light, and of each factor."""
        for index, (start, light) in enumerate(zip(self.span.start, self.span.lights, strict=True)):
            result = values[index]
            for name in self.functions:
                words = start[name], light[name].first, light[name].second
                value = result["cosine" if name == "diffuse" else name]
                yield f"{name}_{index}", self.model.accumulators[name], words, value
        for index, light in enumerate(self.factors):
            words = self.span.factor_start[index], *(self.span.factors[index][n] for n in ("first", "second"))
            yield f"factor_{light}", self.model.accumulators["factor"], words, values[light].factor


class ChordSpansUnit(wiring.Component):
    """Turns values of spans into operands of pixels, by chord setup and accumulators.

    A span of three pixels or more goes through the setup. Its start goes through a memory beside the setup. A
    span of one pixel goes through the memory alone. So short spans take a cycle each, and wait only for the
    spans before them. The setup never waits, because a span is accepted only if there is room for its
    differences behind the setup.

    Parameters
    ----------
    model : LocalChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    initiation_interval : int
        Least cycles from a span of three pixels or more to the next.
    highlights : bool
        Whether there is specular light, and so u.
    length_bits : int
        Bits of the length.
    factors : sequence of int
        Indices of the lights that fade.

    Members
    -------
    i : :py:`In(stream.Signature(span_operands_shape(lights, highlights, length_bits, len(factors))))`
        Spans of one pixel, of which only the first values count, or of three pixels or more.
    long : :py:`In(1)`
        Whether the offered span has more than one pixel. Its source knows this without the length.
    o : :py:`Out(stream.Signature(operands_shape(model, lights, highlights=highlights)))`
        Operands of the pixels.
    out_of_range : :py:`Out(1)`
        High for one cycle for each span with a word out of range.

    Source: docs/theory/chord.md#differences.
    """

    def __init__(
        self,
        model: LocalChordInterpolator,
        lights: int,
        *,
        initiation_interval: int = 3,
        highlights: bool = True,
        length_bits: int = LENGTH_BITS,
        factors: Sequence[int] = (),
    ):
        self._setup = ChordSetupUnit(
            model.setup,
            lights,
            initiation_interval=initiation_interval,
            length_bits=length_bits,
            highlights=highlights,
            factors=len(factors),
        )
        self.multipliers = self._setup.multipliers
        self._accumulator = ChordAccumulatorUnit(model, lights, highlights=highlights, factors=factors)
        # One cycle is for the count of the waiting differences.
        self.latency = self._setup.latency + 1 + self._accumulator.latency
        self.short_latency = 1 + FIFO_LATENCY + self._accumulator.latency
        super().__init__(
            {
                "i": In(stream.Signature(span_operands_shape(lights, highlights, length_bits, len(factors)))),
                "long": In(1),
                "o": Out(stream.Signature(self._accumulator.o.payload.shape())),
                "out_of_range": Out(1),
            }
        )

    @property
    def starts_inside(self) -> int:
        """Depth of the memory of starts, a power of two.

        While a span is in the setup, spans of one pixel may follow on each cycle. There is also room for an
        interval of the setup, the latency of the FIFO, and `_LATE` spans.
        """
        needed = self._setup.latency + self._setup.initiation_interval + FIFO_LATENCY + self._LATE
        return 1 << (needed - 1).bit_length()

    @property
    def differences_inside(self) -> int:
        """Depth of the memory of differences, a power of two.

        There is room for the spans inside the setup, of three pixels or more, and for spans behind it.
        """
        needed = -(-self._setup.latency // _LONG) + FIFO_LATENCY + self._LATE
        return 1 << (needed - 1).bit_length()

    _LATE = 4
    """Spans beyond the count: three come before the count is known, and the words of a fourth wait."""

    def elaborate(self, platform):
        """Memory of starts beside the setup, memory of differences behind it, and the accumulators."""
        m = Module()
        m.submodules.chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        span, joined = self.i.payload, accumulator.i
        depth = self.starts_inside
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=len(span.length) + 1, depth=depth + 1)
        accepted, popped = Signal(), Signal()
        length, is_long = lengths.r_data[:-1], lengths.r_data[-1]
        room, waits = self._count(m, accepted, popped)
        m.d.comb += [
            copy(setup.i.payload, span),
            setup.i.valid.eq(self.i.valid & room & self.long),
            setup.o.ready.eq(1),
            self.i.ready.eq(room & (setup.i.ready | ~self.long)),
            accepted.eq(self.i.valid & self.i.ready),
            joined.payload.length.eq(length),
            joined.valid.eq(lengths.r_rdy & (waits | ~is_long)),
            lengths.r_en.eq(joined.ready & (waits | ~is_long)),
            popped.eq(joined.valid & joined.ready & is_long),
            self.out_of_range.eq(setup.o.valid & setup.o.payload.out_of_range),
        ]
        self._keep_words(m, lengths, accepted)
        connect(m, accumulator.o, wiring.flipped(self.o))
        return m

    def _count(self, m: Module, accepted: Value, popped: Value) -> tuple[Signal, Signal]:
        """Whether there is room for a span, and whether differences wait; both are registers.

        The accumulators accept spans of three pixels or more at least two cycles apart, so that a register
        can tell whether differences wait. Spans are counted a cycle late, so that no count lies between
        handshakes.
        """
        joined, setup = self._accumulator.i, self._setup
        went, is_room = [], []
        for name, comes, goes, depth in (
            ("spans", accepted, joined.valid & joined.ready, self.starts_inside),
            ("long", accepted & self.long, popped, self.differences_inside),
        ):
            entered, left = Signal(name=f"{name}_entered"), Signal(name=f"{name}_left")
            inside = Signal(range(depth + 1), name=f"{name}_inside")
            m.d.sync += [entered.eq(comes), left.eq(goes), inside.eq(inside + entered - left)]
            went.append(left)
            is_room.append(inside < depth - self._LATE)
        behind = Signal(range(self.differences_inside + 1), name="behind")
        waits, room = Signal(name="waits"), Signal(name="room", init=1)
        m.d.sync += [
            behind.eq(behind + setup.o.valid - went[1]),
            # ``behind`` still counts a span that left a cycle before. So ``waits`` does not need the new sum.
            waits.eq(setup.o.valid | behind[1:].any() | (behind[0] & ~went[1])),
            room.eq(Cat(is_room).all()),
        ]
        return room, waits

    def _keep_words(self, m: Module, lengths: fifo.SyncFIFOBuffered, accepted: Value) -> None:
        """Lengths, and memories of starts and of differences, read as the accumulators take words in."""
        accumulator, setup = self._accumulator, self._setup
        words, span = accumulator.words, self.i.payload
        starts, differences = ("start", "factor_start"), ("lights", "factors")
        if not accumulator.factors:
            starts, differences = starts[:1], differences[:1]
        shape = data.StructLayout({name: words.shape().members[name] for name in starts})
        start = Signal(shape, name="start")
        for i, values in enumerate(span["values"]):
            for name in accumulator.functions:
                m.d.comb += start.start[i][name].eq(values[name][0])
        for k in range(len(accumulator.factors)):
            m.d.comb += start.factor_start[k].eq(span.factors[k][0])
        self._takes_long = takes_long = Signal(name="takes_long")
        with m.If(accumulator.i.valid & accumulator.i.ready):
            m.d.sync += takes_long.eq(lengths.r_data[-1])
        taken = accumulator.taken
        # Starts and lengths are written a cycle late, because the handshake comes late in a cycle.
        kept, entered = Signal.like(start, name="kept", reset_less=True), Signal(name="entered")
        length = Signal(len(lengths.w_data), name="length", reset_less=True)
        m.d.sync += [
            copy(kept, start),
            length.eq(Cat(self.i.payload.length, self.long)),
            entered.eq(accepted),
        ]
        m.d.comb += [lengths.w_data.eq(length), lengths.w_en.eq(entered)]
        made = Cat(Value.cast(setup.o.payload[name]) for name in differences)
        came = setup.o.valid, taken & takes_long, self.differences_inside
        for names, kept_words in (
            (starts, _keep(m, "starts", kept, entered, taken, self.starts_inside)),
            (differences, _keep(m, "differences", made, *came)),
        ):
            m.d.comb += Cat(Value.cast(words[name]) for name in names).eq(kept_words)


def _keep(m: Module, name: str, word: ValueLike, written: Value, taken: Value, depth: int) -> Value:
    """Memory of words in their order, without handshakes. It gives the first word that has not been taken.

    Parameters
    ----------
    m : Module
        Module that gets the memory as a submodule ``name``.
    word : ValueLike
        Word that comes.
    written, taken : Value
        Whether a word comes, and whether the first word is taken.
    depth : int
        Largest number of words inside, a power of two.
    """
    return first_in_turn(m, words_in_turn(m, name, word, written, depth), taken)
