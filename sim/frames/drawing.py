"""Frames in bands by simulated hardware: a drawing's pixels band by band, its cycles and counters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from amaranth.hdl import Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.video.draw_unit import Drawing
from blysk.hdl.geometry.triangles import counters_shape
from blysk.hdl.video.draw_unit import STATUS, DrawUnit, band_shape, drawn_band_pixel_shape
from blysk.sim.engines.simulate import simulate

__all__ = ["DrawingSimulator", "DrawnBands", "MergedDrawUnit"]


class MergedDrawUnit(wiring.Component):
    """A `DrawUnit` with one output stream: pixels, and after the last pixel of a band a beat with ``done``.

    Parameters
    ----------
    model : Drawing
        What is drawn.
    """

    def __init__(self, model: Drawing):
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
        """A pixel goes before ``done``; the buttons keep the value of the last request."""
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
            # A beat that waits must not change, where there is no pixel either.
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
    """Bands of simulated hardware, in the order in which they were asked for.

    Parameters
    ----------
    band : int64 array, shape (B,)
        Index of each band.
    pixels : list of arrays
        Output beats of each band's pixels: x, y, r, g, b.
    cycles : int64 array, shape (B,)
        Cycles of each band from its request to its ``done``, with the clearing after the previous band.
    counts : dict of str to int
        `STATUS` at the end.
    """

    band: np.ndarray
    pixels: list[np.ndarray]
    cycles: np.ndarray
    counts: dict[str, int]

    def pictures(self, drawing: Drawing, background: Sequence[int] = (0, 0, 0)) -> list[np.ndarray]:
        """Frame buffers, uint8 (height, width, 3); band 0 starts one, the bands after it must be in order."""
        images: list[np.ndarray] = []
        for band, pixels in zip(self.band, self.pixels, strict=True):
            if band == 0:
                images.append(np.full((drawing.size[1], drawing.size[0], 3), background, dtype=np.uint8))
            color = np.stack([pixels[channel] for channel in "rgb"], axis=-1)
            images[-1][band * drawing.lines + pixels["y"].astype(int), pixels["x"]] = color
        return images


class DrawingSimulator:
    """A `DrawUnit`, built once.

    Parameters
    ----------
    drawing : Drawing
        What is drawn.
    engine : str
        As `simulate` has it.
    """

    def __init__(self, drawing: Drawing, engine: str = "auto"):
        self.drawing, self.engine = drawing, engine
        self._unit = MergedDrawUnit(drawing)

    def run(self, bands: Sequence[int], buttons: Sequence[int] | None = None, **stalls) -> DrawnBands:
        """Ask for bands, and collect their pixels.

        Parameters
        ----------
        bands : sequence of int
            Indices.
        buttons : sequence of int, optional
            Buttons that are pressed from each request on; 0 by default.
        **stalls
            ``input_stalls`` and ``output_stalls`` of `simulate`.

        Raises
        ------
        SimulationError
            If the hardware breaks the stream's rules or stops.
        """
        pressed = np.zeros(len(bands), dtype=int) if buttons is None else np.asarray(buttons)
        triangles = self.drawing.mesh.triangles
        run = simulate(
            self._unit,
            {"band": np.asarray(bands), "buttons": pressed},
            count=None,
            engine=self.engine,
            idle_timeout=20_000 + 40 * self.drawing.mesh.vertices + 20 * triangles,
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
