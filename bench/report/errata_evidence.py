"""Evidence of each erratum of the documents: figures as published, and as they come out."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq, linprog

from blysk.bench.accuracy import scene_for
from blysk.bench.report.cosine_quadratic_figures import ZONE
from blysk.golden.cosines.arccos import PUBLISHED_COEFFICIENTS, SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.recurrence import Recurrence, shortcut_cosine
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax, reciprocal_root
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Light, Material, intensity
from blysk.golden.reference.metrics import mnse_published, nmse
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import Thresholds, gouraud_triangles
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "FACTOR_PUBLISHED",
    "ROOT_PUBLISHED",
    "Evidence",
    "arccos_at_one",
    "arccos_claim",
    "chebyshev",
    "energy",
    "extrapolated_end",
    "factor_claim",
    "factor_quadratics",
    "flat_picture",
    "held_root",
    "inverted_test",
    "mirror",
    "misprint",
    "octaves",
    "order",
    "quadratic_length",
    "recurrence",
    "root_claim",
    "root_least",
    "scaled_in_place",
    "second_lobe",
    "shortcut",
    "undefined_zone",
    "worked_example",
    "wrong_variable",
    "zone_bounds",
]


ROOT_PUBLISHED = {1: (0.64, -0.07), 2: (0.681, -0.119, 0.014)}
"""[T] 2.1: ``1/sqrt(2 + z)`` in ascending powers of z, by degree."""

FACTOR_PUBLISHED = (0.707, -0.341, 0.193, -0.059)
"""[T] 2.2: ``h(r) = 1/sqrt(2 (1 + r))`` in ascending powers of r."""

_ROOT_DOMAIN = (math.sqrt(2), 2.0)

Evidence = tuple[float, float]
"""A quantity twice: by the published and by the right statement."""


def _by_cosine(r: np.ndarray) -> np.ndarray:
    return half_angle_factor(1 - r)


def _row_error(coefficients: Sequence[float], x: np.ndarray) -> float:
    found = np.polynomial.polynomial.polyval(x, coefficients)
    return float(np.abs(found - np.arccos(x)).max())


# Evidence, in the order of the list.


def misprint() -> Evidence:
    """Error in rad of the last row of the arccos table at x = 0.96: as published, and corrected."""
    return tuple(_row_error(Arccos(table).coefficients[4], 0.96) for table in ("as_published", "corrected"))


def order() -> Evidence:
    """Largest error in rad of the first row of the arccos table: coefficients read downwards, and upwards."""
    x = np.linspace(0, 0.5, 501)
    return _row_error(PUBLISHED_COEFFICIENTS[0][::-1], x), _row_error(PUBLISHED_COEFFICIENTS[0], x)


def arccos_claim() -> Evidence:
    """Largest relative error of the first four rows of the arccos table: as claimed, and as computed."""
    worst = [
        largest_error(np.arccos, PUBLISHED_COEFFICIENTS[k], *SEGMENT_BOUNDS[k : k + 2])[1] for k in range(4)
    ]
    return 0.002, max(worst)


def arccos_at_one() -> Evidence:
    """Largest error in rad near x = 1: of a quadratic in x, and of a quadratic times the root of 1 - x."""
    x = 1 - np.geomspace(1e-12, 0.04, 4001)
    error = np.polynomial.polynomial.polyval(x, Arccos("corrected").coefficients[4]) - np.arccos(x)
    # The well-posed form, over the same x.
    root = np.sqrt(1 - x) * np.polynomial.polynomial.polyval(x, [1.5702117, -0.20212057, 0.04670706])
    return float(np.abs(error).max()), float(np.abs(root - np.arccos(x)).max())


def root_claim(degree: int, claimed: float, relative: bool = False) -> Evidence:
    """Largest error of the published polynomial for ``1/sqrt(2 + z)``: as claimed, and as computed."""
    return claimed, largest_error(reciprocal_root, np.array(ROOT_PUBLISHED[degree]), *_ROOT_DOMAIN)[relative]


def root_least() -> Evidence:
    """Largest error of a line for ``1/sqrt(2 + z)``: as claimed, and the least there is."""
    return 0.0005, largest_error(reciprocal_root, minimax(reciprocal_root, *_ROOT_DOMAIN, 1), *_ROOT_DOMAIN)[
        0
    ]


def chebyshev(
    function: Callable[[np.ndarray], np.ndarray], low: float, high: float, degree: int
) -> np.ndarray:
    """Coefficients, in ascending order, of the polynomial through the values at Chebyshev's nodes."""
    fit = np.polynomial.Chebyshev.interpolate(function, degree, [low, high])
    return fit.convert(kind=np.polynomial.Polynomial).coef


