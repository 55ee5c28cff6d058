"""Spans of attributes: on every cycle a pixel's colours and texture coordinates over W, and its 1/W."""

from collections.abc import Iterator
from typing import ClassVar

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.albedo.attribute_spans import AttributeSpans
from blysk.golden.number.spans import LENGTH_BITS
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import count_down, skid_buffer
from blysk.hdl.core.views import copy, copy_fields

__all__ = [
    "AttributeSpansUnit",
    "attribute_span_shape",
    "attribute_words_shape",
    "placement_shape",
    "span_attributes_shape",
]


def _lines(model: AttributeSpans) -> dict:
    """Members with a word of every line that the model has: ``colors``, ``coordinates``, ``weight``."""
    word, members = FixedShape(model.WORD_FORMAT), {}
    if model.colors:
        members["colors"] = data.ArrayLayout(word, 3)
    if model.coordinates:
        members["coordinates"] = data.ArrayLayout(word, 2)
    if model.perspective:
        members["weight"] = word
    return members


def placement_shape(model: AttributeSpans) -> dict:
    """Members that place the texture coordinates of a span: base, range, level; none without coordinates."""
    if not model.coordinates:
        return {}
    return {
        "base": data.ArrayLayout(FixedShape(model.BASE_FORMAT), 2),
        "range": unsigned(model.RANGE_FORMAT.width),
        "level": unsigned(model.LEVEL_FORMAT.width),
    }


def span_attributes_shape(model: AttributeSpans) -> data.StructLayout:
    """Shape of the attributes of a span: words at the first pixel, their steps, the exponent of all steps.

    ``start`` and ``step`` have the members ``colors`` (3 words), ``coordinates`` (2 words) and ``weight``, as
    far as the model has them. With texture coordinates there are also ``base``, ``range`` and ``level``.

    Parameters
    ----------
    model : AttributeSpans
        The attributes.
    """
    lines = data.StructLayout(_lines(model))
    exponent = unsigned(model.EXPONENT_FORMAT.width)
    return data.StructLayout({"start": lines, "step": lines, "exponent": exponent} | placement_shape(model))


def attribute_span_shape(model: AttributeSpans, length_bits: int = LENGTH_BITS) -> data.StructLayout:
    """Shape of a span: its attributes as of `span_attributes_shape`, and its length.

    Parameters
    ----------
    model : AttributeSpans
        The attributes.
    length_bits : int
        Bits of the length.
    """
    return data.StructLayout(span_attributes_shape(model).members | {"length": unsigned(length_bits)})


def attribute_words_shape(model: AttributeSpans) -> data.StructLayout:
    """Shape of the words of a pixel: ``colors``, ``coordinates``, ``weight``, ``base``, ``range``, ``level``.

    Members that the model lacks are left out.

    Parameters
    ----------
    model : AttributeSpans
        The attributes.
    """
    return data.StructLayout(_lines(model) | placement_shape(model))


class AttributeSpansUnit(wiring.Component):
    """Words of every pixel of spans, first pixel first; `AttributeSpans` is the bit-accurate model.

    Each line has an accumulator of 39 bits, and a register of its step, shifted by the exponent. The first
    pixel of a span is on the output a cycle after the span was accepted. The other pixels follow on each
    cycle, unless the output waits. A span of m pixels is accepted m cycles after the span before it, also if
    m is 1. A span of length 0 takes a cycle and gives nothing. The unit has no multipliers.

    If spans are *spaced*, a step is shifted by one place a cycle in place of a shifter, and there is no skid
    buffer. The first pixel of a span of several pixels is offered as many cycles later as its exponent tells.

    Parameters
    ----------
    model : AttributeSpans
        Bit-accurate model.
    length_bits : int
        Bits of the length.
    spaced : bool
        Whether spans are spaced.

    Members
    -------
    i : :py:`In(stream.Signature(attribute_span_shape(model, length_bits)))`
        Spans.
    o : :py:`Out(stream.Signature(attribute_words_shape(model)))`
        Words of pixels, with base, range and level of their span.

    Source: docs/theory/textures.md#lines.
    """

    latency = 1

    FORMULAS: ClassVar[dict[str, str]] = {r"(\w+)_sum": "U + i·dU", r"(\w+)_step": "dU·2^(−e)"}

    def __init__(
        self, model: AttributeSpans | None = None, length_bits: int = LENGTH_BITS, spaced: bool = False
    ):
        self.model, self.length_bits, self.spaced = model or AttributeSpans(), length_bits, spaced
        p = self.model
        super().__init__(
            {
                "i": In(stream.Signature(attribute_span_shape(p, length_bits))),
                "o": Out(stream.Signature(attribute_words_shape(p))),
            }
        )

    def elaborate(self, platform):
        """A counter of pixels, the accumulators, and registers of the words that all pixels share."""
        m = Module()
        p, span = self.model, self.i.payload
        advance = Signal()
        active, ends = count_down(m, self.i.valid, span.length, advance)
        words = Signal(self.o.payload.shape())
        places = Signal.like(span.exponent, name="places")
        if self.spaced:
            settled = ends | ~places.any()
            m.d.comb += [
                self.o.valid.eq(active & settled),
                copy(self.o.payload, words),
                advance.eq(~active | (settled & self.o.ready)),
            ]
        else:
            m.d.comb += advance.eq(skid_buffer(m, self.o, active, words))
        m.d.comb += self.i.ready.eq(advance & ends)
        free, begins = p.SUM_FORMAT.fraction_bits - p.WORD_FORMAT.fraction_bits, advance & ends
        if self.spaced:
            with m.If(begins):
                m.d.sync += places.eq(span.exponent)
            with m.Elif(places.any()):
                m.d.sync += places.eq(places - 1)
        lines = (self._words(view) for view in (span.start, span.step, words))
        for (name, start), (_, step), (_, word) in zip(*lines, strict=True):
            total = Signal(p.SUM_FORMAT.width, name=f"{name}_sum", reset_less=True)
            difference = Signal(signed(p.SUM_FORMAT.width), name=f"{name}_step", reset_less=True)
            given = Cat(Const(0, free), step).as_signed()
            if self.spaced:
                given = Mux(begins, given, difference >> 1)
                with m.If(begins | places.any()):
                    m.d.sync += difference.eq(given)
            with m.If(advance):
                with m.If(ends):
                    half = Const(1 << (free - 1), free)
                    m.d.sync += total.eq(Cat(half, start))
                    if not self.spaced:
                        m.d.sync += difference.eq(given >> span.exponent)
                with m.Else():
                    m.d.sync += total.eq(total + difference)
            m.d.comb += word.eq(total[free:])
        shared = placement_shape(p)
        if shared:
            held = Signal(data.StructLayout(shared), name="of_span", reset_less=True)
            with m.If(advance & ends):
                m.d.sync += copy_fields(held, span, shared)
            m.d.comb += copy_fields(words, held, shared)
        return m

    @staticmethod
    def _words(view: data.View) -> Iterator[tuple[str, Value]]:
        """Name and bits of every line's word in a view with `_lines`."""
        for name in view.shape().members:
            if name in ("colors", "coordinates"):
                for index, word in enumerate(view[name]):
                    yield f"{name}_{index}", Value.cast(word)
            elif name == "weight":
                yield name, Value.cast(view[name])
