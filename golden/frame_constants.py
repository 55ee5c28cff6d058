"""Frame constants: what the pipeline is told before a frame, and the addresses of its write port."""

from dataclasses import dataclass

import numpy as np

from .intensity import MAX_LIGHTS, Intensity
from .lighting import halfway_vector
from .scene import Scene
from .unit_vector import quantise

__all__ = ["FIELDS_OF_A_FRAME", "FIELDS_OF_A_LIGHT", "LIGHT_STRIDE", "FrameConstants", "address_table"]

FIELDS_OF_A_FRAME = {"exponent": (0, 1), "ambient": (1, 3)}
"""First address and number of words of what a frame has once."""

FIELDS_OF_A_LIGHT = {"direction": (0, 3), "halfway": (3, 3), "diffuse": (6, 3), "specular": (9, 3)}
"""The same of what it has for each light, from ``(light + 1) * LIGHT_STRIDE`` on."""

LIGHT_STRIDE = 16
"""Addresses from one light to the next."""


@dataclass(frozen=True)
class FrameConstants:
    """Codes of the constants of a frame.

    Parameters
    ----------
    exponent : int
        Specular exponent, 1 to 1000.
    ambient : int array, shape (3,)
        Ambient colour operand, ``UQ(11, 6)`` in LSB.
    direction, halfway : int arrays, shape (lights, 3)
        Unit vectors to each light, and half-way to the viewer, ``SQ(1, 17)``.
    diffuse, specular : int arrays, shape (lights, 3)
        Colour operands of each light.
    """

    exponent: int
    ambient: np.ndarray
    direction: np.ndarray
    halfway: np.ndarray
    diffuse: np.ndarray
    specular: np.ndarray

    @classmethod
    def of(cls, scene: Scene, lights: int | None = None) -> "FrameConstants":
        """Constants of a scene, for a pipeline with ``lights`` lights.

        Lights that the scene does not have are black. A light straight behind the surface that faces the
        viewer (``L = -V``) has no half-way vector, and no specular light.

        Raises
        ------
        ValueError
            If the scene has more lights than the pipeline, or a term is brighter than 8.
        """
        count = max(len(scene.lights), 1) if lights is None else lights
        if not len(scene.lights) <= count <= MAX_LIGHTS:
            raise ValueError(f"the pipeline has {count} lights, the scene {len(scene.lights)}")
        direction = np.zeros((count, 3), dtype=np.int64)
        halfway, diffuse, specular = np.zeros((3, count, 3), dtype=np.int64)
        for index, light in enumerate(scene.lights):
            direction[index] = quantise(np.asarray(light.direction))
            diffuse[index] = Intensity.color(np.multiply(scene.material.diffuse, light.color))
            between = halfway_vector(light.direction, scene.camera.viewer)
            if np.any(between):
                halfway[index] = quantise(between)
                specular[index] = Intensity.color(np.multiply(scene.material.specular, light.color))
        ambient = Intensity.color(np.multiply(scene.material.ambient, scene.ambient_light))
        return cls(scene.material.exponent, ambient, direction, halfway, diffuse, specular)

    def writes(self) -> dict[str, np.ndarray]:
        """Beats for the write port: ``address`` and ``data``, 18 bits of each code."""
        address, data = [], []
        for name, (first, count) in FIELDS_OF_A_FRAME.items():
            address += range(first, first + count)
            data += np.ravel(getattr(self, name)).tolist()
        for light in range(len(self.direction)):
            base = (light + 1) * LIGHT_STRIDE
            for name, (first, count) in FIELDS_OF_A_LIGHT.items():
                address += range(base + first, base + first + count)
                data += getattr(self, name)[light].tolist()
        return {"address": np.array(address), "data": np.array(data) & 0x3FFFF}


_MEANINGS = {
    "exponent": "specular exponent, 1 to 1000",
    "ambient": "ambient colour, red green blue, UQ(11, 6) in LSB of the channel",
    "direction": "unit vector to the light, SQ(1, 17)",
    "halfway": "unit half-way vector, SQ(1, 17)",
    "diffuse": "diffuse colour, red green blue, UQ(11, 6)",
    "specular": "specular colour, red green blue, UQ(11, 6)",
}


def address_table(lights: int) -> list[str]:
    """Lines that tell the address of every constant of a pipeline with so many lights."""
    rows = [(first, count, name) for name, (first, count) in FIELDS_OF_A_FRAME.items()]
    for light in range(lights):
        base = (light + 1) * LIGHT_STRIDE
        rows += [(base + first, count, name) for name, (first, count) in FIELDS_OF_A_LIGHT.items()]
    return [
        f"  {first:>3}{f' to {first + count - 1}' if count > 1 else '':<8} {_MEANINGS[name]}"
        + (f" (light {first // LIGHT_STRIDE - 1})" if first >= LIGHT_STRIDE else "")
        for first, count, name in rows
    ]
