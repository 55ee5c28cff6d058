"""The comparison of the engines: it measures, and it notices when they differ."""

import dataclasses

import numpy as np
import pytest
from amaranth.hdl import Module, Signal, signed
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out

import bench.engines
from bench.engines import Speed, measure


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


@pytest.fixture(autouse=True)
def _cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))


def test_measure():
    beats = np.random.default_rng(1).integers(-(1 << 17), 1 << 17, 500_000)
    speed = measure(Powers(), beats, constants=300, repeats=2)
    assert speed.clocks == 500_000 + 9
    # The promise of the compiled engine, which is kept by a wide margin.
    assert speed.ratio > 200
    assert speed.build > 0


def test_text():
    speed = Speed(cxxrtl=7.5e6, pysim=15e3, build=1.25, clocks=9)
    assert str(speed) == (
        "cxxrtl 7.50 million clocks a second, pysim 0.0150: 500 times as fast; "
        "model built and loaded in 1.25 s"
    )


def test_engines_that_differ_are_no_measure(monkeypatch):
    simulate = bench.engines.simulate

    def late(*arguments, engine, **others):
        run = simulate(*arguments, engine=engine, **others)
        return dataclasses.replace(run, clocks=run.clocks + (engine == "cxxrtl"))

    monkeypatch.setattr(bench.engines, "simulate", late)
    with pytest.raises(ValueError, match=r"^the engines differ in clocks$"):
        measure(Powers(), np.arange(10), constants=1)
