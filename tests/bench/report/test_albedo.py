"""The section on colours of pixels: its frames, its cycles, its multipliers, and its verdict."""

from dataclasses import replace

import numpy as np
import pytest

from blysk.bench.report.albedo import (
    COLORED,
    SCENES,
    STEEPEST,
    measure,
    multipliers,
    scene_of,
    section,
    tasks,
)
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.golden.frames.surface import design_for
from blysk.golden.presets import preset
from blysk.sim.frames.frame import FrameSimulator

SIZE = (64, 48, 64)


def settings_of(name, filter, transfer="srgb"):
    return {
        "name": name,
        "filter": filter,
        "projection": "perspective",
        "contrast": 1.0,
        "transfer": transfer,
        "size": list(SIZE),
        "engine": None,
    }


@pytest.mark.parametrize("name", SCENES)
def test_measure(name):
    """Errors are within their bounds. On the floor only the filter with steps has borders."""
    for filter in (None,) if name == COLORED else ("bilinear", "nearest"):
        found = measure(**settings_of(name, filter))
        assert 0.4 < found["error"] <= min(1, found["bound"])
        assert 500 < found["pixels"] < 64 * 48
        assert 1 < found["cycles_per_pixel"] < 1.2
        if name != COLORED:
            assert found["writes"] > 4096
        if name.startswith("floor"):
            assert (found["border_pixels"] > 0) == (filter == "nearest")


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize(("name", "filter"), [(STEEPEST, "bilinear"), (STEEPEST, "nearest"), (COLORED, None)])
def test_scenes(name, filter, projection):
    """The texels have the contrast, and the counted design is that of the frame."""
    scene = scene_of(name, filter, projection, 0.25, SIZE)
    chosen = {"name": name, "filter": filter, "projection": projection}
    (frame, *_) = [of for of in tasks(False) if chosen.items() <= of.settings.items()]
    parts = {tuple(of.settings["parts"]) for of in tasks(False) if of.function is multipliers}
    assert design_for(preset("quotient"), scene).albedo.parts in parts
    assert frame.settings["contrast"] == 1
    if filter:
        texels = scene.material.texture.texels
        assert {*texels.ravel()} == {0.375, 0.625}
        assert scene.material.texture.filter == filter
    else:
        assert (scene.mesh.colors.min(), scene.mesh.colors.max()) == (0, 1)


@pytest.mark.long
def test_simulated():
    """Simulation gives the figures of the models, also the cycles."""
    settings = settings_of(COLORED, None) | {"size": [24, 18, 64]}
    assert measure(**settings | {"engine": "pysim"}) == measure(**settings)


@pytest.mark.long
@pytest.mark.parametrize(("filter", "share"), [("nearest", 0), ("bilinear", 0.05)])
def test_cycles(filter, share):
    """Texels that are interpolated come after the light, and short spans wait for them."""
    scene = scene_of(STEEPEST, filter, "perspective", 1.0, (24, 18, 64))
    small = replace(scene.material.texture, texels=np.eye(4)[..., np.newaxis].repeat(3, axis=2))
    scene = replace(scene, material=replace(scene.material, texture=small))
    design = design_for(preset("quotient", "blinn"), scene)
    frame = FrameSimulator(design, "pysim").render(scene)
    modelled = frame_cycles(unit_of(design), frame.prepared.spans, 0)
    assert 0 <= frame.cycles - frame.prepared.writes - modelled <= share * modelled


def result(error, bound):
    return {
        "error": error,
        "bound": bound,
        "pixels": 100,
        "border_pixels": 0,
        "border_error": 0.0,
        "cycles_per_pixel": 1.0,
        "writes": 9,
    }


def test_section():
    """A frame over its bound or over the goal is red, and the text counts it."""
    chosen = tasks(False)
    results = [result(0.5, 0.75) if of.function is measure else 7 for of in chosen]
    results[:3] = result(0.8, 0.75), result(1.2, 1.5), result(1.3, None)
    made = section(chosen, results)
    assert "The largest error off the borders is 1.30 LSB of linear light, 1.20 LSB of sRGB." in made.text[1]
    assert f"{len(made.parts[0].rows) + 8 - 2} of" in made.text[1]
    table, drawing = made.parts
    assert [grades[4] for grades in table.grades[:4]] == ["bad", "bad", "bad", "good"]
    assert table.records()[0]["largest error at a border, LSB"] is None
    assert {row[-1] for row in table.rows} == {7}
    assert "<svg" in drawing.svg


def test_quick_section():
    """Two frames of a single design, without a drawing."""
    chosen = tasks(True)
    assert len(chosen) == 3
    (table,) = section(chosen, [result(0.5, 1.2), result(0.6, 1.3), 31]).parts
    assert [row[-1] for row in table.rows] == [31, 31]
