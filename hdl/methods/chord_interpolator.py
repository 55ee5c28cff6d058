"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

import enum

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, ValueLike, signed, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.normals.difference_accumulator import DifferenceAccumulator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import FIFO_LATENCY, connect, pass_beside
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape, span_values_shape
from blysk.hdl.cosines.chord_values import ChordValuesUnit, light_values_shape
from blysk.hdl.cosines.span_limit import SpanLimitUnit, octave_limit
from blysk.hdl.lighting.value_gate import ValueGateUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordInterpolatorUnit", "ChordSpansUnit"]


_LONG = 3
"""Pixels of the shortest span that has differences."""


class ChordAccumulatorUnit(AccumulatorUnit):
    """``N . L`` and u of each light, two quadratics a light; see `AccumulatorUnit`.

    The words of a span are taken in later than its length, so that a register drives all that take them in.
    A span of m pixels gives its first values 3 cycles after it was accepted.

    Parameters
    ----------
    parameters : ChordInterpolator
        Formats.
    lights : int
        Number of lights, at least 1.
    highlights : bool
        Whether there is u.
    gated : bool
        Whether spans bring a gate's decision for each light, ``lit``.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"length": 12, "lit": lights})))`
        Lengths of spans, 1 or more, and decisions.
    words : :py:`In(StructLayout({"start": ..., "lights": ...}))`
        First values of the span that is taken in, and its differences.
    taken : :py:`Out(1)`
        High for one cycle as the words of the span are taken in that was accepted before.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights=highlights)))`
        Operands of the pixels.

    Source: docs/theory/interpolation.md#forward-differences; [T] figure 2.10.
    """

    latency = 3

    def __init__(
        self,
        parameters: ChordInterpolator | None = None,
        lights: int = 1,
        *,
        highlights: bool = True,
        gated: bool = False,
    ):
        self.parameters = p = parameters or ChordInterpolator()
        self.gated = gated
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        self.words_shape = data.StructLayout(
            {
                "start": light_values_shape(lights, highlights=highlights),
                "lights": chord_differences_shape(lights, highlights, p.setup)["lights"].shape,
            }
        )
        span = {"length": unsigned(LENGTH_BITS)}
        if gated:
            span["lit"] = unsigned(lights)
        super().__init__(
            data.StructLayout(span),
            operands_shape(p, lights, highlights=highlights, gated=gated),
            {"words": In(self.words_shape), "taken": Out(1)},
        )

    @classmethod
    def begin(cls, parameters, start):
        """The start alone where half a step of the result would take a sum: it is added to the result."""
        return (
            start.extend(parameters.format)
            if cls._adds_late(parameters)
            else super().begin(parameters, start)
        )

    @classmethod
    def rounded(cls, parameters, value):
        """The value, with the half that it does not have yet."""
        return super().begin(parameters, value) if cls._adds_late(parameters) else value

    @staticmethod
    def _adds_late(parameters: DifferenceAccumulator) -> bool:
        """Whether the start has a bit of the weight of half a step of the result."""
        return parameters.start_format.fraction_bits > parameters.result_format.fraction_bits

    @property
    def span(self):
        """Words of the span that is taken in."""
        return self.words

    def load(self, m, advance, active):
        """A cycle after the span was accepted."""
        load, present = Signal(name="load"), Signal(name="present")
        if self.gated:
            self._lit = Signal.like(self.i.payload.lit, name="lit", reset_less=True)
        with m.If(advance):
            m.d.sync += [load.eq(self.i.valid & self.i.ready), present.eq(active)]
            if self.gated:
                m.d.sync += self._lit.eq(self.i.payload.lit)
        m.d.comb += self.taken.eq(load & advance)
        return self.taken, present

    def carried(self, values):
        """The decision of each light."""
        if self.gated:
            for index, light in enumerate(values):
                yield ~self._lit[index], light.gated

    def quadratics(self, values):
        """Those of each light."""
        for index, (start, light) in enumerate(zip(self.span.start, self.span.lights, strict=True)):
            result = values[index]
            for name in self.functions:
                words = start[name], light[name].first, light[name].second
                value = result["cosine" if name == "diffuse" else name]
                yield f"{name}_{index}", self.parameters.accumulators[name], words, value


