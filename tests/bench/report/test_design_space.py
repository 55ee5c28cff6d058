# amaranth: UnusedElaboratable=no
"""The design space: designs, their measurements, and lists compared with brute force."""

import gc
import shlex
import warnings

import numpy as np
import pytest
from amaranth.hdl import UnusedElaboratable
from click.testing import CliRunner

from blysk.bench.quality import baselines, resources
from blysk.bench.report import design_space, explore
from blysk.bench.report.design_space import (
    Explored,
    cheapest,
    costs_of,
    errors_of,
    explored,
    front_of,
    tasks_of,
)
from blysk.bench.tools.defaults import EXPONENT
from blysk.bench.tools.sweep import COSTS, Candidate, Sweep
from blysk.golden.build import STYLES
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.compare import compare
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.renderer import render
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.cli.main import cli
from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.frame import FrameSimulator

SMALL = {"triangles": 128, "size": (40, 30)}


def view(width=40, height=30):
    return explore.view_of("teapot", SMALL["triangles"], width, height)


# Designs.


def test_candidates_are_the_pipelines_that_they_name():
    assert Candidate("chord-local", fraction_bits=40).design == preset(
        "chord-local", "cosquad", fraction_bits=40
    )
    assert Candidate("linear", "exp", 2, "one_minus_cosine").design == preset(
        "linear", "exp", 2, operand="one_minus_cosine"
    )
    assert Candidate("quadratic", degree=2).design.interpolator.middle_normal.fit == "minimax_2"
    assert Candidate("bisection", degree=1).design.interpolator.bisection.degree == 1
    for method, degree in (("quadratic", 3), ("quadratic-horner", 3), ("bisection", 2)):
        assert Candidate(method, degree=degree).design.interpolator == METHODS[method]


def test_another_degree_keeps_the_operand():
    interpolator = Candidate("quadratic-eval", operand="one_minus_cosine", degree=2).design.interpolator
    assert (interpolator.form, interpolator.operand) == ("direct", "one_minus_cosine")


@pytest.mark.parametrize(
    "values",
    [
        {"method": "linear", "degree": 2},
        {"method": "quadratic", "degree": 1},
        {"method": "chord-local", "degree": 3},
        {"method": "linear", "fraction_bits": 46},
        {"method": "chord-local", "fraction_bits": 41},
        {"method": "angular", "operand": "cosine"},
        {"method": "quadratic-published", "degree": 3},
        {"method": "quotient", "model": "cosquad"},
        {"method": "renormalise", "model": "phong"},
    ],
)
def test_impossible_candidates_are_refused(values):
    with pytest.raises(ValueError, match=r"method|fraction_bits"):
        Candidate(**values)


def test_quotient_is_swept_with_its_lobes():
    """quotient has its own operand, and no choice of words or degrees."""
    found, impossible = Sweep(methods=("quotient", "renormalise")).candidates()
    quotients = [(one.model, one.style, one.lanes) for one in found if one.method == "quotient"]
    builds = [("throughput", 1), ("throughput", 2), ("throughput", 4), ("compact", 1)]
    assert quotients == [(model, *build) for model in ("blinn", "phong") for build in builds]
    assert {one.lanes for one in found if one.method == "renormalise"} == {1}
    assert impossible["quotient: serves only models that come from a table"] == 3 * len(builds)
    assert any(reason.startswith("renormalise: phong is a lobe of R·V") for reason in impossible)


def test_sweep_has_every_design_once_and_counts_the_impossible():
    """A count by hand: chord-local and angular find no normals, and the middle normal has no degree 1."""
    sweep = Sweep(
        methods=("linear", "angular", "chord-local", "quadratic"),
        models=("cosquad", "exp"),
        lights=(1, 3),
        degrees=(1, 2),
        fraction_bits=(40, 42, 46),
        styles=("compact",),
    )
    found, impossible = sweep.candidates()
    assert len(set(found)) == len(found) == 4 * (2 + 1 + 3 + 2)
    assert impossible == {
        "angular, chord-local: finds no normals, so it has one operand": 4 * (1 + 3),
        "quadratic: has no polynomial of degree 1": 4 * 2,
    }
    assert {one.style for one in found} == {"compact"}
    assert {(one.degree, one.fraction_bits) for one in found if one.method == "linear"} == {(None, None)}


