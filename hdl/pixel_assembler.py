"""Pixel assembler: gives each shaded colour its place on the screen."""

from amaranth.hdl import Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .intensity import pixel_color_shape

__all__ = ["PixelAssemblerUnit", "pixel_shape", "place_shape"]


def place_shape(x_bits: int = 12, y_bits: int = 12, length_bits: int = 12) -> data.StructLayout:
    """Shape of a span's place: first pixel and number of pixels."""
    return data.StructLayout({"x": unsigned(x_bits), "y": unsigned(y_bits), "length": unsigned(length_bits)})


def pixel_shape(x_bits: int = 12, y_bits: int = 12) -> data.StructLayout:
    """Shape of a pixel: place, colour, and whether it is the last of its span."""
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
    """Joins the stream of colours with that of span places; counts x along the span and marks its end.

    The latency is 1 clock and the initiation interval 1. No multipliers.

    Parameters
    ----------
    x_bits, y_bits, length_bits : int
        Bits of the coordinates and of a span's length.

    Members
    -------
    places : :py:`In(stream.Signature(place_shape(x_bits, y_bits, length_bits)))`
        Place of each span; waits until the span's last pixel has gone. Past the largest x it starts at 0.
    colors : :py:`In(stream.Signature(pixel_color_shape()))`
        Colours, in the order of the spans' pixels.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels.

    Source: pipeline.md, "Span stream".
    """

    latency = 1

    def __init__(self, x_bits: int = 12, y_bits: int = 12, length_bits: int = 12):
        super().__init__(
            {
                "places": In(stream.Signature(place_shape(x_bits, y_bits, length_bits))),
                "colors": In(stream.Signature(pixel_color_shape())),
                "o": Out(stream.Signature(pixel_shape(x_bits, y_bits))),
            }
        )

    def elaborate(self, platform):
        """An offset counter and an output register."""
        m = Module()
        offset = Signal.like(self.places.payload.length)
        advance, take, last = Signal(), Signal(), Signal()
        place, color, pixel = self.places.payload, self.colors.payload, self.o.payload
        m.d.comb += [
            advance.eq(~self.o.valid | self.o.ready),
            self.colors.ready.eq(advance & self.places.valid),
            take.eq(self.colors.ready & self.colors.valid),
            last.eq(offset == place.length - 1),
            self.places.ready.eq(take & last),
        ]
        with m.If(advance):
            m.d.sync += self.o.valid.eq(take)
        with m.If(take):
            m.d.sync += [
                offset.eq(offset + 1),
                pixel.x.eq(place.x + offset),
                pixel.y.eq(place.y),
                pixel.r.eq(color.r),
                pixel.g.eq(color.g),
                pixel.b.eq(color.b),
                pixel.last.eq(last),
            ]
            with m.If(last):
                m.d.sync += offset.eq(0)
        return m
