"""Error against run time: the data of a point, the fronts, the pictures, and commands that make them
again."""

import base64
import contextlib
import io
import json
import shlex
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blysk.bench import accuracy
from blysk.bench.report import frames as frames_module
from blysk.bench.report import place_and_route, points
from blysk.bench.report.accuracy_table import accuracy_table
from blysk.bench.report.accuracy_table import main as print_table
from blysk.bench.report.frames import (
    ERRORS,
    EXPONENTS,
    STEPS,
    TIMES,
    frames,
    hardware,
    software_frames,
    software_speeds,
    speeds,
)
from blysk.bench.report.points import BEST, DESIGNS, GROUPS, QUICK_SIMULATED, section, tasks
from blysk.bench.report.points_text import _is_comparable, front
from blysk.bench.store import Task
from blysk.golden.presets import METHODS, MODELS, PUBLISHED, preset
from blysk.golden.reference.metrics import ErrorFigures
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import SHADINGS, render
from blysk.sim.cli.main import main
from blysk.sim.errors import InputError
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

FIGURES = [field.name for field in fields(ErrorFigures)]

PLACE = {"source": "teapot", "triangles": 400, "digest": "of a test", "width": 64, "height": 48}

SIMULATED = ("chord-local", "cosquad")
"""The design that is built most quickly."""


def task(function, timed=False, exponents=(10, 100), **settings):
    return Task(function, {**settings, "view": PLACE, "exponents": list(exponents)}, timed)


def design(method, model="cosquad", simulated=False):
    """Tasks of a design."""
    settings = {"method": method, "model": model, "simulated": simulated}
    return [task(frames, **settings), task(speeds, timed=True, **settings)]


@pytest.fixture(scope="module")
def measured():
    """Tasks of a few designs and of a software shading, and their results."""
    chosen = [
        *design(*SIMULATED, simulated=True),
        *design("linear"),
        *design("angular-published"),
        *design("renormalise", "exp"),
        *design("renormalise", "blinn"),
        *design("quotient", "phong"),
        Task(hardware, dict(zip(("method", "model"), SIMULATED, strict=True))),
        task(software_frames, shading="gouraud"),
        task(software_speeds, timed=True, shading="gouraud"),
        task(software_frames, shading="phong"),
        task(software_speeds, timed=True, shading="phong"),
    ]
    return chosen, [json.loads(json.dumps(one.run())) for one in chosen]


@pytest.fixture(scope="module")
def found(measured):
    """The points by their ids."""
    return {point["id"]: point for point in section(*measured).figures["points"]}


def test_every_method_and_model_is_a_design():
    assert {method for method, _ in DESIGNS} == {*METHODS, *PUBLISHED}
    assert {model for method, model in DESIGNS if method == "renormalise"} == {"blinn", *MODELS}
    assert {model for method, model in DESIGNS if method == "quotient"} == {"blinn", "phong"}
    assert len(set(DESIGNS)) == len(DESIGNS)
    assert set(QUICK_SIMULATED) < set(DESIGNS)


def test_what_is_given_values_or_draws_another_picture_wins_nothing():
    pairs = [("quotient", "blinn"), ("quotient", "phong"), ("chord-local", "blinn"), ("phong", "blinn")]
    points = [{"settings": {"method": method, "model": model}} for method, model in pairs]
    assert [_is_comparable(point) for point in points] == [True, False, False, True]


def of_frames(chosen):
    return [one.settings for one in chosen if one.function is frames]


