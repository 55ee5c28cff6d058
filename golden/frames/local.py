"""Exact operands of lights along spans: N·L and 1 - N·H of points on the surface, perspective-correct."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from blysk.golden.cosines.chord_setup import SpanValues
from blysk.golden.frames.highlight_limits import HighlightLimits
from blysk.golden.reference.geometry import any_component, normalise, sum_of_components
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = [
    "CHUNK",
    "SurfacePoints",
    "chunks",
    "line_ends",
    "lines_along",
    "local_operands",
    "local_values",
    "weights_along",
]

CHUNK = 1 << 16
"""Number of spans computed at once; it bounds the memory and changes no result."""


def weights_along(raster: Raster, span: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Weights of the triangle's corners at t of each span, shape (spans, 3); they are linear in t."""
    t = t[:, np.newaxis]
    left, right = (of.take(span, axis=0) for of in (raster.weights_left, raster.weights_right))
    found: np.ndarray = (1 - t) * left + t * right
    return found


def lines_along(raster: Raster, span: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Normals with their lengths at t of each span, shape (spans, 3); they are linear in t."""
    t = t[:, np.newaxis]
    left, right = line_ends(raster, span)
    found: np.ndarray = (1 - t) * left + t * right
    return found


def line_ends(raster: Raster, span: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Normals with their lengths at the two ends of all or some spans, each of shape (spans, 3)."""
    ends = [(raster.magnitude_left, raster.normal_left), (raster.magnitude_right, raster.normal_right)]
    if span is not None:
        # `take` of rows takes a third of the time of an index.
        ends = [(of.take(span), normal.take(span, axis=0)) for of, normal in ends]
    left, right = (of[:, np.newaxis] * normal for of, normal in ends)
    return left, right


@dataclass(frozen=True)
class SurfacePoints:
    """Exact values at points of the surface, for each light.

    - ``normal`` N and ``viewer`` V have the shape (count, 3);
    - ``direction`` L has the shape (lights, count, 3);
    - ``factor`` a, ``diffuse`` and ``highlight`` u have the shape (count, lights). ``diffuse`` is ``a N·L``.
      a is 1 for a light that does not fade.
    """

    normal: np.ndarray
    viewer: np.ndarray
    direction: np.ndarray
    diffuse: np.ndarray
    highlight: np.ndarray
    factor: np.ndarray

    @classmethod
    def at(cls, scene: Scene, raster: Raster, span: np.ndarray, t: np.ndarray) -> "SurfacePoints":
        """Points at t of each span."""
        line = lines_along(raster, span, t)
        # Between opposite normals the line passes through 0, where no normal is better than another.
        normal = np.where(any_component(line)[:, np.newaxis], normalise(line), raster.normal_left[span])
        points = None
        if scene.local:
            weights = weights_along(raster, span, t)
            share = weights / weights.sum(axis=1, keepdims=True)
            corners = scene.mesh.vertices[scene.mesh.faces[raster.triangle[span]]]
            points = np.einsum("sn,snk->sk", share, corners)
        viewer = scene.view_vectors(points)
        direction = np.empty((len(scene.lights), *normal.shape))
        halfway = np.empty_like(direction)
        factor = np.ones((len(normal), len(scene.lights)))
        for index, light in enumerate(scene.lights):
            towards = light.towards(points)
            direction[index] = towards
            halfway[index] = halfway_vector(towards, viewer)
            factor[:, index] = light.factor(points)
        diffuse = np.einsum("sk,lsk->sl", normal, direction) * factor
        highlight = sum_of_components(np.square(normal - halfway)).T / 2
        highlight = np.where(any_component(halfway).T, highlight, 2.0)
        viewer = np.broadcast_to(viewer, normal.shape)
        return cls(normal, viewer, direction, np.clip(diffuse, -1, 1), np.clip(highlight, 0, 2), factor)

    def scaled(self, scale: int) -> "SurfacePoints":
        """The same points with ``min(2^s u, 1)`` in place of u."""
        return replace(self, highlight=np.minimum(np.ldexp(self.highlight, scale), 1)) if scale else self

    def with_normal(self, normal: np.ndarray, chord: bool) -> "SurfacePoints":
        """The same points with other normals, shape (count, 3); u is half the squared chord, or 1 - N·H."""
        diffuse = np.einsum("sk,lsk->sl", normal, self.direction) * self.factor
        halfway = halfway_vector(self.direction, self.viewer)
        if chord:
            highlight = sum_of_components(np.square(normal - halfway)).T / 2
        else:
            highlight = 1 - np.einsum("sk,lsk->sl", normal, halfway)
        highlight = np.where(any_component(halfway).T, highlight, 2.0)
        return replace(self, normal=normal, diffuse=diffuse, highlight=highlight)

    def turned(self, other: "SurfacePoints", limits: HighlightLimits) -> np.ndarray:
        """Whether N, V or an L differs from ``other`` by more than the limits allow; (count,)."""
        least = np.cos(np.radians(limits.MAX_VECTOR_ANGLE))
        result = np.einsum("sk,sk->s", self.normal, other.normal) < least
        result |= np.einsum("sk,sk->s", self.viewer, other.viewer) < least
        result |= (np.einsum("lsk,lsk->ls", self.direction, other.direction) < least).any(axis=0)
        move = np.linalg.norm(self.viewer - other.viewer, axis=1)
        move = move + np.linalg.norm(self.direction - other.direction, axis=2)
        total = [np.linalg.norm(place.direction + place.viewer, axis=2) for place in (self, other)]
        found: np.ndarray = result | (move > limits.MAX_HALFWAY_CHANGE * np.minimum(*total)).any(axis=0)
        return found


def chunks(count: int) -> Iterator[slice]:
    """Slices of at most `CHUNK` of ``count`` spans."""
    for start in range(0, count, CHUNK):
        yield slice(start, start + CHUNK)


def local_values(scene: Scene, raster: Raster, lights: int | None = None) -> SpanValues:
    """Input of ``chord-local`` for each span: exact values of N·L and u at three places, as codes.

    N, L and H are of unit length at each place. Where a point light is on the surface, N·L is 0. Where there
    is no half-way vector (``L = -V``), u is 2. The middle values of a span of two pixels are means of its
    ends. The factor of a light that fades multiplies its N·L.

    Parameters
    ----------
    scene : Scene
        Mesh, lights and viewer.
    raster : Raster
        Spans from `cut_spans`, in any order.
    lights : int, optional
        Number of lights of the pipeline, by default of the scene. Lights that the scene does not have, and
        lights that are off, are dark: their N·L is 0.
    """
    return local_operands(scene, raster, lights)[0]


def local_operands(
    scene: Scene,
    raster: Raster,
    lights: int | None = None,
    factors: Sequence[int] = (),
    scale: int = 0,
) -> tuple[SpanValues, np.ndarray | None]:
    """`local_values`, and codes of the factors of some lights at the same three places.

    Parameters
    ----------
    scene, raster, lights
        As for `local_values`.
    factors : sequence of int
        Indices of the lights whose factors are computed.
    scale : int
        Scale of u, see `SpanValues.quantise`.

    Returns
    -------
    values : SpanValues
    factors : int64 array, shape (spans, len(factors), 3), or None
        In the format of N·L; ``None`` without ``factors``.
    """
    count = len(scene.lights) if lights is None else lights
    given = len(scene.lights)
    on = np.array([light.is_on for light in scene.lights], dtype=bool)
    spans = np.arange(len(raster.length))
    operands = np.zeros((3, len(spans), count, 3))
    # In a span of one pixel all three values equal the first. A span of two pixels has no middle pixel.
    for place, t, pixels in ((0, 0.0, 1), (2, 1.0, 2), (1, 0.5, 3)):
        has = spans[raster.length >= pixels]
        lacks = spans[raster.length < pixels]
        for values in operands:
            values[lacks, :, place] = (
                values[lacks, :, ::2].mean(axis=2) if place == 1 else values[lacks, :, 0]
            )
        for part in chunks(len(has)):
            exact = SurfacePoints.at(scene, raster, has[part], np.full(len(has[part]), t))
            found = exact.diffuse * on, exact.highlight, exact.factor
            for values, of_place in zip(operands, found, strict=True):
                values[has[part], :given, place] = of_place
    diffuse, highlight, factor = operands
    codes = SpanValues.quantise(diffuse, highlight, scale)
    if not factors:
        return codes, None
    wanted = factor[:, list(factors)]
    return codes, SpanValues.quantise(wanted, np.zeros_like(wanted)).diffuse
