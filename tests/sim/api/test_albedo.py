"""Scenes and pipelines of meshes with colours of vertices and textures."""

import dataclasses
import io
import json

import numpy as np
import pytest
from PIL import Image

import blysk
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.triangle_frame import sent_triangles
from blysk.golden.reference.renderer import render as render_of
from blysk.golden.render import Renderer
from blysk.sim.api import render
from blysk.sim.api.options import SCENE
from blysk.sim.api.render import prepared
from blysk.sim.api.scene import load, scenes_of
from blysk.sim.api.settings import read_settings
from blysk.sim.errors import InputError, OptionError

SQUARE = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n"


@pytest.fixture(autouse=True)
def no_simulator(monkeypatch):
    """Designs and scenes are checked without a simulation."""
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
    # If the file has no diffuse colour, colours of vertices multiply white.
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
    """Without an albedo the file counts as having no colours, so the default colour replaces white."""
    path = square(tmp_path, texture=True)
    settings = read_settings(path, {}, SCENE)
    loaded = load(settings, albedo=False)
    assert loaded.ignored == ("vertex colours", "1 texture")
    (made,) = scenes_of(loaded, settings)
    assert (made.has_albedo, made.materials[0].texture) == (False, None)
    path.write_text(SQUARE.replace(" 1 0 0\n", "\n") + "f 1 2 3 4\n")
    ready = prepared(path, blysk.design(), "pysim", {"size": (16, 12)})
    assert ready.loaded.ignored[-1] == "vertex colours"


def holed(folder, behind=True):
    """A plate whose image has a checker of holes, and perhaps a plate behind it."""
    codes = np.zeros((4, 4, 4), np.uint8)
    codes[..., 0], codes[..., 3] = 255, 255 * (np.indices((4, 4)).sum(axis=0) % 2)
    image = io.BytesIO()
    Image.fromarray(codes).save(image, "PNG")
    corners = np.array([[x, y, z] for z in (0, -1) for y in (0, 1) for x in (0, 1)], "<f4")
    places = np.tile(np.array([[0, 1], [1, 1], [0, 0], [1, 0]], "<f4"), (2, 1))
    parts = [corners.tobytes(), places.tobytes(), np.array([0, 1, 3, 0, 3, 2], "<u4").tobytes()]
    parts += [np.array([4, 5, 7, 4, 7, 6], "<u4").tobytes(), image.getvalue()]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    arrays = [("VEC3", 5126, 8), ("VEC2", 5126, 8), ("SCALAR", 5125, 6), ("SCALAR", 5125, 6)]
    look = {"metallicFactor": 0, "baseColorTexture": {"index": 0}}
    materials = [{"alphaMode": "MASK", "pbrMetallicRoughness": look}]
    materials += [{"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0, 1, 0, 1]}}]
    primitives = [
        {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0},
        {"attributes": {"POSITION": 0}, "indices": 3, "material": 1},
    ]
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": starts[-1], "uri": "a.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "accessors": [
            {"bufferView": k, "type": shape, "componentType": kind, "count": count}
            for k, (shape, kind, count) in enumerate(arrays)
        ],
        "images": [{"bufferView": 4, "mimeType": "image/png"}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": materials,
        "meshes": [{"primitives": primitives[: 1 + behind]}],
        "nodes": [{"mesh": 0}],
    }
    (folder / "a.bin").write_bytes(b"".join(parts))
    (folder / "a.gltf").write_text(json.dumps(document))
    return folder / "a.gltf"


def test_holes_show_what_is_behind(tmp_path):
    """The bit-accurate frame has the holes of the checker, which the test finds by its own texels."""
    options = {"size": (32, 24), "projection": "orthographic", "view": "front"}
    ready = prepared(holed(tmp_path), None, "pysim", options)
    (scene,) = ready.scenes
    assert (ready.loaded.ignored, len(scene.cutoffs)) == ((), 1)
    frame = model_frame(scene, ready.design)
    red, green, _ = np.moveaxis(frame.image.astype(int), -1, 0)
    side = np.ptp(scene.mesh.vertices[:, 0]) * scene.height / scene.camera.height
    row, column = (np.floor(4 * ((np.arange(n) + 0.5 - n / 2) / side + 0.5)) for n in (24, 32))
    seen = np.logical_and.outer((row >= 0) & (row < 4), (column >= 0) & (column < 4))
    assert (render_of(scene).mask == seen).all()
    solid = (np.add.outer(row, column) % 2 == 1) & seen
    assert ((red > green) == solid)[seen].all()
    assert frame.raster.dropped == (seen & ~solid).sum() > 100
    assert compare(scene, ready.design, frame).total_error.max_lsb < 0.75

    # A single plate lets the background show through its holes.
    (alone,) = prepared(holed(tmp_path, behind=False), None, "pysim", options).scenes
    assert (render_of(alone).mask == solid).all()


def test_hardware_geometry_has_no_holes(tmp_path):
    options = {"size": (16, 12), "geometry": "hardware"}
    path = holed(tmp_path)
    ready = prepared(path, None, "pysim", options)
    assert ready.loaded.ignored == ("1 cutoff of alpha",)
    assert ready.scenes[0].textures
    assert not ready.scenes[0].cutoffs
    scene = blysk.scene(path)
    plain = tuple(dataclasses.replace(of, texture=None) for of in scene.materials)
    scene = dataclasses.replace(scene, material=plain)
    with pytest.raises(
        OptionError, match=r"geometry hardware: hardware geometry drops no pixels by alpha; use"
    ):
        prepared(scene, None, "pysim", {"geometry": "hardware"})
    with pytest.raises(ValueError, match="hardware geometry drops no pixels by alpha; leave out the cutoff"):
        sent_triangles(scene, Renderer())


def test_what_an_albedo_cannot_take_is_refused(tmp_path, monkeypatch):
    path = square(tmp_path, texture=True, side=128)
    lights = ["0,0,1,7,7,7"] * 3
    with pytest.raises(OptionError, match=r"lights: .* 16"):
        prepared(path, None, "pysim", {"lights": lights})
    monkeypatch.setattr(TexelMemory, "LARGEST", 2048)
    with pytest.raises(
        InputError, match=r"^textures: a texture of 128x128 texels needs .*; take smaller images"
    ):
        prepared(path, None, "pysim", {})
