"""Ways of Phong and Blinn against each other, counts by hand, and the section against its results."""

import base64
import io
import json
import math

import numpy as np
import pytest
from PIL import Image

from blysk.bench.accuracy import scene_for
from blysk.bench.report import phong_blinn
from blysk.bench.report.phong_blinn import (
    FEWER_OPERATIONS,
    PIXELS,
    WAYS,
    exponents,
    frame_times,
    operations,
    section,
    shading_times,
    tasks,
)
from blysk.bench.report.phong_blinn_hardware import (
    half_angle,
    hardware_cost,
    hardware_frames,
    picture,
    widths,
)
from blysk.bench.store import Task
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot


@pytest.mark.parametrize("local", [False, True])
def test_ways(local):
    """All against `lighting`, which has tests of its own; both forms of Phong agree to rounding."""
    vectors = normal, light, viewer = phong_blinn._vectors(local)
    assert normal.shape == (3, PIXELS)
    assert light.shape == viewer.shape == (3, PIXELS if local else 1)
    found = {name: way(*vectors) for name, way in WAYS.items()}
    vector, scalar, blinn = found.values()
    np.testing.assert_allclose(vector, scalar, atol=1e-12)
    # The ways have no test of N·L > 0 before the highlight.
    lit = np.flatnonzero((normal * light).sum(axis=0) > 1e-6)[:40]
    material = Material((0.1,) * 3, (0.4,) * 3, (0.5,) * 3, 50)
    for pixel in lit:
        column = pixel if local else 0
        for model, values in (("phong", vector), ("blinn", blinn)):
            exact = intensity(
                normal[:, pixel],
                material,
                [Light(light[:, column])],
                (1, 1, 1),
                viewer[:, column],
                REFLECTION_MODELS[model],
            )
            assert values[pixel] == pytest.approx(exact[0], abs=1e-12)


def test_exponents():
    found = exponents()
    assert found["ratio"][0] == 4
    degrees = np.array(found["degrees"])
    c = np.cos(np.radians(degrees[4:]))
    assert found["ratio"][4:] == pytest.approx(np.log(2 * c * c - 1) / np.log(c), rel=1e-6)
    # Phong sees twice the angle.
    n, p, gamma = found["ratio"][80] * 7, 7, math.radians(degrees[80])
    assert math.cos(gamma) ** n == pytest.approx(math.cos(2 * gamma) ** p)


def test_operations():
    """Dot products 3 and 2, diffuse and ambient light 2 and 2 with the weights, a power, two gates."""
    per_frame = {way: operations(way, False) for way in WAYS}
    own = {way: operations(way, True) for way in WAYS}
    rest = {"functions": 1, "comparisons": 2}
    vector, scalar, blinn = WAYS
    # N·L, R·V, twice a cosine, three times a normal, two weights; R = ... - L.
    assert own[vector] == {"multiplications": 12, "additions": 9, **rest}
    assert per_frame[vector] == own[vector]
    # N·L, N·V, 2 (N·L)(N·V), weights; L·V besides where it is not the frame's.
    assert own[scalar] == {"multiplications": 13, "additions": 9, **rest}
    assert per_frame[scalar]["multiplications"] == pytest.approx(10, abs=0.001)
    # N·L, N·H, weights; H besides: sum, length, three divisions.
    assert own[blinn] == {"multiplications": 11, "additions": 11, "divisions": 3, "roots": 1, **rest}
    assert per_frame[blinn]["multiplications"] == pytest.approx(8, abs=0.001)
    assert per_frame[blinn]["roots"] == 1 / PIXELS


def test_times():
    found = shading_times(False, 1)
    assert list(found) == list(WAYS)
    assert next(iter(found.values())) == 1
    assert min(found.values()) > 0
    frame = frame_times(200, 64, 48, 1)
    assert frame["pixels"] == render(scene_for(teapot(200), 50, 64, 48)).mask.sum()
    assert min(frame["raster"], frame["phong"], frame["blinn"]) > 0


def test_half_angles_are_those_of_the_formulas():
    """From R·V itself, against sin^2 (psi/2) = sin^2 gamma times 1 along and cos^2 a across."""
    for degrees in (0, 20, 50, 70):
        for n in (10, 1000):
            sine = math.sin(math.acos(0.5 ** (1 / n)) / 2)
            assert half_angle((1, 0), degrees, n) == pytest.approx(math.asin(sine), abs=1e-9)
            across = math.asin(sine / math.cos(math.radians(degrees)))
            assert half_angle((0, 1), degrees, n) == pytest.approx(across, abs=1e-9)
    # R·V is over half everywhere across.
    assert math.isnan(half_angle((0, 1), 85, 10))


def test_widths():
    found = json.loads(json.dumps(widths((10, 1000))))
    assert np.allclose(found["along"]["1000"], 4, atol=1e-3)
    expected = 4 * np.cos(np.radians(found["degrees"])) ** 2
    assert np.allclose(found["across"]["1000"], expected, atol=1e-3)
    assert found["across"]["10"][-1] is None
    # 1 / cos a.
    assert found["outline"][18] / found["outline"][0] == pytest.approx(1.56, abs=0.04)


