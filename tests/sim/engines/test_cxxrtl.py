"""The compiled engine's own affairs: compilers, the cache, the check of a new model, batches."""

import functools
import gc
import importlib.util
import operator
import os
import random
import re
import shutil
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import Assert, Cat, Const, Module, Mux, Print, Signal, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

import blysk.sim.engines.simulate
from blysk.sim.engines import cache as cache_module
from blysk.sim.engines import compilers, cxxrtl
from blysk.sim.engines.engine import CompilerMissing, SimulationError
from blysk.sim.engines.simulate import simulate

REMEDY = "install one, or pip install 'blysk[native]', or use the engine pysim"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache of each test's own."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("BLYSK_CACHE", str(folder))
    monkeypatch.delenv("CXX", raising=False)
    return folder


class Scale(Component):
    """``factor x``, through one register."""

    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(36)))

    def __init__(self, factor=3):
        super().__init__()
        self.factor = factor

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload * self.factor)]
        return m


BEATS = np.array([1, -2, 131071, -131072])


def scaled(factor=3, **arguments):
    return simulate(Scale(factor), BEATS, count=4, **arguments).beats.tolist()


def entries(folder, suffix=".model"):
    return sorted(path for path in folder.iterdir() if path.suffix == suffix)


def script(folder, name, text):
    path = folder / name
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """A compiler that writes into `LOG` what it compiles."""
    text = 'case "$*" in *driver.cc*) echo x >> "$LOG";; esac; exec c++ "$@"'
    return script(tmp_path_factory.mktemp("compiler"), "logged", text)


@pytest.fixture
def builds(tmp_path, logged, monkeypatch):
    """Number of models compiled so far, as a function."""
    log = tmp_path / "log"
    log.touch()
    monkeypatch.setenv("LOG", str(log))
    monkeypatch.setenv("CXX", logged)
    return lambda: log.read_text().count("x")


@pytest.fixture(scope="module")
def prebuilt(tmp_path_factory, logged):
    """A cache with the model of ``Scale(3)``, as the logged compiler makes it."""
    folder = tmp_path_factory.mktemp("prebuilt") / "cache"
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("BLYSK_CACHE", folder), ("CXX", logged), ("LOG", os.devnull)):
            patch.setenv(name, str(value))
        assert scaled() == (3 * BEATS).tolist()
    return folder


@pytest.fixture
def filled(prebuilt, cache, builds):
    """The cache, with that model in it; ``builds`` is 0."""
    shutil.copytree(prebuilt, cache)
    return cache


# Operations.


def cut(value, width):
    """Lowest bits of an integer, two's complement."""
    return value & ((1 << width) - 1)


WIDTHS = ((5, 32), (33, 1), (64, 63), (70, 20))

# Of Amaranth's values as of Python's integers.
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
# The same of both, in their own words; of the integers' patterns of m and n bits.
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
        """What Python's integers give, for words of a and b as one integer each, and c."""
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


@pytest.mark.parametrize("is_signed", [False, True], ids=["unsigned", "signed"])
def test_operations_against_integers(is_signed):
    """The driver's own operations, which stand in for CXXRTL's, in Python's integers."""
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


# Compilers.


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


def test_chosen_compiler_is_not_there(monkeypatch):
    monkeypatch.setenv("CXX", "/nowhere/c++ -m64")
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    reason = "CXX=/nowhere/c++ -m64 is not found or prints no version"
    assert str(caught.value) == f"no working C++ compiler ({reason}): {REMEDY}"


def test_compiler_that_cannot_even_print_its_version(monkeypatch, tmp_path):
    monkeypatch.setenv("CXX", script(tmp_path, "broken", "exit 1"))
    with pytest.raises(CompilerMissing, match="is not found or prints no version"):
        scaled()


def test_compiler_that_fails(monkeypatch, tmp_path, cache):
    text = (
        'case "$1" in --version) echo 1.0; exit 0;; esac; '
        'echo "file: error: out of luck" >&2; echo more >&2; exit 3'
    )
    path = script(tmp_path, "broken", text)
    monkeypatch.setenv("CXX", path)
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    reason = f"{path} ends with status 3: file: error: out of luck"
    assert str(caught.value) == f"no working C++ compiler ({reason}): {REMEDY}"
    assert list(cache.iterdir()) == []


