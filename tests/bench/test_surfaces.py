"""Smooth surfaces as meshes."""

import math

import numpy as np
import pytest

from blysk.bench.surfaces import sphere


def test_sphere():
    """The sphere is closed, has unit radius, and its faces go anticlockwise from outside.

    Its area is that of a sphere, except for chords.
    """
    mesh = sphere(24)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1)
    np.testing.assert_allclose(mesh.normals, mesh.vertices, atol=1e-15)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", across, a + b + c) >= -1e-12).all()
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(4 * math.pi, rel=0.01)
    assert np.einsum("ij,ij->i", across, a).sum() / 6 == pytest.approx(4 / 3 * math.pi, rel=0.01)