def test_quick_tasks():
    chosen = tasks(quick=True)
    own = [s for s in of_frames(chosen) if "operand" not in s]
    assert [(s["method"], s["model"]) for s in own][: len(DESIGNS)] == DESIGNS
    # Each method is also there in its best form, with its own model and with the exact table.
    best = [(s["method"], s["model"]) for s in of_frames(chosen) if s not in own]
    assert best == [(method, model) for model in ("cosquad", "blinn") for method in BEST]
    exact = {s["method"] for s in of_frames(chosen) if s["model"] == "blinn"}
    assert {s["method"] for s in of_frames(chosen) if s["model"] == "phong"} == {"quotient"}
    assert exact == set(METHODS)
    operands = {
        (s["method"], s.get("operand", METHODS.get(s["method"], s).operand))
        for s in own
        if s["method"] in METHODS
    }
    operands |= {(s["method"], s["operand"]) for s in of_frames(chosen) if s not in own}
    best = {(method, "one_minus_cosine") for method in METHODS if method != "quotient"}
    assert best | {("quotient", "place")} <= operands
    assert {(s["method"], s["model"]) for s in of_frames(chosen) if s["simulated"]} == set(QUICK_SIMULATED)
    assert [(s["method"], s["lanes"]) for s in of_frames(chosen) if "lanes" in s] == [
        ("quotient", 2),
        ("quotient", 4),
    ]
    assert {method for method, _ in QUICK_SIMULATED} == {*METHODS, *PUBLISHED}
    assert [one.settings["shading"] for one in chosen if one.function is software_frames] == [*SHADINGS]
    assert all(one.timed == (one.function in (speeds, software_speeds)) for one in chosen)
    assert place_and_route.measure not in {one.function for one in chosen}
    (view,) = {json.dumps(s["view"]) for s in of_frames(chosen)}
    assert len(teapot(json.loads(view)["triangles"]).faces) == 992


def test_full_tasks(monkeypatch):
    monkeypatch.setattr(points, "tool_versions", lambda: {"pyosys": "1"})
    chosen = tasks(quick=False)
    assert all(s["simulated"] and s["exponents"] == list(EXPONENTS) for s in of_frames(chosen))
    placed = sum(not {"operand", "lanes"} & {*settings} for settings in of_frames(chosen))
    assert sum(one.function is place_and_route.measure for one in chosen) == placed > len(DESIGNS)
    monkeypatch.setattr(points, "tool_versions", lambda: {"pyosys": None})
    assert sum(one.function is place_and_route.measure for one in tasks(quick=False)) == 0


def test_without_a_compiler_nothing_is_simulated(monkeypatch):
    monkeypatch.setenv("CXX", "no-such-compiler")
    assert not any(settings["simulated"] for settings in of_frames(tasks(quick=True)))


def test_further_meshes(tmp_path):
    mesh = tmp_path / "mesh.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (first,) = {
        s["view"]["digest"] for s in of_frames(tasks(True, [str(mesh)])) if s["view"]["source"] != "teapot"
    }
    mesh.write_text("v 0 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\n")
    frames_module._mesh.cache_clear()
    digests = {s["view"]["digest"] for s in of_frames(tasks(True, [str(mesh), str(mesh)]))}
    # These are the teapot's and another mesh's, because the file has changed.
    assert len(digests) == 2
    assert first not in digests
    with pytest.raises(InputError, match=r"missing\.obj"):
        tasks(True, ["missing.obj"])


def test_mesh_that_does_not_show(tmp_path):
    mesh = tmp_path / "needle.obj"
    mesh.write_text("v 0 0 0\nv 1000 1000 0\nv 1000 1000.0001 0\nf 1 2 3\n")
    view = {**PLACE, "source": str(mesh), "triangles": None}
    with pytest.raises(InputError, match="no pixel shows the surface at 64x48"):
        software_frames("flat", view, [10])
    with pytest.raises(InputError, match="no pixel shows the surface at 64x48"):
        frames("linear", "cosquad", view, [10], False)


@pytest.mark.long
def test_simulated_point_is_that_of_the_frame_runner(found):
    design = preset(*SIMULATED)
    mesh = teapot(PLACE["triangles"])
    for exponent, frame, result in accuracy.measure(mesh, design, (10, 100), 64, 48):
        point = found[f"teapot/chord-local/cosquad/{exponent}"]
        for kind in ("arithmetic", "method", "total"):
            for name in FIGURES:
                value = getattr(getattr(result, f"{kind}_error"), name)
                assert point["errors"][f"{kind}_{name}"] == pytest.approx(value, rel=1e-12)
        assert point["times"]["cycles_per_pixel"] == frame.cycles / frame.pixels
        assert point["counts"]["cycles"] == frame.cycles
        assert point["times"]["simulated_pixels_per_second"] > 0
        assert point["hardware"]["multipliers"] > 0


@pytest.mark.long
def test_model_has_the_simulated_frame(measured):
    simulated = measured[1][0]
    model = frames(*SIMULATED, PLACE, [10, 100], simulated=False)
    for one, other in zip(simulated, json.loads(json.dumps(model)), strict=True):
        assert one["cycles"] > one["pixels"]
        assert (one["settings"]["engine"], other["settings"]["engine"]) == ("cxxrtl", "model")
        same = {**one, "cycles": None, "settings": {**one["settings"], "engine": "model"}}
        assert same == other


