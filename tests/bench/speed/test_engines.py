"""The comparison of the engines: it measures, and it notices when they differ."""

import dataclasses

import numpy as np
import pytest
from amaranth.hdl import Module, Signal, signed
from amaranth.lib import data, stream
from amaranth.lib.wiring import Component, In, Out

import blysk.bench.speed.engines
from blysk.bench.speed.engines import Speed, main, measure, picture_seconds
from blysk.sim.engines.beats import pack
from blysk.sim.engines.engine import Ports
from blysk.sim.engines.simulate import simulate


class Powers(Component):
    """Eight multipliers in a row, each stage ``x * first`` cut to 18 bits."""

    i: In(stream.Signature(signed(18)))
    o: Out(stream.Signature(signed(18)))
    constants: In(signed(18))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        value, valid = self.i.payload, self.i.valid
        for stage in range(8):
            product, here = Signal(signed(18), name=f"product{stage}"), Signal(name=f"valid{stage}")
            with m.If(self.i.ready):
                m.d.sync += [product.eq((value * self.constants) >> 8), here.eq(valid)]
            value, valid = product, here
        with m.If(self.i.ready):
            m.d.sync += [self.o.payload.eq(value), self.o.valid.eq(valid)]
        return m


class Pair(Component):
    """``a`` and ``b``, both the input."""

    i: In(stream.Signature(8))
    o: Out(stream.Signature(data.StructLayout({"a": 8, "b": 8})))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [
                self.o.valid.eq(self.i.valid),
                self.o.payload.a.eq(self.i.payload),
                self.o.payload.b.eq(self.i.payload),
            ]
        return m


@pytest.mark.long
def test_measure():
    beats = np.random.default_rng(1).integers(-(1 << 17), 1 << 17, 500_000)
    speed = measure(Powers(), beats, constants=300, repeats=2)
    assert speed.cycles == 500_000 + 9
    # The promise of the compiled engine, which is kept by a wide margin.
    assert speed.ratio > 200
    assert speed.build > 0
    assert speed.verilator_beats is None
    # A beat a clock.
    assert speed.cxxrtl_beats == pytest.approx(speed.cxxrtl, rel=0.01)


@pytest.mark.parametrize(
    ("cxxrtl", "pysim", "verilator", "seconds", "missed"),
    [
        (7.5e6, 2500.0, 5e6, (1.9, 2.5), None),
        (7.5e6, 2500.0, 5e6, (6.0, 1.9), None),
        (4.9e6, 2500.0, 4e6, (1.9, 1.9), "5,000,000 pixels a second"),
        (7.5e6, 40e3, 5e6, (1.9, 1.9), "200 times pysim"),
        (7.5e6, 2500.0, 7.6e6, (1.9, 1.9), "1 times Verilator"),
        (7.5e6, 2500.0, 5e6, (2.0, 2.1), "a picture in 2 s"),
        (4.9e6, 40e3, 6e6, (1.9, 1.9), "5,000,000 pixels a second, 200 times pysim, 1 times Verilator"),
    ],
)
def test_targets(monkeypatch, capsys, cxxrtl, pysim, verilator, seconds, missed):
    """The spans, the pixels expected of them, the table and the exit status, without the runs."""
    asked = {}

    def measured(unit, beats, **others):
        gate = unit.gate
        assert others["baseline"] is not gate
        assert (unit.method, unit.model) == (("quadratic", "cosquad") if gate else ("quotient", "blinn"))
        if gate:
            assert len(others["expected"]["r"]) == beats["length"].sum()
            return Speed(6e6, 2000.0, 6e6, 2000.0, build=4.5, cycles=9000)
        asked.update(others, beats=beats)
        return Speed(cxxrtl, pysim, cxxrtl, pysim, build=4.25, cycles=9000, verilator_beats=verilator)

    monkeypatch.setattr(blysk.bench.speed.engines, "measure", measured)
    # Amaranth complains of components that are made and not used.
    monkeypatch.setattr(blysk.bench.speed.engines, "ShadingPipelineUnit", lambda design: design)
    monkeypatch.setattr(blysk.bench.speed.engines, "beats_of", lambda design, spans: vars(spans))
    monkeypatch.setattr(blysk.bench.speed.engines, "picture_seconds", lambda: seconds)
    assert main(1000, 750) == (0 if missed is None else 1)
    lines = capsys.readouterr().out.splitlines()
    pixels = asked["beats"]["length"].sum()
    assert asked["beats"]["length"].min() >= blysk.bench.speed.engines.LEAST_LENGTH
    assert asked["baseline"]
    assert pixels == len(asked["expected"]["r"]) > 1000
    spans = len(asked["beats"]["x"])
    assert lines[0] == f"teapot at 1000x750, {spans:,} spans: {pixels:,} pixels, 9,000 cycles"
    assert lines[2].split() == ["cxxrtl", f"{cxxrtl:,.0f}", "1.00x"]
    assert lines[3].split() == ["verilator", f"{verilator:,.0f}", f"{cxxrtl / verilator:,.2f}x"]
    assert lines[4].split() == ["pysim", f"{pysim:,.0f}", f"{cxxrtl / pysim:,.2f}x"]
    assert lines[5].split() == ["cxxrtl,", "gate", "6,000,000", f"{cxxrtl / 6e6:,.2f}x"]
    assert f" {seconds[0]:.2f} s by the clock, {seconds[1]:.2f} s of the processor" in lines[7]
    assert lines[-1] == ("every target met" if missed is None else f"missed: {missed}")


