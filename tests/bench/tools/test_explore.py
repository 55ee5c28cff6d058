# amaranth: UnusedElaboratable=no
"""The design space: the list against brute force over the same records, resuming, the commands of designs."""

import gc
import json
import re
import shlex
import warnings
import xml.etree.ElementTree as ET
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from amaranth.hdl import UnusedElaboratable
from click.testing import CliRunner

from blysk.bench import store
from blysk.bench.quality import baselines
from blysk.bench.tools import design_space, explore
from blysk.bench.tools.design_space import (
    COSTS,
    Candidate,
    Explored,
    Sweep,
    cheapest,
    costs_of,
    errors_of,
    explored,
    front_of,
    tasks_of,
)
from blysk.bench.tools.explore import EXPONENT, command, section, tasks
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.compare import compare
from blysk.golden.frames.prepare import prepare
from blysk.golden.pipeline import STYLES
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.renderer import render
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.cli.main import cli
from blysk.sim.errors import InputError
from blysk.sim.frames.figures import ERRORS
from blysk.sim.frames.frame import FrameSimulator

SMALL = {"triangles": 128, "size": (40, 30)}


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(explore, "_TRIANGLES", SMALL["triangles"])


def view(width=40, height=30):
    return explore.view_of("teapot", SMALL["triangles"], width, height)


def run(*arguments):
    return CliRunner().invoke(command, ["--size", "40x30", "--jobs", "1", *map(str, arguments)])


# Designs.


def test_candidates_are_the_pipelines_that_they_name():
    assert Candidate("chord", degree=2, fraction_bits=40).design == preset("chord", terms=2, fraction_bits=40)
    assert Candidate("linear", "exp", 2, "one_minus_cosine").design == preset(
        "linear", "exp", 2, operand="one_minus_cosine"
    )
    assert Candidate("quadratic", degree=2).design.interpolator.middle_normal.fit == "minimax_2"
    assert Candidate("bisection", degree=1).design.interpolator.bisection.degree == 1
    for method, degree in (("quadratic", 3), ("quadratic-horner", 3), ("bisection", 2), ("chord", 3)):
        assert Candidate(method, degree=degree).design.interpolator == METHODS[method]


def test_another_degree_keeps_the_operand():
    interpolator = Candidate("quadratic-eval", operand="one_minus_cosine", degree=2).design.interpolator
    assert (interpolator.form, interpolator.operand) == ("direct", "one_minus_cosine")


@pytest.mark.parametrize(
    "values",
    [
        {"method": "linear", "degree": 2},
        {"method": "quadratic", "degree": 1},
        {"method": "chord", "degree": 4},
        {"method": "linear", "fraction_bits": 46},
        {"method": "chord", "fraction_bits": 41},
        {"method": "angular", "operand": "cosine"},
        {"method": "quadratic-published", "degree": 3},
    ],
)
def test_impossible_candidates_are_refused(values):
    with pytest.raises(ValueError, match=r"method|fraction_bits|terms"):
        Candidate(**values)


def test_sweep_has_every_design_once_and_counts_the_impossible():
    """Against a count by hand: chord and angular find no normals; the middle normal has no degree 1."""
    sweep = Sweep(
        methods=("linear", "angular", "chord", "quadratic"),
        models=("cosquad", "exp"),
        lights=(1, 3),
        degrees=(1, 2),
        fraction_bits=(40, 42, 46),
        styles=("compact",),
    )
    found, impossible = sweep.candidates()
    assert len(set(found)) == len(found) == 4 * (2 + 1 + 2 * 3 + 2)
    assert impossible == {
        "angular, chord: finds no normals, and gives 1 - cos gamma": 4 * (1 + 2 * 3),
        "quadratic: has no polynomial of degree 1": 4 * 2,
    }
    assert {one.style for one in found} == {"compact"}
    assert {(one.degree, one.fraction_bits) for one in found if one.method == "linear"} == {(None, None)}


def test_every_method_is_in_the_default_sweep():
    found, _ = Sweep().candidates()
    assert {one.method for one in found} == set(METHODS)
    printed, _ = Sweep(methods=tuple(PUBLISHED)).candidates()
    assert {one.method for one in printed} == set(PUBLISHED)


