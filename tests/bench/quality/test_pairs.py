# amaranth: UnusedElaboratable=no
"""Pairs of methods and models on meshes: pixels counted, differences found."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blysk.bench.accuracy import scene_for
from blysk.bench.quality import pairs
from blysk.bench.quality.pairs import Pair, main, measure
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.raster import rasterise
from blysk.sim.engines.engine import SimulationError
from blysk.sim.engines.simulate import simulate
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.meshes.teapot import teapot

from ...lists import KINDS

STRESS = str(Path(__file__).parents[2] / "data" / "teapot992.obj")
ONE = {"methods": ["renormalise"], "models": ["cosquad"], "width": 48, "height": 36}


@pytest.mark.long
@pytest.mark.parametrize("method", ["quotient", "renormalise", "chord-local"])
def test_every_pixel_is_compared(method):
    meshes = [teapot(300), load_mesh(STRESS).mesh]
    pixels = sum(len(rasterise(scene_for(mesh, 1, 48, 36)).span) for mesh in meshes)
    (pair,) = measure(meshes, **ONE | {"methods": [method]}, exponents=(2, 500))
    assert pair == Pair(method, "cosquad", 4, 2 * pixels, 0)
    assert pixels > 500


@pytest.mark.parametrize(
    "field", ["g", *(pytest.param(f, marks=pytest.mark.long) for f in ("x", "last", "out_of_range_spans"))]
)
def test_a_difference_is_found(monkeypatch, field):
    def changed(*arguments, **options):
        run = simulate(*arguments, **options)
        if field == "out_of_range_spans":
            status = run.status.copy()
            status[field] += 1
            return replace(run, status=status)
        run.beats[field][7] ^= 1
        return run

    monkeypatch.setattr(pairs, "simulate", changed)
    (pair,) = measure([teapot(300)], **ONE, exponents=(20,))
    assert pair.mismatches == 1


@pytest.fixture
def outcome(monkeypatch):
    """What a frame gives, without the run."""
    asked = []
    result = {"frame": (10, 0)}

    def mismatches(unit, mesh, exponent, width, height):
        asked.append((unit.method, unit.model, exponent, width, height))
        if isinstance(result["frame"], Exception):
            raise result["frame"]
        return result["frame"]

    monkeypatch.setattr(pairs, "ShadingPipelineUnit", lambda design: design)
    monkeypatch.setattr(pairs, "mismatches", mismatches)
    result["asked"] = asked
    return result


def test_every_pair_of_every_mesh(outcome, capsys, tmp_path):
    file = tmp_path / "pairs.json"
    assert main(["teapot", STRESS, "--json", str(file)]) == 0
    # At exponent 1 these have a highlight beyond a right angle, which a table of quotient has not.
    beyond = {
        name for name, unit in MODELS.items() if unit.reflection.reflect(np.array([-1e-6]), 1)[0] > 0.5 / 255
    }
    assert {"cosquad", "exp"} <= beyond < set(MODELS)
    assert set(outcome["asked"]) == {
        (method, preset(method, model).model, exponent, 96, 72)
        for method in METHODS
        for model in ("blinn", *MODELS, None, *["phong"] * (method == "quotient"))
        for exponent in (1, 30, 1000)
        if not (method == "quotient" and model in beyond and exponent == 1)
    }
    count = len(METHODS) * (len(MODELS) + 2) + 1
    frames = 2 * (3 * count - len(beyond))
    assert len(outcome["asked"]) == frames
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith(f"{count} pairs, 2 meshes, {frames * 10:,} pixels: 0 mismatches, 0 pairs with")
    assert last.endswith(f", {len(beyond)} exponents that are not served")
    assert len(json.loads(file.read_text())) == count


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        ((10, 1), "| renormalise | exp | 3 | 30 | 3 |"),
        (SimulationError("stuck\nhere"), "| renormalise | exp | 0 | 0 | 0 | SimulationError: stuck |"),
    ],
)
def test_judged(outcome, capsys, frame, text):
    outcome["frame"] = frame
    assert main(["teapot", "--methods", "renormalise", "--models", "exp"]) == 1
    assert text in capsys.readouterr().out.splitlines()


def test_bad_mesh_is_one_line(capsys):
    assert main(["missing.obj"]) == 2
    assert capsys.readouterr().err.startswith("blysk.bench.quality.pairs: missing.obj: ")


@pytest.mark.long
@pytest.mark.parametrize(
    "method", [pytest.param(name, marks=() if "quad" in name else pytest.mark.long) for name in PUBLISHED]
)
def test_what_the_documents_print_runs_as_hardware_too(method):
    (pair,) = measure([load_mesh(STRESS).mesh], [method], ["cosquad"], (30,), 48, 36)
    assert (pair.mismatches, pair.failure) == (0, "")
    assert pair.pixels > 100


@pytest.mark.long
@pytest.mark.parametrize("method", ["quotient", "renormalise"])
def test_every_pixel_is_that_of_the_model(method, capsys):
    """With a model of each kind and without, of renormalise with every model.

    Other methods with these models have random spans in `tests/hdl/test_pipeline.py`.
    """
    models = MODELS if method == "renormalise" else [*KINDS, "phong"]
    assert main(["teapot", STRESS, "--methods", method, "--models", *models, "none"]) == 0
    capsys.readouterr()
