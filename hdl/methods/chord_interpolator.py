"""The chord method: forward differences of N·L and of half the squared chord from N to H."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, enum, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.span_limit import SpanLimit
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.shapes import span_normals_shape
from blysk.hdl.core.stream import FIFO_LATENCY, SLICE_LATENCY, connect, connect_slice
from blysk.hdl.cosines.chord_setup import ChordSetupUnit, chord_differences_shape, span_values_shape
from blysk.hdl.cosines.chord_values import ChordValuesUnit, light_values_shape
from blysk.hdl.cosines.span_limit import SpanLimitUnit, octave_limit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.light_products import operands_shape
from blysk.hdl.normals.difference_accumulator import AccumulatorUnit

__all__ = ["ChordAccumulatorUnit", "ChordInterpolatorUnit", "ChordSpansUnit"]


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
    """

    def __init__(self, parameters: ChordInterpolator, lights: int, *, highlights: bool = True):
        self.parameters = p = parameters
        self.functions = ("diffuse", "highlight") if highlights else ("diffuse",)
        super().__init__(
            data.StructLayout(
                {
                    "start": light_values_shape(lights, highlights=highlights),
                    "lights": chord_differences_shape(lights, highlights, p.setup)["lights"].shape,
                    "length": unsigned(LENGTH_BITS),
                }
            ),
            operands_shape(p, lights, highlights=highlights),
        )

    def quadratics(self, values):
        """Those of each light."""
        span = self.i.payload
        for index, (start, light) in enumerate(zip(span.start, span.lights, strict=True)):
            result = values[index]
            for name in self.functions:
                words = start[name], light[name].first, light[name].second
                value = result["cosine" if name == "diffuse" else name]
                yield f"{name}_{index}", self.parameters.accumulators[name], words, value


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

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"values": span_values_shape(...), "length": length_bits})))`
        Spans of one pixel, of which the first value counts, or of three and more.
    o : :py:`Out(stream.Signature(operands_shape(parameters, lights, highlights=highlights)))`
        Operands of the pixels.
    out_of_range : :py:`Out(1)`
        High for one cycle for each span with a word that does not fit.

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
    ):
        self._setup = ChordSetupUnit(
            parameters.setup,
            lights,
            initiation_interval=initiation_interval,
            length_bits=length_bits,
            highlights=highlights,
        )
        self.multipliers = self._setup.multipliers
        self._accumulator = ChordAccumulatorUnit(parameters, lights, highlights=highlights)
        self.latency = self._setup.latency + SLICE_LATENCY + self._accumulator.latency
        self.short_latency = FIFO_LATENCY + SLICE_LATENCY + self._accumulator.latency
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
                "o": Out(stream.Signature(operands_shape(parameters, lights, highlights=highlights))),
                "out_of_range": Out(1),
            }
        )

    def elaborate(self, platform):
        """FIFO of starts beside the setup; a register slice before the accumulators."""
        m = Module()
        m.submodules.chord_setup = setup = self._setup
        m.submodules.chord_accumulator = accumulator = self._accumulator
        span = self.i.payload
        functions = span["values"][0].shape().members
        joined = stream.Signature(accumulator.i.payload.shape()).create(path=("joined",))
        start_shape = data.StructLayout(
            {"start": joined.payload.start.shape(), "length": span.length.shape(), "long": 1}
        )
        # As many starts as may follow a span that has just begun its setup.
        m.submodules.starts = starts = fifo.SyncFIFOBuffered(
            width=start_shape.size, depth=setup.latency + FIFO_LATENCY
        )
        given, taken = Signal(start_shape, name="given"), Signal(start_shape, name="taken")
        m.d.comb += [
            given.length.eq(span.length),
            given.long.eq(span.length > 1),
            *(
                given.start[i][name].eq(values[name][0])
                for i, values in enumerate(span["values"])
                for name in functions
            ),
            starts.w_data.eq(given),
            starts.w_en.eq(self.i.valid & (setup.i.ready | ~given.long)),
            setup.i.payload.eq(span),
            setup.i.valid.eq(self.i.valid & starts.w_rdy & given.long),
            self.i.ready.eq(starts.w_rdy & (setup.i.ready | ~given.long)),
            taken.eq(starts.r_data),
            joined.payload.start.eq(taken.start),
            joined.payload.length.eq(taken.length),
            joined.payload.lights.eq(setup.o.payload.lights),
            joined.valid.eq(starts.r_rdy & (setup.o.valid | ~taken.long)),
            starts.r_en.eq(joined.ready & (setup.o.valid | ~taken.long)),
            setup.o.ready.eq(joined.ready & starts.r_rdy & taken.long),
            self.out_of_range.eq(setup.o.valid & setup.o.ready & setup.o.payload.out_of_range),
        ]
        connect_slice(m, joined, accumulator.i)
        connect(m, accumulator.o, wiring.flipped(self.o))
        return m


class _Place(enum.Enum, shape=2):
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
    attribute ``multipliers`` tells how many there are: 10 for one light and an interval of 3.

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
    exponent : :py:`In(10)`
        Specular exponent for `SpanLimit`; only with highlights.
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
        )
        units = self._values, self._limit, self._spans
        self.multipliers = sum(unit.multipliers for unit in units)
        self.latency = 2 * (self.setup_interval // 3) + self._values.latency + self._spans.latency

    @classmethod
    def further_members(cls, highlights):
        """Exponent and flag of the span limit."""
        exponent = {"exponent": In(SpanLimit.EXPONENT_BITS)} if highlights else {}
        return {"wide": Out(1)} | exponent

    def elaborate(self, platform):
        """Normals one after the other to the values; these, collected, to the spans."""
        m = Module()
        m.submodules.chord_values = values = self._values
        m.submodules.span_limit = limit = self._limit
        m.submodules.chord_spans = spans = self._spans
        tag = data.StructLayout({"place": _Place, "length": unsigned(self.length_bits)})
        m.submodules.tags = tags = fifo.SyncFIFOBuffered(width=tag.size, depth=values.latency + FIFO_LATENCY)
        self._send(m, values, limit, tags, tag)
        self._collect(m, values, limit, tags, tag, spans)
        connect(m, spans.o, wiring.flipped(self.o))
        m.d.comb += [values.constants.eq(self.constants), self.out_of_range.eq(spans.out_of_range)]
        if self.highlights:
            m.d.comb += limit.constants.eq(self.exponent)
        return m

    def _send(self, m: Module, values, limit, tags, tag) -> None:
        """Normals of a span: the first as the span is accepted, those that follow from registers."""
        span = self.i.payload
        right, middle = Signal.like(span.normal_right), Signal.like(span.normal_middle)
        length, following = Signal.like(span.length), Signal(_Place)
        word, long = Signal(tag, name="word"), Signal()
        idle = following == _Place.PIXEL
        takes, sends = Signal(), Signal()
        m.d.comb += [
            long.eq(span.length > 2),
            takes.eq(values.i.ready & tags.w_rdy & (limit.i.ready | ~long)),
            self.i.ready.eq(idle & takes),
            limit.i.valid.eq(self.i.valid & idle & long & values.i.ready & tags.w_rdy),
            limit.i.payload.normal_left.eq(span.normal_left),
            limit.i.payload.normal_right.eq(span.normal_right),
            sends.eq(Mux(idle, self.i.valid & (limit.i.ready | ~long), 1)),
            values.i.valid.eq(sends & tags.w_rdy),
            tags.w_en.eq(sends & values.i.ready),
            tags.w_data.eq(word),
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
                    following.eq(Mux(span.length > 1, _Place.RIGHT, _Place.PIXEL)),
                ]
            with m.Elif((following == _Place.RIGHT) & (length > 2)):
                m.d.sync += following.eq(_Place.MIDDLE)
            with m.Else():
                m.d.sync += following.eq(_Place.PIXEL)

    def _collect(self, m: Module, values, limit, tags, tag, spans) -> None:
        """Values of a pixel, or of three places, as a span; and the flag of wide spans."""
        word = Signal(tag, name="collected")
        left, right = (Signal.like(values.o.payload, name=f"values_{side}") for side in ("left", "right"))
        is_pixel, is_middle = word.place == _Place.PIXEL, word.place == _Place.MIDDLE
        complete = Signal()
        m.d.comb += [
            word.eq(tags.r_data),
            complete.eq(is_pixel | (is_middle & limit.o.valid)),
            spans.i.valid.eq(values.o.valid & tags.r_rdy & complete),
            spans.i.payload.length.eq(word.length),
            values.o.ready.eq(tags.r_rdy & Mux(is_pixel | is_middle, complete & spans.i.ready, 1)),
            tags.r_en.eq(values.o.valid & values.o.ready),
            limit.o.ready.eq(values.o.valid & tags.r_rdy & is_middle & spans.i.ready),
        ]
        for place, side in ((_Place.LEFT, left), (_Place.RIGHT, right)):
            with m.If(values.o.valid & tags.r_rdy & (word.place == place)):
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
        self._flag(m, spans.i, limit)

    def _flag(self, m: Module, spans: stream.Interface, limit: SpanLimitUnit) -> None:
        """Whether a span is wide, as it is complete: its angle, and whether a light may have a highlight there."""
        p, given = limit.parameters, spans.payload["values"]
        wide, wide_if_lit = Signal(), Signal()
        long = spans.payload.length >= p.SHORTEST
        fires = spans.valid & spans.ready & long
        m.d.sync += [
            wide.eq(fires & limit.o.payload.wide),
            wide_if_lit.eq(fires & limit.o.payload.wide_if_lit),
        ]
        lit = []
        if self.highlights:
            level = octave_limit(m, "level", self.exponent, p.levels)
            for i, light in enumerate(given):
                u_left, u_middle, u_right = (light.highlight[k] for k in range(3))
                ends, twice = Signal.like(u_left + u_right), Signal.like(u_middle.scale(1))
                smaller, front = Signal.like(u_left), Signal(name=f"front_{i}")
                m.d.sync += [
                    Value.cast(ends).eq(Value.cast(u_left + u_right)),
                    Value.cast(twice).eq(Value.cast(u_middle.scale(1))),
                    Value.cast(smaller).eq(
                        Mux(
                            Value.cast(u_left) < Value.cast(u_right),
                            Value.cast(u_left),
                            Value.cast(u_right),
                        )
                    ),
                    front.eq(Cat(Value.cast(f) >= p.BEHIND.codes.item() for f in light.diffuse).any()),
                ]
                bulge = Value.cast(ends) - Value.cast(twice)
                least = (Value.cast(smaller) << 1) - Mux(bulge > 0, bulge, 0)
                lit.append(front & (least < Value.cast(level)))
        wide_now = Signal()
        m.d.sync += wide_now.eq(wide | (wide_if_lit & Cat(lit).any()))
        m.d.comb += self.wide.eq(wide_now)
