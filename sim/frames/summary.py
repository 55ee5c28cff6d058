"""Figures of frames as text, line by line."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from blysk.golden.reference.transfer import SPACES
from blysk.hdl.port_descriptions import COUNTER_TEXTS
from blysk.sim.frames.error_names import ERRORS, reference_of

__all__ = ["animation_lines", "frame_lines", "short_lines", "specialisation_lines"]

_COUNTS = {
    "opposed_faces": "triangles with normals against their winding",
    "repaired_normals": "stored normals that were repaired",
    "dropped_faces": "faces without area, dropped",
    "degenerate_triangles": "triangles without area on the screen",
    "culled_triangles": COUNTER_TEXTS["culled"],
    "outside_triangles": "triangles outside the picture",
    "uncovered_triangles": "triangles that hold no pixel centre",
    "repaired_span_normals": "span ends whose normal was 0",
    "clipped_triangles": "triangles cut at the near plane or at the ends of the grid",
    "sliver_triangles": COUNTER_TEXTS["sliver"],
    "far_triangles": "triangles beyond 1,000 times the nearest W, where surfaces 0.1 % apart may swap",
    "several_levels": "triangles that have a single level of a texture, and would need several",
    "hidden_spans": "spans without a pixel that shows, left out",
    "cut_out_pixels": "pixels dropped before the depth test, as their alpha is under the cutoff",
    "hidden_pixels": COUNTER_TEXTS["hidden"],
    "dropped_pixels": COUNTER_TEXTS["dropped"],
    "cut_spans": "spans cut to the range of the method",
    "missed_spans": "spans over 0.25 LSB off with this method",
    "missed_pieces": "spans over 0.25 LSB off with this method, as their normals differ in length",
    "short_normals": "spans with normals too short for the words, as W differs much; perhaps 0.25 LSB off",
    "out_of_range_spans": COUNTER_TEXTS["out_of_range_spans"],
    "sharp_lobes": "lobes too sharp for this method's table, perhaps over 0.25 LSB off",
}

_REMEDIES = {
    "opposed_faces": "--back-faces show takes their normals as they are; if they stay dark, export again",
    "far_triangles": "leave out the nearest triangles, or use geometry software",
    "several_levels": "use geometry software, or divide the triangles",
    "missed_spans": "use quotient or renormalise",
    "missed_pieces": "use geometry software, or smaller triangles",
    "short_normals": "use geometry software, or divide the triangles",
    "out_of_range_spans": "their pixels are wrong: use another method, or divide the triangles",
    "sharp_lobes": "use method chord-local",
}
"""Remedy for a count, as a text behind a semicolon."""

_WARNINGS = (
    *("opposed_faces", "repaired_normals", "dropped_faces", "missed_spans", "missed_pieces", "short_normals"),
    *("out_of_range_spans", "far_triangles", "several_levels", "sharp_lobes"),
)
"""Counts that may show a fault of the mesh or the design."""


def _at_once(figures: Mapping[str, Any]) -> str:
    """Words for several lanes or pipelines."""
    counts = ((figures.get(name, 1), word) for name, word in (("lanes", "lanes"), ("pipes", "pipelines")))
    return "".join(f", {count} {word}" for count, word in counts if count > 1)


def _line(name: str, text: str) -> str:
    return f"{name:<12}{text}"


def _model(figures: Mapping[str, Any]) -> str:
    """Reflection model, with its exponent or roughness."""
    parameters = ((name, figures[name]) for name in ("exponent", "roughness"))
    return ", ".join([figures["model"], *(f"{name} {value:.4g}" for name, value in parameters if value)])


def _triangles(figures: Mapping[str, Any]) -> str:
    return f"{figures['triangles']:,} triangle{'s' * (figures['triangles'] != 1)}"


def frame_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    """Lines of all figures of a frame, from `frame_figures` with the mesh's name and counts."""
    materials = f", materials {figures['materials']}" if figures["materials"] > 1 else ""
    yield _line("mesh", f"{figures['mesh']}, {figures['width']}x{figures['height']}")
    yield _line("model", f"{_model(figures)}, lights {figures['lights']}{materials}")
    yield _line("method", figures["method"])
    yield _line("engine", figures["engine"])
    if "geometry" in figures:
        text = f"{figures['geometry']}, took the last triangle after {figures['triangle_cycles']:,} cycles"
        yield _line("geometry", text)
    yield _line("triangles", f"{figures['triangles']:,}")
    yield _line("spans", f"{figures['spans']:,}")
    yield from _pixel_lines(figures)
    if figures["pixels"]:
        yield _line("simulated", f"{figures['simulated_pixels_per_second']:,.0f} pixels a second")
    yield from _error_lines(figures)
    if figures["visible_pixels"]:
        published = f"MNSE as published {figures['mnse_published']:.3g}"
        share = f"defined for {figures['mnse_published_share']:.1%}"
        yield _line("NMSE", f"{figures['nmse']:.3g} ({published}, {share})")
    yield from _count_lines(figures["counts"])
    yield from _ignored_lines(figures)
    yield _second_line(figures["seconds"])