class ChordSpansUnit(wiring.Component):
    """Values of spans in, the operands of their pixels out: chord setup, then accumulators.

    A span of three pixels or more goes through the setup, and its start past it through a memory; a span of
    one pixel through the memory alone. So short spans take a cycle each, and wait only for those before them.
    The setup never waits: a span is accepted only if there is room for its differences behind the setup.

    Parameters
    ----------
    parameters : ChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    initiation_interval : int
        Least cycles from a span of three pixels or more to the next.
    highlights : bool
        Whether there is u.
    length_bits : int
        Bits of the length.
    gate : ValueGateUnit or None
        Decides which spans have no highlight; ``None``: nothing does.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"values": span_values_shape(...), "length": length_bits})))`
        Spans of one pixel, of which the first value counts, or of three and more.
    long : :py:`In(1)`
        Whether the span that is offered has more than one pixel: its source knows without the length.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights=highlights)))`
        Operands of the pixels.
    out_of_range : :py:`Out(1)`
        High for one cycle for each span with a word that does not fit.
    constants : :py:`In(10)` or :py:`In(18)`
        Specular exponent or threshold, constant while spans are inside; only of a gate that has it as a port.

    Source: docs/theory/chord.md#differences.
    """

    def __init__(
        self,
        parameters: ChordInterpolator,
        lights: int,
        *,
        initiation_interval: int = 3,
        highlights: bool = True,
        length_bits: int = LENGTH_BITS,
        gate: ValueGateUnit | None = None,
    ):
        self._gate = gate
        self._setup = ChordSetupUnit(
            parameters.setup,
            lights,
            initiation_interval=initiation_interval,
            length_bits=length_bits,
            highlights=highlights,
        )
        self.multipliers = self._setup.multipliers
        gated = gate is not None
        self._accumulator = ChordAccumulatorUnit(parameters, lights, highlights=highlights, gated=gated)
        # A cycle for the count of the differences that wait.
        self.latency = self._setup.latency + 1 + self._accumulator.latency
        waits = FIFO_LATENCY + (gate.latency if gate else 0)
        self.short_latency = waits + self._accumulator.latency
        output = operands_shape(parameters, lights, highlights=highlights, gated=gated)
        super().__init__(
            {
                "i": In(
                    stream.Signature(
                        data.StructLayout(
                            {
                                "values": span_values_shape(lights, highlights),
                                "length": unsigned(length_bits),
                            }
                        )
                    )
                ),
                "long": In(1),
                "o": Out(stream.Signature(output)),
                "out_of_range": Out(1),
            }
            | (gate.ports if gated else {})
        )

    @property
    def starts_inside(self) -> int:
        """Depth of the memory of starts: all spans that may follow one that has just begun its setup.

        Or come before it: its values may take an interval, in which none comes.
        """
        needed = self._setup.latency + self._setup.initiation_interval + FIFO_LATENCY + self._LATE
        return 1 << (needed - 1).bit_length()

    @property
    def differences_inside(self) -> int:
        """Depth of the memory of differences: those inside the setup, too, a pixel a cycle behind it."""
        needed = -(-self._setup.latency // _LONG) + FIFO_LATENCY + self._LATE
        return 1 << (needed - 1).bit_length()

    _LATE = 3
    """Spans more than counted when the count is known: two that come then, and one of which the words wait."""

    def elaborate(self, platform):
        """Memory of starts beside the setup, one of differences behind it, and the accumulators."""
        m = Module()
        m.submodules.chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        span, joined = self.i.payload, accumulator.i
        depth = self.starts_inside
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=len(span.length) + 1, depth=depth + 1)
        known, gate_ready, accepted, popped = (Signal() for _ in range(4))
        if self._gate is not None:
            self._decide(m, joined, depth, known, gate_ready)
        else:
            m.d.comb += [known.eq(1), gate_ready.eq(1)]
        # A register, so that no comparison of a level is between the handshakes.
        room = Signal(name="room", init=1)
        length, is_long = lengths.r_data[:-1], lengths.r_data[-1]
        waiting, waits = self._count(m, accepted & self.long, popped)
        m.d.comb += [
            setup.i.payload.eq(span),
            setup.i.valid.eq(self.i.valid & gate_ready & room & self.long),
            setup.o.ready.eq(1),
            self.i.ready.eq(room & gate_ready & (setup.i.ready | ~self.long)),
            accepted.eq(self.i.valid & self.i.ready),
            lengths.w_data.eq(Cat(span.length, self.long)),
            lengths.w_en.eq(accepted),
            joined.payload.length.eq(length),
            joined.valid.eq(lengths.r_rdy & known & (waits | ~is_long)),
            lengths.r_en.eq(joined.ready & known & (waits | ~is_long)),
            popped.eq(joined.valid & joined.ready & is_long),
            self.out_of_range.eq(setup.o.valid & setup.o.payload.out_of_range),
        ]
        m.d.sync += room.eq(
            (lengths.level <= depth - self._LATE) & (waiting <= self.differences_inside - self._LATE)
        )
        self._keep_words(m, accepted, is_long)
        connect(m, accumulator.o, wiring.flipped(self.o))
        return m

    def _count(self, m: Module, accepted: Value, popped: Value) -> tuple[Signal, Signal]:
        """Spans of three pixels or more from their setup to the accumulators; whether differences wait.

        Between two of them that the accumulators accept are two cycles or more, so that a register may tell.
        """
        bits = range(self.differences_inside + 1)
        inside, behind, waits = Signal(bits, name="inside"), Signal(bits, name="behind"), Signal(name="waits")
        following, gone = Signal.like(behind, name="following"), Signal(name="gone")
        m.d.comb += following.eq(behind + self._setup.o.valid - gone)
        m.d.sync += [
            gone.eq(popped),
            inside.eq(inside + accepted - gone),
            behind.eq(following),
            waits.eq(following.any()),
        ]
        return inside, waits

    def _keep_words(self, m: Module, accepted: Value, is_long: Value) -> None:
        """Memories of starts and of differences; both are read as the accumulators take words in."""
        accumulator, setup = self._accumulator, self._setup
        start, differences = Signal.like(accumulator.words.start), setup.o.payload.lights
        for i, values in enumerate(self.i.payload["values"]):
            for name in accumulator.functions:
                m.d.comb += start[i][name].eq(values[name][0])
        takes_long = Signal(name="takes_long")
        with m.If(accumulator.i.valid & accumulator.i.ready):
            m.d.sync += takes_long.eq(is_long)
        taken = accumulator.taken
        words = _keep(m, "starts", start, accepted, taken, self.starts_inside)
        m.d.comb += Value.cast(accumulator.words.start).eq(words)
        words = _keep(
            m, "differences", differences, setup.o.valid, taken & takes_long, self.differences_inside
        )
        m.d.comb += Value.cast(accumulator.words.lights).eq(words)

    def _decide(self, m: Module, joined: stream.Interface, depth: int, known: Value, ready: Value) -> None:
        """The gate beside the setup: a span waits for its decision."""
        m.submodules.value_gate = gate = self._gate
        lights = len(gate.o.payload)
        m.submodules.decisions = decisions = fifo.SyncFIFOBuffered(width=lights, depth=depth)
        long = self.long
        for given, light in zip(gate.i.payload, self.i.payload["values"], strict=True):
            first, *others = (light.highlight[k].as_value() for k in range(3))
            m.d.comb += given[0].as_value().eq(first)
            m.d.comb += [given[k].as_value().eq(Mux(long, u, first)) for k, u in enumerate(others, 1)]
        m.d.comb += [
            # Of what every span goes to, the starts and the gate, each waits for the other.
            gate.i.valid.eq(self.i.valid & self.i.ready),
            ready.eq(gate.i.ready),
            decisions.w_data.eq(gate.o.payload),
            decisions.w_en.eq(gate.o.valid),
            gate.o.ready.eq(decisions.w_rdy),
            known.eq(decisions.r_rdy),
            decisions.r_en.eq(joined.valid & joined.ready),
            joined.payload.lit.eq(decisions.r_data),
        ]
        if gate.ports:
            m.d.comb += gate.constants.eq(self.constants)


