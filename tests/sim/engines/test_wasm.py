# amaranth: UnusedElaboratable=no
"""WebAssembly modules give the same beats in the same cycles as the other engines."""

import re
from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Module, unsigned
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.golden.frame_constants import FrameConstants, writes_of
from blysk.golden.number.fixed import Format
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.hdl.core.fixed import SQ, UQ
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines import wasm
from blysk.sim.engines.beats import pack, unpack
from blysk.sim.engines.engine import CompilerMissing, Drive, SimulationError, StopReason
from blysk.sim.engines.pysim import Interpreted
from blysk.sim.frames.frame import beats_of
from blysk.sim.installation import install_extra

wasmtime = pytest.importorskip("wasmtime", reason="wasmtime is not installed")

NONE = np.zeros(1, dtype=bool)
# Spans go through the counters of positions and the ambient colour: all of the driver, and little to compile.
DESIGN = preset(model=None, lights=0)


def spans_of(length):
    length = np.asarray(length)
    normals = np.zeros((len(length), 3), dtype=np.int64)
    return Spans(np.arange(len(length)) * 7 % 4000, np.arange(len(length)), length, normals, normals)


def stimulus_of(component, spans, exponent=5):
    nothing = np.zeros((0, 3), dtype=np.int64)
    constants = FrameConstants(exponent, np.array([64 * 40, 64 * 50 + 32, 7]), *[nothing] * 4)
    return Drive(
        input=pack(component.i.payload.shape(), beats_of(component, spans)),
        write=pack(component.write.payload.shape(), writes_of([constants])),
        constants=np.zeros((0, 0), dtype=np.uint32),
        input_stalls=NONE,
        output_stalls=NONE,
        count=int(spans.length.sum()),
        idle_timeout=10_000,
        settle=64,
    )


class Browser:
    """A module as the page uses it."""

    def __init__(self, binary):
        engine = wasmtime.Engine()
        module = wasmtime.Module(engine, binary)
        assert not module.imports
        self.store = wasmtime.Store(engine)
        self.exports = wasmtime.Instance(self.store, module, []).exports(self.store)

    def call(self, name, *arguments):
        return self.exports[name](self.store, *arguments)

    def read(self, at, count, kind):
        kind = np.dtype(kind)
        raw = self.exports["memory"].read(self.store, at, at + count * kind.itemsize)
        return np.frombuffer(bytes(raw), dtype=kind)

    def write(self, values):
        raw = values.tobytes()
        at = self.call("reserve", max(len(raw), 4))
        self.exports["memory"].write(self.store, bytearray(raw), at)
        return at

    def prepare(self, drive, words):
        self.call("release")
        self.count, self.inputs, self.words = drive.count, len(drive.input), words
        written, given = self.write(drive.write), self.write(drive.input)
        self.output = self.call("reserve", 4 * words * drive.count + 4)
        self.cycles = self.call("reserve", 8 * drive.count + 8)
        self.input_cycles = self.call("reserve", 8 * self.inputs + 8)
        self.arguments = (
            *(written, len(drive.write), given, self.inputs),
            *(self.output, drive.count, self.cycles, self.input_cycles),
        )
        self.call("prepare", *self.arguments)

    def assert_gave(self, run):
        """Check output words, their cycles, and the cycles of the input."""
        output = self.read(self.output, self.count * self.words, "<u4").reshape(self.count, self.words)
        np.testing.assert_array_equal(output, run.output)
        np.testing.assert_array_equal(self.read(self.cycles, self.count, "<i8"), run.cycles)
        np.testing.assert_array_equal(self.read(self.input_cycles, self.inputs, "<i8"), run.input_cycles)


@pytest.fixture(scope="module")
def component():
    return ShadingPipelineUnit(DESIGN)


@pytest.fixture(scope="module")
def module(component):
    return wasm.build(component)


@pytest.fixture
def browser(module):
    return Browser(module)


def status_of(browser, ports):
    return browser.read(browser.call("status"), ports["status"]["words"], "<u4")[np.newaxis]


@pytest.mark.ci
@pytest.mark.long
def test_same_beats_on_the_same_cycles(component, browser):
    ports = wasm.ports_of(component)
    rng = np.random.default_rng(1)
    for spans in (spans_of([3, 1, 0, 2, 4095]), spans_of(rng.integers(0, 6, 40))):
        drive = stimulus_of(component, spans)
        expected = Interpreted(component).run(drive)
        browser.prepare(drive, ports["o"]["words"])
        # A second run from power-up, in the same memory.
        for _ in range(3):
            browser.call("prepare", *browser.arguments)
            assert browser.call("run") == StopReason.DONE
            browser.assert_gave(expected)
            assert browser.call("cycles") == expected.total_cycles
            np.testing.assert_array_equal(status_of(browser, ports), expected.status)