@pytest.mark.parametrize(
    ("candidate", "is_plain"),
    [
        (Candidate("linear"), True),
        (Candidate("quadratic", "exp", 2, "one_minus_cosine", 3, style="compact"), True),
        (Candidate("chord", degree=3, fraction_bits=46), True),
        (Candidate("chord", "cosquad7", 2, None, 2, 40, "compact"), False),
        (Candidate("quadratic", operand="one_minus_cosine", degree=2), False),
        (Candidate("bisection", degree=1), False),
        (Candidate("recurrence-direct"), False),
    ],
)
def test_command_of_a_design_makes_it(candidate, is_plain, monkeypatch, capsys):
    """Run as it stands, but for the Verilog; the unit that it would emit is the candidate's."""
    made = []
    monkeypatch.setattr("blysk.hdl.emit.verilog.emit", lambda unit, name, **_: made.append(unit) or "module")
    monkeypatch.setattr("blysk.sim.api.design.emit", lambda unit, name, **_: made.append(unit) or "module")
    words = shlex.split(candidate.command)
    assert (words[0] == "blysk") == is_plain
    if is_plain:
        assert CliRunner().invoke(cli, words[1:]).output == "module"
    else:
        assert words[:2] == ["python", "-c"]
        exec(words[2], {})
        assert capsys.readouterr().out == "module\n"
    assert len(made) == 1
    unit = made.pop()
    assert unit.parameters.interpolator == candidate.design.interpolator
    assert (unit.parameters.model, unit.parameters.lights) == (candidate.model, candidate.lights)
    assert unit.parameters.build.style == candidate.style
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        del unit
        gc.collect()


# Measurements.


def test_errors_are_those_of_the_simulated_frame():
    candidate = Candidate("chord", degree=2, fraction_bits=38)
    (scene,) = explore.scenes_of(view(16, 12), [EXPONENT])
    frame = FrameSimulator(candidate.design, "pysim").render(scene)
    result = errors_of({"method": "chord", "degree": 2, "fraction_bits": 38}, view(16, 12), EXPONENT)
    expected = compare(scene, candidate.design, frame)
    for name in ERRORS:
        figures = getattr(expected, f"{name}_error")
        assert result["errors"][name] == {
            key: getattr(figures, key) for key in ("max_lsb", "p999_lsb", "rmse_lsb")
        }
    assert result["out_of_range_spans"] == frame.out_of_range_spans
    assert sum(length * count for length, count in result["lengths"]) == frame.pixels


def test_narrow_polynomials_flag_wide_spans():
    narrow, usual = (errors_of({"method": "chord", "degree": degree}, view(), EXPONENT) for degree in (1, 3))
    assert narrow["out_of_range_spans"] > 0
    assert usual["out_of_range_spans"] == 0


def test_several_lights_are_as_bright_as_one_and_all_used():
    (scene,) = explore.scenes_of(view(), [EXPONENT])
    assert design_space._lit(scene, 1) == scene
    lit = design_space._lit(scene, 3)
    constants = FrameConstants.of(lit, 3)
    assert (constants.diffuse.sum(axis=0) - FrameConstants.of(scene).diffuse.sum(axis=0) <= 3).all()
    assert len(np.unique(constants.direction, axis=0)) == 3
    heights = [light.direction[1] for light in lit.lights]
    np.testing.assert_allclose(heights, heights[0], rtol=1e-12)
    assert not np.array_equal(render(lit).image, render(scene).image)


def test_costs_are_those_of_the_netlist():
    result = costs_of({"method": "linear", "model": "cosquad", "style": "compact"})
    unit = ShadingPipelineUnit(preset("linear", style="compact"))
    cost = cost_of(unit)
    assert result == {
        "cells": cost.cells,
        "multipliers": cost.multiplier_count,
        "register_bits": cost.register_bits,
        "memory_bits": cost.rom_bits + cost.ram_bits,
        "cycles_per_pixel": unit.cycles_per_pixel,
        "setup_interval": unit.setup_interval,
    }


# Lists, over made-up records.


def records(count=60, seed=7, candidates=None):
    """Designs with figures out of a few values, so that some are equal."""
    rng = np.random.default_rng(seed)
    errors = rng.choice([0.5, 0.6, 0.75, 1.0, 1.25, 3.0], (count, 3))
    costs = rng.integers(1, 12, (count, 4)).tolist()
    candidates = candidates or Sweep(styles=("throughput",)).candidates()[0]
    return [
        Explored(
            candidates[k],
            {name: {"max_lsb": float(error)} for name, error in zip(ERRORS, errors[k], strict=True)},
            dict(zip(COSTS.values(), costs[k], strict=True)),
            1.5,
            int(rng.random() < 0.2),
        )
        for k in range(count)
    ]


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("cost", COSTS)
def test_cheapest_are_under_the_error_and_nothing_cheaper_is(error, cost):
    designs = records()
    for largest in (0.5, 0.75, 1.0, 2.0):
        chosen = cheapest(designs, error, largest, cost)
        under = [
            k
            for k, one in enumerate(designs)
            if one.errors[error]["max_lsb"] <= largest and not one.out_of_range_spans
        ]
        assert sorted(chosen) == under
        keys = [(designs[k].costs[COSTS[cost]], designs[k].errors[error]["max_lsb"]) for k in chosen]
        assert keys == sorted(keys)


