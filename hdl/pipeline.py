"""The shading pipeline: raster spans in, pixels out, up to one on every cycle."""

from functools import reduce
from operator import and_

from amaranth.hdl import Module, Mux, Shape, Signal, Value, unsigned
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.frame_constants import TEXEL_ADDRESS, TEXELS_ADDRESS
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.albedo.albedo import AlbedoUnit
from blysk.hdl.albedo.attribute_spans import span_attributes_shape
from blysk.hdl.albedo.texel_memory import texels_shape
from blysk.hdl.albedo.texture_address import texel_request_shape
from blysk.hdl.core.memory import (
    LATE_FIFO_LATENCY,
    LUT_WORDS,
    UNCOUNTED,
    connect_late_fifo,
    connect_wide_fifo,
)
from blysk.hdl.core.shapes import normal_shape
from blysk.hdl.core.single_register import connect_register
from blysk.hdl.core.stream import FIFO_LATENCY, SLICE_LATENCY, connect, connect_fifo
from blysk.hdl.core.views import copy, copy_fields
from blysk.hdl.frame_constants import FrameConstantsUnit, existing_material, write_shape
from blysk.hdl.methods.registry import unit_of
from blysk.hdl.pixel_assembler import PixelAssemblerUnit, coordinates_shape
from blysk.hdl.pixel_shading import COMPACT_INTERVAL, PixelShading, connect_lanes, each_lane
from blysk.hdl.port_descriptions import SPAN_COUNTER_BITS

__all__ = ["SPACED", "ShadingPipelineUnit", "span_shape", "status_shape"]

SPACED = 8
"""Spacing of spans from which `ShadingPipelineUnit` has fewer words that wait."""


def span_shape(model: ShadingPipeline) -> data.StructLayout:
    """Shape of a raster span: first pixel, number of pixels, and the operands of the method.

    The operands depend on the method:

    - unit normals at the first and last pixel centre;
    - the ends of the true line;
    - the operands of each light at three places: the first pixel, the middle, the last pixel;
    - vectors N/W with their steps.

    Without lights there are no operands. With several materials there is ``material``, and with an albedo
    there are ``attributes``.

    Parameters
    ----------
    model : ShadingPipeline
        Design of the pipeline.
    """
    members = {
        "x": unsigned(model.x_bits),
        "y": unsigned(model.y_bits),
        "length": unsigned(model.length_bits),
    }
    if model.lights:
        unit = unit_of(model.interpolator)
        members |= unit.span_shape(
            model.lights,
            highlights=model.specular is not None,
            length_bits=model.length_bits,
            **({"factors": len(model.factors)} if model.factors else {}),
            **unit.span_options(model.interpolator),
        ).members
    if model.materials > 1:
        members["material"] = Shape.cast(range(model.materials))
    if model.albedo is not None:
        members["attributes"] = span_attributes_shape(model.albedo.spans)
    return data.StructLayout(members)


def status_shape() -> data.StructLayout:
    """Shape of the pipeline's counters since reset, which stop at their largest value.

    - ``out_of_range_spans``: spans with a larger angle than the method serves. Their pixels have no error
    bound. A span is counted some cycles after it was accepted.
    - ``empty_spans``: spans of length 0.
    - ``overrun``: whether a span went past the largest x. After it x goes on from 0.
    """
    return data.StructLayout(
        {
            "out_of_range_spans": unsigned(SPAN_COUNTER_BITS),
            "empty_spans": unsigned(SPAN_COUNTER_BITS),
            "overrun": unsigned(1),
        }
    )


