"""Criteria of [T] 1.3 for a shading method, measured on the default pipeline: speed, resources, bad input."""

import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import lru_cache, partial
from typing import Any

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.report.claims import Claim, ClaimTable, Document
from blysk.bench.report.placed import placed
from blysk.bench.speed import cycle_model
from blysk.bench.tools.families import DEVICE
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.prepare import constants_of, spans_for
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.sim.cli.main import main
from blysk.sim.meshes.teapot import teapot

__all__ = ["BAD_INPUT", "claims", "frame", "refused", "resources", "section", "simulated", "tasks", "use"]

_METHOD, _MODEL, _EXPONENT = "quotient", "blinn", 50

_SIZES = (640, 480), (1920, 1080)

_TRIANGLES = (100, 1000, 10_000, 100_000, 1_000_000)

BAD_INPUT = {
    "a missing file": ("render", "none.obj"),
    "an unknown method": ("render", "teapot", "--method", "nothing"),
    "an exponent out of range": ("render", "teapot", "--exponent", "0"),
    "a picture without pixels": ("render", "teapot", "--size", "0x0"),
    "an output path in a missing folder": ("render", "teapot", "-o", "no/such/folder/a.png"),
}
"""Command lines with bad input, by the kind of fault."""


@lru_cache(maxsize=1)
def _rastered(triangles: int, width: int, height: int) -> tuple[Scene, Raster]:
    scene = scene_for(teapot(triangles), _EXPONENT, width, height)
    return scene, rasterise(scene)


def frame(triangles: int, size: Sequence[int], method: str, mhz: float) -> dict[str, float]:
    """A frame of the teapot by the cycle model.

    Parameters
    ----------
    triangles : int
        Approximate number of triangles.
    size : sequence of int
        Width and height.
    method : str
        One of `METHODS`.
    mhz : float
        Clock rate.

    Returns
    -------
    dict
        - ``cycles``, ``pixels`` and ``cycles_a_pixel`` of the frame;
        - ``spans``: number of spans after cutting, and ``uncut_spans``: number before cutting;
        - ``latency``: cycles from a span to its first pixel;
        - ``frames_a_second``, and ``milliseconds`` of a frame.
    """
    scene, raster = _rastered(triangles, *size)
    design = preset(method, _MODEL)
    unit = cycle_model.unit_of(design)
    cut, _ = cut_spans(scene, raster, design)
    writes = sum(len(of.writes()["data"]) for of in constants_of(scene, design))
    cycles, pixels = (
        cycle_model.frame_cycles(unit, spans_for(scene, cut, design), writes),
        int(np.sum(cut.length)),
    )
    return {
        "cycles": cycles,
        "pixels": pixels,
        "cycles_a_pixel": cycles / pixels,
        "spans": len(cut.length),
        "uncut_spans": len(raster.length),
        "latency": unit.latency,
        "frames_a_second": mhz * 1e6 / cycles,
        "milliseconds": cycles / mhz / 1e3,
    }


def simulated(method: str) -> dict[str, float]:
    """Cycles of a frame, ``simulated`` and ``modelled`` (by the cycle model), and their ``ratio``.

    `model_of` chooses the reflection model of the method.
    """
    simulated, modelled = cycle_model.compare(preset(method, model_of(method)), 992, (160, 120))
    return {"simulated": simulated, "modelled": modelled, "ratio": modelled / simulated}


def resources(lights: int) -> dict[str, int]:
    """Resources of the default pipeline with a number of lights, before synthesis; see `Cost.totals`."""
    return cost_of(cycle_model.unit_of(preset(_METHOD, _MODEL, lights=lights))).totals


def use(date: str) -> dict[str, int]:
    """Resources of the default pipeline, from its committed placement of this date; see `placed`."""
    entry = placed(DEVICE)[_METHOD, _MODEL]
    if entry["date"] != date:
        raise ValueError(f"the committed placement is of {entry['date']}, not of {date}")
    return {part: entry[part] for part in ("luts", "flip_flops", "multipliers")}


def refused(command: Sequence[str]) -> dict[str, Any]:
    """Response of the command line to a command.

    ``status`` is the exit status, ``lines`` the number of lines, and ``says`` the last line. ``traceback``
    is true if a traceback was printed.
    """
    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            status = main(list(command))
        except SystemExit as error:
            status = error.code
    lines = said.getvalue().strip().split("\n")
    return {
        "status": status,
        "lines": len(lines),
        "says": lines[-1],
        "traceback": "Traceback" in said.getvalue(),
    }


_claim = partial(Claim, "[T] 1.3")


def _entry() -> tuple[float, str]:
    """Clock rate and its date."""
    entry = placed(DEVICE)[_METHOD, _MODEL]
    return entry["fmax_median_mhz"], entry["date"]