def short_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    """The main figures of a frame, in at most eight lines. `frame_lines` has all figures."""
    yield _line(
        "mesh",
        f"{figures['mesh']}, {_triangles(figures)}, {figures['width']}x{figures['height']}",
    )
    lights = f"{figures['lights']} light{'s' * (figures['lights'] != 1)}"
    pipes = _at_once(figures)
    model = f"{figures['method']}, {_model(figures)}, {lights}{pipes}"
    geometry = "geometry, " if "geometry" in figures else ""
    yield _line("hardware", f"{geometry}{model}; {figures['engine']}")
    rate = f", {figures['cycles_per_pixel']:.3f} a pixel" if figures["pixels"] else ""
    hidden = f", {figures['visible_pixels']:,} visible" if geometry else ""
    cut_out = figures["counts"].get("cut_out_pixels")
    hidden += f"; {cut_out:,} pixel{'s' * (cut_out != 1)} dropped by alpha" if cut_out else ""
    yield _line("cycles", f"{figures['cycles']:,} for {figures['pixels']:,} shaded pixels{rate}{hidden}")
    if figures["visible_pixels"]:
        total, method = (figures[f"{name}_error"]["steady_lsb"] for name in ("total", "method"))
        found = f"largest {total:.2f} {_unit(figures)} from exact {figures['target']} shading"
        if figures["target"] != figures["model"]:
            found += f", {method:.2f} from exact normals with this model"
        yield _line("error", f"{found}; {_bound(figures)}")
        yield from _border_line(figures)
    else:
        yield _line("error", "none, no pixel shows the surface")
    counts = figures["counts"]
    counted = [
        f"{text}: {counts[key]:,}{_remedy(key)}"
        for key, text in _COUNTS.items()
        if counts.get(key) and key in _WARNINGS
    ]
    if counted:
        yield _line("noticed", f"{counted[0]}{f', and {len(counted) - 1} more' * (len(counted) > 1)}; see -v")
    yield from _ignored_lines(figures)
    yield _line("seconds", f"{figures['seconds'].get('total', sum(figures['seconds'].values())):.1f}")


def animation_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    """Lines of all figures of an animation, from `animation_figures` with the mesh's name and counts."""
    size = f"{figures['width']}x{figures['height']}"
    rate = figures["frame_count"] / figures["seconds"]["frames"]
    yield _line("mesh", f"{figures['mesh']}, {size}, {_triangles(figures)}")
    yield _line("model", f"{_model(figures)}, lights {figures['lights']}")
    yield _line("method", figures["method"])
    yield _line("engine", f"{figures['engine']}, {figures['workers']}")
    yield _line("turntable", f"{figures['frame_count']:,} frames, {rate:.2f} a second")
    yield from _pixel_lines(figures)
    yield _line("errors", "the worst of all frames")
    yield from _error_lines(figures)
    yield from _count_lines(figures["counts"])
    yield from _ignored_lines(figures)
    yield _second_line(figures["seconds"])


