"""Frame of a light: the identities of the quotient form, against N·H, R·V and N·L of unit vectors."""

import numpy as np
import pytest

from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.light_frame import light_frame, squared_sine


def _pairs():
    """L and V: anywhere, equal, opposite, and nearly equal or opposite."""
    rng = np.random.default_rng(7)
    for _ in range(50):
        yield tuple(normalise(rng.normal(size=(2, 3))))
    axis = normalise(rng.normal(size=3))
    for distance in (0.0, 1e-14, 1e-9, 1e-5, 1e-2):
        near = normalise(axis + distance * rng.normal(size=3))
        yield axis, near
        yield axis, -near


@pytest.mark.parametrize("mirror", [False, True])
def test_identities(mirror):
    """For vectors of any length, the quotients of squares are the sines of N·H and R·V, and the line gives
    N·L."""
    rng = np.random.default_rng(8)
    vectors = rng.normal(size=(500, 3)) * 10.0 ** rng.uniform(-6, 6, (500, 1))
    for light, viewer in _pairs():
        frame = light_frame(light, viewer)
        np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame.axes) > 0
        np.testing.assert_allclose(frame.axes @ light, frame.direction, atol=1e-12)
        np.testing.assert_allclose(frame.axes @ viewer, frame.direction * (-1, 1, 1), atol=1e-12)
        normal = normalise(vectors)
        turned = vectors @ frame.axes.T
        cosine = normal @ light
        np.testing.assert_allclose(
            (turned @ frame.direction) / np.linalg.norm(vectors, axis=1), cosine, atol=1e-12
        )
        if mirror:
            expected = (1 - (2 * cosine * (normal @ viewer) - light @ viewer)) / 2
        elif np.linalg.norm(light + viewer) > 1e-6:
            expected = 1 - np.square(normal @ normalise(light + viewer))
        else:
            continue
        np.testing.assert_allclose(squared_sine(turned, frame, mirror), expected, atol=3e-10)


def test_exponents_of_phong_and_blinn_in_the_space_of_normals():
    """Near the peak R·V^n is as wide as N·H^(4 n) in the plane of L and V, and as N·H^(4 n cos^2 a) across
    it."""
    frame = light_frame(normalise(np.array([1.0, 0.2, 0.4])), normalise(np.array([-0.3, 0.1, 1.0])))
    for direction, ratio in (((1, 0), 4.0), ((0, 1), 4 * frame.cosine**2)):
        vector = np.array([*np.multiply(direction, 1e-3), 1.0])
        mirror, halfway = (squared_sine(vector, frame, kind) for kind in (True, False))
        phong, blinn = np.log1p(-2 * mirror), np.log1p(-halfway) / 2
        assert phong / blinn == pytest.approx(ratio, rel=1e-5)
