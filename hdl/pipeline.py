"""The shading pipeline: raster spans in, pixels out, one a clock."""

from typing import Literal

from amaranth.hdl import Module, Shape, Signal, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.angular_interpolator import AngularInterpolator
from golden.bisection_interpolator import BisectionInterpolator
from golden.chord_interpolator import ChordInterpolator
from golden.diffuse import Diffuse
from golden.intensity import Intensity
from golden.interpolator import Interpolator
from golden.linear_interpolator import LinearInterpolator
from golden.pipeline import ShadingPipeline
from golden.power import Power
from golden.quadratic_interpolator import QuadraticInterpolator
from golden.recurrence_interpolator import RecurrenceInterpolator

from .angular_interpolator import AngularInterpolatorUnit
from .bisection_interpolator import BisectionInterpolatorUnit
from .chord_interpolator import ChordInterpolatorUnit
from .frame_constants import FrameConstantsUnit, write_shape
from .intensity import IntensityUnit
from .interpolator import InterpolatorUnit
from .light import LightUnit
from .linear_interpolator import LinearInterpolatorUnit
from .middle_normal import normal_shape
from .pixel_assembler import PixelAssemblerUnit, pixel_shape, place_shape
from .quadratic_interpolator import QuadraticInterpolatorUnit
from .recurrence_interpolator import RecurrenceInterpolatorUnit
from .specular import SlopeUnit
from .stream import BUFFER_LATENCY, connect, connect_buffered

__all__ = [
    "INTERPOLATORS",
    "PORT_DESCRIPTIONS",
    "STYLES",
    "ShadingPipelineUnit",
    "span_shape",
    "status_shape",
]

STYLES = ("throughput", "compact")
"""One pixel a clock, or few multipliers."""

INTERPOLATORS: dict[type[Interpolator], type[InterpolatorUnit]] = {
    AngularInterpolator: AngularInterpolatorUnit,
    BisectionInterpolator: BisectionInterpolatorUnit,
    ChordInterpolator: ChordInterpolatorUnit,
    LinearInterpolator: LinearInterpolatorUnit,
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
    "i_material": "index of the span's material",
    "o_x": "column of the pixel",
    "o_y": "row",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "last pixel of its span",
    "write_address": "frame constant to write, see above",
    "write_data": "its code; taken when no span is inside",
    "status_wide_spans": "spans too wide for the method since reset, at most 65535",
    "status_empty_spans": "spans of length 0 since reset, at most 65535",
    "status_overrun": "a span went past column 4095",
}
"""What each port of the pipeline is, for the table in its Verilog."""


def span_shape(materials: int = 1) -> data.StructLayout:
    """Shape of a raster span: first pixel, pixels, unit normals at the first and last pixel centre.

    With several materials there is the index of its own, ``material``, too.
    """
    members = {
        "x": unsigned(12),
        "y": unsigned(12),
        "length": unsigned(12),
        "normal_left": normal_shape(),
        "normal_right": normal_shape(),
    }
    if materials > 1:
        members["material"] = Shape.cast(range(materials))
    return data.StructLayout(members)


def status_shape() -> data.StructLayout:
    """Shape of what the pipeline has counted since reset; counters stop at their largest value.

    ``wide_spans``: spans too wide for the method, whose pixels are not to be trusted; counted when that is
    known, some clocks after they are taken. ``empty_spans``: spans of length 0.
    ``overrun``: whether a span has gone past x = 4095, where x starts again at 0.
    """
    return data.StructLayout(
        {"wide_spans": unsigned(16), "empty_spans": unsigned(16), "overrun": unsigned(1)}
    )


