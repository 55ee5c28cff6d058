"""Error against run time over several meshes, sizes and exponents: the front, as sentence, drawing, table."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from statistics import median
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.colors import style_of
from blysk.bench.labels import Label, place_labels
from blysk.bench.report.needs import ring
from blysk.bench.report.points_text import front
from blysk.bench.report.section import Conclusion, Drawing, Table
from blysk.bench.speed.cycle_model import frame_cycles, unit_of
from blysk.bench.svg import panels, svg
from blysk.golden.frames.compare import compare_image
from blysk.golden.frames.frame import model_frame
from blysk.golden.frames.prepare import constants_of
from blysk.golden.methods.interpolator import Operand
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import Mesh
from blysk.sim.meshes.teapot import teapot

__all__ = ["FULL_SCENES", "QUICK_SCENES", "conclusion", "measure", "spread_table", "summaries"]

QUICK_SCENES = (
    ("teapot", 1000, (160, 120), (20, 200)),
    ("ring", 1296, (160, 120), (20, 200)),
    ("teapot", 10_000, (320, 240), (100,)),
)
"""Mesh, triangles, size and exponents of the quick report's scenes."""

FULL_SCENES = (
    ("teapot", 1000, (640, 480), (1, 10, 100, 1000)),
    ("ring", 1296, (640, 480), (1, 10, 100, 1000)),
    ("teapot", 10_000, (640, 480), (1, 10, 100, 1000)),
    ("teapot", 10_000, (1920, 1080), (100,)),
    ("teapot", 100_000, (1920, 1080), (100,)),
)


@lru_cache(maxsize=4)
def _mesh(name: str, triangles: int) -> Mesh:
    return ring() if name == "ring" else teapot(triangles)


def measure(
    method: str, model: str, scenes: Sequence[Sequence[Any]], operand: Operand | None = None
) -> list[dict[str, Any]]:
    """Errors and cycles of a design over several scenes: by the bit-accurate model and the cycle model.

    Parameters
    ----------
    method, model, operand
        Of `preset`.
    scenes : sequence
        As `QUICK_SCENES`.

    Returns
    -------
    list of dict
        A scene and exponent each: ``mesh``, ``triangles``, ``width``, ``height``, ``exponent``,
        ``method_max_lsb``, ``total_max_lsb``, ``spans`` after cutting, ``uncut_spans``, ``pixels``,
        ``cycles``.
    """
    design = preset(method, model, operand=operand)
    unit = unit_of(design)
    found = []
    for mesh, triangles, size, exponents in scenes:
        for exponent in exponents:
            scene = scene_for(_mesh(mesh, triangles), exponent, *size)
            frame = model_frame(scene, design)
            errors = compare_image(scene, design, frame.image)
            writes = sum(len(of.writes()["data"]) for of in constants_of(scene, design))
            found.append(
                {
                    "mesh": mesh,
                    "triangles": len(scene.mesh.faces),
                    "width": size[0],
                    "height": size[1],
                    "exponent": exponent,
                    "method_max_lsb": errors.method_error.max_lsb,
                    "total_max_lsb": errors.total_error.max_lsb,
                    "spans": frame.spans,
                    "uncut_spans": len(frame.raster.length),
                    "pixels": frame.pixels,
                    "cycles": frame_cycles(unit, frame.prepared.spans, writes),
                }
            )
    return found


def summaries(
    points: Sequence[Mapping[str, Any]], spread: Mapping[tuple, Sequence[dict]]
) -> list[dict[str, Any]]:
    """A dictionary a hardware design, over all scenes in which it was measured.

    Parameters
    ----------
    points : sequence of dict
        Those of the report.
    spread : mapping
        Results of `measure` by method, model and perhaps operand.

    Returns
    -------
    list of dict
        ``label``, ``method``, ``group``, ``samples`` (their number); ``method_error`` and ``total_error``,
        each largest and smallest over the scenes; ``cycles``, smallest, median and largest cycles a pixel;
        ``ns``, the same in nanoseconds over scenes and seeds, or ``None``; ``multipliers``, ``luts``,
        ``fmax_mhz``, ``parts``, spans after cutting over spans before.
    """
    found: dict[str, dict[str, Any]] = {}
    for point in points:
        if point["group"] == "software":
            continue
        of = found.setdefault(point["label"], {"point": point, "samples": []})
        cycles = point["times"]["cycles_per_pixel"]
        errors = [point["errors"][f"{kind}_max_lsb"] for kind in ("method", "total")]
        of["samples"].append((*errors, cycles, None))
    for of in found.values():
        settings = of["point"]["settings"]
        key = tuple(settings[name] for name in ("method", "model", "operand") if name in settings)
        for sample in spread.get(key, ()):
            cycles = sample["cycles"] / sample["pixels"]
            errors = [sample["method_max_lsb"], sample["total_max_lsb"]]
            of["samples"].append((*errors, cycles, sample["spans"] / max(sample["uncut_spans"], 1)))
    return [_summary(label, **of) for label, of in found.items()]