def test_every_method_is_in_the_default_sweep():
    found, _ = Sweep().candidates()
    assert {one.method for one in found} == set(METHODS)
    printed, _ = Sweep(methods=tuple(PUBLISHED)).candidates()
    assert {one.method for one in printed} == set(PUBLISHED)


@pytest.mark.long
@pytest.mark.parametrize(
    ("candidate", "is_plain"),
    [
        (Candidate("linear"), True),
        (Candidate("quotient", "phong"), True),
        (Candidate("quotient", "phong", lanes=4), True),
        (Candidate("quadratic", "exp", 2, "one_minus_cosine", 3, style="compact"), True),
        (Candidate("chord-local", fraction_bits=46), True),
        (Candidate("chord-local", "cosquad7", 2, None, None, 40, "compact"), False),
        (Candidate("quadratic", operand="one_minus_cosine", degree=2), False),
        (Candidate("bisection", degree=1), False),
        (Candidate("recurrence-direct"), False),
    ],
)
def test_command_of_a_design_makes_it(candidate, is_plain, monkeypatch, capsys):
    """The command runs as printed, except for the Verilog. The unit that it would emit is the candidate's."""
    made = []
    monkeypatch.setattr("blysk.hdl.emit.verilog.emit", lambda unit, name, **_: made.append(unit) or "module")
    monkeypatch.setattr("blysk.sim.api.verilog.emit", lambda unit, name, **_: made.append(unit) or "module")
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
    assert unit.model.interpolator == candidate.design.interpolator
    assert (unit.model.model, unit.model.lights) == (candidate.model, candidate.lights)
    assert (unit.model.build.style, unit.model.build.lanes) == (candidate.style, candidate.lanes)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        del unit
        gc.collect()


# Measurements.


@pytest.mark.long
def test_errors_are_those_of_the_simulated_frame():
    candidate = Candidate("chord-local", fraction_bits=38)
    (scene,) = explore.scenes_of(view(16, 12), [EXPONENT])
    frame = FrameSimulator(candidate.design, "pysim").render(scene)
    result = errors_of({"method": "chord-local", "fraction_bits": 38}, view(16, 12), EXPONENT)
    expected = compare(scene, candidate.design, frame)
    for name in ERRORS:
        figures = getattr(expected, f"{name}_error")
        assert result["errors"][name] == {
            key: getattr(figures, key) for key in ("max_lsb", "p999_lsb", "rmse_lsb")
        }
    assert result["out_of_range_spans"] == frame.out_of_range_spans
    assert sum(length * count for length, count in result["lengths"]) == frame.pixels


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


@pytest.mark.long
def test_costs_are_those_of_the_netlist():
    result = costs_of({"method": "linear", "model": "cosquad", "style": "compact"})
    unit = ShadingPipelineUnit(preset("linear", "cosquad", style="compact"))
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
    """Designs whose figures come from a few values, so that some are equal."""
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
    # Three spans of 1 pixel, one of 2, two of 10 pixels: 25 pixels.
    assert first.cycles_per_pixel == pytest.approx((3 * 4 + 4 + 2 * 10) / 25)
    assert second.cycles_per_pixel == pytest.approx((3 * 7 + 7 + 2 * 30) / 25)


@pytest.mark.long
def test_stated_cycles_are_a_bound_of_those_of_frames():
    """For the simulated baselines, except bisection, which states no cycles."""
    measured = baselines.read()
    for method in METHODS:
        model = "blinn" if METHODS[method].needs_table else "cosquad"
        for style in STYLES:
            candidate = Candidate(method, model, style=style)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UnusedElaboratable)
                unit = candidate.unit()
                latency = unit.latency
                figures = {"cycles_per_pixel": unit.cycles_per_pixel, "setup_interval": unit.setup_interval}
                del unit
                gc.collect()
            for name, scene in resources.scenes().items():
                prepared = prepare(scene, candidate.design)
                length = prepared.spans.length
                counts = [[k, int(count)] for k, count in enumerate(np.bincount(length)) if count]
                frame = {"errors": {}, "out_of_range_spans": 0, "lengths": counts}
                results = [figures | dict.fromkeys(COSTS.values(), 0), frame]
                (one,) = explored(tasks_of([candidate], {}, EXPONENT), results)
                if method == "bisection":
                    assert one.cycles_per_pixel is None
                    continue
                besides = latency + prepared.writes
                cycles = measured[f"frames: pipeline {method}, {model}, {style}"][f"{name}_cycles"]
                assert length.sum() < cycles <= one.cycles_per_pixel * length.sum() + besides
