"""Ways of Phong and Blinn compared, counts by hand, half-widths against formulas."""

import base64
import io
import math

import numpy as np
import pytest
from PIL import Image

from blysk.bench.report.phong_blinn import (
    PIXELS,
    WAYS,
    exponent_at,
    exponent_of_width,
    frame_times,
    half_angle,
    operations,
    picture,
    shading_times,
    vectors,
)
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.reflection import REFLECTION_MODELS


@pytest.mark.parametrize("local", [False, True])
def test_ways(local):
    """All are compared with `lighting`, which has tests of its own.

    Both forms of Phong agree up to rounding.
    """
    normal, light, viewer = operands = vectors(local)
    assert normal.shape == (3, PIXELS)
    assert light.shape == viewer.shape == (3, PIXELS if local else 1)
    found = {name: way(*operands) for name, way in WAYS.items()}
    vector, scalar, blinn = found.values()
    np.testing.assert_allclose(vector, scalar, atol=1e-12)
    # The ways do not test N·L > 0 before the highlight.
    lit = np.flatnonzero((normal * light).sum(axis=0) > 1e-6)[:40]
    material = Material((0.1,) * 3, (0.4,) * 3, (0.5,) * 3, 50)
    for pixel in lit:
        column = pixel if local else 0
        for model, values in (("phong", vector), ("blinn", blinn)):
            exact = intensity(
                normal[:, pixel],
                material,
                [Light(light[:, column])],
                (1, 1, 1),
                viewer[:, column],
                REFLECTION_MODELS[model],
            )
            assert values[pixel] == pytest.approx(exact[0], abs=1e-12)


def test_exponents():
    """Phong's angle is twice Blinn's."""
    assert exponent_at(0) == 4
    for degrees in (1, 20, 44):
        c = math.cos(math.radians(degrees))
        assert c ** (7 * exponent_at(degrees)) == pytest.approx(math.cos(2 * math.radians(degrees)) ** 7)


def test_operations():
    """Dot products have 3 and 2 operations, diffuse and ambient light with the weights 2 and 2, then a power
    and two gates."""
    vector, scalar, blinn = WAYS
    rest = {"functions": 1, "comparisons": 2}
    own = operations(vector, True)
    # N·L, R·V, twice a cosine, three times a normal, two weights; R = ... - L.
    assert own == {"multiplications": 12, "additions": 9, **rest, "all": 24, "fewer": 0}
    assert operations(vector, False) == own
    # N·L, N·V, 2 (N·L)(N·V), weights; also L·V if it is not the frame's.
    own, of_frame = (operations(scalar, local) for local in (True, False))
    assert own == {"multiplications": 13, "additions": 9, **rest, "all": 25, "fewer": 1 - 25 / 24}
    assert of_frame["multiplications"] == pytest.approx(10, abs=0.001)
    # N·L, N·H, weights; also H: sum, length, three divisions.
    own, of_frame = (operations(blinn, local) for local in (True, False))
    dear = {"divisions": 3, "roots": 1}
    assert own == {"multiplications": 11, "additions": 11, **dear, **rest, "all": 29, "fewer": 1 - 29 / 24}
    assert of_frame["multiplications"] == pytest.approx(8, abs=0.001)
    assert of_frame["roots"] == 1 / PIXELS
    assert of_frame["fewer"] == pytest.approx(1 - 17 / 24, abs=1e-3)


def test_times():
    found = shading_times(False, 1)
    assert list(found) == list(WAYS)
    assert next(iter(found.values())) == 0
    assert max(found.values()) < 1
    frame = frame_times(200, 64, 48, 1)
    assert frame["frame"] == pytest.approx(1 - frame["blinn"] / frame["phong"])
    assert 0 < frame["geometry"] < 1
    # Geometry costs the same with both models.
    assert frame["frame"] == pytest.approx(
        frame["shading"] * (1 - frame["geometry"] * frame["blinn"] / frame["phong"])
    )


def test_half_angles_are_those_of_the_formulas():
    """From R·V itself, against sin^2 (psi/2) = sin^2 gamma times 1 along and cos^2 a across."""
    for degrees in (0, 20, 50, 70):
        for n in (10, 1000):
            sine = math.sin(math.acos(0.5 ** (1 / n)) / 2)
            assert half_angle((1, 0), degrees, n) == pytest.approx(math.asin(sine), abs=1e-9)
            across = math.asin(sine / math.cos(math.radians(degrees)))
            assert half_angle((0, 1), degrees, n) == pytest.approx(across, abs=1e-9)
    # Across the plane R·V is over one half everywhere.
    assert math.isnan(half_angle((0, 1), 85, 10))


def test_exponents_of_the_same_width():
    for degrees in (0, 30, 60):
        assert exponent_of_width("along", degrees, 1000) == pytest.approx(4, abs=1e-3)
        limit = 4 * math.cos(math.radians(degrees)) ** 2
        assert exponent_of_width("across", degrees, 1000) == pytest.approx(limit, abs=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("model", ["blinn", "phong"])
def test_pictures(model):
    drawn = picture(model, 12, 48)
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(drawn["png"]))))
    assert image.shape == (36, 24)
    assert image.max() > 150
    assert drawn["lsb"] < 0.6
