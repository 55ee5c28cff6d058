"""A source of bands in place of a renderer: a moving pattern, one pixel a cycle, with pauses."""

import numpy as np
from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from blysk.hdl.video.display import DisplayUnit

__all__ = ["PatternTop", "picture"]


class PatternTop(wiring.Component):
    """A display whose bands hold ``(x, y, x ^ y ^ frame)`` in every pixel, except those of every eighth
    column.

    Without ``moves`` every frame is the first.
    """

    def __init__(self, model, pause=0, moves=True):
        self.display, self.pause, self.moves = DisplayUnit(model), pause, moves
        members = self.display.signature.members
        super().__init__({name: Out(members[name].shape) for name in ("pairs", "status")})

    def elaborate(self, platform):
        m = Module()
        m.submodules.display = display = self.display
        given = display.model
        width = given.mode.horizontal.visible
        m.d.comb += [self.pairs.eq(display.pairs), self.status.eq(display.status)]
        pixel, request, done = display.pixels.payload, display.request, display.done
        band, x, y = Signal.like(request.payload), Signal.like(pixel.x), Signal.like(pixel.y)
        frame, pause = Signal(8, init=255), Signal(range(self.pause + 2))
        line = Cat(y, band)
        m.d.comb += [
            pixel.x.eq(x),
            pixel.y.eq(y),
            pixel.r.eq(x),
            pixel.g.eq(line),
            pixel.b.eq(x ^ line ^ (frame if self.moves else 0)),
            done.payload.eq(band),
        ]
        with m.FSM():
            with m.State("ask"):
                m.d.comb += request.ready.eq(1)
                m.d.sync += [band.eq(request.payload), pause.eq(0), x.eq(0), y.eq(0)]
                with m.If(request.valid):
                    m.d.sync += frame.eq(frame + (request.payload == 0))
                    m.next = "pause"
            with m.State("pause"):
                m.d.sync += pause.eq(pause + 1)
                with m.If(pause == self.pause):
                    m.next = "draw"
            with m.State("draw"):
                m.d.comb += display.pixels.valid.eq(x[:3] != 7)
                with m.If(display.pixels.ready | ~display.pixels.valid):
                    m.d.sync += x.eq(x + 1)
                    with m.If(x == width - 1):
                        m.d.sync += [x.eq(0), y.eq(y + 1)]
                        with m.If(y == given.lines - 1):
                            m.next = "done"
            with m.State("done"):
                m.d.comb += done.valid.eq(1)
                with m.If(done.ready):
                    m.next = "ask"
        return m


def picture(model, frame):
    """The pattern of a frame."""
    width, height = model.mode.size
    y, x = np.mgrid[:height, :width]
    result = np.stack([x, y, x ^ y ^ frame], axis=-1) & 255
    result[x % 8 == 7] = model.background
    return result
