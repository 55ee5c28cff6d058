"""Pixel assembler: gives each shaded colour its coordinates."""

from amaranth.hdl import Cat, Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.lighting.intensity import pixel_color_shape

__all__ = ["PixelAssemblerUnit", "coordinates_shape", "pixel_shape"]


def coordinates_shape(x_bits: int = 12, y_bits: int = 12, length_bits: int = 12) -> data.StructLayout:
    """Shape of a span's coordinates: first pixel and number of pixels."""
    return data.StructLayout({"x": unsigned(x_bits), "y": unsigned(y_bits), "length": unsigned(length_bits)})


def pixel_shape(x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a pixel: coordinates, colour, and whether it is the last pixel of its span."""
    return data.StructLayout(
        {
            "x": unsigned(x_bits),
            "y": unsigned(y_bits),
            "r": unsigned(8),
            "g": unsigned(8),
            "b": unsigned(8),
            "last": unsigned(1),
        }
    )


class PixelAssemblerUnit(wiring.Component):
    """Joins the streams of colours and of spans' coordinates, counts x along the span and marks its end.

    A colour leaves as a pixel 1 cycle after it was accepted. A colour is accepted on every cycle if its
    coordinates came a cycle before. Coordinates may come long before their colours. The unit has no
    multipliers.

    Parameters
    ----------
    x_bits, y_bits, length_bits : int
        Bits of the coordinates and of a span's length.

    Members
    -------
    coordinates : :py:`In(stream.Signature(coordinates_shape(x_bits, y_bits, length_bits)))`
        Coordinates of each span, of 1 pixel or more. Past the largest x, x goes on from 0.
    colors : :py:`In(stream.Signature(pixel_color_shape()))`
        Colours, in the order of the spans' pixels.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels.

    Source: docs/theory/units.md#pipeline.
    """

    latency = 1

    coordinates_latency = 2
    """Cycles from coordinates to their first pixel, if the colour waits."""

    SPANS_INSIDE = 4
    """Largest number of spans inside: coordinates of two spans, and two waiting pixels of other spans."""

    def __init__(self, x_bits: int = 12, y_bits: int = 12, length_bits: int = 12):
        super().__init__(
            {
                "coordinates": In(stream.Signature(coordinates_shape(x_bits, y_bits, length_bits))),
                "colors": In(stream.Signature(pixel_color_shape())),
                "o": Out(stream.Signature(pixel_shape(x_bits, y_bits))),
            }
        )

    def elaborate(self, platform):
        """Coordinates of spans become coordinates of pixels. They meet the colours in a pixel register."""
        m = Module()
        span, color = self.coordinates.payload, self.colors.payload
        x, y = Signal.like(span.x), Signal.like(span.y)
        load, moves = Signal(), Signal()
        active, ends = count_down(m, self.coordinates.valid, span.length, moves)
        position = stream.Signature(data.StructLayout({"x": x.shape(), "y": y.shape(), "last": 1})).create()
        m.d.comb += [
            moves.eq(skid_buffer(m, position, active, Cat(x, y, ends))),
            self.coordinates.ready.eq(moves & ends),
            load.eq(self.coordinates.ready & self.coordinates.valid),
        ]
        with m.If(load):
            m.d.sync += [x.eq(span.x), y.eq(span.y)]
        with m.Elif(moves):
            m.d.sync += x.eq(x + 1)

        pixel, valid, advance = Signal(self.o.payload.shape()), Signal(), Signal()
        m.d.comb += [
            advance.eq(skid_buffer(m, self.o, valid, pixel)),
            self.colors.ready.eq(advance & position.valid),
            position.ready.eq(advance & self.colors.valid),
        ]
        with m.If(advance):
            m.d.sync += [
                valid.eq(position.valid & self.colors.valid),
                *(pixel[name].eq(position.payload[name]) for name in ("x", "y", "last")),
                *(pixel[name].eq(color[name]) for name in "rgb"),
            ]
        return m
