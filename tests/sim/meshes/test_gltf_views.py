"""Lights and cameras of glTF files: their places, their brightness, and damaged ones."""

import math

import numpy as np
import pytest

from blysk.golden.reference.light import Light
from blysk.sim.meshes.mesh import load_mesh

from .files import load, mesh_gltf, put

UNIT = "the unit of the lights' brightness (the brightest light counts 1)"
# A turn by 90 degrees about y: the axis -z becomes -x.
TURNED = [0, math.sqrt(0.5), 0, math.sqrt(0.5)]
# Its corners are (0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), and its middle (1/2, 1/2, 0).
SQUARE = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


def lit(*lights, nodes=None):
    """A square and lights, each with its own node."""
    placed = nodes or [{} for _ in lights]
    placed = [node | {"extensions": {"KHR_lights_punctual": {"light": k}}} for k, node in enumerate(placed)]
    document, buffer = mesh_gltf(
        SQUARE, (0, 1, 2, 2, 1, 3), None, [{"mesh": 0}, *placed], extensionsUsed=["KHR_lights_punctual"]
    )
    document["extensions"] = {"KHR_lights_punctual": {"lights": list(lights)}}
    document["scenes"][0]["nodes"] = list(range(1 + len(placed)))
    return document, buffer


def seen(*cameras, node=None, nodes=None):
    nodes = nodes or [{"camera": k, "translation": [0.5, 0.5, 4]} | (node or {}) for k in range(len(cameras))]
    document, buffer = mesh_gltf(SQUARE, (0, 1, 2, 2, 1, 3), None, [{"mesh": 0}, *nodes])
    document["cameras"] = list(cameras)
    document["scenes"][0]["nodes"] = list(range(1 + len(nodes)))
    return document, buffer


def test_directional_lights(tmp_path):
    one = load(tmp_path / "a.glb", lit({"type": "directional"}))
    assert (one.lights, one.ignored) == ((Light((0, 0, 1)),), ())
    lights = {"type": "directional", "intensity": 4}, {"type": "directional", "color": [1, 0.5, 0]}
    nodes = [{"rotation": TURNED}, {"matrix": [1, 0, 0, 0, 0, 0, -2, 0, 0, 2, 0, 0, 5, 5, 5, 1]}]
    two = load(tmp_path / "a.glb", lit(*lights, nodes=nodes))
    assert two.ignored == (UNIT,)
    # The second matrix turns z to 2 y. The light shines along -z of the node.
    for light, direction, color in zip(
        two.lights, ((1, 0, 0), (0, 1, 0)), ((1, 1, 1), (0.25, 0.125, 0)), strict=True
    ):
        assert np.allclose(light.direction, direction, atol=1e-12)
        assert light.color == color
    plain = load_mesh(str(tmp_path / "a.glb"), lights=0)
    assert (plain.lights, plain.ignored) == ((), ())


def test_nodes_pass_their_matrix_on(tmp_path):
    document, buffer = lit({"type": "point"}, nodes=[{"translation": [0, 0, 1]}])
    document["nodes"] += [{"scale": [2, 2, 2], "translation": [1, 0, 0], "rotation": TURNED, "children": [1]}]
    document["scenes"][0]["nodes"] = [0, 2]
    # (0, 0, 1) doubled is (0, 0, 2), turned (2, 0, 0), and moved (3, 0, 0).
    (light,) = load(tmp_path / "a.glb", (document, buffer)).lights
    assert np.allclose(light.position, (3, 0, 0))
    document["scenes"][0]["nodes"] = [0]
    assert load(tmp_path / "b.glb", (document, buffer)).lights == ()


def test_point_and_spot_lights(tmp_path):
    """Each corner is equally far from a light above the middle."""
    cone = {"innerConeAngle": math.radians(20), "outerConeAngle": math.radians(50)}
    lights = (
        {"type": "point", "intensity": 10},
        {"type": "spot", "intensity": 40, "spot": cone},
        {"type": "directional", "intensity": 0.5, "color": [0, 1, 0]},
    )
    nodes = [{"translation": [0.5, 0.5, math.sqrt(2)]}, {"translation": [0.5, 0.5, math.sqrt(7.5)]}, {}]
    loaded = load(tmp_path / "a.glb", lit(*lights, nodes=nodes))
    point, spot, sun = loaded.lights
    # The distances are sqrt(2.5) and sqrt(8): 4 lux and 5 lux.
    assert np.allclose(point.color, 0.8)
    assert np.allclose(point.attenuation, (0, 0, 1 / 2.5))
    assert np.allclose(spot.color, 1)
    assert np.allclose(spot.attenuation, (0, 0, 1 / 8))
    assert np.allclose(spot.spot, (0, 0, -1))
    assert np.allclose(spot.cone, (20, 50))
    assert np.allclose(sun.color, (0, 0.1, 0))
    corners = np.array(SQUARE, dtype=float)
    assert np.allclose(point.factor(corners), 1)
    # At twice the distance there is a quarter of the light.
    assert np.allclose(point.factor(np.array([[0.5, 0.5, math.sqrt(2) - 2 * math.sqrt(2.5)]])), 0.25)
    assert loaded.ignored == (UNIT,)
    one = load_mesh(str(tmp_path / "a.glb"), local=False)
    assert np.allclose(one.lights[0].color, (0, 1, 0))
    assert one.ignored == ("2 lights with a position (for --method chord-local)", UNIT)


