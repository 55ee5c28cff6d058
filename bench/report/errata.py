"""Errata of the documents: statements that measurements refute or that our units replace, with evidence."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import quad
from scipy.optimize import linprog

from blysk.bench.accuracy import scene_for
from blysk.bench.report.claims import Claim, ClaimTable, Document
from blysk.bench.report.cosine_quadratic import ZONE
from blysk.golden.cosines.arccos import PUBLISHED_COEFFICIENTS, SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.recurrence import Recurrence, shortcut_cosine
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax, reciprocal_root
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.metrics import mnse_published, nmse
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import Thresholds, gouraud_triangles
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "CLAIMS",
    "FACTOR_PUBLISHED",
    "KINDS",
    "ROOT_PUBLISHED",
    "chebyshev",
    "factor_quadratics",
    "matters",
    "second_lobe",
    "section",
    "tasks",
]


KINDS = {
    "slip": "a slip in print, drawing or listing",
    "figure": "a figure that the printed digits do not give",
    "unclear": "a statement that is undefined, or has two meanings",
    "reading": "perhaps no error of the authors: a machine read our copy, and marks may be lost",
    "form": "no error: a form or choice that is good in its range, and that our units replace",
}
"""Explanations of the kinds of entries."""

ROOT_PUBLISHED = {1: (0.64, -0.07), 2: (0.681, -0.119, 0.014)}
"""[T] 2.1: ``1/sqrt(2 + z)`` in ascending powers of z, by degree."""

FACTOR_PUBLISHED = (0.707, -0.341, 0.193, -0.059)
"""[T] 2.2: ``h(r) = 1/sqrt(2 (1 + r))`` in ascending powers of r."""

_ROOT_DOMAIN = (math.sqrt(2), 2.0)

Pair = tuple[float, float]
"""A quantity by the document's statement, and the same quantity as measured."""


def _by_cosine(r: np.ndarray) -> np.ndarray:
    return half_angle_factor(1 - r)


def _row_error(coefficients: Sequence[float], x: np.ndarray) -> float:
    found = np.polynomial.polynomial.polyval(x, coefficients)
    return float(np.abs(found - np.arccos(x)).max())


def misprint() -> Pair:
    """Error in rad of the last row of the arccos table at x = 0.96: as published, and corrected."""
    return tuple(_row_error(Arccos(table).coefficients[4], 0.96) for table in ("as_published", "corrected"))


def order() -> Pair:
    """Largest error in rad of the first row of the arccos table: coefficients read downwards, and upwards."""
    x = np.linspace(0, 0.5, 501)
    return _row_error(PUBLISHED_COEFFICIENTS[0][::-1], x), _row_error(PUBLISHED_COEFFICIENTS[0], x)


def arccos_rows() -> float:
    """Largest relative error of the first four rows of the arccos table."""
    return max(
        largest_error(np.arccos, PUBLISHED_COEFFICIENTS[k], *SEGMENT_BOUNDS[k : k + 2])[1] for k in range(4)
    )


def arccos_at_one() -> Pair:
    """Largest error in rad near x = 1 of a quadratic in x, and of a quadratic times the root of 1 - x."""
    x = 1 - np.geomspace(1e-12, 0.04, 4001)
    error = np.polynomial.polynomial.polyval(x, Arccos("corrected").coefficients[4]) - np.arccos(x)
    # The well-posed form, over the same x.
    root = np.sqrt(1 - x) * np.polynomial.polynomial.polyval(x, [1.5702117, -0.20212057, 0.04670706])
    return float(np.abs(error).max()), float(np.abs(root - np.arccos(x)).max())


def root_error(degree: int, relative: bool) -> float:
    """Largest absolute or relative error of the published polynomial for ``1/sqrt(2 + z)``."""
    return largest_error(reciprocal_root, np.array(ROOT_PUBLISHED[degree]), *_ROOT_DOMAIN)[relative]


def root_least() -> float:
    """Least largest error of a line for ``1/sqrt(2 + z)``."""
    line = minimax(reciprocal_root, *_ROOT_DOMAIN, 1)
    return largest_error(reciprocal_root, line, *_ROOT_DOMAIN)[0]


def chebyshev(
    function: Callable[[np.ndarray], np.ndarray], low: float, high: float, degree: int
) -> np.ndarray:
    """Coefficients, in ascending order, of the polynomial through the values at Chebyshev's nodes."""
    fit = np.polynomial.Chebyshev.interpolate(function, degree, [low, high])
    return fit.convert(kind=np.polynomial.Polynomial).coef


