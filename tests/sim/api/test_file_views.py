"""Lights and the camera of a glTF file in scenes and pipelines, unless options name others."""

import math

import numpy as np
import pytest

import blysk
from blysk.sim.api.render import prepare_rendering
from blysk.sim.api.scene import load, scenes_of
from blysk.sim.api.settings import rendering_settings

from ..meshes.files import mesh_gltf, put

SQUARE = [[0, 0, 0], [96, 0, 0], [0, 96, 0], [96, 96, 0]]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A square of 96 units, a camera in front of it, a point light and a sun."""
    light = [{"extensions": {"KHR_lights_punctual": {"light": k}}} for k in range(2)]
    nodes = [{"mesh": 0}, {"camera": 0, "translation": [48, 48, 200]}, light[0], light[1]]
    nodes[2]["translation"] = [48, 48, 64]
    document, buffer = mesh_gltf(SQUARE, (0, 1, 2, 2, 1, 3), None, nodes)
    document["scenes"][0]["nodes"] = [0, 1, 2, 3]
    document["cameras"] = [{"type": "perspective", "perspective": {"yfov": math.radians(50), "znear": 1}}]
    lights = [{"type": "point", "intensity": 1e4}, {"type": "directional", "color": [1, 0, 0]}]
    document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    return put(tmp_path_factory.mktemp("views") / "a.glb", (document, buffer))


UNIT = "the unit of the lights' brightness"


def test_scene_has_the_views_of_its_file(file):
    with pytest.warns(RuntimeWarning, match=UNIT):
        scene = blysk.scene(file)
    # A unit of the scene is 128 units of the file.
    assert np.allclose(scene.camera.position, np.array([48, 48, 200]) / 128)
    assert np.allclose(scene.camera.target, np.array([48, 48, 0]) / 128)
    assert scene.camera.field_of_view == pytest.approx(50)
    point, sun = scene.lights
    assert np.allclose(point.position, (0.375, 0.375, 0.5))
    # The corners are 93.3 units away, where 1e4 candela give 1.149 lux.
    assert np.allclose(point.attenuation, (0, 0, 128**2 / 8704))
    assert np.allclose(point.color, 1)
    assert np.allclose(sun.color, (8704 / 1e4, 0, 0))


@pytest.mark.parametrize(
    "options",
    [
        {"view": "front"},
        {"position": (0, 0, 300)},
        {"up": "z"},
        {"projection": "orthographic"},
        {"field_of_view": 40},
    ],
)
def test_options_of_the_camera_replace_the_file_s(file, options):
    with pytest.warns(RuntimeWarning, match=UNIT):
        scene = blysk.scene(file, **options)
    assert not np.allclose(scene.camera.position, np.array([48, 48, 200]) / 128)


@pytest.mark.parametrize("options", [{"lights": "0,0,1"}, {"point_lights": "0,0,90"}])
def test_options_of_lights_replace_the_file_s(file, options):
    scene = blysk.scene(file, **options)
    assert len(scene.lights) == 1
    assert scene.camera.field_of_view == pytest.approx(50)


@pytest.mark.parametrize("place", [[48, 48, -9], [500, 48, 200], [48, 48, 0.5]])
def test_cameras_that_see_nothing_are_told(tmp_path, place):
    """The camera is behind the square, beside it, or has the square in front of the near plane."""
    nodes = [{"mesh": 0}, {"camera": 0, "translation": place}]
    document, buffer = mesh_gltf(SQUARE, (0, 1, 2, 2, 1, 3), None, nodes)
    document["scenes"][0]["nodes"] = [0, 1]
    document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 1}}]
    path = put(tmp_path / "a.glb", (document, buffer))
    with pytest.warns(RuntimeWarning, match="without: a camera that does not see the mesh"):
        scene = blysk.scene(path)
    assert scene.camera.field_of_view == 30


def test_lights_with_a_position_choose_the_method(file):
    settings = rendering_settings(file, {})
    assert settings["method"] == "quotient"
    (scene,) = scenes_of(load(settings), settings)
    assert (settings["method"], scene.local) == ("chord-local", True)
    assert rendering_settings(scene, {})["method"] == "chord-local"
    assert rendering_settings("teapot", {"viewer": "near"})["method"] == "chord-local"


@pytest.mark.parametrize("options", [{"method": "linear"}, {"geometry": "hardware"}, {"gate": True}])
def test_lights_that_a_method_does_not_serve_are_told(file, options, monkeypatch):
    monkeypatch.setattr("blysk.sim.api.render._simulator", lambda *given: None)
    ready = prepare_rendering(rendering_settings(file, options))
    assert ready.loaded.ignored == ("1 light with a position (for --method chord-local)",)
    (light,) = ready.scenes[0].lights
    assert light.color == (1, 0, 0)
    assert ready.design.lights == 1


def test_lights_of_a_file_in_a_pipeline(file, monkeypatch):
    monkeypatch.setattr("blysk.sim.api.render._simulator", lambda *given: None)
    ready = prepare_rendering(rendering_settings(file, {}))
    assert (ready.design.method, ready.design.lights, ready.design.factors) == ("chord-local", 2, (0,))
    own = prepare_rendering(rendering_settings(file, {}), design=blysk.design())
    assert (own.design.method, len(own.scenes[0].lights)) == ("quotient", 1)
