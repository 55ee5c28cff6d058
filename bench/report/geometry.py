"""The report's section on triangles: whole designs compared, from triangles to pixels, and stiff cases.

The first method is ``quotient``. Its spans bring a vector and the step of the vector. ``quotient`` has two
rivals. ``quadratic`` needs unit normals at the ends of each span. ``renormalise`` takes the unchanged line
between the ends, and normalises at every pixel.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import median
from typing import Any

from blysk.bench.colors import style_of
from blysk.bench.report.geometry_cases import TERMINATOR, frame_figures, measure_cases
from blysk.bench.report.section import Cell, Drawing, Mark, Section, Table
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.bench.tools.families import DEVICE
from blysk.bench.tools.fpga import name_of
from blysk.golden.frames.triangle_frame import triangle_frame
from blysk.golden.number.spans import LENGTH_BITS
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import preset
from blysk.golden.reference.scene import Scene
from blysk.golden.render import Renderer
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.render import RendererUnit
from blysk.sim.api.placed import read_store
from blysk.sim.api.scene import scene
from blysk.sim.frames.triangles import TriangleSimulator

__all__ = ["CANDIDATES", "measure", "section", "tasks"]

_METHODS = "quotient", "renormalise", "quadratic"
_EXPONENTS = 1, 20, 100, 1000
_TRIANGLES = 64, 1000, 10_000, 100_000


def _candidate(method: str, **build: Any) -> ShadingPipeline:
    """A design for pictures of up to 1024x512, with the model ``blinn`` and one light."""
    return preset(method, "blinn", x_bits=10, y_bits=9).built(top="render", **build)


CANDIDATES = {
    "quotient": _candidate("quotient"),
    "quotient, two lanes": _candidate("quotient", setups=2),
    "renormalise": _candidate("renormalise", setup_interval=2),
    "renormalise, two lanes": _candidate("renormalise", setup_interval=2, setups=2),
    "quadratic": _candidate("quadratic"),
    "quotient, compact": _candidate("quotient", style="compact"),
    "renormalise, compact": _candidate("renormalise", style="compact"),
    "quadratic, compact": _candidate("quadratic", style="compact"),
}
"""Designs from triangles to pixels to compare, by name."""

_QUICK = "quotient, compact", "renormalise, compact", "quadratic, compact"


def measure(design: str, triangles: Sequence[int], size: Sequence[int]) -> dict[str, Any]:
    """Cost of a design, and frames of the teapot by its simulated hardware.

    Parameters
    ----------
    design : str
        A key of `CANDIDATES`.
    triangles : sequence of int
        Approximate numbers of triangles of the teapot.
    size : sequence of int
        Width and height.

    Returns
    -------
    dict
        - ``multipliers``, ``geometry_multipliers``, ``register_bits`` and ``memory_bits``, before synthesis
          and without the memory of depths;
        - ``frames``: for each frame ``triangles``, ``spans``, ``pixels``, ``cycles`` and the figures of
          `frame_figures`. In place of ``error`` there are ``errors`` by exponent.
    """
    renderer, size = Renderer(CANDIDATES[design]), tuple(size)
    unit = RendererUnit(renderer)
    totals = cost_of(unit).totals
    simulator = TriangleSimulator(renderer, size)
    return {
        "geometry_multipliers": unit.geometry.multipliers,
        **{name: totals[name] for name in ("multipliers", "register_bits", "memory_bits")},
        "frames": [_frame(simulator, count, size) for count in triangles],
    }


def _frame(simulator: TriangleSimulator, triangles: int, size: tuple[int, int]) -> dict[str, Any]:
    drawn = simulator.render(_scene(triangles, size, 50))
    errors, figures = {}, {}
    for exponent in _EXPONENTS:
        of = _scene(triangles, size, exponent)
        figures = frame_figures(of, simulator.renderer, triangle_frame(of, simulator.renderer))
        errors[str(exponent)] = figures.pop("error")
    figures |= {"triangles": len(drawn.sent.triangles), "spans": drawn.spans, "pixels": drawn.pixels}
    return figures | {"cycles": drawn.cycles, "errors": errors}


def _scene(triangles: int, size: tuple[int, int], exponent: int) -> Scene:
    return scene("teapot", size=size, triangles=triangles, exponent=exponent)


def tasks(quick: bool) -> list[Task]:
    """Tasks of each design and of each method's stiff cases.

    A quick report has only compact designs and small pictures.
    """
    settings = {
        "triangles": list(_TRIANGLES[:2] if quick else _TRIANGLES),
        "size": [160, 120] if quick else [640, 480],
    }
    designs = [Task(measure, {"design": name, **settings}) for name in (_QUICK if quick else CANDIDATES)]
    return designs + [Task(measure_cases, {"method": method, "quick": quick}) for method in _METHODS]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: costs of the designs, cycles by the size of triangles, and the stiff cases."""
    designs, cases, size = {}, {}, None
    for task, result in zip(tasks, results, strict=True):
        if "design" in task.settings:
            designs[task.settings["design"]], size = result, task.settings["size"]
        else:
            cases[task.settings["method"]] = result
    rates = {entry["design"]: entry["fmax_mhz"] for entry in read_store() if entry["device"] == DEVICE}
    text = [
        f"All designs draw the teapot at {size[0]}x{size[1]} with one light and a depth test. Every triangle "
        "is sent, and back faces are shaded.\n\n"
        "- `quotient` gets the vector N/W at the first pixel of a span, and the step of the vector. It needs "
        "no normaliser of edges. Spans are cut only where N/W grows short.\n"
        "- `renormalise` gets the unchanged line between the ends. It needs no normaliser of edges and no "
        "cuts, but about 14 products a pixel and light.\n"
        "- `quadratic` gets unit normals at the ends of every span. Wide spans are cut.",
        *_verdict(designs, rates),
        _stability(cases),
    ]
    parts = [_table(designs, rates), _drawing(designs), _case_table(cases)]
    return Section("geometry", "Triangles to pixels", text, parts)


