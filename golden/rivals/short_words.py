"""Exact normals in short words: a unit normal for every pixel in 12 bits, and shading in half floats."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from blysk.golden.reference.fragments import fragment_normals
from blysk.golden.reference.lighting import halfway_vector
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["BITS", "SHORT_WORDS", "short_light"]

BITS = 12
"""Bits of a word, with its sign."""


class _Cosines(NamedTuple):
    """N·L and N·H of every fragment, and the highlight's power."""

    diffuse: np.ndarray
    highlight: np.ndarray
    power: np.ndarray


def _word(values: np.ndarray) -> np.ndarray:
    """Nearest word of `BITS` bits from -1 to 1, without 1 itself."""
    steps = 1 << BITS - 1
    found: np.ndarray = np.clip(np.rint(values * steps), -steps, steps - 1) / steps
    return found


def _in_words(normals: np.ndarray, towards: np.ndarray, halfway: np.ndarray, exponent: float) -> _Cosines:
    """Normals, L, H and both cosines in words of `BITS` bits; the sums and the power are exact."""
    normals = _word(normals)
    diffuse, highlight = (_word(normals @ _word(vector)) for vector in (towards, halfway))
    return _Cosines(diffuse, highlight, np.maximum(highlight, 0) ** exponent)


def _in_halves(normals: np.ndarray, towards: np.ndarray, halfway: np.ndarray, exponent: float) -> _Cosines:
    """Every operation is rounded to half precision of IEEE 754; the power is rounded once."""
    half = np.float16
    x, y, z = np.moveaxis(normals, -1, 0).astype(half)
    # The product of a normal of about unit length and a reciprocal root: a float16 operation rounds.
    scale = half(1) / np.sqrt(x * x + y * y + z * z)
    x, y, z = x * scale, y * scale, z * scale
    diffuse, highlight = (
        x * vector[0] + y * vector[1] + z * vector[2]
        for vector in (towards.astype(half), halfway.astype(half))
    )
    power = (np.maximum(highlight, half(0)).astype(np.float64) ** exponent).astype(half)
    return _Cosines(diffuse, highlight, power)


SHORT_WORDS: Mapping[str, Callable[[np.ndarray, np.ndarray, np.ndarray, float], _Cosines]] = {
    "12 bits": _in_words,
    "half floats": _in_halves,
}
"""How cosines are made, by the words' name."""


def short_light(scene: Scene, raster: Raster, words: str) -> np.ndarray:
    """Blinn's light of every fragment from exact normals, with short words from the unit normal on.

    The interpolated normal is exact and of unit length before it is rounded, and colours are exact. Both are
    kind to these words.

    Parameters
    ----------
    scene : Scene
        Scene of one material, with one distant white light and a distant viewer.
    raster : Raster
        Its raster.
    words : str
        A name of `SHORT_WORDS`.

    Returns
    -------
    float64 array, shape (fragments, 3)
        Channels in LSB, limited to 0 to 255, before they are rounded.

    Raises
    ------
    ValueError
        If the scene has several lights or materials, or a near light or viewer.

    Source: docs/theory/rivals.md#short-words.
    """
    if len(scene.lights) != 1 or len(scene.materials) != 1 or scene.local:
        raise ValueError("short words need a material, and a distant light and viewer")
    towards, material = scene.lights[0].towards(), scene.materials[0]
    normals = fragment_normals(scene, raster, np.arange(len(raster.span)))
    halfway = halfway_vector(towards, scene.camera.viewer)
    found = SHORT_WORDS[words](normals, towards, halfway, material.exponent)
    diffuse = np.maximum(found.diffuse, 0).astype(np.float64)
    power = np.where(found.diffuse > 0, found.power, 0).astype(np.float64)
    colors = (np.asarray(of) for of in (material.ambient, material.diffuse, material.specular))
    ambient, of_diffuse, of_power = colors
    light = ambient + diffuse[:, np.newaxis] * of_diffuse + power[:, np.newaxis] * of_power
    found_light: np.ndarray = np.clip(255 * light, 0, 255)
    return found_light