@pytest.mark.long
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_hardware_frames(model):
    """Every pixel of the simulated frames, a pixel a cycle at most."""
    (found,) = hardware_frames(model, 200, 64, 48, (50,))
    shown = render(scene_for(teapot(200), 50, 64, 48)).mask.sum()
    assert found["cycles"] > found["pixels"] >= shown
    assert found["lsb"] <= found["bound_lsb"] < 0.65
    assert found["rounded"] > 0.99
    drawn = picture(model, 12, 48)
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(drawn["png"]))))
    assert image.shape == (36, 24)
    assert image.max() > 150
    assert drawn["lsb"] < 0.6
    assert hardware_cost(model)["multipliers"] == {"blinn": 16, "phong": 17}[model]


MODELS = (("blinn", 0), ("phong", 2000))

FRAMES = [
    # Triangles, pixels, seconds of geometry, of Phong and of Blinn, cycles.
    (992, 20_000, 0.010, 0.008, 0.006, 30_000),
    (1_000_500, 25_000, 0.500, 0.010, 0.010, 100_000),
]


@pytest.fixture(scope="module")
def made():
    """The section from counts that are real and times that are not."""
    chosen, found = [Task(exponents), Task(widths)], [exponents(), widths((10, 1000))]
    for local in (False, True):
        for way in WAYS:
            chosen.append(Task(operations, {"way": way, "local": local}))
            found.append(operations(way, local))
        chosen.append(Task(shading_times, {"local": local, "repeats": 1}))
        found.append(dict(zip(WAYS, (1.0, 0.9, 1.1 if local else 0.7), strict=True)))
    for triangles, pixels, raster, phong, blinn, cycles in FRAMES:
        settings = {"triangles": triangles, "width": 640, "height": 480}
        chosen.append(Task(frame_times, {**settings, "repeats": 1}))
        found.append(
            {"triangles": triangles, "pixels": pixels, "raster": raster, "phong": phong, "blinn": blinn}
        )
        for model, more in MODELS:
            chosen.append(Task(hardware_frames, {"model": model, **settings, "exponents": [10, 50]}))
            run = {"triangles": triangles, "pixels": pixels, "cycles": cycles + more, "engine": "cxxrtl"}
            run |= {"lsb": 0.52, "bound_lsb": 0.58, "border_lsb": 0.6, "rounded": 0.998}
            found.append([run | {"cycles": 1}, run])
    names = ("multipliers", "cells", "register_bits", "memory_bits", "latency")
    for model, more in MODELS:
        chosen.append(Task(hardware_cost, {"model": model}))
        found.append(dict.fromkeys(names, 16 + more // 2000))
    buffer = io.BytesIO()
    Image.new("L", (4, 4)).save(buffer, "png")
    for _ in range(3):
        chosen.append(Task(picture, {}))
        found.append({"png": base64.b64encode(buffer.getvalue()).decode(), "lsb": 0.51})
    return section(chosen, json.loads(json.dumps(found)))


def part(made, name):
    (found,) = (of for of in made.parts if of.name == name)
    return found


def test_hardware_table(made):
    rows = part(made, "phong-blinn-hardware").records()
    assert [row["model"] for row in rows] == ["blinn", "blinn", "phong", "phong"] * 2
    assert {row["multipliers"] for row in rows if row["model"] == "phong"} == {17}
    said = made.text[2]
    assert "`phong` takes 17 multipliers and 4.080 cycles a pixel at 1,000,500 triangles" in said
    assert "0.52 LSB, within a bound of 0.58" in said
    assert "from `4 cos^2 a` by up to 0.0" in made.text[1]
    for name in ("phong-blinn-widths", "phong-blinn-pictures"):
        assert part(made, name).svg.startswith("<?xml")
    assert part(made, "phong-blinn-pictures").svg.count("data:image/png;base64") == 3


def test_operations_table(made):
    rows = {(row["L and V are"], row["way"]): row for row in part(made, "phong-blinn-operations").records()}
    assert len(rows) == 6
    row = rows["the frame's", "Blinn"]
    assert row["fewer operations than Phong, vector R"] == pytest.approx(1 - 17 / 24, abs=1e-3)
    assert row["less time than Phong, vector R"] == pytest.approx(0.3)
    near = rows["each pixel's", "Blinn"]
    assert near["fewer operations than Phong, vector R"] == pytest.approx(1 - 29 / 24)
    assert rows["each pixel's", "Phong, vector R"]["fewer operations than Phong, vector R"] is None
    grades = [grade for line in part(made, "phong-blinn-operations").grades for grade in line if grade]
    assert grades == ["good", "bad"]
    assert FEWER_OPERATIONS[0] < 1 - 17 / 24 < FEWER_OPERATIONS[1]


def test_frames_table(made):
    first, last = part(made, "phong-blinn-frames").records()
    assert first["less time with Blinn, frame"] == pytest.approx(1 - 16 / 18)
    assert first["less time with Blinn, shading"] == pytest.approx(0.25)
    assert first["share of geometry"] == pytest.approx(10 / 16)
    assert first["Phong, ns a visible pixel"] == pytest.approx(0.018 / 20_000 * 1e9)
    assert first["published, at most"] is None
    assert last["published, at most"] == 0.45
    assert last["cycles a pixel"] == 4
    assert last["hardware cycles"] == 100_000


def test_tasks():
    for quick, largest in ((True, 10_000), (False, 1_000_000)):
        chosen = tasks(quick)
        assert {task.function for task in chosen if task.timed} == {shading_times, frame_times}
        frames = [task.settings for task in chosen if task.function is hardware_frames]
        assert max(settings["triangles"] for settings in frames) == largest
        assert [settings["model"] for settings in frames[:2]] == ["blinn", "phong"]
        assert sum(task.function is picture for task in chosen) == 3
