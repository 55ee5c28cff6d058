"""Bound of a frame's error by the quotient method, from the vectors of its own spans."""

import numpy as np

from blysk.golden.frames.prepare import span_vectors
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.lighting.quotient_lobe import QuotientLobe
from blysk.golden.methods.quotient_interpolator import QuotientErrors, QuotientInterpolator
from blysk.golden.pipeline import Design
from blysk.golden.reference.lighting import distant_cosine
from blysk.golden.reference.raster import Raster
from blysk.golden.reference.scene import Scene

__all__ = ["quotient_bound"]


def quotient_bound(scene: Scene, design: Design, cut: Raster) -> float:
    """Bound of the error against exact normals of every pixel with the same model, in LSB.

    The rounding of a pixel, 1/2, and of its colour operands, 1/128 each; and, for the brightest material, the
    bounds of N·L and of the highlight times reflection and light. `QuotientErrors` proves these for every
    span; the error of a lobe's table is measured at seven places of every step.

    Parameters
    ----------
    scene, design
        As for `compare`; the method is ``quotient``, with specular light.
    cut : Raster
        The spans that were shaded.
    """
    lobe, method = design.specular, design.interpolator
    assert isinstance(lobe, QuotientLobe)
    assert isinstance(method, QuotientInterpolator)
    if not len(cut.length):
        return 0.5
    errors = QuotientErrors.of(span_vectors(scene, cut, design), cut.length, method.mirror)
    largest = 0.0
    for material in scene.materials:
        parameter = design.highlight_parameter(material)
        highlight = errors.highlight(lobe.model, parameter) + lobe.line_error(parameter) + Lobe.ERROR
        total = np.zeros(3)
        for light in scene.lights:
            reflection = material.reflection(distant_cosine(light, scene.distant_viewer))
            diffuse = np.multiply(material.diffuse, errors.cosine + 2.0**-18)
            total += light.color * (diffuse + np.multiply(reflection, highlight))
        largest = max(largest, float(total.max()))
    return 0.5 + 255 * largest + (1 + 2 * len(scene.lights)) / 128
