"""Division of triangles, for hardware that takes a single level of a texture for each."""

from dataclasses import replace

import numpy as np

from blysk.golden.reference.geometry import Mesh
from blysk.golden.reference.scene import Scene

__all__ = ["EDGE_DEPTH_RATIO", "divided"]

EDGE_DEPTH_RATIO = 1.4
"""Largest ratio of the depths at the ends of an edge. The texel step goes with its square at most."""

_MOST_TIMES = 40
"""Most times that an edge is halved, more than any depth needs."""


def divided(scene: Scene) -> Scene:
    """The scene with triangles divided so that each needs hardly more than a level of its texture.

    Edges are halved in space until their ends have depths within `EDGE_DEPTH_RATIO`. An edge beyond a border
    of the picture, or before the near plane, stays whole. Only the ends decide. So triangles that share an
    edge share its parts, and no pixel between them is lost. A new vertex has the means of normals, colours
    and texture coordinates of the ends. So the surface stays the same. A scene without levels of textures, or
    without perspective, does not change.

    Parameters
    ----------
    scene : Scene
        The scene.

    Source: docs/theory/textures.md#levels.
    """
    has_levels = any(len(texture.levels) > 1 for texture in scene.textures.values())
    if scene.camera.projection != "perspective" or not has_levels:
        return scene
    mesh = scene.mesh
    for _ in range(_MOST_TIMES):
        finer = _halved(scene, mesh)
        if finer is mesh:
            break
        mesh = finer
    return scene if mesh is scene.mesh else replace(scene, mesh=mesh)


def _halved(scene: Scene, mesh: Mesh) -> Mesh:
    """The mesh with each edge halved whose depths are too far apart; the mesh itself if there is none."""
    near = scene.camera.near
    x, y, w, _ = scene.camera.homogeneous(mesh.vertices, scene.width, scene.height).T
    beyond = np.stack((x < 0, x > scene.width * w, y < 0, y > scene.height * w, w < near), axis=1)
    depth = np.maximum(w, near)
    ends = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2), axis=2)
    edges, edge = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    edge = edge.reshape(-1, 3)
    first, last = depth[edges].T
    wide = np.maximum(first, last) > EDGE_DEPTH_RATIO * np.minimum(first, last)
    wide &= ~beyond[edges].all(axis=1).any(axis=1)
    if not wide.any():
        return mesh
    middle = len(mesh.vertices) + np.cumsum(wide) - 1
    faces, source = _parts(mesh.faces, wide[edge], middle[edge])
    fields = {"faces": faces, "material": mesh.material[source]}
    for name in ("vertices", "normals", "colors", "coordinates", "alpha"):
        values = getattr(mesh, name)
        if len(values):
            fields[name] = np.concatenate((values, values[edges[wide]].mean(axis=1)))
    return replace(mesh, **fields)


def _parts(faces: np.ndarray, cut: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parts of faces, in the order of the faces, and the face of each.

    ``cut`` tells which edges of a face are halved, ``middle`` by which vertex; edge k goes from corner k on.
    """
    count = cut.sum(axis=1)
    kept, source = [faces[count == 0]], [np.flatnonzero(count == 0)]
    # With one or two halved edges, the first is the one behind an edge that is whole.
    for halves, patterns in (
        (1, ("axc", "xbc")),
        (2, ("axy", "xby", "ayc")),
        (3, ("axz", "xby", "zyc", "xyz")),
    ):
        chosen = np.flatnonzero(count == halves)
        turn = (cut[chosen] & ~np.roll(cut[chosen], 1, axis=1)).argmax(axis=1)
        order = (turn[:, np.newaxis] + np.arange(3)) % 3
        corners = np.take_along_axis(faces[chosen], order, axis=1)
        middles = np.take_along_axis(middle[chosen], order, axis=1)
        named = dict(zip("abcxyz", (*corners.T, *middles.T), strict=True))
        for pattern in patterns:
            kept.append(np.stack([named[name] for name in pattern], axis=1))
            source.append(chosen)
    of = np.concatenate(source)
    order = np.argsort(of, kind="stable")
    return np.concatenate(kept)[order], of[order]
