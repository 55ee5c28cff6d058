"""Compilers that are missing, fail or produce wrong code; refusals of the compiled engine; its operations."""

import functools
import importlib.util
import operator
import os
import random
import re

import numpy as np
import pytest
from amaranth.hdl import Assert, Cat, Const, Module, Mux, Print, Signal, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

from blysk.sim.engines import compilers
from blysk.sim.engines.engine import CompilerMissing, SimulationError
from blysk.sim.engines.simulate import simulate

from .scale import BEATS, REMEDY, Scale, entries, left_in, scaled, script

pytestmark = pytest.mark.usefixtures("cache")


def cut(value, width):
    """Lowest bits of an integer, two's complement."""
    return value & ((1 << width) - 1)


WIDTHS = ((5, 32), (33, 1), (64, 63), (70, 20))

ARITHMETIC = {
    "sum": lambda a, b, c: a + b,
    "difference": lambda a, b, c: a - b,
    "product": lambda a, b, c: a * b,
    "negative": lambda a, b, c: -b,
    "and": lambda a, b, c: a & b,
    "or": lambda a, b, c: a | b,
    "xor": lambda a, b, c: a ^ b,
    "less": lambda a, b, c: a < b,
    "at most": lambda a, b, c: a <= b,
    "more": lambda a, b, c: a > b,
    "at least": lambda a, b, c: a >= b,
    "equal": lambda a, b, c: a == b,
    "unequal": lambda a, b, c: a != b,
    "left": lambda a, b, c: a << c,
    "right": lambda a, b, c: b >> c,
}

OTHERS = {
    "smaller": (lambda a, b, c: Mux(a < b, a, b), lambda a, b, c, m, n: min(a, b)),
    "quotient": (lambda a, b, c: a // b, lambda a, b, c, m, n: a // b if b else 0),
    "remainder": (lambda a, b, c: a % b, lambda a, b, c, m, n: a % b if b else 0),
    "not": (lambda a, b, c: ~b, lambda a, b, c, m, n: ~b),
    "any": (lambda a, b, c: b.any(), lambda a, b, c, m, n: b != 0),
    "all": (lambda a, b, c: b.all(), lambda a, b, c, m, n: cut(b, n) == cut(-1, n)),
    "parity": (lambda a, b, c: b.xor(), lambda a, b, c, m, n: cut(b, n).bit_count() % 2),
    "joined": (
        lambda a, b, c: Cat(a, b, a)[len(a) // 2 :],
        lambda a, b, c, m, n: (cut(a, m) | cut(b, n) << m | cut(a, m) << m + n) >> m // 2,
    ),
    "repeated": (lambda a, b, c: a[-1].replicate(40), lambda a, b, c, m, n: -(a >> m - 1 & 1)),
    "selected": (lambda a, b, c: b.as_unsigned().bit_select(c, 4), lambda a, b, c, m, n: cut(b, n) >> c),
}


class Operations(Component):
    """Every operation on ``a`` and ``b`` of each pair of widths, and on ``c``, folded into 64 bits each."""

    def __init__(self, is_signed):
        self.kind = signed if is_signed else unsigned
        operand = data.ArrayLayout(32, 5)
        results = data.ArrayLayout(64, len(WIDTHS) * (len(ARITHMETIC) + len(OTHERS)))
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout({"a": operand, "b": operand, "c": 7}))),
                "o": Out(stream.Signature(results)),
            }
        )

    def operands(self, m, n):
        kind, payload = self.kind, self.i.payload
        words = payload.a.as_value()[:m], payload.b.as_value()[:n]
        a, b = (word.as_signed() if kind is signed else word for word in words)
        return a, b, payload.c

    def results(self):
        functions = [*ARITHMETIC.values(), *(function for function, _ in OTHERS.values())]
        return [function(*self.operands(m, n)) for m, n in WIDTHS for function in functions]

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += self.o.valid.eq(self.i.valid)
            for index, result in enumerate(self.results()):
                pieces = [result[start : start + 64] for start in range(0, len(result), 64)]
                m.d.sync += self.o.payload[index].eq(functools.reduce(operator.xor, pieces))
        return m

    def expected(self, beats):
        """Results of Python's integers, for words of a and b as one integer each, and c."""
        widths = [len(result) for result in self.results()]
        rows = []
        for words in beats:
            row = []
            for m, n in WIDTHS:
                a, b, c = cut(words[0], m), cut(words[1], n), words[2]
                if self.kind is signed:
                    a, b = a - (a >> m - 1 << m), b - (b >> n - 1 << n)
                row += [int(function(a, b, c)) for function in ARITHMETIC.values()]
                row += [int(function(a, b, c, m, n)) for _, function in OTHERS.values()]
            values = [cut(value, width) for value, width in zip(row, widths, strict=True)]
            rows.append(
                [
                    cut(value ^ value >> 64 ^ value >> 128 ^ value >> 192 ^ value >> 256, 64)
                    for value in values
                ]
            )
        return np.array(rows, dtype=np.uint64)