def factor_quadratics() -> dict[str, tuple[float, float]]:
    """Largest absolute and relative error of three quadratics for the factor of the middle normal.

    ``"nodes"`` goes through the values at Chebyshev's nodes. ``"relative"`` has the least largest relative
    error. ``"within"`` has the least largest relative error among quadratics with an absolute error of at
    most 0.002.
    """
    x = (1 - np.cos(np.linspace(0, np.pi, 4001))) / 2
    exact = _by_cosine(x)
    powers = np.vander(x, 3, increasing=True)
    relative = powers / exact[:, np.newaxis]
    found = {"nodes": chebyshev(_by_cosine, 0, 1, 2)}
    for name, limit in (("relative", 1.0), ("within", 0.002)):
        one, none = np.ones((len(x), 1)), np.zeros((len(x), 1))
        fit = linprog(
            [0, 0, 0, 1],
            A_ub=np.block([[relative, -one], [-relative, -one], [powers, none], [-powers, none]]),
            b_ub=np.concatenate([one[:, 0], -one[:, 0], exact + limit, limit - exact]),
            bounds=[(None, None)] * 4,
        )
        found[name] = fit.x[:3]
    return {name: largest_error(_by_cosine, fit, 0, 1) for name, fit in found.items()}


def factor_error() -> float:
    """Largest error of the published factor of the middle normal."""
    return largest_error(_by_cosine, np.array(FACTOR_PUBLISHED), 0, 1)[0]


def second_lobe() -> Pair:
    """Term at 60 degrees and n = 20: of the parabola alone, and with the comparator."""
    cosine = math.cos(math.radians(60))
    return (20 / 2 * (cosine - 1) + 1) ** 2, float(REFLECTION_MODELS["cosquad"].reflect(cosine, 20))


def shortcut(degrees: float) -> Pair:
    """Two ratios for a span's angle: ``1 - cos d`` by the published shortcut over the exact value, and 1."""
    angle, steps = math.radians(degrees), 1000
    exact = 2 * math.sin(angle / steps / 2) ** 2
    return float((1 - shortcut_cosine(angle, steps)) / exact), 1.0


def recurrence(pixels: int, degrees: float, bits: int) -> Pair:
    """Worst error over a span with the peak at t = 0.79: recurrence of [T] figure 3.5, and Reinsch's form."""
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


def worked_example() -> float:
    """[B] 5 at ``N = V = (0, 0, 1)``, ``L = (1, 1, 1)/sqrt 3``, n = 10, in one channel."""
    axis = np.array([0.0, 0, 1])
    # I_d = 0.8 and I_s = 1 need two lights. The first has no highlight, and the second only a highlight.
    dull = Material((0.1,) * 3, (0.7,) * 3, (0,) * 3, 10)
    glossy = Material((0,) * 3, (0,) * 3, (0.5,) * 3, 10)
    total = intensity(
        axis, dull, [Light((1, 1, 1), (0.8,) * 3)], (0.2,) * 3, axis, REFLECTION_MODELS["phong"]
    )
    total = total + intensity(axis, glossy, [Light((1, 1, 1))], (0, 0, 0), axis, REFLECTION_MODELS["phong"])
    return float(total[0])


def flat_picture() -> Pair:
    """Share of a flat picture's values where MNSE as published is defined, and whether NMSE is defined."""
    reference = np.full((8, 8), 100.0)
    reference[0, 0] = 200
    reference[0, 1] = 0
    image = reference + 1
    # The mean is 100. All values except two are equal to the mean.
    return mnse_published(image, reference)[1], float(np.isfinite(nmse(image, reference)))


def inverted_test() -> Pair:
    """Share of triangles of a teapot that take Gouraud shading: by the test as published, and inverted."""
    scene = scene_for(teapot(1_000), 50, 160, 120)
    every = len(scene.mesh.faces)
    # The tests of highlight and diffuse term are off, because the inversion does not change them.
    close = int(gouraud_triangles(scene, Thresholds(highlight=math.inf, diffuse=math.inf)).sum())
    return (every - close) / every, close / every


def extrapolated_end() -> Pair:
    """Error of the last normal of a span of 10 degrees and 6 pixels, by [T] appendix Г and with N_l added."""
    angle, pixels = math.radians(10), 6
    left, right = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    power = 1 << (pixels - 2).bit_length()
    published, right_end = (start + power / (pixels - 1) * (right - left) for start in (np.zeros(3), left))
    return tuple(
        float(np.linalg.norm(normalise((1 - t) * left + t * end) - right))
        for end in (published, right_end)
        for t in [(pixels - 1) / power]
    )


def scaled_in_place() -> Pair:
    """Error of the last normal of a span of 10 degrees and 6 pixels, with ``dN`` times i/5 at pixel i.

    The first result scales ``dN`` itself at each pixel, the second result a copy.
    """
    angle, pixels = math.radians(10), 6
    left, right = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    shares = np.arange(pixels) / (pixels - 1)
    return tuple(
        float(np.linalg.norm(left + scale * (right - left) - right)) for scale in (shares.prod(), shares[-1])
    )


