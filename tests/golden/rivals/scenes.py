"""Small scenes of few triangles, whose colours do not saturate."""

import numpy as np

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.scene import Scene


def small_scene(bend=0.25, exponent=40, lights=2, cells=3, **options):
    """A bent square of ``2 cells^2`` triangles in perspective; ``bend`` turns the normals at its corners."""
    count = cells + 1
    x, y = (of.ravel() for of in np.meshgrid(*[np.linspace(-1, 1, count)] * 2))
    vertices = np.stack([x, y, -0.5 * bend * (x * x + 2 * y * y)], axis=1)
    normals = normalise(np.stack([bend * x, 2 * bend * y, np.ones(count**2)], axis=1))
    corner = np.add.outer(count * np.arange(cells), np.arange(cells)).ravel()[:, np.newaxis]
    faces = np.concatenate([corner + of for of in ([0, 1, count + 1], [0, count + 1, count])])
    mesh = Mesh(vertices, faces, normals)
    return Scene(
        mesh=mesh,
        camera=Camera.framing(vertices, (0.2, 0.1, 1.0), "perspective", 4 / 3),
        width=64,
        height=48,
        material=Material((0.05,) * 3, (0.3, 0.2, 0.1), (0.25,) * 3, exponent),
        lights=[Light((-0.3, 0.4, 1.0)), Light((0.5, -0.2, 1.0))][:lights],
        **options,
    )
