"""The section on triangles: designs compared, and results of stiff and extreme cases."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from blysk.bench.report import geometry
from blysk.bench.report.geometry import CANDIDATES, measure, section, tasks
from blysk.bench.report.geometry_cases import cases_of, frame_figures, measure_cases
from blysk.bench.tools.families import DEVICE
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.presets import preset
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer

METHODS = "quotient", "renormalise", "quadratic"


@cache
def cases(method):
    return measure_cases(method, True)


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS)
def test_cases(method):
    """Coverage is exact. Only slivers are off, and only opposite normals add up to 0."""
    for case in cases(method):
        assert (case["coverage"], case["other"]) == (0, 0)
        assert case["pixels"] > 0
        assert case["sliver"] or case["error"] < 0.6
        assert (case["zero"] > 0) == (case["name"] == "a normal and its opposite")
    by_name = {case["name"]: case for case in cases(method)}
    assert by_name["triangles between neighbouring points of the grid"]["pixels"] == 400
    assert by_name["10,000 triangles of half a pixel to a pixel"]["triangles"] == 10_000
    assert by_name["two triangles in the same place"]["hidden"] == 13_050


def test_differences_are_found():
    """A colour, a missing pixel, and a pixel of another triangle are found."""
    drawn = next(scene for name, scene in cases_of(True) if "cross" in name)
    renderer = Renderer(preset("renormalise", "blinn", x_bits=12, y_bits=12))
    frame = triangle_frame(drawn, renderer)
    y, x = np.argwhere(frame.owner >= 0)[[0, 500, 900]].T
    image, owner = frame.image.copy(), frame.owner.copy()
    image[y[0], x[0]] ^= 64
    owner[y[1], x[1]] = -1
    owner[y[2], x[2]] = 3 - owner[y[2], x[2]]
    found = frame_figures(drawn, renderer, replace(frame, image=image, owner=owner))
    assert (found["coverage"], found["other"]) == (1, 1)
    assert 63 < found["error"] < 65


@pytest.mark.parametrize("method", METHODS[:2])
def test_random_coarse_meshes(method):
    """Ten convex bodies of 8 to 39 corners, whose normals differ by about 30 degrees, along the true line."""
    rng = np.random.default_rng(10)
    for count, exponent in zip(rng.integers(8, 40, 10), [1, 20, 100, 400, 1000] * 2, strict=True):
        points = normalise(rng.normal(size=(count, 3))) * rng.uniform(0.7, 1, (count, 1))
        hull = ConvexHull(points)
        outward = np.einsum("fn,fn->f", hull.equations[:, :3], _normals_of(points, hull.simplices)) > 0
        faces = np.where(outward[:, np.newaxis], hull.simplices, hull.simplices[:, ::-1])
        mesh = Mesh(points, faces, normalise(normalise(points) + 0.5 * rng.normal(size=points.shape)))
        camera = Camera.framing(points, tuple(rng.normal(size=3)), "perspective", 4 / 3)
        light = Light(tuple(normalise(rng.normal(size=3))))
        drawn = Scene(
            mesh, camera, 160, 120, Material((0.05,) * 3, (0.4,) * 3, (0.55,) * 3, exponent), [light]
        )
        renderer = Renderer(preset(method, "blinn", x_bits=8, y_bits=7))
        found = frame_figures(drawn, renderer, triangle_frame(drawn, renderer))
        assert found["pixels"] > 2000
        assert (found["coverage"], found["other"]) == (0, 0)
        assert found["error"] < 0.6


def _normals_of(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_tasks():
    assert [task.settings["design"] for task in tasks(False)[:-3]] == list(CANDIDATES)
    assert {task.settings["quick"] for task in tasks(True)[-3:]} == {True}


def _result(multipliers, *cycles):
    frames = [
        {"triangles": 10 * 100**k, "pixels": 1000, "cycles": n, "other": k, "errors": {"1": 0.5, "20": None}}
        for k, n in enumerate(cycles)
    ]
    bits = {"register_bits": 7, "memory_bits": 8, "geometry_multipliers": 2}
    return {"multipliers": multipliers, **bits, "frames": frames}


def test_section(monkeypatch):
    """Cycles and clock rates tell which design takes less time. Each method has the cases of the first."""
    store = [
        {"design": f"render {method}, blinn, 1 light, compact", "device": DEVICE, "fmax_mhz": rates}
        for method, rates in (("quotient", [90, 100, 120]), ("renormalise", [80]), ("quadratic", [100]))
    ]
    monkeypatch.setattr(geometry, "read_store", lambda: store)
    chosen = tasks(True)
    results = [_result(10, 4000, 8000), _result(15, 2000, 8000), _result(9, 4000, 4000)]
    results += [cases("quotient")] * 3
    made = section(chosen, results)
    assert made.text[2].startswith(
        "Compared with `quotient, compact`, `quadratic, compact` has 1 fewer multipliers. It takes 1.00 of "
        "the cycles, "
    )
    assert made.text[1] == (
        "Compared with `quotient, compact`, `renormalise, compact` has 5 more multipliers. It takes 0.50 of "
        "the cycles, 0.62 of the time with 10 triangles; 1.00 of the cycles, 1.25 of the time with 1,000 "
        "triangles. Their clock rates are 100 and 80 MHz, medians of 3 and 1 placements."
    )
    assert "0 pixels are covered" in made.text[3]
    assert made.text[3].endswith("Cases with an error above 1 LSB: slivers of 1/256 pixel.")
    designs, drawing, extreme = made.parts
    assert [row[5] for row in designs.rows] == [100, 80, 100]
    assert "<svg" in drawing.svg
    errors = extreme.columns.index("error, LSB")
    assert {marks[errors] for marks in extreme.marks} == {"", "stated"}
    wrong = {"quotient": [{**case, "error": 2.0, "sliver": 0} for case in cases("quotient")]}
    marks = geometry._case_table(wrong).marks
    assert {row[errors] for row in marks} == {"silent"}


@pytest.mark.long
def test_measure():
    """A frame of simulated hardware, and its errors for each exponent."""
    found = measure("quotient, compact", [64], [64, 48])
    (frame,) = found["frames"]
    assert (found["multipliers"], found["geometry_multipliers"], frame["triangles"]) == (7, 2, 52)
    assert frame["cycles"] > frame["pixels"] >= frame["spans"] > 0
    assert max(frame["errors"].values()) < 1
