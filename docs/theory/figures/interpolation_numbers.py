"""Numbers of interpolation.md."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from markdown import table
from numpy.polynomial.polynomial import polyval

from blysk.bench.report.errata import FACTOR_PUBLISHED, ROOT_PUBLISHED
from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import SEGMENT_BOUNDS, Arccos
from blysk.golden.cosines.half_chord import HalfChord
from blysk.golden.cosines.recurrence import Recurrence, shortcut_cosine
from blysk.golden.normals.adaptive_normaliser import AdaptiveNormaliser
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.middle_normal import MIDDLE_NORMAL_FITS, MiddleNormal
from blysk.golden.normals.renormaliser import Renormaliser
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.polynomials import half_angle_factor, largest_error, minimax, reciprocal_root
from blysk.golden.number.unit_vector import COMPONENT, ONE, quantise
from blysk.golden.reference.curves import interpolate
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.reflection import COSQUAD

_ANGLES = (5, 10, 20, 45, 90)


def _span(degrees: float) -> tuple[np.ndarray, np.ndarray]:
    angle = math.radians(degrees)
    return np.array([0.0, 0, 1]), np.array([math.sin(angle), 0, math.cos(angle)])


def curve_errors(degrees: float) -> tuple[float, float, float, float]:
    """Length error of the line, length and vector error of the quadratic, turn of the line in degrees."""
    t = np.linspace(0, 1, 20_001)
    curves = {
        name: interpolate(name, *_span(degrees), t) for name in ("linear", "slerp", "quadratic", "normalised")
    }
    length = {name: np.abs(np.linalg.norm(curve, axis=1) - 1).max() for name, curve in curves.items()}
    vector = np.linalg.norm(curves["quadratic"] - curves["slerp"], axis=1).max()
    turn = np.degrees(np.linalg.norm(curves["normalised"] - curves["slerp"], axis=1).max())
    return float(length["linear"]), float(length["quadratic"]), float(vector), float(turn)


def _curves() -> str:
    rows = []
    for degrees in _ANGLES:
        line, length, vector, turn = curve_errors(degrees)
        rows.append([f"{degrees}°", f"{line:.1e}", f"{length:.1e}", f"{vector:.1e}", f"{turn:.1g}°"])
    head = ["psi", "line: length", "quadratic: length", "quadratic: distance from the great circle"]
    return table([*head, "normalised line: angle to the great circle"], rows, 0)


def _polynomial(coefficients: Sequence[float], variable: str) -> str:
    terms = [f"{coefficients[0]:.4g}"]
    for power, c in enumerate(coefficients[1:], 1):
        if c:
            sign = "-" if c < 0 else "+"
            terms.append(f"{sign} {abs(c):.4g} {variable}{f'^{power}' if power > 1 else ''}")
    return f"`{' '.join(terms)}`"


def _by_cosine(r: np.ndarray) -> np.ndarray:
    return half_angle_factor(1 - r)


def _gap(v: np.ndarray) -> np.ndarray:
    return reciprocal_root(2 - v)


_ROOT, _FACTOR = (math.sqrt(2), 2.0), (0.0, 1.0)


def _fits() -> str:
    cases = [
        ("`1/sqrt(2+z)`, z in [sqrt 2, 2]", "printed", reciprocal_root, ROOT_PUBLISHED[1], _ROOT, "z", 2),
        ("", "least error", reciprocal_root, minimax(reciprocal_root, *_ROOT, 1), _ROOT, "z", 2),
        ("", "printed", reciprocal_root, ROOT_PUBLISHED[2], _ROOT, "z", 2),
        ("", "least error", reciprocal_root, minimax(reciprocal_root, *_ROOT, 2), _ROOT, "z", 2),
        ("`h(r)`, r in [0, 1]", "least error", _by_cosine, minimax(_by_cosine, *_FACTOR, 2), _FACTOR, "r", 1),
        ("", "printed", _by_cosine, FACTOR_PUBLISHED, _FACTOR, "r", 1),
        ("", "least error", _by_cosine, minimax(_by_cosine, *_FACTOR, 3), _FACTOR, "r", 1),
    ]
    for most, terms in ((1.0, 3), (0.5, 2), (0.5, 3)):
        fit = minimax(half_angle_factor, 0, most, terms, {0: 0.5})
        name = f"`h`, u = 1 - r in [0, {most:g}]"
        cases.append((name, "exact at u = 0", half_angle_factor, fit, (0.0, most), "u", 0))
    domain = 0.0, 2 - math.sqrt(2)
    for terms in (2, 3):
        fit = minimax(_gap, *domain, terms, {0: 0.5})
        cases.append(("`1/sqrt(4-v)`, v = 2 - z", "exact at v = 0", _gap, fit, domain, "v", 0))
    rows = []
    for name, kind, function, fit, domain, variable, flat in cases:
        absolute, relative = largest_error(function, np.array(fit), *domain)
        at_zero = polyval(flat, fit) * 2 - 1
        lost = "0" if abs(at_zero) < 1e-12 else f"{at_zero:.1e}"
        rows.append([name, kind, _polynomial(fit, variable), f"{absolute:.1e}", f"{100 * relative:.2g} %"])
        rows[-1] += [lost]
    head = ["function", "fit", "polynomial", "largest error", "relative", "length error at psi = 0"]
    return table(head, rows, 3)


def _words() -> str:
    rows = []
    for fit in MIDDLE_NORMAL_FITS:
        unit = MiddleNormal(fit)
        rows.append([f"middle normal, `{fit}`", f"{unit.model_error:.1e}", f"{unit.error:.1e}"])
    for degree in (1, 2):
        for as_published in (False, True):
            unit = Bisection(degree, as_published=as_published)
            name = f"bisection, degree {degree}{', as published' * as_published}"
            rows.append([name, f"{unit.model_error(False):.1e}", f"{unit.error(False):.1e}"])
    return table(["unit, spans to 45°", "model error of the factor", "bound of a component"], rows)


def _segments() -> str:
    tables = ("as_published", "corrected", "refitted")
    rows = []
    for segment, (low, high) in enumerate(pairwise(SEGMENT_BOUNDS)):
        x = np.linspace(low, high, 20_001)
        exact = np.arccos(x)
        row = [f"[{low:g}, {high:g}]"]
        for name in tables:
            error = np.abs(polyval(x, Arccos(name).coefficients[segment]) - exact)
            relative = float((error[exact > 0] / exact[exact > 0]).max())
            row += [f"{error.max():.2g}", "unbounded" if high == 1 else f"{relative:.2%}"]
        rows.append(row)
    head = ["segment of x"]
    for name in tables:
        head += [f"{name.replace('_', ' ')}, rad", "relative"]
    return table(head, rows)


def _roots() -> list[tuple[int, float]]:
    """Relative errors of ``sqrt(1 - x) p(x)`` by degree, over all of [0, 1]."""

    def ratio(x):
        # arccos x = 2 arcsin sqrt((1 - x)/2), which keeps its digits at 1.
        root = np.sqrt(np.maximum(1 - x, 1e-14))
        return 2 * np.arcsin(root / math.sqrt(2)) / root

    return [(degree, largest_error(ratio, minimax(ratio, 0, 1, degree), 0, 1)[1]) for degree in (1, 2, 3)]


def recurrence_error(form: str, pixels: int, degrees: float, bits: int) -> float:
    """Worst error of the recurrence over a span, the peak at 0.79 of it; Reinsch's with 20 guard bits."""
    angle = math.radians(degrees)
    step = angle / (pixels - 1)
    unit = Recurrence(form, fraction_bits=bits, guard_bits=20)
    one = np.ones(1)
    coefficient, shift = unit.coefficient(step * one)
    states = unit.states(*unit.start(one, 0.79 * angle * one, step * one), coefficient, shift, pixels)
    exact = np.cos(0.79 * angle - step * np.arange(pixels))
    # Reinsch's register holds half a step of the multiplier's operand more.
    more = 2.0 ** -(bits + 1) if form == "reinsch" else 0.0
    return float(np.abs(states.values[:, 0].astype(float) - more - exact).max())