def test_front_by_brute_force():
    designs = records()
    chosen = front_of(designs, "method", "cells")

    def beats(a, b):
        pairs = [(a.costs["cells"], b.costs["cells"])]
        pairs += [(a.errors["method"]["max_lsb"], b.errors["method"]["max_lsb"])]
        return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)

    usable = [one for one in designs if not one.out_of_range_spans]
    for one, on_front in zip(designs, chosen, strict=True):
        assert on_front == (not one.out_of_range_spans and not any(beats(other, one) for other in usable))
    assert chosen.any()


def test_front_without_designs_that_are_given_values():
    """As if these were not there."""
    designs = records(candidates=[Candidate(method) for method in METHODS] * 6)
    chosen = front_of(designs, "total", "multipliers", given_values=False)
    others = [k for k, one in enumerate(designs) if one.candidate.method != "chord-local"]
    assert len(others) == 54
    expected = front_of([designs[k] for k in others], "total", "multipliers")
    assert np.flatnonzero(chosen).tolist() == np.array(others)[expected].tolist()


def test_designs_of_two_styles_share_the_errors_and_not_the_costs():
    candidates = [Candidate("linear"), Candidate("linear", style="compact")]
    todo = tasks_of(candidates, view(), EXPONENT)
    assert [task.function for task in todo] == [costs_of, errors_of, costs_of]
    frame = {
        "errors": {name: {"max_lsb": 0.5} for name in ERRORS},
        "out_of_range_spans": 0,
        "lengths": [[1, 3], [2, 1], [10, 2]],
    }
    parts = dict(zip(COSTS.values(), (10, 2, 30, 40), strict=True))
    results = [
        {**parts, "cycles_per_pixel": 1, "setup_interval": 4},
        frame,
        {**parts, "cells": 7, "cycles_per_pixel": 3, "setup_interval": 7},
    ]
    first, second = explored(todo, results)
    assert [first.candidate, second.candidate] == candidates
    assert first.errors == second.errors == frame["errors"]
    assert (first.costs, second.costs) == (parts, {**parts, "cells": 7})
    # Three spans of 1, one of 2, two of 10 pixels: 25 pixels.
    assert first.cycles_per_pixel == pytest.approx((3 * 4 + 4 + 2 * 10) / 25)
    assert second.cycles_per_pixel == pytest.approx((3 * 7 + 7 + 2 * 30) / 25)


def test_stated_clocks_are_a_bound_of_those_of_frames():
    """Of the baselines, which are simulated; but for bisection, which states none."""
    measured = baselines.read()
    for method in METHODS:
        for style in STYLES:
            candidate = Candidate(method, style=style)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UnusedElaboratable)
                unit = candidate.unit()
                latency = unit.latency
                figures = {"cycles_per_pixel": unit.cycles_per_pixel, "setup_interval": unit.setup_interval}
                del unit
                gc.collect()
            for name, scene in baselines._scenes().items():
                length = prepare(scene, candidate.design).spans.length
                counts = [[k, int(count)] for k, count in enumerate(np.bincount(length)) if count]
                frame = {"errors": {}, "out_of_range_spans": 0, "lengths": counts}
                results = [figures | dict.fromkeys(COSTS.values(), 0), frame]
                (one,) = explored(tasks_of([candidate], {}, EXPONENT), results)
                if method == "bisection":
                    assert one.cycles_per_pixel is None
                    continue
                besides = latency + len(FrameConstants.of(scene).writes()["data"])
                cycles = measured[f"frames: pipeline {method}, cosquad, {style}"][f"{name}_cycles"]
                assert length.sum() < cycles <= one.cycles_per_pixel * length.sum() + besides


# The command.