def wrong_variable() -> Pair:
    """Largest error of ``P0 x + P1 y + P2`` at three corners: with P1 x as second term, and as written."""
    corners = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    values = np.array([0.2, 0.4, 0.9])
    plane = np.linalg.solve(corners, values)
    wrong = plane[0] * corners[:, 0] + plane[1] * corners[:, 0] + plane[2]
    return tuple(float(np.abs(found - values).max()) for found in (wrong, corners @ plane))


def energy(model: str, exponent: int) -> Pair:
    """Reflected energy, ideally 1: with the published energy factor, and with the right factor."""
    half = 2 if model == "blinn" else 1
    reflected = quad(
        lambda t: math.cos(t / half) ** exponent * math.cos(t) * math.sin(t), 0, math.pi / 2, epsabs=1e-13
    )[0]
    n = exponent
    published = {"phong": (n + 2) / (2 * n), "blinn": (n + 2) * (n + 4) / (8 * n * (2 ** (n / 2) + n))}
    return tuple(
        2 * math.pi * factor * reflected
        for factor in (published[model], REFLECTION_MODELS[model].energy_factor(n))
    )


def mirror() -> Pair:
    """Length of R for L at 54.7 degrees: by vector products, as published, and by scalar products."""
    normal, light = np.array([0.0, 0, 1]), normalise(np.array([1.0, 1, 1]))
    published = 2 * np.cross(np.cross(light, normal), normal) - light
    right = 2 * (light @ normal) * normal - light
    return float(np.linalg.norm(published)), float(np.linalg.norm(right))


def zone_error() -> float:
    """Largest relative error of f2 where Blinn's model is at least `ZONE`, for n from 2 to 1000."""
    exponents = np.arange(2, 1001)
    base = exponents / 2 * np.expm1(math.log(ZONE) / exponents) + 1
    return float(np.max(1 - base**2 / ZONE))


