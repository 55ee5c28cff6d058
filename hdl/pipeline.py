"""The shading pipeline: raster spans in, pixels out, one a clock."""

from functools import reduce
from operator import and_

from amaranth.hdl import Module, Mux, Shape, Signal, Value, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.power import Power
from blysk.golden.methods.angular_interpolator import AngularInterpolator
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.interpolator import Interpolator, NormalInterpolator
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.pipeline import Design
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.stream import FIFO_LATENCY, connect, connect_fifo
from blysk.hdl.cosines.local_chord_setup import span_values_shape
from blysk.hdl.frame_constants import FrameConstantsUnit, write_shape
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.specular import SlopeUnit, SpecularUnit
from blysk.hdl.methods.angular_interpolator import AngularInterpolatorUnit
from blysk.hdl.methods.bisection_interpolator import BisectionInterpolatorUnit
from blysk.hdl.methods.chord_interpolator import ChordInterpolatorUnit
from blysk.hdl.methods.interpolator import InterpolatorUnit
from blysk.hdl.methods.linear_interpolator import LinearInterpolatorUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.hdl.methods.quadratic_interpolator import QuadraticInterpolatorUnit
from blysk.hdl.methods.recurrence_interpolator import RecurrenceInterpolatorUnit
from blysk.hdl.pixel_assembler import PixelAssemblerUnit, coordinates_shape, pixel_shape

__all__ = [
    "INTERPOLATORS",
    "PORT_DESCRIPTIONS",
    "ShadingPipelineUnit",
    "span_shape",
    "status_shape",
]

INTERPOLATORS: dict[type[Interpolator], type[InterpolatorUnit]] = {
    AngularInterpolator: AngularInterpolatorUnit,
    BisectionInterpolator: BisectionInterpolatorUnit,
    ChordInterpolator: ChordInterpolatorUnit,
    LinearInterpolator: LinearInterpolatorUnit,
    LocalChordInterpolator: LocalChordInterpolatorUnit,
    QuadraticInterpolator: QuadraticInterpolatorUnit,
    RecurrenceInterpolator: RecurrenceInterpolatorUnit,
}
"""Unit of each method, by its twin."""

PORT_DESCRIPTIONS = {
    "i_x": "first pixel of the span, column",
    "i_y": "its row",
    "i_length": "pixels of the span; 0 gives none",
    "i_normal_left": "unit normal at the first pixel centre, times 2^17 - 1",
    "i_normal_right": "unit normal at the last pixel centre",
    "i_values": "codes of N.L and 1 - N.H of each light at the first pixel, the middle and the last pixel",
    "i_material": "index of the span's material",
    "o_x": "column of the pixel",
    "o_y": "row",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "last pixel of its span",
    "write_address": "frame constant to write, see above",
    "write_data": "its code; taken when no span is inside",
    "status_out_of_range_spans": "spans too wide for the method since reset, at most 65535",
    "status_empty_spans": "spans of length 0 since reset, at most 65535",
    "status_overrun": "a span went past the largest column",
}
"""What each port of the pipeline is, for the table in its Verilog."""


def span_shape(parameters: Design) -> data.StructLayout:
    """Shape of a raster span: first pixel, pixels, unit normals at the first and last pixel centre.

    Without lights there are no normals, and a method that takes values has them in their place; with several
    materials there is the index of its own, ``material``.
    """
    members = {
        "x": unsigned(parameters.x_bits),
        "y": unsigned(parameters.y_bits),
        "length": unsigned(parameters.length_bits),
    }
    if parameters.lights and parameters.takes_values:
        values = span_values_shape(parameters.lights, parameters.specular is not None)
        members["values"] = values.members["values"]
    elif parameters.lights:
        members |= {"normal_left": normal_shape(), "normal_right": normal_shape()}
    if parameters.materials > 1:
        members["material"] = Shape.cast(range(parameters.materials))
    return data.StructLayout(members)