def _verdict(designs: Mapping[str, Any], rates: Mapping[str, Sequence[float]]) -> Iterator[str]:
    """Costs of each rival of a style relative to the first method, for large and for small triangles."""
    for style in ("", ", two lanes", ", compact"):
        for rival in _METHODS[1:]:
            names = [f"{method}{style}" for method in (_METHODS[0], rival)]
            if all(name in designs for name in names):
                yield _beside(names, [designs[name] for name in names], rates)


def _placed_name(design: str) -> str:
    """Name of a candidate in the store. Designs are placed with the default words of places."""
    return name_of(replace(CANDIDATES[design], x_bits=LENGTH_BITS, y_bits=LENGTH_BITS))


def _beside(names: Sequence[str], pair: Sequence[Any], rates: Mapping[str, Sequence[float]]) -> str:
    """Cycles, time and multipliers of the second of two designs relative to the first."""
    seeds = [rates.get(_placed_name(name), ()) for name in names]
    clocks = [median(of) for of in seeds] if all(seeds) else []
    words = []
    for own, rival in zip(*(of["frames"] for of in pair), strict=True):
        ratio = rival["cycles"] / own["cycles"]
        timed = f", {ratio * clocks[0] / clocks[1]:.2f} of the time" if clocks else ""
        words.append(f"{ratio:.2f} of the cycles{timed} with {own['triangles']:,} triangles")
    more = pair[1]["multipliers"] - pair[0]["multipliers"]
    rate = (
        f" Their clock rates are {clocks[0]:.0f} and {clocks[1]:.0f} MHz, medians of {len(seeds[0])} and "
        f"{len(seeds[1])} placements."
        if clocks
        else ""
    )
    return (
        f"Compared with `{names[0]}`, `{names[1]}` has {abs(more)} {'more' if more >= 0 else 'fewer'} "
        f"multipliers. It takes {'; '.join(words)}.{rate}"
    )


