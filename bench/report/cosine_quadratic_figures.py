"""Figures of the report's section on the cosine-quadratic models: errors, slopes, curves, maps, pictures."""

import base64
import math
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

from blysk.bench.accuracy import scene_for
from blysk.bench.surfaces import sphere
from blysk.golden.reference.camera import Camera
from blysk.golden.reference.metrics import error_figures
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "CURVES",
    "EXPONENTS",
    "INFERRED",
    "PICTURED",
    "PICTURE_EXPONENT",
    "PUBLISHED",
    "RELATED",
    "SEEN",
    "SHOWN",
    "ZONE",
    "Published",
    "coefficients",
    "curves",
    "errors",
    "map_of_errors",
    "pictures",
    "slopes",
]


EXPONENTS = range(2, 1001)
"""Range of exponents in [C]."""

ZONE = 0.59363
"""Least brightness of Blinn's model in the "epicentre zone", which [C] does not define: it gives the 7.924 %
that [C] states for f2."""

_X = np.linspace(0, 30, 6001)
"""``n (1 - cos gamma)``, on which the models depend almost alone; above 30 Blinn is below 1e-13."""

CURVES = ("cosquad", "cosquad_q", "cosquad_lin")

SHOWN = (5, 20, 100)

SEEN = 0.1
"""Least brightness of Blinn's model for a relative error to be drawn."""

RELATED = ("cosquad7", "coscos2", "coscos4")

PICTURED = ("blinn", "cosquad", "cosquad_q", "cosquad_lin")

PICTURE_EXPONENT = 50

INFERRED = "What the published figure shows is inferred from the text; the figure itself was not at hand."


@dataclass(frozen=True)
class Published:
    """A figure of [C].

    Parameters
    ----------
    what : str
        Name of the figure.
    published : str
        The published number, digit by digit.
    key : tuple of str
        Key of our figure: name of a measurement, and of a figure in it.
    percent : bool
        Whether it is published in per cent; ours is not.
    """

    what: str
    published: str
    key: tuple[str, str]
    percent: bool = False


PUBLISHED = (
    Published("f2, largest absolute error", "0.162", ("cosquad", "absolute")),
    Published("f2, largest relative error in the zone, %", "7.924", ("cosquad", "relative"), True),
    Published(
        "fQ (Q = 0.64), largest relative error in the zone, %", "1.255", ("cosquad_q", "relative"), True
    ),
    Published("fQ2, largest relative error in the zone, %", "1.256", ("cosquad_lin", "relative"), True),
    Published("fQ2, largest absolute error", "0.128", ("cosquad_lin", "absolute")),
    Published("0.448 n + 0.099, largest relative error, %", "0.5", ("slopes", "error"), True),
    Published("coef(2)", "0.634", ("coefficients", "2")),
    Published("coef(3)", "0.833", ("coefficients", "3")),
    Published("coef(4)", "1.04", ("coefficients", "4")),
    Published("coef(5)", "1.25", ("coefficients", "5")),
    Published("coef(10)", "2.313", ("coefficients", "10")),
    Published("largest deviation of the reflectance from 1", "0.053", ("coefficients", "deviation")),
)
"""Figures of [C], in its order."""


def errors(model: str) -> dict[str, Any]:
    """Largest errors of a model against Blinn's, over all angles and `EXPONENTS`.

    Returns
    -------
    dict
        ``absolute``, and its exponent, ``absolute_exponent``; ``relative``: largest relative error in the
        zone; ``by_exponent``: exponent, absolute and relative error of some exponents.
    """
    found = []
    for exponent in EXPONENTS:
        cosine = np.append(1 - _X[exponent >= _X] / exponent, ZONE ** (1 / exponent))
        blinn = cosine**exponent
        error = np.abs(REFLECTION_MODELS[model].reflect(cosine, exponent) - blinn)
        # The zone's own bound is in it.
        zone = blinn >= ZONE * (1 - 1e-12)
        found.append((exponent, float(error.max()), float((error[zone] / blinn[zone]).max())))
    absolute = max(found, key=lambda entry: entry[1])
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - EXPONENTS[0]
    return {
        "absolute": absolute[1],
        "absolute_exponent": absolute[0],
        "relative": max(entry[2] for entry in found),
        "by_exponent": [list(found[k]) for k in shown],
    }


def slopes() -> dict[str, Any]:
    """Slope k of fQ with Q = 0.64 at some exponents, [C]'s line through it, and the line's largest error.

    Returns
    -------
    dict
        ``exponents``, ``exact``, ``line``, and ``error``: largest relative error over all of `EXPONENTS`;
        ``refitted``: the same error of ``0.44813 n + 0.10235``.
    """
    every = np.array(EXPONENTS)
    exact, line, refitted = (
        np.array([REFLECTION_MODELS[model].slope(n) for n in every])
        for model in ("cosquad_q", "cosquad_lin", "cosquad_lin_refitted")
    )
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - every[0]
    return {
        "exponents": every[shown].tolist(),
        "exact": exact[shown].tolist(),
        "line": line[shown].tolist(),
        "error": float(np.abs(line / exact - 1).max()),
        "refitted": float(np.abs(refitted / exact - 1).max()),
    }


