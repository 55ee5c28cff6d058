"""Evidence of the errata against the published figures, closed forms and hand calculations."""

import math

import numpy as np
import pytest

from blysk.bench.report.errata import ERRATA, KINDS, OWN, evidence, matters, section, tasks
from blysk.bench.report.errata_evidence import (
    FACTOR_PUBLISHED,
    ROOT_PUBLISHED,
    chebyshev,
    factor_quadratics,
)
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
        ("root-1", "0.0012", "0.0022"),
        ("root-1-least", "0.0005", "0.00061"),
        ("root-2", "2e-05", "0.001"),
        ("factor-3", "0.00038", "0.00061"),
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
    # Right factors keep all energy; the published ones are off by their ratio to those.
    "energy-phong": [near(math.pi / 10), near(1)],
    "energy-blinn": [near(math.pi * (2**-5 + 10) / (10 * (2**5 + 10))), near(1)],
    # (L x N) x N is (L·N) N - L, so that what is published is 2 (L·N) N - 3 L.
    "mirror": [near(math.sqrt(9 - 8 / 3)), near(1)],
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
    # dN times 0 at the first pixel stays 0: the last normal is the first.
    assert found["scaled"] == [near(2 * math.sin(TEN / 2)), near(0)]


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


def test_published_digits_are_those_of_chebyshev_nodes():
    """[T] 2.1 and 2.2: coefficients rounded from those nodes, and bounds of the unrounded ones."""
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
    """The printed 0.002 and 0.36 % are within reach of a quadratic, and are those of Chebyshev's nodes."""
    quadratics = factor_quadratics()
    assert {name: f"{relative:.3%}" for name, (_, relative) in quadratics.items()} == {
        "nodes": "0.359%",
        "relative": "0.319%",
        "within": "0.344%",
    }
    assert quadratics["within"][0] < 0.002001
    # The exchange algorithm: relative errors e, -e, e, -e at four places, at their extremes in the end.
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
    """Entries about one matter are of one document, one kind and one count."""
    assert sum(matters().values()) == len({erratum.matter or name for name, erratum in ERRATA.items()})
    assert {erratum.kind for erratum in ERRATA.values()} == set(KINDS)


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
