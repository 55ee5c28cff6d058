"""The report's section on errata: what the documents print, what is right, and computed evidence for it."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from blysk.bench.accuracy import scene_for
from blysk.bench.report.cosine_quadratic import ZONE
from blysk.bench.report.section import Section, Table
from blysk.bench.store import Task
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import PUBLISHED_COEFFICIENTS, SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.recurrence import Recurrence, shortcut_cosine
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax, reciprocal_root
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.metrics import mnse_published, nmse
from blysk.golden.reference.reflection import REFLECTION_MODELS, exponent_ratio
from blysk.golden.reference.renderer import Thresholds, gouraud_triangles
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "ERRATA",
    "FACTOR_PRINTED",
    "OWN",
    "ROOT_PRINTED",
    "Erratum",
    "Unmatched",
    "evidence",
    "section",
    "tasks",
]

ROOT_PRINTED = {1: (0.64, -0.07), 2: (0.681, -0.119, 0.014)}
"""[T] 2.1: ``1/sqrt(2 + z)`` in ascending powers of z, by degree."""

FACTOR_PRINTED = (0.707, -0.341, 0.193, -0.059)
"""[T] 2.2: ``h(r) = 1/sqrt(2 (1 + r))`` in ascending powers of r."""

_ROOT_DOMAIN = (math.sqrt(2), 2.0)

Evidence = tuple[float, float]
"""The same quantity twice: as the document has it, and as it should be."""


@dataclass(frozen=True)
class Erratum:
    """Something that a document prints and that is not so.

    Parameters
    ----------
    place : str
        Document and place.
    printed, right : str
        What is printed, and what it should be.
    quantity : str
        What is computed, with its unit.
    evidence : callable
        Computes it: from what is printed, and from what is right.
    """

    place: str
    printed: str
    right: str
    quantity: str
    evidence: Callable[[], Evidence]


@dataclass(frozen=True)
class Unmatched:
    """A figure of the project's own specification that could not be had, or not to all of its digits.

    Parameters
    ----------
    what : str
        The figure.
    stated : str
        As the specification has it.
    found : str
        What was found instead, in words.
    values : callable
        Computes: the figure, by what the specification says, and another that explains it.
    """

    what: str
    stated: str
    found: str
    values: Callable[[], Evidence]


def _by_cosine(r: np.ndarray) -> np.ndarray:
    return half_angle_factor(1 - r)


def _row_error(coefficients: Sequence[float], x: np.ndarray) -> float:
    found = np.polynomial.polynomial.polyval(x, coefficients)
    return float(np.abs(found - np.arccos(x)).max())


# Evidence, in the order of the list.


def _misprint() -> Evidence:
    return tuple(_row_error(Arccos(table).coefficients[4], 0.96) for table in ("as_published", "corrected"))


def _order() -> Evidence:
    x = np.linspace(0, 0.5, 501)
    return _row_error(PUBLISHED_COEFFICIENTS[0][::-1], x), _row_error(PUBLISHED_COEFFICIENTS[0], x)


def _arccos_claim() -> Evidence:
    worst = [
        largest_error(np.arccos, PUBLISHED_COEFFICIENTS[k], *SEGMENT_BOUNDS[k : k + 2])[1] for k in range(4)
    ]
    return 0.002, max(worst)


def _arccos_at_one() -> Evidence:
    x = 1 - np.geomspace(1e-12, 0.04, 4001)
    error = np.polynomial.polynomial.polyval(x, Arccos("corrected").coefficients[4]) - np.arccos(x)
    # The well-posed form of numbers.md, over the same x.
    root = np.sqrt(1 - x) * np.polynomial.polynomial.polyval(x, [1.5702117, -0.20212057, 0.04670706])
    return float(np.abs(error).max()), float(np.abs(root - np.arccos(x)).max())


def _root_claim(degree: int, claimed: float) -> Evidence:
    return claimed, largest_error(reciprocal_root, np.array(ROOT_PRINTED[degree]), *_ROOT_DOMAIN)[0]


def _root_digits() -> Evidence:
    fit = minimax(reciprocal_root, *_ROOT_DOMAIN, 2)
    return tuple(
        largest_error(reciprocal_root, np.array(row), *_ROOT_DOMAIN)[0] for row in (ROOT_PRINTED[2], fit)
    )


def _factor_quadratic() -> Evidence:
    return 0.0036, largest_error(_by_cosine, minimax(_by_cosine, 0, 1, 2), 0, 1)[1]


def _factor_claim() -> Evidence:
    return 0.00038, largest_error(_by_cosine, np.array(FACTOR_PRINTED), 0, 1)[0]


def _highlight_loss(exponent: int) -> Evidence:
    """LSB lost at the peak of a highlight on a flat face, by the plain fit and by one held at angle 0."""

    def lost(factor: float) -> float:
        return 255 * (1 - float(REFLECTION_MODELS["cosquad"].reflect(2 * factor, exponent)))

    plain = minimax(_by_cosine, 0, 1, 3).sum()
    held = minimax(half_angle_factor, 0, 0.5, 3, {0: 0.5})[0]
    return lost(plain), lost(held)


def _second_lobe() -> Evidence:
    cosine = math.cos(math.radians(60))
    return (20 / 2 * (cosine - 1) + 1) ** 2, float(REFLECTION_MODELS["cosquad"].reflect(cosine, 20))


def _shortcut(degrees: float) -> Evidence:
    angle, steps = math.radians(degrees), 1000
    exact = 2 * math.sin(angle / steps / 2) ** 2
    return float((1 - shortcut_cosine(angle, steps)) / exact), 1.0


def _recurrence(pixels: int, degrees: float, bits: int) -> Evidence:
    """Worst error over a span, as drawn and in Reinsch's form; the peak at 0.79 of the span."""
    angle = math.radians(degrees)
    step = angle / (pixels - 1)
    exact = np.cos(0.79 * angle - step * np.arange(pixels))
    worst = []
    for form in ("direct", "reinsch"):
        unit = Recurrence(form, fraction_bits=bits, guard_bits=20)
        one = np.ones(1)
        coefficient, shift = unit.coefficient(step * one)
        states = unit.states(*unit.start(one, 0.79 * angle * one, step * one), coefficient, shift, pixels)
        found = states.values[:, 0]
        worst.append(float(np.abs(found - exact).max()))
    return worst[0], worst[1]


