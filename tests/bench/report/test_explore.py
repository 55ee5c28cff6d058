# amaranth: UnusedElaboratable=no
"""The design space: the list against brute force over the same records, resumed sweeps, the commands of
designs."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from blysk.bench.cli.explore import command
from blysk.bench.report import design_space, explore
from blysk.bench.report.design_space import costs_of
from blysk.bench.tools.sweep import COSTS, Candidate
from blysk.golden.reference.raster import rasterise
from blysk.sim.errors import InputError
from blysk.sim.frames.error_names import ERRORS

from .test_design_space import SMALL


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("BLYSK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(explore, "_TRIANGLES", SMALL["triangles"])


def run(*arguments):
    return CliRunner().invoke(command, ["--size", "40x30", "--jobs", "1", *map(str, arguments)])


# The command.


@pytest.mark.long
def test_sweep_of_four_designs_and_again(tmp_path, monkeypatch):
    """The list equals brute force over all designs. The second run measures nothing."""
    path = tmp_path / "designs.json"
    options = ("--methods", "linear,renormalise", "--models", "cosquad", "--degrees", "2")
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
    lines = result.stdout.splitlines()
    listed = [line for line in lines if re.match(r" *\d+ .*(throughput|compact)  ", line)]
    assert len(listed) == min(len(under), 3)
    assert not any(line.startswith("chord-local gets values") for line in lines)
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
    assert again.stdout == result.stdout
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
    options = ("--methods", "linear,renormalise,angular", "--models", "cosquad", "--degrees", "3")
    options += ("--fraction-bits", "46", "--styles", "throughput", "--operands", "one_minus_cosine")
    stopped = run(*options)
    assert stopped.exit_code == 130
    assert stopped.output == "blysk: stopped; 4 of 6 measurements are kept, run again to continue\n"
    resumed = run(*options)
    assert resumed.exit_code == 0
    assert calls == ["linear", "renormalise", "angular", "angular"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["--methods", "angular,gouraud"],
            "--methods angular,gouraud: 'gouraud' is not one of the choices; choose from ",
        ),
        (["--models", ""], "--models : '' is not one of the choices"),
        (["--lights", "0"], "--lights 0: '0' is not one of the choices; choose from 1,2,"),
        (["--fraction-bits", "41"], "choose from 36,38,40,42,44,46"),
        (["--degrees", "4"], "choose from 1,2,3"),
        (["--operands", "sine"], "choose from cosine,one_minus_cosine"),
        (["--largest-error", "0"], "--largest-error 0: not an error limit"),
        (["--largest-error", "nan"], "--largest-error nan: not an error limit"),
        (["--cost", "area"], "--cost area: unknown cost; use one of cells, multipliers, registers, memory"),
        (["--error", "model"], "--error model: unknown error; use one of arithmetic, method, total"),
        (["--size", "0x3"], "--size 0x3: out of range"),
        (["--exponent", "1001"], "--exponent 1001: out of range"),
        (["--limit", "0"], "--limit 0: out of range"),
        (["--mesh", "missing.obj"], "missing.obj: "),
        (["--cluster", "tcp://localhost:1", "--jobs", "1"], "--jobs: a cluster has its own workers"),
        (["--cluster", "nowhere"], "--cluster nowhere: not the address of a Dask scheduler"),
        (["--json", "missing/folder.json"], "missing/folder.json: cannot be written"),
        (
            ["--methods", "angular", "--operands", "cosine"],
            "the sweep: holds no possible design, 10 of angular: finds no normals",
        ),
    ],
)
def test_bad_options_are_one_line(arguments, text):
    options = ["--size", "40x30", *arguments]
    result = CliRunner().invoke(command, options)
    assert isinstance(result.exception, InputError)
    assert text in str(result.exception)
    assert "\n" not in str(result.exception)


def made_up(monkeypatch, out_of_range=False, error=0.5):
    """Results without measurements."""

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
        "allow a larger error, or sweep more designs"
    )
    assert json.loads(path.read_text())["designs"]
    made_up(monkeypatch, out_of_range=True)
    assert "all of them flag spans as too wide" in str(run().exception)


def test_what_is_given_is_told(monkeypatch):
    made_up(monkeypatch)
    told = "The cost of a design leaves out the computation of these values.\n"
    assert told in run("--methods", "chord-local").output
    assert told not in run("--methods", "angular").output


def test_impossible_ones_are_told(monkeypatch):
    made_up(monkeypatch)
    output = run("--methods", "chord-local,quadratic", "--models", "exp", "--styles", "compact").output
    # chord-local has no dot product: 2 words. quadratic has no degree 1: 2 operands.
    assert output.startswith(
        "impossible  4 combinations: 2 of chord-local: finds no normals, so it has one operand; "
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
