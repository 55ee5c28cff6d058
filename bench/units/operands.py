"""Operands for units: random codes, unit vectors, spans and lengths, with their corner cases."""

from collections.abc import Callable, Iterator

import numpy as np
from amaranth.lib.wiring import Component

from blysk.golden.lighting.highlight_operand import MAX_EXPONENT, HighlightOperand
from blysk.golden.normals.gpq import GPQ
from blysk.golden.normals.middle_normal import MAX_SPAN_ANGLE, MiddleNormal
from blysk.golden.number.fixed import Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT, ONE, ONE_SQUARED, quantise
from blysk.golden.reference.geometry import normalise
from blysk.sim.engines.beats import dtype_of

__all__ = [
    "AXIS",
    "LONG",
    "SPANS_45",
    "any_codes",
    "any_curves",
    "any_lengths",
    "any_pairs",
    "code_pairs_at",
    "component_words",
    "curves",
    "curves_of",
    "degrees_between",
    "dot",
    "exact_middle",
    "exponents",
    "highlight_codes",
    "light_constants",
    "log_lengths",
    "pairs_at",
    "pairs_chosen",
    "pairs_of_length",
    "pixel_of",
    "setup_spans",
    "short_lengths",
    "span_ends",
    "span_lengths",
    "sphere",
    "spread_angles",
    "turned",
    "unit_codes",
    "vectors_near",
    "word_corners",
    "word_ends",
]

SPANS_45 = "spans to 45 degrees"
LONG = "2 to 4095 pixels"
AXIS = (0, 0, ONE)
"""Codes of the unit vector along z."""


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot products along the last axis."""
    return np.einsum("...i,...i->...", a, b)


def component_words(*codes: np.ndarray) -> tuple[Fixed, ...]:
    """Vectors of codes as numbers of ``SQ(1, 17)``."""
    return tuple(Fixed(COMPONENT, code) for code in codes)


# Words.


def any_codes(rng: np.random.Generator, format: Format, *shape: int) -> np.ndarray:
    """Random codes of a format.

    Every third row has codes of every size. Every 16th row has the smallest code, the largest code, 0 or 1.
    """
    codes = rng.integers(format.min_code, format.max_code, shape, endpoint=True)
    codes[1::3] >>= rng.integers(0, format.width, codes[1::3].shape)
    ends = [format.min_code, format.max_code, 0, 1]
    codes[::16] = rng.choice(ends, codes[::16].shape)
    return rng.permutation(codes)


def word_ends(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Components: the smallest or the largest code, 0, 1 or -1."""
    return rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], shape)


def word_corners(*words: int) -> np.ndarray:
    """Codes of all pairs of vectors whose components are among given codes, shape (2, count, 3).

    Parameters
    ----------
    words : int
        The codes. By default the smallest code, the largest code, 0, 1 and -1.
    """
    words = words or (COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1)
    pairs = np.stack(np.meshgrid(*[words] * 6), axis=-1).reshape(-1, 2, 3)
    return np.moveaxis(pairs, 1, 0)


# Unit vectors.


def sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    """Unit vectors, uniform over the sphere."""
    return normalise(rng.normal(size=(count, 3)))


def unit_codes(rng: np.random.Generator, count: int) -> np.ndarray:
    """Codes of unit vectors, uniform over the sphere."""
    return quantise(sphere(rng, count))