@pytest.mark.long
def test_model_error_is_the_models_own(found):
    """The largest difference over all angles, times k_s, almost occurs somewhere. Blinn's own is 0."""
    cosine = np.linspace(0, 1, 100_001)
    for exponent in (10, 100):
        blinn = cosine**exponent
        models = {
            "linear/cosquad": np.maximum(1 - exponent / 2 * (1 - cosine), 0) ** 2,
            "renormalise/exp": np.exp(-exponent * (1 - cosine)),
        }
        for name, model in models.items():
            largest = 255 * 0.55 * np.abs(model - blinn).max()
            error = found[f"teapot/{name}/{exponent}"]["errors"]["model_max_lsb"]
            assert 0.9 * largest < error <= largest
        errors = found[f"teapot/renormalise/blinn/{exponent}"]["errors"]
        assert errors["model_max_lsb"] == 0
        assert errors["model_psnr_db"] is None


def test_phong_is_held_against_phong():
    """Blinn's highlight of the same exponent is another picture, not the exact picture."""
    for exponent, of in zip((1, 100), frames("quotient", "phong", PLACE, [1, 100], False), strict=True):
        errors = of["errors"]
        assert errors["model_max_lsb"] == 0
        assert errors["method_max_lsb"] == errors["total_max_lsb"] <= 0.6
        scene = accuracy.scene_for(teapot(PLACE["triangles"]), exponent, 64, 48)
        exact = [render(scene, model=REFLECTION_MODELS[name]).image for name in ("phong", "blinn")]
        assert 255 * np.abs(np.subtract(*exact)).max() > 5


@pytest.mark.long
def test_errors_of_software(found):
    phong, gouraud = (found[f"teapot/{shading}/100"]["errors"] for shading in ("phong", "gouraud"))
    assert phong["total_max_lsb"] == phong["arithmetic_max_lsb"] <= 0.5
    # The hardware's exact frame is the same.
    assert phong["method_max_lsb"] <= 0.5
    assert gouraud["arithmetic_max_lsb"] <= 0.5
    assert gouraud["total_max_lsb"] > 10
    assert found["teapot/phong/100"]["verdicts"]["total"]
    assert not found["teapot/gouraud/100"]["verdicts"]["total"]
    assert found["teapot/phong/100"]["times"] == {
        "cycles_per_pixel": None,
        "ns_per_pixel": None,
        "multipliers": None,
        "luts": None,
        "simulated_pixels_per_second": None,
        "golden_ns_per_pixel": pytest.approx(1e5, rel=1),
    }


def brute(errors, times):
    known = [
        e is not None and t is not None and e == e and t == t for e, t in zip(errors, times, strict=True)
    ]
    count = range(len(errors))
    return [
        known[i]
        and not any(
            known[j]
            and errors[j] <= errors[i]
            and times[j] <= times[i]
            and (errors[j] < errors[i] or times[j] < times[i])
            for j in count
        )
        for i in count
    ]


@pytest.mark.parametrize("seed", range(20))
def test_front(seed):
    """The front is compared with its definition, with ties, equal points and points without figures."""
    rng = np.random.default_rng(seed)
    errors, times = (rng.integers(0, 12, 40).astype(float).tolist() for _ in range(2))
    errors[3] = times[7] = None
    errors[5] = times[9] = float("nan")
    np.testing.assert_array_equal(front(errors, times), brute(errors, times))


def test_front_of_few():
    assert front([], []).tolist() == []
    assert front([1.0], [None]).tolist() == [False]
    assert front([1.0, 1.0], [2.0, 2.0]).tolist() == [True, True]


@pytest.mark.long
def test_fronts(measured):
    figures = section(*measured).figures
    assert set(figures["fronts"]) == {f"{e['key']}|{t['key']}" for e in ERRORS for t in TIMES}
    by_id = {point["id"]: point for point in figures["points"]}
    for error, time in (("total_max_lsb", "golden_ns_per_pixel"), ("method_p999_lsb", "cycles_per_pixel")):
        front = figures["fronts"][f"{error}|{time}"]
        for exponent in (10, 100):
            scene = [point for point in by_id.values() if point["settings"]["exponent"] == exponent]
            expected = brute([p["errors"][error] for p in scene], [p["times"][time] for p in scene])
            assert {p["id"] for p, on in zip(scene, expected, strict=True) if on} == {
                name for name in front if by_id[name] in scene
            }

    # Here a larger number is better.
    def psnr_and_time(point):
        return point["errors"]["total_psnr_db"], -point["times"]["golden_ns_per_pixel"]

    best = max(by_id.values(), key=psnr_and_time)
    assert best["id"] in figures["fronts"]["total_psnr_db|golden_ns_per_pixel"]
    fast = max(by_id.values(), key=lambda point: point["times"]["simulated_pixels_per_second"] or 0)
    assert fast["id"] in figures["fronts"]["total_max_lsb|simulated_pixels_per_second"]