def _worked_example() -> Evidence:
    """[B] 5 at ``N = V = (0, 0, 1)``, ``L = (1, 1, 1)/sqrt 3``, n = 10, in one channel."""
    axis = np.array([0.0, 0, 1])
    # I_d = 0.8 and I_s = 1: two lights, one without a highlight and one that is nothing else.
    dull = Material((0.1,) * 3, (0.7,) * 3, (0,) * 3, 10)
    glossy = Material((0,) * 3, (0,) * 3, (0.5,) * 3, 10)
    total = intensity(
        axis, dull, [Light((1, 1, 1), (0.8,) * 3)], (0.2,) * 3, axis, REFLECTION_MODELS["phong"]
    )
    total = total + intensity(axis, glossy, [Light((1, 1, 1))], (0, 0, 0), axis, REFLECTION_MODELS["phong"])
    return 0.3445, float(total[0])


def _flat_picture() -> Evidence:
    reference = np.full((8, 8), 100.0)
    reference[0, 0] = 200
    reference[0, 1] = 0
    image = reference + 1
    # The mean is 100: all but two values are at it.
    return mnse_published(image, reference)[1], float(np.isfinite(nmse(image, reference)))


def _inverted_test() -> Evidence:
    scene = scene_for(teapot(1_000), 50, 160, 120)
    every = len(scene.mesh.faces)
    # Highlight and diffuse tests aside, which the inversion does not touch.
    close = int(gouraud_triangles(scene, Thresholds(highlight=math.inf, diffuse=math.inf)).sum())
    return (every - close) / every, close / every


def _extrapolated_end() -> Evidence:
    """Error of the last normal of a span of 10 degrees and 6 pixels, by [T] appendix Г and with N_l added."""
    angle, pixels = math.radians(10), 6
    left, right = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    power = 1 << (pixels - 2).bit_length()
    printed, right_end = (start + power / (pixels - 1) * (right - left) for start in (np.zeros(3), left))
    return tuple(
        float(np.linalg.norm(normalise((1 - t) * left + t * end) - right))
        for end in (printed, right_end)
        for t in [(pixels - 1) / power]
    )


def _scaled_twice() -> Evidence:
    """The same span, turned so that x and z change: ``dN.x`` scaled twice, ``dN.z`` never."""
    angle, pixels = math.radians(10), 6
    left, right = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    scale = 1 / (pixels - 1)
    step = right - left
    return tuple(
        float(np.abs(left + (pixels - 1) * step * factors - right).max())
        for factors in (np.array([scale**2, scale, 1]), np.full(3, scale))
    )


