"""Measurements of the report's section on [T]: speed in software and in hardware, shares of shading, MNSE."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.report.thesis_ways import SPANS, WAYS, Counted, finish, random_operands
from blysk.bench.speed.renderer import timed
from blysk.bench.speed.throughput import measure, spans_of
from blysk.bench.tools.blocks import Entry, entry_of, row_of
from blysk.bench.tools.place_and_route import lay_out
from blysk.bench.tools.tool_runner import TooLarge
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import constants_of, prepare
from blysk.golden.presets import preset
from blysk.golden.reference.metrics import error_figures, mnse_published, nmse
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.installation import install_extra
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "SHADINGS",
    "UNITS",
    "clock_rate",
    "fastest",
    "frame_cycles",
    "hardware",
    "prices",
    "shading_share",
    "software",
    "square_errors",
]


SHADINGS = ("gouraud", "phong")

UNITS = {
    "renormaliser": ("renormaliser", ""),
    "bisection": ("bisection", "2, 45"),
    "middle normal": ("middle_normal", "exact"),
    "middle normal, one a cycle": ("middle_normal", "exact, interval 1"),
    "forward differences": ("difference_accumulator", ""),
    "recurrence": ("recurrence", "reinsch, interleaved"),
    "renormalise interpolator": ("renormalise_interpolator", "renormalise"),
    "bisection interpolator": ("bisection_interpolator", "bisection"),
    "quadratic interpolator": ("quadratic_interpolator", "quadratic"),
    "recurrence interpolator": ("recurrence_interpolator", "recurrence"),
}
"""Units of the claims: unit and variant in the table of ``blysk blocks``. An interpolator includes its setup,
and gives N·L and N·H; the others are only the unit of a pixel."""


def fastest(actions: Sequence[Callable[[], Any]], repeats: int) -> list[float]:
    """Least processor time of each of several actions, in seconds; they run in turn, in the same minutes.

    It is the time of all threads, as if they shared one core; other processes do not count.

    Parameters
    ----------
    actions : sequence of callables
        Actions to time.
    repeats : int
        Number of runs of each.
    """
    times = [[timed(action, 1)[0].cpu for action in actions] for _ in range(repeats)]
    return np.min(times, axis=0).tolist()


def software(way: str, baseline: str, pixels: int, repeats: int) -> dict[str, Any]:
    """Two ways in software on the same spans: ratio of times, operations a result, and largest difference.

    Both are NumPy in float64, vectorised over `SPANS` random spans of up to 45 degrees, their setup included.

    Parameters
    ----------
    way, baseline : str
        Two of `WAYS`.
    pixels : int
        Pixels of each span; for a bisection a power of two, one more than its results.
    repeats : int
        Runs of each; the fastest counts.

    Returns
    -------
    dict
        ``ratio``: time of the baseline over time of the way. ``operations``, ``baseline_operations``:
        operations a result, by kind (see `Counted`). ``difference``: largest difference of a component of a
        normal, or of a cosine.
    """
    operands = random_operands()
    pair = WAYS[way], WAYS[baseline]
    operations = []
    for one in pair:
        counts: Counter[str] = Counter()
        found = sum(1 for _ in one(*(Counted.of(x, counts) for x in operands), pixels))
        operations.append({kind: count / (found * SPANS) for kind, count in counts.items()})
    results = zip(*(one(*operands, pixels) for one in pair), strict=True)
    difference = max(float(np.abs(ours - theirs).max()) for ours, theirs in results)
    # So many runs at once that a timing is no matter of microseconds.
    runs = max(1, 64 // pixels)
    time, baseline_time = fastest(
        [lambda one=one: [finish(one, operands, pixels) for _ in range(runs)] for one in pair], repeats
    )
    return {
        "ratio": baseline_time / time,
        "operations": operations[0],
        "baseline_operations": operations[1],
        "difference": difference,
    }


def prices(repeats: int) -> dict[str, float]:
    """Times of a division, a root and a cosine in NumPy, as ratios to a multiplication.

    Parameters
    ----------
    repeats : int
        Runs of each; the fastest counts.
    """
    x = np.random.default_rng(1).uniform(0.5, 1, SPANS)
    actions = {"a multiplication": lambda: x * x, "a division": lambda: x / x}
    actions |= {"a root": lambda: np.sqrt(x), "a cosine": lambda: np.cos(x)}
    # Many at once: one takes some microseconds.
    loops = [lambda action=action: [action() for _ in range(100)] for action in actions.values()]
    product, *times = fastest(loops, repeats)
    return {name: time / product for name, time in zip(list(actions)[1:], times, strict=True)}


def _entry(name: str) -> Entry:
    return entry_of(*UNITS[name])


def hardware(name: str) -> dict[str, Any]:
    """Cycles and parts of a unit of `UNITS`.

    Returns
    -------
    dict
        ``latency`` and ``interval`` (initiation interval) in cycles, ``cells``, ``multipliers``,
        ``register_bits``, and ``memory_bits``.
    """
    row = row_of(_entry(name), None)
    return {
        "latency": row.latency,
        "interval": row.interval,
        **row.cost.totals,
    }


def clock_rate(name: str, seeds: int, tools: dict[str, str | None]) -> dict[str, Any]:
    """Clock rate of a unit of `UNITS` after place and route.

    Parameters
    ----------
    name : str
        The unit.
    seeds : int
        Number of placements.
    tools : dict of str to str or None
        Versions of the tools, which the result depends on.

    Returns
    -------
    dict
        ``fmax``: median clock rate in MHz, or ``None`` with the ``reason``.
    """
    if None in tools.values():
        return {"fmax": None, "reason": f"place and route is not installed: {install_extra('fpga')}"}
    try:
        layout = lay_out(name, _entry(name).variant.unit(), seeds)
    except TooLarge as error:
        return {"fmax": None, "reason": str(error)}
    return {"fmax": layout.fmax[1], "reason": ""}


def frame_cycles(name: str, triangles: int, width: int, height: int) -> float:
    """Cycles a pixel of a frame in the simulated pipeline with an interpolator of `UNITS`.

    Parameters
    ----------
    name : str
        The interpolator.
    triangles : int
        Triangles of the teapot, about.
    width, height : int
        Size of the picture.
    """
    _, method = UNITS[name]
    scene = scene_for(teapot(triangles), 50, width, height)
    unit = ShadingPipelineUnit(preset(method, "cosquad"))
    pixels, cycles = measure(unit, spans_of(scene, method), FrameConstants.of(scene, 1))
    return cycles / pixels


def shading_share(triangles: int, width: int, height: int, repeats: int) -> dict[str, Any]:
    """Share of a frame's time that the golden renderer spends on shading, by Gouraud's and Phong's method.

    Parameters
    ----------
    triangles : int
        Triangles of the teapot, about.
    width, height : int
        Size of the picture.
    repeats : int
        Runs of each part, in turn; the fastest count.

    Returns
    -------
    dict
        ``triangles`` and ``pixels``; ``gouraud`` and ``phong``: shading over rasterising and shading.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    raster = rasterise(scene)
    actions = [lambda: rasterise(scene)]
    actions += [
        lambda shading=shading: render(scene, shading, REFLECTION_MODELS["phong"], raster)
        for shading in SHADINGS
    ]
    geometry, *times = fastest(actions, repeats)
    shares = {shading: time / (geometry + time) for shading, time in zip(SHADINGS, times, strict=True)}
    return {"triangles": len(scene.mesh.faces), "pixels": int(raster.visible.sum()), **shares}