def _recurrences() -> str:
    rows = []
    for pixels, degrees, bits in ((64, 10, 16), (256, 60, 16), (4095, 60, 24), (4095, 60, 32)):
        angle = math.radians(degrees)
        row = [str(pixels), f"{degrees}°", str(bits)]
        for form in ("direct", "reinsch"):
            if form == "reinsch" and bits == 32:
                # Its products outgrow the model's words.
                row += ["", ""]
                continue
            bound = float(Recurrence(form, bits, 20).error(np.array([pixels]), np.array([angle]))[0])
            # The bound has the rounding of the result to 17 bits, the state has not.
            shown = "none" if bound >= 3 else f"{bound - 2.0**-18:.1e}"
            row += [f"{recurrence_error(form, pixels, degrees, bits):.1e}", shown]
        rows.append(row)
    head = ["pixels", "psi", "F", "direct", "its bound", "Reinsch", "its bound"]
    return table(head, rows, 0)


def _steps() -> str:
    """How far the angular setup is off, by where psi comes from."""
    rng = np.random.default_rng(1)
    rows = []
    units = {
        "half chord": AngularSetup(),
        "arccos, refitted": AngularSetup("arccos"),
        "arccos, corrected": AngularSetup("arccos", Arccos("corrected")),
        "arccos, as published": AngularSetup("arccos", Arccos("as_published")),
    }
    angles = (0.0001, 1, 10, 45)
    spans = [_random_spans(rng, degrees, 2000) for degrees in angles]
    for name, unit in units.items():
        rows.append([name, *(f"{_setup_error(unit, *span):.1e}" for span in spans)])
    return table(["psi from", *(f"{degrees:g}°" for degrees in angles)], rows)


