"""Fragments that a cutoff of alpha drops before the depth test, in float64."""

import numpy as np

from blysk.golden.reference.scene import Scene

__all__ = ["dropped_fragments"]

# Bound for the rounding of a sum of shares. An alpha counts as equal to the cutoff if it is less by this
# bound at most.
_ROUNDED = 2.0**-40


def dropped_fragments(
    scene: Scene, triangle: np.ndarray, shares: np.ndarray, level: np.ndarray
) -> np.ndarray:
    """Whether fragments have a smaller alpha than the cutoff of their material.

    Alpha is the product of the alpha of the material, of the vertices and of the texture. Vertices and
    texture are sampled as for the albedo: perspective-correct, with the texture's filter, wrap modes and
    level.

    Parameters
    ----------
    scene : Scene
        Mesh and materials.
    triangle : int array, shape (fragments,)
        Index into the mesh's faces.
    shares : float64 array, shape (fragments, 3)
        Perspective-correct barycentric coordinates.
    level : int array, shape (fragments,)
        Level of the texture, 0 if it has one level.

    Returns
    -------
    bool array, shape (fragments,)
        An alpha within 2^-40 of the cutoff is not smaller.

    Source: docs/theory/textures.md#alpha.
    """
    mesh = scene.mesh
    dropped = np.zeros(len(triangle), dtype=bool)
    material = mesh.material[triangle]
    for index, of in scene.cutoffs.items():
        assert of.cutoff is not None
        chosen = np.flatnonzero(material == index)
        corners, share = mesh.faces[triangle[chosen]], shares[chosen]
        alpha = np.full(len(chosen), of.alpha)
        if mesh.alpha.size:
            alpha *= np.einsum("fn,fn->f", share, mesh.alpha[corners])
        if of.texture is not None:
            places = np.einsum("fn,fnk->fk", share, mesh.coordinates[corners])
            alpha *= of.texture.sample_alpha(places, level[chosen])
        dropped[chosen] = alpha < of.cutoff - _ROUNDED
    return dropped