def _wrong_variable() -> Evidence:
    """A plane ``P0 x + P1 y + P2`` through three corners, with ``P1 x`` for ``P1 y``: error at a corner."""
    corners = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    values = np.array([0.2, 0.4, 0.9])
    plane = np.linalg.solve(corners, values)
    wrong = plane[0] * corners[:, 0] + plane[1] * corners[:, 0] + plane[2]
    return tuple(float(np.abs(found - values).max()) for found in (wrong, corners @ plane))


def _tangent() -> Evidence:
    """Share of random spans of equal normals whose first N·H comes out, to 1e-4: as printed, by the twin."""
    normal, halfway = normalise(np.random.default_rng(1).normal(size=(2, 1000, 3)))
    exact = np.einsum("ij,ij->i", normal, halfway)
    cosine = 1.0
    with np.errstate(invalid="ignore"):
        tangent = np.divide(exact - cosine * exact, math.sqrt(1 - cosine**2) * exact)
    phase = np.arctan(tangent)
    printed = exact / np.cos(phase) * np.cos(phase)
    normal, halfway = (Fixed(COMPONENT, quantise(vector)) for vector in (normal, halfway))
    _, turn, _, amplitude, _ = AngularSetup().compute(normal, normal, halfway, np.ones(1000, dtype=np.int64))
    found = amplitude.values * np.cos(2 * np.pi * turn.values)
    return tuple(float(np.mean(np.abs(curve - exact) < 1e-4)) for curve in (printed, found))


def _energy(model: str, exponent: int) -> Evidence:
    """Reflected energy, which the factor is to make 1: with the printed one and the right one."""
    half = 2 if model == "blinn" else 1
    reflected = quad(
        lambda t: math.cos(t / half) ** exponent * math.cos(t) * math.sin(t), 0, math.pi / 2, epsabs=1e-13
    )[0]
    n = exponent
    printed = {"phong": (n + 2) / (2 * n), "blinn": (n + 2) * (n + 4) / (8 * n * (2 ** (n / 2) + n))}
    return tuple(
        2 * math.pi * factor * reflected
        for factor in (printed[model], REFLECTION_MODELS[model].energy_factor(n))
    )


def _mirror() -> Evidence:
    """Length of R by vector products, as printed, and by scalar ones; L at 54.7 degrees."""
    normal, light = np.array([0.0, 0, 1]), normalise(np.array([1.0, 1, 1]))
    printed = 2 * np.cross(np.cross(light, normal), normal) - light
    right = 2 * (light @ normal) * normal - light
    return float(np.linalg.norm(printed)), float(np.linalg.norm(right))


def _zone(bound: float) -> float:
    """Largest relative error of f2 where Blinn is at the bound or above, n from 2 to 1000."""
    exponents = np.arange(2, 1001)
    base = exponents / 2 * np.expm1(math.log(bound) / exponents) + 1
    return float(np.max(1 - base**2 / bound))


def _undefined_zone() -> Evidence:
    return 0.07924, _zone(ZONE)


def _four_times() -> Evidence:
    return 4.0, float(exponent_ratio(math.cos(math.radians(40))))


