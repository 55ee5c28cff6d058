"""Helpers of the tests of cut spans."""

import numpy as np

from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.number.unit_vector import ONE
from blysk.golden.reference.geometry import normalise
from blysk.golden.reference.lighting import Material
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.renderer import fragment_positions

METHOD = LocalChordInterpolator()
WIDTH = 4095
ONE_VALUE = (ONE / 2**17) ** 2


def raster_of(rng, left, right, length, spread=0.3):
    """Spans with these normals and lengths, anywhere on a picture. A span of one pixel has one normal.

    Each end is up to ``10^spread`` times as long as 1, or as short.
    """
    length = np.broadcast_to(length, len(left)).astype(np.int32)
    right = np.where(length[:, np.newaxis] == 1, left, right)
    count, fragments = len(length), int(length.sum())
    magnitude_left, magnitude_right = 10.0 ** rng.uniform(-spread, spread, (2, count))
    x = rng.integers(0, WIDTH - length, endpoint=True).astype(np.int32)
    y = rng.integers(0, 4095, count).astype(np.int32)
    span = np.repeat(np.arange(count, dtype=np.int32), length)
    offset = (np.arange(fragments) - np.repeat(np.cumsum(length) - length, length)).astype(np.int16)
    return Raster(
        x=x,
        y=y,
        length=length,
        triangle=rng.integers(0, 1000, count).astype(np.int32),
        normal_left=left,
        normal_right=right,
        magnitude_left=magnitude_left,
        magnitude_right=np.where(length == 1, magnitude_left, magnitude_right),
        weights_left=np.ones((count, 3)),
        weights_right=np.ones((count, 3)),
        back=rng.random(count) < 0.5,
        span=span,
        offset=offset,
        pixel=(y[span] * WIDTH + x[span] + offset).astype(np.int32),
        visible=rng.random(fragments) < 0.5,
        triangles=1000,
        degenerate=1,
        culled=2,
        outside=3,
        uncovered=4,
        hidden_spans=5,
        repaired_normals=6,
    )


def angles(raster):
    """Degrees between the ends of each span, by a form that is exact for small and large angles."""
    left, right = raster.normal_left, raster.normal_right
    sine = np.linalg.norm(left - right, axis=1)
    return np.degrees(2 * np.arctan2(sine, np.linalg.norm(left + right, axis=1)))


def origins(raster, cut):
    """The given span of each part, found by the part's first fragment."""
    first = np.cumsum(cut.length) - cut.length
    return raster.span[first], raster.offset[first]


def line_at(raster, span, t):
    """``(1-t) m_l N_l + t m_r N_r`` of spans."""
    left = ((1 - t) * raster.magnitude_left[span])[:, np.newaxis] * raster.normal_left[span]
    return left + (t * raster.magnitude_right[span])[:, np.newaxis] * raster.normal_right[span]


def material(exponent):
    return Material((0.1,) * 3, (0.7,) * 3, (0.6,) * 3, exponent)


def exact_operands(scene, raster):
    """N·L and u of every fragment, with each vector normalised at the fragment."""
    span = raster.span
    t = raster.offset / np.maximum(raster.length[span] - 1, 1)
    normal = normalise(line_at(raster, span, t))
    point = fragment_positions(scene, raster, np.arange(len(span)))
    viewer = scene.camera.position - point if scene.viewer == "near" else scene.camera.viewer
    viewer = viewer / np.linalg.norm(viewer, axis=-1, keepdims=True)
    cosine, u = [], []
    for light in scene.lights:
        towards = light.direction if light.position is None else light.position - point
        towards = normalise(np.broadcast_to(towards, point.shape))
        halfway = normalise(towards + viewer)
        cosine.append((normal * towards).sum(axis=1))
        u.append(((normal - halfway) ** 2).sum(axis=1) / 2)
    return np.stack(cosine, axis=1), np.stack(u, axis=1)