@pytest.mark.long
def test_clock_rate(measured, monkeypatch):
    """The clock rate is that of the section on place and route.

    Without it and without a committed rate there are no nanoseconds.
    """
    chosen, results = measured
    monkeypatch.setattr(points, "placed", lambda device: {})
    task = place_and_route.task(*SIMULATED)
    for found, expected in (
        ({"fmax_median_mhz": 100, "multipliers": 3}, 10),
        ({"reason": "too large"}, None),
    ):
        figures = section([*chosen, task], [*results, found]).figures
        point = next(p for p in figures["points"] if p["id"] == "teapot/chord-local/cosquad/10")
        cycles = point["times"]["cycles_per_pixel"]
        assert point["times"]["ns_per_pixel"] == (expected and pytest.approx(expected * cycles))
        assert point["hardware"]["multipliers"] != 3


@pytest.mark.long
def test_section(measured):
    made = section(*measured)
    assert (made.name, made.title) == ("points", "Error against run time")
    over_scenes, every, on_front = made.parts
    assert {row["design"] for row in over_scenes.records()} == {
        point["label"] for point in made.figures["points"] if point["group"] != "software"
    }
    assert len(every.rows) == len(made.figures["points"]) == 2 * 8
    assert {len(row) for row in every.grades} == {len(every.columns)}
    for record, point in zip(every.records(), made.figures["points"], strict=True):
        assert record["design"] == point["label"]
        assert record["exponent"] == point["settings"]["exponent"]
        assert record["total error, largest, LSB"] == point["errors"]["total_max_lsb"]
        assert record["hardware, cycles, cycles a pixel"] == point["times"]["cycles_per_pixel"]
    assert on_front.rows
    groups = {point["label"]: point["group"] for point in made.figures["points"]}
    assert groups == {
        "chord-local, cosquad": "own",
        "linear, cosquad": "baseline",
        "angular-published, cosquad": "published",
        "renormalise, exp": "baseline",
        "renormalise, blinn": "baseline",
        "quotient, phong": "own",
        "gouraud, software": "software",
        "phong, software": "software",
    }
    assert {key["key"] for key in made.figures["groups"]} == set(GROUPS)
    for point in made.figures["points"]:
        assert set(point["errors"]) == {axis["key"] for axis in ERRORS}
        assert set(point["times"]) == {axis["key"] for axis in TIMES}
    json.dumps(made.figures, allow_nan=False)


def picture(uri):
    head, data = uri.split(",")
    assert head == "data:image/png;base64"
    return Image.open(io.BytesIO(base64.b64decode(data)))


@pytest.mark.long
def test_pictures_hold_the_frame_and_its_errors(found, measured):
    point = found["teapot/chord-local/cosquad/100"]
    scene = accuracy.scene_for(teapot(PLACE["triangles"]), 100, 64, 48)
    frame = FrameSimulator(preset(*SIMULATED)).render(scene)
    exact = render(scene, "phong", REFLECTION_MODELS["blinn"], raster=frame.raster)
    rows, columns = np.nonzero(exact.mask)
    shown = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    np.testing.assert_array_equal(picture(point["pictures"]["frame"]), frame.image[shown][..., 0])
    total = picture(point["pictures"]["total"])
    colors = [*section(*measured).figures["error_map"]["colors"], None]
    assert (total.info["transparency"], len(colors)) == (len(STEPS), len(STEPS) + 1)
    error = np.abs(frame.image - exact.image * 255).max(axis=-1)[shown]
    codes = np.asarray(total)
    np.testing.assert_array_equal(codes == len(STEPS), ~exact.mask[shown])
    limits = np.array([0, *STEPS])
    inside = exact.mask[shown]
    assert (error[inside] <= limits[codes[inside] + 1]).all()
    assert ((error[inside] > limits[codes[inside]]) | (codes[inside] == 0)).all()
    assert error.max() > STEPS[codes[inside].max() - 1]
    painted = np.asarray(total.convert("RGBA"))[inside]
    for code, color in enumerate(colors[:-1]):
        expected = [int(color[k : k + 2], 16) for k in (1, 3, 5)]
        assert (painted[codes[inside] == code][:, :3] == expected).all()


