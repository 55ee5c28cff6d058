"""From the operands of pixels to their colours: the lights, the intensity and the transfer of a pipeline."""

from collections.abc import Iterator, Sequence
from functools import reduce
from operator import and_

from amaranth.hdl import Module, Signal, Value
from amaranth.lib import data, stream, wiring

from blysk.golden.frame_constants import LOBE_ADDRESS
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.pipeline import ShadingPipeline
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy
from blysk.hdl.lighting.colored_intensity import intensity_unit
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.factor import FactorUnit
from blysk.hdl.lighting.light import LightUnit, kind_of
from blysk.hdl.lighting.transfer import TransferUnit

__all__ = ["COMPACT_INTERVAL", "PixelShading", "connect_lanes", "each_lane"]

COMPACT_INTERVAL = 3
"""Least cycles of a pixel in the compact style, also with one channel.

The products of a pixel share multipliers for these cycles. Three channels need at least this number of
cycles.
"""


class PixelShading:
    """The units of a pipeline between operands and colours, and their connections.

    Parameters
    ----------
    model : ShadingPipeline
        Design of the pipeline.

    Attributes
    ----------
    lights : list
        Light units. Without specular light they are diffuse units.
    slope, tables : Component or None
        Slopes or tables that the lights share.
    intensity : Component or None
        Intensity unit; ``None`` if colours are constant, without lights and albedo.
    transfer : TransferUnit or None
        Transfer unit, if the transfer is not linear.
    light_latency, latency : int
        Cycles from the operands to the terms, and cycles from the operands to the colours.
    cycles_per_pixel : int
        Cycles that a pixel with every term takes.
    """

    def __init__(self, model: ShadingPipeline):
        self.model = p = model
        self.slope = self.tables = self.intensity = self.transfer = None
        self.lights = self._light_units() if p.lights else []
        if p.lights or p.albedo:
            self.intensity = intensity_unit(p.intensity, p.build.compact)
        if p.transfer != "linear":
            # Constant colours are encoded on every cycle.
            channels = p.intensity.channels
            interval = channels if p.build.compact and self.intensity is not None else 1
            self.transfer = TransferUnit(channels=channels, initiation_interval=interval)
        self.light_latency = max((light.latency for light in self.lights), default=0)
        behind = [unit for unit in (self.intensity, self.transfer) if unit is not None]
        self.latency = self.light_latency + sum(unit.latency for unit in behind)
        paced = [*self.lights[:1], *([] if self.intensity is None else [self.intensity])]
        self.cycles_per_pixel = max((unit.initiation_interval for unit in paced), default=1)

    def _light_units(self) -> list:
        """Make the light units (diffuse units without specular light), and their shared slopes or tables."""
        p = self.model
        compact, exponent = p.build.compact, p.build.exponent
        diffuse = Diffuse(p.interpolator.COSINE_FORMAT)
        if p.specular is None:
            return [DiffuseUnit(diffuse) for _ in range(p.lights)]
        self._kind = kind = kind_of(p.specular)
        if exponent is None and kind.slope_unit:
            self.slope = kind.slope_unit(p.specular)
        if kind.memory:
            self.tables = kind.memory(p.specular, p.lights)
        # Lights in lockstep need equal latencies. So if one light fades, every light has a factor unit.
        waiting = range(p.lights) if p.factors and not compact else p.factors
        interval = max(kind.compact_interval(p.specular, exponent), COMPACT_INTERVAL) if compact else 1
        return [
            LightUnit(
                p.specular,
                diffuse,
                initiation_interval=interval,
                exponent=exponent,
                shares_slope=self.slope is not None or self.tables is not None,
                gated=p.gate,
                factor=FactorUnit(has_factor=index in p.factors) if index in waiting else None,
            )
            for index in range(p.lights)
        ]

    def connect(
        self,
        m: Module,
        constants: data.View,
        operands: stream.Interface | None,
        gated: Value | None,
        albedo: stream.Interface | None,
        colors: stream.Interface,
    ) -> None:
        """Connect the units, from operands to colours.

        Parameters
        ----------
        m : Module
            Module of the pipeline. The intensity unit is its submodule already.
        constants : View
            Frame constants.
        operands : stream.Interface or None
            Operands of pixels; ``None`` without lights.
        gated : Value or None
            Decision of a gate for each light; ``None`` without a gate.
        albedo : stream.Interface or None
            Albedo of pixels. ``None``: pixels have no albedo.
        colors : stream.Interface
            Colours of pixels.
        """
        p, intensity = self.model, self.intensity
        if self.slope is not None:
            m.submodules.slope = self.slope
            m.d.comb += self.slope.exponent.eq(constants.exponent)
        self._connect_lights(m, operands, albedo)
        for index, light in enumerate(self.lights):
            m.submodules[f"light_{index}"] = light
            of_light = constants.lights[index]
            m.d.comb += [
                copy(intensity.constants.diffuse[index], of_light.diffuse),
                copy(intensity.constants.specular[index], of_light.specular),
            ]
            words, terms = operands.payload[index], light.o.payload
            if p.specular is None:
                m.d.comb += [light.i.payload.eq(words.cosine), intensity.i.payload.diffuse[index].eq(terms)]
                continue
            m.d.comb += [
                light.i.payload.cosine.eq(words.cosine),
                light.i.payload.highlight.eq(words.highlight),
                intensity.i.payload.diffuse[index].eq(terms.diffuse),
                intensity.i.payload.specular[index].eq(terms.specular),
            ]
            if gated is not None:
                m.d.comb += light.i.payload.gated.eq(gated[index])
            if light.fades:
                m.d.comb += light.i.payload.factor.eq(words.factor)
            if self.slope is not None:
                m.d.comb += copy(light.constants, self.slope.slope)
            elif "constants" in light.signature.members:
                word = constants[self._kind.constant]
                m.d.comb += Value.cast(light.constants).eq(word)
        m.d.comb += copy(intensity.constants.ambient, constants.ambient)
        if albedo is not None:
            m.d.comb += [
                copy(intensity.i.payload.albedo, albedo.payload),
                copy(intensity.constants.emission, constants.emission),
            ]
            if p.albedo.tints:
                m.d.comb += intensity.constants.tinted.eq(constants.tinted)
        connect(m, intensity.o, self._encoded(m, colors))

    def connect_tables(self, m: Module, write: data.View, written: Value) -> None:
        """Connect the tables of the lights, if the lights have tables. Writes of frame constants load them.

        Parameters
        ----------
        m : Module
            Module of the pipeline.
        write : View
            Payload of the write port.
        written : Value
            Whether a write was taken on the cycle before.
        """
        if self.tables is None:
            return
        m.submodules.tables = self.tables
        for light, read in zip(self.lights, self.tables.reads, strict=True):
            wiring.connect(m, light.table, read)
        if self.tables.tables is None:
            # Two registers tell whether a write was taken, and whether its address is that of the tables.
            of_table = Signal(name="of_table")
            m.d.sync += [
                of_table.eq(write.address == LOBE_ADDRESS),
                Value.cast(self.tables.write.payload).eq(write.data),
            ]
            m.d.comb += self.tables.write.valid.eq(written & of_table)

    def _connect_lights(
        self, m: Module, operands: stream.Interface | None, albedo: stream.Interface | None
    ) -> None:
        """Connect operands, lights, albedo and intensity unit, with their handshakes.

        In lockstep equal units with the same handshakes are in the same state on every cycle. So the
        handshake of the first unit serves all. If lights skip beats, either all lights accept a beat on a
        cycle, or none does.
        """
        intensity = self.intensity
        lockstep = self.model.specular is None or not (self.lights and self.lights[0].skips_dark)
        leaders = self.lights[:1] if lockstep else self.lights
        ready, terms = intensity.i.ready, [light.o.valid for light in leaders]
        if albedo is not None:
            # The intensity unit takes the terms and the albedo of a pixel together.
            ready = ready & albedo.valid
            m.d.comb += albedo.ready.eq(reduce(and_, terms, intensity.i.ready))
            terms.append(albedo.valid)
        for light in self.lights:
            others = [other for other in leaders if other is not light and not lockstep]
            m.d.comb += [
                light.i.valid.eq(reduce(and_, (other.i.ready for other in others), operands.valid)),
                light.o.ready.eq(reduce(and_, (other.o.valid for other in others), ready)),
            ]
        if self.lights:
            m.d.comb += operands.ready.eq(reduce(and_, (light.i.ready for light in leaders)))
        m.d.comb += intensity.i.valid.eq(reduce(and_, terms))

    def connect_constant(self, m: Module, ambient: data.View, colors: stream.Interface) -> None:
        """Give every pixel of a pipeline without lights the ambient colour."""
        p, encoded = self.model, self._encoded(m, colors)
        for channel, name in enumerate("rgb"):
            light = ambient[0 if p.grey else channel]
            level = light.round_half_up(p.intensity.fraction_bits).saturate(p.intensity.result_format)
            m.d.comb += encoded.payload[name].eq(level.as_value())
        m.d.comb += colors.valid.eq(1)

    def _encoded(self, m: Module, colors: stream.Interface) -> stream.Interface:
        """Stream that takes the colours: the input of the transfer unit, or ``colors`` without this unit."""
        transfer = self.transfer
        if transfer is None:
            return colors
        m.submodules.transfer = transfer
        if self.intensity is not None:
            connect(m, transfer.o, colors)
        else:
            # Constant colours never wait. After a write they are encoded before the next span needs them.
            m.d.comb += [
                copy(colors.payload, transfer.o.payload),
                transfer.i.valid.eq(1),
                transfer.o.ready.eq(1),
            ]
        return transfer.i


