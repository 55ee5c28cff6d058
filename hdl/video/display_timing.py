"""Display timing: the pixel of a display on each cycle of the pixel clock, and its sync pulses."""

from amaranth.hdl import Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out

from blysk.golden.video.display_timing import Axis, DisplayMode, DisplayTiming

__all__ = ["DisplayTimingUnit", "timing_shape"]


def timing_shape(mode: DisplayMode) -> data.StructLayout:
    """Shape of a cycle: position, whether it is in the picture (``active``), both sync signals."""
    return data.StructLayout(
        {
            "x": unsigned((mode.horizontal.total - 1).bit_length()),
            "y": unsigned((mode.vertical.total - 1).bit_length()),
            "active": 1,
            "hsync": 1,
            "vsync": 1,
        }
    )


class DisplayTimingUnit(wiring.Component):
    """Two counters and the signals that follow from them. `DisplayTiming` is the bit-accurate model.

    The unit runs freely, because the display never waits. It gives a position each cycle. The first cycle
    after the reset is the model's cycle 0. The unit has no multipliers. Its clock is the pixel clock.

    Parameters
    ----------
    model : DisplayTiming
        Bit-accurate model.

    Members
    -------
    o : :py:`Out(timing_shape(model.mode))`
        Position, ``active`` and sync signals of the present cycle.

    Source: docs/theory/video.md#display.
    """

    def __init__(self, model: DisplayTiming | None = None):
        self.model = model or DisplayTiming()
        super().__init__({"o": Out(timing_shape(self.model.mode))})

    def elaborate(self, platform):
        """Count the pixels of a line. At the end of each line count the lines."""
        m = Module()
        line, frame = self.model.mode.horizontal, self.model.mode.vertical
        shape: data.StructLayout = self.o.shape()
        x, y = Signal(shape["x"].shape, name="x"), Signal(shape["y"].shape, init=frame.visible, name="y")
        m.d.sync += x.eq(x + 1)
        with m.If(x == line.total - 1):
            m.d.sync += [x.eq(0), y.eq(y + 1)]
            with m.If(y == frame.total - 1):
                m.d.sync += y.eq(0)
        m.d.comb += [
            self.o.x.eq(x),
            self.o.y.eq(y),
            self.o.active.eq((x < line.visible) & (y < frame.visible)),
            self.o.hsync.eq(_sync(x, line)),
            self.o.vsync.eq(Mux(x >= line.pulse[0], _sync(y, frame, 1), _sync(y, frame))),
        ]
        return m


def _sync(position: Value, axis: Axis, early: int = 0) -> Value:
    begin, end = axis.pulse
    pulse = (position >= begin - early) & (position < end - early)
    return pulse if axis.positive else ~pulse