class ShadingPipelineUnit(wiring.Component):
    """Shading pipeline of a design: any method, any reflection model, any number of lights.

    An interpolator makes the operands of pixels from spans. For each light a light unit makes terms from
    operands. The intensity unit makes colours from terms. For the transfer ``"srgb"`` a transfer unit encodes
    the colours. While the pixels of a span are made, the setup works on the next spans. A FIFO carries the
    coordinates of the spans past all these units. `ShadingPipeline` is the bit-accurate model.

    The first pixel of a span leaves `latency` cycles after an empty pipeline has accepted it. Without stalls
    each span then takes at most ``max(cycles_per_pixel length, setup_interval)`` cycles, and in the
    throughput style at least ``cycles_per_pixel length``. Up to two spans may wait after their setup. So a
    short span that follows a long span takes the fewest cycles. (``bisection`` takes more cycles for a span
    of several segments.) A span of length 0 is accepted like every span, and gives no pixel.

    With a gate a highlight gate processes each span in parallel with the interpolator, and decides for each
    light. If the span has no highlight, the specular unit of the light keeps its state. In the compact style
    it is bypassed. The gate accepts spans as often as the setup does. A decision precedes the first pixel
    of its span, or the pixel waits for the decision. So a method with a shorter setup than the gate, such as
    ``linear``, may take a cycle more for short spans.

    With two or four lanes a beat of ``o`` has as many neighbouring pixels of a span, see `beat_shape`. The
    interpolator makes the operands of all pixels, and each lane has units of its own from there to the
    colours. In the rules above beats take the place of pixels. A span of two pixels from software is a pair,
    see `QuotientLanesUnit`. With four lanes a span of three or four pixels is a single beat, and takes two
    cycles.

    Without lights there is neither interpolator nor multiplier. Every pixel has the ambient colour.

    With an albedo an albedo unit processes each span in parallel with the interpolator. A FIFO holds the
    albedo of all pixels that may come before their terms, so the albedo does not limit the rate.

    In the *compact* style there are these multipliers:

    - one for the colours;
    - one for the specular terms of each light;
    - two for the products of each light with a normal, if the method finds normals;
    - one or two for the setup, as many as its longest interval needs;
    - with an albedo, a third of the multipliers that the albedo has in the throughput style.

    In this style ``quotient`` has ``ceil((2 + 2 lights) / 3)`` multipliers for its quotients and one for the
    setup. A pixel takes the largest of three numbers of cycles:

    - 3, also with one channel, because the products of a pixel share multipliers;
    - ``channels max(1, T)``, or ``channels (1 + T)`` with an albedo, where T is the number of its diffuse and
      specular terms that are not 0 (see `Intensity.cycles`);
    - one cycle for each product of the specular model (42 for a power), if a light is in front of the surface
      and the span is not dark.

    So pixels without a highlight take fewer cycles. The pixels are the same to the bit. ``cycles_per_pixel``
    and ``latency`` are then those of a pixel with every term.

    A write is accepted when no span is inside, and no span is accepted while a write waits. So the constants
    never change while spans are inside. ``i.ready`` falls on the cycle on which ``write.valid`` rises.
    ``i.ready`` rises 2 cycles after the last write was accepted. For the same reason a span of another
    material than the span before it waits until no span is inside. It is accepted 5 cycles after the last
    pixel has left. Its first pixel comes ``latency + 5`` cycles after this last pixel. Without the change it
    may come 1 cycle after. Sort spans by material.

    Parameters
    ----------
    model : ShadingPipeline
        Method, reflection model, numbers of lights and materials, and build options.
    spacing : int
        Least number of cycles from a span to the next. From `SPACED` on, fewer words wait beside the
        interpolator. If spans come sooner, they wait.

    Raises
    ------
    ValueError
        If the method cannot be built for the setup interval.

    Members
    -------
    i : :py:`In(stream.Signature(span_shape(model)))`
        Spans.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels. With several lanes the payload is ``beat_shape(x_bits, y_bits, lanes)``.
    write : :py:`In(stream.Signature(write_shape()))`
        Frame constants; see `FrameConstantsUnit` for the addresses.
    texel_request, texel_response
        The streams of `TextureSamplerUnit`. Only with a texel memory outside.
    status : :py:`Out(status_shape())`
        Counters.

    Attributes
    ----------
    direction : View
        In `normal_shape`: the constant L of the first light, for units that make vectors for highlights of
        R·V.

    Source: docs/theory/units.md#pipeline; [T] figure 4.10.
    """

    def __init__(self, model: ShadingPipeline | None = None, spacing: int = 1):
        self.model = p = model or ShadingPipeline()
        self._spacing = spacing
        self._assembler = PixelAssemblerUnit(p.x_bits, p.y_bits, p.length_bits, p.build.lanes)
        members = {
            "i": In(stream.Signature(span_shape(p))),
            "o": Out(self._assembler.o.signature),
            "write": In(stream.Signature(write_shape())),
            "status": Out(status_shape()),
        }
        if p.texels_outside:
            memory = p.albedo.texture.memory
            members["texel_request"] = Out(stream.Signature(texel_request_shape(memory)))
            members["texel_response"] = In(stream.Signature(texels_shape()))
        super().__init__(members)
        self._interpolator = self._gate = None
        self._lanes = [PixelShading(p) for _ in range(p.build.lanes)]
        self._shading, *self._further = self._lanes
        self._albedo = None
        self.direction = Signal(normal_shape(), name="first_direction")
        self.setup_interval = self._shortest_interval = self.cycles_per_pixel = 1
        self.latency = LATE_FIFO_LATENCY + self._assembler.coordinates_latency
        if p.lights:
            self._make_units()
        elif p.build.setup_interval is not None:
            raise ValueError("without lights there is no setup, and no setup_interval")
        if p.albedo is not None:
            self._make_albedo()

    def _make_albedo(self) -> None:
        """The albedo path, and the times that follow from it."""
        p, shading = self.model, self._shading
        interval = COMPACT_INTERVAL if p.build.compact else 1
        self._albedo = AlbedoUnit(p.albedo, p.length_bits, interval, spaced=self._spacing >= SPACED)
        behind = shading.latency - shading.light_latency + self._assembler.latency
        before = self.latency - behind if p.lights else 0
        path = SLICE_LATENCY + self._albedo.latency + LATE_FIFO_LATENCY
        # Room for all pixels whose albedo comes before their terms.
        ahead = max(before - path, 0) + LATE_FIFO_LATENCY
        self._waiting_albedos = -(-ahead // interval) + UNCOUNTED + 2
        self.latency = max(before, path) + behind
        self.cycles_per_pixel = max(self.cycles_per_pixel, shading.cycles_per_pixel, interval)

    def _make_units(self) -> None:
        """Units from spans to colours, and the times that follow from them."""
        p = self.model
        compact, setup_interval, product_interval = p.build.compact, p.build.setup_interval, 1
        method = unit_of(p.interpolator)
        if compact:
            product_interval = COMPACT_INTERVAL
            if setup_interval is None:
                setup_interval = max(method.setup_intervals(p.interpolator), default=None)
        self._interpolator = method(
            p.interpolator,
            p.lights,
            setup_interval=setup_interval,
            highlights=p.specular is not None,
            length_bits=p.length_bits,
            product_interval=product_interval,
            factors=p.factors,
            **({"lanes": p.build.lanes} if p.build.lanes > 1 else {}),
        )
        self.setup_interval = self._interpolator.setup_interval
        self._shortest_interval = self._interpolator.shortest_interval
        self.latency = self._interpolator.latency + self._shading.latency + self._assembler.latency
        if p.gate:
            self._gate = method.gate(p, self.setup_interval)
            # A FIFO before the gate, and one after it.
            decided = self._gate.latency + 2 * FIFO_LATENCY
            self.latency += max(decided - self._interpolator.latency, 0)
        self.cycles_per_pixel = max(self._interpolator.cycles_per_pixel, self._shading.cycles_per_pixel)

    @property
    def vectors(self) -> bool:
        """Whether spans bring N/W in the frame of a light, as in `GeometryUnit`."""
        return "step" in self.i.payload.shape().members

    @property
    def _waiting_spans(self) -> int:
        """Depth of the FIFOs beside interpolator and lights: the most spans that these may contain."""
        inside = -(-self.latency // max(self._shortest_interval, self._spacing)) + UNCOUNTED
        return max(inside, 17 if self._spacing < SPACED else LUT_WORDS)

    @property
    def spans_inside(self) -> int:
        """Largest number of spans inside."""
        # Two more spans wait in registers behind the memory of the coordinates.
        return self._waiting_spans + 2 + self._assembler.SPANS_INSIDE

    def elaborate(self, platform):
        """Frame constants, units from spans to colours, FIFO of coordinates, admission, counters."""
        m = Module()
        p = self.model
        # Whether a write was taken on the cycle before.
        self._written = Signal(name="written")
        m.submodules.pixel_assembler = assembler = self._assembler
        m.submodules.frame_constants = frame = FrameConstantsUnit(
            p.lights, p.materials, p.threshold_format, p.banks, p.albedo
        )
        sinks, albedo = [self._carry_coordinates(m)], None
        if p.albedo is not None:
            albedo, sink = self._carry_albedo(m, frame)
            sinks.append(sink)
        if p.lights:
            if p.mirror:
                m.d.comb += self.direction.eq(frame.constants.lights[0].direction)
            sinks += self._shade(m, frame, albedo)
        elif albedo is not None:
            m.submodules.intensity = self._shading.intensity
            self._shading.connect(m, frame.constants, None, None, albedo, assembler.colors)
        elif self._further:
            for inner, shading, colors in each_lane(m, self._lanes, assembler.colors):
                shading.connect_constant(inner, frame.constants.ambient, colors)
        else:
            self._shading.connect_constant(m, frame.constants.ambient, assembler.colors)
        connect(m, assembler.o, wiring.flipped(self.o))
        admit = self._admit(m, frame, sinks)
        self._count(m, admit)
        return m

    def _carry_coordinates(self, m: Module) -> tuple[Value, Value]:
        """Make the FIFO that carries coordinates to the assembler. Returns valid and ready of its input."""
        p, assembler = self.model, self._assembler
        layout = coordinates_shape(p.x_bits, p.y_bits, p.length_bits)
        source = stream.Signature(layout).create(path=("source",))
        m.d.comb += copy_fields(source.payload, self.i.payload, layout.members)
        connect_late_fifo(m, "coordinates", source, assembler.coordinates, self._waiting_spans)
        return source.valid, source.ready

    def _carry_albedo(
        self, m: Module, frame: FrameConstantsUnit
    ) -> tuple[stream.Interface, tuple[Value, Value]]:
        """Make the albedo path. Returns its output, which waits for the terms, and its input's handshake."""
        m.submodules.albedo = unit = self._albedo
        source = unit.i.signature.flip().create(path=("attributes",))
        attributes = self.i.payload.attributes
        m.d.comb += [
            *copy_fields(source.payload, attributes, attributes.shape().members),
            source.payload.length.eq(self.i.payload.length),
        ]
        if self._spacing < SPACED:
            connect_wide_fifo(m, "waiting_attributes", source, unit.i, depth=4)
        else:
            connect_register(m, "waiting_attributes", source, unit.i)
        albedo = unit.o.signature.create(path=("colored",))
        connect_late_fifo(m, "albedos", unit.o, albedo, self._waiting_albedos)
        if unit.model.texture is not None:
            m.d.comb += copy(unit.constants, frame.constants.texture)
            if self.model.texels_outside:
                connect(m, unit.request, wiring.flipped(self.texel_request))
                connect(m, wiring.flipped(self.texel_response), unit.response)
            elif unit.model.texture.memory.written:
                self._load_texels(m, unit.write)
        return albedo, (source.valid, source.ready)

    def _load_texels(self, m: Module, texels: stream.Interface) -> None:
        """Load texels, a cycle after their writes were taken."""
        of_texels = Signal(name="of_texels")
        write = self.write.payload
        m.d.sync += [
            of_texels.eq((write.address == TEXELS_ADDRESS) | (write.address == TEXEL_ADDRESS)),
            texels.payload.begins.eq(write.address == TEXELS_ADDRESS),
            texels.payload.value.eq(write.data),
        ]
        m.d.comb += texels.valid.eq(self._written & of_texels)

    def _admit(self, m: Module, frame: FrameConstantsUnit, sinks: list[tuple[Value, Value]]) -> Value:
        """Accept spans and writes. Returns whether a span of 1 pixel or more is accepted on this cycle.

        If every sink is ready, all sinks accept the span on the same cycle. A write is accepted while no span
        is inside. Some interpolators take the words of a span in turns. They have begun the span before it is
        accepted (`has_begun`).

        Parameters
        ----------
        m : Module
            Module that gets the logic.
        frame : FrameConstantsUnit
            The constants.
        sinks : list of tuple of Value
            Valid and ready of each unit that takes spans.
        """
        admit, nonempty, settled, unlocked = (Signal() for _ in range(4))
        written = self._written
        idle, write_waits = Signal(name="idle", init=1), self.write.valid
        hold = ~idle
        has_pixels = self.i.payload.length != 0
        begun = None if self._interpolator is None else self._interpolator.has_begun
        if begun is not None:
            hold, write_waits = hold | begun, write_waits & ~begun
            # A span that has begun has pixels. So in this case no path leads from the length to the sinks.
            has_pixels |= begun
        m.d.comb += [
            nonempty.eq(self.i.valid & has_pixels),
            unlocked.eq(~write_waits & ~written & settled),
            self.i.ready.eq(reduce(and_, (ready for _, ready in sinks), unlocked)),
            admit.eq(nonempty & self.i.ready),
        ]
        for index, (valid, _) in enumerate(sinks):
            others = (ready for k, (_, ready) in enumerate(sinks) if k != index)
            m.d.comb += valid.eq(reduce(and_, others, nonempty & unlocked))

        connect(m, wiring.flipped(self.write), frame.write)
        # A constant has its value two cycles after its write.
        m.d.sync += written.eq(self.write.valid & self.write.ready)
        # ``inside`` lags a cycle behind, so that no path leads from the ports into the sum.
        inside = Signal(range(self.spans_inside + 1))
        came, went = Signal(name="came"), Signal(name="went")
        finished = self.o.valid & self.o.ready & self.o.payload.last
        is_one = Mux(came ^ went, inside == Mux(went, 2, 0), inside == 1)
        m.d.comb += frame.hold.eq(hold)
        m.d.sync += [
            came.eq(admit),
            went.eq(finished),
            inside.eq(inside + came - went),
            idle.eq(~admit & (idle | (finished & is_one))),
        ]
        if (p := self.model).materials > 1:
            # Constants follow the index one cycle later, and the slope of the exponent some cycles later.
            material, waited = existing_material(self.i.payload.material, p.materials), Signal(2)
            with m.If(self.i.valid & (material != frame.material)):
                m.d.sync += waited.eq(0)
                with m.If(idle):
                    m.d.sync += frame.material.eq(material)
            with m.Elif(~waited.all()):
                m.d.sync += waited.eq(waited + 1)
            # Ready does not depend on a payload that is not valid, because its bits may be unknown.
            same = (material == frame.material) & waited.all()
            m.d.comb += settled.eq(~self.i.valid | same)
        else:
            m.d.comb += settled.eq(1)
        return admit

    def _count(self, m: Module, admit: Value) -> None:
        """Drive the counters of `status_shape`."""
        span, status = self.i.payload, self.status
        for counter, event in (
            (status.out_of_range_spans, self._interpolator.out_of_range if self._interpolator else 0),
            (status.empty_spans, self.i.valid & self.i.ready & (span.length == 0)),
            (status.overrun, admit & (span.x + span.length > 1 << self.model.x_bits)),
        ):
            seen = Signal(name="seen")
            m.d.sync += seen.eq(event)
            with m.If(seen & ~counter.all()):
                m.d.sync += counter.eq(counter + 1)

    def _shade(
        self, m: Module, frame: FrameConstantsUnit, albedo: stream.Interface | None
    ) -> list[tuple[Value, Value]]:
        """Connect the units from spans to colours. Returns valid and ready of the units that take spans."""
        span = self.i.payload
        m.submodules.interpolator = interpolator = self._interpolator
        m.submodules.intensity = self._shading.intensity
        sinks = [(interpolator.i.valid, interpolator.i.ready)]
        words = interpolator.i.payload
        m.d.comb += copy_fields(words, span)
        for vectors, light in zip(interpolator.light_vectors, frame.constants.lights, strict=False):
            m.d.comb += copy_fields(vectors, light, ("direction", "halfway"))
        operands, gated = interpolator.o, None
        if self._gate is not None:
            operands, gated = self._decide(m, frame, sinks)
        if self._further:
            connect_lanes(
                m,
                self._lanes,
                frame.constants,
                operands,
                self._assembler.colors,
                self.write.payload,
                self._written,
            )
            return sinks
        self._shading.connect_tables(m, self.write.payload, self._written)
        self._shading.connect(m, frame.constants, operands, gated, albedo, self._assembler.colors)
        return sinks

    def _decide(self, m: Module, frame: FrameConstantsUnit, sinks: list) -> tuple[stream.Interface, Value]:
        """Hold the operands of each span until the gate has decided. Returns operands and decisions."""
        p, span = self.model, self.i.payload
        m.submodules.highlight_gate = gate = self._gate
        width = p.length_bits
        m.submodules.lengths = lengths = fifo.SyncFIFOBuffered(width=width, depth=self._waiting_spans)
        m.submodules.decisions = decisions = fifo.SyncFIFOBuffered(width=p.lights, depth=self._waiting_spans)
        # The gate is not always ready on the same cycles as the setup.
        waiting = gate.i.signature.flip().create(path=("waiting",))
        connect_fifo(m, "undecided", waiting, gate.i, depth=3)
        sinks += [(waiting.valid, waiting.ready), (lengths.w_en, lengths.w_rdy)]
        source = self._interpolator.o
        operands = source.signature.create(path=("decided",))
        pixel, last = Signal(p.length_bits), Signal()
        moves = operands.valid & operands.ready
        m.d.comb += [
            *copy_fields(waiting.payload, span),
            lengths.w_data.eq(span.length),
            decisions.w_data.eq(gate.o.payload),
            decisions.w_en.eq(gate.o.valid),
            gate.o.ready.eq(decisions.w_rdy),
            # A pixel waits for the decision of its span. The length of the span comes before the decision.
            copy(operands.payload, source.payload),
            operands.valid.eq(source.valid & decisions.r_rdy),
            source.ready.eq(operands.ready & decisions.r_rdy),
            last.eq(pixel == lengths.r_data - 1),
            lengths.r_en.eq(moves & last),
            decisions.r_en.eq(moves & last),
        ]
        for index in range(p.lights):
            m.d.comb += gate.constants.halfway[index].eq(frame.constants.lights[index].halfway)
        for name in ("threshold", "exponent"):
            if name in gate.constants.shape().members:
                m.d.comb += gate.constants[name].eq(frame.constants[name])
        with m.If(moves):
            m.d.sync += pixel.eq(Mux(last, 0, pixel + 1))
        return operands, ~decisions.r_data
