"""Bound of the error of every pixel with an albedo, from the words of its own attributes and texels."""

from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple, Self, cast

import numpy as np

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.attribute_spans import SpanAttributes
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_filter import TextureFilter
from blysk.golden.frames.border import BORDER
from blysk.golden.frames.missed import plane_error
from blysk.golden.frames.quotient_bound import LightErrors, across_slivers
from blysk.golden.frames.surface import span_attributes
from blysk.golden.geometry.scene_triangles import SceneTriangles
from blysk.golden.geometry.surface_words import SurfaceWords
from blysk.golden.number.spans import pixels_of, runs_of
from blysk.golden.reference.albedo import Samples, fragment_colors, fragment_samples
from blysk.golden.reference.lighting import Material, distant_cosine
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene
from blysk.golden.reference.texture import wrapped
from blysk.golden.render import Renderer

__all__ = ["AttributeErrors", "albedo_bound", "albedo_errors"]


class _Errors(NamedTuple):
    """Exact albedo of some fragments, and bounds of its errors, each of shape (count, 3)."""

    which: np.ndarray
    albedo: np.ndarray
    error: np.ndarray


class AttributeErrors(NamedTuple):
    """Bounds of the errors of attributes at each pixel of a picture, shape (height * width,).

    Parameters
    ----------
    colors, coordinates : float64 arrays
        Of colours, and of texture coordinates in texels.
    """

    colors: np.ndarray
    coordinates: np.ndarray

    @classmethod
    def of_triangles(cls, renderer: Renderer, sent: SceneTriangles, size: tuple[int, int]) -> Self:
        """Largest bounds of all triangles that cover a pixel.

        A word is off by the error of its plane, the rounding of the corners, and `SurfaceWords.ERROR`.
        Slivers have the attributes of their longest edge. So the distance of their middle corner's attributes
        from this edge counts, too.

        Parameters
        ----------
        renderer : Renderer
            Geometry and shading, with an albedo.
        sent : SceneTriangles
            The triangles.
        size : (int, int)
            Width and height of the picture.
        """
        albedo, (width, height) = renderer.design.albedo, size
        drawn, pieces, _ = renderer.geometry.pieces(sent.triangles, sent.frame)
        corners = drawn.triangles.surface
        assert albedo is not None
        assert corners is not None
        assert pieces.surface is not None
        of_words = plane_error(drawn, renderer) + SurfaceWords.ERROR
        of_words += across_slivers(drawn, corners, renderer)
        words = pieces.surface
        if sent.triangles.base is not None:
            own = drawn.triangles[pieces.triangle]
            words = words._replace(base=own.base, range=own.range, level=own.level)
        span, index = pixels_of(pieces.length)
        found = albedo.attributes.errors(
            albedo.spans.compute(words, pieces.length), of_words[pieces.triangle[span]]
        )
        pixel = pieces.y[span] * width + pieces.x[span] + index
        result = cls(np.zeros(width * height), np.zeros(width * height))
        for of, errors in zip(result, found, strict=True):
            np.maximum.at(of, pixel, errors)
        # A colour is 0 to 1.
        return result._replace(colors=np.minimum(result.colors, 1))


def albedo_bound(
    scene: Scene,
    albedo: Albedo,
    cut: Raster,
    lights: Sequence[LightErrors],
    attributes: AttributeErrors | None = None,
) -> np.ndarray | None:
    """Bound of the error of every shown pixel, in LSB of linear light.

    With an albedo a and its error e, and the light ``L = A + sum D`` on the surface with the error l, a pixel
    is off by at most the sum of

    - ``a l + e (L + l)``;
    - the error of the specular sum, which the albedo multiplies if the material is tinted;
    - the rounding of the light on the surface and of the colour operands, 1/128 each;
    - the rounding of the pixel, 1/2.

    Parameters
    ----------
    scene : Scene
        The scene, with albedo.
    albedo : Albedo
        The albedo path.
    cut : Raster
        The shaded spans.
    lights : sequence of LightErrors
        Bounds of the light on each material.
    attributes : AttributeErrors, optional
        Errors of the attributes in a frame by triangles. By default the errors of the spans' own words.

    Returns
    -------
    float64 array, shape (height, width, 3), or None
        1/2 where there is no surface. ``None``: words may miss a texel by more than `BORDER`, in a texture
        that takes the nearest.

    Source: docs/theory/textures.md#error-of-a-pixel.
    """
    bound = np.full((scene.height * scene.width, 3), 0.5)
    parts = [_Light.of(scene, *given) for given in zip(scene.materials, lights, strict=True)]
    for found in albedo_errors(scene, albedo, cut, attributes):
        if found is None:
            return None
        material = scene.mesh.material[cut.triangle[cut.span[found.which]]]
        for index in np.unique(material):
            chosen = material == index
            bound[cut.pixel[found.which[chosen]]] += 255 * parts[index].error(
                found.albedo[chosen], found.error[chosen]
            )
    return bound.reshape(scene.height, scene.width, 3)