def _random_spans(rng: np.random.Generator, degrees: float, count: int) -> list[np.ndarray]:
    left, across, halfway = rng.normal(size=(3, count, 3))
    left, halfway = normalise(left), normalise(halfway)
    across = normalise(across - (across * left).sum(axis=1, keepdims=True) * left)
    angle = math.radians(degrees)
    return [quantise(v) for v in (left, math.cos(angle) * left + math.sin(angle) * across, halfway)]


def _setup_error(unit: AngularSetup, left: np.ndarray, right: np.ndarray, halfway: np.ndarray) -> float:
    """Largest error of cos gamma at the ends and between, against the great circle through the codes."""
    words = [Fixed(COMPONENT, codes) for codes in (left, right, halfway)]
    pixels = np.full(len(left), 65)
    _, phase, step, amplitude, _ = unit.compute(*words, pixels)
    index = np.arange(65)[:, np.newaxis]
    found = amplitude.values * np.cos(2 * np.pi * (phase.values - index * step.values))
    a, b = ((n * halfway).sum(axis=1) / ONE**2 for n in (left, right))
    chord = np.linalg.norm(right - left, axis=1) / ONE
    psi = 2 * np.arcsin(np.minimum(chord / 2, 1))
    t = index / 64
    sine = np.where(psi > 0, np.sin(psi), 1)
    exact = np.where(psi > 0, (a * np.sin((1 - t) * psi) + b * np.sin(t * psi)) / sine, a + t * (b - a))
    return float(np.abs(found - exact).max())


