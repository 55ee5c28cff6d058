"""Evidence of the errata against the published figures, closed forms and calculations by hand."""

import math

import numpy as np
import pytest

from blysk.bench.report.claims import measured
from blysk.bench.report.cosine_quadratic import ZONE
from blysk.bench.report.errata import (
    CLAIMS,
    FACTOR_PUBLISHED,
    KINDS,
    ROOT_PUBLISHED,
    chebyshev,
    factor_quadratics,
    matters,
)
from blysk.golden.normals import bisection, middle_normal
from blysk.sim.meshes.teapot import teapot

TEN = math.radians(10)


@pytest.fixture(scope="module")
def found():
    """Printed and measured values by function and settings."""
    return {
        "-".join(map(str, (claim.function.__name__, *claim.settings.values()))): tuple(
            float(value) for value in claim.values(result)
        )
        for claim, result in zip(CLAIMS, measured(CLAIMS), strict=True)
    }


@pytest.mark.parametrize(
    ("name", "published", "right"),
    [
        ("misprint", "0.086", "0.00013"),
        ("arccos_rows", "0.002", "0.0042"),
        ("arccos_at_one", "0.084", None),
        ("root_error-1-True", "0.0012", "0.0022"),
        ("root_least", "0.0005", "0.00061"),
        ("root_error-2-False", "2e-05", "0.001"),
        ("factor_error", "0.00038", "0.00061"),
        ("recurrence-64-10-16", "0.015", None),
        ("recurrence-256-60-16", "0.4", None),
        ("recurrence-4095-60-24", "0.4", None),
    ],
)
def test_published_figures(found, name, published, right):
    """To the digits shown in docs/theory/errata.md."""
    values = [f"{value:.2g}" for value in found[name]]
    assert values[0] == published
    assert right is None or values[1] == right


def test_mended_forms(found):
    """Reinsch's form is under 6e-5, and under 3e-7 for 24 bits; sqrt(1-x) poly(x) is 0.041 % off."""
    assert found["recurrence-64-10-16"][1] < 6e-5
    assert found["recurrence-256-60-16"][1] < 6e-5
    assert found["recurrence-4095-60-24"][1] < 3e-7
    assert found["arccos_at_one"][1] < 0.00041 * math.acos(0.96)


def test_order_of_the_columns(found):
    """In the other order the row gives 1.57 x^2 - 0.972 x - 0.144, which is far off at x = 0."""
    assert found["order"][0] == pytest.approx(math.pi / 2 + 0.144, abs=1e-6)
    assert found["order"][1] == pytest.approx(0.0012, abs=5e-5)


def near(value):
    return pytest.approx(value, abs=1e-12)


