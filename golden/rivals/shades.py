"""The way from operands to colours, counted: the same lobe, diffuse light and sums for every method."""

from typing import NamedTuple

import numpy as np

from blysk.golden.frame_constants import FrameConstants
from blysk.golden.lighting.diffuse import Diffuse
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import UQ, Fixed
from blysk.golden.reference.scene import Scene
from blysk.golden.rivals.trace import Trace

__all__ = ["Shades", "shaded", "shown"]


class Shades(NamedTuple):
    """Light of every fragment.

    Parameters
    ----------
    light : float64 array, shape (fragments, 3)
        Channels in LSB, limited to 0 to 255, before they are rounded.
    color : uint8 array, shape (fragments, 3)
        The pixels.
    """

    light: np.ndarray
    color: np.ndarray


def shown(total: Fixed) -> Shades:
    """Pixels of sums in LSB: limited, and rounded half up."""
    light = np.clip(total.values, 0, 255)
    return Shades(light, np.floor(light + 0.5).astype(np.uint8))


def shaded(scene: Scene, cosine: Fixed, operand: Fixed, lobe: Lobe, trace: Trace) -> Shades:
    """Colours from operands, as a pipeline computes them.

    Parameters
    ----------
    scene : Scene
        Lights, and one material.
    cosine : Fixed, shape (fragments, lights)
        N·L.
    operand : Fixed, shape (fragments, lights)
        Operand of the lobe.
    lobe : Lobe
        Unit of the highlight.
    trace : Trace
        Gets the parts.
    """
    constants = FrameConstants.of(scene, len(scene.lights), mirror=lobe.reflection.MIRROR)
    unit = Diffuse(cosine.format)
    dark = unit.dark(cosine)
    diffuse = trace.added(unit.compute(cosine))
    table = lobe.table(scene.materials[0].parameter(lobe.reflection))
    specular = lobe.compute(operand, dark, table)
    argument = lobe.argument(operand)
    lit = (argument.codes < 1 << argument.format.width - 1) & ~dark
    entry, fraction = lobe.address(Fixed(argument.format, np.where(lit, argument.codes, 0)))
    trace.read(lobe.entries * lobe.WORD_BITS, table.values[entry], table.differences[entry])
    trace.product(table.differences[entry], fraction)
    trace.added(specular)
    format = Intensity.COLOR_FORMAT * Intensity.TERM_FORMAT
    format = UQ(format.integer_bits + 5, format.fraction_bits)
    total = Fixed(format, np.broadcast_to(constants.ambient << 17, (len(dark), 3)))
    for term, colors in ((diffuse, constants.diffuse), (specular, constants.specular)):
        for light, color in enumerate(colors):
            word = Fixed(term.format, term.codes[:, light, np.newaxis])
            product = trace.product(word, Fixed(Intensity.COLOR_FORMAT, color[np.newaxis]))
            total = trace.added(Fixed(format, total.codes + product.codes))
    return shown(trace.added(total))
