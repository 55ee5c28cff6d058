"""The design space: pipelines, their errors in a scene, their costs, and the cheapest pipelines."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from blysk.bench.report.frames import scenes_of
from blysk.bench.report.points_text import front
from blysk.bench.store import Task
from blysk.bench.tools.sweep import COSTS, Candidate
from blysk.golden.frames.compare import compare
from blysk.golden.frames.frame import model_frame
from blysk.golden.reference.lighting import Light
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.sim.frames.animation import turned
from blysk.sim.frames.error_names import ERRORS

__all__ = [
    "Explored",
    "cheapest",
    "costs_of",
    "errors_of",
    "explored",
    "front_of",
    "tasks_of",
]


_FIGURES = ("max_lsb", "p999_lsb", "rmse_lsb")


# Measurements.


def _lit(scene: Scene, lights: int) -> Scene:
    """The scene with its light divided into equal lights, which stand evenly round an upright axis."""
    (light,) = scene.lights
    directions = turned(light.direction, (0, 1, 0), lights).tolist()
    return replace(scene, lights=[Light(tuple(one), (1 / lights,) * 3) for one in directions])


def errors_of(candidate: Mapping[str, Any], view: Mapping[str, Any], exponent: int) -> dict[str, Any]:
    """Errors of a frame by a design's bit-accurate model. They do not depend on style and lanes.

    Parameters
    ----------
    candidate : dict
        Fields of a `Candidate`.
    view : dict
        Mesh and size, as in `frames`.
    exponent : int
        Exponent of the highlight.

    Returns
    -------
    dict
        ``errors``: for each of `ERRORS` ``max_lsb``, ``p999_lsb`` and ``rmse_lsb``;
        ``out_of_range_spans``: number of spans that are too wide for the design. Their pixels may be wrong;
        ``lengths``: pairs of a length and the number of spans that have it.
    """
    tried = Candidate(**candidate)
    (scene,) = scenes_of(view, [exponent])
    scene = _lit(scene, tried.lights)
    frame = model_frame(scene, tried.design)
    comparison = compare(scene, tried.design, frame)
    figures = {name: asdict(getattr(comparison, f"{name}_error")) for name in ERRORS}
    lengths, counts = np.unique(frame.cut_raster.length, return_counts=True)
    return {
        "errors": {name: {key: of[key] for key in _FIGURES} for name, of in figures.items()},
        "out_of_range_spans": frame.out_of_range_spans,
        "lengths": [list(pair) for pair in zip(lengths.tolist(), counts.tolist(), strict=True)],
    }


def costs_of(candidate: Mapping[str, Any]) -> dict[str, int]:
    """Resources of a design by `Cost.totals`, with its ``cycles_per_pixel`` and ``setup_interval``."""
    unit = Candidate(**candidate).unit()
    return cost_of(unit).totals | {
        "cycles_per_pixel": unit.cycles_per_pixel,
        "setup_interval": unit.setup_interval,
    }


def tasks_of(candidates: Iterable[Candidate], view: Mapping[str, Any], exponent: int) -> list[Task]:
    """Measurements of designs on a scene. The errors of a design are a task for all styles and lanes."""
    found = []
    for candidate in candidates:
        found.append(Task(costs_of, {"candidate": asdict(candidate)}))
        common = asdict(replace(candidate, style="throughput", lanes=1))
        found.append(Task(errors_of, {"candidate": common, "view": view, "exponent": exponent}))
    return list({(task.function, repr(task.settings)): task for task in found}.values())


@dataclass(frozen=True)
class Explored:
    """A measured design.

    Parameters
    ----------
    candidate : Candidate
        The design.
    errors : dict of dict
        Errors of `errors_of`.
    costs : dict
        Figures of `Cost.totals`.
    cycles_per_pixel : float or None
        Upper bound from the figures of the units: the sum of ``max(cycles_per_pixel length, setup_interval)``
        of all spans, divided by the number of pixels. With lanes, beats take the place of pixels. Writes of
        constants and latency are not included. A frame takes fewer cycles if a span is set up during the
        pixels of a longer span, or if pixels lack terms. ``None`` for ``bisection``, because it states no
        interval of the spans that it divides.
    out_of_range_spans : int
        Number of spans that are too wide, of `errors_of`.
    """

    candidate: Candidate
    errors: dict[str, dict[str, float]]
    costs: dict[str, int]
    cycles_per_pixel: float | None
    out_of_range_spans: int

    def as_dict(self) -> dict[str, Any]:
        """The figures under stable names."""
        figures = {name: x for name, x in asdict(self).items() if name != "candidate"}
        return {**asdict(self.candidate), **figures, "command": self.candidate.command}


def explored(tasks: Sequence[Task], results: Sequence[Any]) -> list[Explored]:
    """Designs, from the results of `tasks_of`."""
    measured = {
        (task.function, Candidate(**task.settings["candidate"])): result
        for task, result in zip(tasks, results, strict=True)
    }
    found = []
    for (function, candidate), result in measured.items():
        if function is not costs_of:
            continue
        frame = measured[errors_of, replace(candidate, style="throughput", lanes=1)]
        lengths, counts = np.array(frame["lengths"]).T
        beats = -(-lengths // candidate.lanes)
        cycles = np.maximum(result["cycles_per_pixel"] * beats, result["setup_interval"])
        divides = candidate.design.interpolator.divides_spans
        found.append(
            Explored(
                candidate,
                frame["errors"],
                {name: result[name] for name in COSTS.values()},
                None if divides else float((cycles * counts).sum() / (lengths * counts).sum()),
                frame["out_of_range_spans"],
            )
        )
    return found


def front_of(designs: Sequence[Explored], error: str, cost: str) -> np.ndarray:
    """Whether each design is on the Pareto front of largest error and cost: bool array.

    A design that flags spans as too wide is not on the front.

    Parameters
    ----------
    designs : sequence of Explored
        The designs.
    error : str
        One of `ERRORS`.
    cost : str
        One of `COSTS`.
    """
    errors = [None if one.out_of_range_spans else one.errors[error]["max_lsb"] for one in designs]
    return front(errors, [one.costs[COSTS[cost]] for one in designs])


def cheapest(designs: Sequence[Explored], error: str, largest: float, cost: str) -> list[int]:
    """Indices of the designs whose largest error is at most ``largest``, the cheapest first.

    Designs of equal cost are sorted by error. Designs that flag spans as too wide are left out.

    Parameters
    ----------
    designs, error, cost
        As in `front_of`.
    largest : float
        Limit of the largest error, in LSB.
    """
    usable = [
        (one.costs[COSTS[cost]], one.errors[error]["max_lsb"], index)
        for index, one in enumerate(designs)
        if not one.out_of_range_spans and one.errors[error]["max_lsb"] <= largest
    ]
    return [index for *_, index in sorted(usable)]