def test_smaller_pictures_keep_the_largest_error():
    values = np.zeros((7, 11))
    values[6, 10], values[2, 3] = 5, 7
    small = frames_module._largest(values, 3)
    assert small.shape == (3, 4)
    assert (small[2, 3], small[0, 1], small.sum()) == (5, 7, 12)
    rng = np.random.default_rng(3)
    image = np.repeat(rng.integers(0, 256, (50, 900, 1), dtype=np.uint8), 3, axis=-1)
    exact = image / 255.0
    exact[30, 600] = 1 - exact[30, 600].round()
    made = frames_module._pictures(image, {"error": exact}, np.ones((50, 900), dtype=bool))
    frame, error = picture(made["frame"]), picture(made["error"])
    assert frame.size == error.size == (225, 13)
    assert np.argwhere(np.asarray(error)).tolist() == [[30 // 4, 600 // 4]]


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["chord-local/cosquad", "angular-published/cosquad", "renormalise/blinn", "quotient/phong"]
)
def test_command_makes_the_point_again(found, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    point = found[f"teapot/{name}/100"]
    program, *arguments = shlex.split(point["command"])
    assert program == "blysk"
    assert main(arguments) == 0
    capsys.readouterr()
    figures = json.loads(Path("figures.json").read_text())
    for kind in ("arithmetic", "method", "total"):
        for name in FIGURES:
            value = figures[f"{kind}_error"][name]
            assert point["errors"][f"{kind}_{name}"] == pytest.approx(value, rel=1e-9)
    assert figures["pixels"] == point["counts"]["pixels"]
    assert figures["visible_pixels"] == point["counts"]["shown"]


@pytest.mark.long
def test_command_in_python(found):
    point = found["teapot/gouraud/10"]
    program, option, code = shlex.split(point["command"])
    assert (program, option) == ("python", "-c")
    with contextlib.redirect_stdout(io.StringIO()) as output:
        exec(code, {})
    assert output.getvalue().strip() == str(point["errors"])


def test_command_of_a_file():
    settings = {
        **PLACE,
        "source": "my mesh.obj",
        "triangles": None,
        "method": "renormalise",
        "model": "exp",
        "exponent": 7,
    }
    settings |= {"ambient": 0.05, "diffuse": 0.4, "specular": 0.55, "engine": "cxxrtl"}
    words = shlex.split(points._command(settings))
    assert words[:3] == ["blysk", "render", "my mesh.obj"]
    assert "--triangles" not in words


@pytest.mark.long
def test_accuracy_table(measured):
    chosen, results = measured
    kept = [(t, r) for t, r in zip(chosen, results, strict=True) if t.settings.get("method") == SIMULATED[0]]
    made = section(*zip(*kept, strict=True))
    head, rule, line, end = accuracy_table(made.figures["points"]).split("\n")
    assert head.startswith("| mesh | method | model | n = 10 | n = 100 | total | cycles a pixel |")
    assert len(rule.split("|")) == len(head.split("|")) == len(line.split("|"))
    assert end == ""
    cells = line.strip("| ").split(" | ")
    assert cells[:3] == ["teapot", *SIMULATED]
    design = preset(*SIMULATED)
    for cell, (exponent, frame, result) in zip(
        cells[3:], accuracy.measure(teapot(400), design, (10, 100), 64, 48), strict=False
    ):
        assert cell == f"{result.arithmetic_error.max_lsb:.2f} / {result.method_error.max_lsb:.2f}"
        if exponent == 100:
            assert cells[5:7] == [f"{result.total_error.max_lsb:.1f}", f"{frame.cycles / frame.pixels:.3f}"]


def test_accuracy_table_of_no_report(tmp_path, capsys):
    (tmp_path / "report.json").write_text("{}")
    for name in ("report.json", "none.json"):
        assert print_table([str(tmp_path / name)]) == 2
        error = capsys.readouterr().err
        assert error.endswith("is not a full report; give the report.json of `blysk bench`\n")