def status_shape() -> data.StructLayout:
    """Shape of what the pipeline has counted since reset; counters stop at their largest value.

    ``out_of_range_spans``: spans too wide for the method, whose pixels are not to be trusted; counted when
    that is known, some cycles after they are taken. ``empty_spans``: spans of length 0. ``overrun``: whether
    a span has gone past the largest x, where x starts again at 0.
    """
    return data.StructLayout(
        {"out_of_range_spans": unsigned(16), "empty_spans": unsigned(16), "overrun": unsigned(1)}
    )


class ShadingPipelineUnit(wiring.Component):
    """Shades raster spans, with any method and any reflection model.

    An interpolator takes spans to the operands of their pixels; a light unit for each light takes these to
    terms, and the intensity unit to colours. The setup of the next spans overlaps the pixels of this one; a
    FIFO carries the spans' places round it. `Design` is the bit-true twin, and says
    what a pipeline may do without.

    The first pixel of a span leaves `latency` cycles after an idle pipeline has taken it. Without stalls each
    span then takes at most ``max(cycles_per_pixel length, setup_interval)`` cycles; two spans are held
    ready, so that a long one pays for short ones after it, but for a clock. (``bisection`` takes longer where
    it divides spans.) A span of length 0 is taken like any other and gives nothing.

    With a gate a highlight gate looks at each span beside the interpolator, and tells the light units which
    spans hold no highlight: their specular units stand still, or are passed by in the compact style. It takes
    spans as often as the setup does, and its answer is there before the span's first pixel, or that waits:
    a method whose setup is shorter than the gate, such as ``linear``, may take a clock more for short spans.

    Without lights there is neither interpolator nor multiplier; a span's pixels have the ambient colour.

    In the *compact* style one multiplier does the colours, one the specular terms of a light, two its
    products with a normal where there is one, and one or two the setup (as many as its longest interval
    needs). A pixel takes a clock a channel for each of its diffuse and specular terms that is not 0, at least
    one; and, where its light is in front and its span not dark, as many cycles as its specular model has
    products, a power 42. So what has no highlight costs less. The pixels are the same to the bit.
    ``cycles_per_pixel`` and ``latency`` are then those of a pixel with every term.

    A write is taken when no span is inside, and no span is taken while a write waits, so a frame's constants
    never change under a running span: ``i.ready`` falls on the clock on which ``write.valid`` rises, and
    rises 2 cycles after the last write was taken. For the same reason a span of another material than the one
    before it waits until no span is inside: it is taken 5 cycles after the last pixel has left, and its first
    pixel comes ``latency + 5`` cycles after that one, where without the change it comes 1 clock after. Sort
    spans by material.

    Parameters
    ----------
    parameters : Design
        Method, reflection model, numbers of lights and materials, and what is left out.

    Raises
    ------
    ValueError
        If the method is not built for the setup interval.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape(parameters)))`
        Spans.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants; see `FrameConstantsUnit` for the addresses.
    status : :py:`Out(status_shape())`
        Counters.

    Source: pipeline.md; [T] figure 4.10.
    """

    def __init__(self, parameters: Design | None = None):
        self.parameters = p = parameters or Design()
        style, setup_interval = p.build.style, p.build.setup_interval
        super().__init__(
            {
                "i": In(stream.Signature(span_shape(p))),
                "o": Out(stream.Signature(pixel_shape(p.x_bits, p.y_bits))),
                "write": In(stream.Signature(write_shape())),
                "status": Out(status_shape()),
            }
        )
        self._assembler = PixelAssemblerUnit(p.x_bits, p.y_bits, p.length_bits)
        self._interpolator, self._gate, self._slope, self._lights = None, None, None, []
        self.setup_interval = self.cycles_per_pixel = 1
        self.latency = FIFO_LATENCY + self._assembler.coordinates_latency
        if not p.lights:
            if setup_interval is not None:
                raise ValueError("without lights there is no setup, and no setup_interval")
            return
        method = INTERPOLATORS[type(p.interpolator)]
        served = method.setup_intervals(p.interpolator)
        if setup_interval not in (None, *served):
            choice = f"1 to {served[-1]}" if served else "left out"
            raise ValueError(f"setup_interval of {p.method} must be {choice}, not {setup_interval}")
        if style == "compact" and setup_interval is None and served:
            setup_interval = served[-1]
        options = {} if setup_interval is None else {"setup_interval": setup_interval}
        if style == "compact" and isinstance(p.interpolator, NormalInterpolator):
            # A pixel takes its channels' cycles at least.
            options["product_interval"] = p.intensity.channels
        self._interpolator = method(
            p.interpolator,
            p.lights,
            highlights=p.specular is not None,
            length_bits=p.length_bits,
            **options,
        )
        self.setup_interval = self._interpolator.setup_interval
        self._lights = self._light_units()
        self._intensity = (CompactIntensityUnit if style == "compact" else IntensityUnit)(p.intensity)
        if p.gate:
            interval = min(self.setup_interval, 3 + 12 * p.lights)
            self._gate = HighlightGateUnit(
                p.highlight_gate, p.lights, initiation_interval=interval, exponent=p.build.exponent
            )
        self.cycles_per_pixel = max(
            self._interpolator.cycles_per_pixel,
            options.get("product_interval", 1),
            self._lights[0].initiation_interval,
            self._intensity.initiation_interval,
        )
        chain = (self._interpolator, self._lights[0], self._intensity, self._assembler)
        self.latency = sum(unit.latency for unit in chain)
        if p.gate:
            # A FIFO before the gate, and one after it.
            decided = self._gate.latency + 2 * FIFO_LATENCY
            self.latency += max(decided - self._interpolator.latency, 0)

    @property
    def _waiting_spans(self) -> int:
        """Spans that wait beside the interpolator for their colours: as many as may be on the way at a time.

        17 are a memory of 16 words, and a register behind it.
        """
        return max(-(-self.latency // self.setup_interval), 17)

    def _light_units(self) -> list:
        """Diffuse units, or light units, which share what follows from the exponent."""
        p = self.parameters
        compact, exponent = p.build.style == "compact", p.build.exponent
        diffuse = Diffuse(p.interpolator.COSINE_FORMAT)
        if p.specular is None:
            return [DiffuseUnit(diffuse) for _ in range(p.lights)]
        interval, shares_slope = 1, False
        if isinstance(p.specular, Power):
            interval = 42 if compact else 1
        else:
            if compact:
                # A colour takes its channels' cycles anyway.
                interval = max(SpecularUnit.multiplications(p.specular, exponent), p.intensity.channels)
            if exponent is None:
                self._slope, shares_slope = SlopeUnit(p.specular), True
        return [
            LightUnit(
                p.specular,
                diffuse,
                initiation_interval=interval,
                exponent=exponent,
                shares_slope=shares_slope,
                gated=p.gate,
            )
            for _ in range(p.lights)
        ]

    def elaborate(self, platform):
        """Admission, then shading, then the assembler."""
        m = Module()
        p = self.parameters
        m.submodules.pixel_assembler = assembler = self._assembler
        m.submodules.frame_constants = frame = FrameConstantsUnit(p.lights, p.materials)
        place_layout = coordinates_shape(p.x_bits, p.y_bits, p.length_bits)
        m.submodules.coordinates = coordinates = fifo.SyncFIFOBuffered(
            width=place_layout.size, depth=self._waiting_spans
        )

        # Admission: a span goes to what sets it up, its place round it, to all or to none.
        place = Signal(place_layout)
        empty, offered, free, admit, settled, written = (Signal() for _ in range(6))
        span = self.i.payload
        sinks = [(coordinates.w_en, coordinates.w_rdy)]
        if p.lights:
            sinks += self._shade(m, frame)
        else:
            ambient = frame.constants.ambient
            for channel, name in enumerate("rgb"):
                level = ambient[0 if p.grey else channel].round_half_up(0).saturate(Intensity.RESULT_FORMAT)
                m.d.comb += assembler.colors.payload[name].eq(level.as_value())
            m.d.comb += assembler.colors.valid.eq(1)
        m.d.comb += [
            empty.eq(span.length == 0),
            offered.eq(self.i.valid & ~empty),
            free.eq(~self.write.valid & ~written & settled),
            self.i.ready.eq(free & reduce(and_, (ready for _, ready in sinks))),
            admit.eq(offered & self.i.ready),
            place.x.eq(span.x),
            place.y.eq(span.y),
            place.length.eq(span.length),
            coordinates.w_data.eq(place),
        ]
        for index, (valid, _) in enumerate(sinks):
            others = (ready for k, (_, ready) in enumerate(sinks) if k != index)
            m.d.comb += valid.eq(reduce(and_, others, offered & free))
        m.d.comb += [
            assembler.coordinates.payload.eq(coordinates.r_data),
            assembler.coordinates.valid.eq(coordinates.r_rdy),
            coordinates.r_en.eq(assembler.coordinates.ready),
        ]
        connect(m, assembler.o, wiring.flipped(self.o))

        # Writes, only while no span is inside.
        connect(m, wiring.flipped(self.write), frame.write)
        # A constant is there two cycles after its write.
        m.d.sync += written.eq(self.write.valid & self.write.ready)
        inside = Signal(range(self._waiting_spans + self._assembler.SPANS_INSIDE + 1))
        finished = self.o.valid & self.o.ready & self.o.payload.last
        idle = Signal(init=1)
        m.d.comb += frame.hold.eq(~idle)
        m.d.sync += [
            inside.eq(inside + admit - finished),
            idle.eq(~admit & (idle | (finished & (inside == 1)))),
        ]
        if p.materials > 1:
            # Constants follow the index a clock behind, the highlight's slope some more.
            waited = Signal(2)
            with m.If(self.i.valid & (span.material != frame.material)):
                m.d.sync += waited.eq(0)
                with m.If(idle):
                    m.d.sync += frame.material.eq(span.material)
            with m.Elif(~waited.all()):
                m.d.sync += waited.eq(waited + 1)
            m.d.comb += settled.eq((span.material == frame.material) & waited.all())
        else:
            m.d.comb += settled.eq(1)

        status = self.status
        for counter, event in (
            (status.out_of_range_spans, self._interpolator.out_of_range if p.lights else 0),
            (status.empty_spans, self.i.valid & self.i.ready & empty),
            (status.overrun, admit & (span.x + span.length > 1 << p.x_bits)),
        ):
            seen = Signal(name="seen")
            m.d.sync += seen.eq(event)
            with m.If(seen & ~counter.all()):
                m.d.sync += counter.eq(counter + 1)
        return m

    def _shade(self, m: Module, frame: FrameConstantsUnit) -> list[tuple[Value, Value]]:
        """From spans to colours; valid and ready of what takes the spans."""
        p, span = self.parameters, self.i.payload
        m.submodules.interpolator = interpolator = self._interpolator
        m.submodules.intensity = intensity = self._intensity
        sinks = [(interpolator.i.valid, interpolator.i.ready)]
        words = interpolator.i.payload
        m.d.comb += [Value.cast(words[name]).eq(Value.cast(span[name])) for name in words.shape().members]
        operands, gated = interpolator.o, None
        if self._gate is not None:
            operands, gated = self._decide(m, frame, sinks)
        if self._slope is not None:
            m.submodules.slope = self._slope
            m.d.comb += self._slope.exponent.eq(frame.constants.exponent)

        # In lockstep, one handshake is that of all: equal units, offered the same beats and taken from on the
        # same cycles. Where lights skip beats, all take one together, or none.
        lockstep = p.specular is None or not self._lights[0].skips_dark
        leaders = self._lights[:1] if lockstep else self._lights
        for index, light in enumerate(self._lights):
            m.submodules[f"light_{index}"] = light
            constants = frame.constants.lights[index]
            if not p.takes_values:
                vectors = interpolator.constants[index]
                m.d.comb += [
                    vectors.direction.eq(constants.direction),
                    vectors.halfway.eq(constants.halfway),
                ]
            m.d.comb += [
                intensity.constants.diffuse[index].eq(constants.diffuse),
                intensity.constants.specular[index].eq(constants.specular),
            ]
            words, terms = operands.payload[index], light.o.payload
            if p.specular is None:
                m.d.comb += [light.i.payload.eq(words.cosine), intensity.i.payload.diffuse[index].eq(terms)]
            else:
                m.d.comb += [
                    light.i.payload.cosine.eq(words.cosine),
                    light.i.payload.highlight.eq(words.highlight),
                    intensity.i.payload.diffuse[index].eq(terms.diffuse),
                    intensity.i.payload.specular[index].eq(terms.specular),
                ]
                if gated is not None:
                    m.d.comb += light.i.payload.gated.eq(gated[index])
                if self._slope is not None:
                    m.d.comb += light.constants.eq(self._slope.slope)
                elif "constants" in light.signature.members:
                    m.d.comb += light.constants.eq(frame.constants.exponent)
            others = [other for other in leaders if other is not light and not lockstep]
            m.d.comb += [
                light.i.valid.eq(reduce(and_, (other.i.ready for other in others), operands.valid)),
                light.o.ready.eq(reduce(and_, (other.o.valid for other in others), intensity.i.ready)),
            ]
        m.d.comb += [
            operands.ready.eq(reduce(and_, (light.i.ready for light in leaders))),
            intensity.i.valid.eq(reduce(and_, (light.o.valid for light in leaders))),
            intensity.constants.ambient.eq(frame.constants.ambient),
        ]
        connect(m, intensity.o, self._assembler.colors)
        return sinks

    def _decide(self, m: Module, frame: FrameConstantsUnit, sinks: list) -> tuple[stream.Interface, Value]:
        """The highlight gate's decisions beside the operands of each pixel; it too takes the spans."""
        p, span = self.parameters, self.i.payload
        m.submodules.highlight_gate = gate = self._gate
        width = p.length_bits
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=width, depth=self._waiting_spans)
        m.submodules.decisions = decisions = fifo.SyncFIFOBuffered(width=p.lights, depth=self._waiting_spans)
        # The gate takes a span at a turn of its own, which is not always that of the setup.
        waiting = gate.i.signature.flip().create(path=("waiting",))
        connect_fifo(m, "undecided", waiting, gate.i, depth=3)
        sinks += [(waiting.valid, waiting.ready), (lengths.w_en, lengths.w_rdy)]
        source = self._interpolator.o
        operands = source.signature.create(path=("decided",))
        place, last = Signal(p.length_bits), Signal()
        moves = operands.valid & operands.ready
        m.d.comb += [
            waiting.payload.normal_left.eq(span.normal_left),
            waiting.payload.normal_right.eq(span.normal_right),
            lengths.w_data.eq(span.length),
            decisions.w_data.eq(gate.o.payload),
            decisions.w_en.eq(gate.o.valid),
            gate.o.ready.eq(decisions.w_rdy),
            # A decision, and with it the length, is there before the pixel, or that waits.
            Value.cast(operands.payload).eq(Value.cast(source.payload)),
            operands.valid.eq(source.valid & decisions.r_rdy),
            source.ready.eq(operands.ready & decisions.r_rdy),
            last.eq(place == lengths.r_data - 1),
            lengths.r_en.eq(moves & last),
            decisions.r_en.eq(moves & last),
        ]
        for index in range(p.lights):
            m.d.comb += gate.constants.halfway[index].eq(frame.constants.lights[index].halfway)
        if p.build.exponent is None:
            m.d.comb += gate.constants.exponent.eq(frame.constants.exponent)
        with m.If(moves):
            m.d.sync += place.eq(Mux(last, 0, place + 1))
        return operands, ~decisions.r_data
