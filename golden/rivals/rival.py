"""Base of the rivals: what the host computes for a triangle, the words of a beat, and the pixels."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.reflection import BLINN, ReflectionModel
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.shades import Shades, shaded
from blysk.golden.rivals.trace import Trace
from blysk.golden.rivals.triangles import Polynomial, ScreenTriangles, Surfaces, dot, screen_triangles

__all__ = ["LightVectors", "Rival", "SurfaceRival", "directions_of", "middles_of", "unit"]


class LightVectors(NamedTuple):
    """Unit vectors L, H and V of a light at some points, each of shape (3, points) or (3, 1)."""

    towards: np.ndarray
    halfway: np.ndarray
    viewer: np.ndarray


def directions_of(scene: Scene, point: np.ndarray) -> list[LightVectors]:
    """Vectors of every light at points.

    Parameters
    ----------
    scene : Scene
        Lights and viewer.
    point : float64 array, shape (3, points)
        Positions; a distant light and viewer do not read them.
    """
    places = np.moveaxis(point, 0, -1) if scene.local else None
    viewer = scene.view_vectors(places)
    found = []
    for light in scene.lights:
        towards = light.towards(places)
        vectors = (towards, halfway_vector(towards, viewer), viewer)
        found.append(LightVectors(*(np.reshape(np.moveaxis(of, -1, 0), (3, -1)) for of in vectors)))
    return found


def unit(vector: np.ndarray) -> np.ndarray:
    """Unit vectors along the first axis, by single operations."""
    found: np.ndarray = vector * (1 / np.sqrt(dot(vector, vector)))
    return found


def middles_of(corners: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Sums of values at the ends of the edges 01, 02, 12."""
    first, second, third = corners
    return [first + second, first + third, second + third]


@dataclass(frozen=True)
class Rival(ABC):
    """A method of other people as a bit-accurate model.

    It shades the fragments of `rasterise`. No triangle or span is cut, and a beat brings a triangle. The
    methods of this project are measured by the same base; see `SpanDesign`.
    """

    NAME: ClassVar[str]
    TITLE: ClassVar[str]
    REFLECTION: ClassVar[ReflectionModel] = BLINN
    """Model of the exact picture with which the rival is compared."""
    HARDWARE: ClassVar[str] = ""
    """Name of the method with hardware in this project; empty for a model alone."""
    SPAN_CYCLES: ClassVar[int] = 3
    """Cycles of a span among which its products share multipliers."""
    SETUP_CYCLES: ClassVar[int] = 1
    """Cycles of a triangle before its spans in hardware: 8 if it has products, which share multipliers."""

    @abstractmethod
    def host(self, scene: Scene, triangles: ScreenTriangles) -> Sequence[np.ndarray]:
        """What software computes for each triangle, in float64, by single operations that may be counted."""

    @abstractmethod
    def beat_bits(self, lights: int) -> int:
        """Bits of a triangle's words, without its place."""

    @abstractmethod
    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment.

        Parameters
        ----------
        scene : Scene
            Scene of one material, without albedo.
        raster : Raster
            Its raster.
        trace : Trace
            Gets the parts and the bits that switch.

        Raises
        ------
        ValueError
            As `screen_triangles` does.
        """


@dataclass(frozen=True)
class SurfaceRival(Rival):
    """Base of rivals with a quadratic of N·L and a quadratic of the highlight's operand over a triangle.

    The operand is ``u = 1 - cos gamma``, in ``UQ(1, 25)``, cut and limited to 0 and over. The lobe is a table
    of u. `Surfaces` has the words.

    Source: docs/theory/rivals.md.
    """

    SPAN_CYCLES: ClassVar = 1
    SURFACES: ClassVar[Surfaces] = Surfaces()

    @abstractmethod
    def host(self, scene: Scene, triangles: ScreenTriangles) -> Polynomial:
        """Coefficients of N·L of each light, then of u of each: arrays of shape (2 lights, triangles)."""

    def beat_bits(self, lights: int) -> int:
        """Six words for each of two quadratics of each light."""
        return 2 * lights * Surfaces.WORDS * self.SURFACES.format.width

    def shade(self, scene: Scene, raster: Raster, trace: Trace) -> Shades:
        """Bit-accurate light of every fragment, see `Rival.shade`."""
        triangles = screen_triangles(scene, raster)
        words, _ = self.SURFACES.quantise(self.host(scene, triangles))
        values = self.SURFACES.compute(words, triangles, trace).truncate(25)
        lights = len(scene.lights)
        format = Lobe.ARGUMENT_FORMAT
        operand = Fixed(format, np.clip(values.codes[:, lights:], 0, format.max_code))
        lobe = Lobe(BLINN, "one_minus_cosine")
        return shaded(scene, values[:, :lights], operand, lobe, trace)
