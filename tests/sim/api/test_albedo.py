"""Scenes and pipelines of meshes with colours of vertices and textures."""

import dataclasses

import numpy as np
import pytest
from PIL import Image

import blysk
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.sim.api import render
from blysk.sim.api.options import SCENE
from blysk.sim.api.render import prepared
from blysk.sim.api.scene import load, scenes_of
from blysk.sim.api.settings import read_settings
from blysk.sim.errors import InputError, OptionError

SQUARE = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n"


@pytest.fixture(autouse=True)
def no_simulator(monkeypatch):
    """Designs and scenes are looked at, and not simulated."""
    monkeypatch.setattr(render, "_simulator", lambda *_: None)


def square(folder, texture=False, side=4):
    """A coloured square, perhaps with a checker of some texels."""
    text = SQUARE + "f 1/1 2/2 3/3 4/4\n"
    if texture:
        checker = 255 * (np.indices((side, side)).sum(axis=0) % 2).astype(np.uint8)
        Image.fromarray(checker).convert("RGB").save(folder / "a.png")
        (folder / "a.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd a.png\n")
        text = f"mtllib a.mtl\nusemtl a\n{text}"
    (folder / "a.obj").write_text(text)
    return folder / "a.obj"


@pytest.mark.parametrize("texture", [False, True])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_pipeline_has_the_albedo_of_the_mesh(tmp_path, texture, projection):
    path = square(tmp_path, texture)
    options = {"size": (40, 30), "projection": projection, "view": (0.5, 0.4, 1)}
    ready = prepared(path, None, "pysim", options)
    albedo, (scene,) = ready.design.albedo, ready.scenes
    assert (albedo.colors, albedo.texture is not None) == (True, texture)
    assert (albedo.perspective, ready.loaded.ignored) == (projection == "perspective", ())
    # Without a colour of the file, colours of vertices are on white.
    assert scene.materials[0].diffuse == (1, 1, 1)
    error = compare(scene, ready.design, model_frame(scene, ready.design)).total_error
    assert error.max_lsb < 0.75
    assert prepared(path, None, "pysim", {**options, "materials": "one"}).design.albedo is None


def test_a_mesh_of_the_interface_keeps_its_colours(tmp_path):
    mesh = blysk.scene(square(tmp_path)).mesh
    scene = blysk.scene(mesh)
    assert np.array_equal(scene.mesh.colors, mesh.colors)
    assert scene.materials[0].diffuse == (1, 1, 1)
    plain = blysk.scene(dataclasses.replace(mesh, colors=np.zeros((0, 3))))
    assert plain.materials[0].diffuse != (1, 1, 1)


def test_without_an_albedo_colours_are_told(tmp_path):
    """Then a default stays in place of white, as if the file had no colours."""
    path = square(tmp_path, texture=True)
    settings = read_settings(path, {}, SCENE)
    loaded = load(settings, albedo=False)
    assert loaded.ignored == ("vertex colours", "1 texture")
    (made,) = scenes_of(loaded, settings)
    assert (made.has_albedo, made.materials[0].texture) == (False, None)
    path.write_text(SQUARE.replace(" 1 0 0\n", "\n") + "f 1 2 3 4\n")
    hardware = {"geometry": "hardware", "size": (16, 12)}
    ready = prepared(path, None, "pysim", hardware)
    assert ready.design.albedo is None
    assert ready.loaded.ignored[-1] == "vertex colours"
    ready = prepared(path, blysk.design(), "pysim", {"size": (16, 12)})
    assert ready.loaded.ignored[-1] == "vertex colours"


def test_what_an_albedo_cannot_take_is_refused(tmp_path, monkeypatch):
    path = square(tmp_path, texture=True, side=128)
    lights = ["0,0,1,7,7,7"] * 3
    with pytest.raises(OptionError, match=r"lights: .* 16"):
        prepared(path, None, "pysim", {"lights": lights})
    with pytest.raises(OptionError, match="geometry hardware: hardware geometry draws no vertex colours"):
        prepared(blysk.scene(path), None, "pysim", {"geometry": "hardware"})
    monkeypatch.setattr(TexelMemory, "LARGEST", 2048)
    with pytest.raises(
        InputError, match=r"^textures: a texture of 128x128 texels needs .*; take smaller images"
    ):
        prepared(path, None, "pysim", {})
