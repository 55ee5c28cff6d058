# amaranth: UnusedElaboratable=no
"""The comparison of the engines: it measures, and it notices if they differ."""

import dataclasses

import pytest

from blysk.bench.speed import engine_rates
from blysk.bench.speed.engine_rates import LEAST_LENGTH, beats_of_teapot, measure
from blysk.bench.speed.engines import main
from blysk.bench.speed.verilator import verilator_folder
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.engine import Ports


class Same:
    """A stub of Verilator's model: it gives the last output of the compiled engine, or gives it a cycle
    later."""

    def __init__(self, unit, late):
        self.ports, self.late = Ports(unit), late

    def run(self, drive):
        return pack(self.ports.o, Same.last.beats), Same.last.cycles + self.late


@pytest.fixture
def few(monkeypatch):
    """A pipeline that is compiled quickly. Runs are kept for `Same`."""
    unit, simulate = ShadingPipelineUnit(preset("linear", None)), engine_rates.simulate

    def kept(*arguments, **options):
        Same.last = simulate(*arguments, **options)
        return Same.last

    monkeypatch.setattr(engine_rates, "simulate", kept)
    beats, write = beats_of_teapot(unit, 2000, 1500)
    assert min(beats["length"]) >= LEAST_LENGTH
    return unit, {name: column[:60] for name, column in beats.items()}, write


@pytest.mark.ci
@pytest.mark.long
def test_what_differs_is_no_measure(few, monkeypatch):
    monkeypatch.setattr(engine_rates, "Verilated", lambda unit, folder: Same(unit, 0))
    rates = measure(*few, repeats=1)
    assert list(rates) == ["cxxrtl", "verilator", "pysim"]
    assert min(rates.values()) > 0
    monkeypatch.setattr(engine_rates, "Verilated", lambda unit, folder: Same(unit, 1))
    with pytest.raises(ValueError, match=r"^Verilator's model and the compiled engine differ$"):
        measure(*few, repeats=1)
    simulate = engine_rates.simulate

    def late(*arguments, engine, **options):
        run = simulate(*arguments, engine=engine, **options)
        return dataclasses.replace(run, cycles=run.cycles + (engine == "cxxrtl"))

    monkeypatch.setattr(engine_rates, "simulate", late)
    with pytest.raises(ValueError, match=r"^the engines differ in cycles$"):
        measure(*few)


@pytest.mark.long
@pytest.mark.skipif(verilator_folder() is None, reason="the Python package verilator is not installed")
def test_measure(few):
    assert measure(*few, repeats=1)["pysim"] < 1e5


@pytest.mark.parametrize(
    ("rates", "missed"),
    [
        ((7.5e6, 5e6, 2500.0), None),
        ((4.9e6, 4e6, 2500.0), "5,000,000 pixels a second"),
        ((7.5e6, 7.6e6, 40e3), "1 times verilator, 200 times pysim"),
    ],
)
def test_targets(monkeypatch, capsys, rates, missed):
    found = dict(zip(("cxxrtl", "verilator", "pysim"), rates, strict=True))
    monkeypatch.setattr(engine_rates, "beats_of_teapot", lambda unit, width, height: ({}, {}))
    monkeypatch.setattr(engine_rates, "measure", lambda unit, beats, write, repeats, step: found)
    assert main([]) == (0 if missed is None else 1)
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].split() == ["verilator", f"{rates[1]:,.0f}", f"{rates[0] / rates[1]:,.2f}x"]
    assert lines[-1] == ("every target met" if missed is None else f"missed: {missed}")
