"""Figures of frames as plain values: counts, cycles, errors, and the savings of a specialisation."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from blysk.golden.frames.border import BORDER
from blysk.golden.frames.compare import Comparison
from blysk.golden.frames.frame import Picture
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.reference.scene import Scene
from blysk.sim.frames.error_names import ERRORS
from blysk.sim.frames.frame import SimulatedFrame
from blysk.sim.frames.specialise import Specialisation
from blysk.sim.frames.triangles import SimulatedTriangleFrame

__all__ = [
    "animation_figures",
    "difference_figures",
    "frame_figures",
    "saving_figures",
    "sharp_lobes",
    "triangle_figures",
    "worst_errors",
]


def frame_figures(
    scene: Scene, design: ShadingPipeline, frame: SimulatedFrame, comparison: Comparison
) -> dict[str, Any]:
    """Figures of a frame, ready for `write_json`.

    Parameters
    ----------
    scene, design
        The scene, and the design that drew it.
    frame : SimulatedFrame
        The frame.
    comparison : Comparison
        Its errors.
    """
    raster = frame.raster
    visible = int(np.count_nonzero(frame.cut_raster.visible))
    return {
        **_figures(scene, design, frame, raster.triangles, visible),
        "lanes": design.build.lanes,
        "pipes": design.build.pipes,
        **_errors(comparison, ERRORS),
        "counts": {
            "degenerate_triangles": raster.degenerate,
            "culled_triangles": raster.culled,
            "outside_triangles": raster.outside,
            "uncovered_triangles": raster.uncovered,
            "repaired_span_normals": raster.repaired_normals,
            "hidden_spans": raster.hidden_spans,
            "cut_out_pixels": raster.dropped,
            "cut_spans": frame.prepared.spans_cut,
            "missed_spans": frame.prepared.missed_spans,
            "out_of_range_spans": frame.out_of_range_spans,
            "sharp_lobes": sharp_lobes(scene, design),
        },
        "seconds": {**frame.seconds, "golden": comparison.seconds},
    }


def triangle_figures(
    scene: Scene, design: ShadingPipeline, frame: SimulatedTriangleFrame, comparison: Comparison
) -> dict[str, Any]:
    """Figures of a frame by simulated geometry, ready for `write_json`.

    There is no ``arithmetic_error``, because the hardware makes its own spans. ``cycles`` counts from the
    first triangle until the hardware is empty. ``triangle_cycles`` ends in the cycle in which the last
    triangle is taken.

    Parameters
    ----------
    scene, design
        The scene, and the design that drew it.
    frame : SimulatedTriangleFrame
        The frame.
    comparison : Comparison
        Its errors.
    """
    counts, sent = frame.counts, frame.sent
    return {
        **_figures(scene, design, frame, len(sent.triangles), frame.visible),
        "geometry": "hardware",
        "lanes": design.build.lanes,
        "setups": design.build.setups,
        "coarse": design.build.coarse is not None,
        "triangle_cycles": frame.input_cycles,
        **_errors(comparison, [name for name in ERRORS if name != "arithmetic"]),
        "counts": {
            "clipped_triangles": sent.clipped,
            "outside_triangles": sent.outside,
            "degenerate_triangles": counts["zero_area"],
            "culled_triangles": counts["culled"],
            "uncovered_triangles": counts["empty"],
            "sliver_triangles": counts["sliver"],
            "repaired_span_normals": counts["repaired"],
            "cut_spans": counts["cut"],
            "hidden_pixels": counts["hidden"],
            "dropped_pixels": counts["dropped"],
            "far_triangles": sent.far,
            "several_levels": sent.several_levels,
            "missed_pieces": counts["missed_pieces"],
            "short_normals": counts["short_normals"],
            "out_of_range_spans": counts["out_of_range_spans"],
            "sharp_lobes": sharp_lobes(scene, design),
        },
        "seconds": {**frame.seconds, "golden": comparison.seconds},
    }


def sharp_lobes(scene: Scene, design: ShadingPipeline) -> int:
    """Number of lobes for which the table of ``quotient`` is over 0.25 LSB off between two entries."""
    if design.specular is None:
        return 0
    return sum(map(design.specular.is_sharp, set(map(design.highlight_parameter, scene.materials))))


def _figures(
    scene: Scene,
    design: ShadingPipeline,
    frame: SimulatedFrame | SimulatedTriangleFrame,
    triangles: int,
    visible: int,
) -> dict[str, Any]:
    """Figures that every frame has."""
    material, model = scene.materials[0], design.specular and design.specular.reflection
    return {
        "method": design.method,
        "model": design.model,
        **{
            name: material.parameter(model) if model and name == model.PARAMETER else None
            for name in ("exponent", "roughness")
        },
        "lights": design.lights,
        "materials": design.materials,
        "style": design.build.style,
        "gate": design.gate,
        "engine": frame.engine,
        "width": scene.width,
        "height": scene.height,
        "triangles": triangles,
        "spans": frame.spans,
        "pixels": frame.pixels,
        "visible_pixels": visible,
        "cycles": frame.cycles,
        "cycles_per_pixel": frame.cycles / frame.pixels if frame.pixels else math.nan,
        "simulated_pixels_per_second": frame.pixels / (frame.seconds["simulate"] or math.inf),
    }


def _errors(comparison: Comparison, names: Iterable[str]) -> dict[str, Any]:
    return {
        **{f"{name}_error": dataclasses.asdict(getattr(comparison, f"{name}_error")) for name in names},
        "target": comparison.target,
        "transfer": comparison.transfer,
        "bound_lsb": comparison.bound_lsb,
        "border": f"{comparison.border} at most {BORDER:g}",
        "step_lsb": comparison.step_lsb,
        "border_pixels": comparison.border_pixels,
        "nmse": comparison.nmse,
        "mnse_published": comparison.mnse_published,
        "mnse_published_share": comparison.mnse_published_share,
    }


def animation_figures(frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures of several frames: sums, worst errors, and the figures of each frame.

    Parameters
    ----------
    frames : sequence of dict
        Figures of `frame_figures` or `triangle_figures`, all for the same scene and pipeline. ``triangles``
        of the result is the largest number of triangles in a frame.
    """
    same = ("method", "model", "exponent", "roughness", "lights", "materials", "style", "gate", "engine")
    same += ("width", "height", "target", "transfer", "border", "step_lsb")
    same += tuple(key for key in ("lanes", "pipes", "geometry", "setups", "coarse") if key in frames[0])
    pixels, cycles = (sum(frame[key] for frame in frames) for key in ("pixels", "cycles"))
    bounds = [frame["bound_lsb"] for frame in frames]
    return {
        **{key: frames[0][key] for key in same},
        "triangles": max(frame["triangles"] for frame in frames),
        "frame_count": len(frames),
        "visible_pixels": sum(frame["visible_pixels"] for frame in frames),
        "pixels": pixels,
        "cycles": cycles,
        "cycles_per_pixel": cycles / pixels if pixels else math.nan,
        **worst_errors(frames),
        "bound_lsb": None if None in bounds else max(bounds),
        "border_pixels": sum(frame["border_pixels"] for frame in frames),
        "counts": {
            # The lobes belong to the scene, so all frames have the same lobes.
            key: (max if key == "sharp_lobes" else sum)(frame["counts"][key] for frame in frames)
            for key in frames[0]["counts"]
        },
        "frames": list(frames),
    }