def _frame(triangles: int, size: Sequence[int], method: str) -> dict[str, Any]:
    return {"triangles": triangles, "size": list(size), "method": method, "mhz": _entry()[0]}


def _criteria(quick: bool) -> list[Claim]:
    found = []
    for size in _SIZES:
        # Spans are shortest at the first size. A quick report has most triangles at this size only.
        for triangles in _TRIANGLES[: -1 if quick and size != _SIZES[0] else None]:
            settings = _frame(triangles, size, _METHOD)
            scene = f"teapot of {triangles:,} triangles at {size[0]}x{size[1]}"
            found += [
                _claim("speed", f"{scene}, frames a second", frame, settings, "frames_a_second"),
                _claim("latency of a frame", f"{scene}, ms", frame, settings, "milliseconds"),
            ]
    settings = _frame(_TRIANGLES[0], _SIZES[0], _METHOD)
    found.append(_claim("latency of a pixel", "latency, cycles", frame, settings, "latency"))
    parts = {"luts": "look-up tables", "flip_flops": "flip-flops", "multipliers": "multipliers of 18x18 bits"}
    for part, words in parts.items():
        found.append(_claim("use of resources", f"{words} on {DEVICE}", use, {"date": _entry()[1]}, part))
    for lights in (1, 2) if quick else (1, 2, 4, 8):
        for part in ("multipliers", "register_bits"):
            words = f"{part.replace('_', ' ')} before synthesis, lights: {lights}"
            found.append(_claim("scaling with lights", words, resources, {"lights": lights}, part))
    return found


def _cycles(quick: bool) -> list[Claim]:
    # `_rastered` keeps one scene. All methods of a scene come together, so a process draws no scene twice.
    scenes = [(_SIZES[0], triangles, method) for triangles in _TRIANGLES for method in METHODS]
    scenes += [(_SIZES[1], triangles, _METHOD) for triangles in _TRIANGLES[: -1 if quick else None]]
    return [
        _claim(
            "scaling with triangles and pixels",
            f"cycles a pixel, {method}, {triangles:,} triangles at {size[0]}x{size[1]}",
            frame,
            _frame(triangles, size, method),
            "cycles_a_pixel",
        )
        for size, triangles, method in scenes
    ]


def _simulated(quick: bool) -> list[Claim]:
    return [
        _claim(
            "",
            f"cycles of the model divided by simulated cycles, {method}",
            simulated,
            {"method": method},
            "ratio",
        )
        for method in METHODS
    ]


def _refused(quick: bool) -> list[Claim]:
    return [
        _claim("bad input", f"exit status: {what}", refused, {"command": list(command)}, "status")
        for what, command in BAD_INPUT.items()
    ]


def claims(quick: bool) -> list[Claim]:
    """All criteria. If quick, they have no million triangles at 1920x1080 and at most two lights."""
    return [claim for table in _DOCUMENT.tables for claim in table.claims(quick)]


_DOCUMENT = Document(
    "criteria",
    "The documents' criteria",
    [
        "[T] 1.3 lists criteria of a shading method. This section answers them for the default pipeline: "
        f"`{_METHOD}` with `{_MODEL}`, one light and exponent {_EXPONENT}. The section *Energy proxy* "
        "treats energy.",
        "The cycle model gives the cycles, from the first write of a constant to the last pixel. A table "
        "compares the model with simulation. Place and route on one device, out of context, gives the "
        "clock rate. We assume that geometry and frame buffer keep up. The pipeline counts in `status` the "
        "spans that are out of range, empty or past the edge, and goes on.",
    ],
    [
        ClaimTable("criteria", "Answers to the criteria", _criteria),
        ClaimTable(
            "criteria-triangles",
            "Cycles by number of triangles",
            _cycles,
            "Small triangles have short spans. Work that is done once a span then takes more cycles than "
            "the pixels. With `quotient` a span of one pixel takes one cycle. A longer span takes at least "
            "three cycles.",
            {"cycles": "cycles", "pixels": "pixels", "spans": "spans", "spans before cutting": "uncut_spans"},
        ),
        ClaimTable(
            "criteria-simulated",
            "The cycle model compared with simulation",
            _simulated,
            "Teapot of 992 triangles at 160x120.",
            {"cycles, simulated": "simulated", "cycles, model": "modelled"},
        ),
        ClaimTable(
            "criteria-bad-input",
            "Bad input",
            _refused,
            "A refused command line writes no file.",
            {"lines": "lines", "answer": "says"},
        ),
    ],
    appendix=False,
)

tasks, section = _DOCUMENT.tasks, _DOCUMENT.section
