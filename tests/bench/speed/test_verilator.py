"""Verilator's model of the emitted Verilog: equal beats in equal cycles, and one line if there is no
Verilator."""

import dataclasses
import re

import numpy as np
import pytest
from amaranth.hdl import Module, signed
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

import blysk.bench.speed.verilator
from blysk.bench.speed.verilator import Verilated
from blysk.golden.number.fixed import SQ
from blysk.hdl.core.fixed import FixedShape
from blysk.sim.engines.beats import pack
from blysk.sim.engines.compilers import find_compilers
from blysk.sim.engines.engine import Drive, SimulationError
from blysk.sim.engines.simulate import simulate, stimulus_of

needed = pytest.mark.skipif(
    blysk.bench.speed.verilator.verilator_folder() is None,
    reason="the Python package verilator is not installed",
)


class Sums(Component):
    """Running sums of words that cross the 32-bit boundaries of a packed beat, from a written start."""

    i: In(
        stream.Signature(
            data.StructLayout({"a": 13, "b": signed(50), "c": data.ArrayLayout(FixedShape(SQ(3, 20)), 3)})
        )
    )
    o: Out(
        stream.Signature(data.StructLayout({"c": data.ArrayLayout(signed(24), 2), "b": signed(64), "a": 13}))
    )
    write: In(stream.Signature(data.StructLayout({"data": 40})))

    def elaborate(self, platform):
        m = Module()
        given, sums = self.i.payload, self.o.payload
        move = ~self.o.valid | self.o.ready
        m.d.comb += [self.write.ready.eq(~self.o.valid), self.i.ready.eq(move & ~self.write.valid)]
        with m.If(move):
            m.d.sync += self.o.valid.eq(self.i.valid & self.i.ready)
        with m.If(self.write.valid & self.write.ready):
            m.d.sync += sums.b.eq(sums.b + self.write.payload.data)
        with m.Elif(self.i.valid & self.i.ready):
            m.d.sync += [
                sums.a.eq(sums.a + given.a),
                sums.b.eq(sums.b + given.b),
                *(
                    word.eq(code.as_value())
                    for word, code in zip(sums.c, (given.c[0], given.c[2]), strict=True)
                ),
            ]
        return m


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """This test does not need speed, and Verilator's runtime takes long to optimise."""
    quick = [
        dataclasses.replace(each, compile=tuple("-O0" if flag == "-O2" else flag for flag in each.compile))
        for each in find_compilers()
    ]
    monkeypatch.setattr(blysk.bench.speed.verilator, "find_compilers", lambda: iter(quick))


def drive(ports, beats, write, count, **others):
    free = np.zeros(1, dtype=bool)
    given = {"input_stalls": free, "output_stalls": free, "idle_timeout": 100, "settle": 0} | others
    return Drive(
        pack(ports.i, beats),
        pack(ports.write, write),
        np.zeros((0, 0), dtype=np.uint32),
        count=count,
        **given,
    )


@pytest.mark.long
@needed
def test_equal_to_the_engine(tmp_path):
    rng = np.random.default_rng(3)
    beats = {
        "a": rng.integers(0, 1 << 13, 300),
        "b": rng.integers(-(1 << 49), 1 << 49, 300),
        "c": rng.integers(-(1 << 22), 1 << 22, (300, 3)),
    }
    write = {"data": rng.integers(0, 1 << 40, 5)}
    component = Sums()
    run = simulate(component, beats, count=300, write=write)
    model = Verilated(component, tmp_path)
    assert model.compiler
    output, cycles = model.run(drive(model.ports, beats, write, 300))
    assert np.array_equal(output, pack(model.ports.o, run.beats))
    assert np.array_equal(cycles, run.cycles)
    # Writes between beats.
    late = np.array([0, 0, 7, 7, 200])
    run = simulate(component, beats, count=300, write=write, write_after=late)
    between, cycles = model.run(drive(model.ports, beats, write, 300, write_after=late))
    assert np.array_equal(between, pack(model.ports.o, run.beats))
    assert np.array_equal(cycles, run.cycles)
    # Each run starts from power-up. A beat that never comes ends the run.
    assert np.array_equal(model.run(drive(model.ports, beats, write, 300))[0], output)
    with pytest.raises(SimulationError, match=r"^Verilator's model gave nothing for 100 cycles$"):
        model.run(drive(model.ports, beats, write, 301))
    with pytest.raises(ValueError, match=r"^a stimulus with a count and without stalls is needed$"):
        model.run(drive(model.ports, beats, write, 300, output_stalls=np.array([True, False])))


class Constant(Component):
    i: In(stream.Signature(8))
    o: Out(stream.Signature(8))
    constants: In(data.StructLayout({"a": 40, "b": signed(5)}))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [self.o.valid.eq(self.i.valid), self.i.ready.eq(self.o.ready)]
        m.d.sync += self.o.payload.eq(self.i.payload * self.constants.a + self.constants.b)
        return m


@pytest.mark.long
@needed
def test_constants_are_held(tmp_path):
    component, beats = Constant(), np.arange(256)
    run = simulate(component, beats, count=256, constants={"a": 3, "b": -7})
    model = Verilated(component, tmp_path)
    output, _ = model.run(stimulus_of(component, beats, count=256, constants={"a": 3, "b": -7}))
    assert np.array_equal(output, pack(model.ports.o, run.beats))


def test_says_what_is_missing(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(blysk.bench.speed.verilator, "verilator_folder", lambda: None)
        with pytest.raises(SimulationError, match=r"^the Python package verilator is not installed$"):
            Verilated(None, tmp_path)
    monkeypatch.setattr(blysk.bench.speed.verilator, "verilator_folder", lambda: tmp_path)
    monkeypatch.setattr(blysk.bench.speed.verilator, "find_compilers", lambda: iter(()))
    with pytest.raises(SimulationError, match=r"^no C\+\+ compiler of this machine for Verilator's model$"):
        Verilated(None, tmp_path)


@needed
def test_says_what_failed(tmp_path, monkeypatch):
    monkeypatch.setattr(
        blysk.bench.speed.verilator, "emit", lambda component, name: "module core(;\nendmodule\n"
    )
    component = Sums()
    with pytest.raises(
        SimulationError, match=r"^verilator_bin ends with status \d+: %Error: core\.v:1:"
    ) as caught:
        Verilated(component, tmp_path)
    assert not re.search(r"\n", str(caught.value))
    simulate(component, {"a": [1], "b": [1], "c": [[1, 1, 1]]}, count=1, engine="pysim")