CLAIMS = (
    Claim(
        "[T] table 3.1, last row",
        "74.547",
        "error of the polynomial at x = 0.96, rad",
        misprint,
        ours="74.457",
        kind="slip",
    ),
    Claim(
        "[T] table 3.1, columns A, B, C",
        "columns A, B, C, which could also mean A x^2 + B x + C",
        "largest error on [0, 0.5], rad",
        order,
        ours="A + B x + C x^2",
        kind="unclear",
    ),
    Claim(
        "[T] table 3.1, error",
        "0.2 %, which we read as the error of every row",
        "largest relative error on [0, 0.96]",
        arccos_rows,
        printed="0.002",
        ours="its own digits give more on [0.75, 0.96]",
        kind="figure",
    ),
    Claim(
        "[T] 3.2",
        "a quadratic on [0.96, 1]",
        "largest error on [0.96, 1], corrected, rad",
        arccos_at_one,
        ours="sqrt(1 - x) times a polynomial, or the half-chord: at x = 1 arccos has the slope of a root",
        kind="form",
    ),
    Claim(
        "[T] 2.1, degree 1",
        "0.64 - 0.07 z: 0.12 %",
        "largest relative error on [sqrt 2, 2]",
        root_error,
        {"degree": 1, "relative": True},
        printed="0.0012",
        ours="0.12 % is the error of the coefficients before they were rounded",
        kind="figure",
        matter="digits-2.1",
    ),
    Claim(
        "[T] 2.1, degree 1",
        "0.0005",
        "largest error on [sqrt 2, 2]",
        root_least,
        printed="0.0005",
        ours="no line has less than 6.1e-4",
        kind="figure",
        matter="digits-2.1",
    ),
    Claim(
        "[T] 2.1, degree 2",
        "0.014 z^2 - 0.119 z + 0.681: 2e-5, 0.004 %",
        "largest error on [sqrt 2, 2]",
        root_error,
        {"degree": 2, "relative": False},
        printed="0.00002",
        ours="both are errors of the coefficients before they were rounded",
        kind="figure",
        matter="digits-2.1",
    ),
    Claim(
        "[T] 2.2, h of degree 3",
        "0.00038, 0.054 %",
        "largest error, r from 0 to 1",
        factor_error,
        printed="0.00038",
        ours="both are errors of the coefficients before they were rounded",
        kind="figure",
    ),
    Claim(
        "[T] figure 3.6",
        "the comparator is behind the square",
        "highlight at n = 20, gamma = 60 degrees",
        second_lobe,
        ours="compare the base, before it is squared",
        kind="slip",
    ),
    *(
        Claim(
            "[T] 3.3",
            "cos(psi/m) = (cos psi - 1)/m^2 + 1, approximately, for small psi",
            f"1 - cos(psi/m), divided by its exact value, psi = {degrees} degrees",
            shortcut,
            {"degrees": degrees},
            ours="4 sin^2(psi/2m)/2 for 1 - cos(psi/m)",
            kind="form",
            matter="shortcut",
        )
        for degrees in (10, 60)
    ),
    *(
        Claim(
            "[T] figure 3.5",
            "x(t+1) = 2 cos d x(t) - x(t-1), exact except for rounding",
            f"worst error: {pixels} pixels, {degrees} degrees, {bits} fraction bits",
            recurrence,
            {"pixels": pixels, "degrees": degrees, "bits": bits},
            ours="Reinsch's form",
            kind="form",
            matter="recurrence",
        )
        for pixels, degrees, bits in ((64, 10, 16), (256, 60, 16), (4095, 60, 24))
    ),
    Claim(
        "[T] 4.1, worked example",
        "0.3445, with 0.0015 for the highlight; 0.577^10 = 0.003 would give this",
        "intensity",
        worked_example,
        printed="0.3445",
        ours="0.577^10 is 0.0041",
        kind="slip",
    ),
    Claim(
        "[T] 4.1, MNSE",
        "each error divided by its own pixel's distance from the mean",
        "share of a flat picture's values for which MNSE is defined",
        flat_picture,
        ours="sum of errors divided by sum of distances (NMSE)",
        kind="form",
    ),
    Claim(
        "[T] appendix В",
        "Phong shading where normals are close",
        "share of the triangles of a teapot of 992 for which the test of normals chooses Gouraud shading",
        inverted_test,
        ours="Gouraud shading where normals are close",
        kind="slip",
    ),
    Claim(
        "[T] appendix Г, NormalVector",
        "the end vector is extrapolated without the start vector",
        "error of the last normal, 10 degrees, 6 pixels",
        extrapolated_end,
        ours="N_l + g (N_r - N_l)",
        kind="slip",
    ),
    Claim(
        "[T] appendix Г, NormalVector",
        "dN is scaled in place at every pixel, from i = 0 on; we read the factor as i/(m - 1)",
        "error of the last normal, 10 degrees, 6 pixels",
        scaled_in_place,
        ours="a scaled copy; dN itself does not change",
        kind="slip",
    ),
    Claim(
        "[T] appendix Д",
        "P[1]*x in green",
        "error of green at a corner with a given value, intensities 0.2, 0.4, 0.9",
        wrong_variable,
        ours="P[1]*y",
        kind="slip",
    ),
    Claim(
        "[C], Phong's normalising coefficient",
        "(n+2)/2n",
        "reflected energy at n = 10, ideally 1",
        energy,
        {"model": "phong", "exponent": 10},
        ours="(n+2)/(2 pi)",
        kind="reading",
        matter="normalising",
    ),
    Claim(
        "[C], Blinn's normalising coefficient",
        "((n+2)(n+4))/(8n(2^(n/2)+n))",
        "reflected energy at n = 10, ideally 1",
        energy,
        {"model": "blinn", "exponent": 10},
        ours="((n+2)(n+4))/(8 pi (2^(-n/2)+n))",
        kind="reading",
        matter="normalising",
    ),
    Claim(
        "[C], mirror direction",
        "R = 2 (L x N) x N - L",
        "length of R, ideally 1",
        mirror,
        ours="R = 2 (L·N) N - L: the products are scalar",
        kind="reading",
    ),
    Claim(
        "[C], epicentre zone",
        "7.924 % in a zone that is not defined",
        "largest relative error of f2 in the zone",
        zone_error,
        printed="0.07924",
        ours=f"where Blinn's model is at least {ZONE}",
        kind="unclear",
    ),
)
"""Printed statements of the documents."""


def matters() -> dict[str, int]:
    """Number of different matters in `CLAIMS`, for each kind in the order of `KINDS`."""
    found = {(claim.kind, claim.matter or (claim.source, claim.stated)) for claim in CLAIMS}
    return {kind: sum(one == kind for one, _ in found) for kind in KINDS}


_DOCUMENT = Document(
    "errata",
    "Errata of the documents",
    [
        f"This section has {sum(matters().values())} matters in {len(CLAIMS)} entries. Each entry has a "
        "quantity that anyone can compute again: by the printed statement, and by our correction or form. "
        f"Not every entry is an error: {matters()['form']} matters are forms that are good in "
        "their range. The units keep the published constants as named variants. The other sections show "
        "the effect of these constants.",
    ],
    [
        ClaimTable(
            "errata",
            "Printed statements of the documents, and measured values",
            lambda quick: CLAIMS,
            "Kinds: "
            + "; ".join(f"*{kind}*, {meaning}" for kind, meaning in KINDS.items())
            + ". Printed: a value "
            "that the document prints with its digits, or a value that we compute from the printed "
            "statement. docs/theory/errata.md describes the listings of [T].",
        )
    ],
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