def _keep(m: Module, name: str, word: ValueLike, written: Value, taken: Value, depth: int) -> Value:
    """Memory of words in their order, without handshakes: the first that has not been taken.

    Parameters
    ----------
    m : Module
        Module that gets the memory as a submodule ``name``.
    word : ValueLike
        Word that comes.
    written, taken : Value
        Whether it does, and whether the first is taken.
    depth : int
        Words at most, a power of two.
    """
    word = Value.cast(word)
    m.submodules[name] = memory = Memory(shape=len(word), depth=depth, init=[])
    write, read = memory.write_port(), memory.read_port(domain="comb")
    m.d.comb += [write.data.eq(word), write.en.eq(written)]
    with m.If(written):
        m.d.sync += write.addr.eq(write.addr + 1)
    with m.If(taken):
        m.d.sync += read.addr.eq(read.addr + 1)
    return read.data


class _Place(enum.IntEnum):
    """What a normal is to its span: the normal of a pixel, or one of the three of a longer span."""

    PIXEL = 0
    LEFT = 1
    RIGHT = 2
    MIDDLE = 3


class ChordInterpolatorUnit(InterpolatorUnit, parameters=ChordInterpolator):
    """Chord values of one, two or three normals a span, then chord setup and accumulators.

    `ChordInterpolator` is the bit-accurate model. A span of k pixels takes ``min(k, 3)`` turns of the values,
    each ``setup_interval / 3`` cycles, and k cycles of the accumulators; both go on side by side, so that
    spans of any length leave a pixel in every cycle at a setup interval of 3. No multiplier a pixel; the
    attribute ``multipliers`` tells how many there are: 9 for one light and an interval of 3.

    The first pixel of a span of three or more comes `latency` cycles after the span, that of a shorter one
    earlier.

    Parameters
    ----------
    parameters : ChordInterpolator
        Bit-accurate model.
    lights : int
        Number of lights, at least 1.
    options
        As for `InterpolatorUnit`; ``setup_interval`` is 3, 9 or 18.

    Members
    -------
    constants : :py:`In(StructLayout({"lights": ..., "exponent": 10, "threshold": UQ(3, 15)}))`
        L and H of each light, with highlights the specular exponent for `SpanLimit`, of tables a threshold;
        constant while spans are inside.
    wide : :py:`Out(1)`
        High for one cycle for each wide span.

    Source: docs/theory/chord.md#differences.
    """

    shortest_interval = 1

    @classmethod
    def setup_intervals(cls, parameters):
        """Initiation intervals that save multipliers of one light."""
        return (3, 9, 18)

    @classmethod
    def span_shape(cls, lights, *, highlights=True, length_bits=LENGTH_BITS):
        """Normals at the first pixel, the middle and the last pixel, and the length."""
        return span_normals_shape(length_bits, middle=True)

    def __init__(self, parameters: ChordInterpolator, lights: int, **options):
        super().__init__(parameters, lights, **options)
        self._values = ChordValuesUnit(
            None,
            lights,
            initiation_interval=self.setup_interval // 3,
            highlights=self.highlights,
        )
        self._limit = SpanLimitUnit(highlights=self.highlights)
        self._spans = ChordSpansUnit(
            parameters,
            lights,
            initiation_interval=self.setup_interval,
            highlights=self.highlights,
            length_bits=self.length_bits,
            gate=self.gate,
        )
        units = self._values, self._limit, self._spans
        self.multipliers = sum(unit.multipliers for unit in units)
        self.latency = 2 * (self.setup_interval // 3) + self._values.latency + self._spans.latency

    def further_members(self):
        """Exponent and flag of the span limit."""
        members = {"lights": light_vectors_shape(self.lights)}
        if self.highlights:
            members["exponent"] = unsigned(SpanLimit.EXPONENT_BITS)
        if self.takes_threshold:
            members["threshold"] = FixedShape(ValueGate.THRESHOLD_FORMAT)
        return {"wide": Out(1), "constants": In(data.StructLayout(members))}

    @property
    def light_vectors(self):
        """L and H of each light, of the constants."""
        return self.constants.lights

    @property
    def exponent(self):
        """The specular exponent, of the constants."""
        return self.constants.exponent if self.highlights else None

    @property
    def threshold(self):
        """The threshold of a lobe's table, of the constants."""
        return self.constants.threshold if self.takes_threshold else None

    def elaborate(self, platform):
        """Normals one after the other to the values; these, collected, to the spans."""
        m = Module()
        m.submodules.chord_values = values = self._values
        m.submodules.span_limit = limit = self._limit
        m.submodules.chord_spans = spans = self._spans
        tag = data.StructLayout({"place": unsigned(2), "length": unsigned(self.length_bits)})
        sent, collected = Signal(tag, name="sent"), Signal(tag, name="collected")
        accepted, taken = values.i.valid & values.i.ready, values.o.valid & values.o.ready
        # One beat more may wait in the skid buffer.
        m.d.comb += collected.eq(pass_beside(m, "tags", sent, accepted, taken, values.latency + 1))
        self._send(m, values, limit, sent)
        self._collect(m, values, limit, collected, spans)
        connect(m, spans.o, wiring.flipped(self.o))
        m.d.comb += [values.constants.eq(self.light_vectors), self.out_of_range.eq(spans.out_of_range)]
        if self.highlights:
            m.d.comb += limit.constants.eq(self.exponent)
        if "constants" in spans.signature.members:
            m.d.comb += spans.constants.eq(
                Value.cast(self.threshold) if self.takes_threshold else self.exponent
            )
        return m

    def _send(self, m: Module, values, limit, word) -> None:
        """Normals of a span: the first as the span is accepted, those that follow from registers."""
        span = self.i.payload
        right, middle = (
            Signal.like(normal, name=name, reset_less=True)
            for normal, name in ((span.normal_right, "right"), (span.normal_middle, "middle"))
        )
        length, following = Signal.like(span.length, name="length"), Signal(2, name="following")
        long, idle, last = Signal(), Signal(name="idle", init=1), Signal(name="last")
        m.d.comb += [
            # By bits: a comparison is a chain of carries.
            long.eq(span.length[2:].any() | span.length[:2].all()),
            self.i.ready.eq(idle & values.i.ready),
            # The limit is ready again as the last normal of a long span is sent, and never waits.
            limit.i.valid.eq(self.i.valid & idle & long & values.i.ready),
            limit.i.payload.normal_left.eq(span.normal_left),
            limit.i.payload.normal_right.eq(span.normal_right),
            limit.o.ready.eq(1),
            values.i.valid.eq(self.i.valid | ~idle),
        ]
        with m.If(idle):
            m.d.comb += [
                Value.cast(values.i.payload).eq(Value.cast(span.normal_left)),
                word.place.eq(Mux(long, _Place.LEFT, _Place.PIXEL)),
                word.length.eq(Mux(long, span.length, 1)),
            ]
        with m.Else():
            m.d.comb += [
                Value.cast(values.i.payload).eq(Mux(last, Value.cast(middle), Value.cast(right))),
                word.place.eq(Mux((length == 2) & ~last, _Place.PIXEL, following)),
                word.length.eq(Mux(length == 2, 1, length)),
            ]
        with m.If(idle):
            # Of the span that is accepted, and of any before it.
            m.d.sync += [
                Value.cast(right).eq(Value.cast(span.normal_right)),
                Value.cast(middle).eq(Value.cast(span.normal_middle)),
                length.eq(span.length),
            ]
        with m.If(values.i.valid & values.i.ready):
            with m.If(idle):
                several = span.length[1:].any()
                m.d.sync += [following.eq(Mux(several, _Place.RIGHT, _Place.PIXEL)), idle.eq(~several)]
            with m.Elif((following == _Place.RIGHT) & (length > 2)):
                m.d.sync += [following.eq(_Place.MIDDLE), last.eq(1)]
            with m.Else():
                m.d.sync += [following.eq(_Place.PIXEL), idle.eq(1), last.eq(0)]

    def _collect(self, m: Module, values, limit, word, spans) -> None:
        """Values of a pixel, or of three places, as a span; and the flag of wide spans."""
        left, right = (Signal.like(values.o.payload, name=f"values_{side}") for side in ("left", "right"))
        is_pixel, is_middle = word.place == _Place.PIXEL, word.place == _Place.MIDDLE
        complete = is_pixel | is_middle
        m.d.comb += [
            spans.i.valid.eq(values.o.valid & complete),
            spans.i.payload.length.eq(word.length),
            spans.long.eq(is_middle),
            values.o.ready.eq(spans.i.ready | ~complete),
        ]
        for place, side in ((_Place.LEFT, left), (_Place.RIGHT, right)):
            with m.If(values.o.valid & (word.place == place)):
                m.d.sync += side.eq(values.o.payload)
        given = spans.i.payload["values"]
        for i, light in enumerate(values.o.payload):
            for name in light.shape().members:
                three = Mux(is_pixel, light[name].as_value(), left[i][name].as_value())
                m.d.comb += [
                    given[i][name][0].as_value().eq(three),
                    given[i][name][1].eq(light[name]),
                    given[i][name][2].eq(right[i][name]),
                ]
        self._flag(m, spans, limit, values.o, word, left)

    def _flag(self, m: Module, spans, limit, values: stream.Interface, word, left) -> None:
        """Whether a span is wide, some cycles after it is complete: its angle, and where a highlight may be.

        Parameters
        ----------
        m : Module
            Module that gets the logic.
        spans, limit : wiring.Component
            Where complete spans go, and whose results there are in their order.
        values : stream.Interface
            Values of the normals.
        word, left : data.View
            What a normal is to its span, and the values at the first pixel.
        """
        p = self._limit.parameters
        # A result can be read two cycles after it is there.
        first = 2 * (self.setup_interval // 3) + self._values.latency
        wait = max(2, limit.latency + 2 - first)
        complete, flagged = Signal(wait, name="complete"), Signal(wait, name="flagged")
        fires = spans.i.valid & spans.i.ready & spans.long
        shown = fires & (spans.i.payload.length >= p.SHORTEST)
        m.d.sync += [complete.eq(Cat(fires, complete)), flagged.eq(Cat(shown, flagged))]
        limited = limit.o.payload.shape()(
            pass_beside(m, "limits", limit.o.payload, limit.o.valid, complete[-1], self._LIMITS_INSIDE)
        )
        lit = Const(0)
        if self.highlights:
            if self.takes_threshold:
                level = Signal(FixedShape(p.LEVEL_FORMAT), name="level", reset_less=True)
                m.d.sync += level.eq(self.threshold)
            else:
                level = octave_limit(m, "level", self.exponent, p.levels)
            lit = Cat(
                self._is_lit(m, f"{i}", values, word, first, light, level.as_value())
                for i, (first, light) in enumerate(zip(left, values.payload, strict=True))
            ).any()
            for k in range(wait - 2):
                later = Signal(name=f"lit_{k}")
                m.d.sync += later.eq(lit)
                lit = later
        wide_now = Signal()
        m.d.sync += wide_now.eq(flagged[-1] & (limited.wide | (limited.wide_if_lit & lit)))
        m.d.comb += self.wide.eq(wide_now)

    _LIMITS_INSIDE = 8
    """Results of the limit that wait at most for the values of their spans."""

    def _is_lit(self, m: Module, name: str, values: stream.Interface, word, first, light, level) -> Value:
        """Whether a light is not behind a span and may have a highlight there, two cycles after its values.

        `SpanLimit.least` is the least of ``2 l``, ``2 r`` and ``2 m - |l - r|``, l, r and m being u at the first
        pixel, the last and in the middle, which come in this order.
        """
        taken = values.valid & values.ready
        now, first = light.highlight.as_value(), first.highlight.as_value()
        behind = self._limit.parameters.BEHIND.codes.item()
        fronts, unders = (Signal(3, name=f"{kind}_{name}") for kind in ("fronts", "unders"))
        slope = Signal(signed(len(now) + 1), name=f"slope_{name}", reset_less=True)
        excess = Signal(signed(max(len(now), len(level)) + 2), name=f"excess_{name}", reset_less=True)
        lit, front = Signal(name=f"bright_{name}"), Signal(name=f"front_{name}")
        with m.If(taken):
            m.d.sync += [
                fronts.eq(Cat(light.diffuse.as_value() >= behind, fronts)),
                unders.eq(Cat((now << 1) < level, unders)),
                excess.eq((now << 1) - level),
            ]
        with m.If(values.valid & (word.place == _Place.RIGHT)):
            m.d.sync += slope.eq(first - now)
        m.d.sync += [
            front.eq(fronts.any()),
            lit.eq(unders[1:].any() | (excess - slope < 0) | (excess + slope < 0)),
        ]
        return front & lit
