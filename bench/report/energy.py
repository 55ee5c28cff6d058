"""The report's section on switching: register bits that toggle for a pixel, without and with a gate.

Toggled bits stand for energy, because CMOS takes most energy when bits change. `toggles` says which bits are
counted.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.report.section import Cell, Drawing, Grade, Section, Table
from blysk.bench.store import Task
from blysk.bench.svg import svg
from blysk.golden.frames.prepare import prepare
from blysk.golden.pipeline import Pixels
from blysk.golden.presets import METHODS as ALL_METHODS
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.engines.toggles import ToggleCounter
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.teapot import teapot

__all__ = [
    "BLOCKS",
    "DESIGN",
    "EXPONENTS",
    "METHOD",
    "METHODS",
    "MODELS",
    "by_block",
    "measure",
    "same_pixels",
    "section",
    "tasks",
]

METHODS = tuple(name for name, of in ALL_METHODS.items() if of.serves_gate and of.ORIGIN != "own")
"""Methods that serve the gate: ``linear`` and the methods of the documents."""

METHOD = "quadratic"
"""Method of `METHODS` that is measured with every model."""

MODELS = ("cosquad", "coscos4", "blinn_product")
EXPONENTS = (2, 50, 1000)

BLOCKS: dict[str, tuple[str, ...]] = {
    "frame constants": ("frame_constants", "slope", "tables"),
    "admission": ("top", "coordinates"),
    "setup of spans": ("interpolator",),
    "highlight gate": ("highlight_gate", "decisions", "lengths", "undecided"),
    "cosines of pixels": (
        *("interpolator.quotient", "interpolator.difference_accumulator", "interpolator.evaluator"),
        *("interpolator.cosine_direction_0", "interpolator.cosine_halfway_0", "interpolator.recurrence_0"),
        "interpolator.products",
    ),
    "diffuse": ("light_0.diffuse",),
    "specular": ("light_0.specular",),
    "intensity": ("intensity",),
    "assembler": ("shaded", "pixel_assembler"),
}
"""Submodules of the pipeline by block, in the order of the stream.

A submodule inside another submodule counts for its own block. The sums of ``quotient`` and the normals of
``bisection`` are in the setup of spans.
"""

DESIGN = ("quotient", "blinn")
"""Method and model of the default pipeline, which has no gate."""
_FULL, _QUICK = (320, 240, 10_000), (48, 36, 64)
_COLORS = (
    *("#9aa0a6", "#5f6368", "#d62728", "#1f77b4"),
    *("#17a2a2", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#000000"),
)


def by_block(toggles: dict[str, int]) -> dict[str, int]:
    """Toggles of each of `BLOCKS`, and of ``others`` if there are other submodules.

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


def same_pixels(run: Run, expected: Pixels) -> bool:
    """Whether a run's pixels are as expected, in order: coordinates, colour, mark of a span's end."""
    fields = {name: getattr(expected, name) for name in ("x", "y", "last")}
    fields |= {name: expected.color[:, channel] for channel, name in enumerate("rgb")}
    return all(np.array_equal(run.beats[name], codes) for name, codes in fields.items())


def measure(
    method: str, model: str, gate: bool, exponents: Sequence[int], size: Sequence[int], engine: str
) -> list[dict[str, Any]]:
    """Toggles of a pipeline, one pixel a cycle, in a frame of the teapot.

    Parameters
    ----------
    method, model : str
        Method and reflection model.
    gate : bool
        Whether the pipeline has a highlight gate.
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
        the pixels equal the pixels of the bit-accurate model.
    """
    design = preset(method, model, gate=gate)
    counter = ToggleCounter(ShadingPipelineUnit(design))
    width, height, triangles = size
    mesh = teapot(triangles)
    results = []
    for exponent in exponents:
        scene = scene_for(mesh, exponent, width, height)
        prepared = prepare(scene, design)
        spans, (constants,) = prepared.spans, prepared.constants
        beats, pixels = beats_of(counter, spans), int(np.sum(spans.length))
        run = simulate(counter, beats, count=pixels, write=constants.writes(), engine=engine)
        results.append(
            {
                "spans": len(spans),
                "pixels": pixels,
                "cycles": run.total_cycles,
                "toggles": {path: int(run.status[path]) for path in run.status.dtype.names},
                "same": same_pixels(run, design.compute(spans, constants)),
            }
        )
    return results


def tasks(quick: bool) -> list[Task]:
    """Measurements of `DESIGN`, then without and with the gate of each model and each method.

    A quick report has one model and method, in Amaranth's own simulator.
    """
    exponents = EXPONENTS[1:2] if quick else EXPONENTS
    common = {"exponents": list(exponents), "size": list(_QUICK if quick else _FULL)}
    common["engine"] = "pysim" if quick else "auto"
    pairs = [(METHOD, model) for model in MODELS]
    pairs += [(method, MODELS[0]) for method in METHODS if method != METHOD]
    pairs = pairs[:1] if quick else pairs
    designs = [(*DESIGN, False), *((*pair, gate) for pair in pairs for gate in (False, True))]
    names = ("method", "model", "gate")
    return [Task(measure, dict(zip(names, design, strict=True)) | common) for design in designs]