CLOSED_FORMS = {
    "second_lobe": (near(16), 0),
    # Ambient 0.02, diffuse 0.323316, specular 0.002058.
    "worked_example": (0.3445, near(0.02 + 0.8 * 0.7 / math.sqrt(3) + 0.5 * 3**-5)),
    # Two of 64 values differ from the mean.
    "flat_picture": (2 / 64, 1),
    # 0.2 + 0.2 x + 0.7 y. With 0.7 x in place of 0.7 y both other corners are 0.7 off.
    "wrong_variable": (near(0.7), near(0)),
    # Right factors keep all energy. The published factors are off by their ratio to the right factors.
    "energy-phong-10": (near(math.pi / 10), near(1)),
    "energy-blinn-10": (near(math.pi * (2**-5 + 10) / (10 * (2**5 + 10))), near(1)),
    # (L x N) x N is (L·N) N - L, so the published formula is 2 (L·N) N - 3 L.
    "mirror": (near(math.sqrt(9 - 8 / 3)), near(1)),
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms(found, name):
    assert found[name] == CLOSED_FORMS[name]


def test_shortcut(found):
    """``1 - cos(psi/m)`` tends to ``psi^2/(2 m^2)``; the shortcut's value is ``(1 - cos psi)/m^2``."""
    for degrees, shown in ((10, "0.3%"), (60, "8.8%")):
        psi = math.radians(degrees)
        value, one = found[f"shortcut-{degrees}"]
        assert value == pytest.approx((1 - math.cos(psi)) * 2 / psi**2, rel=1e-6)
        assert f"{1 - value:.1%}" == shown
        assert one == 1


def test_inverted_test(found):
    """Lengths of the differences of vertex normals, counted here."""
    mesh = teapot(1_000)
    corners = mesh.normals[mesh.faces]
    widest = np.max([np.linalg.norm(corners[:, k] - corners[:, k - 1], axis=1) for k in range(3)], axis=0)
    close = np.mean(widest < 0.9)
    assert len(mesh.faces) == 992
    assert found["inverted_test"] == (pytest.approx(1 - close), pytest.approx(close))


def test_listing_of_the_normal_vector(found):
    """6 pixels make 5 steps, and 8 in the listing. Without N_l the last normal is N_r - 5/8 N_l."""
    last = np.array([math.sin(TEN), math.cos(TEN) - 5 / 8])
    last /= math.hypot(*last)
    miss = math.dist(last, (math.sin(TEN), math.cos(TEN)))
    assert found["extrapolated_end"] == (pytest.approx(miss), pytest.approx(0, abs=1e-12))
    # At the first pixel dN times 0 becomes 0, so the last normal is the first.
    assert found["scaled_in_place"] == (near(2 * math.sin(TEN / 2)), near(0))


def test_zone(found):
    """f2 is farthest from Blinn's power at the zone's bound b, and nearly at its limit,
    ``(1 + ln b / 2)^2``."""
    assert f"{found['zone_error'][1]:.3%}" == "7.924%"
    assert found["zone_error"][1] == pytest.approx(1 - (1 + math.log(ZONE) / 2) ** 2 / ZONE, abs=3e-4)


def test_published_digits_are_those_of_chebyshev_nodes():
    """[T] 2.1 and 2.2: coefficients rounded from Chebyshev's nodes, and bounds of the unrounded
    coefficients."""
    root, factor = (lambda z: 1 / np.sqrt(2 + z)), (lambda r: 1 / np.sqrt(2 * (1 + r)))
    for function, low, high, published, digits, shown in (
        (root, math.sqrt(2), 2, ROOT_PUBLISHED[1], 2, "0.12%"),
        (root, math.sqrt(2), 2, ROOT_PUBLISHED[2], 3, "0.004%"),
        (factor, 0, 1, FACTOR_PUBLISHED, 3, "0.054%"),
    ):
        fit = chebyshev(function, low, high, len(published) - 1)
        assert fit.round(digits) == pytest.approx(published, abs=1e-12)
        x = np.linspace(low, high, 10_001)
        worst = np.abs(np.polynomial.polynomial.polyval(x, fit) / function(x) - 1).max()
        assert f"{worst:.{len(shown) - 3}%}" == shown


def test_quadratics_of_the_middle_normal():
    """A quadratic can reach the printed 0.002 and 0.36 %. They are those of Chebyshev's nodes."""
    quadratics = factor_quadratics()
    assert {name: f"{relative:.3%}" for name, (_, relative) in quadratics.items()} == {
        "nodes": "0.359%",
        "relative": "0.319%",
        "within": "0.344%",
    }
    assert quadratics["within"][0] < 0.002001
    # The exchange algorithm has relative errors e, -e, e, -e at four places, which are its extremes in the
    # end.
    x = np.linspace(0, 1, 100_001)
    places = np.array([0, 0.25, 0.75, 1])
    for _ in range(10):
        exact = 1 / np.sqrt(2 * (1 + places))
        columns = np.column_stack([np.ones(4), places, places**2, [1, -1, 1, -1] * exact])
        *fit, level = np.linalg.solve(columns, exact)
        error = np.polynomial.polynomial.polyval(x, fit) * np.sqrt(2 * (1 + x)) - 1
        inner = np.flatnonzero(np.diff(np.sign(np.diff(error)))) + 1
        places = x[[0, *inner, -1]]
    assert quadratics["relative"][1] == pytest.approx(abs(level), rel=1e-4)


def test_matters_count_once():
    """As docs/theory/errata.md counts them."""
    assert sum(matters().values()) == 18
    assert {claim.kind for claim in CLAIMS} == set(KINDS)


def test_published_coefficients_are_those_of_the_units():
    assert bisection._PUBLISHED == ROOT_PUBLISHED
    assert middle_normal._PUBLISHED == FACTOR_PUBLISHED
