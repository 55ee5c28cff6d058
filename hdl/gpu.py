"""The GPU: from a mesh in memory to the lanes of a monitor."""

from amaranth.hdl import Module, Signal
from amaranth.lib import data, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from blysk.golden.gpu import Gpu
from blysk.golden.video.serialiser import LANES
from blysk.hdl.bus.loader import STATUS as LOADED
from blysk.hdl.bus.loader import LoaderUnit, loader_members
from blysk.hdl.core.stream import connect
from blysk.hdl.core.views import copy_fields
from blysk.hdl.geometry.triangles import counters_shape
from blysk.hdl.video.display import DisplayUnit
from blysk.hdl.video.draw_unit import STATUS as DRAWN
from blysk.hdl.video.draw_unit import DrawUnit

__all__ = ["STATUS", "GpuUnit"]

STATUS = (*DRAWN, "late_bands", "frames_shown")
"""Counters of `GpuUnit`: those of `DrawUnit`, then those of `DisplayUnit`."""


class GpuUnit(wiring.Component):
    """Draws a mesh by a `DrawUnit`, and shows it by a `DisplayUnit`. `Gpu` is the bit-accurate model.

    There are three clocks, see `DisplayUnit`. While the display shows a band, the next band is drawn.

    Parameters
    ----------
    model : Gpu
        Bit-accurate model, with all contents of memories.

    Members
    -------
    buttons : :py:`In(4)`
        Buttons, from any clock; see `ControlsUnit`.
    pairs : :py:`Out(data.ArrayLayout(2, 4))`
        Pairs of bits for the lanes, in the domain ``serial``; see `DisplayUnit`.
    status : :py:`Out(counters_shape(*STATUS))`
        Counters since the reset. With a loader there are those of `LoaderUnit`, too.
    line, flash, resting, dropped
        Members of `LoaderUnit` at the border of the chip, see `loader_members`. Only with a loader.

    Source: docs/theory/video.md#bands.
    """

    def __init__(self, model: Gpu):
        self.model = model
        self.draw = DrawUnit(model.drawing, model.loader is not None)
        self.display = DisplayUnit(model.buffer)
        names, members = STATUS, {}
        if model.loader is not None:
            names, members = (*STATUS, *LOADED), loader_members(model.loader)
            self.loader = LoaderUnit(model.loader)
        super().__init__(
            {
                "buttons": In(self.draw.signature.members["buttons"].shape),
                "pairs": Out(data.ArrayLayout(2, LANES)),
                "status": Out(counters_shape(*names)),
                **members,
            }
        )

    def elaborate(self, platform):
        """The two units, and the streams between them."""
        m = Module()
        m.submodules.draw, m.submodules.display = draw, display = self.draw, self.display
        pressed = Signal.like(self.buttons, name="pressed")
        m.submodules.pressed = FFSynchronizer(self.buttons, pressed)
        for source, sink in ((display.request, draw.request), (draw.done, display.done)):
            wiring.connect(m, source, sink)
        drawn, taken = draw.pixels, display.pixels
        m.d.comb += [
            draw.buttons.eq(pressed),
            *copy_fields(taken.payload, drawn.payload, "xyrgb"),
            taken.valid.eq(drawn.valid),
            drawn.ready.eq(taken.ready),
            self.pairs.eq(display.pairs),
            *copy_fields(self.status, draw.status, DRAWN),
            self.status.late_bands.eq(display.status.late_bands),
            self.status.frames_shown.eq(display.status.frames),
        ]
        if self.model.loader is not None:
            self._load(m)
        return m

    def _load(self, m: Module) -> None:
        """The loader, which writes while the drawing rests."""
        m.submodules.loader = loader = self.loader
        connect(m, loader.o, self.draw.load)
        m.d.comb += [
            self.draw.rest.eq(loader.resting),
            self.resting.eq(loader.resting),
            self.dropped.eq(loader.dropped),
            *copy_fields(self.status, loader.status, LOADED),
        ]
        if self.model.loader.uart is not None:
            m.d.comb += loader.line.eq(self.line)
        if self.model.loader.flash is not None:
            wiring.connect(m, wiring.flipped(self.flash), loader.flash)
