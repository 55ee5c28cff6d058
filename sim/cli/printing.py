"""The figures of a frame, or of many, as one table of plain values, and in print."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from blysk.golden.pipeline import Design
from blysk.golden.reference.scene import Scene
from blysk.sim.frames.fit import Fit
from blysk.sim.frames.frame import Comparison, SimulatedFrame

__all__ = [
    "ERRORS",
    "fit_figures",
    "frame_figures",
    "print_counts",
    "print_errors",
    "print_figures",
    "print_fit",
    "worst_errors",
]

ERRORS = {
    "arithmetic": "the same method and model in float64",
    "method": "exactly normalised Phong interpolation, same model",
    "total": "the exact Blinn frame, one viewing direction",
}
"""Name of each error, and what the frame is held against for it."""

_COUNTS = {
    "repaired_normals": "stored normals repaired",
    "dropped_faces": "faces without area dropped",
    "degenerate_triangles": "triangles without area on the screen",
    "culled_triangles": "back faces left out",
    "outside_triangles": "triangles outside the picture",
    "uncovered_triangles": "triangles that hold no pixel centre",
    "repaired_span_normals": "span ends whose normal was 0",
    "hidden_spans": "spans wholly hidden, left out",
    "cut_spans": "spans too wide for the method, cut",
    "out_of_range_spans": "spans flagged as too wide by the pipeline",
}


def frame_figures(
    scene: Scene, design: Design, frame: SimulatedFrame, comparison: Comparison
) -> dict[str, Any]:
    """Figures of a frame, ready for `write_json`.

    Parameters
    ----------
    scene, design
        What was drawn, and by what.
    frame : SimulatedFrame
        The frame.
    comparison : Comparison
        Its errors.
    """
    raster = frame.raster
    return {
        "method": design.method,
        "model": design.model,
        "exponent": scene.materials[0].exponent,
        "lights": design.lights,
        "materials": design.materials,
        "engine": frame.engine,
        "width": scene.width,
        "height": scene.height,
        "triangles": raster.triangles,
        "spans": frame.spans,
        "pixels": frame.pixels,
        "visible_pixels": int(np.count_nonzero(frame.cut_raster.visible)),
        "cycles": frame.cycles,
        "cycles_per_pixel": frame.cycles / frame.pixels if frame.pixels else math.nan,
        "simulated_pixels_per_second": frame.pixels / frame.seconds["simulate"],
        **{f"{name}_error": dataclasses.asdict(getattr(comparison, f"{name}_error")) for name in ERRORS},
        "nmse": comparison.nmse,
        "mnse_published": comparison.mnse_published,
        "mnse_published_share": comparison.mnse_published_share,
        "counts": {
            "degenerate_triangles": raster.degenerate,
            "culled_triangles": raster.culled,
            "outside_triangles": raster.outside,
            "uncovered_triangles": raster.uncovered,
            "repaired_span_normals": raster.repaired_normals,
            "hidden_spans": raster.hidden_spans,
            "cut_spans": frame.spans_cut,
            "out_of_range_spans": frame.out_of_range_spans,
        },
        "seconds": {**frame.seconds, "golden": comparison.seconds},
    }


def worst_errors(figures: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """The worst of each error over several frames: the largest, and of PSNR the least.

    Frames that show no surface have no errors and do not count; if none does, every figure is NaN.

    Parameters
    ----------
    figures : sequence of dict
        Of `frame_figures`.
    """
    worst = {}
    for name in ERRORS:
        errors = [frame[f"{name}_error"] for frame in figures if frame["visible_pixels"]]
        worst[f"{name}_error"] = {
            key: (min if key == "psnr_db" else max)((error[key] for error in errors), default=math.nan)
            for key in figures[0][f"{name}_error"]
        }
    return worst


def print_figures(figures: Mapping[str, Any]) -> None:
    """Print the figures of a frame: those of `frame_figures`, with the mesh's name and its own counts."""
    size = f"{figures['width']}x{figures['height']}"
    rows = {
        "mesh": f"{figures['mesh']}, {size}",
        "model": f"{figures['model']}, exponent {figures['exponent']}, lights {figures['lights']}"
        + (f", materials {figures['materials']}" if figures["materials"] > 1 else ""),
        "method": figures["method"],
        "engine": figures["engine"],
        "triangles": f"{figures['triangles']:,}",
        "spans": f"{figures['spans']:,}",
        "pixels": f"{figures['pixels']:,} shaded, {figures['visible_pixels']:,} visible",
        "cycles": f"{figures['cycles']:,}",
    }
    if figures["pixels"]:
        rows["cycles"] += f", {figures['cycles_per_pixel']:.3f} a pixel"
        rows["simulated"] = f"{figures['simulated_pixels_per_second']:,.0f} pixels a second"
    for name, value in rows.items():
        print(f"{name:<12}{value}")
    print_errors(figures if figures["visible_pixels"] else None)
    if figures["visible_pixels"]:
        print(
            f"{'NMSE':<12}{figures['nmse']:.3g} (MNSE as printed {figures['mnse_published']:.3g}, "
            f"defined for {figures['mnse_published_share']:.1%})"
        )
    print_counts(figures["counts"])
    times = ", ".join(f"{name} {value:.2f}" for name, value in figures["seconds"].items())
    print(f"{'seconds':<12}{times}")


