"""The shading pipeline: raster spans in, pixels out, one a clock."""

from amaranth.hdl import Module, Signal, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from golden.intensity import Intensity
from golden.pipeline import ShadingPipeline
from golden.specular import Specular

from .difference_accumulator import DifferenceAccumulatorUnit
from .difference_setup import DifferenceSetupUnit
from .frame_constants import FrameConstantsUnit, write_shape
from .gpq import GPQUnit
from .intensity import IntensityUnit
from .light import LightUnit
from .middle_normal import MiddleNormalUnit, normal_shape
from .pixel_assembler import PixelAssemblerUnit, pixel_shape, place_shape
from .stream import BUFFER_LATENCY, connect, connect_buffered

__all__ = ["PORT_DESCRIPTIONS", "ShadingPipelineUnit", "span_shape", "status_shape"]

PORT_DESCRIPTIONS = {
    "i_x": "first pixel of the span, column",
    "i_y": "its row",
    "i_length": "pixels of the span; 0 gives none",
    "i_normal_left": "unit normal at the first pixel centre, times 2^17 - 1",
    "i_normal_right": "unit normal at the last pixel centre",
    "o_x": "column of the pixel",
    "o_y": "row",
    "o_r": "red",
    "o_g": "green",
    "o_b": "blue",
    "o_last": "last pixel of its span",
    "write_address": "frame constant to write, see above",
    "write_data": "its code; taken when no span is inside",
    "status_wide_spans": "spans over 45 degrees since reset, at most 65535",
    "status_empty_spans": "spans of length 0 since reset, at most 65535",
    "status_overrun": "a span went past column 4095",
}
"""What each port of the pipeline is, for the table in its Verilog."""


def span_shape() -> data.StructLayout:
    """Shape of a raster span: first pixel, pixels, unit normals at the first and last pixel centre."""
    return data.StructLayout(
        {
            "x": unsigned(12),
            "y": unsigned(12),
            "length": unsigned(12),
            "normal_left": normal_shape(),
            "normal_right": normal_shape(),
        }
    )


def status_shape() -> data.StructLayout:
    """Shape of what the pipeline has counted since reset; counters stop at their largest value.

    ``wide_spans``: spans over 45 degrees, whose normals are not to be trusted; counted when their middle
    normal is known, 25 clocks or more after they are taken. ``empty_spans``: spans of length 0.
    ``overrun``: whether a span has gone past x = 4095, where x starts again at 0.
    """
    return data.StructLayout(
        {"wide_spans": unsigned(16), "empty_spans": unsigned(16), "overrun": unsigned(1)}
    )


