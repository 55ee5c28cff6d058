"""Intensity units of pixels that bring an albedo, the colour of the surface."""

from typing import ClassVar, NamedTuple

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import UQ
from blysk.hdl.core.fixed import FixedShape, FixedValue
from blysk.hdl.core.memory import delayed, turn_of
from blysk.hdl.core.stream import skid_buffer
from blysk.hdl.lighting.intensity import (
    CompactIntensityUnit,
    IntensityUnit,
    of_channel,
    one_at_most,
    selected,
)

__all__ = ["ColoredIntensityUnit", "CompactColoredIntensityUnit", "intensity_unit"]

_COLOR, _SURFACE = Intensity.COLOR_FORMAT, Intensity.SURFACE_FORMAT

_FACTOR = UQ(1, Intensity.TERM_FORMAT.fraction_bits)
"""Format that holds a term and an albedo."""

_STAGES = 3
"""Registers from a sum of light on a surface to its product with the albedo: rounded, operands, product."""


def _limited(light: FixedValue, model: Intensity) -> FixedValue:
    """Bring rounded light on a surface into the format that the albedo multiplies."""
    if _SURFACE.holds(light.format):
        return light.extend(_SURFACE)
    # Ambient light and a single term stay below the limit of the format.
    only_one = model.lights == 1 and not model.tints
    return light.wrap(_SURFACE) if only_one else light.saturate(_SURFACE)


class ColoredIntensityUnit(IntensityUnit):
    """Intensity ``I = a (k_a I_a + sum_i I_i k_d D_i) + E + sum_i I_i k_s S_i`` of a channel; a: albedo.

    Formats and error are those of the bit-accurate model `Intensity` with ``has_albedo``. With ``tints`` the
    constant ``tinted`` moves the specular sum into the brackets.

    The latency is ``9 + ceil(log2(lights + 1))`` cycles: terms, factors, products, adder tree, rounded light
    on the surface, operands, product, sum, rounding, saturation. Tints take 1 more. The initiation interval
    is 1. Each channel has one more multiplier than in an `IntensityUnit`, of 18 by 17 bits.

    Parameters
    ----------
    model : Intensity
        Bit-accurate model, with ``has_albedo``; 0 lights or more.

    Members
    -------
    i : :py:`In(stream.Signature(StructLayout({"diffuse": ..., "specular": ..., "albedo": ...})))`
        Beats of an `IntensityUnit`, and the albedo of red, green, blue, ``UQ(1, 16)``, at most 1.
    o : :py:`Out(stream.Signature(pixel_color_shape(fraction_bits)))`
        Channels, in the model's `result_format`.
    constants : :py:`In(StructLayout({"ambient", "diffuse", "specular", "emission", "tinted"}))`
        Colour operands, constant while beats are inside; ``tinted`` only with tints.

    Source: docs/theory/units.md#intensity.
    """

    FORMULAS: ClassVar[dict[str, str]] = IntensityUnit.FORMULAS | {
        r"light_\d+_\d+_(\w)": r"Σ of light on the surface, \1",
        r"light_and_shine_(\w)": r"Σ of light on the surface, \1",
        r"shine_\d+_\d+_(\w)": r"Σ k_s,\1·S",
        r"beside_\d+_\d+_(\w)": r"E_\1 + Σ k_s,\1·S",
        r"surface_(\w)": r"light on the surface, \1",
        r"colored_(\w)": r"a_\1·light",
        r"sum_(\w)": r"Σ of terms, \1",
    }

    def _latency_to_sum(self, model):
        return 7 + model.lights.bit_length() + model.tints

    def staged(self, m, operands):
        """Registers of the terms; and the albedo, delayed until the operands of its product are loaded."""
        p, found = self.model, {}
        if p.lights:
            found = {kind: self.register(m, operands[kind], f"terms_{kind}") for kind in self.kinds}
        if found and p.has_specular and not p.tints:
            for stage in range(_STAGES):
                found["specular"] = self.register(m, found["specular"], f"terms_specular_{stage}")
        cycles = self._latency_to_sum(p) - 3
        return found | {"albedo": delayed(m, "albedo", operands.albedo, cycles, turn_of(m, cycles))}

    def total(self, m, operands, channel, name):
        """Albedo times the light on the surface, and the light that the albedo does not multiply."""
        p, register, constants = self.model, self.register, self.constants
        products = self.products(m, operands, ("diffuse",), channel, name)
        light = self.sum_of(m, products, constants.ambient[channel], f"light_{{}}_{{}}_{name}")
        beside = constants.emission[channel]
        if p.tints and p.lights:
            light, beside = self._by_tint(m, operands, light, channel, name)
        elif p.has_specular and p.lights:
            products = self.products(m, operands, ("specular",), channel, name)
            beside = self.sum_of(m, products, beside, f"beside_{{}}_{{}}_{name}")
        rounded = register(m, light.round_half_up(_SURFACE.fraction_bits), f"surface_rounded_{name}")
        surface = register(m, _limited(rounded, p), f"surface_{name}")
        factor = register(m, operands["albedo"][channel], f"factor_albedo_{name}")
        return register(m, register(m, surface * factor, f"colored_{name}") + beside, f"sum_{name}")

    def _by_tint(self, m, operands, light: FixedValue, channel: int, name: str):
        """Light that the albedo multiplies, and other light. ``tinted`` places the specular sum."""
        register, tinted = self.register, self.constants.tinted
        products = self.products(m, operands, ("specular",), channel, name)
        levels = self.model.lights.bit_length()
        shine = self.sum_of(m, products, None, f"shine_{{}}_{{}}_{name}", levels)
        inside, beside = (
            FixedValue(shine.format, Mux(chosen, shine.as_value(), 0)) for chosen in (tinted, ~tinted)
        )
        for stage in range(_STAGES):
            beside = register(m, beside, f"shine_beside_{stage}_{name}")
        beside = register(m, beside + self.constants.emission[channel], f"beside_{name}")
        return register(m, light + inside, f"light_and_shine_{name}"), beside