ERRATA = {
    "arccos-misprint": Erratum(
        "[T] table 3.1, last row",
        "74.547",
        "74.457",
        "error of the polynomial at x = 0.96, rad",
        _misprint,
    ),
    "arccos-order": Erratum(
        "[T] table 3.1, columns A, B, C",
        "coefficients in descending order",
        "in ascending order: A + B x + C x^2",
        "largest error on [0, 0.5], rad",
        _order,
    ),
    "arccos-claim": Erratum(
        "[T] table 3.1, error",
        "0.2 % at most",
        "more on [0.75, 0.96], by its own digits",
        "largest relative error on [0, 0.96]",
        _arccos_claim,
    ),
    "arccos-one": Erratum(
        "[T] 3.3",
        "a quadratic on [0.96, 1]",
        "sqrt(1 - x) times a polynomial, or the half chord: arccos has a root's slope at 1",
        "largest error on [0.96, 1], corrected, rad",
        _arccos_at_one,
    ),
    "root-1": Erratum(
        "[T] 2.1, degree 1",
        "0.64 - 0.07 z: 0.0005, 0.12 %",
        "the printed digits are not that good",
        "largest error on [sqrt 2, 2]",
        lambda: _root_claim(1, 0.0005),
    ),
    "root-2": Erratum(
        "[T] 2.1, degree 2",
        "0.014 z^2 - 0.119 z + 0.681: 2e-5, 0.004 %",
        "the printed digits are not that good",
        "largest error on [sqrt 2, 2]",
        lambda: _root_claim(2, 2e-5),
    ),
    "root-digits": Erratum(
        "[T] 2.1, degree 2",
        "coefficients of three digits",
        "0.68084977 - 0.1189218 z + 0.0142535 z^2",
        "largest error on [sqrt 2, 2]",
        _root_digits,
    ),
    "factor-2": Erratum(
        "[T] 2.2, h of degree 2",
        "0.36 %",
        "no quadratic is that good",
        "largest relative error, r from 0 to 1",
        _factor_quadratic,
    ),
    "factor-3": Erratum(
        "[T] 2.2, h of degree 3",
        "0.00038, 0.054 %",
        "the printed digits are not that good",
        "largest error, r from 0 to 1",
        _factor_claim,
    ),
    "flat-100": Erratum(
        "[T] 2.2, h fitted over all r",
        "least largest error",
        "exact at r = 1, where neighbouring normals are",
        "lost at a highlight's peak on a flat face, n = 100, LSB",
        lambda: _highlight_loss(100),
    ),
    "flat-1000": Erratum(
        "[T] 2.2, h fitted over all r",
        "least largest error",
        "exact at r = 1, where neighbouring normals are",
        "lost at a highlight's peak on a flat face, n = 1000, LSB",
        lambda: _highlight_loss(1000),
    ),
    "second-lobe": Erratum(
        "[T] figure 3.6",
        "the comparator is behind the square",
        "compare the base, before it is squared",
        "highlight at n = 20, gamma = 60 degrees",
        _second_lobe,
    ),
    "shortcut-10": Erratum(
        "[T] 3.3",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 10 degrees",
        lambda: _shortcut(10),
    ),
    "shortcut-60": Erratum(
        "[T] 3.3",
        "cos(psi/m) = (cos psi - 1)/m^2 + 1",
        "4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
        "1 - cos(psi/m) over the exact one, psi = 60 degrees",
        lambda: _shortcut(60),
    ),
    "recurrence-64": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 64 pixels, 10 degrees, 16 fraction bits",
        lambda: _recurrence(64, 10, 16),
    ),
    "recurrence-256": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 256 pixels, 60 degrees, 16 fraction bits",
        lambda: _recurrence(256, 60, 16),
    ),
    "recurrence-4095": Erratum(
        "[T] figure 3.5",
        "x(t+1) = 2 cos d x(t) - x(t-1)",
        "Reinsch's form",
        "worst error: 4095 pixels, 60 degrees, 24 fraction bits",
        lambda: _recurrence(4095, 60, 24),
    ),
    "tangent": Erratum(
        "[T] 3.2",
        "tan lambda as a quotient",
        "sums and differences of N_l·H and N_r·H over half-angle functions, and the angle of both",
        "share of spans of equal normals, the usual case, whose N·H comes out",
        _tangent,
    ),
    "worked-example": Erratum(
        "[T] 4.1, worked example",
        "0.3445",
        "0.577^10 was taken for 0.003",
        "intensity",
        _worked_example,
    ),
    "mnse": Erratum(
        "[T] 4.1, MNSE",
        "each error divided by its own pixel's distance from the mean",
        "sum of errors over sum of distances (NMSE)",
        "share of a flat picture's values with a defined figure",
        _flat_picture,
    ),
    "inverted": Erratum(
        "[T] appendix В",
        "Phong where normals are close",
        "Gouraud where they are close",
        "share of the triangles of a teapot of 992 that the test of normals gives to Gouraud",
        _inverted_test,
    ),
    "extrapolated": Erratum(
        "[T] appendix Г, NormalVector",
        "the end is extrapolated without the start vector",
        "N_l + g (N_r - N_l)",
        "error of the last normal, 10 degrees, 6 pixels",
        _extrapolated_end,
    ),
    "scaled": Erratum(
        "[T] appendix Г, NormalVector",
        "dN.x is scaled twice, dN.z never",
        "each once",
        "error of the last normal's components, 10 degrees, 6 pixels",
        _scaled_twice,
    ),
    "variable": Erratum(
        "[T] appendix Д",
        "P[1]*x in two channels",
        "P[1]*y",
        "error at a corner whose value is given, intensities 0.2, 0.4, 0.9",
        _wrong_variable,
    ),
    "energy-phong": Erratum(
        "[C], Phong's normalising coefficient",
        "(n+2)/2n",
        "(n+2)/(2 pi)",
        "reflected energy at n = 10, to be 1",
        lambda: _energy("phong", 10),
    ),
    "energy-blinn": Erratum(
        "[C], Blinn's normalising coefficient",
        "((n+2)(n+4))/(8n(2^(n/2)+n))",
        "((n+2)(n+4))/(8 pi (2^(-n/2)+n))",
        "reflected energy at n = 10, to be 1",
        lambda: _energy("blinn", 10),
    ),
    "mirror": Erratum(
        "[C], mirror direction",
        "R = 2 (L x N) x N - L",
        "R = 2 (L·N) N - L: products are scalar",
        "length of R, to be 1",
        _mirror,
    ),
    "zone": Erratum(
        "[C], epicentre zone",
        "7.924 %, of a zone that is not defined",
        f"where Blinn's model is at least {ZONE}",
        "largest relative error of f2 in the zone",
        _undefined_zone,
    ),
    "four-times": Erratum(
        "[P], exponents of Blinn and Phong",
        "about 4 times",
        "4 at the peak alone, and more away from it",
        "n/p at gamma = 40 degrees",
        _four_times,
    ),
}
"""What the documents print, by name."""