def test_memory_does_not_grow_from_run_to_run(component, browser):
    drive = stimulus_of(component, spans_of([9] * 50))
    browser.prepare(drive, wasm.ports_of(component)["o"]["words"])
    sizes = []
    for _ in range(4):
        browser.call("prepare", *browser.arguments)
        browser.call("run")
        sizes.append(browser.exports["memory"].data_len(browser.store))
    assert len(set(sizes)) == 1


def test_trace_is_the_status_of_every_clock(component, browser):
    ports = wasm.ports_of(component)
    spans = spans_of([2, 0, 3, 0])
    drive = stimulus_of(component, spans)
    expected = Interpreted(component).run(drive)
    browser.prepare(drive, ports["o"]["words"])
    words = ports["status"]["words"]
    rows, ended = browser.call("reserve", 4 * words * 400), browser.call("reserve", 4)
    count = browser.call("trace", rows, 400, ended)
    assert browser.read(ended, 1, "<i4")[0] == StopReason.DONE
    assert count == expected.total_cycles + drive.settle
    browser.assert_gave(expected)
    trace = browser.read(rows, count * words, "<u4").reshape(count, words)
    for clock in (1, 5, *expected.input_cycles[:2] + 2, expected.total_cycles):
        status = Interpreted(component).run(replace(drive, limit=int(clock))).status
        np.testing.assert_array_equal(trace[clock - 1 : clock], status)
    browser.call("prepare", *browser.arguments)
    assert browser.call("trace", rows, 7, ended) == 7
    assert browser.read(ended, 1, "<i4")[0] == StopReason.LIMIT


def test_fields():
    inner = data.StructLayout({"a": SQ(1, 17), "b": data.ArrayLayout(UQ(0, 9), 2), "c": unsigned(3)})
    fields = wasm.fields_of(data.StructLayout({"x": unsigned(12), "y": inner}))
    assert fields == {
        "x": {"offset": 0, "width": 12, "signed": False, "fraction": 0},
        "y.a": {"offset": 12, "width": 18, "signed": True, "fraction": 17},
        "y.b.0": {"offset": 30, "width": 9, "signed": False, "fraction": 9},
        "y.b.1": {"offset": 39, "width": 9, "signed": False, "fraction": 9},
        "y.c": {"offset": 48, "width": 3, "signed": False, "fraction": 0},
    }
    assert wasm.format_of(Format(True, 2, 5)) == {"width": 7, "signed": True, "fraction": 5}


def test_fields_of_a_pipeline_are_those_of_its_beats(component):
    ports = wasm.ports_of(component)
    shape = component.i.payload.shape()
    rng = np.random.default_rng(7)
    words = rng.integers(0, 1 << 32, (20, ports["i"]["words"]), dtype=np.uint32)
    beats = unpack(shape, words)
    for name, field in ports["i"]["fields"].items():
        codes = sum(words[:, k].astype(object) << 32 * k for k in range(words.shape[1]))
        codes = (codes >> field["offset"]) & ((1 << field["width"]) - 1)
        np.testing.assert_array_equal(codes.astype(np.int64), beats[name].astype(np.int64))


class Plain(Component):
    """A register between two streams, without writes and status."""

    def __init__(self):
        super().__init__({"i": In(stream.Signature(3)), "o": Out(stream.Signature(3))})

    def elaborate(self, platform):
        m = Module()
        m.d.sync += self.o.payload.eq(self.i.payload)
        m.d.comb += [self.i.ready.eq(1), self.o.valid.eq(0)]
        return m


def test_needs_writes_and_a_status():
    with pytest.raises(ValueError, match="status"):
        wasm.build(Plain())


def test_compiler_missing(uninstalled, component):
    uninstalled("ziglang")
    with pytest.raises(CompilerMissing, match=re.escape(f"ziglang is not installed: {install_extra('web')}")):
        wasm.build(component)


def test_compiler_fails(monkeypatch, component):
    monkeypatch.setattr(wasm, "_FLAGS", ("-std=c++3",))
    with pytest.raises(SimulationError, match=r"ziglang ends with status 1: .*error"):
        wasm.build(component)
