"""The documents' criteria ([T] 1.3) as one table, and cycles a pixel against the size of triangles."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from blysk.bench.colors import style_of
from blysk.bench.labels import Label, place_labels
from blysk.bench.report import energy
from blysk.bench.report.criteria_figures import (
    EXPONENT,
    METHOD,
    MODEL,
    frame,
    refused,
    resources,
    simulated,
)
from blysk.bench.report.placed import placed
from blysk.bench.report.section import Cell, Drawing, Section, Table
from blysk.bench.store import Task
from blysk.bench.svg import panels, svg
from blysk.bench.tools.families import DEVICE
from blysk.golden.pixel_pipelines import PIPES
from blysk.golden.presets import METHODS

__all__ = ["SIZES", "section", "tasks"]

SIZES = (640, 480), (1920, 1080)

_TRIANGLES = (100, 1000, 10_000, 100_000, 1_000_000)

_LIGHTS = 1, 2, 4, 8


def tasks(quick: bool) -> list[Task]:
    """Frames by triangles and size, cycles beside simulation, lights, pipelines, energy, bad input."""
    found = [
        Task(frame, {"triangles": count, "size": list(size), "methods": list(METHODS if first else [METHOD])})
        for first, size in zip((True, False), SIZES, strict=True)
        # Of the drawing all, as short spans are what it is about.
        for count in (_TRIANGLES if first or not quick else _TRIANGLES[:-1])
    ]
    found += [Task(simulated, {"method": method}) for method in METHODS]
    found += [Task(resources, {"lights": lights}) for lights in (_LIGHTS[:2] if quick else _LIGHTS)]
    return [*found, *energy.tasks(quick)[:1], Task(refused)]


# The section.


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """One table of criteria, and the drawing of cycles a pixel."""
    of: dict[Any, list[tuple[Mapping[str, Any], Any]]] = {}
    for task, result in zip(tasks, results, strict=True):
        of.setdefault(task.function, []).append((task.settings, result))
    deviation = {
        settings["method"]: result["modelled"] / result["simulated"] - 1 for settings, result in of[simulated]
    }
    exact = [method for method, share in deviation.items() if share == 0]
    worst = max(deviation, key=lambda method: abs(deviation[method]))
    frames = [(settings["triangles"], tuple(settings["size"]), result) for settings, result in of[frame]]
    small = [entry for entry in frames if entry[1] == SIZES[0]]
    text = [
        f"What [T] 1.3 asks of a shading method, for the default pipeline (`{METHOD}`, `{MODEL}`), "
        "measured: frames a "
        "second and latency, resources, how they grow, energy, and what it does with bad input.",
        f"Cycles are those of the cycle model. Of a simulated frame of 992 triangles at 160x120 it gives "
        f"the cycles "
        f"exactly for {len(exact)} of {len(deviation)} methods; the largest deviation is that of `{worst}`, "
        f"{deviation[worst]:+.1%}"
        + (f", that of `{METHOD}` {deviation[METHOD]:+.1%}." if METHOD in deviation else "."),
    ]
    parts = [_criteria(frames, of), _drawing(small), _by_triangles(frames), _deviations(of[simulated])]
    return Section("criteria", "The documents' criteria", text, parts)


def _criteria(frames: Sequence[tuple], of: Mapping[Any, list]) -> Table:
    entry = placed(DEVICE).get((METHOD, MODEL))
    rate, origin = (entry["fmax_median_mhz"], f"placed {entry['date']}") if entry else (100.0, "assumed")
    rows: list[list[Cell]] = []
    for _, (width, height), result in frames:
        seconds = result[METHOD]["cycles"] / (rate * 1e6)
        scene = f"teapot, {result['triangles']:,} triangles, {width}x{height}"
        condition = f"at {rate:.0f} MHz ({origin}); geometry and frame buffer keep up"
        rows.append(["frames a second", scene, 1 / seconds, "frames/s", condition])
        condition = "first write of a constant to last pixel"
        rows.append(["latency of a frame", scene, 1e3 * seconds, "ms", condition])
    latency = frames[0][2][METHOD]["latency"]
    condition = f"{latency / rate:.2f} µs at {rate:.0f} MHz"
    rows.append(["latency of a pixel", "any", latency, "cycles", condition])
    if entry:
        condition = f"{origin}, one light, out of context"
        parts = ("luts", "LUT"), ("flip_flops", "flip-flops"), ("multipliers", "18x18 bits")
        rows += [["use of resources", entry["device"], entry[part], unit, condition] for part, unit in parts]
    return Table(
        "criteria",
        "The criteria, one by one",
        ("criterion", "of what", "figure", "unit", "condition"),
        [*rows, *_scaling(frames, of), *_energy(frames, of), *_refusals(of)],
    )


def _scaling(frames: Sequence[tuple], of: Mapping[Any, list]) -> Iterator[list[Cell]]:
    ones = next(result for settings, result in of[resources] if settings["lights"] == 1)
    for settings, result in of[resources]:
        bits = result["register_bits"] / ones["register_bits"]
        note = f"register bits {bits:.2f} times; cycles the same"
        yield ["scaling with lights", settings["lights"], result["multipliers"], "multipliers", note]
    same = [result[METHOD] for _, _, result in frames if result["triangles"] == frames[0][2]["triangles"]]
    grows = (same[-1]["cycles"] / same[0]["cycles"]) / (same[-1]["pixels"] / same[0]["pixels"])
    yield ["scaling with pixels", "640x480 to 1920x1080", grows, "cycles over pixels", "1: proportional"]
    of_size = [result for _, size, result in frames if size == SIZES[0]]
    first, last = (
        result[METHOD]["cycles"] / result[METHOD]["pixels"] for result in (of_size[0], of_size[-1])
    )
    scene = f"{of_size[0]['triangles']:,} to {of_size[-1]['triangles']:,} at 640x480"
    yield ["scaling with triangles", scene, last / first, "times the cycles a pixel", "see the drawing"]
    where = "section *More than one pixel a cycle*"
    yield ["scaling with pipelines", f"up to {max(PIPES)}", None, "", where]


def _energy(frames: Sequence[tuple], of: Mapping[Any, list]) -> Iterator[list[Cell]]:
    pixels = next(result[METHOD]["pixels"] for _, size, result in frames if size == SIZES[0])
    for settings, result in of[energy.measure]:
        toggles = sum(result[0]["toggles"].values()) / result[0]["pixels"]
        scene = f"{settings['model']}, exponent {settings['exponents'][0]}"
        yield [
            "energy proxy of a pixel",
            scene,
            toggles,
            "register bits that toggle",
            "section *Energy proxy*",
        ]
        total = pixels * toggles / 1e6
        yield ["energy proxy of a frame", "640x480", total, "million register bits that toggle", ""]


def _refusals(of: Mapping[Any, list]) -> Iterator[list[Cell]]:
    [(_, refusals)] = of[refused]
    for each in refusals:
        clean = each["status"] == 2 and each["lines"] == 1 and not each["traceback"]
        answer = "one line, no file" if clean else f"{each['lines']} lines"
        yield ["bad input", each["what"], each["status"], "exit status", answer]
    what = "spans out of range, empty, past the edge"
    yield ["bad input", what, None, "", "counted in `status`; the pipeline goes on"]


def _by_triangles(frames: Sequence[tuple]) -> Table:
    columns = ["triangles", "picture", "method", "cycles a pixel", "cycles", "pixels", "spans"]
    columns += ["spans before cutting"]
    rows = [
        [
            *(result["triangles"], f"{width}x{height}", method, found["cycles"] / found["pixels"]),
            *(found["cycles"], found["pixels"], found["spans"], found["uncut_spans"]),
        ]
        for _, (width, height), result in frames
        for method, found in result.items()
        if method != "triangles"
    ]
    return Table("criteria-triangles", "Cycles by number of triangles", columns, rows, "By the cycle model.")


def _deviations(found: Sequence[tuple]) -> Table:
    rows = []
    for settings, result in found:
        counts = result["simulated"], result["modelled"]
        rows.append((settings["method"], *counts, counts[1] / counts[0] - 1))
    columns = ("method", "cycles, simulated", "cycles, model", "deviation, share")
    note = "Teapot of 992 triangles at 160x120."
    return Table("criteria-simulated", "The cycle model beside simulation", columns, rows, note)


def _drawing(frames: Sequence[tuple]) -> Drawing:
    figure, (axes,) = panels(9.2, 4.0)
    counts = [result["triangles"] for _, _, result in frames]
    labels, points = [], []
    for method in METHODS:
        each = [result[method]["cycles"] / result[method]["pixels"] for _, _, result in frames]
        style = style_of(method)
        axes.plot(counts, each, color=style.color, linestyle=style.dash, marker=style.marker, markersize=4.5)
        labels.append(Label(counts[-1], each[-1], method, style.color))
        # Labels keep clear of the lines, too.
        logs = np.log(counts), np.log(each)
        along = np.linspace(logs[0][0], logs[0][-1], 120)
        points += [*zip(np.exp(along), np.exp(np.interp(along, *logs)), strict=True)]
    axes.set(xscale="log", yscale="log", xlabel="triangles of the teapot at 640x480", ylabel="cycles a pixel")
    axes.set_xlim(counts[0] * 0.7, counts[-1] * 8)
    axes.set_xticks(counts, [f"{count:,}" for count in counts], minor=False)
    axes.set_xticks((), minor=True)
    axes.set_yticks((1, 2, 5, 10, 20, 50), ("1", "2", "5", "10", "20", "50"), minor=False)
    axes.set_yticks((), minor=True)
    # Where lines lie together, not all have room.
    labels.sort(key=lambda label: label.text != METHOD)
    place_labels(axes, labels, points)
    size = sum(result[METHOD]["pixels"] for _, _, result in frames) // len(frames)
    note = (
        f"One light, exponent {EXPONENT}, about {size:,} pixels shaded. Small triangles have short spans: "
        f"what is done "
        "once a span then weighs more than the pixels. A span of `quotient` takes three cycles at least, "
        "but of one pixel one."
    )
    return Drawing("criteria-triangles", "Cycles a pixel against the number of triangles", svg(figure), note)
