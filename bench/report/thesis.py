"""Claims of [T]: speed in software and in hardware, share of shading in the time, and the measure MNSE."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.report.claims import Claim, ClaimTable, Document, at_least
from blysk.bench.report.counted import fastest
from blysk.bench.report.thesis_software import prices, software
from blysk.bench.report.thesis_ways import DIVIDED, SCALED, SPANS, WIDEST
from blysk.bench.tools.blocks import entry_of, row_of
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import METHODS, PUBLISHED, preset
from blysk.golden.reference.metrics import error_figures, mnse_published, nmse
from blysk.golden.reference.raster import rasterise
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import render
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "SPEEDS",
    "UNITS",
    "Speed",
    "claims",
    "hardware",
    "section",
    "shading_share",
    "square_errors",
    "tasks",
]


@dataclass(frozen=True)
class Speed:
    """A method that [T] claims to be faster than classical normalisation.

    Parameters
    ----------
    name, source : str
        The method, and its place in [T].
    printed : str
        The claimed ratio of speeds.
    ways, baselines : tuple of str
        Some of `WAYS`. Each way is compared with each baseline.
    units : tuple of str
        Some of `UNITS`, for the same comparison in hardware.
    in_pixels : bool
        Whether the ratio depends on the length of spans.
    """

    name: str
    source: str
    printed: str
    ways: tuple[str, ...]
    baselines: tuple[str, ...]
    units: tuple[str, ...]
    in_pixels: bool = True


SPEEDS = (
    Speed(
        "bisection, polynomial of degree 2",
        "[T] 2.1",
        "2.4",
        ("bisection, a factor each", "bisection, a factor a level"),
        (f"bisection, {DIVIDED}", f"bisection, {SCALED}"),
        ("bisection", "bisection interpolator"),
    ),
    Speed(
        "middle normal, polynomial h",
        "[T] 2.2",
        "2.5",
        ("middle by h(r)",),
        (f"middle, {DIVIDED}", f"middle, {SCALED}"),
        ("middle normal", "middle normal, one a cycle"),
        in_pixels=False,
    ),
    Speed(
        "forward differences of the normal",
        "[T] 2.2",
        "3.6",
        ("forward differences",),
        (f"line, {DIVIDED}", f"line, {SCALED}"),
        ("forward differences", "quadratic interpolator"),
    ),
    Speed(
        "spherical-angular recurrence",
        "[T] 3.3",
        "1.7",
        ("recurrence",),
        (
            f"line, {DIVIDED}, N·L and N·H",
            f"line, {SCALED}, N·L and N·H",
            "a cosine of each angle",
        ),
        ("recurrence", "recurrence interpolator"),
    ),
)
"""Speed claims of [T], all made for software."""


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
"""Units of the claims: unit and variant in the table of ``blysk blocks``.

An interpolator includes its setup, and gives N·L and N·H. The other entries are only the unit that works at
every pixel, without the setup.
"""

_SHADINGS = ("gouraud", "phong")


@cache
def _parts(name: str) -> dict[str, int]:
    row = row_of(entry_of(*UNITS[name]), None)
    return {"interval": row.interval, **row.cost.totals}


def hardware(unit: str, baseline: str) -> dict[str, float | None]:
    """Ratios of the baseline to the unit: cycles for each result, and parts.

    Unit and baseline are keys of `UNITS`.

    Returns
    -------
    dict
        Ratios of ``interval``, ``multipliers``, ``cells`` and ``register_bits``. ``None`` if the unit's
        figure is 0.
    """
    own, other = _parts(unit), _parts(baseline)
    kinds = ("interval", "multipliers", "cells", "register_bits")
    return {kind: other[kind] / own[kind] if own[kind] else None for kind in kinds}


def shading_share(triangles: int, width: int, height: int, repeats: int) -> dict[str, float]:
    """Share of a frame's time that the golden renderer spends on shading, by Gouraud's and Phong's method.

    Parameters
    ----------
    triangles : int
        Approximate number of triangles of the teapot.
    width, height : int
        Size of the picture.
    repeats : int
        Runs of each part, in turn. The fastest run counts.

    Returns
    -------
    dict
        ``gouraud`` and ``phong``: shading time, divided by the time of rasterising plus shading.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    raster = rasterise(scene)
    actions = [lambda: rasterise(scene)]
    actions += [
        lambda shading=shading: render(scene, shading, REFLECTION_MODELS["phong"], raster)
        for shading in _SHADINGS
    ]
    geometry, *times = fastest(actions, repeats)
    return {shading: time / (geometry + time) for shading, time in zip(_SHADINGS, times, strict=True)}


