"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

import enum
from collections.abc import Iterable, Sequence

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import FIFO_LATENCY, connect, connect_slice, pass_beside
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape, span_operands_shape
from blysk.hdl.cosines.chord_values import ChordValuesUnit, light_values_shape
from blysk.hdl.cosines.span_limit import SpanLimitUnit, octave_limit
from blysk.hdl.lighting.value_gate import ValueGateUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordInterpolatorUnit", "ChordSpansUnit"]


def least_highlight(m: Module, name: str, values: Sequence[FixedValue]) -> Value:
    """`SpanLimit.least` of three values of u, two cycles after them.

    Parameters
    ----------
    m : Module
        Module that gets the registers.
    name : str
        Common part of their names.
    values : sequence of FixedValue
        u at the first pixel, in the middle and at the last pixel.
    """
    left, middle, right = (value.as_value() for value in values)
    smaller = Signal.like(left, name=f"smaller_{name}", reset_less=True)
    bulge = Signal(signed(len(left) + 2), name=f"bulge_{name}", reset_less=True)
    m.d.sync += [smaller.eq(Mux(left < right, left, right)), bulge.eq(left + right - (middle << 1))]
    least = (smaller << 1) - Mux(bulge > 0, bulge, 0)
    result = Signal.like(least, name=f"least_{name}", reset_less=True)
    m.d.sync += result.eq(least)
    return result


class ChordAccumulatorUnit(AccumulatorUnit):
    """``N . L`` and u of each light, two quadratics a light; see `AccumulatorUnit`.

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
    factors : sequence of int
        Lights that fade, which have a quadratic more.
    """

    def __init__(
        self,
        parameters: ChordInterpolator,
        lights: int,
        *,
        highlights: bool = True,
        gated: bool = False,
        factors: Sequence[int] = (),
    ):
        self.parameters = p = parameters
        self.gated, self.factors = gated, tuple(factors)
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        span = {
            "start": light_values_shape(lights, highlights=highlights),
            "lights": chord_differences_shape(lights, highlights, p.setup)["lights"].shape,
            "length": unsigned(LENGTH_BITS),
        }
        if gated:
            span["lit"] = unsigned(lights)
        if self.factors:
            count = len(self.factors)
            differences = chord_differences_shape(lights, highlights, p.setup, count)
            span["factors"] = differences["factors"].shape
            span["factor_start"] = data.ArrayLayout(FixedShape(p.setup.DIFFUSE_FORMAT), count)
        output = operands_shape(p, lights, highlights=highlights, gated=gated, factored=bool(self.factors))
        super().__init__(data.StructLayout(span), output)

    def carried(self, values):
        """The decision of each light."""
        if self.gated:
            for index, light in enumerate(values):
                yield ~self.i.payload.lit[index], light.gated

    def quadratics(self, values):
        """Those of each light."""
        span = self.i.payload
        for index, (start, light) in enumerate(zip(span.start, span.lights, strict=True)):
            result = values[index]
            for name in self.functions:
                words = start[name], light[name].first, light[name].second
                value = result["cosine" if name == "diffuse" else name]
                yield f"{name}_{index}", self.parameters.accumulators[name], words, value
        for index, light in enumerate(self.factors):
            words = span.factor_start[index], span.factors[index].first, span.factors[index].second
            yield f"factor_{light}", self.parameters.accumulators["factor"], words, values[light].factor


