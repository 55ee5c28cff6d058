"""Scenes for tests of the renderer, and their rays and colours, without any code of the renderer."""

import math
from dataclasses import replace

import numpy as np

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene

MATERIAL = Material((0.1, 0.2, 0.3), (0.6, 0.5, 0.4), (0.5, 0.4, 0.6), 20)
LIGHTS = (Light((1, 2, 3), (0.9, 0.8, 0.7)), Light((-2, 1, 1), (0.2, 0.3, 0.5)))
BACKGROUND = (0.25, 0.5, 0.75)
SEVERAL = (
    MATERIAL,
    Material((0.3, 0, 0), (0.1, 0.9, 0.2), (0.8, 0, 0), 3),
    Material((0, 0, 0), (1,) * 3, (1,) * 3, 200),
)
"""Materials of a mesh."""


def ball(segments=12, rings=7):
    """An ellipsoid with its own normals. It is open at the poles, so that its inside is visible, too."""
    u, v = np.meshgrid(
        np.arange(segments) * 2 * np.pi / segments, np.linspace(0.5, np.pi - 0.3, rings), indexing="ij"
    )
    unit = np.stack((np.cos(u) * np.sin(v), np.cos(v), np.sin(u) * np.sin(v)), axis=-1).reshape(-1, 3)
    first = (np.arange(segments)[:, np.newaxis] * rings + np.arange(rings - 1)).reshape(-1)
    second = (first + rings) % (segments * rings)
    faces = np.concatenate(
        (np.column_stack((first, second, second + 1)), np.column_stack((first, second + 1, first + 1)))
    )
    # Seen from outside, corners go anticlockwise.
    return Mesh(unit * (1, 0.7, 1.2), faces[:, ::-1].copy(), normalise(unit / (1, 0.7, 1.2)))


def soup(seed, count=14):
    """Triangles that cross each other."""
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1, 1, (3 * count, 3))
    return Mesh(
        vertices,
        np.arange(3 * count).reshape(count, 3),
        normalise(rng.normal((0, 0, 2), size=vertices.shape)),
    )


def scene_of(mesh, camera, width=44, height=33, **options):
    return Scene(mesh, camera, width, height, MATERIAL, LIGHTS, background=BACKGROUND, **options)


INSIDE = Camera((0.1, 0.05, 0.3), (0, 0.1, -1), projection="perspective", field_of_view=80, near=0.2)
SCENES = {
    "orthographic": scene_of(ball(), Camera.framing(ball().vertices, (0.4, 0.9, 1), "orthographic", 4 / 3)),
    "perspective": scene_of(
        ball(), Camera.framing(ball().vertices, (0.4, 0.9, 1), "perspective", 4 / 3, field_of_view=75)
    ),
    "crossing": scene_of(soup(1), Camera((0.3, 0.2, 3), (0, 0, 0), height=2.0)),
    "crossing in perspective": scene_of(
        soup(2), Camera((0.3, 0.2, 2.5), (0, 0, 0), projection="perspective", field_of_view=40)
    ),
    # Triangles in front of, behind and across the near plane. Some are seen from behind.
    "near plane": scene_of(soup(3), INSIDE),
    "near plane, many": scene_of(soup(4, 40), INSIDE),
    # These are so near that their corners project millions of pixels away.
    "guard band": scene_of(soup(5, 40), replace(INSIDE, near=1e-7)),
    "orthographic near plane": scene_of(soup(6, 40), Camera((0, 0, 0.1), (0, 0, -1), height=2.0, near=0.2)),
}
LAMPS = (Light(position=(1.5, 1, 2), color=(0.9, 0.8, 0.7)), Light((-2, 1, 1), (0.2, 0.3, 0.5)))
SCENES |= {
    "point light": replace(SCENES["orthographic"], lights=LAMPS),
    "near viewer": replace(SCENES["perspective"], viewer="near"),
    "point light and near viewer": replace(SCENES["crossing in perspective"], lights=LAMPS, viewer="near"),
    "point light, near viewer and near plane": replace(
        SCENES["near plane, many"], lights=LAMPS, viewer="near"
    ),
}


def cast(scene, dx=0.0, dy=0.0):
    """For the ray through every pixel centre, moved by (dx, dy) pixels: the nearest triangle or -1, and
    shares."""
    camera = scene.camera
    forward = np.subtract(camera.target, camera.position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    up = np.cross(right, forward)
    column, row = np.meshgrid(np.arange(scene.width) + 0.5 + dx, np.arange(scene.height) + 0.5 + dy)
    across, above = column - scene.width / 2, scene.height / 2 - row
    if camera.projection == "perspective":
        unit = 2 * math.tan(math.radians(camera.field_of_view) / 2) / scene.height
        origin = np.broadcast_to(camera.position, (*column.shape, 3))
        direction = forward + unit * (across[..., np.newaxis] * right + above[..., np.newaxis] * up)
    else:
        unit = camera.height / scene.height
        origin = camera.position + unit * (across[..., np.newaxis] * right + above[..., np.newaxis] * up)
        direction = np.broadcast_to(forward, (*column.shape, 3))
    # For every pixel and triangle, origin + depth direction = a + s (b - a) + t (c - a).
    a, b, c = np.moveaxis(scene.mesh.vertices[scene.mesh.faces], 1, 0)
    matrices = np.empty((*column.shape, len(a), 3, 3))
    matrices[..., 0] = b - a
    matrices[..., 1] = c - a
    matrices[..., 2] = -direction[:, :, np.newaxis]
    offset = origin[:, :, np.newaxis] - a
    s, t, depth = np.moveaxis(np.linalg.solve(matrices, offset[..., np.newaxis])[..., 0], -1, 0)
    hit = (s >= 0) & (t >= 0) & (s + t <= 1) & (depth >= camera.near)
    depth = np.where(hit, depth, np.inf)
    nearest = depth.argmin(axis=-1)[..., np.newaxis]
    s, t = np.take_along_axis(s, nearest, -1), np.take_along_axis(t, nearest, -1)
    shares = np.concatenate((1 - s - t, s, t), axis=-1)
    return np.where(hit.any(axis=-1), nearest[..., 0], -1), shares


def color_by_hand(normals, viewer, shine=lambda cosine: np.maximum(cosine, 0) ** MATERIAL.exponent):
    """Colours of unit normals under distant lights, saturated, without code of the project's lighting."""
    normals, color = np.asarray(normals), np.array(MATERIAL.ambient)
    for light in LIGHTS:
        half = np.add(light.direction, viewer)
        cosine = normals @ (half / np.linalg.norm(half))
        lit = (normals @ np.array(light.direction))[..., np.newaxis]
        term = np.multiply(MATERIAL.diffuse, lit) + np.multiply(
            MATERIAL.specular, shine(cosine)[..., np.newaxis]
        )
        color = color + np.where(lit > 0, light.color * term, 0)
    return np.clip(color, 0, 1)
