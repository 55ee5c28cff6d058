"""Fronts of the section on rivals: error against area, against switched bits, and against placed tables.

A method is on a front if no other method is at least as good in every number and better in one.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from statistics import median
from typing import Any

from blysk.bench.colors import style_of
from blysk.bench.labels import Label, place_labels
from blysk.bench.report.section import Cell, Drawing, Table
from blysk.bench.svg import panels, svg
from blysk.bench.tools.families import DEVICE
from blysk.golden.rivals.designs import SpanDesign
from blysk.golden.rivals.registry import COMPARED
from blysk.golden.rivals.rival import Rival
from blysk.hdl.methods.renormalise_interpolator import RenormaliseInterpolatorUnit
from blysk.sim.api.placed import read_store

__all__ = [
    "DRAWN",
    "PRODUCT_AREA",
    "area_of",
    "counts",
    "drawings",
    "front_of",
    "listed",
    "placed_of",
    "placed_table",
    "title_of",
]

DRAWN = 100
"""Exponent of the drawings, and of switched bits."""

PRODUCT_AREA = 18 * 18
"""Bits of adders that stand for a multiplier of 18x18 bits: one for each partial product."""

Frames = Mapping[str, Sequence[Mapping[str, Any]]]
"""Results of `rivals.errors` by method."""


def area_of(of: Mapping[str, Any]) -> int | None:
    """Area of the result of `rivals.parts` in bits of adders, `PRODUCT_AREA` for a multiplier."""
    if of["multipliers"] is None:
        return None
    area: int = PRODUCT_AREA * of["multipliers"] + of["adder_bits"]
    return area


def front_of(points: Mapping[str, Sequence[float]]) -> list[str]:
    """Names of the points that no other point beats, from the smallest first number on.

    A point beats another if it is at most as large in every number, and smaller in one.
    """
    found = []
    for name, at in points.items():
        others = (other for key, other in points.items() if key != name)
        if not any(all(a <= b for a, b in zip(of, at, strict=True)) and of != at for of in others):
            found.append(name)
    return sorted(found, key=lambda name: points[name])


def counts(name: str) -> bool:
    """Whether the trace of a method has all its parts, those of its setup among them."""
    rival = COMPARED[name]
    return not isinstance(rival, SpanDesign) or rival.COUNTS_SETUP


def listed(names: Iterable[str]) -> str:
    """Names as text, with commas, and "and" before the last."""
    names = [f"`{name}`" for name in names]
    return f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else "".join(names)


def title_of(mesh: str, of: Frames) -> str:
    """A mesh with its triangles, as text."""
    kind = "teapot" if mesh.startswith("teapot") else "torus"
    return f"{kind}, {next(iter(of.values()))[0]['triangles']:,} triangles"


def _drawn(found: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The frame of the drawn exponent."""
    return next(of for of in found if of["exponent"] == DRAWN)


def _is_blinn(name: str) -> bool:
    return COMPARED[name].REFLECTION.name == "blinn"


def placed_of(rival: Rival) -> dict[str, Any] | None:
    """Committed place and route of a method's hardware with one light, or ``None`` if it was not placed.

    Parameters
    ----------
    rival : Rival
        One of `COMPARED`.

    Returns
    -------
    dict or None
        An entry of the store, with ``mhz``, the median over its seeds.
    """
    if not isinstance(rival, SpanDesign):
        return None
    usual = rival.SETUP_INTERVAL in (None, RenormaliseInterpolatorUnit.DEFAULT_INTERVAL)
    name = f"pipeline {rival.HARDWARE}, {rival.REFLECTION.name}, 1 light"
    design = name if usual else f"{name}, interval {rival.SETUP_INTERVAL}"
    for entry in read_store():
        if (entry["device"], entry["design"]) == (DEVICE, design):
            return entry | {"mhz": median(entry["fmax_mhz"])}
    return None