@pytest.mark.parametrize("output", ["echo garbage", "true"], ids=["text", "empty"])
def test_compiler_that_writes_garbage(monkeypatch, tmp_path, cache, output):
    text = f'case "$1" in --version) echo 1.0; exit 0;; esac; for last; do :; done; {output} > "$last"'
    path = script(tmp_path, "broken", text)
    monkeypatch.setenv("CXX", path)
    with pytest.raises(CompilerMissing) as caught:
        scaled()
    message = str(caught.value)
    assert message.startswith(f"no working C++ compiler ({path} makes a library that does not load: ")
    assert "\n" not in message
    assert list(cache.iterdir()) == []


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
    """The check against pysim: a compiler that changes the factor 3."""
    text = (
        'case "$1" in --version) exec c++ --version;; esac; '
        "sed -i 's/value<3>{0x3u}/value<3>{0x2u}/; s/value<2>{0x3u}/value<2>{0x1u}/' model.cc; "
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
    """A queue of 16 in a memory with a write port: CXXRTL's run time needs `operator new` and a vector."""

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
        SimulationError, match=r"^Yosys: Design contains feedback wires.* give each its own signal"
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


# The cache.


def test_second_model_comes_from_the_cache(filled, builds):
    cache = filled
    assert len(entries(cache)) == 1
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 0
    for _ in range(2):
        assert scaled(5) == (5 * BEATS).tolist()
        assert builds() == 1
    assert len(entries(cache)) == len(list(cache.iterdir())) == 2
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700


def test_cached_model_needs_neither_yosys_nor_pysim(filled, monkeypatch):
    def never(*arguments):
        raise AssertionError("the model is in the cache")

    monkeypatch.setattr(cxxrtl._Yosys, "run", never)
    monkeypatch.setattr(cxxrtl, "Interpreted", never)
    assert scaled() == (3 * BEATS).tolist()
    with pytest.raises(AssertionError, match="the model is in the cache"):
        scaled(5)


@pytest.mark.parametrize("what", ["compiler", "script", "rewriting"])
def test_another_compiler_or_script_is_another_entry(filled, builds, monkeypatch, what):
    if what == "compiler":
        monkeypatch.setenv("CXX", f"{os.environ['CXX']} -DOTHER")
    elif what == "rewriting":
        source = cxxrtl._source
        monkeypatch.setattr(cxxrtl, "_source", lambda name: source(name) + "\n")
    else:
        monkeypatch.setattr(cxxrtl, "_SCRIPT", cxxrtl._SCRIPT.replace("flatten;", "flatten; opt_expr;"))
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert len(entries(filled)) == 2


@pytest.mark.parametrize("damage", ["flip", "cut", "empty"])
def test_corrupted_entry_is_built_again(filled, builds, damage):
    (entry,) = entries(filled)
    content = bytearray(entry.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 1
    elif damage == "cut":
        del content[-100:]
    else:
        content = b""
    # A new file: the one that is loaded stays mapped.
    entry.unlink()
    entry.write_bytes(content)
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    (again,) = entries(filled)
    assert again.read_bytes() != content


def test_entry_with_a_true_checksum_that_does_not_load_is_built_again(filled, builds):
    (entry,) = entries(filled)
    key = entry.stem.split("-")[0]
    entry.unlink()
    other = filled / "other"
    other.write_bytes(b"not a library")
    other.rename(filled / f"{key}-{cxxrtl._digest(other)}.model")
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert [path.stem.split("-")[0] for path in entries(filled)] == [key]


def test_model_of_another_key_is_not_taken(filled, builds):
    (three,) = entries(filled)
    scaled(5)
    (five,) = set(entries(filled)) - {three}
    key, digest = three.stem.split("-")[0], five.stem.split("-")[1]
    three.unlink()
    (filled / f"{key}-{digest}.model").write_bytes(five.read_bytes())
    assert scaled(3) == (3 * BEATS).tolist()
    assert builds() == 2


def test_cache_that_others_can_write_is_not_used(filled, builds):
    cache = filled
    for mode in (0o770, 0o702):
        cache.chmod(mode)
        (planted,) = entries(cache)
        before = planted.read_bytes()
        built = builds()
        cache_module.private_folder.cache_clear()
        warning = (
            rf"^cache folder {re.escape(str(cache))} can be written by others \(chmod go-w\): compiled models"
        )
        with pytest.warns(RuntimeWarning, match=warning):
            assert scaled() == (3 * BEATS).tolist()
        assert builds() == built + 1
        assert [path.read_bytes() for path in entries(cache)] == [before]


def test_cache_of_another_user_is_not_used(cache, monkeypatch):
    cache.mkdir(mode=0o700)
    owner = cache.stat().st_uid
    monkeypatch.setattr(os, "getuid", lambda: owner + 1)
    with pytest.warns(
        RuntimeWarning, match="belongs to another user: compiled models are kept for this run only"
    ):
        assert scaled() == (3 * BEATS).tolist()
    assert entries(cache) == []


def test_cache_that_cannot_be_made(cache, monkeypatch):
    cache.write_text("a file in the way")
    monkeypatch.setenv("BLYSK_CACHE", str(cache / "folder"))
    with pytest.warns(RuntimeWarning, match=r"cannot be made \(Not a directory\): compiled models are kept"):
        assert scaled() == (3 * BEATS).tolist()


def test_cache_that_cannot_be_written(cache, monkeypatch):
    cache.mkdir(mode=0o500)
    # The superuser may write anywhere; then only the answer can be tried.
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != cache and access(path, mode))
    with pytest.warns(RuntimeWarning, match="cannot be written: compiled models are kept for this run only"):
        assert scaled() == (3 * BEATS).tolist()
    assert entries(cache) == []


def test_cache_that_fills_up_meanwhile(cache, monkeypatch):
    def full(source, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    component = Scale()
    for _ in range(2):
        assert simulate(component, BEATS, count=4).beats.tolist() == (3 * BEATS).tolist()
    assert entries(cache) == []


def test_relative_paths(monkeypatch, tmp_path):
    script(tmp_path, "compiler", 'exec c++ "$@"')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BLYSK_CACHE", "models")
    monkeypatch.setenv("CXX", "./compiler")
    assert scaled() == (3 * BEATS).tolist()
    assert len(entries(tmp_path / "models")) == 1


def test_default_cache_is_the_users(monkeypatch, tmp_path):
    monkeypatch.delenv("BLYSK_CACHE")
    monkeypatch.setattr(cache_module.platformdirs, "user_cache_path", lambda name: tmp_path / "home" / name)
    assert cache_module.cache_folder() == tmp_path / "home" / "blysk"


PROGRAM = """
import numpy as np
from amaranth.hdl import Assert, Const, Module, Print, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out
from blysk.sim.engines.simulate import simulate

class Triple(Component):
    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(36)))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [self.o.valid.eq(self.i.valid), self.o.payload.eq(self.i.payload * 3)]
        return m
"""


def start(program, **environment):
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM + program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
        env=os.environ | environment,
    )


def test_two_processes_at_once(builds, cache):
    """Both find the cache empty and build; one entry is left, whole, and nothing beside it."""
    program = "print(simulate(Triple(), np.arange(5), count=5).beats.tolist())"
    # Other hash seeds: the netlist, and with it the key, must not depend on the order of sets.
    processes = [start(program, PYTHONHASHSEED=seed) for seed in ("1", "2")]
    for process in processes:
        output, errors = process.communicate(timeout=60)
        assert (process.returncode, errors) == (0, "")
        assert output == "[0, 3, 6, 9, 12]\n"
    assert 1 <= builds() <= 2
    keys = {path.name.split("-")[0] for path in cache.iterdir()}
    assert len(keys) == 1
    assert entries(cache) == sorted(cache.iterdir())
    count = builds()
    process = start(program, PYTHONHASHSEED="3")
    assert process.communicate(timeout=60)[0] == "[0, 3, 6, 9, 12]\n"
    assert builds() == count


# Batches.


def test_batches_leave_no_trace(filled, monkeypatch):
    beats = np.random.default_rng(4).integers(-100, 100, 300)
    stalls = np.random.default_rng(5).random((2, 23)) < 0.5
    component = Scale()
    arguments = {"count": 300, "input_stalls": stalls[0], "output_stalls": stalls[1]}
    whole = simulate(component, beats, **arguments)
    monkeypatch.setattr(cxxrtl, "_BATCH", 7)
    seen = []
    for count in (300, None):
        parts = simulate(
            component, beats, **arguments | {"count": count, "progress": seen.append, "idle_timeout": 90}
        )
        np.testing.assert_array_equal(parts.beats, whole.beats)
        np.testing.assert_array_equal(parts.cycles, whole.cycles)
        np.testing.assert_array_equal(parts.input_cycles, whole.input_cycles)
        assert parts.total_cycles == whole.total_cycles
    assert seen[0] <= 7
    assert 300 in seen


@pytest.mark.parametrize("end", ["drops", "stuck"])
def test_errors_are_the_same_in_batches(monkeypatch, end):
    class Faulty(Scale):
        def elaborate(self, platform):
            m = super().elaborate(platform)
            age = Signal(8)
            m.d.sync += age.eq(age + (age != 255))
            with m.If(age == 60 if end == "drops" else age >= 60):
                m.d.sync += self.o.valid.eq(0)
            return m

    stalls = np.arange(64) == 60
    messages = []
    for batch in (1000, 1, 61):
        monkeypatch.setattr(cxxrtl, "_BATCH", batch)
        with pytest.raises(SimulationError) as caught:
            simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, idle_timeout=600)
        messages.append(str(caught.value))
    with pytest.raises(SimulationError) as caught:
        simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, idle_timeout=600, engine="pysim")
    assert messages == [str(caught.value)] * 3