def each_lane(
    m: Module, lanes: Sequence[PixelShading], colors: stream.Interface
) -> Iterator[tuple[Module, PixelShading, stream.Interface]]:
    """Module, shading, and stream of colours of each lane of a pipeline.

    The first lane is in the pipeline's module, and its handshakes serve all lanes.

    Parameters
    ----------
    m : Module
        Module of the pipeline. Further lanes are its submodules ``lane_1``, ``lane_2``, ...
    lanes : sequence of PixelShading
        Shading of each lane.
    colors : stream.Interface
        Colours of a beat: an array of the colours of all lanes.
    """
    for index, shading in enumerate(lanes):
        lane, inner = f"lane_{index}", m
        if index:
            m.submodules[lane] = inner = Module()
        own = stream.Signature(colors.payload[index].shape()).create(path=(lane, "colors"))
        yield inner, shading, own
        m.d.comb += [copy(colors.payload[index], own.payload), own.ready.eq(colors.ready)]
        if not index:
            m.d.comb += colors.valid.eq(own.valid)


def connect_lanes(
    m: Module,
    lanes: Sequence[PixelShading],
    constants: data.View,
    operands: stream.Interface,
    colors: stream.Interface,
    write: data.View,
    written: Value,
) -> None:
    """Connect the shading of each lane, from the operands of a beat to its colours.

    The units of all lanes are equal and have the same handshakes. So they are in the same state on every
    cycle.

    Parameters
    ----------
    m, lanes, colors
        As for `each_lane`. The intensity unit of the first lane is a submodule already.
    constants : View
        Frame constants.
    operands : stream.Interface
        Operands of a beat: an array of the operands of all lanes.
    write, written
        As for `PixelShading.connect_tables`.
    """
    for index, (inner, shading, own) in enumerate(each_lane(m, lanes, colors)):
        words = operands.payload[index]
        of_lane = stream.Signature(words.shape()).create(path=(f"lane_{index}", "operands"))
        if index:
            inner.submodules.intensity = shading.intensity
        shading.connect_tables(inner, write, written)
        shading.connect(inner, constants, of_lane, None, None, own)
        m.d.comb += [copy(of_lane.payload, words), of_lane.valid.eq(operands.valid)]
        if not index:
            m.d.comb += operands.ready.eq(of_lane.ready)
