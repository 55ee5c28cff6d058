"""Evidence of the errata against the published figures, closed forms and hand calculations."""

import math

import numpy as np
import pytest

from blysk.bench.report.errata import ERRATA, OWN, evidence, section, tasks
from blysk.bench.report.errata_evidence import FACTOR_PUBLISHED, ROOT_PUBLISHED
from blysk.golden.normals import bisection, middle_normal
from blysk.sim.meshes.teapot import teapot

TEN = math.radians(10)


@pytest.fixture(scope="module")
def found():
    return evidence(own=False)


@pytest.fixture(scope="module")
def own():
    return evidence(own=True)


@pytest.mark.parametrize(
    ("name", "published", "right"),
    [
        ("arccos-misprint", "0.086", "0.00013"),
        ("arccos-claim", "0.002", "0.0042"),
        ("arccos-one", "0.084", None),
        ("root-1", "0.0005", "0.0011"),
        ("root-2", "2e-05", "0.001"),
        ("root-digits", "0.001", "2e-05"),
        ("factor-2", "0.0036", "0.0038"),
        ("factor-3", "0.00038", "0.00061"),
        ("flat-100", "14", "0"),
        ("recurrence-64", "0.015", None),
        ("recurrence-256", "0.4", None),
        ("recurrence-4095", "0.4", None),
    ],
)
def test_published_figures(found, name, published, right):
    """To the digits shown in docs/theory/errata.md."""
    values = [f"{value:.2g}" for value in found[name]]
    assert values[0] == published
    assert right is None or values[1] == right


def test_mended_forms(found):
    """Reinsch's form under 6e-5, and 3e-7 for 24 bits; sqrt(1-x) poly(x) 0.041 % relative."""
    assert found["recurrence-64"][1] < 6e-5
    assert found["recurrence-256"][1] < 6e-5
    assert found["recurrence-4095"][1] < 3e-7
    assert found["arccos-one"][1] < 0.00041 * math.acos(0.96)


def test_loss_on_a_flat_face(found):
    """The plain cubic makes normals 0.058 % short at r = 1, and the base falls by n/2 of it."""
    short = 1 - 2 * (0.70681854 - 0.34255322 + 0.19682175 - 0.06137531)
    for n, shown in ((100, 14), (1000, 125)):
        lost, held = found[f"flat-{n}"]
        assert lost == pytest.approx(255 * (1 - (1 - n / 2 * short) ** 2), rel=1e-3)
        assert math.floor(lost) == shown
        assert held == 0


def test_order_of_the_columns(found):
    """The other way round the row gives 1.57 x^2 - 0.972 x - 0.144, which is far off at x = 0."""
    assert found["arccos-order"][0] == pytest.approx(math.pi / 2 + 0.144, abs=1e-6)
    assert found["arccos-order"][1] == pytest.approx(0.0012, abs=5e-5)


def near(value):
    return pytest.approx(value, abs=1e-12)


CLOSED_FORMS = {
    "second-lobe": [near(16), 0],
    # Ambient 0.02, diffuse 0.323316, specular 0.002058.
    "worked-example": [0.3445, near(0.02 + 0.8 * 0.7 / math.sqrt(3) + 0.5 * 3**-5)],
    # Two of 64 values are away from the mean.
    "mnse": [2 / 64, 1],
    # 0.2 + 0.2 x + 0.7 y: with 0.7 x in its place both other corners are 0.7 off.
    "variable": [near(0.7), near(0)],
    "tangent": [0, 1],
    # Right factors keep all energy; the published ones are off by their ratio to those.
    "energy-phong": [near(math.pi / 10), near(1)],
    "energy-blinn": [near(math.pi * (2**-5 + 10) / (10 * (2**5 + 10))), near(1)],
    # (L x N) x N is (L·N) N - L, so that what is published is 2 (L·N) N - 3 L.
    "mirror": [near(math.sqrt(9 - 8 / 3)), near(1)],
    "four-times": [4, near(math.log(math.cos(math.radians(80))) / math.log(math.cos(math.radians(40))))],
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_closed_forms(found, name):
    assert found[name] == CLOSED_FORMS[name]


def test_shortcut(found):
    """``1 - cos(psi/m)`` tends to ``psi^2/(2 m^2)``: the shortcut's is ``(1 - cos psi)/m^2``."""
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
    assert found["inverted"] == [pytest.approx(1 - close), pytest.approx(close)]


def test_listing_of_the_normal_vector(found):
    """6 pixels make 5 steps, and 8 in the listing: without N_l the last is N_r - 5/8 N_l."""
    last = np.array([math.sin(TEN), math.cos(TEN) - 5 / 8])
    last /= math.hypot(*last)
    miss = math.dist(last, (math.sin(TEN), math.cos(TEN)))
    assert found["extrapolated"] == [pytest.approx(miss), pytest.approx(0, abs=1e-12)]
    # dN.x: 5 steps of 1/25; dN.z: 5 of 1.
    assert found["scaled"] == [
        pytest.approx(max(4 / 5 * math.sin(TEN), 4 * (1 - math.cos(TEN)))),
        pytest.approx(0, abs=1e-12),
    ]


def test_zone(found, own):
    """f2 is farthest from Blinn at the zone's bound b, and all but at its limit, ``(1 + ln b / 2)^2``."""
    assert f"{found['zone'][1]:.3%}" == "7.924%"
    for bound, value in ((0.594, own["zone"][0]), (own["zone"][1], 0.07924)):
        assert value == pytest.approx(1 - (1 + math.log(bound) / 2) ** 2 / bound, abs=3e-4)
    assert own["zone"][1] == pytest.approx(0.59363, abs=5e-6)


def test_every_entry_shows_a_difference(found):
    assert found.keys() == ERRATA.keys()
    for name, (published, right) in found.items():
        if name != "zone":
            assert abs(published - right) > 2e-3 * max(abs(published), abs(right)), name


def test_own_figures(own):
    """What is stated is none of what comes out."""
    assert [f"{value:.1e}" for value in own["octaves"]] == ["9.2e-04", "6.8e-05"]
    # Symmetric about the middle, where the curve is exact.
    length, place = own["quadratic-length"]
    assert f"{length:.2e}" == "7.25e-04"
    assert 0 < place < 0.5
    shown, best = own["held-root"]
    assert 7.95e-7 < best < shown
    assert own.keys() == OWN.keys()


def test_published_coefficients_are_those_of_the_units():
    assert bisection._PUBLISHED == ROOT_PUBLISHED
    assert middle_normal._PUBLISHED == FACTOR_PUBLISHED


def test_section(found, own):
    chosen = tasks(quick=True)
    assert [task.settings for task in chosen] == [task.settings for task in tasks(quick=False)]
    made = section(chosen, [found, own])
    errata, figures = made.parts
    assert len(errata.rows) == len(ERRATA)
    assert len(figures.rows) == len(OWN)
    first = errata.records()[0]
    assert first["right"] == "74.457"
    assert [first["as published"], first["as it should be"]] == found["arccos-misprint"]
