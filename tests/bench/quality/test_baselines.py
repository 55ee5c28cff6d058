"""The baselines: no figure changes by more than 2 % unnoticed, and the check itself can fail."""

import json
from contextlib import nullcontext

import numpy as np
import pytest

from blysk.bench.accuracy import model_of
from blysk.bench.quality import baselines, resources
from blysk.bench.quality.baselines import TOLERANCE, UPDATE, differences, main, read
from blysk.bench.quality.resources import ENTRIES, cycles_of, measure
from blysk.bench.tools.blocks import ENTRIES as UNITS
from blysk.bench.units.registry import RECORDS
from blysk.golden.build import STYLES
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.errors import InputError

BASELINES = read()


QUICK = "parts: dot_product"
"""All of these take minutes."""


@pytest.mark.parametrize(
    "name", [name if name == QUICK else pytest.param(name, marks=pytest.mark.long) for name in ENTRIES]
)
def test_nothing_moved(name, monkeypatch):
    """No figure has changed, and no operand of a multiplier has more than 18 bits."""

    def narrow(component):
        cost = cost_of(component)
        assert all(width <= 18 for width, _ in cost.multipliers)
        return cost

    monkeypatch.setattr(resources, "cost_of", narrow)
    old = {name: BASELINES[name]} if name in BASELINES else {}
    moved = differences(old, {name: measure(name)}, TOLERANCE)
    assert not moved, f"{'; '.join(moved)}. If that is meant: {UPDATE}"


def test_every_entry_has_a_baseline_and_every_baseline_an_entry():
    missing, extra = set(ENTRIES) - set(BASELINES), set(BASELINES) - set(ENTRIES)
    assert not missing | extra, f"missing: {missing}; too many: {extra}; update by {UPDATE}"


def test_entries_are_every_unit_method_model_and_style():
    assert {f"parts: {entry.title}" for entry in UNITS if entry.record.name != "pipeline"} <= set(ENTRIES)
    titles = {name.removeprefix("parts: ").split(",")[0] for name in ENTRIES}
    for name, record in RECORDS.items():
        assert any(f"{name} {variant}".rstrip().split(",")[0] in titles for variant in record.variants)
    for method in METHODS:
        for style in STYLES:
            name = f"pipeline {method}, {model_of(method)}, {style}"
            assert {f"{kind}: {name}" for kind in ("frames", "parts")} <= set(ENTRIES)
    assert {f"parts: pipeline renormalise, {model}, throughput" for model in MODELS} <= set(ENTRIES)
    gates = {name.removesuffix(", gate") for name in ENTRIES if name.endswith(", gate")}
    assert gates <= set(ENTRIES)
    assert {name.split(":")[0] for name in gates} == {"frames", "parts"}


def test_figures_are_positive_numbers():
    assert {figure for figures in BASELINES.values() for figure in figures} == {
        *("cells", "multipliers", "register_bits", "memory_bits"),
        *("teapot_cycles", "square_cycles"),
    }
    for name, figures in BASELINES.items():
        assert all(type(value) is int and value >= 0 for value in figures.values())
        assert figures.get("cells", 1) > 0
        if name.startswith("frames"):
            assert min(figures.values()) > 0


def test_parts_are_those_of_the_cost():
    cost = cost_of(DotProductUnit())
    assert cost_of(DotProductUnit()).totals == {
        "cells": cost.cells,
        "multipliers": sum(cost.multipliers.values()),
        "register_bits": cost.register_bits,
        "memory_bits": cost.rom_bits + cost.ram_bits,
    }


@pytest.mark.long
def test_cycles_are_those_of_the_pixels():
    """The simulation runs to the last pixel, and takes at least a cycle a pixel."""
    design = preset("linear", "cosquad")
    cycles = cycles_of(design)
    scenes = resources.scenes()
    assert set(cycles) == {f"{name}_cycles" for name in scenes}
    for name, scene in scenes.items():
        spans, constants = prepare(scene, design).spans, FrameConstants.of(scene)
        fields = {
            field: getattr(spans, field) for field in ("x", "y", "length", "normal_left", "normal_right")
        }
        count = int(spans.length.sum())
        run = simulate(
            ShadingPipelineUnit(design), fields, count=count, write=constants.writes(), engine="pysim"
        )
        assert cycles[f"{name}_cycles"] == run.cycles[-1] + 1 >= count


def test_frames_have_short_spans_and_long_ones():
    spans = {
        name: prepare(scene, preset(model="cosquad")).spans for name, scene in resources.scenes().items()
    }
    assert np.median(spans["teapot"].length) < 4
    assert spans["square"].length.max() >= 16


# The check.


