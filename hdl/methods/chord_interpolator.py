"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

import enum

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.chord_values import ChordValues
from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.lighting.value_gate import ValueGate
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.shapes import light_vectors_shape, span_normals_shape
from blysk.hdl.core.stream import connect, pass_beside
from blysk.hdl.cosines.chord_values import ChordValuesUnit
from blysk.hdl.cosines.span_limit import SpanLimitUnit, octave_limit
from blysk.hdl.methods.chord_spans import ChordSpansUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit

__all__ = ["ChordInterpolatorUnit"]


class _Place(enum.IntEnum):
    """Place of a normal in its span: that of a pixel, or one of the three of a longer span.

    Upper bit: the span is not complete with this normal. Lower bit, of a complete span: it is long.
    """

    PIXEL = 0
    MIDDLE = 1
    LEFT = 2
    RIGHT = 3


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
        L and H of each light; with highlights the specular exponent, for `SpanLimit`; with tables a
        threshold. Constant while spans are inside.
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
        """L and H of each light, from the constants."""
        return self.constants.lights

    @property
    def exponent(self):
        """The specular exponent, from the constants."""
        return self.constants.exponent if self.highlights else None

    @property
    def threshold(self):
        """The threshold of a lobe's table, from the constants."""
        return self.constants.threshold if self.takes_threshold else None

    def elaborate(self, platform):
        """Normals one after the other to the chord values; the values, collected, to the spans."""
        m = Module()
        m.submodules.chord_values = values = self._values
        m.submodules.span_limit = limit = self._limit
        m.submodules.chord_spans = spans = self._spans
        tag = data.StructLayout({"place": unsigned(2), "length": unsigned(self.length_bits)})
        sent, collected = Signal(tag, name="sent"), Signal(tag, name="collected")
        accepted, taken = values.i.valid & values.i.ready, values.o.valid & values.o.ready
        entered, kept = Signal(name="entered"), Signal(tag, name="kept", reset_less=True)
        m.d.sync += [entered.eq(accepted), kept.eq(sent)]
        # One beat more may wait in the skid buffer.
        m.d.comb += collected.eq(pass_beside(m, "tags", kept, entered, taken, values.latency + 1))
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
        """Normals of a span: the first as the span is accepted, the others from registers."""
        span = self.i.payload
        right, middle = (
            Signal.like(normal, name=name, reset_less=True)
            for normal, name in ((span.normal_right, "right"), (span.normal_middle, "middle"))
        )
        length, following = Signal.like(span.length, name="length"), Signal(2, name="following")
        long, idle, last = Signal(), Signal(name="idle", init=1), Signal(name="last")
        is_long = Signal(name="is_long", reset_less=True)
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
                word.place.eq(Mux(is_long, following, _Place.PIXEL)),
                word.length.eq(Mux(is_long, length, 1)),
            ]
        with m.If(idle):
            # Loaded on every idle cycle: the span that is accepted overwrites those that were not.
            m.d.sync += [
                Value.cast(right).eq(Value.cast(span.normal_right)),
                Value.cast(middle).eq(Value.cast(span.normal_middle)),
                length.eq(span.length),
                is_long.eq(long),
            ]
        with m.If(values.i.valid & values.i.ready):
            with m.If(idle):
                several = span.length[1:].any()
                m.d.sync += [following.eq(Mux(several, _Place.RIGHT, _Place.PIXEL)), idle.eq(~several)]
            with m.Elif((following == _Place.RIGHT) & is_long):
                m.d.sync += [following.eq(_Place.MIDDLE), last.eq(1)]
            with m.Else():
                m.d.sync += [following.eq(_Place.PIXEL), idle.eq(1), last.eq(0)]

    def _collect(self, m: Module, values, limit, word, spans) -> None:
        """Values of a pixel, or of three places, as a span; and the flag of wide spans."""
        left, right = (Signal.like(values.o.payload, name=f"values_{side}") for side in ("left", "right"))
        is_middle = word.place[0]
        complete = ~word.place[1]
        m.d.comb += [
            spans.i.valid.eq(values.o.valid & complete),
            spans.i.payload.length.eq(word.length),
            # Read only with a complete span.
            spans.long.eq(is_middle),
            values.o.ready.eq(spans.i.ready | ~complete),
        ]
        for place, side in ((_Place.LEFT, left), (_Place.RIGHT, right)):
            with m.If(values.o.valid & (word.place == place)):
                m.d.sync += side.eq(values.o.payload)
        given = spans.i.payload["values"]
        for i, light in enumerate(values.o.payload):
            for name in light.shape().members:
                three = Mux(is_middle, left[i][name].as_value(), light[name].as_value())
                m.d.comb += [
                    given[i][name][0].as_value().eq(three),
                    given[i][name][1].eq(light[name]),
                    given[i][name][2].eq(right[i][name]),
                ]
        self._flag(m, spans, limit, values.o, word, left)

    def _flag(self, m: Module, spans, limit, values: stream.Interface, word, left) -> None:
        """Whether a span is wide, some cycles after it is complete: by its angle, and its highlights.

        Parameters
        ----------
        m : Module
            Module that gets the logic.
        spans, limit : wiring.Component
            The unit that complete spans go to, and the span limit, whose results come in their order.
        values : stream.Interface
            Values of the normals.
        word, left : data.View
            Place of a normal in its span, and the values at the first pixel.
        """
        p = self._limit.parameters
        # A result can be read two cycles after it is there.
        first = 2 * (self.setup_interval // 3) + self._values.latency
        wait = max(3, limit.latency + 2 - first)
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
            for k in range(wait - 3):
                later = Signal(name=f"lit_{k}")
                m.d.sync += later.eq(lit)
                lit = later
        wide_now = Signal()
        m.d.sync += wide_now.eq(flagged[-1] & (limited.wide | (limited.wide_if_lit & lit)))
        m.d.comb += self.wide.eq(wide_now)

    _LIMITS_INSIDE = 8
    """Largest number of results of the limit that wait for the values of their spans."""

    def _is_lit(self, m: Module, name: str, values: stream.Interface, word, first, light, level) -> Value:
        """Whether a light is not behind a span and may have a highlight there, three cycles after it.

        `SpanLimit.least` is the least of ``2 l``, ``2 r`` and ``2 m - |l - r|``, where l, r and m are u at
        the first pixel, the last and in the middle, which come in this order.
        """
        taken, right = Signal(name=f"taken_{name}"), Signal(name=f"right_{name}")
        held = Signal.like(light, name=f"light_{name}", reset_less=True)
        m.d.sync += [
            taken.eq(values.valid & values.ready),
            right.eq(values.valid & (word.place == _Place.RIGHT)),
            held.eq(light),
        ]
        now, first = held.highlight.as_value(), first.highlight.as_value()
        behind = self._limit.parameters.BEHIND.codes.item()
        fronts, unders = (Signal(3, name=f"{kind}_{name}") for kind in ("fronts", "unders"))
        slope = Signal(signed(len(now) + 1), name=f"slope_{name}", reset_less=True)
        excess = Signal(signed(max(len(now), len(level)) + 2), name=f"excess_{name}", reset_less=True)
        lit, front = Signal(name=f"bright_{name}"), Signal(name=f"front_{name}")
        with m.If(taken):
            m.d.sync += [
                fronts.eq(Cat(held.diffuse.as_value() >= behind, fronts)),
                unders.eq(Cat((now << 1) < level, unders)),
                excess.eq((now << 1) - level),
            ]
        with m.If(right):
            m.d.sync += slope.eq(first - now)
        m.d.sync += [
            front.eq(fronts.any()),
            lit.eq(unders[1:].any() | (excess - slope < 0) | (excess + slope < 0)),
        ]
        return front & lit
