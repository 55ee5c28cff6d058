"""Intensity units: ambient, diffuse and specular light of a pixel in three channels; [T] figure 4.10."""

from collections.abc import Sequence
from functools import reduce
from operator import add, or_
from typing import ClassVar

from amaranth.hdl import Cat, Module, Mux, Signal, Value, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.core.stream import skid_buffer

__all__ = [
    "CompactIntensityUnit",
    "IntensityUnit",
    "color_shape",
    "of_channel",
    "one_at_most",
    "pixel_color_shape",
    "selected",
]

_COLOR, _TERM = Intensity.COLOR_FORMAT, Intensity.TERM_FORMAT


def color_shape() -> data.ArrayLayout:
    """Shape of a colour operand: red, green, blue in ``UQ(11, 6)``, in LSB of the 8-bit channel."""
    return data.ArrayLayout(FixedShape(_COLOR), 3)


def pixel_color_shape(fraction_bits: int = 0) -> data.StructLayout:
    """Shape of a shaded pixel: red, green, blue in 8 bits, and perhaps fraction bits behind the point."""
    return data.StructLayout(dict.fromkeys("rgb", unsigned(8 + fraction_bits)))


def _kinds(model: Intensity) -> tuple[str, ...]:
    """Kinds of terms."""
    return ("diffuse", "specular") if model.has_specular else ("diffuse",)


def _term_shape(model: Intensity) -> data.StructLayout:
    """Shape of an input beat."""
    terms = data.ArrayLayout(FixedShape(_TERM), model.lights)
    albedo = {"albedo": data.ArrayLayout(FixedShape(model.ALBEDO_FORMAT), 3)} if model.has_albedo else {}
    return data.StructLayout(dict.fromkeys(_kinds(model), terms) | albedo)


def _constants_shape(model: Intensity) -> data.StructLayout:
    """Shape of the colour operands."""
    colors = data.ArrayLayout(color_shape(), model.lights)
    members = {"ambient": color_shape(), "diffuse": colors, "specular": colors}
    members |= {"emission": color_shape()} if model.has_albedo else {}
    return data.StructLayout(members | ({"tinted": 1} if model.tints else {}))


