"""Spans with a pixel next to an edge of what is shown: there a cosine's last bits decide."""

from collections.abc import Callable

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.pipeline import Design, Spans
from blysk.golden.reference.geometry import normalise

__all__ = ["SHADE", "constants_of", "highlight_edges", "spans_on_edges"]

SHADE = np.array([1])
"""Edge of light and shade, as one of `highlight_edges`."""


def constants_of(code: np.ndarray, exponent: int) -> FrameConstants:
    """A light from where its highlight is, of eight times the full one and less, that has no diffuse term."""
    nothing, specular = Intensity.color(np.zeros(3)), Intensity.color(np.array([[8.0, 7.0, 6.0]]))
    return FrameConstants(exponent, nothing, code[np.newaxis], code[np.newaxis], 0 * specular, specular)


def highlight_edges(design: Design, exponent: int) -> np.ndarray:
    """Codes of N.H, of 25 fraction bits, that are shown otherwise than those before them."""
    constants = constants_of(np.zeros(3, dtype=int), exponent)
    # The unit reads them to 2^-16 of what the exponent makes of them.
    step = 1 << (9 - int(design.specular.scale(np.array(exponent))[1]))
    arguments = Fixed(UQ(1, 25), np.arange(0, (1 << 26) // max(exponent, 2), step)[:, np.newaxis])
    terms = design.specular.compute(arguments, np.zeros(arguments.shape, dtype=bool), exponent)
    colors = (constants.ambient, constants.diffuse, constants.specular)
    colors = (Fixed(Intensity.COLOR_FORMAT, codes) for codes in colors)
    shown = design.intensity.compute(*colors, Fixed(terms.format, 0 * terms.codes), terms)
    changed = np.flatnonzero(np.any(np.diff(shown, axis=0), axis=-1)) + 1
    return (1 << 25) + 1 - arguments.codes[changed, 0]


def spans_on_edges(
    rng: np.random.Generator,
    code: np.ndarray,
    edges: np.ndarray,
    angles: np.ndarray,
    steps: np.ndarray,
    cosine: Callable[..., np.ndarray],
) -> Spans:
    """Spans that have a pixel, after so many steps, whose cosine with a vector is next to some edge.

    A span is turned so that the cosine is about right, and then moved as it is by some last bits until the
    twin's is, as near as may be. Of every eight spans the one that comes nearest is taken.

    Parameters
    ----------
    code : int array, shape (3,)
        The vector.
    edges : int array
        Cosines of 25 fraction bits.
    angles : array, shape (spans,)
        In degrees.
    steps : int array, shape (spans,)
        Of the pixel.
    cosine : callable
        That of so many pixels, as the twin has it, in steps of 2^-34: of normals, lengths and steps.
    """
    count = len(steps)
    after = np.where(rng.random(count) < 0.5, 0, rng.integers(0, 12, count))
    length = 1 + steps + after
    edge = rng.choice(edges, count)
    along, height = normalise(code), np.ldexp(edge, -25)[:, np.newaxis]
    away = normalise(np.cross(rng.normal(size=(count, 3)), along))
    normal = height * along + np.sqrt(1 - height**2) * away
    across = normalise(np.cross(rng.normal(size=(count, 3)), normal))
    left, right = (
        quantise(normal * np.cos(angle)[:, np.newaxis] + across * np.sin(angle)[:, np.newaxis])
        for angle in np.radians(angles) * [-steps, after] / np.maximum(length - 1, 1)
    )
    moves = np.stack(np.mgrid[-150:151, -150:151], axis=-1).reshape(-1, 2)
    moves = np.c_[moves, np.rint(moves @ code[:2] / -code[2]).astype(int)]
    moves = moves[np.argsort(moves @ code)]
    rises = moves @ code
    # What a pixel rises by when both ends rise by one.
    turn = np.radians(angles) / 2
    share = np.cos(turn * (steps - after) / np.maximum(length - 1, 1)) / np.cos(turn)

    def missing():
        return edge * 2.0**9 - cosine(left, right, length, steps)

    for _ in range(4):
        move = moves[np.searchsorted((rises[1:] + rises[:-1]) / 2, missing() / share)]
        left, right = (np.clip(end + move, -ONE, ONE) for end in (left, right))
    nearest = np.argmin(np.abs(missing()).reshape(-1, 8), axis=-1) + np.arange(0, count, 8)
    nearest = rng.permutation(nearest)
    place = np.zeros(len(nearest), dtype=np.int64)
    return Spans(place, place, length[nearest], left[nearest], right[nearest])