class ChordSpansUnit(wiring.Component):
    """Values of spans in, the operands of their pixels out: chord setup, then accumulators.

    A span of three pixels or more goes through the setup, and its start past it through a FIFO; a span of one
    pixel through the FIFO alone. So short spans take a cycle each, and wait only for those before them.

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
    factors : sequence of int
        Lights that fade.

    Members
    -------
    i : :py:`In(stream.Signature(span_operands_shape(lights, highlights, length_bits, len(factors))))`
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
        factors: Sequence[int] = (),
    ):
        self._gate = gate
        self._factors = len(factors)
        self._setup = ChordSetupUnit(
            parameters.setup,
            lights,
            initiation_interval=initiation_interval,
            length_bits=length_bits,
            highlights=highlights,
            factors=self._factors,
        )
        self.multipliers = self._setup.multipliers
        gated = gate is not None
        self._accumulator = ChordAccumulatorUnit(
            parameters, lights, highlights=highlights, gated=gated, factors=factors
        )
        self.latency = self._setup.latency + self._accumulator.latency
        waits = FIFO_LATENCY + (gate.latency if gate else 0)
        self.short_latency = waits + self._accumulator.latency
        span = span_operands_shape(lights, highlights, length_bits, self._factors)
        super().__init__(
            {
                "i": In(stream.Signature(span)),
                "long": In(1),
                "o": Out(stream.Signature(self._accumulator.o.payload.shape())),
                "out_of_range": Out(1),
            }
            | (gate.ports if gated else {})
        )

    def elaborate(self, platform):
        """FIFO of starts beside the setup, and the accumulators."""
        m = Module()
        m.submodules.chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        span = self.i.payload
        functions = span["values"][0].shape().members
        joined = accumulator.i
        start = {"start": joined.payload.start.shape(), "length": span.length.shape(), "long": 1}
        if self._factors:
            start["factor_start"] = joined.payload.factor_start.shape()
        start_shape = data.StructLayout(start)
        # As many starts as may follow a span that has just begun its setup, or come before it: its values may
        # take an interval, in which none comes.
        depth = setup.latency + setup.initiation_interval + FIFO_LATENCY + 1
        m.submodules.starts = starts = fifo.SyncFIFOBuffered(width=start_shape.size, depth=depth)
        decided, gate_ready = Signal(init=1), Signal(init=1)
        if self._gate is not None:
            self._decide(m, joined, starts, decided, gate_ready)
        else:
            m.d.comb += [decided.eq(1), gate_ready.eq(1)]
        given, taken = Signal(start_shape, name="given"), Signal(start_shape, name="taken")
        # A register, so that no comparison of the level is between the handshakes.
        room = Signal(name="room", init=1)
        m.d.sync += room.eq(starts.level < depth - 1)
        m.d.comb += [
            given.length.eq(span.length),
            given.long.eq(self.long),
            *(
                given.start[i][name].eq(values[name][0])
                for i, values in enumerate(span["values"])
                for name in functions
            ),
            starts.w_data.eq(given),
            starts.w_en.eq(self.i.valid & gate_ready & room & (setup.i.ready | ~given.long)),
            setup.i.payload.eq(span),
            setup.i.valid.eq(self.i.valid & gate_ready & room & given.long),
            self.i.ready.eq(room & gate_ready & (setup.i.ready | ~given.long)),
            taken.eq(starts.r_data),
            joined.payload.start.eq(taken.start),
            joined.payload.length.eq(taken.length),
            joined.payload.lights.eq(setup.o.payload.lights),
            joined.valid.eq(starts.r_rdy & decided & (setup.o.valid | ~taken.long)),
            starts.r_en.eq(joined.ready & decided & (setup.o.valid | ~taken.long)),
            setup.o.ready.eq(joined.ready & starts.r_rdy & decided & taken.long),
            self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range),
        ]
        for index in range(self._factors):
            m.d.comb += [
                given.factor_start[index].eq(span.factors[index][0]),
                joined.payload.factor_start[index].eq(taken.factor_start[index]),
            ]
        if self._factors:
            m.d.comb += joined.payload.factors.eq(setup.o.payload.factors)
        connect(m, accumulator.o, wiring.flipped(self.o))
        return m

    def _decide(self, m: Module, joined: stream.Interface, starts, decided: Value, ready: Value) -> None:
        """The gate beside the setup: a span waits for its decision."""
        m.submodules.value_gate = gate = self._gate
        lights = len(gate.o.payload)
        m.submodules.decisions = decisions = fifo.SyncFIFOBuffered(width=lights, depth=starts.depth)
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
            decided.eq(decisions.r_rdy),
            decisions.r_en.eq(starts.r_en & starts.r_rdy),
            joined.payload.lit.eq(decisions.r_data),
        ]
        if gate.ports:
            m.d.comb += gate.constants.eq(self.constants)


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
        right, middle = Signal.like(span.normal_right), Signal.like(span.normal_middle)
        length, following = Signal.like(span.length), Signal(2)
        long = Signal()
        idle = following == _Place.PIXEL
        takes = Signal()
        m.d.comb += [
            # By bits: a comparison is a chain of carries.
            long.eq(span.length[2:].any() | span.length[:2].all()),
            # The limit is ready again before the last normal of a long span is sent.
            takes.eq(values.i.ready & limit.i.ready),
            self.i.ready.eq(idle & takes),
            limit.i.valid.eq(self.i.valid & idle & long & values.i.ready),
            limit.i.payload.normal_left.eq(span.normal_left),
            limit.i.payload.normal_right.eq(span.normal_right),
            values.i.valid.eq(Mux(idle, self.i.valid & limit.i.ready, 1)),
        ]
        with m.If(idle):
            m.d.comb += [
                Value.cast(values.i.payload).eq(Value.cast(span.normal_left)),
                word.place.eq(Mux(long, _Place.LEFT, _Place.PIXEL)),
                word.length.eq(Mux(long, span.length, 1)),
            ]
        with m.Else():
            last = following == _Place.MIDDLE
            m.d.comb += [
                Value.cast(values.i.payload).eq(Mux(last, Value.cast(middle), Value.cast(right))),
                word.place.eq(Mux((length == 2) & ~last, _Place.PIXEL, following)),
                word.length.eq(Mux(length == 2, 1, length)),
            ]
        with m.If(values.i.valid & values.i.ready):
            with m.If(idle):
                m.d.sync += [
                    Value.cast(right).eq(Value.cast(span.normal_right)),
                    Value.cast(middle).eq(Value.cast(span.normal_middle)),
                    length.eq(span.length),
                    following.eq(Mux(span.length[1:].any(), _Place.RIGHT, _Place.PIXEL)),
                ]
            with m.Elif((following == _Place.RIGHT) & (length > 2)):
                m.d.sync += following.eq(_Place.MIDDLE)
            with m.Else():
                m.d.sync += following.eq(_Place.PIXEL)

    def _collect(self, m: Module, values, limit, word, spans) -> None:
        """Values of a pixel, or of three places, as a span; and the flag of wide spans."""
        limited = limit.o
        if self.setup_interval > limit.initiation_interval:
            # Its result is there before the middle values, and must not keep the next span out.
            limited = limit.o.signature.create(path=("limited",))
            connect_slice(m, limit.o, limited)
        left, right = (Signal.like(values.o.payload, name=f"values_{side}") for side in ("left", "right"))
        is_pixel, is_middle = word.place == _Place.PIXEL, word.place == _Place.MIDDLE
        complete = Signal()
        m.d.comb += [
            complete.eq(is_pixel | (is_middle & limited.valid)),
            spans.i.valid.eq(values.o.valid & complete),
            spans.i.payload.length.eq(word.length),
            spans.long.eq(is_middle),
            values.o.ready.eq(Mux(is_pixel | is_middle, complete & spans.i.ready, 1)),
            limited.ready.eq(values.o.valid & is_middle & spans.i.ready),
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
        # Of long spans, whose first value is in its register.
        self._flag(m, spans.i, limited.payload, zip(left, values.o.payload, right, strict=True))

    def _flag(self, m: Module, spans: stream.Interface, limited: data.View, places: Iterable) -> None:
        """Whether a span is wide, as it is complete: its angle, and where a highlight may be.

        Parameters
        ----------
        m : Module
            Module that gets the logic.
        spans : stream.Interface
            Complete spans.
        limited : data.View
            Output of the span limit.
        places : iterable of tuple of data.View
            Of each light the values at the first pixel, in the middle and at the last pixel.
        """
        p = self._limit.parameters
        wide, wide_if_lit = Signal(2), Signal(2)
        long = spans.payload.length >= p.SHORTEST
        fires = spans.valid & spans.ready & long
        m.d.sync += [
            wide.eq(Cat(fires & limited.wide, wide[0])),
            wide_if_lit.eq(Cat(fires & limited.wide_if_lit, wide_if_lit[0])),
        ]
        lit = []
        if self.highlights:
            if self.takes_threshold:
                level = Signal(FixedShape(p.LEVEL_FORMAT), name="level", reset_less=True)
                m.d.sync += level.eq(self.threshold)
            else:
                level = octave_limit(m, "level", self.exponent, p.levels)
            for i, light in enumerate(places):
                front = Signal(2, name=f"front_{i}")
                behind = p.BEHIND.codes.item()
                now = Cat(at.diffuse.as_value() >= behind for at in light).any()
                m.d.sync += front.eq(Cat(now, front[0]))
                least = least_highlight(m, f"{i}", [at.highlight for at in light])
                lit.append(front[1] & (least < level.as_value()))
        wide_now = Signal()
        m.d.sync += wide_now.eq(wide[1] | (wide_if_lit[1] & Cat(lit).any()))
        m.d.comb += self.wide.eq(wide_now)