def test_tolerance_is_two_per_cent_either_way_and_includes_its_bounds():
    for new, far in ((1020, False), (1021, True), (980, False), (979, True)):
        assert bool(differences({"x": {"cells": 1000}}, {"x": {"cells": new}}, TOLERANCE)) == far
    old, new = {"x": {"cells": 1000, "memory_bits": 3}}, {"x": {"cells": 1030, "memory_bits": 2}}
    far = ["x: cells was 1,000, is 1,030, +3.00%", "x: memory_bits was 3, is 2, -33.33%"]
    assert differences(old, new, TOLERANCE) == far


def test_anything_is_far_from_nothing():
    far = ["x: multipliers was 0, is 1"]
    assert differences({"x": {"multipliers": 0}}, {"x": {"multipliers": 1}}, TOLERANCE) == far
    assert differences({"x": {"multipliers": 0}}, {"x": {"multipliers": 0}}) == []


def test_missing_and_further_entries_are_differences():
    one, both = {"x": {"cells": 5}}, {"x": {"cells": 5}, "y": {"cells": 7, "multipliers": 1}}
    assert differences(one, both, TOLERANCE) == ["y has no baseline"]
    assert differences(both, one, TOLERANCE) == ["y is not measured any more"]
    assert differences({"y": {"cells": 7}}, {"y": both["y"]}, TOLERANCE) == ["y: multipliers has no baseline"]
    assert differences({"y": both["y"]}, {"y": {"cells": 7}}, TOLERANCE) == ["y: multipliers is not measured"]
    assert differences(both, both) == []


# The command.


@pytest.fixture
def small(monkeypatch, tmp_path):
    """Two entries, measured at once, in a separate file. Tests can change the figures."""
    figures = {"one": {"cells": 1000}, "two": {"cells": 2000, "multipliers": 3}}
    path = tmp_path / "baselines.json"
    monkeypatch.setattr(baselines, "FILE", path)
    monkeypatch.setattr(resources, "ENTRIES", dict.fromkeys(figures))
    monkeypatch.setattr(baselines, "local_executor", lambda jobs: nullcontext())
    monkeypatch.setattr(resources, "measure", lambda name: figures[name])
    monkeypatch.setattr(baselines, "results_of", lambda tasks, *_: [task.run() for task in tasks])
    return figures, path


def test_command_writes_compares_and_fails(small, capsys):
    figures, path = small
    assert main([]) == 2
    assert UPDATE in capsys.readouterr().err
    assert main(["--update"]) == 0
    assert json.loads(path.read_text()) == figures
    capsys.readouterr()
    assert main([]) == 0
    assert capsys.readouterr().out == "2 entries, 0 differences, 0 of more than 2%\n"

    figures["one"]["cells"] = 1019
    assert main([]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "one: cells was 1,000, is 1,019, +1.90%"

    figures["two"]["cells"] = 1940
    assert main([]) == 1
    out = capsys.readouterr().out
    assert "two: cells was 2,000, is 1,940, -3.00% (over 2%)" in out
    assert UPDATE in out
    assert json.loads(path.read_text())["two"]["cells"] == 2000

    assert main(["--update"]) == 0
    assert "two: cells was 2,000, is 1,940, -3.00% (over 2%)" in capsys.readouterr().out
    assert main([]) == 0


def test_command_tells_of_missing_entries(small, capsys):
    figures, path = small
    path.write_text(json.dumps({**figures, "gone": {"cells": 1}}))
    assert main([]) == 1
    assert "gone is not measured any more (over 2%)" in capsys.readouterr().out


def test_words_choose_entries(small, capsys):
    figures, path = small
    path.write_text(json.dumps({"two": {"cells": 5}, "gone": {"cells": 1}}))
    assert main(["one", "--update"]) == 0
    assert "1 entries, 1 differences" in capsys.readouterr().out
    assert json.loads(path.read_text()) == {"one": figures["one"], "two": {"cells": 5}, "gone": {"cells": 1}}
    path.write_text("{}")
    assert main(["one", "--update"]) == 0
    assert json.loads(path.read_text()) == {"one": figures["one"]}
    assert main(["ne", "--jobs", "1"]) == 0
    assert main(["nothing"]) == 2
    assert "nothing: no entry has this word in its name; " in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "{", "[1"])
def test_command_refuses_a_broken_file(small, capsys, text):
    _, path = small
    path.write_text(text)
    assert main([]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(path) in line
    with pytest.raises(InputError):
        read(path)


def test_command_refuses_bad_options(capsys):
    assert main(["--jobs", "0"]) == 2
    assert main(["--nonsense"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2


def test_interrupt_is_one_line(small, monkeypatch, capsys):
    figures, path = small
    path.write_text(json.dumps(figures))

    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(baselines, "results_of", stop)
    assert main([]) == 130
    assert capsys.readouterr().err == "blysk.bench.quality.baselines: interrupted; run it again to continue\n"
    assert main(["--update"]) == 130
    assert json.loads(path.read_text()) == figures
