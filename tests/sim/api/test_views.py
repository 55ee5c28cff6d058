"""Words for the view and the upright: a cube with a mark on one side, seen from the side that the word
names."""

import numpy as np
import pytest

from blysk import scene
from blysk.golden.reference.geometry import Mesh
from blysk.sim.api.options import SCENE
from blysk.sim.api.settings import read_settings
from blysk.sim.errors import OptionError

# The direction to the viewer, and the direction that is up in the picture.
VIEWS = {
    ("y", "front"): ((0, 0, 1), (0, 1, 0)),
    ("y", "back"): ((0, 0, -1), (0, 1, 0)),
    ("y", "right"): ((1, 0, 0), (0, 1, 0)),
    ("y", "left"): ((-1, 0, 0), (0, 1, 0)),
    ("y", "top"): ((0, 1, 0), (0, 0, -1)),
    ("y", "bottom"): ((0, -1, 0), (0, 0, 1)),
    ("z", "front"): ((0, -1, 0), (0, 0, 1)),
    ("z", "back"): ((0, 1, 0), (0, 0, 1)),
    ("z", "right"): ((1, 0, 0), (0, 0, 1)),
    ("z", "left"): ((-1, 0, 0), (0, 0, 1)),
    ("z", "top"): ((0, 0, 1), (0, 1, 0)),
    ("z", "bottom"): ((0, 0, -1), (0, -1, 0)),
    ("x", "front"): ((0, 0, 1), (1, 0, 0)),
    ("x", "right"): ((0, -1, 0), (1, 0, 0)),
}


@pytest.mark.parametrize(("up", "view"), VIEWS, ids="-".join)
def test_words(up, view):
    viewer, upright = VIEWS[up, view]
    camera = scene("teapot", triangles=64, up=up, view=view).camera
    np.testing.assert_allclose(camera.viewer, viewer, atol=1e-12)
    np.testing.assert_allclose(camera.axes[1], upright, atol=1e-12)


def test_words_are_those_of_their_vectors():
    words = scene("teapot", triangles=64, up="z", view="front").camera
    vectors = scene("teapot", triangles=64, up=(0, 0, 1), view=(0, -1, 0)).camera
    assert words == vectors


def test_default_view_turns_with_the_upright():
    """A mesh with z up, and the same mesh turned so that y is up, give the same picture."""
    rng = np.random.default_rng(3)
    vertices = rng.normal(size=(12, 3))
    normals = np.tile([0.0, 0.0, 1.0], (12, 1))
    faces = np.arange(12).reshape(4, 3)
    # x stays, z becomes y, and -y becomes z.
    turned = vertices[:, [0, 2, 1]] * [1, 1, -1]
    first = scene(Mesh(vertices, faces, normals), up="z").camera
    second = scene(Mesh(turned, faces, normals)).camera
    np.testing.assert_allclose(first.view(vertices / 4), second.view(turned / 4), atol=1e-12)


def test_default_view_is_as_it_was():
    assert read_settings("teapot", {}, SCENE)["view"] == (0.4, 0.5, 1.0)
    assert read_settings("teapot", {"up": "y"}, SCENE)["view"] == (0.4, 0.5, 1.0)
    assert read_settings("teapot", {"up": (0, 0, 1), "view": (1, 2, 3)}, SCENE)["view"] == (1.0, 2.0, 3.0)


def test_slanting_upright():
    camera = scene("teapot", triangles=64, up=(0, 1, 1), view="right").camera
    np.testing.assert_allclose(camera.viewer, (1, 0, 0), atol=1e-12)
    front = scene("teapot", triangles=64, up=(0, 1, 1.001), view="front").camera
    assert abs(np.dot(front.viewer, np.array([0, 1, 1.001]))) < 1e-12


def test_scene_file(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text('mesh.file = "teapot"\nmesh.triangles = 64\ncamera.view = "top"\ncamera.up = "z"\n')
    assert scene(str(path)).camera == scene("teapot", triangles=64, view="top", up="z").camera
    # An option replaces the file's value.
    assert scene(str(path), view="left").camera == scene("teapot", triangles=64, view="left", up="z").camera


@pytest.mark.parametrize(("name", "value"), [("view", "above"), ("up", "w"), ("up", "front"), ("view", "x")])
def test_unknown_words(name, value):
    with pytest.raises(
        OptionError, match='not a direction; give three numbers or "X,Y,Z", a vector other than 0, or one of'
    ):
        scene("teapot", **{name: value})