def _octaves() -> Evidence:
    return tuple(largest_error(np.arccos, minimax(np.arccos, 0, 0.5, degree), 0, 0.5)[0] for degree in (2, 3))


def _zone_bounds() -> Evidence:
    return _zone(0.594), float(brentq(lambda bound: _zone(bound) - 0.07924, 0.5, 0.7))


def _quadratic_length() -> Evidence:
    angle = math.radians(45)
    ends = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    t = np.linspace(0, 1, 100_001)
    normals = interpolate("quadratic", *ends, t)
    length = np.abs(np.linalg.norm(normals, axis=1) - 1)
    return float(length.max()), float(t[length.argmax()])


def _held_root() -> Evidence:
    def gap(v):
        return reciprocal_root(2 - v)

    domain = 0.0, 2 - math.sqrt(2)
    shown = np.array([0.5, 0.0625277, 0.01144775, 0.00317987])
    best = minimax(gap, *domain, 3, {0: 0.5})
    return tuple(largest_error(gap, row, *domain)[0] for row in (shown, best))


OWN = {
    "octaves": Unmatched(
        "arccos in octaves of 1 - x, largest error, rad",
        "1.7e-4",
        "quadratics give the first, cubics the second",
        _octaves,
    ),
    "zone": Unmatched(
        "[C]'s zone, 7.924 %: Blinn at least",
        "0.594",
        "0.594 gives the first; the second is the bound of 7.924 %",
        _zone_bounds,
    ),
    "quadratic-length": Unmatched(
        "length error of a quadratic normal at 45 degrees",
        "7.3e-4",
        "the first, at the place in the span that is the second",
        _quadratic_length,
    ),
    "held-root": Unmatched(
        "1/sqrt(2+z) exact at angle 0, 3 terms, largest error",
        "7.9e-7",
        "the coefficients shown give the first, the best ones the second",
        _held_root,
    ),
}
"""Figures of the specification that did not come out, by name."""


def evidence(own: bool) -> dict[str, list[float]]:
    """Evidence of each entry.

    Parameters
    ----------
    own : bool
        Of `OWN`, else of `ERRATA`.

    Returns
    -------
    dict
        By name, two figures: see `Erratum` and `Unmatched`.
    """
    if own:
        return {name: list(figure.values()) for name, figure in OWN.items()}
    return {name: list(erratum.evidence()) for name, erratum in ERRATA.items()}


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section: the same whether quick or not."""
    return [Task(evidence, {"own": own}) for own in (False, True)]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks."""
    documents, own = results
    errata = Table(
        "errata",
        "Errata of the documents",
        ("place", "printed", "right", "computed", "as printed", "as it should be"),
        [
            [erratum.place, erratum.printed, erratum.right, erratum.quantity, *documents[name]]
            for name, erratum in ERRATA.items()
        ],
        "Both figures are computed by this report, but for those that a document claims itself (an error, "
        "an intensity, a ratio), which stand as printed. Listings of [T] are as the specification describes "
        "them.",
    )
    figures = Table(
        "errata-specification",
        "Figures of this project's specification that did not come out",
        ("figure", "stated", "found", "first", "second"),
        [[figure.what, figure.stated, figure.found, *own[name]] for name, figure in OWN.items()],
        "Computed in float64.",
    )
    text = [
        f"{len(ERRATA)} entries on what the documents print, each with a figure that anyone can compute "
        "again: from what is printed, and from what it should be. The devices keep the printed constants as "
        "named variants, so that their effect shows in the other sections.",
    ]
    return Section("errata", "Errata of the documents", text, [errata, figures])