@pytest.mark.long
@pytest.mark.parametrize(
    "is_signed", [False, pytest.param(True, marks=pytest.mark.ci)], ids=["unsigned", "signed"]
)
def test_operations_against_integers(is_signed):
    """The driver's own operations, which replace CXXRTL's, are compared with Python's integers."""
    rng = random.Random(3)
    edges = [0, 1, 2, -1, -2, *(sign << width - 1 for pair in WIDTHS for width in pair for sign in (1, -1))]
    beats = [
        (cut(rng.choice(edges), 160), cut(rng.choice(edges), 160), rng.randrange(128)) for _ in range(400)
    ]
    beats += [
        (rng.getrandbits(160), rng.getrandbits(160) >> rng.randrange(160), rng.randrange(40))
        for _ in range(200)
    ]
    component = Operations(is_signed)
    words = [[[beat[k] >> 32 * word & 0xFFFFFFFF for word in range(5)] for beat in beats] for k in range(2)]
    operands = {"a": np.array(words[0]), "b": np.array(words[1]), "c": np.array([beat[2] for beat in beats])}
    run = simulate(component, operands, count=len(beats))
    expected = component.expected(beats)
    names = [f"{name} of {m} and {n} bits" for m, n in WIDTHS for name in (*ARITHMETIC, *OTHERS)]
    wrong = np.flatnonzero((run.beats != expected).any(axis=0))
    assert [names[index] for index in wrong] == []


def test_no_compiler(monkeypatch, cache):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert list(compilers.find_compilers()) == []
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    tried = "tried c++, g++, clang++ and the package ziglang"
    assert str(caught.value) == f"no working C++ compiler ({tried}): {REMEDY}"
    assert entries(cache) == []
    with pytest.warns(RuntimeWarning, match="using pysim"):
        assert scaled(engine="auto") == (3 * BEATS).tolist()


def test_flags_of_the_environment_come_last(monkeypatch):
    monkeypatch.setenv("CXXFLAGS", "-O0 '-DA=b c'")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    for compiler in compilers.find_compilers():
        assert compiler.compile.index("-O2") < compiler.compile.index("-O0")
        assert "-DA=b c" in compiler.compile


VERSION = 'case "$1" in --version) echo 1.0; exit 0;; esac; '
OUTPUT = VERSION + "for last; do :; done; "

BROKEN = {
    "no version": ("exit 1", "CXX={} is not found or prints no version"),
    "failing": (
        VERSION + 'echo "file: error: out of luck" >&2; echo more >&2; exit 3',
        "{} ends with status 3: file: error: out of luck",
    ),
    "killed": (OUTPUT + 'head -c 5000 "$0" > "$last"; kill -9 $$', "{} ends with signal 9: no message"),
    "lazy": ("echo 1.0", "{} makes nothing"),
    "text": (OUTPUT + 'echo garbage > "$last"', "{} makes a library that does not load: .+"),
    "empty": (OUTPUT + 'true > "$last"', "{} makes a library that does not load: .+"),
}


@pytest.mark.parametrize(
    "name",
    [
        name if name == "failing" else pytest.param(name, marks=[pytest.mark.ci, pytest.mark.long])
        for name in BROKEN
    ],
)
def test_broken_compiler(monkeypatch, tmp_path, cache, temporary, name):
    """There is one line, and no file that the compiler wrote is left.

    The next compiler finds everything unchanged.
    """
    text, reason = BROKEN[name]
    path = script(tmp_path, "broken", text)
    monkeypatch.setenv("CXX", path)
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    line = rf"no working C\+\+ compiler \({reason.format(re.escape(path))}\): {re.escape(REMEDY)}"
    assert re.fullmatch(line, str(caught.value))
    assert left_in(cache, temporary) == []
    monkeypatch.delenv("CXX")
    if name == "text":
        assert scaled() == (3 * BEATS).tolist()


def test_chosen_compiler_is_not_there(monkeypatch):
    monkeypatch.setenv("CXX", "/nowhere/c++ -m64")
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    reason = "CXX=/nowhere/c++ -m64 is not found or prints no version"
    assert str(caught.value) == f"no working C++ compiler ({reason}): {REMEDY}"


