"""Abbas and others 2001: one quadratic of each channel over a triangle, through the colours at six points."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from blysk.golden.number.fixed import SQ
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.bishop_weimer import six_point_values
from blysk.golden.rivals.rival import Rival
from blysk.golden.rivals.shades import Shades, shown
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import (
    Polynomial,
    ScreenTriangles,
    Surfaces,
    gradients,
    screen_triangles,
    six_points,
)

__all__ = ["Abbas"]


@dataclass(frozen=True)
class Abbas(Rival):
    """Colours by a quadratic of each channel, through the exact intensities at corners and middles of edges.

    A pixel takes two additions a channel, for any number of lights. The host shades six points a triangle,
    with the whole model.

    Source: docs/theory/rivals.md#abbas; [Abbas01], [Abbas00].
    """

    NAME: ClassVar = "abbas"
    TITLE: ClassVar = "Abbas and others 2001, quadratics of the colours"
    SPAN_CYCLES: ClassVar = 1
    SURFACES: ClassVar[Surfaces] = Surfaces(SQ(13, 29))

    def host(self, scene: Scene, triangles: ScreenTriangles) -> Polynomial:
        """Coefficients of red, green and blue in LSB: arrays of shape (3, triangles)."""
        lights, material = len(scene.lights), scene.materials[0]
        ambient = 255 * np.array(material.ambient_term(scene.ambient_light))
        exponent = float(material.exponent)
        pairs = [
            (
                255 * np.multiply(material.diffuse, light.color),
                255 * np.multiply(material.specular, light.color),
            )
            for light in scene.lights
        ]

        def colors(values: np.ndarray) -> np.ndarray:
            total = np.broadcast_to(ambient[:, np.newaxis], (3, values.shape[1]))
            for (diffuse, specular), cosine, u in zip(pairs, values[:lights], values[lights:], strict=True):
                shine = np.power(np.maximum(1 - u, 0), exponent)
                shine = np.where(np.asarray(cosine) > 0, shine, 0)
                total = total + np.maximum(cosine, 0) * diffuse[:, np.newaxis]
                total = total + shine * specular[:, np.newaxis]
            return total

        corners, middles = ([colors(of) for of in group] for group in six_point_values(scene, triangles))
        return six_points(corners, middles, gradients(triangles))

    def beat_bits(self, lights: int) -> int:
        """Six words for each channel."""
        return 3 * Surfaces.WORDS * self.SURFACES.format.width

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        triangles = screen_triangles(scene, raster)
        words, _ = self.SURFACES.quantise(self.host(scene, triangles))
        return shown(self.SURFACES.compute(words, triangles, trace))
