import math

import numpy as np
import pytest

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.geometry import normalise


def matrix(camera, width, height):
    """The way from the world to pixels as a 4x4 matrix of the textbooks: look-at, projection, viewport."""
    back = np.subtract(camera.position, camera.target)
    back = back / np.linalg.norm(back)
    right = np.cross(camera.up, back)
    right = right / np.linalg.norm(right)
    look = np.eye(4)
    look[:3, :3] = right, np.cross(back, right), back
    look[:3, 3] = -look[:3, :3] @ camera.position
    project = np.eye(4)
    if camera.projection == "perspective":
        focal = 1 / math.tan(math.radians(camera.field_of_view) / 2)
        project[:2, :2] = np.diag((focal * height / width, focal))
        project[3] = 0, 0, -1, 0
    else:
        project[:2, :2] = np.diag((2 / camera.height * height / width, 2 / camera.height))
    viewport = np.eye(4)
    viewport[0, [0, 3]] = width / 2
    viewport[1, [1, 3]] = -height / 2, height / 2
    return viewport @ project @ look


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_projection_against_matrices(projection):
    camera = Camera((3, 4, 5), (0.5, 0.2, 0), (0.1, 1, 0.2), projection, height=7.0, field_of_view=50)
    points = np.random.default_rng(12).uniform(-1, 1, (100, 3))
    ones = np.concatenate((points, np.ones((100, 1))), axis=1)
    expected = ones @ matrix(camera, 640, 480).T
    found = camera.project(points, 640, 480)
    assert found[:, :2] == pytest.approx(expected[:, :2] / expected[:, 3:], abs=1e-10)
    depth = (points - camera.position) @ -camera.viewer
    assert found[:, 2] == pytest.approx(depth, abs=1e-12)
    homogeneous = camera.homogeneous(points, 640, 480)
    assert homogeneous[:, :2] / homogeneous[:, 2:3] == pytest.approx(found[:, :2], abs=1e-12)


def test_target_is_the_middle_and_up_is_up():
    for projection in ("orthographic", "perspective"):
        camera = Camera((1, 2, 3), (0, 0, 0), projection=projection)
        assert camera.project([0, 0, 0], 100, 50)[:2] == pytest.approx((50, 25))
        above = camera.project([0, 0.1, 0], 100, 50)
        assert above[0] == pytest.approx(50)
        assert above[1] < 25
    assert Camera((0, 0, 5), (0, 0, 0)).viewer == pytest.approx((0, 0, 1))


def test_picture_height():
    camera = Camera((0, 0, 5), (0, 0, 0), height=4)
    assert camera.project([0, 2, 0], 30, 40)[1] == pytest.approx(0)
    camera = Camera((0, 0, 5), (0, 0, 0), projection="perspective", field_of_view=90)
    assert camera.project([0, -5, 0], 30, 40)[1] == pytest.approx(40)


@pytest.mark.parametrize("direction", [(0, 1, 0), (0, -2, 0), (1e-9, 1, 0)])
def test_line_of_sight_parallel_to_up(direction):
    camera = Camera(direction, (0, 0, 0))
    axes = camera.axes
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(axes) == pytest.approx(-1)
    assert axes[2] == pytest.approx(-normalise(direction), abs=1e-15)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("margin", [0, 0.05, 0.2])
def test_framing_fits_all(projection, margin):
    rng = np.random.default_rng(13)
    for width, height in ((400, 300), (100, 300)):
        vertices = rng.normal(size=(200, 3)) * (1, 3, 0.5) + 10
        camera = Camera.framing(
            vertices, rng.normal(size=3), projection, width / height, field_of_view=70, margin=margin
        )
        pixels = camera.project(vertices, width, height)
        share = pixels[:, :2] / (width, height)
        # All vertices are inside the margin, and one lies on it.
        assert np.abs(share - 0.5).max() == pytest.approx(0.5 - margin, abs=1e-9)
        assert (pixels[:, 2] > camera.near).all()
        assert camera.target == pytest.approx((vertices.min(axis=0) + vertices.max(axis=0)) / 2)


def test_framing_flat_and_thin_objects():
    sheet = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 1]])
    for projection in ("orthographic", "perspective"):
        for direction in ((0, 0, 1), (0, 1, 0), (1, 0, 0)):
            camera = Camera.framing(sheet, direction, projection)
            pixels = camera.project(sheet, 400, 300)
            assert ((pixels[:, :2] > 0) & (pixels[:, :2] < (400, 300))).all()
            assert (pixels[:, 2] > camera.near).all()
        stick = np.array([[0.0, 0, 0], [0, 0, 2]])
        assert (Camera.framing(stick, (0, 0, 1), projection).view(stick)[:, 2] > 0).all()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"target": (0, 0, 1)}, "position and target must differ"),
        ({"up": (0, 0, 0)}, "a camera's up must not be 0"),
        ({"projection": "fisheye"}, "projection must be one of orthographic, perspective, not 'fisheye'"),
        ({"height": 0}, "a camera's height must be finite and greater than 0, not 0"),
        ({"near": -1}, "a camera's near must be finite and greater than 0, not -1"),
        ({"field_of_view": 180}, "field_of_view must be greater than 0 and less than 180 degrees, not 180"),
        ({"position": (0, 0)}, "a camera's position must be three finite numbers"),
        ({"position": (0, 0, math.inf)}, "a camera's position must be three finite numbers"),
    ],
)
def test_refusals(values, text):
    with pytest.raises(ValueError, match=text):
        Camera(**{"position": (0, 0, 1), "target": (0, 0, 0), **values})


def test_framing_refusals():
    box = np.eye(3)
    with pytest.raises(ValueError, match="vertices must not all be in one place"):
        Camera.framing(np.ones((3, 3)), (0, 0, 1))
    with pytest.raises(ValueError, match="direction must not be 0"):
        Camera.framing(box, (0, 0, 0))
    with pytest.raises(ValueError, match=r"margin must be at least 0 and less than 0.5, not 0.5"):
        Camera.framing(box, (0, 0, 1), margin=0.5)
    with pytest.raises(ValueError, match="aspect must be finite and greater than 0, not 0"):
        Camera.framing(box, (0, 0, 1), aspect=0)
    with pytest.raises(ValueError, match=r"vertices must have shape \(count, 3\)"):
        Camera.framing(np.zeros((0, 3)), (0, 0, 1))
    with pytest.raises(ValueError, match="vertices must be finite"):
        Camera.framing(np.full((2, 3), np.nan), (0, 0, 1))
    with pytest.raises(ValueError, match="points must be in front of a perspective camera"):
        Camera((0, 0, 1), (0, 0, 0), projection="perspective").project([0, 0, 2], 4, 4)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_camera_in_another_unit_shows_the_same_picture(projection):
    camera = Camera((1, 2, 30), (0, 1, 0), projection=projection, height=9, field_of_view=40, near=0.5)
    points = np.array([[0, 0, 0], [3, 1, -2], [-1, 4, 5.0]])
    scaled = camera.scaled(-5)
    pixels = camera.project(points, 80, 60)
    assert np.array_equal(scaled.project(points / 32, 80, 60), pixels / (1, 1, 32))
    assert scaled.near == 0.5 / 32
    with pytest.raises(OverflowError):
        camera.scaled(2000)