def square_errors(method: str, triangles: int, width: int, height: int) -> dict[str, Any]:
    """MNSE of a frame as published in [T] 4.1, and its well-posed form NMSE.

    The frame is by the bit-accurate model with `model_of` the method. The reference is the exact frame, Phong
    shading with Blinn's model. Only pixels of the surface count.

    Parameters
    ----------
    method : str
        One of `METHODS` or `PUBLISHED`.
    triangles : int
        Approximate number of triangles of the teapot.
    width, height : int
        Size of the picture.

    Returns
    -------
    dict
        - ``nmse``, ``published``, ``max_lsb`` and ``p999_lsb``;
        - ``defined``: share of values for which the published form is defined;
        - ``nearest``: share of MNSE that comes from the 1 % of values nearest the mean;
        - ``step``, a pair for MNSE and NMSE. One value of the reference gets 1 LSB more. The number is the
          error for the value nearest the mean, divided by the error for the farthest value.
    """
    scene = scene_for(teapot(triangles), 50, width, height)
    design = preset(method, model_of(method))
    prepared = prepare(scene, design)
    color = design.compute(prepared.spans, prepared.constants).color
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
    steps = []
    for place in (distance.argmin(), distance.argmax()):
        wrong = reference.copy().ravel()
        wrong[place] += 1
        steps.append((mnse_published(wrong, reference.ravel())[0], nmse(wrong, reference.ravel())))
    return {
        "nmse": nmse(shown, reference),
        "published": published,
        "defined": defined,
        "max_lsb": errors.max_lsb,
        "p999_lsb": errors.p999_lsb,
        "nearest": float(terms[: len(terms) // 100].sum() / terms.sum()),
        "step": [nearest / farthest for nearest, farthest in zip(*steps, strict=True)],
    }


def _speeds(quick: bool) -> list[Claim]:
    found, repeats = [], 15 if quick else 40
    for speed in SPEEDS:
        lengths = ((8, 64) if quick else (4, 8, 16, 32, 64, 128, 256)) if speed.in_pixels else (1,)
        for way in speed.ways:
            for baseline in speed.baselines:
                for pixels in lengths:
                    where = f", {pixels} pixels a span" if speed.in_pixels else ""
                    settings = {"way": way, "baseline": baseline, "pixels": pixels}
                    settings |= {"printed": float(speed.printed), "repeats": repeats}
                    found.append(
                        Claim(
                            speed.source,
                            f"{speed.name}: {speed.printed} times as fast",
                            f"times as fast: {way}, compared with {baseline}{where}",
                            software,
                            settings,
                            "ratio",
                            speed.printed,
                            at_least,
                            timed=True,
                        )
                    )
    return found


def _prices(quick: bool) -> list[Claim]:
    settings = {"repeats": 15 if quick else 40}
    kinds = ("a division", "a root", "a cosine")
    return [
        Claim(
            "this machine",
            "",
            f"time of {kind} of NumPy, in multiplications",
            prices,
            settings,
            kind,
            timed=True,
        )
        for kind in kinds
    ]


def _units(quick: bool) -> list[Claim]:
    found = []
    for speed in SPEEDS:
        for unit in speed.units:
            whole = unit.endswith("interpolator")
            baseline = "renormalise interpolator" if whole else "renormaliser"
            if not (quick and whole):
                found.append(
                    Claim(
                        speed.source,
                        f"{speed.name}: {speed.printed} times as fast, in software",
                        f"cycles for each result of the {baseline}, divided by those of the {unit}",
                        hardware,
                        {"unit": unit, "baseline": baseline},
                        "interval",
                        speed.printed,
                        at_least,
                    )
                )
    return found


def _size(quick: bool) -> dict[str, int]:
    return {"width": 160, "height": 120} if quick else {"width": 640, "height": 480}


def _shares(quick: bool) -> list[Claim]:
    return [
        Claim(
            "[T] table 1.1",
            f"share of {shading.title()} shading in a frame's time",
            f"share of shading, {count:,} triangles, %",
            shading_share,
            {"triangles": count, **_size(quick), "repeats": 7 if quick else 3},
            shading,
            timed=True,
        )
        for shading in _SHADINGS
        for count in ((1_000, 10_000) if quick else (1_000, 10_000, 100_000, 1_000_000))
    ]


_MNSE = "MNSE: each error divided by its own pixel's distance from the mean"


def _squares(quick: bool) -> list[Claim]:
    methods = ("linear", "quadratic", "renormalise", "quotient") if quick else (*METHODS, *PUBLISHED)
    settings = {"triangles": 1_000 if quick else 10_000, **_size(quick)}
    return [
        Claim("[T] 4.1", _MNSE, f"MNSE, {method}", square_errors, {"method": method, **settings}, "published")
        for method in methods
    ]


def _steps(quick: bool) -> list[Claim]:
    first = _squares(quick)[0].settings
    step = "error of 1 LSB in the value nearest the mean, divided by that of 1 LSB in the farthest value"
    share = "share of MNSE that comes from the 1 % of values nearest the mean, %"
    return [
        Claim("[T] 4.1", _MNSE, step, square_errors, first, "step", ours="NMSE: a sum divided by a sum"),
        Claim("[T] 4.1", _MNSE, share, square_errors, first, "nearest"),
    ]


def claims(quick: bool) -> list[Claim]:
    """All claims. If quick, they are for two lengths of spans, small frames, and units without setup."""
    return [claim for table in _DOCUMENT.tables for claim in table.claims(quick)]


_DOCUMENT = Document(
    "thesis",
    "[T]: speed, table 1.1, MNSE",
    [
        "For four of its methods [T] states how much faster they are in software than classical "
        "normalisation. We know neither its programs nor its machine. Our measurements are in NumPy on "
        "this machine, and do not refute [T]. NumPy does each operation on whole arrays, so a root costs "
        "only the time of the processor's root unit.",
        "A hardware unit that takes new operands in every cycle gives a normal in every cycle, with any "
        "structure. So in hardware the methods save multipliers, cells and registers, and no cycles.",
        "Table 1.1 of [T] has the share of shading in the time of a frame. We did not have its published "
        "values. MNSE as published divides each pixel's error by the distance of the pixel's value from the "
        "mean. It is undefined for a value at the mean. Values near the mean count most.",
    ],
    [
        ClaimTable(
            "thesis-software",
            "Speed in software",
            _speeds,
            f"NumPy in float64, {SPANS} spans of up to {WIDEST:g} degrees at once, setup included. The two "
            "ways run alternately, several times. We use the shortest processor time of each. For a "
            "bisection, p pixels mean p - 1 normals between two ends, so its span has p + 1 pixels. [T] says "
            "only 'classical normalisation' of its baseline. We compare with both usual forms, and the "
            "recurrence also with the direct evaluation of the cosines. Price: cost of a root, division or "
            "cosine, in multiplications or additions, at which the counted operations alone give the "
            "published ratio. Difference: between the results of both ways, as components of a unit normal "
            "or as cosines. It includes the distance of a line's normals from the great circle.",
            {
                "price of a root": "price",
                "largest difference": "difference",
                "operations for each result": "own",
                "operations of the baseline": "other",
            },
        ),
        ClaimTable("thesis-prices", "Cost of a division, a root and a cosine", _prices),
        ClaimTable(
            "thesis-hardware",
            "The same in hardware: figure of the baseline, divided by that of the unit",
            _units,
            "A figure above 1 means that the unit of [T] takes less than the baseline. Cells are operators, "
            "multiplexers, registers and memories of any width, before technology mapping. An interpolator "
            "includes its setup, and gives N·L and N·H of one light. A dash means that the unit has none of "
            "the resource. `blysk blocks` prints each unit's own figures. The sections "
            "*The documents' criteria* "
            "and *Place and route* have cycles and clock rates of whole pipelines.",
            {"multipliers": "multipliers", "cells": "cells", "register bits": "register_bits"},
        ),
        ClaimTable(
            "thesis-shading-share",
            "Table 1.1: share of shading in the time of a frame",
            _shares,
            "Teapot, golden renderer, Phong's model. The renderer spends the rest of the time on "
            "projection, rasterising, depth, and the normals at the ends of spans. It shades no hidden "
            "pixels.",
        ),
        ClaimTable(
            "thesis-mnse",
            "MNSE and its well-posed form NMSE",
            _squares,
            "Teapot, exponent 50, model `cosquad`, but `blinn` for `quotient`. The frames are of the "
            "bit-accurate model, which the RTL equals to the bit. The reference is Phong shading with "
            "Blinn's model, so most of the error is that of `cosquad`. NMSE is "
            "`sum (I-O)^2 / sum (I-mean(I))^2`.",
            {
                "NMSE": "nmse",
                "share of values with a defined MNSE": "defined",
                "largest error, LSB": "max_lsb",
                "99.9th percentile, LSB": "p999_lsb",
            },
        ),
        ClaimTable(
            "thesis-mnse-steps", "Values that count most in MNSE", _steps, "Frame of the first method above."
        ),
    ],
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
