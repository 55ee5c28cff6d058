"""Meshes of the live page, with their colours and textures."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blysk.bench.surfaces import grid, sphere
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.texture import Texture
from blysk.golden.reference.transfer import decode
from blysk.sim.meshes.teapot import teapot

__all__ = ["MESHES", "Body"]


@dataclass(frozen=True)
class Body:
    """A mesh of the page.

    Parameters
    ----------
    title : str
        Title on the page.
    make : callable
        Function that makes the mesh.
    views : int
        Cameras of the turntable.
    margin : float
        See `Camera.framing`.
    text : str
        Line about its surface.
    colored : bool
        Whether its vertices have colours.
    picture : callable, optional
        Function that makes the picture of its texture: codes of sRGB, a uint8 array of shape (height, width,
        3). The texture repeats the picture. It has levels, and the filter ``bilinear``.
    """

    title: str
    make: Callable[[], Mesh]
    views: int
    margin: float = 0.05
    text: str = "a surface of one colour"
    colored: bool = False
    picture: Callable[[], np.ndarray] | None = None

    @property
    def albedo(self) -> bool:
        """Whether only a module with an albedo draws it."""
        return self.colored or self.picture is not None

    @property
    def texture(self) -> Texture | None:
        """Its texture in linear light."""
        return None if self.picture is None else Texture(decode(self.picture() / 255))


def _square() -> Mesh:
    """Two triangles with normals that bend outwards. Some spans are as wide as the square."""
    corners = np.array([(x, y, 0.0) for y in (-1, 1) for x in (-1, 1)])
    return Mesh(corners, np.array([(0, 1, 3), (0, 3, 2)]), normalise(corners * 0.3 + (0, 0, 1)))


def _torus() -> Mesh:
    """A torus of 1024 triangles: colours that change around it, and three squares of texture around it."""
    across, around = np.meshgrid(np.linspace(0, 1, 17), np.linspace(0, 1, 33), indexing="ij")
    tube, ring = 2 * np.pi * across, 2 * np.pi * around
    normals = np.stack([np.cos(tube) * np.cos(ring), np.sin(tube), np.cos(tube) * np.sin(ring)], axis=-1)
    circle = np.stack([np.cos(ring), np.zeros_like(ring), np.sin(ring)], axis=-1)
    colors = (1 + np.cos(ring[..., np.newaxis] + np.arange(3) * 2 * np.pi / 3)) / 2
    places = np.stack([3 * around, across], axis=-1)
    mesh = grid(circle + 0.45 * normals, normalise(normals))
    return replace(mesh, colors=colors.reshape(-1, 3), coordinates=places.reshape(-1, 2))


def _tiles() -> np.ndarray:
    """A picture of 64x64 texels: a checker of tiles of 8x8 texels, with dark joints."""
    row, column = np.indices((64, 64))
    picture = np.array([(38, 96, 120), (233, 196, 106)], dtype=np.uint8)[(row // 8 + column // 8) % 2]
    picture[(row % 8 == 0) | (column % 8 == 0)] = 24
    return picture


MESHES = {
    "teapot": Body("Utah teapot", lambda: teapot(3000), 8),
    "sphere": Body("sphere", lambda: sphere(24), 1, 0.15),
    "square": Body("bent square", _square, 8, 0.1),
    "colored": Body(
        "torus, vertex colours",
        lambda: replace(_torus(), coordinates=np.zeros((0, 2))),
        1,
        0.1,
        "a colour at each vertex",
        colored=True,
    ),
    "textured": Body(
        "torus, texture",
        lambda: replace(_torus(), colors=np.zeros((0, 3))),
        1,
        0.1,
        "a texture of 64x64 texels with levels of detail, loaded again for each frame",
        picture=_tiles,
    ),
}
"""Meshes of the page, by name."""