def test_sweep_of_four_designs_and_again(tmp_path, monkeypatch):
    """The listed ones against brute force over all; the second run measures nothing."""
    path = tmp_path / "designs.json"
    options = (
        "--methods",
        "linear,chord",
        "--models",
        "cosquad",
        "--operands",
        "one_minus_cosine",
        "--degrees",
        "2",
    )
    options += ("--operands", "one_minus_cosine", "--fraction-bits", "46", "--json", path)
    options += ("--largest-error", "1.5", "--limit", "3")
    result = run(*options)
    assert result.exit_code == 0, result.output
    saved = json.loads(path.read_text())
    assert len(saved["designs"]) == 4
    under = [
        one
        for one in saved["designs"]
        if one["errors"]["method"]["max_lsb"] <= 1.5 and not one["out_of_range_spans"]
    ]
    under.sort(key=lambda one: (one["costs"]["cells"], one["errors"]["method"]["max_lsb"]))
    lines = result.output.splitlines()
    listed = [line for line in lines if re.match(r" *\d+ .*(throughput|compact)  ", line)]
    assert len(listed) == min(len(under), 3)
    assert not any(line.startswith("chord-local is given") for line in lines)
    commands = [re.sub(r"^ *\d+  ", "", line) for line in lines[-len(listed) :]]
    assert commands == [one["command"] for one in under[:3]]
    for line, one in zip(listed, under, strict=False):
        words = line.replace("*", " ").split()
        assert words[1:3] == [one["method"], one["model"]]
        assert f"{one['costs']['cells']:,}" in words
        assert f"{one['errors']['method']['max_lsb']:.2f}" in words
        assert ("*" in line) == one["front"]
    assert any(one["front"] for one in saved["designs"])

    before = path.read_text()

    def forbidden(*_):
        raise AssertionError("measured again")

    monkeypatch.setattr(design_space, "model_frame", forbidden)
    monkeypatch.setattr(design_space, "cost_of", forbidden)
    again = run(*options)
    assert again.output == result.output
    assert path.read_text() == before


def test_interrupt_keeps_what_is_done(monkeypatch):
    calls = []

    def unit(candidate):
        calls.append(candidate.method)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return SimpleNamespace(cycles_per_pixel=1, setup_interval=4)

    monkeypatch.setattr(Candidate, "unit", unit)
    costs = SimpleNamespace(totals=dict.fromkeys(COSTS.values(), 1))
    monkeypatch.setattr(design_space, "cost_of", lambda unit: costs)
    options = ("--methods", "linear,renormalise,chord", "--models", "cosquad", "--degrees", "3")
    options += ("--fraction-bits", "46", "--styles", "throughput", "--operands", "one_minus_cosine")
    stopped = run(*options)
    assert stopped.exit_code == 130
    assert stopped.output == "blysk: stopped; 4 of 6 measurements are kept, run again to go on\n"
    resumed = run(*options)
    assert resumed.exit_code == 0
    assert calls == ["linear", "renormalise", "chord", "chord"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["--methods", "chord,gouraud"],
            "--methods chord,gouraud: 'gouraud' is none of the choices; use some of ",
        ),
        (["--models", ""], "--models : '' is none of the choices"),
        (["--lights", "0"], "--lights 0: '0' is none of the choices; use some of 1,2,"),
        (["--fraction-bits", "41"], "use some of 36,38,40,42,44,46"),
        (["--degrees", "4"], "use some of 1,2,3"),
        (["--operands", "sine"], "use some of cosine,one_minus_cosine"),
        (["--largest-error", "0"], "--largest-error 0: no such error"),
        (["--largest-error", "nan"], "--largest-error nan: no such error"),
        (["--cost", "area"], "--cost area: unknown cost; use one of cells, multipliers, registers, memory"),
        (["--error", "model"], "--error model: unknown error; use one of arithmetic, method, total"),
        (["--size", "0x3"], "--size 0x3: out of range"),
        (["--exponent", "1001"], "--exponent 1001: out of range"),
        (["--limit", "0"], "--limit 0: out of range"),
        (["--mesh", "missing.obj"], "missing.obj: "),
        (["--cluster", "nowhere"], "--cluster nowhere: not the address of a Dask scheduler"),
        (["--json", "missing/folder.json"], "missing/folder.json: cannot be written"),
        (
            ["--methods", "chord", "--operands", "cosine"],
            "the sweep: holds no possible design, 36 of chord: finds no normals",
        ),
    ],
)
def test_bad_options_are_one_line(arguments, text):
    options = ["--size", "40x30", *arguments]
    result = CliRunner().invoke(command, options)
    assert isinstance(result.exception, InputError)
    assert text in str(result.exception)
    assert "\n" not in str(result.exception)


def test_jobs_are_not_for_a_cluster():
    result = run("--cluster", "tcp://localhost:1")
    assert "--jobs: a cluster has its own workers" in str(result.exception)