class IntensityUnit(PipelinedUnit):
    """Intensity ``I = k_a I_a + sum_i I_i (k_d D_i + k_s S_i)`` of a channel, rounded half up and saturated.

    Formats and error are those of the bit-accurate model `Intensity`. The sum grows by a bit at each level of
    the adder tree, so nothing wraps.

    The latency is ``5 + ceil(log2(2 lights + 1))`` cycles (terms, factors, products, adder tree, rounding,
    saturation). The initiation interval is 1. Each multiplier has registers of its own for its operands and
    its product, as in `registered_product`. There are six multipliers of 17 by 17 bits for each light.
    Without specular terms there are three for each light, and the latency has ``lights`` in place of
    ``2 lights``. One channel takes a third of the multipliers.

    Parameters
    ----------
    model : Intensity
        Bit-accurate model: number of lights, at least 1, whether there are specular terms, and channels.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse": ..., "specular": ...})))`
        A term of each kind for each light, ``UQ(0, 17)``. ``specular`` only if there are specular terms.
    o : :py:`Out(stream.Signature(pixel_color_shape(fraction_bits)))`
        Channels, in the model's `result_format`.
    constants : :py:`In(StructLayout({"ambient", "diffuse", "specular"}))`
        Colour operands, constant while beats are inside: one ``ambient``, and ``diffuse`` and ``specular``
        for each light.

    Source: docs/theory/units.md#intensity; [T] figure 4.10; [B] 4 and 5.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        r"factor_diffuse_(\d+)_(\w)": r"D_\1",
        r"factor_specular_(\d+)_(\w)": r"S_\1",
        r"color_diffuse_(\d+)_(\w)": r"k_d,\2",
        r"color_specular_(\d+)_(\w)": r"k_s,\2",
        r"diffuse_(\d+)_(\w)": r"k_d,\2·D_\1",
        r"specular_(\d+)_(\w)": r"k_s,\2·S_\1",
        r"sum_\d+_\d+_(\w)": r"Σ of terms, \1",
        r"rounded_(\w)": r"I_\1",
        "([rgb])": r"I_\1",
    }

    def __init__(self, model: Intensity | None = None):
        self.model = p = model or Intensity()
        self.kinds = _kinds(p)
        super().__init__(
            _term_shape(p),
            pixel_color_shape(p.fraction_bits),
            latency=self._latency_to_sum(p) + 2,
            constants=_constants_shape(p),
        )

    def _latency_to_sum(self, model: Intensity) -> int:
        """Cycles from the input to the sum of a channel."""
        terms = len(self.kinds) * model.lights
        return 3 + terms.bit_length()

    def datapath(self, m, operands):
        """Terms, products, a binary tree of sums, rounding, saturation."""
        register = self.register
        result = Signal(self.o.payload.shape())
        channels = "rgb"[: self.model.channels]
        operands = self.staged(m, operands)
        for channel, name in enumerate(channels):
            total = self.total(m, operands, channel, name)
            rounded = register(m, total.round_half_up(self.model.fraction_bits), f"rounded_{name}")
            code = register(m, rounded.saturate(self.model.result_format), name).as_value()
            of_channel = name if len(channels) > 1 else "rgb"
            m.d.comb += [result[each].eq(code) for each in of_channel]
        return result

    def staged(self, m, operands):
        """Registers of an input beat."""
        return self.register(m, operands, "terms")

    def total(self, m, operands, channel: int, name: str) -> FixedValue:
        """Sum of a channel, before it is rounded."""
        products = self.products(m, operands, self.kinds, channel, name)
        return self.sum_of(m, products, self.constants.ambient[channel], f"sum_{{}}_{{}}_{name}")

    def products(self, m, terms, kinds: Sequence[str], channel: int, name: str) -> list[FixedValue]:
        """Products of the terms of some kinds with their colours, two registers after the terms."""
        register, found = self.register, []
        for light in range(self.model.lights):
            for kind in kinds:
                factor = register(m, terms[kind][light], f"factor_{kind}_{light}_{name}")
                color = register(m, self.constants[kind][light][channel], f"color_{kind}_{light}_{name}")
                found.append(register(m, factor * color, f"{kind}_{light}_{name}"))
        return found

    def sum_of(self, m, terms, constant, name: str, levels: int = 0) -> FixedValue:
        """Sum of terms and a constant in a tree of registers, at least ``levels`` high.

        ``constant`` may be ``None``.
        """
        # A constant needs no registers that delay it to the other terms.
        terms, level = [*terms, *([] if constant is None else [constant])], 0
        while len(terms) > 1 or level < levels:
            pairs = [terms[k : k + 2] for k in range(0, len(terms), 2)]
            terms = [
                constant
                if pair[0] is constant
                else self.register(m, reduce(add, pair), name.format(level, k))
                for k, pair in enumerate(pairs)
            ]
            level += 1
        return terms[0]


class CompactIntensityUnit(wiring.Component):
    """The sum of an `IntensityUnit` on one multiplier of 17 by 17 bits, without the terms that are 0.

    The results are those of `IntensityUnit`. A pixel takes ``c = 3 max(1, T)`` cycles, where T is the number
    of its diffuse and specular terms that are not 0 (`Intensity.cycles`). With one light a pixel takes 6
    cycles with a highlight, and 3 cycles without a highlight or in the dark. The next pixel is taken c cycles
    later. The pixel leaves after ``c + 5`` cycles (input, operands, product, sum, rounding, saturation).
    Cycles of stall are not counted.

    Parameters
    ----------
    model : Intensity
        As for `IntensityUnit`.

    Attributes
    ----------
    latency, initiation_interval : int
        Cycles of a pixel that has no term of 0.

    Members
    -------
    i, o, constants
        Those of `IntensityUnit`.

    Source: docs/theory/units.md#intensity; [T] figure 4.10; [B] 4 and 5.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "product": "k·D or k·S",
        "total": "Σ of terms",
    }

    def __init__(self, model: Intensity | None = None):
        self.model = p = model or Intensity()
        self.kinds = _kinds(p)
        self._terms = len(self.kinds) * p.lights
        self.initiation_interval = p.most_cycles
        self.latency = self.initiation_interval + 5
        super().__init__(
            {
                "i": In(stream.Signature(_term_shape(p))),
                "o": Out(stream.Signature(pixel_color_shape(p.fraction_bits))),
                "constants": In(_constants_shape(p)),
            }
        )

    def elaborate(self, platform):
        """Products channel by channel, then sum, rounding, saturation."""
        m = Module()
        advance = Signal()
        busy, channel, term, first, ends_channel = self._issue(m, advance)
        note = data.StructLayout({"live": 1, "first": 1, "last": 1, "channel": 2})
        notes = [Signal(note, name=f"note_{stage}") for stage in range(4)]
        issued, multiplied, added, rounding = notes
        valid = Signal()
        last_channel = self.model.channels - 1
        # These registers have no reset, so that synthesis can use a multiplier's own registers for them.
        factors = [
            Signal(FixedShape(of), name=name, reset_less=True)
            for of, name in ((_TERM, "term"), (_COLOR, "color"))
        ]
        product = Signal(FixedShape(_TERM * _COLOR), reset_less=True)
        total = Signal(FixedShape(UQ(11 + self._terms.bit_length(), 23)))
        start = FixedValue(_COLOR, of_channel(self.constants.ambient, multiplied.channel))
        before = Mux(multiplied.first, Value.cast(start.extend(total.format)), Value.cast(total))
        fraction_bits, result_format = self.model.fraction_bits, self.model.result_format
        rounded = Signal.like(Value.cast(total.round_half_up(fraction_bits)))
        channels = [Signal(result_format.width, name=name) for name in "rgb"[: last_channel + 1]]
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
                    Value.cast(factors[0]).eq(term[0]),
                    Value.cast(factors[1]).eq(term[1]),
                ]
            with m.If(issued.live):
                m.d.sync += product.eq(factors[0] * factors[1])
            with m.If(multiplied.live):
                # The sum has at most 2 lights + 1 numbers, each under 2^11.
                m.d.sync += total.eq((FixedValue(total.format, before) + product).wrap(total.format))
            with m.If(added.live & added.last):
                m.d.sync += rounded.eq(Value.cast(total.round_half_up(fraction_bits)))
            for k, result in enumerate(channels):
                with m.If(rounding.live & rounding.last & (rounding.channel == k)):
                    wide = UQ(len(rounded) - fraction_bits, fraction_bits)
                    code = FixedValue(wide, rounded).saturate(result_format)
                    m.d.sync += result.eq(code.as_value())
        return m

    def _issue(self, m: Module, advance: Value) -> tuple[Signal, Signal, Sequence[Value], Signal, Signal]:
        """Take pixels in, and give their products one by one to the multiplier.

        Returns
        -------
        busy : Signal
            Whether there is a product on this cycle.
        channel : Signal
            Channel of the product.
        term : sequence of Value
            Operands of the product, the term and its colour.
        first, ends_channel : Signal
            Whether the product is the first of its channel, and whether it is the last.
        """
        terms = [term for kind in self.kinds for term in self.i.payload[kind]]
        colors = [color for kind in self.kinds for color in self.constants[kind]]
        held = [Signal.like(Value.cast(term), name=f"term_{k}") for k, term in enumerate(terms)]
        used, left = Signal(len(terms), name="used"), Signal(len(terms), name="left")
        busy, first = Signal(name="busy"), Signal(name="first", init=1)
        channel, accept = Signal(2, name="channel"), Signal(name="accept")

        # The lowest term that is left is multiplied. A channel without terms takes a cycle, too.
        chosen, rest = Signal(len(terms), name="chosen"), Signal(len(terms), name="rest")
        ends_channel, ends_pixel = Signal(name="ends_channel"), Signal(name="ends_pixel")
        # ``free``: the unit is not busy, or on a pixel's last cycle. ``ready``: it is free, and the output
        # moves. Both are registers, computed a cycle ahead.
        free, ready = (Signal(name=name, init=1) for name in ("free", "ready"))
        following = Signal(name="following")
        m.d.sync += [free.eq(following), ready.eq(following & ~(self.o.valid & ~self.o.ready))]
        m.d.comb += [
            chosen.eq(left & -left),
            rest.eq(left & ~chosen),
            ends_channel.eq(~rest.any()),
            ends_pixel.eq(ends_channel & (channel == self.model.channels - 1)),
            self.i.ready.eq(ready),
            following.eq(free),
            accept.eq(self.i.valid & self.i.ready),
        ]
        nonzero, last_channel = Cat(Value.cast(term).any() for term in terms), self.model.channels - 1
        with m.If(accept):
            m.d.sync += [busy.eq(1), channel.eq(0), used.eq(nonzero), left.eq(nonzero)]
            m.d.comb += following.eq(one_at_most(nonzero) if last_channel == 0 else 0)
            m.d.sync += [register.eq(Value.cast(term)) for register, term in zip(held, terms, strict=True)]
        with m.Elif(advance & busy):
            remain = Mux(ends_channel, used, rest)
            m.d.sync += left.eq(remain)
            ends = one_at_most(remain) & (channel + ends_channel == last_channel)
            m.d.comb += following.eq(ends_pixel | ends)
            with m.If(ends_channel):
                m.d.sync += channel.eq(channel + 1)
            with m.If(ends_pixel):
                m.d.sync += busy.eq(0)
        words = [of_channel(color, channel) for color in colors]
        return busy, channel, (selected(chosen, held), selected(chosen, words)), first, ends_channel


def one_at_most(bits: Value) -> Value:
    """Whether at most one bit is set."""
    return ~(bits & (bits - 1)[: len(bits)]).any()


def selected(one_hot: Value, words: Sequence[Value]) -> Value:
    """The word whose bit is set; 0 if no bit is set."""
    return reduce(or_, (Mux(one_hot[k], Value.cast(word), 0) for k, word in enumerate(words)))


def of_channel(color: data.View, channel: Value) -> Value:
    """Word of a channel of a colour: 0 is red, 1 is green, 2 is blue."""
    red, green, blue = (Value.cast(part) for part in color)
    return Mux(channel[1], blue, Mux(channel[0], green, red))
