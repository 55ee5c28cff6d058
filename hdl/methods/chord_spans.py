"""Spans of values to the operands of their pixels: what the chord methods share."""

from collections.abc import Sequence

from amaranth.hdl import Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import FIFO_LATENCY, connect
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape, span_operands_shape
from blysk.hdl.cosines.chord_values import light_values_shape
from blysk.hdl.lighting.value_gate import ValueGateUnit
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordSpansUnit"]


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