def section(tasks: Sequence[Task], results: Sequence[Any]) -> Section:
    """The section: toggles a pixel by block."""
    found: dict[tuple[str, str, int], dict[bool, dict]] = {}
    for task, result in zip(tasks, results, strict=True):
        for exponent, frame in zip(task.settings["exponents"], result, strict=True):
            key = (task.settings["method"], task.settings["model"], exponent)
            found.setdefault(key, {})[task.settings["gate"]] = frame
    all_frames = [frame for of in found.values() for frame in of.values()]
    blocks = list(dict.fromkeys(block for frame in all_frames for block in by_block(frame["toggles"])))
    saved = {key: 1 - _total(of[True]) / _total(of[False]) for key, of in found.items() if True in of}
    best, worst = max(saved, key=saved.get), min(saved, key=saved.get)
    width, height, _ = tasks[0].settings["size"]
    (method, model, exponent), pair = next(iter(found.items()))
    (rival, other, _), gated = next(of for of in found.items() if True in of[1] and of[0][2] == exponent)
    shares = {block: _a_pixel(pair[False], block) / _total(pair[False]) for block in blocks}
    largest = max(shares, key=shares.get)
    text = [
        "This section counts the register bits that change while a pixel is shaded, block by block. The "
        f"counts come from simulation: the teapot at {width}x{height}, one light, one pixel a cycle.",
        f"The default pipeline, `{method}` with `{model}`, switches {_total(pair[False]):.0f} bits a pixel "
        f"at exponent {exponent}. `{rival}` with `{other}` switches {_total(gated[False]):.0f}. The block "
        f"*{largest}* has the largest share of the default pipeline: {shares[largest]:.0%}. Work done once "
        "a span counts more when spans are short. These spans have "
        f"{pair[False]['pixels'] / pair[False]['spans']:.1f} pixels on average.",
        "Methods of unit normals can have a highlight gate. The gate stops the specular unit in spans "
        "without a highlight. The gate's own registers switch once a span. With the gate the count of the "
        "whole pipeline changes by "
        f"{' to '.join(dict.fromkeys(_change(key, saved) for key in (best, worst)))}.",
        "**Not counted**: bits inside multipliers and other logic between two registers, glitches, wires, "
        "the clock tree, and bits inside memories. The count compares designs. The count is not an energy in "
        "joules.",
    ]
    if not all(frame["same"] for frame in all_frames):
        text.append("**The pixels of a simulation differ from the model's. These figures are void.**")
    parts = [_table(found, saved, blocks), _drawing(found, blocks)]
    return Section("energy", "Energy proxy: register bits that switch", text, parts)


def _change(key: tuple[str, str, int], saved: dict) -> str:
    return f"{0 - saved[key]:+.1%} (`{key[0]}`, `{key[1]}`, exponent {key[2]})"


def _total(frame: dict) -> float:
    return sum(frame["toggles"].values()) / frame["pixels"]


def _a_pixel(frame: dict, block: str) -> float:
    return by_block(frame["toggles"]).get(block, 0) / frame["pixels"]


def _table(found: dict, saved: dict, blocks: Sequence[str]) -> Table:
    columns = ["method", "model", "exponent", "gate", "spans", "pixels", "cycles"]
    columns += [*(f"{block}, bits a pixel" for block in blocks), "pipeline, bits a pixel", "saved, share"]
    rows: list[list[Cell]] = []
    grades: list[list[Grade]] = []
    for key, of in found.items():
        for gate, frame in of.items():
            row: list[Cell] = [*key, "on" if gate else "off"]
            row += [frame[name] for name in ("spans", "pixels", "cycles")]
            row += [*(_a_pixel(frame, block) for block in blocks), _total(frame)]
            rows.append([*row, saved[key] if gate else None])
            grade: Grade = ("good" if saved[key] > 0 else "fair") if gate else ""
            grades.append([""] * (len(columns) - 1) + [grade])
    note = (
        "Toggled register bits, divided by the shaded pixels, hidden pixels included. Green: the gate saves "
        "more bits than it toggles. Yellow: the gate toggles more bits than it saves."
    )
    return Table("energy", "Register bits that toggle for a pixel", columns, rows, note, grades)


def _drawing(found: dict, blocks: Sequence[str]) -> Drawing:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.6, 0.36 * sum(map(len, found.values())) + 1.9), layout="constrained")
    axes = figure.subplots()
    bars = [
        (f"{method}, {model}, n = {exponent}" + f", gate {'on' if gate else 'off'}" * (len(of) > 1), frame)
        for (method, model, exponent), of in found.items()
        for gate, frame in of.items()
    ]
    # The two bars of a frame stand together.
    group = np.repeat(np.arange(len(found)), [len(of) for of in found.values()])
    place = np.arange(len(bars)) + group * 0.5
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
    note = (
        "From left to right: blocks in the order in which a span passes through them. The block *setup of "
        "spans* includes the sums of `quotient` and the normals of `bisection`."
    )
    return Drawing("energy-blocks", "Register bits that toggle for a pixel, by block", svg(figure), note)