def square_errors(method: str, triangles: int, width: int, height: int) -> dict[str, Any]:
    """MNSE of a frame as published in [T] 4.1, and its well-posed form NMSE.

    The frame is by the bit-accurate model with `model_of` the method; the reference is the exact
    frame, Phong shading with Blinn's model. Only pixels of the surface count.

    Parameters
    ----------
    method : str
        One of `METHODS` or `PUBLISHED`.
    triangles : int
        Triangles of the teapot, about.
    width, height : int
        Size of the picture.

    Returns
    -------
    dict
        ``nmse``, ``published``, ``defined`` (share of values for which the published form is defined),
        ``max_lsb`` and ``p999_lsb``; ``nearest``: share of the published form that comes from the 1 % of the
        values nearest the mean; ``worst`` and ``least``: the published form for the reference itself with
        1 LSB more in the one value that counts most, or least; ``one``: NMSE of either.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    design = preset(method, model_of(method))
    prepared = prepare(scene, design)
    color = design.compute(prepared.spans, constants_of(scene, design)).color
    exact = render(scene, raster=prepared.raster)
    image = np.zeros((height * width, 3))
    seen = prepared.cut_raster.visible
    image[prepared.cut_raster.pixel[seen]] = color[seen]
    shown, reference = image[exact.mask.ravel()], exact.image[exact.mask] * 255
    errors = error_figures(shown[np.newaxis], reference[np.newaxis])
    published, defined = mnse_published(shown, reference)
    distance = np.abs(reference - reference.mean()).ravel()
    order = np.argsort(distance)
    terms = np.square((shown - reference).ravel()[order] / distance[order])
    ones = []
    for place in (distance.argmin(), distance.argmax()):
        wrong = reference.copy().ravel()
        wrong[place] += 1
        ones.append((mnse_published(wrong, reference.ravel())[0], nmse(wrong, reference.ravel())))
    return {
        "nmse": nmse(shown, reference),
        "published": published,
        "defined": defined,
        "max_lsb": errors.max_lsb,
        "p999_lsb": errors.p999_lsb,
        "nearest": float(terms[: len(terms) // 100].sum() / terms.sum()),
        "worst": ones[0][0],
        "least": ones[1][0],
        "one": ones[0][1],
    }