def factor_quadratics() -> dict[str, tuple[float, float]]:
    """Largest absolute and relative error of three quadratics for the factor of the middle normal.

    ``"nodes"``: through the values at Chebyshev's nodes; ``"relative"``: of the least largest relative error;
    ``"within"``: the same among those with an absolute error of 0.002 at most.
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


def factor_claim() -> Evidence:
    """Largest error of the published factor of the middle normal: as claimed, and as computed."""
    return 0.00038, largest_error(_by_cosine, np.array(FACTOR_PUBLISHED), 0, 1)[0]


def second_lobe() -> Evidence:
    """Term at 60 degrees and n = 20: of the parabola alone, and with the comparator."""
    cosine = math.cos(math.radians(60))
    return (20 / 2 * (cosine - 1) + 1) ** 2, float(REFLECTION_MODELS["cosquad"].reflect(cosine, 20))


def shortcut(degrees: float) -> Evidence:
    """Ratio of ``1 - cos d`` by the published shortcut to the exact value, for a span's angle; and 1."""
    angle, steps = math.radians(degrees), 1000
    exact = 2 * math.sin(angle / steps / 2) ** 2
    return float((1 - shortcut_cosine(angle, steps)) / exact), 1.0


def recurrence(pixels: int, degrees: float, bits: int) -> Evidence:
    """Worst error of a recurrence over a span, with its peak at 0.79: as drawn, and in Reinsch's form."""
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


def worked_example() -> Evidence:
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


def flat_picture() -> Evidence:
    """Share of the values of a flat picture where MNSE as published is defined; whether NMSE is."""
    reference = np.full((8, 8), 100.0)
    reference[0, 0] = 200
    reference[0, 1] = 0
    image = reference + 1
    # The mean is 100: all but two values are at it.
    return mnse_published(image, reference)[1], float(np.isfinite(nmse(image, reference)))


def inverted_test() -> Evidence:
    """Share of triangles of a teapot that take Gouraud shading: by the test as published, and inverted."""
    scene = scene_for(teapot(1_000), 50, 160, 120)
    every = len(scene.mesh.faces)
    # Highlight and diffuse tests aside, which the inversion does not touch.
    close = int(gouraud_triangles(scene, Thresholds(highlight=math.inf, diffuse=math.inf)).sum())
    return (every - close) / every, close / every


def extrapolated_end() -> Evidence:
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


def scaled_in_place() -> Evidence:
    """Error of the last normal of the same span: with ``dN`` itself times i/5 at each pixel i, and a copy."""
    angle, pixels = math.radians(10), 6
    left, right = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    shares = np.arange(pixels) / (pixels - 1)
    return tuple(
        float(np.linalg.norm(left + scale * (right - left) - right)) for scale in (shares.prod(), shares[-1])
    )


def wrong_variable() -> Evidence:
    """Largest error of ``P0 x + P1 y + P2`` at three corners: with ``P1 x`` for ``P1 y``, and right."""
    corners = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    values = np.array([0.2, 0.4, 0.9])
    plane = np.linalg.solve(corners, values)
    wrong = plane[0] * corners[:, 0] + plane[1] * corners[:, 0] + plane[2]
    return tuple(float(np.abs(found - values).max()) for found in (wrong, corners @ plane))


def energy(model: str, exponent: int) -> Evidence:
    """Reflected energy, ideally 1: with the published energy factor, and with the right one."""
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


def mirror() -> Evidence:
    """Length of R for L at 54.7 degrees: by vector products, as published, and by scalar products."""
    normal, light = np.array([0.0, 0, 1]), normalise(np.array([1.0, 1, 1]))
    published = 2 * np.cross(np.cross(light, normal), normal) - light
    right = 2 * (light @ normal) * normal - light
    return float(np.linalg.norm(published)), float(np.linalg.norm(right))


def zone_error(bound: float) -> float:
    """Largest relative error of f2 where Blinn's model is at least ``bound``, for n from 2 to 1000."""
    exponents = np.arange(2, 1001)
    base = exponents / 2 * np.expm1(math.log(bound) / exponents) + 1
    return float(np.max(1 - base**2 / bound))


def undefined_zone() -> Evidence:
    """Largest relative error in the zone: as claimed, and with the zone that fits the claim, `ZONE`."""
    return 0.07924, zone_error(ZONE)


def octaves() -> Evidence:
    """Largest error in rad of arccos up to x = 1/2, by a quadratic and by a cubic."""
    return tuple(largest_error(np.arccos, minimax(np.arccos, 0, 0.5, degree), 0, 0.5)[0] for degree in (2, 3))


def zone_bounds() -> Evidence:
    """Largest relative error where Blinn's model is at least 0.594, and the bound that gives 7.924 %."""
    return zone_error(0.594), float(brentq(lambda bound: zone_error(bound) - 0.07924, 0.5, 0.7))


def quadratic_length() -> Evidence:
    """Largest error of the length of a quadratic normal at 45 degrees, and its place in the span, 0 to 1."""
    angle = math.radians(45)
    ends = np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])
    t = np.linspace(0, 1, 100_001)
    normals = interpolate("quadratic", *ends, t)
    length = np.abs(np.linalg.norm(normals, axis=1) - 1)
    return float(length.max()), float(t[length.argmax()])


def held_root() -> Evidence:
    """Largest error of a cubic for ``1/sqrt(2 + z)``, exact at angle 0: as shown, and with the best terms."""

    def gap(v):
        return reciprocal_root(2 - v)

    domain = 0.0, 2 - math.sqrt(2)
    shown = np.array([0.5, 0.0625277, 0.01144775, 0.00317987])
    best = minimax(gap, *domain, 3, {0: 0.5})
    return tuple(largest_error(gap, row, *domain)[0] for row in (shown, best))
