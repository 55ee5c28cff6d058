"""Intensity unit ([T] figure 4.10): ambient, diffuse and specular light of a pixel, in three channels."""

from functools import reduce
from operator import or_
from typing import Literal

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.stream import PipelinedUnit, skid_buffer

__all__ = ["IntensityUnit", "color_shape", "pixel_color_shape"]


def color_shape() -> data.ArrayLayout:
    """Shape of a colour operand: red, green, blue in ``UQ(11, 6)``, in LSB of the 8-bit channel."""
    return data.ArrayLayout(FixedShape(Intensity.COLOR_FORMAT), 3)


def pixel_color_shape() -> data.StructLayout:
    """Shape of a shaded pixel: red, green, blue in 8 bits."""
    return data.StructLayout({"r": unsigned(8), "g": unsigned(8), "b": unsigned(8)})


class IntensityUnit(PipelinedUnit):
    """``I = k_a I_a + sum_i I_i (k_d D_i + k_s S_i)`` a channel, saturated to 255 and rounded half up.

    Formats and error are those of `Intensity`, the bit-true twin. Nothing wraps: the sum
    grows by a bit at each level of the adder tree.

    In the throughput style the latency is ``9 + ceil(log2(2 lights + 1))`` cycles (terms, two for the
    factors, two for the products, two that the channels are apart, adder tree, rounding, saturation) and the
    initiation interval is 1. The channels follow each other by a clock: each multiplier has registers of its
    own, two in a row for its factor and for its product, as in `registered_product`. Six
    multipliers a light. Without specular terms there are ``lights`` in place of ``2 lights``, with one
    channel a third of the multipliers and two cycles less.

    In the compact style there is one multiplier of 17 by 17 bits, and no product of a term that is 0. A pixel
    takes ``c = 3 max(1, T)`` cycles, T the number of its diffuse and specular terms that are not 0
    (`Intensity.cycles`): 3 for one light without and 6 with a highlight, 3 in the dark. The
    next pixel is taken in c cycles after it, and the pixel leaves after ``c + 5`` (input, operands, product,
    sum, rounding, saturation), cycles of standing still not counted. ``latency`` and ``initiation_interval``
    are those of a pixel with every term. One light has 230 register bits, against 1335; 16 have 808, against
    18769.

    Parameters
    ----------
    parameters : Intensity
        Number of lights, at least 1; whether there are specular terms; channels.
    style : str
        ``"throughput"`` or ``"compact"``.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse": ..., "specular": ...})))`
        One term a light, ``UQ(0, 17)``; the latter only where there are specular terms.
    o : :py:`Out(stream.Signature(pixel_color_shape()))`
        Channels.
    constants : :py:`In(StructLayout({"ambient", "diffuse", "specular"}))`
        Colour operands, the latter two one a light; stay while beats are inside.

    Raises
    ------
    ValueError
        If the style is unknown.

    Source: [T] figure 4.10; [B] 4 and 5; pipeline.md, "Composition".
    """

    def __init__(
        self,
        parameters: Intensity | None = None,
        style: Literal["throughput", "compact"] = "throughput",
    ):
        if style not in ("throughput", "compact"):
            raise ValueError(f"style must be 'throughput' or 'compact', not {style!r}")
        self.style = style
        self.parameters = parameters or Intensity()
        lights = self.parameters.lights
        self.kinds = ("diffuse", "specular") if self.parameters.has_specular else ("diffuse",)
        self._terms = len(self.kinds) * lights
        channels = self.parameters.channels
        cycles = channels * self._terms if style == "compact" else 1
        terms = data.ArrayLayout(FixedShape(Intensity.TERM_FORMAT), lights)
        colors = data.ArrayLayout(color_shape(), lights)
        super().__init__(
            data.StructLayout(dict.fromkeys(self.kinds, terms)),
            pixel_color_shape(),
            latency=cycles + 5 if style == "compact" else 6 + channels + self._terms.bit_length(),
            initiation_interval=cycles,
            constants=data.StructLayout({"ambient": color_shape(), "diffuse": colors, "specular": colors}),
        )

    def elaborate(self, platform):
        """The base's control in the throughput style; in the compact style one that counts products."""
        return self._compact() if self.style == "compact" else super().elaborate(platform)

    def datapath(self, m, operands):
        """Terms, products, a binary tree of sums, rounding, saturation."""
        register = self.register
        result = Signal(self.o.payload.shape())
        channels = "rgb"[: self.parameters.channels]
        for channel, name in enumerate(channels):
            operands = register(m, operands, f"terms_{name}")
            terms = [self.constants.ambient[channel]]
            for light in range(self.parameters.lights):
                for kind in self.kinds:
                    factor = operands[kind][light]
                    for step in range(2):
                        factor = register(m, factor, f"factor_{kind}_{light}_{name}_{step}")
                    term = factor * self.constants[kind][light][channel]
                    for clock in range(channel, len(channels) + 1):
                        term = register(m, term, f"{kind}_{light}_{name}_{clock}")
                    terms.append(term)
            level = 0
            while len(terms) > 1:
                pairs = [terms[k : k + 2] for k in range(0, len(terms), 2)]
                terms = [
                    register(m, pair[0] + pair[1] if len(pair) == 2 else pair[0], f"sum_{level}_{k}_{name}")
                    for k, pair in enumerate(pairs)
                ]
                level += 1
            rounded = register(m, terms[0].round_half_up(0), f"rounded_{name}")
            level = register(m, rounded.saturate(Intensity.RESULT_FORMAT), name).as_value()
            of_channel = name if len(channels) > 1 else "rgb"
            m.d.comb += [result[each].eq(level) for each in of_channel]
        return result

    def _compact(self) -> Module:
        """Channel by channel, a clock for each term that is not 0; then product, sum, rounding."""
        m = Module()
        terms = [term for kind in self.kinds for term in self.i.payload[kind]]
        colors = [color for kind in self.kinds for color in self.constants[kind]]
        last_channel = self.parameters.channels - 1
        held = [Signal.like(Value.cast(term), name=f"term_{k}") for k, term in enumerate(terms)]
        used, left = Signal(len(terms)), Signal(len(terms))
        busy, valid = Signal(), Signal()
        channel = Signal(2)
        advance, accept = Signal(), Signal()

        # The lowest term that is left is multiplied; a channel without any takes a clock too.
        turn, rest = Signal(len(terms)), Signal(len(terms))
        ends_channel, ends_pixel = Signal(), Signal()
        m.d.comb += [
            turn.eq(left & -left),
            rest.eq(left & ~turn),
            ends_channel.eq(~rest.any()),
            ends_pixel.eq(ends_channel & (channel == last_channel)),
            self.i.ready.eq(advance & (~busy | ends_pixel)),
            accept.eq(self.i.valid & self.i.ready),
        ]
        nonzero = Cat(Value.cast(term).any() for term in terms)
        with m.If(accept):
            m.d.sync += [busy.eq(1), channel.eq(0), used.eq(nonzero), left.eq(nonzero)]
            m.d.sync += [register.eq(Value.cast(term)) for register, term in zip(held, terms, strict=True)]
        with m.Elif(advance & busy):
            m.d.sync += left.eq(Mux(ends_channel, used, rest))
            with m.If(ends_channel):
                m.d.sync += channel.eq(channel + 1)
            with m.If(ends_pixel):
                m.d.sync += busy.eq(0)

        def chosen(words):
            """The word of this turn, 0 if there is none."""
            return reduce(or_, (Mux(turn[k], Value.cast(word), 0) for k, word in enumerate(words)))

        def of_channel(color, channel):
            red, green, blue = (Value.cast(part) for part in color)
            return Mux(channel[1], blue, Mux(channel[0], green, red))

        # What goes with an operand, a product, a sum and a rounded sum.
        note = data.StructLayout({"live": 1, "first": 1, "last": 1, "channel": 2})
        notes = [Signal(note, name=f"note_{stage}") for stage in range(4)]
        issued, multiplied, added, rounding = notes
        first = Signal(init=1)
        format, one = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT
        total = Signal(FixedShape(UQ(11 + self._terms.bit_length(), 23)))
        factors = [Signal(FixedShape(of), name=name) for of, name in ((one, "term"), (format, "color"))]
        product = Signal(FixedShape(one * format))
        start = FixedValue(format, of_channel(self.constants.ambient, multiplied.channel))
        before = Mux(multiplied.first, Value.cast(start.extend(total.format)), Value.cast(total))
        rounded = Signal.like(Value.cast(total.round_half_up(0)))
        channels = [Signal(8, name=name) for name in "rgb"[: last_channel + 1]]
        pixel = Cat(*channels, *channels[:1] * (2 - last_channel))
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid, pixel))
        with m.If(advance):
            m.d.sync += [
                Cat(notes).eq(Cat(busy, first, ends_channel, channel, notes[:-1])),
                valid.eq(rounding.live & rounding.last & (rounding.channel == last_channel)),
            ]
            with m.If(busy):
                m.d.sync += [
                    first.eq(ends_channel),
                    Value.cast(factors[0]).eq(chosen(held)),
                    Value.cast(factors[1]).eq(chosen([of_channel(color, channel) for color in colors])),
                ]
            with m.If(issued.live):
                m.d.sync += product.eq(factors[0] * factors[1])
            with m.If(multiplied.live):
                # At most 2 lights + 1 numbers under 2^11 each.
                m.d.sync += total.eq((FixedValue(total.format, before) + product).wrap(total.format))
            with m.If(added.live & added.last):
                m.d.sync += rounded.eq(Value.cast(total.round_half_up(0)))
            for k, result in enumerate(channels):
                with m.If(rounding.live & rounding.last & (rounding.channel == k)):
                    code = FixedValue(UQ(len(rounded), 0), rounded).saturate(Intensity.RESULT_FORMAT)
                    m.d.sync += result.eq(code.as_value())
        return m