def specialisation_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    """Lines of `saving_figures`. If both frames are known, cycles and `difference_figures` follow."""
    for reduction in figures["reductions"]:
        saves = [f"{count:,} {name.replace('_', ' ')}" for name, count in reduction["saves"].items() if count]
        yield _line("left out", f"{reduction['reason']}; saves {', '.join(saves) or 'nothing'}")
    full = figures["full"]
    parts = [
        f"{count:,} of {full[name]:,} {name.replace('_', ' ')}"
        for name, count in figures["specialised"].items()
    ]
    if "full_cycles" in figures:
        parts.append(f"{figures['cycles']:,} of {figures['full_cycles']:,} cycles")
    yield _line("specialised", ", ".join(parts))
    if "full_cycles" in figures:
        text = "the frame equals the frame of the full pipeline, to the bit"
        if figures["different_pixels"]:
            text = (
                f"{figures['different_pixels']:,} pixels differ from the full pipeline's, by at most "
                f"{figures['largest_difference']} of 255"
            )
        yield _line("", text)


def _pixel_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    yield _line("pixels", f"{figures['pixels']:,} shaded, {figures['visible_pixels']:,} visible")
    rate = f", {figures['cycles_per_pixel']:.3f} a pixel" if figures["pixels"] else ""
    pipes = _at_once(figures)
    yield _line("cycles", f"{figures['cycles']:,}{rate}{pipes}")


def _unit(figures: Mapping[str, Any]) -> str:
    """Unit of the errors, with the space of the codes."""
    return f"LSB of 8-bit {SPACES[figures['transfer']]}"


def _bound(figures: Mapping[str, Any]) -> str:
    bound = figures["bound_lsb"]
    if bound is None:
        return "no bound is known"
    where = " where the same triangle shows" if "geometry" in figures else ""
    # A bound is rounded up, so that it stays a bound.
    return f"bound {math.ceil(100 * bound - 1e-6) / 100:.2f}{where}"


def _border_line(figures: Mapping[str, Any]) -> Iterator[str]:
    """The pixels that the largest error and the bound do not include."""
    count = figures["border_pixels"]
    if count:
        most = max(figures[f"{name}_error"]["border_lsb"] for name in ("total", "method"))
        pixels = f"{count:,} pixel{'s' * (count != 1)} with {figures['border']}"
        ends = ""
        if figures["step_lsb"]:
            step = f"{figures['step_lsb']:.1f} LSB of {SPACES['linear']}"
            ends = f", where a light begins, or a highlight ends in a step of {step}"
        yield _line("left out", f"{pixels}{ends}: largest {most:.2f} LSB")


def _error_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    if not figures["visible_pixels"]:
        yield _line("error", "none, no pixel shows the surface")
        return
    heads = f"{'largest':>9}{'99.9 %':>9}{'RMSE':>9}{'PSNR, dB':>10}"
    yield _line("error, LSB", f"{heads}   in {_unit(figures)}, against")
    for name in ERRORS:
        error = figures.get(f"{name}_error")
        if error is None:
            continue
        yield (
            f"  {name:<10}{error['max_lsb']:>9.3f}{error['p999_lsb']:>9.3f}{error['rmse_lsb']:>9.3f}"
            f"{error['psnr_db']:>10.2f}   {reference_of(name, figures['target'])}"
        )
    method = figures["method_error"]
    where = f"largest method error away from the border of a light {method['steady_lsb']:.3f}"
    hypothesis = ", for spans from software" * (
        figures["bound_lsb"] is not None and "geometry" not in figures
    )
    yield _line("", f"{where}; {_bound(figures)}{hypothesis}")
    yield from _border_line(figures)


def _count_lines(counts: Mapping[str, int]) -> Iterator[str]:
    for key, text in _COUNTS.items():
        if counts.get(key):
            yield _line("counted", f"{text}: {counts[key]:,}{_remedy(key)}")


def _remedy(key: str) -> str:
    return f"; {_REMEDIES[key]}" if key in _REMEDIES else ""


def _ignored_lines(figures: Mapping[str, Any]) -> Iterator[str]:
    """A line that names the contents of a mesh file that are not drawn, though they belong to the picture."""
    if figures.get("ignored"):
        yield _line("ignored", "; ".join(figures["ignored"]))


def _second_line(seconds: Mapping[str, float]) -> str:
    return _line("seconds", ", ".join(f"{name} {value:.2f}" for name, value in seconds.items()))
