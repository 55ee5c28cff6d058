"""Wrong meshes are refused, with the reason."""

import numpy as np
import pytest

from blysk.golden.reference.geometry import Mesh

VERTICES = np.eye(3)
NO_MATERIAL = "material must be an index of 0 or more for each of the 1 faces, or empty"


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"vertices": np.zeros((3, 2))}, r"vertices must have shape \(count, 3\), not \(3, 2\)"),
        ({"faces": np.arange(3)}, r"faces must have shape \(count, 3\), not \(3,\)"),
        ({"normals": np.zeros((4, 3))}, "there must be one normal a vertex, not 4 for 3"),
        ({"faces": np.array([[0, 1, 3]])}, "faces must index the 3 vertices"),
        ({"faces": np.array([[0, 1, -1]])}, "faces must index the 3 vertices"),
        ({"vertices": np.full((3, 3), np.inf)}, "vertices and normals must be finite"),
        ({"normals": np.full((3, 3), np.nan)}, "vertices and normals must be finite"),
        ({"material": np.zeros(2, int)}, NO_MATERIAL),
        ({"material": np.zeros((1, 1), int)}, NO_MATERIAL),
        ({"material": np.array([-1])}, NO_MATERIAL),
        ({"material": None}, NO_MATERIAL),
        ({"colors": np.zeros((2, 3))}, r"colors must have shape \(3, 3\), not \(2, 3\)"),
        ({"colors": np.full((3, 3), 1.5)}, "colors must be 0 to 1"),
        ({"colors": np.full((3, 3), np.nan)}, "colors must be 0 to 1"),
        ({"coordinates": np.zeros((3, 3))}, r"coordinates must have shape \(3, 2\), not \(3, 3\)"),
        ({"coordinates": np.full((3, 2), np.inf)}, "coordinates must be numbers within 1048576"),
    ],
)
def test_bad_arrays_are_refused(given, message):
    arrays = {"vertices": VERTICES, "faces": np.array([[0, 1, 2]]), "normals": VERTICES} | given
    with pytest.raises(ValueError, match=f"^{message}$"):
        Mesh(**arrays)


def test_a_mesh_has_one_material_unless_told():
    mesh = Mesh(VERTICES, np.array([[0, 1, 2], [2, 1, 0]]), VERTICES)
    assert mesh.material.tolist() == [0, 0]