def turned(rng: np.random.Generator, vectors: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Unit vectors at given angles from other vectors, in any direction."""
    across = rng.normal(size=vectors.shape)
    across = normalise(across - dot(across, vectors)[:, np.newaxis] * vectors)
    angle = np.radians(np.broadcast_to(degrees, len(vectors)))[:, np.newaxis]
    return vectors * np.cos(angle) + across * np.sin(angle)


def pairs_at(
    rng: np.random.Generator, count: int, degrees: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of unit normals at given angles, uniform over the sphere."""
    left = sphere(rng, count)
    return left, turned(rng, left, degrees)


def code_pairs_at(
    rng: np.random.Generator, count: int, degrees: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Codes of pairs of unit normals at given angles, uniform over the sphere."""
    left, right = pairs_at(rng, count, degrees)
    return quantise(left), quantise(right)


def pairs_of_length(
    rng: np.random.Generator, count: int, degrees: np.ndarray | float, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Codes of pairs of vectors of a given length. Pairs with a component over 1 are left out."""
    pairs = np.stack(pairs_at(rng, count, degrees)) * length
    left, right = np.rint(pairs[:, (np.abs(pairs) <= 1).all(axis=(0, 2))] * ONE).astype(np.int64)
    return left, right


def pairs_chosen(
    left: np.ndarray, right: np.ndarray, choose: Callable[[np.ndarray], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of vectors a of ``left`` and b of ``right`` for which ``choose`` accepts ``1 - a . b``.

    So a test can find the rare pairs for which the word of ``1 - a . b`` is at the border of a rounding.

    Parameters
    ----------
    left, right : int64 array, shape (count, 3)
        Codes of vectors.
    choose : callable
        Function from codes of ``1 - a . b`` with 34 fraction bits to booleans.
    """
    # Products and sums have 36 bits, which float64 holds.
    difference = ONE_SQUARED.codes - (left.astype(float) @ right.T.astype(float)).astype(np.int64)
    first, second = np.nonzero(choose(difference))
    return left[first], right[second]


def spread_angles(rng: np.random.Generator, count: int, widest: float) -> np.ndarray:
    """Angles in degrees, 0 to ``widest``, with both ends of this range.

    In one half the angle is uniform, in the other half its logarithm.
    """
    angles = rng.uniform(0, widest, count)
    angles[::2] = widest * 10.0 ** rng.uniform(-6, 0, len(angles[::2]))
    angles[: count // 20] = 0
    angles[count // 20 : count // 10] = widest
    return angles


def span_ends(rng: np.random.Generator, count: int, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Codes of the end normals of spans up to ``widest`` degrees. Some normals are along an axis."""
    left = sphere(rng, count)
    left[: count // 20] = np.eye(3)[np.arange(count // 20) % 3]
    right = turned(rng, left, rng.permutation(spread_angles(rng, count, widest)))
    return quantise(left), quantise(right)


def any_pairs(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes of pairs of unit normals at angles of every size. Every sixteenth pair has arbitrary codes."""
    left = sphere(rng, count)
    right = normalise(left + 10.0 ** rng.uniform(-5, 1, (count, 1)) * rng.normal(size=(count, 3)))
    left, right = quantise(left), quantise(right)
    for ends in (left, right):
        ends[::16] = any_codes(rng, COMPONENT, *ends[::16].shape)
    return left, right


def vectors_near(rng: np.random.Generator, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Codes of a unit vector for each span. In every second span it is near the normals of the span."""
    vector = sphere(rng, len(left))
    vector[::2] = normalise((0.7 * left + 0.3 * right)[::2] / ONE + vector[::2] * 1e-3)
    return quantise(vector)


def degrees_between(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Angles between vectors of codes, as a column."""
    sine = np.linalg.norm(np.cross(left / ONE, right / ONE), axis=1)
    return np.degrees(np.arctan2(sine, dot(left, right) / ONE**2))[:, np.newaxis]


def exact_middle(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact unit vector half-way between two vectors of codes, and the cosine of their angle."""
    cosine = dot(left, right) / ONE**2
    return (left + right) * COMPONENT.step / np.sqrt(2 + 2 * cosine)[:, np.newaxis], cosine


def light_constants(unit: Component, direction: np.ndarray, halfway: np.ndarray) -> np.ndarray:
    """Constants of a unit, with the codes of L and H of each light."""
    constants = np.zeros(len(direction), dtype_of(unit.constants.shape().elem_shape))
    constants["direction"], constants["halfway"] = direction, halfway
    return constants


# Spans.


def log_lengths(rng: np.random.Generator, count: int, least: int = 1) -> np.ndarray:
    """Lengths of ``count`` spans with a uniform logarithm, among them the two shortest and two longest."""
    lengths = np.floor(least * (4096 / least) ** rng.random(count)).astype(np.int64)
    edges = [least, least + 1, 4094, 4095]
    lengths[: len(edges)] = edges[:count]
    return lengths


def span_lengths(rng: np.random.Generator, pixels: int, least: int = 1) -> np.ndarray:
    """Lengths of at least 16 spans with about ``pixels`` pixels in all, in random order."""
    return rng.permutation(log_lengths(rng, max(pixels // 450, 16), least))


def any_lengths(rng: np.random.Generator, count: int) -> np.ndarray:
    """Lengths of ``count`` spans with a uniform logarithm. Some spans have the largest length."""
    lengths = np.floor(4096 ** rng.random(count)).astype(np.int64)
    lengths[:: max(count // 4, 1)] = 4095
    return lengths


def short_lengths(rng: np.random.Generator, pixels: int, least: int = 0) -> np.ndarray:
    """Lengths of spans that have exactly ``pixels`` pixels in all. Most are short."""
    longest = min(4096, 2 + pixels // 16)
    lengths = np.floor(longest ** rng.random(max(pixels // 8, 8)) ** 3).astype(np.int64)
    lengths = np.maximum(lengths - (1 - least), least)
    lengths = lengths[np.cumsum(lengths) <= pixels]
    rest = pixels - int(lengths.sum())
    return np.r_[lengths, [4095] * (rest // 4095), [rest % 4095] if rest % 4095 else []].astype(np.int64)


def pixel_of(rng: np.random.Generator, length: np.ndarray) -> np.ndarray:
    """Offset of a pixel in each span. In every fourth span it is the last pixel."""
    pixel = np.floor(rng.random(len(length)) * length).astype(np.int64)
    pixel[::4] = length[::4] - 1
    return pixel


def setup_spans(
    rng: np.random.Generator, count: int, widest: float, out_of_range: float
) -> dict[str, np.ndarray]:
    """Spans of all lengths for a setup.

    Some have equal normals, some have angles out of range, and some have components with extreme codes.

    Parameters
    ----------
    rng : Generator
        Generator of the random numbers.
    count : int
        Number of spans, 200 or more.
    widest : float
        Largest angle of the spans in range, in degrees.
    out_of_range : float
        Least angle of the 60 spans out of range, in degrees. Opposite normals are among them.
    """
    angles = np.r_[np.zeros(20), 10.0 ** rng.uniform(-4, 0, 80), rng.uniform(0, widest, count - 200)]
    angles = np.r_[angles, rng.uniform(out_of_range, 180, 59), 180]
    left = sphere(rng, len(angles))
    left, right = quantise(left), quantise(turned(rng, left, angles))
    left, right = np.vstack([left, word_ends(rng, 40, 3)]), np.vstack([right, word_ends(rng, 40, 3)])
    # These ends have the longest chord.
    left[-1], right[-1] = COMPONENT.max_code, COMPONENT.min_code
    length = rng.integers(1, 4096, len(left))
    length[::2] = rng.integers(1, 20, len(length[::2]))
    length[:12] = [1, 2, 3, 4, 5, 16, 17, 2048, 2049, 2050, 4094, 4095]
    order = rng.permutation(len(left))
    return {"normal_left": left[order], "normal_right": right[order], "length": length[order]}


def curves(rng: np.random.Generator, count: int) -> tuple[Fixed, Fixed, Fixed]:
    """Coefficients G, P, Q of the quadratic curves of spans up to 45 degrees."""
    return curves_of(*component_words(*span_ends(rng, count, MAX_SPAN_ANGLE)))


def curves_of(left: Fixed, right: Fixed) -> tuple[Fixed, Fixed, Fixed]:
    """Coefficients G, P, Q of the quadratic curves of spans between unit normals."""
    middle, _ = MiddleNormal().compute(left, right)
    return GPQ().compute(left, middle, right)


def any_curves(rng: np.random.Generator, count: int) -> dict[str, np.ndarray]:
    """Random codes of the coefficients G, P, Q, by name."""
    formats = {"g": GPQ.G_FORMAT, "p": GPQ.P_FORMAT, "q": GPQ.Q_FORMAT}
    return {name: any_codes(rng, format, count, 3) for name, format in formats.items()}


# Highlights.


def highlight_codes(
    rng: np.random.Generator, model: HighlightOperand, count: int, exponent: int
) -> np.ndarray:
    """Operands of a specular unit.

    In most operands 1 - cos gamma is at most 1.25 times the largest value with a term over 0. The others are:

    - every fourth: 1 - cos gamma has a uniform logarithm;
    - every twelfth: it differs from that largest value by up to 3 units of one of the bits 0 to 11;
    - every third: a random code;
    - every sixteenth: the code of cos gamma = 1, 0 or -1, or a code next to it.
    """
    format = model.operand_format
    reach = 1.25 * model.last_lit_arguments[exponent] * 2.0**-25
    distance = rng.uniform(0, min(reach, 2), count)
    distance[1::4] = 10.0 ** rng.uniform(-9, 0.3, len(distance[1::4]))
    border = rng.integers(-3, 4, len(distance[3::12])) << rng.integers(0, 12, len(distance[3::12]))
    # Half a step is added, because the cosine has more fraction bits.
    distance[3::12] = (model.last_lit_arguments[exponent] + border + 0.5) * 2.0**-25
    if model.operand == "cosine":
        one = ONE_SQUARED.codes.item()
        codes = one - np.floor(distance * 2.0**34).astype(np.int64)
        corners = [one, one - 1, one + 1, one + 10**6, 0, 1, -1, -one]
    else:
        codes = np.floor(distance * 2.0**25).astype(np.int64)
        corners = [0, 1, 2, (1 << 25) - 1, 1 << 25, format.max_code - 1]
    codes = np.clip(codes, format.min_code, format.max_code)
    codes[2::3] = any_codes(rng, format, len(codes[2::3]))
    codes[::16] = rng.choice(corners, len(codes[::16]))
    return codes


def exponents(rng: np.random.Generator, count: int) -> Iterator[tuple[int, int]]:
    """Exponents, and the number of samples of each."""
    chosen = [1, 2, 3, 10, 100, 500, 999, MAX_EXPONENT]
    chosen += rng.integers(1, MAX_EXPONENT + 1, 32).tolist()
    for exponent in chosen:
        yield exponent, max(count // len(chosen), 16)