def worst_errors(figures: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """The worst value of each error over several frames: smallest PSNR, largest of each other error.

    Frames that show no surface have no errors and do not count. If no frame shows a surface, every figure is
    NaN.

    Parameters
    ----------
    figures : sequence of dict
        Figures of `frame_figures`.
    """
    worst = {}
    for name in (name for name in ERRORS if f"{name}_error" in figures[0]):
        errors = [frame[f"{name}_error"] for frame in figures if frame["visible_pixels"]]
        worst[f"{name}_error"] = {
            key: (min if key == "psnr_db" else max)((error[key] for error in errors), default=math.nan)
            for key in figures[0][f"{name}_error"]
        }
    return worst


def saving_figures(specialisation: Specialisation) -> dict[str, Any]:
    """Resources of a full pipeline and of its specialisation, and the saving of each reduction.

    Parameters
    ----------
    specialisation : Specialisation
        The pipelines.

    Returns
    -------
    dict
        ``full`` and ``specialised`` have the number of each resource. ``reductions`` has the ``reason`` of
        each reduction, and the resources that it ``saves`` in addition to the reductions before it.
    """
    full, steps = specialisation.costs()
    before = [full, *steps]
    return {
        "full": full.totals,
        "specialised": before[-1].totals,
        "reductions": [
            {
                "reason": reduction.reason,
                "saves": {name: count - after.totals[name] for name, count in cost.totals.items()},
            }
            for reduction, cost, after in zip(specialisation.reductions, before, steps, strict=False)
        ],
    }


def difference_figures(frame: Picture, full_frame: Picture) -> dict[str, int]:
    """Largest difference of a channel between two frames, and how many pixels differ."""
    difference = np.abs(full_frame.image.astype(np.int16) - frame.image)
    return {
        "largest_difference": int(difference.max(initial=0)),
        "different_pixels": int(np.count_nonzero(difference.any(axis=-1))),
    }
