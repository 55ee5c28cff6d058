"""The report's section on switching: toggled register bits a pixel of a frame, without and with the gate.

They are a proxy of energy: CMOS takes most energy when bits change. `toggles` says which bits are counted.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.gate import MODELS, frames, same_pixels
from blysk.bench.report.section import Cell, Drawing, Grade, Section, Table
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.toggles import ToggleCounter
from blysk.sim.meshes.teapot import teapot

__all__ = ["BLOCKS", "EXPONENTS", "by_block", "measure", "section", "tasks"]

EXPONENTS = (2, 50, 1000)

BLOCKS: dict[str, tuple[str, ...]] = {
    "frame constants": ("frame_constants", "slope"),
    "admission": ("top", "coordinates"),
    "setup of spans": ("interpolator",),
    "highlight gate": ("interpolator.chord_spans.value_gate", "interpolator.chord_spans.decisions"),
    "sums of pixels": ("interpolator.chord_spans.chord_accumulator",),
    "diffuse": ("light_0.diffuse",),
    "specular": ("light_0.specular",),
    "intensity": ("intensity",),
    "assembler": ("shaded", "pixel_assembler"),
}
"""Submodules of the pipeline by block, in the stream's order; an inner one counts for its own block."""

_FULL, _QUICK = (320, 240, 10_000), (48, 36, 64)
_COLORS = (
    *("#9aa0a6", "#5f6368", "#d62728", "#1f77b4", "#6baed6"),
    *("#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#000000"),
)


def by_block(toggles: dict[str, int]) -> dict[str, int]:
    """Toggles of each of `BLOCKS`, and of ``others``, if there are any.

    Parameters
    ----------
    toggles : dict
        Toggles by path, as `ToggleCounter` counts them.
    """
    owner = {name: block for block, names in BLOCKS.items() for name in names}
    totals = dict.fromkeys(BLOCKS, 0)
    for path, count in toggles.items():
        parts = path.split(".")
        above = (".".join(parts[:depth]) for depth in range(len(parts), 0, -1))
        block = next((owner[name] for name in above if name in owner), "others")
        totals[block] = totals.get(block, 0) + count
    return totals


def measure(
    model: str, gate: bool, exponents: Sequence[int], size: Sequence[int], engine: str
) -> list[dict[str, Any]]:
    """Toggles of a pipeline of the chord method, one pixel a cycle, in a frame of the teapot.

    Parameters
    ----------
    model : str
        Reflection model.
    gate : bool
        Whether it has a highlight gate.
    exponents : sequence of int
        Exponents, with a frame for each.
    size : sequence of int
        Width, height and triangles.
    engine : str
        As `simulate` takes it.

    Returns
    -------
    list of dict
        For each exponent ``spans``, ``pixels``, ``cycles``, ``toggles`` by submodule, and ``same``: whether
        the pixels are those of the bit-accurate model.
    """
    design = preset("chord", model, gate=gate)
    counter = ToggleCounter(ShadingPipelineUnit(design))
    width, height, triangles = size
    mesh = teapot(triangles)
    results = []
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        spans, constants = prepare(scene, design).spans, FrameConstants.of(scene)
        [run] = frames([counter], spans, constants, engine)
        results.append(
            {
                "spans": len(spans),
                "pixels": int(np.sum(spans.length)),
                "cycles": run.total_cycles,
                "toggles": {path: int(run.status[path]) for path in run.status.dtype.names},
                "same": same_pixels(run, design.compute(spans, constants)),
            }
        )
    return results