def _placed_points(of_mesh: Mapping[str, Frames]) -> dict[str, dict[str, dict[str, Any]]]:
    """For each mesh and placed method entry, cycles and time of a pixel, products with time, and error."""
    entries = {name: placed_of(rival) for name, rival in COMPARED.items()}
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for mesh, of in of_mesh.items():
        points = found[title_of(mesh, of)] = {}
        for name, frames in of.items():
            if entry := entries[name]:
                frame = _drawn(frames)
                time = 1e3 * frame["cycles"] / entry["mhz"]
                points[name] = {
                    "entry": entry,
                    "cycles": frame["cycles"],
                    "ns": time,
                    "tables": entry["luts"] * time,
                    "multipliers": entry["multipliers"] * time,
                    "error": frame["max_lsb"],
                }
    return found


def _fronts_placed(points: Mapping[str, Mapping[str, Any]]) -> tuple[list[str], list[str]]:
    """Fronts of tables times time against error, and of both and multipliers times time."""

    def front(*keys: str) -> list[str]:
        return front_of({name: [of[k] for k in keys] for name, of in points.items() if _is_blinn(name)})

    return front("tables", "error"), front("tables", "multipliers", "error")


def _left_out() -> str:
    """A sentence on the methods of which a front of placed designs knows nothing."""
    models = listed(name for name, rival in COMPARED.items() if not rival.HARDWARE)
    return f"{models} are models without hardware, so this front leaves them out."


def placed_table(of_mesh: Mapping[str, Frames]) -> Table:
    """Parts, clock rate and time of every placed method on every mesh, and whether it is on a front."""
    columns = ["method", "mesh", "look-up tables", "flip-flops", "multipliers", "block RAMs", "seeds"]
    columns += ["clock rate, median, MHz", "cycles a pixel", "ns a pixel", "tables times ns"]
    columns += ["multipliers times ns", "error, LSB", "on the front of tables"]
    columns += ["on the front of tables and multipliers"]
    rows: list[list[Cell]] = []
    for mesh, points in _placed_points(of_mesh).items():
        fronts = _fronts_placed(points)
        for name, of in points.items():
            entry = of["entry"]
            parts = (entry[part] for part in ("luts", "flip_flops", "multipliers", "block_rams"))
            time = (entry["mhz"], *(of[key] for key in ("cycles", "ns", "tables", "multipliers", "error")))
            on = (name in front for front in fronts)
            rows.append([name, mesh, *parts, len(entry["fmax_mhz"]), *time, *on])
    note = (
        "Committed placements of the methods that have hardware, with one light, out of context. "
        "`docs/guide/rivals.md` says which work on timing each design had. Cycles and errors are those of "
        f"the table of errors at exponent {DRAWN}. A method is on a front if no other method is at least as "
        f"good in all its numbers and better in one. Methods with R·V are not on a front. {_left_out()}"
    )
    return Table("rivals-placed", "Placed methods: tables times time", columns, rows, note)


