"""The sweep over the exponents: what it compares, and what it tells apart."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blysk.bench import accuracy
from blysk.bench.quality import sweep
from blysk.bench.quality.sweep import EXPONENTS, FEW_EXPONENTS, LARGEST, Point, SweptMesh, main, summarise
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.number.unit_vector import quantise
from blysk.golden.presets import LOBES, MIRROR_LOBES, MODELS, preset
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.mesh import load_mesh
from blysk.sim.meshes.teapot import teapot

UNITS = MODELS | LOBES | MIRROR_LOBES
STRESS = str(Path(__file__).parents[2] / "data" / "teapot992.obj")


def test_exponents():
    assert list(EXPONENTS) == list(range(1, 1001))
    assert len(FEW_EXPONENTS) == 30
    assert {1, 2, 3, 10, 100, 500, 1000} <= set(FEW_EXPONENTS) <= set(EXPONENTS)


@pytest.mark.parametrize(
    ("model", "exponent"),
    [("cosquad", 1), ("blinn_product", 30), ("coscos4", 700), ("blinn", 5), ("phong", 9)],
)
def test_reference_is_the_renderer(model, exponent):
    """Worked out once a mesh, the exact frame is that which the golden renderer draws."""
    frame = SweptMesh(teapot(1000), 96, 72)
    image = render(frame.scene_of(exponent), model=UNITS[model].reflection).image.reshape(-1, 3)
    shown = frame.raster.pixel[frame.raster.visible]
    assert len(shown) == frame.pixels > 1500
    np.testing.assert_allclose(frame.golden(model, exponent), 255 * image[shown], rtol=0, atol=1e-9)


@pytest.mark.parametrize("method", ["quotient", "renormalise", "chord-local", "quadratic"])
def test_spans_are_those_of_a_frame(method):
    """The raster is kept; the rest is as for a frame by itself."""
    frame, design = SweptMesh(load_mesh(STRESS).mesh, 64, 48), preset(method, accuracy.model_of(method))
    for exponent in (3, 700):
        cut, spans = frame.spans_of(design, exponent)
        expected = prepare(frame.scene_of(exponent), design)
        np.testing.assert_array_equal(cut.visible, expected.cut_raster.visible)
        for name in ("x", "y", "length", "normal_left", "normal_right", "material"):
            np.testing.assert_array_equal(getattr(spans, name), getattr(expected.spans, name))
        if design.interpolator.given_values:
            np.testing.assert_array_equal(spans.values, expected.spans.values)
        if spans.vectors is not None:
            for own, other in zip(tuple(spans.vectors), tuple(expected.spans.vectors), strict=True):
                np.testing.assert_array_equal(own, other)


@pytest.mark.long
@pytest.mark.parametrize("design", [("quotient", "phong"), ("renormalise", "cosquad")])
def test_errors_are_those_of_the_simulated_frame(design):
    mesh, (method, model) = teapot(500), design
    frame = SweptMesh(mesh, 64, 48)
    for exponent, _, result in accuracy.measure(mesh, preset(*design), (2, 300), 64, 48):
        (point,) = frame.points(exponent, [model], method)
        assert point.max_lsb == pytest.approx(result.method_error.max_lsb, abs=1e-9)
        assert (point.model, point.exponent, point.over) == (model, exponent, 0)
        assert point.steady_lsb == point.max_lsb <= LARGEST


def flat(normal):
    """A square with one normal."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64)
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(normal, (4, 1)))


@pytest.mark.parametrize("side", [1, -1])
def test_switched_pixels_are_told_apart(side):
    """A normal a billionth off a right angle to the light, which as a code lies on the other side of it."""
    scene = SweptMesh(flat([0, 0, 1]), 16, 12).scene
    light, viewer = np.array(scene.lights[0].direction), scene.camera.viewer
    across = normalise(viewer - (viewer @ light) * light)
    turn = np.linspace(-1, 1, 200)[:, np.newaxis]
    normals = np.cos(turn) * across + np.sin(turn) * np.cross(light, across)
    normals = normalise(normals + side * 1e-9 * light)
    product = quantise(normals) @ quantise(light)
    # The model's N·L is cut to 25 of these 34 fraction bits.
    (normal, *_) = normals[side * product < -(2**10)]
    (point,) = SweptMesh(flat(normal), 16, 12).points(1, ["blinn_product"], "quadratic")
    assert point.over == point.switched == point.pixels > 20
    assert point.switched_cosine == pytest.approx(1e-9, rel=0.01)
    assert point.max_lsb > 5
    assert point.steady_lsb == 0


def test_a_wrong_sign_is_no_excuse(monkeypatch):
    """Where N·L is not about 0, a light that is off is an error as any."""
    scene = SweptMesh(flat([0, 0, 1]), 16, 12).scene
    light, viewer = np.array(scene.lights[0].direction), scene.camera.viewer
    across = normalise(viewer - (viewer @ light) * light)
    frame = SweptMesh(flat(normalise(across + 0.002 * light)), 16, 12)
    constants = FrameConstants.of(frame.scene, 1)
    behind = replace(constants, direction=-constants.direction)
    monkeypatch.setattr(sweep, "constants_of", lambda *_: [behind])
    (point,) = frame.points(1, ["blinn_product"], "quadratic")
    assert point.over == point.pixels > 20
    assert point.switched == 0
    assert point.steady_lsb == point.max_lsb > 5


def test_other_errors_are_not_switched():
    """Straight lines between normals are far off, and not at N·L = 0 only."""
    frame = SweptMesh(teapot(1000), 96, 72)
    (point,) = frame.points(100, ["cosquad"], method="linear")
    assert point.over > 20
    assert point.switched < point.over / 10
    assert point.steady_lsb == point.max_lsb > 20