def tasks(quick: bool) -> list[Task]:
    """Measurements of each model without and with the gate; quick ones in Amaranth's own simulator."""
    exponents = EXPONENTS[1:2] if quick else EXPONENTS
    common = {"exponents": list(exponents), "size": list(_QUICK if quick else _FULL)}
    common["engine"] = "pysim" if quick else "auto"
    pairs = [(model, gate) for model in (MODELS[:1] if quick else MODELS) for gate in (False, True)]
    return [Task(measure, {"model": model, "gate": gate} | common) for model, gate in pairs]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: toggles a pixel by block."""
    found: dict[tuple[str, int], dict[bool, dict]] = {}
    for task, result in zip(tasks, results, strict=True):
        for exponent, frame in zip(task.settings["exponents"], result, strict=True):
            found.setdefault((task.settings["model"], exponent), {})[task.settings["gate"]] = frame
    all_frames = [frame for of in found.values() for frame in of.values()]
    blocks = list(dict.fromkeys(block for frame in all_frames for block in by_block(frame["toggles"])))
    saved = {key: 1 - _total(of[True]) / _total(of[False]) for key, of in found.items()}
    best, worst = max(saved, key=saved.get), min(saved, key=saved.get)
    width, height, _ = tasks[0].settings["size"]
    (model, exponent), pair = next(iter(found.items()))
    shares = {block: _a_pixel(pair[False], block) / _total(pair[False]) for block in blocks}
    largest = max(shares, key=shares.get)
    text = [
        f"Register bits that change, on the teapot at {width}x{height} in one light, by the chord method, "
        "one pixel a cycle: what a pixel costs in switching, block by block, from simulation. A highlight "
        "gate makes the specular unit stand still in spans without a highlight, and itself switches once a "
        "span.",
        f"Most is in the block *{largest}*: {shares[largest]:.0%} of all with `{model}` at exponent "
        f"{exponent}, gate off. With the gate the whole pipeline's count changes by "
        f"{' to '.join(dict.fromkeys(_change(key, saved) for key in (best, worst)))}. What is done once a "
        "span weighs more, the shorter spans are: these have "
        f"{pair[False]['pixels'] / pair[False]['spans']:.1f} pixels.",
        "**Not counted**: bits inside multipliers and other logic between two registers, glitches, wires, "
        "the clock's own tree, and the bits inside memories. It compares designs; it is no number of joules.",
    ]
    if not all(frame["same"] for frame in all_frames):
        text.append("**The pixels of a simulation are not the model's: these figures are void.**")
    parts = [_table(found, saved, blocks), _drawing(found, blocks)]
    return Section("energy", "Energy proxy: register bits that switch", text, parts)


def _change(key: tuple[str, int], saved: dict) -> str:
    return f"{0 - saved[key]:+.1%} (`{key[0]}`, exponent {key[1]})"


def _total(frame: dict) -> float:
    return sum(frame["toggles"].values()) / frame["pixels"]


def _a_pixel(frame: dict, block: str) -> float:
    return by_block(frame["toggles"]).get(block, 0) / frame["pixels"]


def _table(found: dict, saved: dict, blocks: Sequence[str]) -> Table:
    columns = ["model", "exponent", "gate", "spans", "pixels", "cycles"]
    columns += [*(f"{block}, bits a pixel" for block in blocks), "pipeline, bits a pixel", "saved, share"]
    rows: list[list[Cell]] = []
    grades: list[list[Grade]] = []
    for (model, exponent), of in found.items():
        for gate, frame in of.items():
            row: list[Cell] = [model, exponent, "on" if gate else "off"]
            row += [frame[name] for name in ("spans", "pixels", "cycles")]
            row += [*(_a_pixel(frame, block) for block in blocks), _total(frame)]
            rows.append([*row, saved[model, exponent] if gate else None])
            grade: Grade = ("good" if saved[model, exponent] > 0 else "fair") if gate else ""
            grades.append([""] * (len(columns) - 1) + [grade])
    note = (
        "Toggled register bits over pixels shaded, hidden ones too. Green: the gate saves more than it "
        "takes; yellow: it takes more."
    )
    return Table("energy", "Register bits that toggle, a pixel", columns, rows, note, grades)


def _drawing(found: dict, blocks: Sequence[str]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 0.62 * len(found) + 1.9), layout="constrained")
    axes = figure.subplots()
    bars = [
        (f"{model}, n = {exponent}, gate {'on' if gate else 'off'}", frame)
        for (model, exponent), of in found.items()
        for gate, frame in of.items()
    ]
    # The two of a frame stand together.
    place = np.arange(len(bars)) + np.arange(len(bars)) // 2 * 0.5
    start = np.zeros(len(bars))
    for block, color in zip(blocks, _COLORS, strict=False):
        counts = np.array([_a_pixel(frame, block) for _, frame in bars])
        axes.barh(place, counts, 0.9, left=start, color=color, label=block, edgecolor="white", linewidth=0.4)
        start += counts
    axes.set(yticks=place, yticklabels=[label for label, _ in bars], xlabel="toggled register bits a pixel")
    axes.margins(y=0.02)
    axes.invert_yaxis()
    axes.grid(True, axis="x", color="#dddddd", linewidth=0.5)
    axes.set_axisbelow(True)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4, frameon=False)
    note = "Blocks in the order in which a span passes them, from left to right."
    return Drawing("energy-blocks", "Register bits that toggle a pixel, by block", svg(figure), note)