class ShadingPipelineUnit(wiring.Component):
    """Shades raster spans, with any method and any reflection model.

    An interpolator takes spans to the operands of their pixels; a light unit for each light takes these to
    terms, and the intensity unit to colours. The setup of the next spans overlaps the pixels of this one; a
    FIFO carries the spans' places round it. `golden.pipeline.ShadingPipeline` is the bit-true twin.

    The first pixel of a span leaves `latency` clocks after an idle pipeline has taken it. Without stalls each
    span then takes at most ``max(clocks_per_pixel length, setup_interval)`` clocks; three spans are held
    ready, so that a long one pays for short ones after it. (``bisection`` takes longer where it divides
    spans.) A span of length 0 is taken like any other and gives nothing.

    In the *compact* style one multiplier does the colours, one or a few the specular terms and one or two the
    setup (as many as its longest interval needs): a pixel takes 3 clocks for each of its diffuse and specular
    terms that is not 0, at least 3, so that what has no highlight costs less; a power takes 42. The pixels
    are the same to the bit. ``clocks_per_pixel`` and ``latency`` are then those of a pixel with every term.

    A write is taken when no span is inside, and no span is taken while a write waits, so a frame's constants
    never change under a running span: ``i.ready`` falls on the clock on which ``write.valid`` rises. For the
    same reason a span of another material than the one before it waits until no span is inside: it is taken 5
    clocks after the last pixel has left, and its first pixel comes ``latency + 5`` clocks after that one,
    where without the change it comes 1 clock after. Sort spans by material.

    Parameters
    ----------
    parameters : ShadingPipeline
        Method, reflection model, numbers of lights and materials.
    setup_interval : int or None
        Clocks from a span to the next at the closest, where the method has that choice: a smaller one needs
        more multipliers, and changes no pixel. ``None``: 4, or in the compact style the largest.
    style : str
        ``"throughput"`` or ``"compact"``.

    Raises
    ------
    ValueError
        If the method is not built for the setup interval, or the style is unknown.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape(materials)))`
        Spans.
    o : :py:`Out(stream.Signature(pixel_shape()))`
        Pixels.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants; see `FrameConstantsUnit` for the addresses.
    status : :py:`Out(status_shape())`
        Counters.

    Source: pipeline.md; [T] figure 4.10.
    """

    PLACES = 64

    def __init__(
        self,
        parameters: ShadingPipeline | None = None,
        setup_interval: int | None = None,
        style: Literal["throughput", "compact"] = "throughput",
    ):
        if style not in STYLES:
            raise ValueError(f"style must be one of {', '.join(STYLES)}, not {style!r}")
        self.style = style
        self.parameters = p = parameters or ShadingPipeline()
        super().__init__(
            {
                "i": In(stream.Signature(span_shape(p.materials))),
                "o": Out(stream.Signature(pixel_shape())),
                "write": In(stream.Signature(write_shape())),
                "status": Out(status_shape()),
            }
        )
        method = INTERPOLATORS[type(p.interpolator)]
        served = method.setup_intervals(p.interpolator)
        if setup_interval not in (None, *served):
            choice = f"1 to {served[-1]}" if served else "left out"
            raise ValueError(f"setup_interval of {p.method} must be {choice}, not {setup_interval}")
        if style == "compact" and setup_interval is None and served:
            setup_interval = served[-1]
        options = {} if setup_interval is None else {"setup_interval": setup_interval}
        self._interpolator = method(p.interpolator, p.lights, **options)
        diffuse = Diffuse(p.interpolator.COSINE_FORMAT)
        self._slope = None if isinstance(p.highlight, Power) else SlopeUnit(p.highlight)
        shares_slope = self._slope is not None
        interval = 1
        if style == "compact":
            interval = 3 if shares_slope else 42
        self._lights = [
            LightUnit(p.highlight, diffuse, interval, shares_slope=shares_slope) for _ in range(p.lights)
        ]
        self._intensity = IntensityUnit(Intensity(p.lights), style)
        self._assembler = PixelAssemblerUnit()
        self.setup_interval = self._interpolator.setup_interval
        self.clocks_per_pixel = max(
            self._interpolator.clocks_per_pixel, interval, self._intensity.initiation_interval
        )
        chain = (self._interpolator, self._lights[0], self._intensity, self._assembler)
        self.latency = sum(unit.latency for unit in chain) + BUFFER_LATENCY

    def elaborate(self, platform):
        """Interpolator, then the lights side by side, then the assembler."""
        m = Module()
        p = self.parameters
        m.submodules.interpolator = interpolator = self._interpolator
        m.submodules.intensity = intensity = self._intensity
        m.submodules.pixel_assembler = assembler = self._assembler
        m.submodules.frame_constants = frame = FrameConstantsUnit(p.lights, p.materials)
        m.submodules.places = places = fifo.SyncFIFOBuffered(width=place_shape().size, depth=self.PLACES)

        # Admission: a span goes to the interpolator, its place round it, both or neither.
        place = Signal(place_shape())
        empty, offered, free, admit, settled = (Signal() for _ in range(5))
        span = self.i.payload
        m.d.comb += [
            empty.eq(span.length == 0),
            offered.eq(self.i.valid & ~empty),
            free.eq(~self.write.valid & places.w_rdy & settled),
            admit.eq(offered & free & interpolator.i.ready),
            self.i.ready.eq(free & interpolator.i.ready),
            interpolator.i.valid.eq(offered & free),
            interpolator.i.payload.normal_left.eq(span.normal_left),
            interpolator.i.payload.normal_right.eq(span.normal_right),
            interpolator.i.payload.length.eq(span.length),
            place.x.eq(span.x),
            place.y.eq(span.y),
            place.length.eq(span.length),
            places.w_data.eq(place),
            places.w_en.eq(admit),
        ]

        # Lights in lockstep: equal units that are offered the same beats and taken from on the same clocks.
        constants_of_exponent = frame.constants.exponent
        if self._slope is not None:
            m.submodules.slope = self._slope
            m.d.comb += self._slope.exponent.eq(frame.constants.exponent)
            constants_of_exponent = self._slope.slope
        for index, light in enumerate(self._lights):
            m.submodules[f"light_{index}"] = light
            constants = frame.constants.lights[index]
            vectors = interpolator.constants[index]
            m.d.comb += [
                vectors.direction.eq(constants.direction),
                vectors.halfway.eq(constants.halfway),
                light.i.payload.cosine.eq(interpolator.o.payload[index].cosine),
                light.i.payload.highlight.eq(interpolator.o.payload[index].highlight),
                light.i.valid.eq(interpolator.o.valid),
                light.o.ready.eq(intensity.i.ready),
                light.constants.eq(constants_of_exponent),
                intensity.i.payload.diffuse[index].eq(light.o.payload.diffuse),
                intensity.i.payload.specular[index].eq(light.o.payload.specular),
                intensity.constants.diffuse[index].eq(constants.diffuse),
                intensity.constants.specular[index].eq(constants.specular),
            ]
        m.d.comb += [
            interpolator.o.ready.eq(self._lights[0].i.ready),
            intensity.i.valid.eq(self._lights[0].o.valid),
            intensity.constants.ambient.eq(frame.constants.ambient),
        ]
        connect_buffered(m, "shaded", intensity.o, assembler.colors, depth=4)
        m.d.comb += [
            assembler.places.payload.eq(places.r_data),
            assembler.places.valid.eq(places.r_rdy),
            places.r_en.eq(assembler.places.ready),
        ]
        connect(m, assembler.o, wiring.flipped(self.o))

        # Writes, only while no span is inside.
        connect(m, wiring.flipped(self.write), frame.write)
        inside = Signal(range(self.PLACES + 2))
        finished = self.o.valid & self.o.ready & self.o.payload.last
        m.d.comb += frame.hold.eq(inside != 0)
        m.d.sync += inside.eq(inside + admit - finished)
        if p.materials > 1:
            # Constants follow the index a clock behind, the highlight's slope some more.
            waited = Signal(2)
            with m.If(self.i.valid & (span.material != frame.material)):
                m.d.sync += waited.eq(0)
                with m.If(inside == 0):
                    m.d.sync += frame.material.eq(span.material)
            with m.Elif(~waited.all()):
                m.d.sync += waited.eq(waited + 1)
            m.d.comb += settled.eq((span.material == frame.material) & waited.all())
        else:
            m.d.comb += settled.eq(1)

        status = self.status
        for counter, event in (
            (status.wide_spans, interpolator.wide),
            (status.empty_spans, self.i.valid & self.i.ready & empty),
        ):
            with m.If(event & ~counter.all()):
                m.d.sync += counter.eq(counter + 1)
        with m.If(admit & (span.x + span.length > 4096)):
            m.d.sync += status.overrun.eq(1)
        return m