@pytest.mark.long
def test_picture_seconds(monkeypatch):
    """The command is run as a user would, and the first picture, which builds the model, does not count."""
    calls = []
    run = blysk.bench.speed.engines.run_program

    def counted(command, **options):
        # Without a cache each would build; the interpreted engine builds nothing.
        calls.append([*command, "--engine", "pysim"])
        return run(calls[-1], **options)

    monkeypatch.setattr(blysk.bench.speed.engines, "run_program", counted)
    wall, processor = picture_seconds(100, "16x12", repeats=1)
    assert len(calls) == 2
    assert processor > 0.01
    assert wall > 0.01


class Baseline:
    """Stands for Verilator's model: what the engine gives, and one beat or clock changed."""

    def __init__(self, component, beat, clock):
        self.ports = Ports(component)
        self.component, self.beat, self.clock = component, beat, clock

    def run(self, drive):
        run = simulate(self.component, drive.input[:, 0].astype(np.int64), count=drive.count)
        output, cycles = pack(self.ports.o, run.beats), run.cycles.copy()
        output[3] ^= self.beat
        cycles[5] += self.clock
        return output, cycles


def test_baseline(monkeypatch):
    beats = np.arange(200)
    component = Pair()
    monkeypatch.setattr(blysk.bench.speed.engines, "Verilated", lambda unit, folder: Baseline(unit, 0, 0))
    assert measure(component, beats, baseline=True).verilator_beats > 0
    for beat, clock in ((1, 0), (0, 1)):
        monkeypatch.setattr(
            blysk.bench.speed.engines, "Verilated", lambda unit, folder, c=(beat, clock): Baseline(unit, *c)
        )
        with pytest.raises(ValueError, match=r"^Verilator's model and the compiled engine differ$"):
            measure(component, beats, baseline=True)


def test_other_beats_than_expected_are_no_measure():
    beats = np.arange(10)
    with pytest.raises(ValueError, match=r"^the compiled engine gives another b than expected$"):
        measure(Pair(), beats, expected={"a": beats, "b": beats + 1})


@pytest.mark.long
def test_engines_that_differ_are_no_measure(monkeypatch):
    simulate = blysk.bench.speed.engines.simulate

    def late(*arguments, engine, **others):
        run = simulate(*arguments, engine=engine, **others)
        return dataclasses.replace(run, cycles=run.cycles + (engine == "cxxrtl"))

    monkeypatch.setattr(blysk.bench.speed.engines, "simulate", late)
    with pytest.raises(ValueError, match=r"^the engines differ in cycles$"):
        measure(Powers(), np.arange(10), constants=1)
