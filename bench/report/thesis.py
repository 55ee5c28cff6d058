"""The report's section on [T]: its speed claims in software and in hardware, its table 1.1, and its MNSE."""

from collections.abc import Sequence
from typing import Any

from blysk.bench.report.section import Drawing, Section, Table
from blysk.bench.report.thesis_figures import (
    SHADINGS,
    UNITS,
    clock_rate,
    frame_cycles,
    hardware,
    prices,
    shading_share,
    software,
    square_errors,
)
from blysk.bench.report.thesis_ways import CLAIMS, SPANS, WAYS, WIDEST, Claim
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.bench.tools.place_and_route import tool_versions
from blysk.golden.presets import METHODS, PUBLISHED

__all__ = [
    "section",
    "tasks",
]


_LENGTHS = (4, 8, 16, 32, 64, 128, 256)

_QUICK_LENGTHS = (8, 64)

_TRIANGLES = (1_000, 10_000, 100_000, 1_000_000)

_SEEDS = 3


def tasks(quick: bool) -> list[Task]:
    """Measurements of the section.

    Parameters
    ----------
    quick : bool
        Whether the measurements take only some seconds: two lengths of spans, the units of a pixel without
        place and route, and small frames.
    """
    found = []
    for claim in CLAIMS:
        lengths = (_QUICK_LENGTHS if quick else _LENGTHS) if claim.in_pixels else (1,)
        settings = [
            {"way": way, "baseline": baseline, "pixels": pixels, "repeats": 15 if quick else 40}
            for way in claim.ways
            for baseline in claim.baselines
            for pixels in lengths
        ]
        found += [Task(software, chosen, timed=True) for chosen in settings]
    found.append(Task(prices, {"repeats": 15 if quick else 40}, timed=True))
    size = {"width": 160, "height": 120} if quick else {"width": 640, "height": 480}
    units = [name for name in UNITS if not (quick and name.endswith("interpolator"))]
    found += [Task(hardware, {"name": name}) for name in units]
    if not quick:
        rate = {"seeds": _SEEDS, "tools": tool_versions()}
        found += [Task(clock_rate, {"name": name, **rate}) for name in units]
        whole = [name for name in units if name.endswith("interpolator")]
        found += [Task(frame_cycles, {"name": name, "triangles": 10_000, **size}) for name in whole]
    found += [
        Task(shading_share, {"triangles": count, **size, "repeats": 7 if quick else 3}, timed=True)
        for count in (_TRIANGLES[:2] if quick else _TRIANGLES)
    ]
    methods = ("linear", "quadratic", "renormalise", "quotient") if quick else (*METHODS, *PUBLISHED)
    count = 1_000 if quick else 10_000
    found += [Task(square_errors, {"method": method, "triangles": count, **size}) for method in methods]
    return found


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section from the results of its tasks.

    Parameters
    ----------
    tasks : sequence of Task
        Tasks of `tasks`.
    results : sequence
        Their results.
    """
    by = {
        function: [
            (task.settings, result)
            for task, result in zip(tasks, results, strict=True)
            if task.function is function
        ]
        for function in (software, prices, hardware, clock_rate, frame_cycles, shading_share, square_errors)
    }
    speeds = _software_table(by[software])
    units = {settings["name"]: {**result, "frame": None} for settings, result in by[hardware]}
    rates = {settings["name"]: result for settings, result in by[clock_rate]}
    for settings, result in by[frame_cycles]:
        units[settings["name"]]["frame"] = result
    squares = _squares_table(by[square_errors])
    reached = [_reached(claim, speeds) for claim in CLAIMS]
    first, one = by[square_errors][0]
    turned = _turned(squares)
    text = [
        "[T] states of four of its methods how much faster they are than classical normalisation, in "
        "software. We know neither its programs nor its machine. What follows is measured in NumPy on this "
        "machine, and does not refute it. " + " ".join(reached),
        "NumPy does an operation at a time on whole arrays, so that a root costs what its unit takes and no "
        "more: "
        + ", ".join(f"{kind} {cost:.2g}" for kind, cost in by[prices][0][1].items())
        + " multiplications on this machine. The table has the price from which on the counted operations "
        "alone would give the published ratio, as on a machine whose roots cost so much.",
        "In hardware a unit that takes new operands in every cycle gives a normal a cycle whatever is "
        "inside, but for setups that take longer than a span: the claims turn into multipliers, cells and "
        "registers that are saved, not into cycles. The table of units restates them so; the figure of a "
        "baseline over a unit's is above 1 where the unit is the cheaper.",
        "Table 1.1 of [T] has the share of shading in the time of a frame. Its published values were not at "
        "hand; the table below shows what the golden renderer, in NumPy, takes for either method.",
        f"MNSE, as published in [T] 4.1, is defined for {one['defined']:.0%} of the values of the teapot's "
        "frame, and for few of a flat picture (see the errata). It divides by a pixel's own distance from "
        f"the mean: with the method `{first['method']}` the hundredth of the values that is nearest the "
        f"mean makes {one['nearest']:.0%} of it. The same single step of 1 LSB, in the reference frame "
        f"itself, gives {one['worst']:.2g} in the value nearest the mean and {one['least']:.2g} in the "
        f"farthest one, a ratio of {one['worst'] / one['least']:.2g}; NMSE says {one['one']:.2g} of both. "
        f"{turned}",
    ]
    parts = [
        speeds,
        _speed_drawing(by[software]),
        _operations_table(by[software]),
        _hardware_table(units, rates),
        _ratios_table(units, rates),
        _shares_table(by[shading_share]),
        squares,
    ]
    return Section("thesis", "[T]: speed, table 1.1, MNSE", text, parts, appendix=True)


_CLAIM_OF = {(way, baseline): claim for claim in CLAIMS for way in claim.ways for baseline in claim.baselines}


def _software_table(results: Sequence[tuple[dict, dict]]) -> Table:
    rows, grades = [], []
    for settings, result in results:
        claim = _CLAIM_OF[settings["way"], settings["baseline"]]
        holds = result["ratio"] >= claim.published
        rows.append(
            [
                *(claim.name, claim.source, settings["way"], settings["baseline"]),
                settings["pixels"] if claim.in_pixels else None,
                *(
                    claim.published,
                    result["ratio"],
                    holds,
                    _price(claim.published, result),
                    result["difference"],
                ),
            ]
        )
        grade = "good" if holds else "fair" if result["ratio"] > 1 else "bad"
        grades.append([""] * 6 + [grade] * 2 + [""] * 2)
    return Table(
        "thesis-software",
        "Speed claims of [T] in software: how many times faster",
        (
            *("claim", "source", "way", "compared with", "pixels a span"),
            *("published ratio", "measured ratio", "reaches it", "price of a root that reaches it"),
            "largest difference",
        ),
        rows,
        f"NumPy in float64, {SPANS} spans of up to {WIDEST:g} degrees at once, setup included; both ways "
        "in turn in one run, the least processor time of several; a bisection has a pixel more. What [T] "
        "compared with is known as 'classical normalisation' only: both usual forms are here, and for the "
        "recurrence the direct evaluation "
        "of the cosines too. Price: what a root, a division or a cosine would have to cost, in "
        "multiplications or additions, for the counted operations alone to give the published ratio. "
        "Difference: between the results of both, as components of a unit normal or cosines; a line's "
        "normals lie on another curve than the great circle, which is part of it. Green: the published ratio "
        "is reached; yellow: faster, but less; red: slower.",
        grades,
    )


def _price(published: float, result: dict[str, Any]) -> float | None:
    """Least cost of a dear operation, in cheap ones, at which the counts give the published ratio."""
    cheap, dear = (
        [sum(result[of].get(kind, 0.0) for kind in kinds) for of in ("operations", "baseline_operations")]
        for kinds in (_OPERATIONS[:2], _OPERATIONS[2:])
    )
    gain = dear[1] - published * dear[0]
    return max((published * cheap[0] - cheap[1]) / gain, 0.0) if gain > 0 else None


def _reached(claim: Claim, table: Table) -> str:
    rows = [row for row in table.records() if row["claim"] == claim.name]
    ratios = [row["measured ratio"] for row in rows]
    held = [row for row in rows if row["reaches it"]]
    text = (
        f"*{claim.name[0].upper()}{claim.name[1:]}*: published {claim.published}, "
        f"measured {min(ratios):.2f} to {max(ratios):.2f}, "
    )
    if len(held) == len(rows):
        return text + "reached everywhere."
    if not held:
        return text + "reached nowhere."
    against = sorted({row["compared with"] for row in held})
    where = f"reached in {len(held)} of {len(rows)} comparisons: against {' and '.join(against)}"
    lengths = sorted({row["pixels a span"] for row in held} - {None})
    return text + where + (f", on spans of {', '.join(map(str, lengths))} pixels." if lengths else ".")


def _speed_drawing(results: Sequence[tuple[dict, dict]]) -> Drawing:
    chosen = [claim for claim in CLAIMS if claim.in_pixels]
    figure, row = panels(9.6, 3.6, len(chosen), sharey=True)
    for claim, panel in zip(chosen, row, strict=True):
        for k, way in enumerate(claim.ways):
            for baseline, colour in zip(claim.baselines, ("#0072b2", "#d55e00", "#009e73"), strict=False):
                curve = [
                    (settings["pixels"], result["ratio"])
                    for settings, result in results
                    if (settings["way"], settings["baseline"]) == (way, baseline)
                ]
                label = baseline.removeprefix("bisection, ").removeprefix("line, ")
                label += f"; {way.removeprefix('bisection, ')}" if len(claim.ways) > 1 else ""
                panel.plot(
                    *zip(*curve, strict=True),
                    marker="os"[k],
                    linestyle=("-", "--")[k],
                    color=colour,
                    label=label,
                )
        panel.axhline(claim.published, color="black", linestyle=":", label=f"published, {claim.published}")
        panel.axhline(1, color="#999999", linewidth=0.8)
        panel.set_xscale("log", base=2)
        panel.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        panel.set_title(claim.name, fontsize=9)
        panel.legend(fontsize=6.5, loc="upper center", bbox_to_anchor=(0.5, -0.2), frameon=False)
    row[0].set_ylabel("times faster than the baseline")
    row[len(row) // 2].set_xlabel("pixels of a span")
    return Drawing(
        "thesis-speed",
        "Speed of the ways of [T] in software, against the length of a span",
        svg(figure),
        "Short spans pay for the setup. Below 1 a way is slower than its baseline.",
    )


_OPERATIONS = ("multiplications", "additions", "divisions", "roots", "functions")


def _operations_table(results: Sequence[tuple[dict, dict]]) -> Table:
    found = {}
    for settings, result in results:
        found[settings["way"], settings["pixels"]] = result["operations"]
        found[settings["baseline"], settings["pixels"]] = result["baseline_operations"]
    order = {way: k for k, way in enumerate(WAYS)}
    single = {way for claim in CLAIMS if not claim.in_pixels for way in (*claim.ways, *claim.baselines)}
    rows = [
        [way, None if way in single else pixels, *(counts.get(kind, 0.0) for kind in _OPERATIONS)]
        for (way, pixels), counts in sorted(found.items(), key=lambda item: (order[item[0][0]], item[0][1]))
    ]
    return Table(
        "thesis-operations",
        "Operations in software, of a normal or of a pixel's N·L and N·H",
        ("way", "pixels a span", *_OPERATIONS),
        rows,
        "Counted while the ways run, the setup's share included; additions with subtractions; a product "
        "with a power of two counts; functions are cosines, sines and their inverses.",
    )


def _hardware_table(units: dict[str, dict], rates: dict[str, dict]) -> Table:
    kinds = ("latency", "interval", "frame", "multipliers", "cells", "register_bits", "memory_bits")
    rows = [
        [name, *(figures[kind] for kind in kinds), rates.get(name, {}).get("fmax")]
        for name, figures in units.items()
    ]
    reasons = sorted({result["reason"] for result in rates.values()} - {""})
    missing = " ".join(reasons) if rates else "The quick report has no place and route."
    return Table(
        "thesis-units",
        "The same in hardware: units",
        (
            *(
                "unit",
                "latency, cycles",
                "interval, cycles",
                "cycles a pixel of a frame",
                "multipliers",
                "cells",
            ),
            *("register bits", "memory bits", "Fmax, MHz"),
        ),
        rows,
        "Interval: cycles from one result to the next. Cells, before technology mapping, are operators, "
        "multiplexers, registers and memories of any width. An interpolator is whole: setup, and N·L and N·H "
        "of one light; its frame is a teapot's, through the simulated pipeline, setups of spans included. "
        f"Fmax: median of placements on an ECP5-25F. {missing}".strip(),
    )


def _ratios_table(units: dict[str, dict], rates: dict[str, dict]) -> Table:
    rows = []
    for claim in CLAIMS:
        pairs = [
            (name, baseline)
            for name in claim.units
            for baseline in claim.baseline_units
            if name.endswith("interpolator") == baseline.endswith("interpolator")
            and name in units
            and baseline in units
        ]
        for name, baseline in pairs:
            ours, theirs = units[name], units[baseline]
            row = [claim.name, name, baseline, claim.published]
            for kind in ("interval", "frame", "multipliers", "cells", "register_bits"):
                row.append(theirs[kind] / ours[kind] if ours[kind] and theirs[kind] else None)
            rate, baseline_rate = (rates.get(one, {}).get("fmax") for one in (name, baseline))
            row.append(rate / baseline_rate if rate and baseline_rate else None)
            rows.append(row)
    return Table(
        "thesis-hardware",
        "Speed claims of [T] in hardware: the baseline's figure over the unit's",
        (
            *("claim", "unit", "compared with", "published ratio (software)", "cycles a result"),
            "cycles a pixel of a frame",
            *("multipliers", "cells", "register bits", "Fmax (unit over baseline)"),
        ),
        rows,
        "Above 1 the unit of [T] needs less, or cycles faster. No figure: the unit has no multiplier, or "
        "there is no place and route. The baseline is the direct renormaliser, a normal a cycle.",
    )


def _shares_table(results: Sequence[tuple[dict, dict]]) -> Table:
    return Table(
        "thesis-shading-share",
        "[T] table 1.1: share of shading in the time of a frame",
        ("shading", "triangles", "visible pixels", "share of shading"),
        [
            [shading, result["triangles"], result["pixels"], result[shading]]
            for shading in SHADINGS
            for _, result in results
        ],
        "Teapot, golden renderer, Phong's model. The rest of the time is projection, rasterising, depth, "
        "and the normals at the ends of spans; pixels that are hidden are not shaded. The published values "
        "were not at hand.",
    )


def _squares_table(results: Sequence[tuple[dict, dict]]) -> Table:
    return Table(
        "thesis-mnse",
        "MNSE as published in [T] 4.1, and its well-posed form",
        (
            *("method", "MNSE as published", "share of values where it is defined", "NMSE"),
            *("largest error, LSB", "99.9th percentile, LSB"),
        ),
        [
            [
                settings["method"],
                *(result[name] for name in ("published", "defined", "nmse", "max_lsb", "p999_lsb")),
            ]
            for settings, result in results
        ],
        "Teapot, exponent 50, model cosquad, of quotient blinn, against Phong shading with Blinn's model, so "
        "mostly the error of cosquad; frames of the bit-accurate model, which the RTL equals to the bit. "
        "NMSE is `sum (I-O)^2 / sum (I-mean(I))^2`.",
    )


def _turned(squares: Table) -> str:
    """Sentence on two methods whose order differs between the published form and NMSE, if any."""
    rows = squares.records()
    for better in rows:
        for worse in rows:
            if (
                better["NMSE"] < worse["NMSE"]
                and better["largest error, LSB"] <= worse["largest error, LSB"]
                and better["MNSE as published"] > worse["MNSE as published"]
            ):
                return (
                    f"Of the methods, too, it puts `{worse['method']}` "
                    f"({worse['MNSE as published']:.5g}) before `{better['method']}` "
                    f"({better['MNSE as published']:.5g}), which has the smaller NMSE "
                    f"({better['NMSE']:.5g} against {worse['NMSE']:.5g}) and a largest error of "
                    f"{better['largest error, LSB']:.4g} against {worse['largest error, LSB']:.4g} LSB."
                )
    orders = [sorted(rows, key=lambda row: row[form]) for form in ("NMSE", "MNSE as published")]
    if orders[0] == orders[1]:
        return "It puts these methods in the same order as NMSE does."
    return "It puts these methods in another order than NMSE does."