class _Issue(NamedTuple):
    """A product that is issued to the multiplier on a cycle.

    Parameters
    ----------
    busy, first, ends_channel, colored : Signal
        ``busy``: there is a product. ``first`` and ``ends_channel``: it is the first product, or the last, of
        its channel in the pass. ``colored``: the pass is the second pass, which has the albedo as a factor.
    channel : Signal
        Channel of the product.
    operands : pair of Value
        Operands of the product: the term or albedo, and the colour or light.
    """

    busy: Signal
    first: Signal
    ends_channel: Signal
    channel: Signal
    colored: Signal
    operands: tuple[Value, Value]


class CompactColoredIntensityUnit(CompactIntensityUnit):
    """The sum of a `ColoredIntensityUnit` on one multiplier of 18 by 18 bits, without the terms that are 0.

    A pixel has two passes through its channels. In the first pass the terms that the albedo multiplies are
    added to the ambient light. In the second pass the albedo multiplies this sum, and the other terms are
    added. A pixel without a term for the albedo has the second pass alone.

    A pixel takes ``c = 3 (1 + T)`` cycles, where T is the number of its terms that are not 0
    (`Intensity.cycles`). With one channel it takes ``1 + T``, and 2 more with a first pass. The pixel leaves
    after ``c + 5`` cycles. Cycles of stall are not counted.

    Parameters
    ----------
    model : Intensity
        As for `ColoredIntensityUnit`.

    Attributes
    ----------
    latency, initiation_interval : int
        Cycles of a pixel that has no term of 0.

    Members
    -------
    i, o, constants
        Those of `ColoredIntensityUnit`.

    Source: docs/theory/units.md#intensity.
    """

    FORMULAS: ClassVar[dict[str, str]] = {
        "product": "k·D, k·S or a·light",
        "total": "Σ of terms",
        r"parked_\d": "light on the surface",
    }

    def elaborate(self, platform):
        """Products channel by channel in two passes, then sum, rounding, saturation."""
        m = Module()
        p, advance, surface = self.model, Signal(), Signal(_SURFACE.width, name="surface")
        issue = self._issue(m, advance, surface)
        note = data.StructLayout({"live": 1, "first": 1, "last": 1, "channel": 2, "colored": 1})
        notes = [Signal(note, name=f"note_{stage}") for stage in range(4)]
        issued, multiplied, added, rounding = notes
        valid, last_channel = Signal(), p.channels - 1
        # These registers have no reset, so that synthesis can use a multiplier's own registers for them.
        factors = [
            Signal(FixedShape(of), name=name, reset_less=True)
            for of, name in ((_FACTOR, "term"), (_SURFACE, "color"))
        ]
        product = Signal(FixedShape(_FACTOR * _SURFACE), reset_less=True)
        # The first pass adds ambient light and terms, all under 2^11. The second pass adds E, specular terms,
        # and a product under 2^13, which counts as four numbers under 2^11.
        most = max(1 + self._terms, 5 + p.lights * p.has_specular)
        total = Signal(FixedShape(UQ(11 + (most - 1).bit_length(), 23)))
        of = multiplied.channel
        start = (of_channel(self.constants[name], of) for name in ("emission", "ambient"))
        start = FixedValue(_COLOR, Mux(multiplied.colored, *start)).extend(total.format)
        before = Mux(multiplied.first, start.as_value(), Value.cast(total))
        self._park(m, advance, added, total, issue.channel, surface)
        fraction_bits = p.fraction_bits
        rounded = Signal.like(Value.cast(total.round_half_up(fraction_bits)))
        channels = [Signal(p.result_format.width, name=name) for name in "rgb"[: p.channels]]
        pixel = Cat(*channels, *channels[:1] * (3 - p.channels))
        m.d.comb += advance.eq(skid_buffer(m, self.o, valid, pixel))
        ends = rounding.live & rounding.last & rounding.colored
        with m.If(advance):
            m.d.sync += [
                Cat(notes).eq(Cat(*issue[:5], notes[:-1])),
                valid.eq(ends & (rounding.channel == last_channel)),
            ]
            with m.If(issue.busy):
                m.d.sync += issue.first.eq(issue.ends_channel)
                m.d.sync += [
                    Value.cast(factor).eq(word) for factor, word in zip(factors, issue.operands, strict=True)
                ]
            with m.If(issued.live):
                m.d.sync += product.eq(factors[0] * factors[1])
            with m.If(multiplied.live):
                m.d.sync += total.eq((FixedValue(total.format, before) + product).wrap(total.format))
            with m.If(added.live & added.last):
                m.d.sync += rounded.eq(Value.cast(total.round_half_up(fraction_bits)))
            for k, result in enumerate(channels):
                with m.If(ends & (rounding.channel == k)):
                    wide = UQ(len(rounded) - fraction_bits, fraction_bits)
                    code = FixedValue(wide, rounded).saturate(p.result_format)
                    m.d.sync += result.eq(code.as_value())
        return m

    def _park(self, m: Module, advance, added: data.View, total: FixedValue, channel, surface: Signal):
        """Keep the light on the surface of each channel until the albedo multiplies it.

        If the light of a channel is needed on the cycle on which it is parked, the light is passed on
        directly.
        """
        now = _limited(total.round_half_up(_SURFACE.fraction_bits), self.model).as_value()
        of_light, parked = Signal(name="of_light"), []
        m.d.comb += of_light.eq(added.live & ~added.colored)
        for k in range(self.model.channels):
            word = Signal(_SURFACE.width, name=f"parked_{k}", reset_less=True)
            parked.append(word)
            with m.If(advance & of_light & (added.channel == k)):
                m.d.sync += word.eq(now)
        kept = of_channel((parked * 3)[:3], channel)
        m.d.comb += surface.eq(Mux(of_light & (added.channel == channel), now, kept))

    def _issue(self, m: Module, advance, surface: Signal) -> _Issue:
        """Take pixels in, and give their products one by one to the multiplier.

        Each product of a channel has a bit in ``used``, ``left`` and ``after``: bit 0 is the albedo's, and
        the terms' bits follow. If there is only one channel, products of 0 end its first pass, so that the
        second pass finds its sum.
        """
        p, given = self.model, self.i.payload
        terms = [Value.cast(term) for kind in self.kinds for term in given[kind]]
        colors = [color for kind in self.kinds for color in self.constants[kind]]
        held = [Signal.like(term, name=f"term_{k}") for k, term in enumerate(terms)]
        albedo = [Signal.like(Value.cast(given.albedo[k]), name=f"albedo_{k}") for k in range(p.channels)]
        padding = p.PADDING if p.channels == 1 else 0
        bits = 1 + len(terms) + padding
        used, left, after = (Signal(bits, name=name) for name in ("used", "left", "after"))
        chosen, rest, remain = (Signal(bits, name=name) for name in ("chosen", "rest", "remain"))
        busy, first, colored = Signal(name="busy"), Signal(name="first", init=1), Signal(name="colored")
        channel, accept = Signal(2, name="channel"), Signal(name="accept")
        # Whether the pixel has no first pass, so that its light is ambient.
        dark, is_dark = Signal(name="dark"), Signal(name="is_dark")
        ends_channel, ends_pass, ends_pixel = (
            Signal(name=name) for name in ("ends_channel", "ends_pass", "ends_pixel")
        )

        # ``free`` and ``ready`` work as in a `CompactIntensityUnit`.
        free, ready = (Signal(name=name, init=1) for name in ("free", "ready"))
        following, last_channel = Signal(name="following"), p.channels - 1
        nonzero = [term.any() for term in terms]
        inside = [1] * p.lights + [self.constants.tinted if p.tints else 0] * (len(terms) - p.lights)
        under = [bit & of for bit, of in zip(nonzero, inside, strict=True)]
        second = Cat(1, *(bit & ~of[0] for bit, of in zip(nonzero, map(Value.cast, inside), strict=True)))
        m.d.comb += is_dark.eq(~Cat(under).any())
        begins = Mux(is_dark, second, Cat(0, *under, *[1] * padding))
        m.d.sync += [free.eq(following), ready.eq(following & ~(self.o.valid & ~self.o.ready))]
        m.d.comb += [
            chosen.eq(left & -left),
            rest.eq(left & ~chosen),
            ends_channel.eq(~rest.any()),
            ends_pass.eq(ends_channel & (channel == last_channel)),
            ends_pixel.eq(ends_pass & colored),
            remain.eq(Mux(ends_pass, after, Mux(ends_channel, used, rest))),
            self.i.ready.eq(ready),
            following.eq(free),
            accept.eq(self.i.valid & self.i.ready),
        ]
        with m.If(accept):
            m.d.sync += [busy.eq(1), channel.eq(0), colored.eq(is_dark), dark.eq(is_dark)]
            m.d.sync += [used.eq(begins), left.eq(begins), after.eq(second)]
            m.d.comb += following.eq(is_dark & one_at_most(second) if last_channel == 0 else 0)
            m.d.sync += [word.eq(term) for word, term in zip(held, terms, strict=True)]
            m.d.sync += [word.eq(Value.cast(given.albedo[k])) for k, word in enumerate(albedo)]
        with m.Elif(advance & busy):
            m.d.sync += left.eq(remain)
            is_last = Mux(ends_pass, last_channel == 0, colored & (channel + ends_channel == last_channel))
            m.d.comb += following.eq(ends_pixel | (one_at_most(remain) & is_last))
            with m.If(ends_channel):
                m.d.sync += channel.eq(channel + 1)
            with m.If(ends_pass):
                m.d.sync += [channel.eq(0), colored.eq(1), used.eq(after)]
            with m.If(ends_pixel):
                m.d.sync += busy.eq(0)
        light = Mux(dark, of_channel(self.constants.ambient, channel), surface)
        # An albedo has one fraction bit less than a term.
        words = Cat(0, of_channel((albedo * 3)[:3], channel)), *held
        colors = [light, *(of_channel(color, channel) for color in colors)]
        operands = selected(chosen, words), selected(chosen, colors)
        return _Issue(busy, first, ends_channel, channel, colored, operands)


def intensity_unit(model: Intensity, compact: bool = False) -> IntensityUnit | CompactIntensityUnit:
    """The intensity unit of a model and a style."""
    if compact:
        return (CompactColoredIntensityUnit if model.has_albedo else CompactIntensityUnit)(model)
    return (ColoredIntensityUnit if model.has_albedo else IntensityUnit)(model)