def coefficients() -> dict[str, Any]:
    """Ideal coef(n) of fQ2, ``1/(2 pi integral_0^1 S(c) c dc)``, and [C]'s line for it.

    With the slope k, ``S = (1 - k (1-c))^2`` down to ``c = max(1 - 1/k, 0)``; the integral is taken in closed
    form.

    Returns
    -------
    dict
        ``exponents``, ``ideal`` and ``line`` of some exponents; ``deviation``: largest relative error of the
        line over `EXPONENTS`, and its exponent, ``deviation_exponent``; the ideal at n = 2, 3, 4, 5 and 10,
        with n as a text for its key.
    """
    n = np.array(EXPONENTS, dtype=np.float64)
    k = np.array([REFLECTION_MODELS["cosquad_lin"].slope(value) for value in n])
    # With y = 1 - c from 0 to w: (1 - k y)^2 (1 - y).
    w = np.minimum(1 / k, 1)
    inside = w - (1 + 2 * k) * w**2 / 2 + (2 * k + k**2) * w**3 / 3 - k**2 * w**4 / 4
    ideal = 1 / (2 * np.pi * inside)
    line = np.array([REFLECTION_MODELS["cosquad_lin"].energy_factor(value) for value in n])
    deviation = np.abs(line / ideal - 1)
    shown = np.unique(np.geomspace(2, 1000, 60).astype(int)) - EXPONENTS[0]
    return {
        "exponents": n[shown].tolist(),
        "ideal": ideal[shown].tolist(),
        "line": line[shown].tolist(),
        "deviation": float(deviation.max()),
        "deviation_exponent": int(n[deviation.argmax()]),
        **{str(value): float(ideal[value - EXPONENTS[0]]) for value in (2, 3, 4, 5, 10)},
    }


def curves(exponent: int) -> dict[str, Any]:
    """Brightness against the angle, of Blinn's model and those of [C].

    Parameters
    ----------
    exponent : int
        n; angles go up to that at which Blinn's model is about ``exp(-6)``, or to 90 degrees.

    Returns
    -------
    dict
        ``degrees``, and by model the brightness.
    """
    degrees = np.linspace(0, math.degrees(math.acos(max(1 - 6 / exponent, 0))), 121)
    cosine = np.cos(np.radians(degrees))
    brightness = {
        model: REFLECTION_MODELS[model].reflect(cosine, exponent).tolist() for model in ("blinn", *CURVES)
    }
    return {"degrees": degrees.tolist(), **brightness}


def map_of_errors(model: str, size: int) -> dict[str, Any]:
    """Error of a model against Blinn's, over angle and exponent.

    Parameters
    ----------
    model : str
        Reflection model.
    size : int
        Number of angles, and of exponents.

    Returns
    -------
    dict
        ``degrees``, ``exponents`` and ``error``, an array of exponents by angles.
    """
    degrees, exponents = np.linspace(0, 90, size), np.geomspace(2, 1000, size)
    cosine = np.cos(np.radians(degrees))
    error = [
        REFLECTION_MODELS[model].reflect(cosine, n) - REFLECTION_MODELS["blinn"].reflect(cosine, n)
        for n in exponents
    ]
    return {
        "degrees": degrees.tolist(),
        "exponents": exponents.tolist(),
        "error": np.round(error, 5).tolist(),
    }


def pictures(body: str, exponent: int, width: int, height: int) -> dict[str, Any]:
    """A body in Blinn's model and in those of [C], drawn by the golden renderer with Phong shading.

    Parameters
    ----------
    body : str
        ``"sphere"`` or ``"teapot"``.
    exponent : int
        Exponent of the highlight.
    width, height : int
        Size of each picture.

    Returns
    -------
    dict
        For each model ``png`` in base 64, and ``max_lsb``, ``p999_lsb`` and ``psnr_db`` against Blinn's
        picture.
    """
    mesh = sphere(48) if body == "sphere" else teapot(10_000)
    scene = scene_for(mesh, exponent, width, height)
    scene = replace(scene, camera=Camera.framing(mesh.vertices, (0.2, 0.3, 1), "perspective", width / height))
    raster = rasterise(scene)
    found = {}
    exact = render(scene, "phong", REFLECTION_MODELS["blinn"], raster)
    for model in PICTURED:
        frame = render(scene, "phong", REFLECTION_MODELS[model], raster)
        figures = error_figures(frame.image * 255, exact.image * 255, exact.mask)
        shown = np.where(frame.mask[..., np.newaxis], frame.image, 1.0)
        buffer = BytesIO()
        Image.fromarray(np.rint(shown * 255).astype(np.uint8)).convert("L").save(buffer, "PNG", optimize=True)
        found[model] = {
            "png": base64.b64encode(buffer.getvalue()).decode(),
            "max_lsb": figures.max_lsb,
            "p999_lsb": figures.p999_lsb,
            "psnr_db": figures.psnr_db if math.isfinite(figures.psnr_db) else None,
        }
    return found