def _summary(label: str, point: Mapping[str, Any], samples: Sequence[tuple]) -> dict[str, Any]:
    method, total, cycles, parts = (
        [value for value in of if value is not None] for of in zip(*samples, strict=True)
    )
    rates = point["hardware"].get("seeds_mhz") or []
    ns = None
    if cycles and rates:
        middle = median(cycles) * 1e3 / median(rates)
        ns = min(cycles) * 1e3 / max(rates), middle, max(cycles) * 1e3 / min(rates)
    return {
        "label": label,
        "method": point["settings"]["method"],
        "group": point["group"],
        "samples": len(samples),
        "method_error": (min(method), max(method)),
        "total_error": (min(total), max(total)),
        "cycles": (min(cycles), median(cycles), max(cycles)) if cycles else None,
        "ns": ns,
        "multipliers": point["hardware"].get("multipliers"),
        "luts": point["hardware"].get("luts"),
        "fmax_mhz": median(rates) if rates else None,
        "parts": median(parts) if parts else None,
    }


def conclusion(found: Sequence[Mapping[str, Any]]) -> Conclusion | None:
    """Which designs are on the front of the largest total error, over all scenes, against cycles a pixel."""
    timed = [of for of in found if of["cycles"]]
    if not timed:
        return None
    on_front = _front(timed, "total_error")
    exact = [of for of in on_front if of["total_error"][1] <= 1] or on_front[-1:]
    best = exact[0]
    sentence = (
        f"Of {len(timed)} designs {len(on_front)} {'is' if len(on_front) == 1 else 'are'} on the front: "
        f"none has both "
        f"a smaller worst error and fewer cycles. "
        + (
            "Of those within 1 LSB of exact Blinn shading everywhere "
            if best["total_error"][1] <= 1
            else "There "
        )
        + f"**`{best['label']}`** is the fastest: {_costs(best)}."
    )
    others = [of for of in on_front if of is not best]
    if others:
        said = "; ".join(f"`{of['label']}`, {_costs(of)}" for of in others[:3])
        more = f"; and {len(others) - 3} more" if len(others) > 3 else ""
        sentence += f" Also on it: {said}{more}."
    rivals = [of for of in timed if of["method"] == "renormalise" and of["total_error"][1] <= 1]
    if rivals and best["method"] != "renormalise":
        rival = min(rivals, key=lambda of: of["cycles"][1])
        sentence += (
            f" The best form of normalising at every pixel, `{rival['label']}`, takes "
            f"{rival['cycles'][1] / best['cycles'][1]:.2f} times the cycles ({_costs(rival)})."
        )
    return Conclusion("What does a pixel cost, and how exact is it?", sentence, _drawing(timed))


def _front(found: Sequence[Mapping[str, Any]], kind: str) -> list[Mapping[str, Any]]:
    """Those that no other beats, fastest first."""
    error, cycles = [of[kind][1] for of in found], [of["cycles"][1] for of in found]
    on = [of for of, is_on in zip(found, front(error, cycles), strict=True) if is_on]
    return sorted(on, key=lambda of: of["cycles"][1])


def _costs(of: Mapping[str, Any]) -> str:
    parts = [f"{of['cycles'][1]:.2f} cycles a pixel", f"worst error {of['total_error'][1]:.2f} LSB"]
    if of["multipliers"] is not None:
        parts.append(f"{of['multipliers']} multipliers")
    if of["luts"] is not None:
        parts.append(f"{of['luts']:,} LUT at {of['fmax_mhz']:.0f} MHz")
    return ", ".join(parts)


