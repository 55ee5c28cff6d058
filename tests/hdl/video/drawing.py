"""A `DrawUnit` with one output stream, and its simulated bands: pixels, cycles and counters."""

from dataclasses import dataclass

import numpy as np
from amaranth.hdl import Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.geometry.triangles import counters_shape
from blysk.hdl.video.draw_unit import STATUS, DrawUnit, band_shape, drawn_band_pixel_shape
from blysk.sim.engines.simulate import simulate


class MergedDrawUnit(wiring.Component):
    """Output beats: pixels, and after the last pixel of a band a beat with ``done``."""

    def __init__(self, model):
        self.model, self.unit = model, DrawUnit(model)
        design = model.renderer.design
        pixel = drawn_band_pixel_shape(design.x_bits, design.y_bits)
        band = band_shape(model.bands)
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout({"band": band, "buttons": unsigned(4)}))),
                "o": Out(
                    stream.Signature(data.StructLayout({"pixel": pixel, "done": unsigned(1), "band": band}))
                ),
                "status": Out(counters_shape(*STATUS)),
            }
        )

    def elaborate(self, platform):
        """A pixel goes before ``done``. The buttons keep the value of the last request."""
        m = Module()
        m.submodules.unit = unit = self.unit
        buttons = Signal(4, name="buttons")
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += buttons.eq(self.i.payload.buttons)
        m.d.comb += [
            unit.request.payload.eq(self.i.payload.band),
            unit.request.valid.eq(self.i.valid),
            self.i.ready.eq(unit.request.ready),
            unit.buttons.eq(buttons),
            # A beat that waits must not change, also where it has no pixel.
            Value.cast(self.o.payload.pixel).eq(Mux(unit.pixels.valid, Value.cast(unit.pixels.payload), 0)),
            self.o.payload.band.eq(unit.done.payload),
            self.o.payload.done.eq(~unit.pixels.valid),
            self.o.valid.eq(unit.pixels.valid | unit.done.valid),
            unit.pixels.ready.eq(self.o.ready),
            unit.done.ready.eq(self.o.ready & ~unit.pixels.valid),
            self.status.eq(unit.status),
        ]
        return m


@dataclass(frozen=True)
class DrawnBands:
    """Bands in the order of their requests.

    The cycles of a band go from its request to its ``done``, with the clearing after the band before.
    """

    band: np.ndarray
    pixels: list[np.ndarray]
    cycles: np.ndarray
    counts: dict[str, int]


class DrawingSimulator:
    """A `DrawUnit`, built once."""

    def __init__(self, drawing):
        self.drawing, self.unit = drawing, MergedDrawUnit(drawing)

    def run(self, bands, buttons=None, **stalls):
        """Request bands, and collect their pixels. ``buttons`` are pressed from each request on."""
        mesh = self.drawing.mesh
        run = simulate(
            self.unit,
            {"band": np.asarray(bands), "buttons": np.asarray(buttons or [0] * len(bands))},
            count=None,
            engine="auto",
            idle_timeout=20_000 + 40 * mesh.vertices + 20 * mesh.triangles,
            **stalls,
        )
        ends = np.flatnonzero(run.beats["done"])
        starts = np.r_[0, ends[:-1] + 1]
        before = np.r_[run.input_cycles[0], run.cycles[ends[:-1]]]
        return DrawnBands(
            band=run.beats["band"][ends].astype(np.int64),
            pixels=[run.beats["pixel"][start:end] for start, end in zip(starts, ends, strict=True)],
            cycles=run.cycles[ends] - before,
            counts={name: int(run.status[name]) for name in STATUS},
        )
