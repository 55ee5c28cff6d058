"""Ways in software to the normals, or to N·L and N·H, of a span."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from blysk.bench.report.counted import dot
from blysk.bench.report.errata import FACTOR_PUBLISHED, ROOT_PUBLISHED

__all__ = ["DIVIDED", "SCALED", "SPANS", "WAYS", "WIDEST", "Way", "random_operands"]


SPANS = 4096
"""Spans that the ways in software compute at a time. They are few, so their arrays stay in a cache."""

WIDEST = 45.0

# The ways in software. Each takes the spans' ends, L and H as arrays of three rows. It yields an array for
# each place in a span, with the pixels of all spans at this place. A loop is over places, because each value
# follows from the value before.

Way = Callable[[np.ndarray, np.ndarray, np.ndarray, int], Iterator[np.ndarray]]


def _divided(vector: np.ndarray) -> np.ndarray:
    return vector / np.sqrt(dot(vector, vector))


def _scaled(vector: np.ndarray) -> np.ndarray:
    return vector * (1 / np.sqrt(dot(vector, vector)))


def _polynomial(coefficients: Sequence[float], x: np.ndarray) -> np.ndarray:
    """Horner's rule for coefficients in ascending order."""
    *rest, total = coefficients
    for coefficient in reversed(rest):
        total = total * x + coefficient
    return total


def _middle(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Middle normal by the h polynomial ([T] 2.2)."""
    return (left + right) * _polynomial(FACTOR_PUBLISHED, dot(left, right))


def _lines(normalised, left, right, vectors, pixels):
    step = (right - left) / (pixels - 1)
    vector = left
    for _ in range(pixels):
        yield normalised(vector)
        vector = vector + step


def _forward_differences(left, right, vectors, pixels):
    """Normals by forward differences of the quadratic method ([T] 2.2 and figure 2.10)."""
    middle = 4 * _middle(left, right)
    dt = 1 / (pixels - 1)
    curvature = (2 * (left + right) - middle) * dt
    first = (curvature + (middle - right - 3 * left)) * dt
    second = 2 * dt * curvature
    normal = left
    for _ in range(pixels):
        yield normal
        normal = normal + first
        first = first + second


def _middles(normalised, left, right, vectors, pixels):
    yield normalised(left + right)


def _middles_by_factor(left, right, vectors, pixels):
    yield _middle(left, right)


def _halves(half, left, right, pixels):
    """Normals between two normals by bisection, from left to right.

    ``half(left, right, level)`` is the middle normal of two normals.
    """
    levels = pixels.bit_length() - 1

    def between(left, right, level):
        if level == levels:
            return
        middle = half(left, right, level)
        yield from between(left, middle, level + 1)
        yield middle
        yield from between(middle, right, level + 1)

    return between(left, right, 0)


def _bisection_normalised(normalised, left, right, vectors, pixels):
    return _halves(lambda a, b, level: normalised(a + b), left, right, pixels)


def _bisection(left, right, vectors, pixels):
    """Bisection by ``(N_a + N_b) p(z)``, ``z = 2 N_a·N_b`` ([T] 2.1)."""
    folded = [coefficient * 2.0**power for power, coefficient in enumerate(ROOT_PUBLISHED[2])]
    return _halves(lambda a, b, level: (a + b) * _polynomial(folded, dot(a, b)), left, right, pixels)


def _bisection_by_levels(left, right, vectors, pixels):
    """`_bisection` with one factor for all arcs of a level. From level to level z becomes ``sqrt(2 + z)``."""
    z = 2 * dot(left, right)
    factors = []
    for _ in range(pixels.bit_length() - 1):
        factors.append(_polynomial(ROOT_PUBLISHED[2], z))
        z = np.sqrt(2 + z)
    return _halves(lambda a, b, level: (a + b) * factors[level], left, right, pixels)


def _cosines_normalised(normalised, left, right, vectors, pixels):
    direction, halfway = vectors
    for normal in _lines(normalised, left, right, vectors, pixels):
        yield np.stack([dot(normal, direction), dot(normal, halfway)])


def _turn(left, right, vectors):
    """Angle of the spans, and cosines of both vectors to the left end and to the unit tangent there."""
    cosine = dot(left, right)
    angle = np.arccos(cosine)
    first, last = (np.stack([dot(end, vector) for vector in vectors]) for end in (left, right))
    return angle, first, (last - cosine * first) / np.sin(angle)


def _cosines_by_angles(left, right, vectors, pixels):
    """N·L and N·H by ``cos beta cos(lambda - t psi)`` ([T] 3.1)."""
    angle, cosines, sines = _turn(left, right, vectors)
    amplitude = np.sqrt(cosines * cosines + sines * sines)
    phase = np.arctan2(sines, cosines)
    step = angle / (pixels - 1)
    for _ in range(pixels):
        yield amplitude * np.cos(phase)
        phase = phase - step


def _recurrence(left, right, vectors, pixels):
    """N·L and N·H by the recurrence ``x(t+1) = 2 cos d x(t) - x(t-1)`` ([T] 3.3)."""
    angle, before, sines = _turn(left, right, vectors)
    step = angle / (pixels - 1)
    cosine = np.cos(step)
    now = before * cosine + sines * np.sin(step)
    twice = 2 * cosine
    for _ in range(pixels):
        yield before
        before, now = now, twice * now - before


DIVIDED = "normalised, three divisions"

SCALED = "normalised, one division"

WAYS: dict[str, Way] = {
    f"middle, {DIVIDED}": partial(_middles, _divided),
    f"middle, {SCALED}": partial(_middles, _scaled),
    "middle by h(r)": _middles_by_factor,
    f"bisection, {DIVIDED}": partial(_bisection_normalised, _divided),
    f"bisection, {SCALED}": partial(_bisection_normalised, _scaled),
    "bisection, a factor each": _bisection,
    "bisection, a factor a level": _bisection_by_levels,
    f"line, {DIVIDED}": partial(_lines, _divided),
    f"line, {SCALED}": partial(_lines, _scaled),
    "forward differences": _forward_differences,
    f"line, {DIVIDED}, N·L and N·H": partial(_cosines_normalised, _divided),
    f"line, {SCALED}, N·L and N·H": partial(_cosines_normalised, _scaled),
    "a cosine of each angle": _cosines_by_angles,
    "recurrence": _recurrence,
}
"""Ways by name. A way computes, for the pixels of spans, either the normals, or N·L and N·H.

A way is a function of the left ends, the right ends, (L, H) and the number of pixels. Vectors are arrays of
shape (3, spans) or (3, 1). A way yields an array for each pixel in turn. The shape is (3, spans) for normals,
and (2, spans) for N·L and N·H.
"""


def random_operands(seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of random spans, up to `WIDEST` degrees, and a unit L and H."""
    rng = np.random.default_rng(seed)
    left, normal = rng.normal(size=(2, 3, SPANS))
    left = _divided(left)
    normal = _divided(normal - dot(normal, left) * left)
    angle = np.radians(rng.uniform(0.1, WIDEST, SPANS))
    vectors = rng.normal(size=(2, 3, 1))
    return left, left * np.cos(angle) + normal * np.sin(angle), np.stack([_divided(v) for v in vectors])