def test_interrupt_between_batches(filled):
    """Ctrl-C ends a run that would take for ever, within a batch or so."""
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals go to the main thread")
    component = Scale()
    simulate(component, BEATS, count=4)
    beats = np.zeros(100, dtype=int)
    # One beat in 100 million cycles.
    stalls = np.ones(10**8, dtype=bool)
    stalls[5] = False
    started = time.monotonic()
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulate(component, beats, count=100, input_stalls=stalls, idle_timeout=10**10)
    assert time.monotonic() - started < 5
    timer.join()
    assert simulate(component, BEATS, count=4).beats.tolist() == (3 * BEATS).tolist()


def test_an_exception_in_progress_ends_the_run(filled):
    def stop(done):
        raise RuntimeError(f"stop at {done}")

    with pytest.raises(RuntimeError, match=r"^stop at 4$"):
        scaled(progress=stop)


@pytest.mark.parametrize("enabled", [True, False])
def test_garbage_collection_is_as_before(enabled, filled, monkeypatch):
    """Off while a netlist is made, also when that fails; then as the caller has it."""
    seen = []
    convert = cxxrtl.rtlil.convert

    def watched(*arguments, **options):
        seen.append(gc.isenabled())
        return convert(*arguments, **options)

    monkeypatch.setattr(cxxrtl.rtlil, "convert", watched)
    before = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        assert scaled() == (3 * BEATS).tolist()
        assert gc.isenabled() == enabled
        with pytest.raises(ZeroDivisionError), cxxrtl._without_collection():
            raise ZeroDivisionError
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if before else gc.disable)()
    assert seen == [False]


@pytest.mark.parametrize("count", [None, 300])
@pytest.mark.parametrize(("batch", "room"), [(1, 1), (7, 2), (1000, 1), (50, 1 << 24)])
def test_room_for_the_output_grows(filled, monkeypatch, count, batch, room):
    monkeypatch.setattr(cxxrtl, "_BATCH", batch)
    monkeypatch.setattr(cxxrtl, "_ROOM", room)
    beats = np.arange(-150, 150)
    run = simulate(Scale(), beats, count=count, idle_timeout=100)
    assert run.beats.tolist() == (3 * beats).tolist()
    assert run.cycles.tolist() == list(range(1, 301))


@pytest.mark.parametrize("piece", [1, 7, 300, 301])
def test_beats_are_unpacked_in_pieces(filled, monkeypatch, piece):
    monkeypatch.setattr(blysk.sim.engines.simulate, "_PIECE", piece)
    beats = np.arange(-150, 150)
    assert simulate(Scale(), beats, count=300).beats.tolist() == (3 * beats).tolist()
    assert simulate(Scale(), beats[:0], count=0).beats.tolist() == []