def drawings(
    of_mesh: Mapping[str, Frames], of_lights: Mapping[int, Mapping], frames_of: Mapping[int, Frames]
) -> list[tuple[Drawing, str]]:
    """Drawings of the fronts, each with a sentence.

    Parameters
    ----------
    of_mesh : mapping
        Results of `rivals.errors` with one light, by mesh and method.
    of_lights : mapping
        Results of `rivals.parts`, by number of lights and method.
    frames_of : mapping
        Results of `rivals.errors` on one mesh, by number of lights and method.

    Returns
    -------
    list of tuple of Drawing and str
    """
    area = {
        title_of(mesh, of): _points(of, partial(_area_time, of_lights[1])) for mesh, of in of_mesh.items()
    }
    energy = {title_of(mesh, of): _points(of, _switched, counts) for mesh, of in of_mesh.items()}
    counted = {f"{lights} light{'s' * (lights > 1)}": (lights, of) for lights, of in frames_of.items()}
    area_by_lights = {
        title: _points(of, partial(_area_time, of_lights[lights]), counts)
        for title, (lights, of) in counted.items()
    }
    energy_by_lights = {title: _points(of, _switched, counts) for title, (_, of) in counted.items()}
    tables = {
        mesh: {name: (of["tables"], of["error"]) for name, of in points.items()}
        for mesh, points in _placed_points(of_mesh).items()
    }
    wide, bits = "area times time, bits of adders times cycles a pixel", "switched bits a pixel"
    note = f"Exponent {DRAWN}. The line is the front of the methods that draw Blinn's highlight. "
    partly = "`kuijk-blake` counts only the multipliers of its setup, so its area is a lower bound. "
    middle = next(title_of(mesh, of) for mesh, of in of_mesh.items() if of is frames_of[1])
    here = f"Mesh: {middle}. Errors and cycles are those of the same number of lights. "
    rate = (
        "Every method gives one pixel a cycle, or waits without switching. `kuijk-blake` is left out, "
        "because the switched bits of its setup are not counted."
    )
    placed = (
        "Look-up tables and median clock rates of committed placements. Multipliers are not in the drawing; "
        f"the table has them. {_left_out()}"
    )
    mesh, number, of_area = ", by mesh", ", by number of lights", "Error against area times time"
    of_bits, of_tables = "Error against switched bits", "Error against tables times time of placed designs"
    time = "look-up tables times nanoseconds a pixel"
    return [
        _drawing("rivals-area", of_area + mesh, wide, area, note + partly),
        _drawing("rivals-lights", of_area + number, wide, area_by_lights, note + here),
        _drawing("rivals-energy", of_bits + mesh, bits, energy, note + rate),
        _drawing("rivals-energy-lights", of_bits + number, bits, energy_by_lights, note + here + rate),
        _drawing("rivals-placed", of_tables + mesh, time, tables, note + placed),
    ]


def _area_time(parts: Mapping[str, Mapping[str, Any]], name: str, frame: Mapping[str, Any]) -> float:
    """Area times cycles a pixel of a method, whose area is known."""
    area = area_of(parts[name])
    assert area is not None
    return area * float(frame["cycles"])


def _switched(name: str, frame: Mapping[str, Any]) -> float:
    return float(frame["switched"])


def _points(
    of: Frames, first: Callable[[str, Mapping[str, Any]], float], kept: Callable[[str], bool] = lambda _: True
) -> dict[str, tuple[float, float]]:
    """First quantity and error of each kept method."""
    drawn = {name: _drawn(frames) for name, frames in of.items() if kept(name)}
    return {name: (first(name, frame), frame["max_lsb"]) for name, frame in drawn.items()}


_STYLES = {
    "duff": ("#7a4fbf", "p"),
    "bishop-weimer": ("#999933", "v"),
    "bishop-weimer-six": ("#999933", "^"),
    "loisel": ("#cc6677", "X"),
    "abbas": ("#44aa99", "P"),
}
"""Colours and markers of the rivals without hardware."""


def _style(name: str) -> tuple[str, str]:
    """Colour and marker of a method."""
    style = style_of(COMPARED[name].HARDWARE)
    return _STYLES.get(name, (style.color, style.marker))


def _drawing(
    name: str, title: str, x: str, groups: Mapping[str, Mapping[str, tuple[float, float]]], note: str
) -> tuple[Drawing, str]:
    """A panel for each group of points, with its front, and a sentence about the fronts."""
    figure, axes = panels(4.6 * len(groups), 4.2, len(groups), sharey=True)
    said = []
    for panel, (group, points) in zip(axes, groups.items(), strict=True):
        same = {of: at for of, at in points.items() if _is_blinn(of)}
        front = front_of(same)
        said.append(f"{group}: {listed(front)}")
        for of, at in points.items():
            color, marker = _style(of)
            shown = color if of in same else "none"
            panel.plot(*at, marker, color=color, markerfacecolor=shown, markersize=6)
        panel.step(*zip(*(points[of] for of in front), strict=True), where="post", color="#1c2126", lw=1.1)
        panel.set(xscale="log", yscale="log", title=group, xlabel=x)
        panel.margins(0.16)
        labels = [
            Label(*at, of, _style(of)[0], "bold" if of in front else "normal") for of, at in points.items()
        ]
        place_labels(panel, labels, list(points.values()))
    axes[0].set_ylabel("largest error before rounding, LSB of linear light")
    text = f"*{title}*: the front has, from the smallest on, for {'; for '.join(said)}."
    return Drawing(name, title, svg(figure), note), text
