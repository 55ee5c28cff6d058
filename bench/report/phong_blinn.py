"""Claims of [P] on Phong's and Blinn's highlights: exponents, operations, times, and shapes of highlights."""

import base64
import io
import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from PIL import Image
from scipy.optimize import brentq

from blysk.bench.accuracy import scene_for
from blysk.bench.report.claims import Claim, ClaimTable, Document, Plot, at_least
from blysk.bench.report.counted import Counted, dot, fastest
from blysk.bench.report.section import Drawing
from blysk.bench.store import Task
from blysk.bench.surfaces import sphere
from blysk.bench.svg import panels, svg
from blysk.golden.frames.compare import compare
from blysk.golden.presets import preset
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS, exponent_ratio
from blysk.golden.reference.renderer import render
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "PIXELS",
    "WAYS",
    "claims",
    "exponent_at",
    "exponent_of_width",
    "frame_times",
    "half_angle",
    "operations",
    "picture",
    "section",
    "shading_times",
    "tasks",
    "vectors",
]

PIXELS = 1 << 14
"""Pixels that the ways in software compute at a time. Their arrays stay in a processor's cache."""

_EXPONENT = 50


# The ways in software. From unit vectors N, L and V, as arrays of three rows, a way computes the cosines of
# the highlight and of the diffuse term of a pixel, and then the power. A vector that is the same for a whole
# frame has one column.


def _halfway(light: np.ndarray, viewer: np.ndarray) -> np.ndarray:
    total = light + viewer
    return total / np.sqrt(dot(total, total))


def _shaded(cosine: np.ndarray, highlight: np.ndarray) -> np.ndarray:
    power = np.maximum(highlight, 0.0) ** float(_EXPONENT)
    return np.maximum(cosine, 0.0) * 0.4 + power * 0.5 + 0.1


def _phong_vector(normal, light, viewer):
    cosine = dot(normal, light)
    mirrored = 2 * cosine * normal - light
    return _shaded(cosine, dot(mirrored, viewer))


def _phong_scalar(normal, light, viewer):
    cosine = dot(normal, light)
    return _shaded(cosine, 2 * cosine * dot(normal, viewer) - dot(light, viewer))


def _blinn(normal, light, viewer):
    return _shaded(dot(normal, light), dot(normal, _halfway(light, viewer)))


WAYS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "Phong, vector R": _phong_vector,
    "Phong, 2 (N·L)(N·V) - L·V": _phong_scalar,
    "Blinn": _blinn,
}
"""Functions from N, L and V to a pixel's brightness in one channel, with diffuse and ambient light."""


def vectors(local: bool) -> list[np.ndarray]:
    """Random unit N of every pixel, and L and V of every pixel or of the frame."""
    rng = np.random.default_rng(1)
    columns = (PIXELS, PIXELS if local else 1, PIXELS if local else 1)
    found = [rng.normal(size=(3, count)) for count in columns]
    return [vector / np.sqrt(dot(vector, vector)) for vector in found]


def operations(way: str, local: bool) -> dict[str, float]:
    """Operations of a pixel, counted during the computation.

    Parameters
    ----------
    way : str
        One of `WAYS`.
    local : bool
        Whether every pixel has its own L and V. Else L, V, L·V and H are computed once a frame, so they add
        almost nothing to a pixel.

    Returns
    -------
    dict
        Operations of a pixel by kind (see `Counted`), and their sum ``all``. ``fewer`` is the share of
        operations that the way saves, compared with the first of `WAYS`.
    """
    counts: dict[str, Counter[str]] = {}
    for name in (next(iter(WAYS)), way):
        counts[name] = Counter()
        WAYS[name](*(Counted.of(vector, counts[name]) for vector in vectors(local)))
    first, own = (sum(of.values()) for of in (next(iter(counts.values())), counts[way]))
    of_pixel = {kind: count / PIXELS for kind, count in counts[way].items()}
    return {**of_pixel, "all": own / PIXELS, "fewer": 1 - own / first}