def test_a_broken_compiler_gives_way_to_the_next(monkeypatch, tmp_path):
    folder = tmp_path / "bin"
    folder.mkdir()
    script(folder, "c++", 'case "$1" in --version) echo 1.0; exit 0;; esac; exit 1')
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    names = [compiler.name for compiler in compilers.find_compilers()]
    if len(names) < 2:
        pytest.skip("there is one compiler only")
    assert names[0] == "c++"
    assert scaled() == (3 * BEATS).tolist()


def test_compiler_that_miscompiles_is_found_out(monkeypatch, tmp_path, cache):
    """The check against pysim finds a compiler that changes the factor 3."""
    text = (
        'case "$1" in --version) exec c++ --version;; esac; '
        "sed -i 's/0x3ull <</0x2ull <</' model.cc; "
        'exec c++ "$@"'
    )
    monkeypatch.setenv("CXX", script(tmp_path, "sly", text))
    component = Scale()
    for _ in range(2):
        with pytest.raises(
            SimulationError, match="model of Scale and pysim differ in output within the first"
        ):
            simulate(component, BEATS, count=4)
    assert entries(cache) == []
    monkeypatch.delenv("CXX")
    assert scaled() == (3 * BEATS).tolist()
    assert len(entries(cache)) == 1


class Buffer(Component):
    """A queue of 16 in a memory with a write port.

    CXXRTL's run time then needs `operator new` and a vector.
    """

    i: In(stream.Signature(35))
    o: Out(stream.Signature(35))

    def elaborate(self, platform):
        m = Module()
        m.submodules.memory = memory = Memory(shape=35, depth=16, init=[])
        store, fetch = memory.write_port(), memory.read_port(domain="comb")
        head, tail = Signal(5), Signal(5)
        m.d.comb += [
            self.i.ready.eq((head - tail)[:5] != 16),
            store.addr.eq(head),
            store.data.eq(self.i.payload),
            store.en.eq(self.i.valid & self.i.ready),
            fetch.addr.eq(tail),
        ]
        m.d.sync += head.eq(head + store.en)
        with m.If(~self.o.valid | self.o.ready):
            m.d.sync += [
                self.o.valid.eq(head != tail),
                self.o.payload.eq(fetch.data),
                tail.eq(tail + (head != tail)),
            ]
        return m


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None, reason="the package ziglang is not installed"
)
def test_zig(monkeypatch, cache):
    monkeypatch.setattr(compilers, "_system_compiler", lambda command: None)
    assert [compiler.name for compiler in compilers.find_compilers()] == ["ziglang"]
    beats = np.arange(100) << 28
    stalls = np.random.default_rng(2).random(30) < 0.6
    run = simulate(Buffer(), beats, count=100, output_stalls=stalls)
    np.testing.assert_array_equal(run.beats, beats)
    assert len(entries(cache)) == 1


def test_combinational_feedback_is_refused():
    class Tangled(Scale):
        def elaborate(self, platform):
            m = super().elaborate(platform)
            fields = Signal(data.StructLayout({"a": 18, "b": 18, "c": 18}))
            m.d.comb += [
                fields.a.eq(self.i.payload + 1),
                fields.b.eq(fields.a * 5),
                fields.c.eq(fields.b ^ fields.a),
            ]
            with m.If(self.i.ready):
                m.d.sync += self.o.payload.eq(fields.c)
            return m

    with pytest.raises(
        SimulationError, match=r"^Yosys: Design contains feedback wires.* give each field its own signal"
    ):
        simulate(Tangled(), BEATS, count=4)
    assert len(simulate(Tangled(), BEATS, count=4, engine="pysim").beats) == 4


def test_other_clock_domains_are_refused():
    class Faster(Scale):
        def elaborate(self, platform):
            m = super().elaborate(platform)
            m.d.fast += Signal(3, name="counter").eq(1)
            return m

    with pytest.raises(ValueError, match=r"^Faster has inputs that nothing drives: fast_clk, fast_rst$"):
        simulate(Faster(), BEATS, count=4)


@pytest.mark.parametrize("statement", [Assert(Const(1)), Print("here")], ids=["assert", "print"])
def test_assertions_and_prints_are_refused(statement):
    class Talking(Scale):
        def elaborate(self, platform):
            m = super().elaborate(platform)
            m.d.sync += statement
            return m

    message = r"^Talking has an assertion or a print statement, which only the engine pysim runs$"
    with pytest.raises(ValueError, match=message):
        simulate(Talking(), BEATS, count=4)
