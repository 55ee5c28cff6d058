"""The compiled engine's own affairs: compilers, the cache, the check of a new model, batches."""

import importlib.util
import os
import re
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import Assert, Const, Module, Print, Signal, signed, unsigned
from amaranth.lib import data, stream
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Component, In, Out

from sim import cxxrtl
from sim.engine import CompilerMissing, SimulationError, simulate

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


def logged_compiler(folder, log):
    """A compiler that counts the files it compiles."""
    compiler = "c++"
    return script(folder, "logged", f'case "$*" in *driver.cc*) echo x >> {log};; esac; exec {compiler} "$@"')


@pytest.fixture
def builds(tmp_path, monkeypatch):
    """Number of models compiled so far, as a function."""
    log = tmp_path / "log"
    log.touch()
    monkeypatch.setenv("CXX", logged_compiler(tmp_path, log))
    return lambda: log.read_text().count("x")


# Arithmetic.


class Arithmetic(Component):
    """Sums, differences and products of ``a`` and ``b`` in a few widths around 32 and 64 bits."""

    WIDTHS = ((1, 1), (5, 12), (31, 33), (32, 32), (63, 63))

    def __init__(self, widths, is_signed):
        kind = signed if is_signed else unsigned
        self.kind = kind
        a, b = kind(widths[0]), kind(widths[1])
        # Results cut off at 63 bits, and one at an odd width under it.
        self.results = {"sum": 63, "difference": 63, "product": 63, "short": min(widths) + 1}
        super().__init__(
            {
                "i": In(stream.Signature(data.StructLayout({"a": a, "b": b}))),
                "o": Out(
                    stream.Signature(data.StructLayout({name: kind(w) for name, w in self.results.items()}))
                ),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        a, b, o = self.i.payload.a, self.i.payload.b, self.o.payload
        with m.If(self.i.ready):
            m.d.sync += [
                self.o.valid.eq(self.i.valid),
                o.sum.eq(a + b),
                o.difference.eq(a - b),
                o.product.eq(a * b),
                o.short.eq(a * b - a),
            ]
        return m

    def model(self, a, b):
        rows = []
        for x, y in zip(a.tolist(), b.tolist(), strict=True):
            row = []
            for value, width in zip((x + y, x - y, x * y, x * y - x), self.results.values(), strict=True):
                value %= 1 << width
                row.append(value - (1 << width) if self.kind is signed and value >> (width - 1) else value)
            rows.append(tuple(row))
        return rows


@pytest.mark.parametrize("is_signed", [False, True], ids=["unsigned", "signed"])
@pytest.mark.parametrize("widths", Arithmetic.WIDTHS)
def test_arithmetic_against_integers(widths, is_signed):
    """The driver's own arithmetic, which stands in for CXXRTL's, in Python's integers."""
    rng = np.random.default_rng(3)
    columns = []
    for width in widths:
        low, high = (-(1 << width) // 2, (1 << width) // 2 - 1) if is_signed else (0, (1 << width) - 1)
        edges = [value for value in (low, low + 1, -1, 0, 1, high - 1, high) if low <= value <= high]
        columns.append((edges, rng.integers(low, high, 200, endpoint=True)))
    (edges_a, a), (edges_b, b) = columns
    grid = np.array([(x, y) for x in edges_a for y in edges_b])
    a, b = np.concatenate([grid[:, 0], a]), np.concatenate([grid[:, 1], b])
    component = Arithmetic(widths, is_signed)
    run = simulate(component, {"a": a, "b": b}, count=len(a))
    assert run.beats.tolist() == component.model(a, b)


# Compilers.


def test_no_compiler(monkeypatch, cache):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert list(cxxrtl.find_compilers()) == []
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
    names = [compiler.name for compiler in cxxrtl.find_compilers()]
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
    monkeypatch.setattr(cxxrtl, "_system_compiler", lambda command: None)
    assert [compiler.name for compiler in cxxrtl.find_compilers()] == ["ziglang"]
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


def test_second_model_comes_from_the_cache(builds, cache):
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 1
    assert scaled(5) == (5 * BEATS).tolist()
    assert builds() == 2
    assert len(entries(cache)) == len(list(cache.iterdir())) == 2
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700


def test_cached_model_needs_neither_yosys_nor_pysim(builds, monkeypatch):
    scaled()

    def never(*arguments):
        raise AssertionError("the model is in the cache")

    monkeypatch.setattr(cxxrtl._Yosys, "run", never)
    monkeypatch.setattr(cxxrtl, "Interpreted", never)
    assert scaled() == (3 * BEATS).tolist()


def test_another_compiler_is_another_entry(builds, cache, monkeypatch):
    scaled()
    monkeypatch.setenv("CXX", f"{os.environ['CXX']} -DOTHER")
    scaled()
    assert builds() == 2
    assert len(entries(cache)) == 2


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "foreign"])
def test_corrupted_entry_is_built_again(builds, cache, damage):
    scaled()
    (entry,) = entries(cache)
    content = bytearray(entry.read_bytes())
    if damage == "flip":
        content[len(content) // 2] ^= 1
    elif damage == "cut":
        del content[-100:]
    else:
        content = b"" if damage == "empty" else b"not a library"
    # A new file: the one that is loaded stays mapped.
    entry.unlink()
    entry.write_bytes(content)
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 2
    (again,) = entries(cache)
    assert again.read_bytes() != content


def test_entry_with_a_true_checksum_that_does_not_load_is_built_again(builds, cache):
    scaled()
    (entry,) = entries(cache)
    key = entry.stem.split("-")[0]
    entry.unlink()
    other = cache / "other"
    other.write_bytes(b"not a library")
    other.rename(cache / f"{key}-{cxxrtl._digest(other)}.model")
    assert scaled() == (3 * BEATS).tolist()
    assert builds() == 2
    assert [path.stem.split("-")[0] for path in entries(cache)] == [key]


def test_model_of_another_key_is_not_taken(builds, cache):
    scaled(3)
    (three,) = entries(cache)
    scaled(5)
    (five,) = set(entries(cache)) - {three}
    key, digest = three.stem.split("-")[0], five.stem.split("-")[1]
    three.unlink()
    (cache / f"{key}-{digest}.model").write_bytes(five.read_bytes())
    assert scaled(3) == (3 * BEATS).tolist()
    assert builds() == 3


def test_cache_that_others_can_write_is_not_used(builds, cache):
    scaled()
    for mode in (0o770, 0o707, 0o720):
        cache.chmod(mode)
        (planted,) = entries(cache)
        before = planted.read_bytes()
        built = builds()
        cxxrtl._private_folder.cache_clear()
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
    monkeypatch.setattr(os, "access", lambda path, mode: False)
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
    monkeypatch.setattr(cxxrtl.platformdirs, "user_cache_path", lambda name: tmp_path / "home" / name)
    assert cxxrtl.cache_folder() == tmp_path / "home" / "blysk"


PROGRAM = """
import numpy as np
from amaranth.hdl import Assert, Const, Module, Print, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out
from sim.engine import simulate

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
        cwd=Path(__file__).parents[2],
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


def test_batches_leave_no_trace(monkeypatch):
    beats = np.random.default_rng(4).integers(-100, 100, 300)
    stalls = np.random.default_rng(5).random((2, 23)) < 0.5
    component = Scale()
    arguments = {"count": 300, "input_stalls": stalls[0], "output_stalls": stalls[1]}
    whole = simulate(component, beats, **arguments)
    monkeypatch.setattr(cxxrtl, "_BATCH", 7)
    seen = []
    for count in (300, None):
        parts = simulate(
            component, beats, **arguments | {"count": count, "progress": seen.append, "patience": 90}
        )
        np.testing.assert_array_equal(parts.beats, whole.beats)
        np.testing.assert_array_equal(parts.clocks, whole.clocks)
        np.testing.assert_array_equal(parts.input_clocks, whole.input_clocks)
        assert parts.total_clocks == whole.total_clocks
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
            simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, patience=600)
        messages.append(str(caught.value))
    with pytest.raises(SimulationError) as caught:
        simulate(Faulty(), np.arange(500), count=500, output_stalls=stalls, patience=600, engine="pysim")
    assert messages == [str(caught.value)] * 3


def test_interrupt_between_batches():
    """Ctrl-C ends a run that would take for ever, within a batch or so."""
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals go to the main thread")
    component = Scale()
    simulate(component, BEATS, count=4)
    beats = np.zeros(100, dtype=int)
    started = time.monotonic()
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        # One beat in 100 million clocks.
        simulate(component, beats, count=100, input_stalls=np.arange(10**8) != 5, patience=10**10)
    assert time.monotonic() - started < 5
    timer.join()
    assert simulate(component, BEATS, count=4).beats.tolist() == (3 * BEATS).tolist()


def test_an_exception_in_progress_ends_the_run():
    def stop(done):
        raise RuntimeError(f"stop at {done}")

    with pytest.raises(RuntimeError, match=r"^stop at 4$"):
        scaled(progress=stop)