def shading_times(local: bool, repeats: int) -> dict[str, float]:
    """Share of time that each way saves on the same pixels in one run, compared with Phong's way by R.

    Parameters
    ----------
    local : bool
        As in `operations`.
    repeats : int
        Runs of each way, in turn. The fastest run counts.
    """
    operands = vectors(local)
    times = fastest([lambda way=way: way(*operands) for way in WAYS.values()], repeats)
    return {name: 1 - time / times[0] for name, time in zip(WAYS, times, strict=True)}


def frame_times(triangles: int, width: int, height: int, repeats: int) -> dict[str, float]:
    """[P] figure 8: time of a frame by the golden renderer with Phong's and with Blinn's model, in one run.

    Parameters
    ----------
    triangles : int
        Approximate number of triangles of the teapot.
    width, height : int
        Size of the picture.
    repeats : int
        Runs of each model, in turn. The fastest run counts.

    Returns
    -------
    dict
        - ``phong`` and ``blinn``: nanoseconds of a pixel that shows the teapot, geometry included;
        - ``frame`` and ``shading``: share of time that Blinn's model saves, of the frame and of its shading;
        - ``geometry``: share of geometry in the time of Blinn's frame.
    """
    scene = scene_for(teapot(triangles), _EXPONENT, width, height)
    raster = rasterise(scene)
    geometry, phong, blinn = fastest(
        [
            lambda: rasterise(scene),
            lambda: render(scene, "phong", REFLECTION_MODELS["phong"], raster),
            lambda: render(scene, "phong", REFLECTION_MODELS["blinn"], raster),
        ],
        repeats,
    )
    pixels = int(raster.visible.sum())
    return {
        "phong": (geometry + phong) / pixels * 1e9,
        "blinn": (geometry + blinn) / pixels * 1e9,
        "frame": 1 - (geometry + blinn) / (geometry + phong),
        "shading": 1 - blinn / phong,
        "geometry": geometry / (geometry + blinn),
    }


# Shapes of the highlights.


def exponent_at(degrees: float) -> float:
    """[P] figure 5: Blinn's exponent over Phong's for the same brightness, ``ln(2c^2 - 1)/ln c``."""
    return float(exponent_ratio(math.cos(math.radians(degrees))))


_ALONG, _ACROSS = "along", "across"

_DIRECTIONS = {_ALONG: (1, 0), _ACROSS: (0, 1)}
"""Directions of a normal from H: along the plane of L and V, and across the plane."""


def half_angle(way: Sequence[float], degrees: float, exponent: float) -> float:
    """Angle in radians of a normal from H, at which ``(R·V)^n`` is half of its peak. NaN without this angle.

    The angle is found from R·V itself, ``R = 2 (N·L) N - L``.

    Parameters
    ----------
    way : two floats
        Unit vector from H to the normal: its parts along the plane of L and V, and across the plane.
    degrees : float
        Half of the angle from L to V, a.
    exponent : float
        n.
    """
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    light, viewer = np.array([sine, 0, cosine]), np.array([-sine, 0, cosine])

    def excess(gamma: float) -> float:
        normal = np.array([way[0] * math.sin(gamma), way[1] * math.sin(gamma), math.cos(gamma)])
        mirrored = 2 * (normal @ light) * normal - light
        return max(float(mirrored @ viewer), 0.0) ** exponent - 0.5

    return brentq(excess, 0, math.pi / 2) if excess(math.pi / 2) < 0 else math.nan


def exponent_of_width(way: str, degrees: float, exponent: float) -> float:
    """Exponent, divided by n, of Blinn's highlight that is half of its peak where ``(R·V)^n`` is, too.

    Parameters
    ----------
    way : {"along", "across"}
        Direction in which the normal turns: along the plane of L and V, or across the plane.
    degrees, exponent
        As in `half_angle`.
    """
    gamma = half_angle(_DIRECTIONS[way], degrees, exponent)
    return math.log(0.5) / math.log(math.cos(gamma)) / exponent


