"""Lights and cameras of glTF files, placed in the world."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light import Light, Triple
from blysk.sim.meshes.gltf_parts import extension_of
from blysk.sim.meshes.materials import Found

__all__ = ["GltfLight", "GltfViews", "gltf_views", "placed_camera", "placed_lights"]

_LIGHTS = "KHR_lights_punctual"
# The share of the vertices that are nearer to a light than the distance r of `placed_lights`.
_NEAR = 0.25
# The farthest place of a camera from the middle of the mesh, in sizes of the mesh.
_FARTHEST = 1e6


class GltfLight(NamedTuple):
    """A light of a document in the world."""

    kind: str
    """``"directional"``, ``"point"`` or ``"spot"``."""
    color: np.ndarray
    """Linear colour times intensity, in lux (directional) or candela."""
    position: np.ndarray
    axis: np.ndarray
    """Direction in which it shines."""
    range: float
    """Distance from which on it gives no light."""
    cone: tuple[float, float]
    """Inner and outer angle, degrees."""


class GltfViews(NamedTuple):
    """Lights and cameras of the scene of a document."""

    lights: list[GltfLight]
    cameras: list[tuple[np.ndarray, Any]]
    """Matrix into the world, and JSON object, of each camera."""


def gltf_views(document: dict, lights: bool, camera: bool, found: Found) -> GltfViews:
    """Lights and cameras of a scene's nodes.

    Parameters
    ----------
    document : dict
        After `complete_scene`.
    lights, camera : bool
        Whether to read lights, and cameras. If not, the result has none, and nothing is recorded.
    found : Found
        Records damaged lights.
    """
    cameras, texts = document.get("cameras"), extension_of(document, _LIGHTS).get("lights")
    views = GltfViews([], [])
    for node, matrix in _frames(document):
        if camera and "camera" in node:
            views.cameras.append((matrix, _entry(cameras, node["camera"])))
        if lights and "light" in extension_of(node, _LIGHTS):
            text = _entry(texts, extension_of(node, _LIGHTS)["light"])
            try:
                views.lights.append(_light(text, matrix))
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
                found.tell("damaged light", "damaged lights")
    return views


def _entry(entries: Any, index: Any) -> Any:
    """An entry of a list; ``None`` if it is not there."""
    is_place = isinstance(entries, list) and type(index) is int and 0 <= index < len(entries)
    return entries[index] if is_place else None


def _frames(document: dict) -> Iterator[tuple[dict, np.ndarray]]:
    """Each node of the scene with its matrix into the world, 4 by 4."""
    nodes = document["nodes"]
    frames = [(index, np.eye(4)) for index in document["scenes"][document["scene"]].get("nodes", [])]
    for index, matrix in frames:
        matrix = matrix @ _matrix(nodes[index])
        yield nodes[index], matrix
        frames += [(child, matrix) for child in nodes[index].get("children", [])]


def _matrix(node: dict) -> np.ndarray:
    """Matrix of a node; NaN if its numbers are damaged."""
    try:
        if "matrix" in node:
            return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        x, y, z, w = normalise(node.get("rotation", (0, 0, 0, 1))).tolist()
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
        matrix[:3, 3] = node.get("translation", (0, 0, 0))
    except (TypeError, ValueError):
        return np.full((4, 4), np.nan)
    return matrix


def _light(text: dict, matrix: np.ndarray) -> GltfLight:
    """A light. A damaged light raises one of several exceptions."""
    kind, spot = text["type"], text.get("spot", {})
    if kind not in ("directional", "point", "spot"):
        raise ValueError
    color = np.array(text.get("color", (1, 1, 1)), dtype=np.float64) * float(text.get("intensity", 1))
    reach = float(text.get("range", math.inf))
    cone = float(spot.get("innerConeAngle", 0)), float(spot.get("outerConeAngle", math.pi / 4))
    axis, position = normalise(-matrix[:3, 2]), matrix[:3, 3]
    finite = np.isfinite([*color, *axis, *position]).all() and (color >= 0).all() and color.shape == (3,)
    if not (finite and axis.any() and reach > 0 and 0 <= cone[0] < cone[1] <= math.pi):
        raise ValueError
    return GltfLight(kind, color, position, axis, reach, tuple(map(math.degrees, cone)))


def placed_lights(
    lights: list[GltfLight], vertices: np.ndarray, most: int, local: bool, found: Found
) -> tuple[Light, ...]:
    """Lights in our unit of brightness: the brightest counts 1.

    Lux and candela have no largest value. So lights are compared by their illuminance E. It is ``E = I`` for
    a directional light, and ``E = I / r^2`` for a point light. A quarter of the vertices is nearer to the
    light than r. A range R multiplies E by ``1 - (r/R)^4``. The largest E of any channel becomes 1. At
    distance d a point light is multiplied by ``(r/d)^2``, limited to 1.

    Parameters
    ----------
    lights : list of GltfLight
        The lights.
    vertices : float64 array, shape (V, 3)
        The mesh.
    most : int
        Largest number of lights. Of more lights the brightest are taken.
    local : bool
        Whether to take lights with a position.
    found : Found
        Records that the brightness has another unit, that a range has its effect at the distance r only, and
        the number of lights that are left out.

    Returns
    -------
    tuple of Light
        In the order of the nodes.
    """
    if not local:
        distant = [light for light in lights if light.kind == "directional"]
        one, many = (f"{what} with a position (for --method chord-local)" for what in ("light", "lights"))
        found.tell(one, many, len(lights) - len(distant))
        lights = distant
    placed: list[tuple[np.ndarray, GltfLight, float]] = []
    for light in lights:
        distance, lux = 1.0, light.color
        if light.kind != "directional":
            distances = np.linalg.norm(vertices - light.position, axis=1)
            distance = float(np.quantile(distances, _NEAR)) or float(distances.max())
            lux = light.color / distance**2 * max(1 - (distance / light.range) ** 4, 0)
            found.tell("range of a light", "ranges of lights", int(light.range < 2 * distances.max()))
        placed.append((lux, light, distance))
    placed = [each for each in placed if each[0].max() > 0]
    if not placed:
        return ()
    brightest = max(float(lux.max()) for lux, _, _ in placed)
    order = np.argsort([-lux.max() for lux, _, _ in placed], kind="stable")[:most]
    one, many = (f"{what} after the {most} brightest" for what in ("light", "lights"))
    found.tell(one, many, len(placed) - len(order))
    if brightest != 1 or any(light.kind != "directional" for _, light, _ in placed):
        found.tell("the unit of the lights' brightness (the brightest light counts 1)")
    return tuple(_made(placed[k], brightest) for k in sorted(order.tolist()))


def _made(placed: tuple[np.ndarray, GltfLight, float], brightest: float) -> Light:
    lux, light, distance = placed
    color = _triple(lux / brightest)
    if light.kind == "directional":
        return Light(_triple(-light.axis), color)
    spot, cone = (_triple(light.axis), light.cone) if light.kind == "spot" else (None, None)
    return Light(None, color, _triple(light.position), (0.0, 0.0, distance**-2), spot, cone)


def placed_camera(cameras: list[tuple[np.ndarray, Any]], vertices: np.ndarray, found: Found) -> Camera | None:
    """The first camera, in the mesh's unit; ``None`` if there is no camera, or the first is damaged.

    Its target is the point on its axis at the depth of the middle of the mesh.

    Parameters
    ----------
    cameras : list of array and object
        Matrix into the world, and JSON object, of each camera.
    vertices : float64 array, shape (V, 3)
        The mesh.
    found : Found
        Records further cameras, and a damaged first camera.
    """
    if not cameras:
        return None
    found.tell("camera after the first", "cameras after the first", len(cameras) - 1)
    matrix, text = cameras[0]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle, size = low + (high - low) / 2, float(np.linalg.norm(high - low))
    try:
        return _camera(text, matrix, middle, size)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        found.tell("a damaged camera")
        return None


def _camera(text: dict, matrix: np.ndarray, middle: np.ndarray, size: float) -> Camera:
    """A camera. A damaged camera raises one of several exceptions."""
    kind = text["type"]
    values = text[kind]
    position, forward, up = matrix[:3, 3], normalise(-matrix[:3, 2]), normalise(matrix[:3, 1])
    away = float(np.linalg.norm(middle - position))
    if not (away < _FARTHEST * size and np.linalg.norm(np.cross(forward, up)) > 1e-6):
        raise ValueError
    depth = float((middle - position) @ forward)
    distance = depth if depth > 1e-3 * size else max(away, 1e-3 * size)
    # Depths have few bits. So the near plane is not nearer than needed.
    near = max(float(values.get("znear", 0)), distance / 1000)
    view = {"field_of_view": math.degrees(values["yfov"])} if kind == "perspective" else {}
    view |= {"height": 2 * float(values["ymag"])} if kind == "orthographic" else {}
    target = _triple(position + distance * forward)
    return Camera(_triple(position), target, _triple(up), kind, near=near, **view)


def _triple(vector: np.ndarray) -> Triple:
    x, y, z = (vector + 0.0).tolist()
    return x, y, z