def _table(designs: Mapping[str, Any], rates: Mapping[str, Sequence[float]]) -> Table:
    counts = [frame["triangles"] for frame in next(iter(designs.values()))["frames"]]
    columns = ("design", "multipliers", "of geometry", "register bits", "memory bits", "clock rate, MHz")
    columns += tuple(f"cycles, {count:,} triangles" for count in counts)
    columns += ("pixels that show another triangle", "largest error, LSB")
    rows: list[tuple[Cell, ...]] = []
    for name, of in designs.items():
        placed = rates.get(_placed_name(name))
        errors = [error for frame in of["frames"] for error in frame["errors"].values() if error is not None]
        rows.append(
            (
                *(name, of["multipliers"], of["geometry_multipliers"], of["register_bits"]),
                *(of["memory_bits"], median(placed) if placed else None),
                *(frame["cycles"] for frame in of["frames"]),
                *(max(frame["other"] for frame in of["frames"]), max(errors)),
            )
        )
    note = (
        "Multipliers and bits are counted before synthesis, without the memory of depths. The clock rate is "
        f"the median of the placements on an {DEVICE}, if there are any. Cycles are simulated, from the "
        "first triangle until the hardware is empty. The error is that of the bit-accurate model against "
        "exact normals at every pixel in float64, with the same reflection model. It is the largest over all "
        f"frames, over the exponents {', '.join(map(str, _EXPONENTS))}, and over the pixels that show the "
        "same triangle. At a common edge of two triangles that are folded flat, hardware and float64 may "
        "show different triangles."
    )
    return Table("geometry-designs", "Designs from triangles to pixels", columns, rows, note)


def _drawing(designs: Mapping[str, Any]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 4.0), layout="constrained")
    panel = figure.subplots()
    for name, of in designs.items():
        candidate, frames = CANDIDATES[name], of["frames"]
        style = style_of(candidate.method)
        dash = ":" if candidate.build.setups > 1 else "--" if candidate.build.compact else "-"
        panel.plot(
            [frame["pixels"] / frame["triangles"] for frame in frames],
            [frame["cycles"] / frame["pixels"] for frame in frames],
            color=style.color,
            linestyle=dash,
            marker=style.marker,
            linewidth=1.4,
            label=name,
        )
    panel.set(xscale="log", yscale="log", xlabel="pixels of a triangle", ylabel="cycles a pixel")
    panel.set_yticks((1, 2, 5, 10, 20), ("1", "2", "5", "10", "20"))
    panel.set_yticks((), minor=True)
    panel.grid(True, color="#dddddd", linewidth=0.5)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside right center", frameon=False)
    note = "Small triangles are on the left. Their cycles come from the setup of triangles, not from shading."
    return Drawing("geometry-cycles", "Cycles a pixel against the size of triangles", svg(figure), note)


def _stability(cases: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    every = [case for of in cases.values() for case in of]
    errors = [case["error"] for case in every if not case["sliver"] and case["error"] is not None]
    told = sorted({case["name"] for case in every if (case["error"] or 0) > 1})
    return (
        f"Each method has {len(every) // len(cases)} stiff and extreme cases. In all cases together "
        f"{sum(case['coverage'] for case in every)} pixels are covered by only one of hardware and float64. "
        f"In cases where the hardware counts no sliver the largest error is {max(errors):.2f} LSB. "
        f"Cases with an error above 1 LSB: {'; '.join(told) or 'none'}."
    )


def _case_table(cases: Mapping[str, Sequence[Mapping[str, Any]]]) -> Table:
    counters = ("empty", "zero_area", "sliver", "cut", "repaired", "spans", "hidden")
    columns = ("case", "method", "triangles", "pixels", "coverage differs", "other triangle", "no normal")
    columns += ("error, LSB",)
    columns += tuple(name.replace("_", " ") for name in counters)
    rows: list[tuple[Cell, ...]] = []
    marks: list[tuple[Mark, ...]] = []
    for method, of in cases.items():
        for case in of:
            figures = (case[name] for name in ("triangles", "pixels", "coverage", "other", "zero", "error"))
            rows.append((case["name"], method, *figures, *(case[counter] for counter in counters)))
            off = (case["error"] or 0) > 1
            mark: Mark = "" if not off else "stated" if case["sliver"] else "silent"
            marks.append(tuple(mark if column == "error, LSB" else "" for column in columns))
    note = (
        "Bit-accurate models against exact coverage and exact normals in float64. The simulated hardware "
        "equals the models to the bit. No normal: pixels where opposite normals add up to 0, so that every "
        f"normal is right. Error: the largest error of the other pixels whose |N.L| is over {TERMINATOR:g}. "
        "§: the hardware counts slivers in this case. A sliver is at most 1/256 pixel wide, and has the "
        "attributes of its longest edge. A triangle is empty if it covers no pixel centre."
    )
    return Table("geometry-cases", "Stiff and extreme triangles", columns, rows, note, marks=marks)
