"""Expressions as machine words: every operation at the widths where a word begins or ends, against pysim."""

import re

import numpy as np
import pytest
from amaranth.hdl import Cat, Module, Mux, Signal, signed
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines import words
from blysk.sim.engines.words import plain_words

from .components import both
from .test_guards import Few, generated


def leading_zeros(word):
    """Counted by halves; the upper half has a power of two of bits."""
    if len(word) == 1:
        return ~word
    upper = 1 << (len(word) - 1).bit_length() - 1
    high, low = word[-upper:], word[:-upper]
    return Mux(high.any(), leading_zeros(high), upper + leading_zeros(low))


class Operations(Component):
    """Amaranth's operations on a and b of a width and an amount c, signed and unsigned.

    Fields lie across words.
    """

    i: In(stream.Signature(data.StructLayout({"a": 64, "b": 64, "c": 7})))
    o: Out(stream.Signature(data.ArrayLayout(64, 26)))

    def __init__(self, width):
        self.width = width
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        width, given = self.width, self.i.payload
        a, b = given.a[:width], given.b[:width]
        s, t = a.as_signed(), b.as_signed()
        c, k = given.c, Signal(signed(width), init=-1 << width - 1)
        results = [
            a + b,
            s - t,
            (a * b)[:64],
            (s * t)[:64],
            Cat(a & b, a | t, ~s),
            Cat(a ^ b, -s, -a),
            Cat(a == b, a != t, a < b, a <= b, s > t, s >= t, s < b),
            Cat(a.any(), a.all(), a.bool(), ~a[0], s != k, s == -1, (a & b).any()),
            (a << c[:5])[:64],
            (s << c[:6])[:64],
            a >> c,
            s >> c,
            Mux(c[0], a, t),
            Mux(a > b, Cat(a, b), Cat(b, a)),
            Cat(b[: width // 2], a[width // 2 :], c).rotate_left(3),
            a[-1].replicate(width) ^ b,
            Cat(a, b)[width // 2 : width // 2 + width],
            a.word_select(c[:1], max(1, width // 2)),
            a.bit_select(c[:6], width),
            s + k,
        ]
        wide = Signal(150, init=5)
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += self.o.valid.eq(self.i.valid)
            m.d.sync += wide[60 - width // 2 :][:width].eq(a)
            m.d.sync += [place.eq(result) for place, result in zip(self.o.payload, results, strict=False)]
            # Of one word, and of bits across words. The halves of the second do not belong to the same word.
            m.d.sync += self.o.payload[24].eq(Cat(leading_zeros(a), leading_zeros((a >> c)[:width])))
            mixed = Mux(a[-1:].any(), leading_zeros(a[-1:]), 1 + leading_zeros(b[:1]))
            m.d.sync += self.o.payload[25].eq(Cat(leading_zeros(wide[50:107]), mixed))
            m.d.sync += self.o.payload[20].eq(wide[50:114])
            m.d.sync += self.o.payload[21].eq(wide[60 - width // 2 :][:width])
            with m.If(wide[:100].any() & (wide[1:101] != wide[:100])):
                m.d.sync += self.o.payload[22].eq((wide ^ Cat(given.a, given.b))[40:104])
            with m.Else():
                m.d.sync += self.o.payload[23].eq((~wide)[37:101])
        return m


@pytest.mark.parametrize(
    ("width", "long"), [(33, 64), *(pytest.param(n, words.LONG, marks=pytest.mark.long) for n in (1, 64))]
)
def test_as_in_pysim(monkeypatch, width, long):
    """Small numbers, numbers with all bits, and random numbers, under stalls.

    Operands of long expressions have names.
    """
    monkeypatch.setattr(words, "LONG", long)
    rng = np.random.default_rng(width)
    numbers = rng.integers(0, 1 << 64, (2, 200), dtype=np.uint64)
    numbers[:, :60] = rng.choice(np.array([0, 1, 3, (1 << 64) - 1, 1 << 63, 1 << 31], np.uint64), (2, 60))
    numbers[1, 40:80] = numbers[0, 40:80]
    beats = {"a": numbers[0], "b": numbers[1], "c": rng.integers(0, 128, 200)}
    both(Operations(width), beats, 200, output_stalls=rng.random(97) < 0.3)


def test_templates_are_gone(monkeypatch):
    """CXXRTL's templates are only left in operations of more than 64 bits. Then the text keeps its header."""
    operation, header = re.compile(r"\b\w+_[us]+<\d+>\(|reduce_|logic_"), "#include <cxxrtl/cxxrtl.h>"
    wide = plain_words(generated(Operations(24), monkeypatch))
    assert set(operation.findall(wide)) == {"xor_uu<150>("}
    assert header in wide
    narrow = plain_words(generated(Few(), monkeypatch))
    assert not operation.search(narrow)
    assert header not in narrow


def test_leading_zeros_are_one_operation(monkeypatch):
    """Leading zeros of one word. A choice between halves of two words stays a choice."""
    text = plain_words(generated(Operations(24), monkeypatch))
    assert re.search(r"leading_zeros\(\(p_\w+\.data\[0\]\), 24\)|leading_zeros\(.*, 24\)", text)
    assert re.search(r"leading_zeros\(.*, 57\)", text)


def test_text_that_is_not_understood_stays():
    for text in ("", "struct p_top {};", "bool p_top::eval(performer *performer) {\n\tp_x = odd(p_y);\n}"):
        assert plain_words(text) == text