def _drawing(found: Sequence[Mapping[str, Any]]) -> Drawing:
    """Both errors side by side, against nanoseconds where most designs have been placed, else cycles."""
    placed = [of for of in found if of["ns"]]
    in_ns = 2 * len(placed) > len(found)
    key, drawn = ("ns", placed) if in_ns else ("cycles", found)
    figure, axes = panels(9.2, 4.4, 2, sharex=True, sharey=True)
    kinds = (
        ("method_error", "method error: the same model, exact normals"),
        ("total_error", "total error: exact Blinn"),
    )
    for panel, (kind, title) in zip(axes, kinds, strict=True):
        panel.set(xscale="log", yscale="log", title=title)
        for of in drawn:
            style, published = style_of(of["method"]), of["group"] == "published"
            x, (low, high) = of[key], of[kind]
            panel.errorbar(
                *(x[1], high),
                xerr=[[x[1] - x[0]], [x[2] - x[1]]],
                yerr=[[high - max(low, 1e-2)], [0]],
                color=style.color,
                marker=style.marker,
                markersize=5.5,
                markerfacecolor="white" if published else style.color,
                linewidth=0.6,
                alpha=0.9,
            )
        on = {of["label"] for of in _front(drawn, kind)} if not in_ns else set()
        corners = sorted((of[key][1], of[kind][1]) for of in drawn if of["label"] in on)
        if corners:
            xs = [corners[0][0], *(x for x, _ in corners), max(of[key][1] for of in drawn)]
            ys = [max(of[kind][1] for of in drawn), *(y for _, y in corners), corners[-1][1]]
            panel.step(xs, ys, where="post", color="#1c2126", linewidth=1.2, zorder=0)
        _ticks(panel, in_ns)
    axes[0].set_ylabel("largest error over all scenes, LSB of 8 bits")
    for panel, (kind, _) in zip(axes, kinds, strict=True):
        front_labels = {of["label"] for of in _front(drawn, kind)}
        order = sorted(
            drawn, key=lambda of: (of["label"] not in front_labels, of["group"] == "published", of[kind][1])
        )
        labels = [
            Label(
                of[key][1],
                of[kind][1],
                of["label"].replace(", 1 - N.H", ""),
                style_of(of["method"]).color,
                "bold" if of["label"] in front_labels else "normal",
            )
            for of in _distinct(order, key, kind)
        ]
        place_labels(panel, labels, [(of[key][1], of[kind][1]) for of in drawn])
    scenes = max(of["samples"] for of in drawn)
    note = (
        f"A point is a design: its largest error and its median run time over up to {scenes} scenes "
        f"(meshes, sizes, "
        "exponents); bars go to the smallest error, and over the run times of all scenes"
        + (" and seeds of placement" if in_ns else "")
        + ". Open: as published. The line is the front. Of designs in the same place one is named."
        " Not counted: spans are cut from triangles, and their normals prepared, before the pipeline (by "
        "the host, or by "
        "the hardware of `blysk verilog --geometry`); each part of a cut span counts with its cycles."
    )
    if not in_ns:
        note += (
            f" {len(placed)} of {len(found)} designs have committed clock rates; "
            "the others await `blysk fpga`."
        )
    return Drawing(
        "front", f"Error against {'nanoseconds' if in_ns else 'cycles'} a pixel", svg(figure), note
    )


def _ticks(panel: Any, in_ns: bool) -> None:
    ticks = (10, 12, 15, 20, 30, 50, 100, 200, 500) if in_ns else (1, 1.5, 2, 3, 5, 10, 20, 50, 100)
    low, high = panel.get_xlim()
    kept = [tick for tick in ticks if low <= tick <= high]
    panel.set_xticks(kept, [f"{tick:g}" for tick in kept], minor=False)
    panel.set_xticks((), minor=True)
    errors = [0.5, 1, 2, 5, 10, 20, 50, 100, 200]
    low, high = panel.get_ylim()
    kept = [tick for tick in errors if low <= tick <= high]
    panel.set_yticks(kept, [f"{tick:g}" for tick in kept], minor=False)
    panel.set_yticks((), minor=True)
    panel.set_xlabel("ns a pixel, after place and route" if in_ns else "cycles a pixel")


def _distinct(found: Sequence[Mapping[str, Any]], key: str, kind: str) -> list[Mapping[str, Any]]:
    """One of those that lie in the same place, to a hundredth of a decade, the first."""
    kept: dict[tuple, Mapping[str, Any]] = {}
    for of in found:
        place = np.rint(np.log10([of[key][1], of[kind][1]]) * (60, 25))
        kept.setdefault((*place, of["method"]), of)
    return list(kept.values())


def spread_table(found: Sequence[Mapping[str, Any]]) -> Table:
    """What `summaries` gives, a row a design."""
    on_front = {of["label"] for of in _front([of for of in found if of["cycles"]], "total_error")}
    columns = ["design", "group", "on the front", "scenes"]
    columns += ["method error, smallest, LSB", "method error, largest, LSB"]
    columns += ["total error, smallest, LSB", "total error, largest, LSB"]
    columns += [
        "cycles a pixel, smallest",
        "cycles a pixel, median",
        "cycles a pixel, largest",
        "ns a pixel, median",
    ]
    columns += ["multipliers", "look-up tables", "clock rate, MHz", "parts a span"]
    rows = [
        [
            *(of["label"], of["group"], of["label"] in on_front, of["samples"]),
            *of["method_error"],
            *of["total_error"],
            *(of["cycles"] or [None] * 3),
            *(of["ns"][1] if of["ns"] else None, of["multipliers"], of["luts"], of["fmax_mhz"], of["parts"]),
        ]
        for of in found
    ]
    note = (
        "Over all meshes, sizes and exponents. Cycles of the further scenes are those of the cycle model. "
        "Parts a span: "
        "spans after cutting over spans before, the cost of cutting. Multipliers are those of the netlist; "
        "look-up tables "
        "and clock rates those after place and route, where a design has been placed."
    )
    return Table("front", "Every design over all scenes", columns, rows, note)