_DEGREES, _N = 50, 12
"""a and Phong's n of the pictures."""

_PICTURES = (
    ("phong", _N, f"true Phong, n = {_N}"),
    ("blinn", 4 * _N, f"Blinn, 4 n = {4 * _N}: equal along"),
    *(
        ("blinn", n, f"Blinn, 4 n cos² a = {n}: equal across")
        for n in [round(4 * _N * math.cos(math.radians(_DEGREES)) ** 2)]
    ),
)
"""Model, exponent and title of each picture."""


def picture(model: str, exponent: int, side: int) -> dict[str, Any]:
    """A highlight on a sphere by the simulated pipeline `quotient`. L and V are 100 degrees apart.

    Parameters
    ----------
    model : str
        ``"blinn"`` or ``"phong"``.
    exponent : int
        Exponent of the model.
    side : int
        Width and height.

    Returns
    -------
    dict
        ``png``: the part with the highlight, in base 64. ``lsb``: largest error of the picture, without the
        border of the light.
    """
    scene = scene_for(sphere(48), exponent, side, side)
    right, _, towards = scene.camera.axes[0], scene.camera.axes[1], scene.camera.viewer
    turn = math.radians(2 * _DEGREES)
    scene = replace(scene, lights=(Light(tuple(math.cos(turn) * towards - math.sin(turn) * right)),))
    design = preset("quotient", model)
    frame = FrameSimulator(design, "auto").render(scene)
    buffer = io.BytesIO()
    part = frame.image[side // 8 : side - side // 8, : side // 2]
    Image.fromarray(part).convert("L").save(buffer, "png", optimize=True)
    error = compare(scene, design, frame).method_error.steady_lsb
    return {"png": base64.b64encode(buffer.getvalue()).decode(), "lsb": error}


def _pictures(found: Sequence[dict]) -> Drawing:
    figure, row = panels(9.0, 3.3, len(found))
    for axes, result, (_, _, title) in zip(row, found, _PICTURES, strict=True):
        image = Image.open(io.BytesIO(base64.b64decode(result["png"])))
        axes.imshow(np.asarray(image), cmap="gray", vmin=0, vmax=255)
        axes.set(xticks=(), yticks=())
        axes.grid(False)
        axes.set_title(title, fontsize=8)
        axes.set_xlabel(f"largest error {result['lsb']:.2f} LSB", fontsize=8)
    return Drawing(
        "phong-blinn-pictures",
        "True Phong and Blinn by simulated hardware",
        svg(figure),
        f"A sphere, with the light {2 * _DEGREES} degrees from the viewer. Phong's highlight is wider across "
        "the plane of L and V than along the plane. Blinn's highlight is a circle in the space of normals.",
    )


# The claims.


def _shapes(quick: bool) -> list[Claim]:
    brightness = "over n, for the same brightness, gamma = {} degrees"
    found = [
        Claim("[P] figure 5", "about 4", brightness.format(g), exponent_at, {"degrees": g}, printed=printed)
        for g, printed in ((0, "4"), (15, ""), (30, ""), (40, ""), (44, ""))
    ]
    for way in _DIRECTIONS:
        for degrees in (0, 30, 60, 75):
            limit = "4" if way == _ALONG else f"4 cos^2 a = {4 * math.cos(math.radians(degrees)) ** 2:.3f}"
            for n in (10, 1000):
                quantity = (
                    f"over n, for the same half-width {way} the plane of L and V, n = {n}, a = {degrees}"
                )
                settings = {"way": way, "degrees": degrees, "exponent": n}
                found.append(
                    Claim("[P]", "about 4", quantity, exponent_of_width, settings, printed="4", ours=limit)
                )
    return found


def _counts(quick: bool) -> list[Claim]:
    fewer, found = "20 to 35 % fewer operations", []
    for local, whose in ((False, "the frame's"), (True, "each pixel's")):
        for way in WAYS:
            what = f"operations saved: {way}, L and V are {whose}, %"
            printed = "20 to 35" if way == "Blinn" else ""
            settings = {"way": way, "local": local}
            found.append(Claim("[P]", fewer, what, operations, settings, "fewer", printed, at_least))
        for way in list(WAYS)[1:]:
            settings = {"local": local, "repeats": 20 if quick else 100}
            what = f"time saved: {way}, L and V are {whose}, %"
            found.append(Claim("[P]", fewer, what, shading_times, settings, way, timed=True))
    return found


def _frames(quick: bool) -> list[Claim]:
    size = {"width": 320, "height": 240} if quick else {"width": 1920, "height": 1080}
    found = []
    for triangles in (1_000, 10_000) if quick else (1_000, 10_000, 100_000, 1_000_000):
        settings = {"triangles": triangles, **size, "repeats": 9 if quick else 2}
        for key, what in (
            ("frame", "time of a frame saved by Blinn"),
            ("shading", "time of the frame's shading saved by Blinn"),
            ("geometry", "share of geometry in Blinn's frame"),
        ):
            printed = "40 to 45" if key == "frame" and triangles == 1_000_000 else ""
            quantity = f"{what}, {triangles:,} triangles, {size['width']}x{size['height']}, %"
            less = "40 to 45 % less time at a million polygons"
            found.append(
                Claim(
                    "[P] figure 8", less, quantity, frame_times, settings, key, printed, at_least, timed=True
                )
            )
    return found


def claims(quick: bool) -> list[Claim]:
    """Claims. Frames have up to 10,000 triangles at 320x240 if quick, else up to a million at 1920x1080."""
    return [*_shapes(quick), *_counts(quick), *_frames(quick)]


_DOCUMENT = Document(
    "phong-blinn",
    "[P]: Phong and Blinn",
    [
        "[P] compares Phong's model, `(R·V)^p`, with Blinn's, `(N·H)^n`. The factor of about 4 between the "
        "exponents holds for coplanar vectors near the peak. [P] itself says that the factor does not hold "
        "towards pi/2. Let 2 a be the angle from L to V. In the space of normals, along the plane of L and "
        "V, Phong's power n is as wide as Blinn's power 4 n. Across the plane it is as wide as "
        "`4 n cos^2 a`. So no exponent makes both models equal, unless L = V.",
        "The section *Error against run time* has both models in hardware. The section *The documents' "
        "criteria* has cycles by number of triangles.",
    ],
    [
        ClaimTable(
            "phong-blinn-exponents",
            "Blinn's exponent for Phong's highlight",
            _shapes,
            "We compute half-widths from R·V itself. The angle a is in degrees.",
        ),
        ClaimTable(
            "phong-blinn-operations",
            "Operations and time to shade a pixel, compared with Phong by the vector R",
            _counts,
            "One channel and one light, with diffuse and ambient light. A power counts as one function. "
            "Operations are counted and timed while NumPy computes in float64. The ways run in turn in the "
            "same run, and the fastest of many times counts.",
            {"operations": "all"}
            | {
                kind: kind
                for kind in ("multiplications", "additions", "divisions", "roots", "functions", "comparisons")
            },
        ),
        ClaimTable(
            "phong-blinn-frames",
            "Time of a frame with Phong's and with Blinn's model",
            _frames,
            f"Teapot, exponent {_EXPONENT}. Processor time of the golden renderer, NumPy in float64, with "
            "both models in one run. The renderer shades only visible pixels. If geometry takes more of the "
            "time, a model saves a smaller share.",
            {"Phong, ns a visible pixel": "phong", "Blinn, ns a visible pixel": "blinn"},
        ),
    ],
    [
        Plot(
            lambda quick: [
                Task(picture, {"model": model, "exponent": n, "side": 240 if quick else 480})
                for model, n, _ in _PICTURES
            ],
            _pictures,
        )
    ],
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
