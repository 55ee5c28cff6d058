"""Pixel assembler: gives each shaded colour its coordinates."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.lighting.intensity import pixel_color_shape

__all__ = ["PixelAssemblerUnit", "beat_shape", "coordinates_shape", "pixel_shape"]


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


def beat_shape(x_bits: int = 12, y_bits: int = 12, lanes: int = 2) -> data.StructLayout:
    """Shape of the pixels of a beat of several lanes.

    - ``x``, ``y``: coordinates of the first pixel. Lane k has the pixel at ``x + k``.
    - ``present``: a bit for each lane with a pixel. Lane 0 always has a pixel. Lanes without a pixel are the
      last lanes.
    - ``colors``: the colour of each lane; 0 in a lane without a pixel.
    - ``last``: whether the beat is the last of its span.
    """
    colors = data.ArrayLayout(pixel_color_shape(), lanes)
    x, y = unsigned(x_bits), unsigned(y_bits)
    return data.StructLayout({"x": x, "y": y, "present": unsigned(lanes), "colors": colors, "last": 1})


class PixelAssemblerUnit(wiring.Component):
    """Joins the streams of colours and of spans' coordinates, counts x along the span and marks its end.

    A colour leaves as a pixel 1 cycle after it was accepted. A colour is accepted on every cycle if its
    coordinates came a cycle before. Coordinates may come long before their colours. The unit has no
    multipliers.

    With several lanes a beat of colours leaves as a beat of pixels, see `beat_shape`. The first beat begins
    at the first pixel of the span, at any column. With two lanes beats that begin at even columns would suit
    the words of a frame buffer. But a span would then take a further beat if it begins at an odd column and
    has an even number of pixels. Short spans would lose a large part of the gain. With N lanes a frame buffer
    of N banks, with column x in bank x mod N, writes each beat in one cycle.

    Parameters
    ----------
    x_bits, y_bits, length_bits : int
        Bits of the coordinates and of a span's length.
    lanes : int
        Pixels of a beat, 1, 2 or 4.

    Members
    -------
    coordinates : :py:`In(stream.Signature(coordinates_shape(x_bits, y_bits, length_bits)))`
        Coordinates of each span, of 1 pixel or more. Past the largest x, x goes on from 0.
    colors : :py:`In(stream.Signature(pixel_color_shape()))`
        Colours, in the order of the spans' pixels. With several lanes an array of colours. In the last beat
        of a span, colours past the last pixel have no effect.
    o : :py:`Out(stream.Signature(pixel_shape(x_bits, y_bits)))`
        Pixels. With several lanes the payload is ``beat_shape(x_bits, y_bits, lanes)``.

    Source: docs/theory/units.md#pipeline.
    """

    latency = 1

    coordinates_latency = 2
    """Cycles from coordinates to their first pixel, if the colour waits."""

    SPANS_INSIDE = 4
    """Largest number of spans inside: coordinates of two spans, and two waiting pixels of other spans."""

    def __init__(self, x_bits: int = 12, y_bits: int = 12, length_bits: int = 12, lanes: int = 1):
        self.lanes = lanes
        colors, pixels = pixel_color_shape(), pixel_shape(x_bits, y_bits)
        if lanes > 1:
            colors, pixels = data.ArrayLayout(colors, lanes), beat_shape(x_bits, y_bits, lanes)
        super().__init__(
            {
                "coordinates": In(stream.Signature(coordinates_shape(x_bits, y_bits, length_bits))),
                "colors": In(stream.Signature(colors)),
                "o": Out(stream.Signature(pixels)),
            }
        )

    def elaborate(self, platform):
        """Coordinates of spans become coordinates of pixels. They meet the colours in a pixel register."""
        m = Module()
        span, color = self.coordinates.payload, self.colors.payload
        x, y = Signal.like(span.x), Signal.like(span.y)
        load, moves = Signal(), Signal()
        members, further = {"x": x.shape(), "y": y.shape(), "last": 1}, []
        if self.lanes > 1:
            active, ends, present = self._count_beats(m, moves)
            members["present"], further = len(present), [present]
        else:
            active, ends = count_down(m, self.coordinates.valid, span.length, moves)
        position = stream.Signature(data.StructLayout(members)).create()
        m.d.comb += [
            moves.eq(skid_buffer(m, position, active, Cat(x, y, ends, *further))),
            self.coordinates.ready.eq(moves & ends),
            load.eq(self.coordinates.ready & self.coordinates.valid),
        ]
        with m.If(load):
            m.d.sync += [x.eq(span.x), y.eq(span.y)]
        with m.Elif(moves):
            m.d.sync += x.eq(x + self.lanes)

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
                *self._colors(pixel, color, position.payload),
            ]
        return m

    def _colors(self, pixel: data.View, color: data.View, position: data.View) -> list:
        """Assignments of the colours of a pixel, or of all lanes."""
        if self.lanes == 1:
            return [pixel[name].eq(color[name]) for name in "rgb"]
        found = [pixel.present.eq(Cat(1, position.present)), pixel.colors[0].eq(color[0])]
        for lane in range(1, self.lanes):
            shown = Mux(position.present[lane - 1], Value.cast(color[lane]), 0)
            found.append(Value.cast(pixel.colors[lane]).eq(shown))
        return found

    def _count_beats(self, m: Module, advance: Value) -> tuple[Signal, Signal, Signal]:
        """Count the beats of spans of several lanes, one on each cycle on which ``advance`` is high.

        Returns ``active`` and ``ends`` as `count_down` does, and whether the beat has a pixel in each further
        lane. All are registers.
        """
        lanes = self.lanes
        active, ends = Signal(name="active"), Signal(name="ends", init=1)
        present = Signal(lanes - 1, name="present")
        valid, length = self.coordinates.valid, self.coordinates.payload.length
        remaining = Signal(len(length), name="remaining")

        def over(pixels: Value, count: int) -> Value:
            """Whether there are more pixels than a small number."""
            bits = count.bit_length()
            pixels = Cat(pixels, Const(0, bits))
            return pixels[bits:].any() | pixels[:bits].matches(*range(count + 1, 1 << bits))

        with m.If(advance):
            with m.If(ends):
                m.d.sync += [
                    active.eq(valid & length.any()),
                    ends.eq(~(valid & over(length, lanes))),
                    present.eq(Cat(over(length, lane) for lane in range(1, lanes))),
                    remaining.eq(length),
                ]
            with m.Else():
                m.d.sync += [
                    ends.eq(~over(remaining, 2 * lanes)),
                    present.eq(Cat(over(remaining, lanes + lane) for lane in range(1, lanes))),
                    remaining.eq(remaining - lanes),
                ]
        return active, ends, present