class ShadingPipelineUnit(wiring.Component):
    """Shades raster spans with the normals of a quadratic curve.

    Setup (middle normal, G/P/Q, differences) of the next spans overlaps the pixels of this one; a FIFO
    carries the spans' places round it. `golden.pipeline.ShadingPipeline` is the bit-true twin.

    The first pixel of a span leaves `latency` clocks after an idle pipeline has taken it, 66 and the depth
    of the adder tree: ``66 + ceil(log2(2 lights + 1))``. Without stalls each span then takes at most
    ``max(length, 7)`` clocks: up to one pixel a clock, and a setup interval of 7; three spans are held
    ready, so that a long one pays for short ones after it. A span of length 0 is taken like any other and
    gives nothing. 5 multipliers, and 14 a light.

    A write is taken when no span is inside, and no span is taken while a write waits, so a frame's constants
    never change under a running span: ``i.ready`` falls on the clock on which ``write.valid`` rises.

    Parameters
    ----------
    parameters : ShadingPipeline
        Method, reflection model, number of lights.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape()))`
        Spans.
    o : :py:`Out(stream.Signature(pixel_shape()))`
        Pixels.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants; see `FrameConstantsUnit` for the addresses.
    status : :py:`Out(status_shape())`
        Counters.

    Source: pipeline.md; [T] figure 4.10.
    """

    # Up to 5 spans are in the middle-normal unit and 1 in G/P/Q before their lengths are read; up to 3 in
    # the difference setup, 3 prepared, 1 in the accumulator and, if of one pixel each, 7 behind it.
    LENGTHS = 8
    PLACES = 32

    def __init__(self, parameters: ShadingPipeline | None = None):
        self.parameters = parameters or ShadingPipeline()
        super().__init__(
            {
                "i": In(stream.Signature(span_shape())),
                "o": Out(stream.Signature(pixel_shape())),
                "write": In(stream.Signature(write_shape())),
                "status": Out(status_shape()),
            }
        )
        self._middle, self._gpq, self._setup = MiddleNormalUnit(), GPQUnit(), DifferenceSetupUnit()
        self._accumulator, self._assembler = DifferenceAccumulatorUnit(), PixelAssemblerUnit()
        self._lights = [LightUnit(Specular(self.parameters.model)) for _ in range(self.parameters.lights)]
        self._intensity = IntensityUnit(Intensity(self.parameters.lights))
        self.setup_interval = max(self._middle.initiation_interval, self._setup.initiation_interval)
        chain = (self._middle, self._gpq, self._setup, self._accumulator)
        chain += (self._lights[0], self._intensity, self._assembler)
        self.latency = sum(unit.latency for unit in chain) + 2 * BUFFER_LATENCY

    def elaborate(self, platform):
        """Setup, then the lights side by side, then the assembler."""
        m = Module()
        m.submodules.middle_normal = middle = self._middle
        m.submodules.gpq = gpq = self._gpq
        m.submodules.difference_setup = setup = self._setup
        m.submodules.difference_accumulator = accumulator = self._accumulator
        m.submodules.intensity = intensity = self._intensity
        m.submodules.pixel_assembler = assembler = self._assembler
        m.submodules.frame_constants = frame = FrameConstantsUnit(self.parameters.lights)
        m.submodules.places = places = fifo.SyncFIFOBuffered(width=place_shape().size, depth=self.PLACES)
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=12, depth=self.LENGTHS)

        # Admission: a span goes to the setup, its place round it, both or neither.
        place = Signal(place_shape())
        empty, offered, free, admit = Signal(), Signal(), Signal(), Signal()
        span = self.i.payload
        m.d.comb += [
            empty.eq(span.length == 0),
            offered.eq(self.i.valid & ~self.write.valid & ~empty),
            free.eq(places.w_rdy & lengths.w_rdy),
            admit.eq(offered & free & middle.i.ready),
            self.i.ready.eq(~self.write.valid & free & middle.i.ready),
            middle.i.valid.eq(offered & free),
            middle.i.payload.normal_left.eq(span.normal_left),
            middle.i.payload.normal_right.eq(span.normal_right),
            place.x.eq(span.x),
            place.y.eq(span.y),
            place.length.eq(span.length),
            places.w_data.eq(place),
            places.w_en.eq(admit),
            lengths.w_data.eq(span.length),
            lengths.w_en.eq(admit),
        ]

        # Setup. A length is always there before its coefficients: the two have left together.
        m.d.comb += [
            gpq.i.payload.normal_left.eq(middle.o.payload.normal_left),
            gpq.i.payload.normal_middle.eq(middle.o.payload.normal_middle),
            gpq.i.payload.normal_right.eq(middle.o.payload.normal_right),
            gpq.i.valid.eq(middle.o.valid),
            middle.o.ready.eq(gpq.i.ready),
            *(setup.i.payload[name].eq(gpq.o.payload[name]) for name in "gpq"),
            setup.i.payload.length.eq(lengths.r_data),
            setup.i.valid.eq(gpq.o.valid),
            gpq.o.ready.eq(setup.i.ready),
            lengths.r_en.eq(gpq.o.valid & setup.i.ready),
        ]
        connect_buffered(m, "prepared", setup.o, accumulator.i, depth=3)

        # Lights in lockstep: equal units that are offered the same beats and taken from on the same clocks.
        for index, light in enumerate(self._lights):
            m.submodules[f"light_{index}"] = light
            constants = frame.constants.lights[index]
            m.d.comb += [
                light.i.payload.eq(accumulator.o.payload),
                light.i.valid.eq(accumulator.o.valid),
                light.o.ready.eq(intensity.i.ready),
                light.constants.direction.eq(constants.direction),
                light.constants.halfway.eq(constants.halfway),
                light.constants.exponent.eq(frame.constants.exponent),
                intensity.i.payload.diffuse[index].eq(light.o.payload.diffuse),
                intensity.i.payload.specular[index].eq(light.o.payload.specular),
                intensity.constants.diffuse[index].eq(constants.diffuse),
                intensity.constants.specular[index].eq(constants.specular),
            ]
        m.d.comb += [
            accumulator.o.ready.eq(self._lights[0].i.ready),
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

        status = self.status
        for counter, event in (
            (status.wide_spans, middle.o.valid & middle.o.ready & middle.o.payload.wide),
            (status.empty_spans, self.i.valid & self.i.ready & empty),
        ):
            with m.If(event & ~counter.all()):
                m.d.sync += counter.eq(counter + 1)
        with m.If(admit & (span.x + span.length > 4096)):
            m.d.sync += status.overrun.eq(1)
        return m