def fit_figures(fit: Fit, frame: SimulatedFrame, full_frame: SimulatedFrame | None) -> dict[str, Any]:
    """What a fitted pipeline leaves out, and what that saves, each omission on top of those before it.

    Parameters
    ----------
    fit : Fit
        The pipeline and what it leaves out.
    frame : SimulatedFrame
        Its frame.
    full_frame : SimulatedFrame or None
        That of the full pipeline, if it has been simulated.
    """
    full, steps = fit.costs()
    before = [full, *steps]
    figures = {
        "full": full.totals,
        "fitted": before[-1].totals,
        "omissions": [
            {
                "reason": omission.reason,
                "saves": {name: count - after.totals[name] for name, count in cost.totals.items()},
            }
            for omission, cost, after in zip(fit.omissions, before, steps, strict=False)
        ],
        "cycles": frame.cycles,
    }
    if full_frame is not None:
        figures["full_cycles"] = full_frame.cycles
        difference = np.abs(full_frame.image.astype(np.int16) - frame.image)
        figures["largest_difference"] = int(difference.max(initial=0))
        figures["different_pixels"] = int(np.count_nonzero(difference.any(axis=-1)))
    return figures


def print_fit(figures: Mapping[str, Any] | None) -> None:
    """Print what `fit_figures` has found; nothing for ``None``."""
    if figures is None:
        return
    for omission in figures["omissions"]:
        saves = ", ".join(
            f"{count:,} {name.replace('_', ' ')}" for name, count in omission["saves"].items() if count
        )
        print(f"{'left out':<12}{omission['reason']}; saves {saves or 'nothing'}")
    full, fitted = figures["full"], figures["fitted"]
    parts = [f"{count:,} of {full[name]:,} {name.replace('_', ' ')}" for name, count in fitted.items()]
    if "full_cycles" in figures:
        parts.append(f"{figures['cycles']:,} of {figures['full_cycles']:,} cycles")
    print(f"{'fitted':<12}{', '.join(parts)}")
    if "full_cycles" in figures:
        text = "the frame is that of the full pipeline, to the bit"
        if figures["different_pixels"]:
            text = (
                f"{figures['different_pixels']:,} pixels differ from the full pipeline's, by at most "
                f"{figures['largest_difference']} of 255"
            )
        print(f"{'':<12}{text}")


def print_counts(counts: Mapping[str, int]) -> None:
    """Print what was counted, where there is any."""
    for key, text in _COUNTS.items():
        if counts[key]:
            print(f"{'counted':<12}{text}: {counts[key]:,}")


def print_errors(errors: Mapping[str, Any] | None) -> None:
    """Print the errors of a frame or of `worst_errors`; ``None`` where no pixel shows the surface."""
    if errors is None:
        print(f"{'error':<12}none, no pixel shows the surface")
        return
    print(f"{'error, LSB':<12}{'largest':>9}{'99.9 %':>9}{'RMSE':>9}{'PSNR, dB':>10}   against")
    for name, against in ERRORS.items():
        error = errors[f"{name}_error"]
        print(
            f"  {name:<10}{error['max_lsb']:>9.3f}{error['p999_lsb']:>9.3f}{error['rmse_lsb']:>9.3f}"
            f"{error['psnr_db']:>10.2f}   {against}"
        )