def test_ranges(tmp_path):
    nodes = [{"translation": [0.5, 0.5, math.sqrt(2)]}] * 3
    lights = [{"type": "point", "range": reach} for reach in (10, 2, 1)]
    loaded = load(tmp_path / "a.glb", lit(*lights, nodes=nodes))
    # 1 - (r/R)^4 with r^2 = 2.5. The last light ends before the square.
    weights = np.array([1 - 6.25 / 1e4, 1 - 6.25 / 16])
    assert np.allclose([light.color[0] for light in loaded.lights], weights / weights[0])
    assert loaded.ignored == ("2 ranges of lights", UNIT)


def test_most_lights(tmp_path):
    lights = [{"type": "directional", "intensity": k} for k in range(20)]
    loaded = load(tmp_path / "a.glb", lit(*lights))
    assert [light.color[0] for light in loaded.lights] == [k / 19 for k in range(4, 20)]
    # The first light is off.
    assert loaded.ignored == ("3 lights after the 16 brightest", UNIT)
    assert [light.color[0] for light in load_mesh(str(tmp_path / "a.glb"), lights=1).lights] == [1]


BAD_LIGHTS = [
    None,
    7,
    {},
    {"type": "lamp"},
    {"type": "point", "color": [1, -1, 1]},
    {"type": "point", "color": [1, 1]},
    {"type": "point", "color": "red"},
    {"type": "point", "intensity": "x"},
    {"type": "point", "intensity": 1e999},
    {"type": "point", "range": 0},
    {"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}},
    {"type": "spot", "spot": 3},
    {"type": "spot", "spot": {"outerConeAngle": 4}},
]


@pytest.mark.parametrize("bad", BAD_LIGHTS)
def test_damaged_lights(tmp_path, bad):
    loaded = load(tmp_path / "a.glb", lit({"type": "directional"}, bad))
    assert (loaded.lights, loaded.ignored) == ((Light((0, 0, 1)),), ("1 damaged light",))


@pytest.mark.parametrize("index", [5, -1, "a", True, None, [0]])
def test_lights_that_are_not_there(tmp_path, index):
    document, buffer = lit({"type": "directional"})
    document["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = index
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == ("1 damaged light",)
    document["extensions"]["KHR_lights_punctual"] = index
    assert load(tmp_path / "a.glb", (document, buffer)).ignored == ("1 damaged light",)


PERSPECTIVE = {"type": "perspective", "perspective": {"yfov": math.radians(40), "znear": 0.5}}
ORTHOGRAPHIC = {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1.5, "znear": 0, "zfar": 9}}


def test_cameras(tmp_path):
    first = load(tmp_path / "a.glb", seen(PERSPECTIVE, ORTHOGRAPHIC))
    assert first.ignored == ("1 camera after the first",)
    camera = first.camera
    assert (camera.position, camera.target, camera.up) == ((0.5, 0.5, 4), (0.5, 0.5, 0), (0, 1, 0))
    assert (camera.projection, camera.near) == ("perspective", 0.5)
    assert camera.field_of_view == pytest.approx(40)
    # After the turn the camera at (4, 1/4, 1/2) looks along -x. The middle is 7/2 deep.
    node = {"translation": [4, 0.25, 0.5], "rotation": TURNED, "scale": [3, 3, 3]}
    camera = load(tmp_path / "a.glb", seen(ORTHOGRAPHIC, node=node)).camera
    assert np.allclose(camera.target, (0.5, 0.25, 0.5))
    assert np.allclose(camera.up, (0, 1, 0))
    assert (camera.projection, camera.height) == ("orthographic", 3)
    assert camera.near == pytest.approx(3.5e-3)
    plain = load_mesh(str(tmp_path / "a.glb"), camera=False)
    assert (plain.camera, plain.ignored) == (None, ())
    # The mesh is behind the camera.
    behind = load(tmp_path / "a.glb", seen(PERSPECTIVE, node={"translation": [0.5, 0.5, -4]})).camera
    assert np.allclose(behind.target, (0.5, 0.5, -8))


@pytest.mark.parametrize(
    "camera",
    [
        None,
        {},
        {"type": "fisheye", "fisheye": {}},
        {"type": "perspective"},
        {"type": "perspective", "perspective": {}},
        {"type": "perspective", "perspective": {"yfov": 4, "znear": 1}},
        {"type": "perspective", "perspective": {"yfov": "x", "znear": 1}},
        {"type": "perspective", "perspective": {"yfov": 1, "znear": 1e999}},
        {"type": "orthographic", "orthographic": {"ymag": 0}},
    ],
)
def test_damaged_cameras(tmp_path, camera):
    loaded = load(tmp_path / "a.glb", seen(camera))
    assert (loaded.camera, loaded.ignored) == (None, ("a damaged camera",))


@pytest.mark.parametrize("node", [{"scale": [0, 0, 0]}, {"translation": [0, 0, 1e9]}])
def test_cameras_at_no_place(tmp_path, node):
    assert load(tmp_path / "a.glb", seen(PERSPECTIVE, node=node)).ignored == ("a damaged camera",)
    put(tmp_path / "b.glb", lit({"type": "directional"}, nodes=[{"scale": [0, 0, 0]}]))
    assert load_mesh(str(tmp_path / "b.glb")).ignored == ("1 damaged light",)