def _true_spans() -> tuple[float, float]:
    """Largest difference of the two forms of a span with lengths, and of the shift from its formula."""
    rng = np.random.default_rng(1)
    left, right = normalise(rng.normal(size=(2, 1000, 1, 3)))
    lengths = rng.uniform(0.2, 5, (2, 1000, 1))
    t = np.linspace(0, 1, 1001)
    moved = t * lengths[1] / ((1 - t) * lengths[0] + t * lengths[1])
    line = ((1 - t) * lengths[0])[..., np.newaxis] * left + (t * lengths[1])[..., np.newaxis] * right
    same = np.abs(normalise(line) - interpolate("normalised", left, right, moved)).max()
    root = np.sqrt(lengths[1] / lengths[0])[:, 0]
    shift = np.abs(moved - t).max(axis=1)
    return float(same), float(np.abs(shift - np.abs(root - 1) / (root + 1)).max())


def _sentences() -> list[str]:
    angle = math.radians(1)
    cosine_error = (math.acos(math.cos(angle) - 2.0**-17) - angle) / angle
    roots = dict(_roots())
    shortcut = [
        1 - float((1 - shortcut_cosine(math.radians(d), 1000)) / (2 * math.sin(math.radians(d) / 2000) ** 2))
        for d in (10, 60)
    ]
    q = (1 - 0) / 4
    depths = [AdaptiveNormaliser(2.0**-k).depth for k in (10, 14)]
    same, shift = _true_spans()
    assert same < 1e-12
    assert shift < 1e-5
    bits = [math.log2(4095 * 2.0**18), math.log2(4095**2 / 2 * 2.0**18)]
    turn = max(curve_errors(d)[3] / math.degrees(math.radians(d) ** 3) for d in (20, 45, 60))
    # Length of a flat face's normals by the plain cubic, and what the peak of `cosquad` loses by it.
    short = 2 * float(minimax(_by_cosine, *_FACTOR, 3).sum())
    lost = [255 * (1 - float(COSQUAD.reflect(short, n))) for n in (100, 1000)]
    return [
        f"the peak by {lost[0]:.1f} LSB at n = 100, and by {lost[1]:.1f} LSB at n = 1000",
        f"at 45° this is {float(half_angle_factor(1 - math.cos(math.radians(45)))) - 0.5:.4f}",
        f"{(q + q * q) / (1 - math.cos(math.radians(45))) - 1:.1%} at most, for k = 0 at 90°",
        f"a threshold of 2^-10 needs at most {depths[0]} levels, and a threshold of 2^-14 needs {depths[1]}",
        f"A cosine of 16 fraction bits, half a step off, costs {cosine_error:.1%} of psi at 1°",
        f"{roots[1]:.2%}, {roots[2]:.3%} and {roots[3]:.4%} for degree 1, 2 and 3",
        f"relative error of at most {HalfChord.RELATIVE_ERROR:.1e}",
        f"too small by {shortcut[0]:.1%} at psi = 10° and by {shortcut[1]:.1%} at 60°",
        f"about {bits[0]:.0f} fraction bits for the first difference and {bits[1]:.0f} for the second",
        f"{2.0**-42 * (4094 + 4094**2 / 2):.1e} after 4,095 pixels with the 42 fraction bits",
        f"off by at most {Renormaliser.LENGTH_ERROR:.1e}, 2^{math.log2(Renormaliser.LENGTH_ERROR):.1f}",
        f"the direction of N by at most 2^{math.log2(Renormaliser.DIRECTION_ERROR):.1f}",
        f"at most {turn:.3f} psi^3 up to 60°",
        f"(sqrt 1.1 - 1)/(sqrt 1.1 + 1) = {(math.sqrt(1.1) - 1) / (math.sqrt(1.1) + 1):.4f}",
    ]


TABLES: dict[str, Callable[[], str]] = {
    "normal-curves": _curves,
    "fits": _fits,
    "factors": _words,
    "arccos": _segments,
    "angles": _steps,
    "recurrences": _recurrences,
}
SENTENCES: dict[str, Callable[[], list[str]]] = {"interpolation.md": _sentences}