def test_other_scenes():
    frame = SweptMesh(teapot(100), 16, 12, (0, 0, 1), (0, 1, 0.5), (1, 0, 0))
    assert frame.scene_of(7).material == Material((0,) * 3, (0,) * 3, (1,) * 3, 7)
    assert frame.scene.lights == (Light((1, 0, 0)),)
    np.testing.assert_allclose(frame.scene.camera.viewer, normalise([0, 1, 0.5]), atol=1e-12)
    assert frame.golden("blinn_product", 1).shape == (frame.pixels, 3)


def test_light_from_behind(capsys):
    """Of the pixels where N·L is about 0 some switch by quadratics, none by lines; no other is off."""
    rows = {}
    for method in ("quadratic", "renormalise"):
        chosen = ["--models", "cosquad", "--exponents", "1", "--view", "1", "0.2", "0.3", "--method", method]
        assert main([STRESS, *chosen, "--light", "-0.3", "0.2", "-1"]) == 0
        rows[method] = cells = capsys.readouterr().out.splitlines()[2].strip("| ").split(" | ")
        assert float(cells[4]) <= LARGEST
        assert cells[6] == "0"
    assert rows["renormalise"][9] == "0"
    assert float(rows["renormalise"][7]) <= LARGEST
    cells = rows["quadratic"]
    assert float(cells[7]) > LARGEST
    assert 0 < int(cells[9]) < 30
    # The fit's own error, 0.12 of 255 at most, and that of the arithmetic.
    assert float(cells[10]) < 0.12 / 255 + 2**-16


def point(model, exponent, max_lsb, steady_lsb, over=0, switched=0, cosine=0.0):
    return Point(model, exponent, 5, 10, max_lsb, over, switched, cosine, steady_lsb)


def test_summary():
    first, second = summarise(
        "m",
        [
            point("exp", 1, 9.0, 0.5, 3, 3, 1e-6),
            point("blinn_product", 1, 0.7, 0.7),
            point("exp", 2, 1.25, 1.25, 4, 1, 1e-7),
        ],
    )
    assert (first.mesh, first.model, first.exponents, first.pixels) == ("m", "exp", 2, 10)
    assert (first.steady_lsb, first.steady_exponent, first.over) == (1.25, 2, 3)
    assert (first.max_lsb, first.exponent, first.switched, first.switched_cosine) == (9.0, 1, 4, 1e-6)
    assert first.missed == (2,)
    assert (second.model, second.exponents, second.missed) == ("blinn_product", 1, ())


SMALL = [STRESS, "--width", "64", "--height", "48"]


def test_table(tmp_path, capsys):
    file = tmp_path / "sweep.json"
    chosen = ["--models", "exp", "cosquad", "--exponents", "1", "1000", "--method", "renormalise"]
    assert main([*SMALL, *chosen, "--json", str(file)]) == 0
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[:3] for row in rows] == [["| teapot992", model, "2"] for model in ("exp", "cosquad")]
    points = json.loads(file.read_text())["teapot992"]
    assert [(point["exponent"], point["model"]) for point in points] == [
        (exponent, model) for exponent in (1, 1000) for model in ("exp", "cosquad")
    ]
    assert max(point["steady_lsb"] for point in points) <= LARGEST


def test_local_chord_method(capsys):
    chosen = ["--models", "cosquad", "--exponents", "1", "1000", "--method", "chord-local"]
    assert main([*SMALL, *chosen, "--view", "1", "0.2", "0.3", "--light", "-0.3", "0.2", "-1"]) == 0
    assert " | cosquad | 2 | " in capsys.readouterr().out


def test_target(capsys):
    chosen = ["--models", "cosquad", "--exponents", "30", "100", "--method", "linear"]
    assert main([*SMALL, *chosen]) == 1
    assert "teapot992, cosquad; at 2 exponents: 30, 100" in capsys.readouterr().err


def test_true_phong_and_blinn_by_default(capsys):
    """No pixel is over an LSB, none switched, and no span is cut for an exponent."""
    assert main([*SMALL, "--exponents", "1", "100"]) == 0
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[:3] for row in rows] == [["| teapot992", model, "2"] for model in ("blinn", "phong")]
    assert all(float(row[4]) < 0.6 and row[6] == row[9] == "0" for row in rows)


@pytest.mark.parametrize(("method", "model"), [("quotient", "cosquad"), ("renormalise", "phong")])
def test_a_model_that_the_method_is_not_swept_with(method, model, capsys):
    assert main([STRESS, "--method", method, "--models", model]) == 2
    served = ", ".join(sweep.models_of(method))
    text = f"blysk.bench.quality.sweep: --models {model}: is not swept with {method}; use {served}\n"
    assert capsys.readouterr().err == text


def test_bad_mesh_is_one_line(capsys):
    assert main(["missing.obj"]) == 2
    assert capsys.readouterr().err.startswith("blysk.bench.quality.sweep: missing.obj: ")


@pytest.mark.long
@pytest.mark.parametrize("method", ["quotient", "renormalise"])
@pytest.mark.parametrize("mesh", ["teapot", STRESS], ids=["teapot", "stress"])
def test_methods_are_within_an_lsb(mesh, method, capsys):
    """Part of what the command sweeps by itself: every model, and an exponent in thirteen."""
    exponents = map(str, sorted({*FEW_EXPONENTS[::3], *range(1, 1001, 13)}))
    first, *others = sorted(sweep.models_of(method), key=accuracy.model_of(method).__ne__)
    chosen = [mesh, "--method", method]
    assert main([*chosen, "--models", first, "--exponents", *exponents]) == 0
    assert main([*chosen, "--models", *others, "--exponents", "1", "3", "10", "100", "1000"]) == 0
    capsys.readouterr()