def made_up(monkeypatch, out_of_range=False, error=0.5):
    """Results without measuring."""

    def results(todo, *_):
        frame = {
            "errors": {name: {"max_lsb": error} for name in ERRORS},
            "out_of_range_spans": int(out_of_range),
        }
        parts = {**dict.fromkeys(COSTS.values(), 5), "cycles_per_pixel": 1, "setup_interval": 4}
        return [parts if task.function is costs_of else {**frame, "lengths": [[3, 9]]} for task in todo]

    monkeypatch.setattr(explore, "results_of", results)


def test_no_design_under_the_error_is_one_line(monkeypatch, tmp_path):
    made_up(monkeypatch, error=2.25)
    path = tmp_path / "all.json"
    result = run("--json", path)
    assert isinstance(result.exception, InputError)
    assert str(result.exception) == (
        "--largest-error 1: no design of the sweep reaches it, the least is 2.25 LSB; "
        "allow more, or sweep more"
    )
    assert json.loads(path.read_text())["designs"]
    made_up(monkeypatch, out_of_range=True)
    assert "all of them flag spans as too wide" in str(run().exception)


def test_what_is_given_is_told(monkeypatch):
    made_up(monkeypatch)
    told = "chord-local is given values of each light with a span; to work them out is not in its cost\n"
    assert told in run("--methods", "chord-local").output
    assert told not in run("--methods", "chord").output


def test_impossible_ones_are_told(monkeypatch):
    made_up(monkeypatch)
    output = run("--methods", "chord,quadratic", "--models", "exp", "--styles", "compact").output
    # chord without a dot product: 3 degrees of 2 words; quadratic without degree 1: 2 operands.
    assert output.startswith(
        "impossible  8 combinations: 6 of chord: finds no normals, and gives 1 - cos gamma; "
        "2 of quadratic: has no polynomial of degree 1\n"
    )


def test_a_mesh_without_a_pixel_is_refused(monkeypatch):
    def hidden(scene):
        raster = rasterise(scene)
        return replace(raster, visible=np.zeros_like(raster.visible))

    monkeypatch.setattr(explore, "rasterise", hidden)
    assert "no pixel shows the surface at 40x30" in str(run().exception)


@pytest.mark.long
def test_processes_and_a_cluster_give_the_same(monkeypatch, tmp_path):
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    options = ["--size", "40x30", "--methods", "linear", "--models", "cosquad", "--operands", "cosine"]
    options += ["--largest-error", "200"]
    outputs = []

    def explored_by(*who):
        monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / who[-1][:3]))
        outputs.append(CliRunner().invoke(command, [*options, *who]).output)

    explored_by("--jobs", "1")
    explored_by("--jobs", "2")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0", host="127.0.0.1"
    ) as local:
        explored_by("--cluster", local.scheduler_address)
    assert outputs[0] == outputs[1] == outputs[2]
    assert "blysk verilog --method linear --model cosquad --style compact" in outputs[0]


# The section.


@pytest.mark.long
def test_section_of_real_results():
    """A few designs at the size of the quick report: every row against its results."""
    todo = tasks(quick=True)
    assert len(todo) == 8
    results = store.results_of(todo)
    made = section(todo, results)
    drawing, table = made.parts
    assert ET.fromstring(drawing.svg).tag.endswith("svg")
    rows = table.records()
    assert [row["method"] for row in rows] == ["linear", "renormalise", "chord", "chord-local"]
    assert len(made.figures["designs"]) == len(rows)
    for row, design in zip(rows, made.figures["designs"], strict=True):
        assert row["largest total error, LSB"] == design["errors"]["total"]["max_lsb"]
        assert row["cells"] == design["costs"]["cells"]
    for error in ("method", "total"):
        for cost in ("cells", "multipliers"):
            chosen = front_of(explored(todo, results), error, cost, given_values=False)
            assert [row[f"front of {error} error and {cost}"] for row in rows] == chosen.tolist()
            assert chosen.any()
    json.dumps(made.figures, allow_nan=False)
    under = [row for row in rows if row["largest method error, LSB"] <= 1 and not row["spans too wide"]]
    for given in (False, True):
        least = min(row["cells"] for row in under if (row["method"] == "chord-local") == given)
        assert f"takes {least:,} cells" in " ".join(made.text)


def test_full_section_sweeps_everything():
    todo = tasks(quick=False)
    assert {task.settings["candidate"]["method"] for task in todo} == set(METHODS)
    assert not any(task.timed for task in todo)
