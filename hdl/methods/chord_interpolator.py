"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

import enum
from collections.abc import Iterable, Sequence

from amaranth.hdl import Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import connect, connect_slice, pass_beside
from blysk.hdl.cosines.chord_values import ChordValuesUnit
from blysk.hdl.cosines.span_limit import SpanLimitUnit, octave_limit
from blysk.hdl.methods.chord_spans import ChordSpansUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["ChordInterpolatorUnit"]


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
            ChordValues(parameters.scale),
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
