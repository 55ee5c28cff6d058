"""Pareto front of error against run time over several meshes, sizes and exponents: text, drawing, table."""

from collections.abc import Container, Iterable, Mapping, Sequence
from statistics import median
from typing import Any

import numpy as np

from blysk.bench.colors import style_of
from blysk.bench.labels import Label, place_labels
from blysk.bench.report.section import Conclusion, Drawing, Table
from blysk.bench.svg import panels, svg
from blysk.golden.presets import METHODS, MIRROR_LOBES

__all__ = ["conclusion", "design_of", "spread_table", "summaries"]


def design_of(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Method and model of a point, the operand if it is not the method's own, and the lanes if several.

    `blysk.sim.api.placed.design_of` has the same words.
    """
    lanes = (f"{settings['lanes']} pixel lanes",) if "lanes" in settings else ()
    return *(settings[name] for name in ("method", "model", "operand") if name in settings), *lanes


def summaries(
    points: Sequence[Mapping[str, Any]], spread: Mapping[tuple, Sequence[dict]]
) -> list[dict[str, Any]]:
    """Summary of each hardware design over all scenes in which it was measured.

    Parameters
    ----------
    points : sequence of dict
        Points of the report.
    spread : mapping
        Results of `front_scenes.measure`, by `design_of`.

    Returns
    -------
    list of dict
        - ``label``, ``method`` and ``group``; ``samples``: number of scenes;
        - ``is_prepared``: whether spans bring dot products; ``is_mirror``: whether the model takes R·V;
        - ``method_error`` and ``total_error``: smallest and largest error over the scenes;
        - ``cycles``: smallest, median and largest cycles a pixel;
        - ``ns``: smallest, median and largest nanoseconds a pixel over scenes and seeds, or ``None``;
        - ``multipliers``, ``luts`` and ``fmax_mhz``;
        - ``parts``: number of spans after cutting, divided by the number before.
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
        for sample in spread.get(design_of(settings), ()):
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
    method_name = point["settings"]["method"]
    return {
        "label": label,
        "method": method_name,
        "group": point["group"],
        "is_prepared": METHODS.get(method_name) is not None and METHODS[method_name].given_values,
        "is_mirror": point["settings"]["model"] in MIRROR_LOBES,
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


_ALIKE_LSB, _ALIKE_TIMES = 0.15, 1.05
"""Two designs count as equal up to this difference of errors, in LSB, and up to this ratio of times."""

_LEAST_LSB = 1e-2
"""Smallest drawn error."""


def conclusion(found: Sequence[Mapping[str, Any]]) -> Conclusion | None:
    """Sentences about the front of two measures: largest total error over all scenes, and cycles a pixel.

    Parameters
    ----------
    found : sequence of dict
        From `summaries`.
    """
    timed = [of for of in found if of["cycles"]]
    if not timed:
        return None
    on_front = _front(timed, "total_error")
    if not on_front:
        return None
    exact = [of for of in on_front if of["total_error"][1] <= 1] or on_front[-1:]
    fast = [of for of in exact if of["cycles"][1] <= _ALIKE_TIMES * exact[0]["cycles"][1]]
    best = min(fast, key=lambda of: of["total_error"][1])
    scenes = max(of["samples"] for of in timed)
    sentence = (
        f"**`{best['label']}`** shades a pixel in {best['cycles'][1]:.2f} cycles. Its largest error against "
        f"exact Blinn shading on {scenes} scenes is {best['total_error'][1]:.2f} LSB. It takes {_costs(best)}"
    )
    compared = [of for of in timed if of is not best and _is_compared(of)]
    equals = [of for of in compared if all(of[key][1] <= best[key][1] for key in ("cycles", "total_error"))]
    if not equals:
        sentence += f". Of {len(compared)} other designs none is both as fast and as exact"
    others = [f"`{of['label']}` ({_says(of)})" for of in on_front if of is not best]
    if others:
        more = f" and {len(others) - 3} more" if len(others) > 3 else ""
        sentence += f". The front also has {', '.join(others[:3])}{more}"
    rivals = _cheapest_first(
        of for of in timed if of["method"] == "renormalise" and of["total_error"][1] <= 1
    )
    if rivals and best["method"] != "renormalise":
        rival = rivals[0]
        times = rival["cycles"][1] / best["cycles"][1]
        sentence += (
            ". Of the designs that normalise at every pixel, with an error of at most 1 LSB, "
            f"`{rival['label']}` has the fewest multipliers. Its largest error is "
            f"{rival['total_error'][1]:.2f} LSB. It takes {times:.2f} times the cycles and {_costs(rival)}"
        )
    prepared = _cheapest_first(of for of in timed if of["is_prepared"] and of["total_error"][1] <= 1)
    if prepared:
        sentence += (
            f". `{prepared[0]['label']}` takes {_costs(prepared[0])}. Its spans bring dot products at three "
            "points. The computation of these dot products is not counted"
        )
    mirrors = _cheapest_first(of for of in timed if of["is_mirror"])
    if mirrors:
        of = mirrors[0]
        sentence += (
            f". For true Phong highlights, (R·V)^n, `{of['label']}` takes {of['cycles'][1]:.2f} cycles and "
            f"{_costs(of)}. Its largest error against exact Phong shading is {of['total_error'][1]:.2f} LSB"
        )
    return Conclusion(
        "What is the cost of a pixel, and how exact is it?", f"{sentence}.", _drawing(timed, best)
    )


def _is_compared(of: Mapping[str, Any]) -> bool:
    """Whether a design may be on the front: it computes its dot products and draws Blinn's highlight."""
    return not (of["is_prepared"] or of["is_mirror"])


def _cheapest_first(found: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return sorted(found, key=lambda of: of["multipliers"] or np.inf)


def _front(found: Sequence[Mapping[str, Any]], kind: str, time: str = "cycles") -> list[Mapping[str, Any]]:
    """Designs that no other design beats, fastest first.

    Designs that get their dot products as input are left out. Designs of R·V are left out, too, because they
    draw another picture.

    A design beats another design if two conditions hold. First, it is no worse in error and time. Differences
    up to `_ALIKE_LSB` and ratios up to `_ALIKE_TIMES` count as equal. Second, it is better in error or time,
    or it is smaller. A smaller design has fewer multipliers, or equally many and fewer look-up tables.
    ``time`` is ``cycles`` or ``ns``, a key of `summaries`.
    """
    found = [of for of in found if _is_compared(of)]
    if not found:
        return []
    error, times = np.array([(of[kind][1], of[time][1]) for of in found]).T
    multipliers = np.array([of["multipliers"] or np.inf for of in found])
    # NaN stands for an unknown number of tables. No comparison with NaN holds.
    luts = np.array([of["luts"] or np.nan for of in found])
    # [i, j]: whether j is better than i.
    less_error = error < error[:, np.newaxis] - _ALIKE_LSB
    less_time = times * _ALIKE_TIMES < times[:, np.newaxis]
    smaller = multipliers < multipliers[:, np.newaxis]
    smaller |= (multipliers == multipliers[:, np.newaxis]) & (luts < luts[:, np.newaxis])
    no_worse = ~(less_error | less_time).T
    beaten = (no_worse & (less_error | less_time | smaller)).any(axis=1)
    return sorted(
        (of for of, is_beaten in zip(found, beaten, strict=True) if not is_beaten),
        key=lambda of: of[time][1],
    )


def _says(of: Mapping[str, Any]) -> str:
    return f"{of['cycles'][1]:.2f} cycles, {of['total_error'][1]:.2f} LSB"


def _costs(of: Mapping[str, Any]) -> str:
    parts = [] if of["multipliers"] is None else [f"{of['multipliers']} multipliers"]
    if of["luts"] is not None:
        parts.append(f"{of['luts']:,} LUT at {of['fmax_mhz']:.0f} MHz")
    return ", ".join(parts) or "resources that were not counted"


def _drawing(found: Sequence[Mapping[str, Any]], best: Mapping[str, Any]) -> Drawing:
    """Drawing of both errors against nanoseconds a pixel, or against cycles a pixel.

    Nanoseconds need clock rates of most designs and of the best design.
    """
    # A design with one scene is not comparable with designs of several scenes.
    several = [of for of in found if of["samples"] > 1]
    found = several if len(several) > 2 else found
    placed = [of for of in found if of["ns"]]
    in_ns = 2 * len(placed) > len(found) and best["ns"] is not None
    key, drawn = ("ns", placed) if in_ns else ("cycles", found)
    figure, axes = panels(9.2, 4.4, 2, sharex=True, sharey=True)
    kinds = (
        ("method_error", "method error: the same model, exact normals"),
        ("total_error", "total error: the exact power, exact normals"),
    )
    for panel, (kind, title) in zip(axes, kinds, strict=True):
        panel.set(xscale="log", yscale="log")
        panel.set_title(title, fontsize=9, loc="left")
        for of in drawn:
            style, published = style_of(of["method"]), of["group"] == "published"
            x, (low, high) = of[key], of[kind]
            panel.errorbar(
                *(x[1], high),
                xerr=[[x[1] - x[0]], [x[2] - x[1]]],
                yerr=[[high - max(low, _LEAST_LSB)], [0]],
                color=style.color,
                marker=style.marker,
                markersize=5.5,
                markerfacecolor="white" if published else style.color,
                linewidth=0.6,
                alpha=0.9,
            )
        on = {of["label"] for of in _front(drawn, kind, key)}
        corners = sorted((of[key][1], of[kind][1]) for of in drawn if of["label"] in on)
        if corners:
            xs = [corners[0][0], *(x for x, _ in corners), max(of[key][1] for of in drawn)]
            ys = [max(of[kind][1] for of in drawn), *(y for _, y in corners), corners[-1][1]]
            panel.step(xs, ys, where="post", color="#1c2126", linewidth=1.2, zorder=0)
        # Room for labels below the most exact designs.
        panel.set_ylim(bottom=max(min(of[kind][1] for of in drawn), _LEAST_LSB) / 4)
        _ticks(panel, in_ns)
    axes[0].set_ylabel("largest error over all scenes, LSB of linear light")
    for panel, (kind, _) in zip(axes, kinds, strict=True):
        labels = [
            Label(
                *(
                    of[key][1],
                    of[kind][1],
                    _short(of),
                    style_of(of["method"]).color,
                ),
                "bold" if of["label"] in on else "normal",
            )
            for of in _named(drawn, on, kind)
        ]
        place_labels(panel, labels, [point for of in drawn for point in _on_bars(of[key], of[kind])])
    scenes = max(of["samples"] for of in drawn)
    note = (
        f"A point is a design: its largest error and its median run time over up to {scenes} scenes "
        "(meshes, sizes, exponents). A bar reaches down to the smallest error, and across the run times of "
        "all scenes"
        + (" and seeds of placement" if in_ns else "")
        + ". An open mark is a variant as published. A design with an asterisk takes dot products at three "
        "points of every span as input, so it is not on the front. `phong` is not on the front either, "
        "because its errors are against (R·V)^n. The line is the front. Names stand at the front, and at the "
        "best and the worst design of each method. Before the pipeline, the host or the hardware of "
        "`blysk verilog --geometry` cuts spans from triangles and prepares the spans' normals. This work "
        "is not counted. The cycles of each part of a cut span are counted."
    )
    if in_ns and len(placed) < len(found):
        without = ", ".join(of["label"] for of in found if not of["ns"])
        note += f" Not drawn, without a clock rate (not placed, or too large for the FPGA): {without}."
    elif not in_ns:
        note += (
            f" {len(placed)} of {len(found)} designs have committed clock rates. Place the others with "
            "`blysk fpga`. The drawing shows nanoseconds if most designs and the best have a clock rate."
        )
    return Drawing(
        "front", f"Error against {'nanoseconds' if in_ns else 'cycles'} a pixel", svg(figure), note
    )


def _on_bars(x: Sequence[float], error: Sequence[float]) -> list[tuple[float, float]]:
    """Points on the bars of a design, which a label must not cover."""
    low, high = (max(value, _LEAST_LSB) for value in error)
    return [(at, high) for at in np.geomspace(x[0], x[2], 12)] + [
        (x[1], at) for at in np.geomspace(low, high, 24)
    ]


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


def _short(of: Mapping[str, Any]) -> str:
    return of["label"].replace(", 1 - N.H", "") + "*" * of["is_prepared"]


def _named(found: Sequence[Mapping[str, Any]], on: Container[str], kind: str) -> list[Mapping[str, Any]]:
    """Designs that get a label: first the front, then the best and the worst design of each method."""
    chosen = sorted((of for of in found if of["label"] in on), key=lambda of: of[kind][1])
    for method in dict.fromkeys(of["method"] for of in found):
        own = sorted((of for of in found if of["method"] == method), key=lambda of: of[kind][1])
        named = any(of["method"] == method for of in chosen)
        chosen += [of for of in ([] if named else own[:1]) if of not in chosen]
        chosen += [of for of in own[-1:] if of not in chosen]
    return chosen


def spread_table(found: Sequence[Mapping[str, Any]]) -> Table:
    """Table of `summaries`, a row for each design."""
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
        "Over all meshes, sizes and exponents. The cycle model gives the cycles of the further scenes. "
        "Parts a span: number of spans after cutting, divided by the number before. Multipliers are counted "
        "in the netlist. Look-up tables and clock rates are those after place and route, if a design has "
        "been placed."
    )
    return Table("front", "Every design over all scenes", columns, rows, note)