class _Light(NamedTuple):
    """Light on a material: its errors, its largest value, and the rounding of its operands.

    ``surface`` is for the light that the albedo multiplies, ``other`` for all other light.
    """

    surface_error: np.ndarray
    other_error: np.ndarray
    largest: np.ndarray

    @classmethod
    def of(cls, scene: Scene, material: Material, errors: LightErrors) -> "_Light":
        step = 1 / (128 * 255)
        lights = () if material.unlit else [light for light in scene.lights if light.is_on]
        colors = np.array([light.color for light in lights]).reshape(-1, 3)
        cosines = [distant_cosine(light, scene.distant_viewer) for light in lights]
        diffuse = colors * material.diffuse
        specular = colors * np.array([material.reflection(of) for of in cosines]).reshape(-1, 3)
        largest = material.ambient_term(scene.ambient_light) + diffuse.sum(axis=0)
        # Roundings of the ambient operand, of the operands of lights, and of their sum.
        surface = errors.diffuse + step * (2 + np.count_nonzero(diffuse, axis=0))
        other = errors.highlight + step * np.count_nonzero(specular, axis=0)
        if material.tinted:
            largest, surface, other = largest + specular.sum(axis=0), surface + other, np.zeros(3)
        return cls(surface, other + step * (np.array(material.emission) > 0), largest)

    def error(self, albedo: np.ndarray, error: np.ndarray) -> np.ndarray:
        """Bound of the error of pixels, without their rounding, from their albedo and its error."""
        found: np.ndarray = albedo * self.surface_error + error * (self.largest + self.surface_error)
        found += self.other_error
        return found


def albedo_errors(
    scene: Scene, albedo: Albedo, cut: Raster, attributes: AttributeErrors | None = None
) -> Iterator[_Errors | None]:
    """Exact albedo of shown fragments, and bounds of its errors, in parts of a frame.

    ``None`` for a part where words may miss a texel by more than `BORDER`, in a texture that takes the
    nearest.

    Parameters
    ----------
    scene, albedo, cut, attributes
        As for `albedo_bound`.
    """
    spans, first = None if attributes else span_attributes(scene, cut, albedo), 0
    for part in runs_of(cut.length):
        length = cut.length[part]
        shown = np.flatnonzero(cut.visible[first : first + int(length.sum())])
        which = first + shown
        first += int(length.sum())
        if attributes:
            of_color, of_place = (of[cut.pixel[which]] for of in attributes)
        else:
            assert spans is not None
            own = cast(SpanAttributes, spans[part])
            words, of_words = albedo.spans.compute(own, length), albedo.spans.errors(own, length)
            of_color, of_place = (of[shown] for of in albedo.attributes.errors(words, of_words))
        color, texel = fragment_colors(scene, cut, which), np.ones((len(which), 3))
        error = np.zeros((len(which), 3))
        for samples in fragment_samples(scene, cut, which):
            off = of_place[samples.which]
            if samples.texture.filter == "nearest" and off.max(initial=0) > BORDER:
                yield None
            texel[samples.which] = samples.colors
            error[samples.which] = _sample_errors(samples, off)
        if albedo.colors:
            error = color * error + (texel + error) * of_color[:, np.newaxis]
        yield _Errors(which, color * texel, error + albedo.has_product * albedo.FORMAT.step / 2)


def _sample_errors(samples: Samples, off: np.ndarray) -> np.ndarray:
    """Bounds of the errors of samples whose texture coordinates are off by some texels, shape (samples, 3).

    A bound covers the texels of all places up to this far off.
    """
    texture, nearest = samples.texture, samples.texture.filter == "nearest"
    error = np.empty((len(off), 3))
    for number in np.unique(samples.level):
        chosen = np.flatnonzero(samples.level == number)
        image = texture.levels[number]
        rounding = np.abs(TexelMemory.linear(TexelMemory.encode(image)) - image)
        place = samples.coordinates[chosen] * image.shape[1::-1] - (0 if nearest else 0.5)
        step = off[chosen, np.newaxis]
        found, colors = np.zeros((len(chosen), 3)), []
        for signs in product((-1, 1), repeat=2):
            first = np.floor(place + step * signs).astype(np.int64)
            columns, rows = (
                [wrapped(first[:, axis] + k, image.shape[1 - axis], texture.wrap[axis]) for k in (0, 1)]
                for axis in (0, 1)
            )
            if nearest:
                colors.append(image[rows[0], columns[0]])
                np.maximum(found, rounding[rows[0], columns[0]], out=found)
                continue
            texels = np.array([[image[row, column] for column in columns] for row in rows])
            across = np.abs(texels[:, 1] - texels[:, 0]).max(axis=0)
            down = np.abs(texels[1] - texels[0]).max(axis=0)
            largest = np.max([rounding[row, column] for row in rows for column in columns], axis=0)
            np.maximum(found, largest + step * (across + down), out=found)
        error[chosen] = found + (np.ptp(colors, axis=0) if nearest else 0) + TextureFilter.ERROR
    return error
