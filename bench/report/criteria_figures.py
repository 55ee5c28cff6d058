"""Figures of the documents' criteria: frames by the cycle model, resources, bad input."""

import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import lru_cache
from typing import Any

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.speed import cycle_model
from blysk.golden.frames.cut import cut_spans
from blysk.golden.frames.prepare import constants_of, spans_for
from blysk.golden.presets import preset
from blysk.golden.reference.raster import Raster, rasterise
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.sim.cli.main import main
from blysk.sim.meshes.teapot import teapot

__all__ = ["BAD_INPUT", "EXPONENT", "METHOD", "MODEL", "frame", "refused", "resources", "simulated"]

METHOD, MODEL = "quotient", "blinn"
"""The default pipeline."""

EXPONENT = 50

BAD_INPUT = (
    ("a file that is not there", ("render", "none.obj")),
    ("an unknown method", ("render", "teapot", "--method", "nothing")),
    ("an exponent out of range", ("render", "teapot", "--exponent", "0")),
    ("a picture without pixels", ("render", "teapot", "--size", "0x0")),
    ("a place that cannot be written", ("render", "teapot", "-o", "no/such/folder/a.png")),
)
"""Bad inputs: a description, and the command line."""


@lru_cache(maxsize=1)
def _rastered(triangles: int, width: int, height: int) -> tuple[Scene, Raster]:
    scene = scene_for(teapot(triangles), EXPONENT, width, height)
    return scene, rasterise(scene)


def frame(triangles: int, size: Sequence[int], methods: Sequence[str]) -> dict[str, Any]:
    """Cycles of a frame by the cycle model, for some methods.

    Parameters
    ----------
    triangles : int
        Number of triangles of the teapot, about.
    size : sequence of int
        Width and height.
    methods : sequence of str
        Some of `METHODS`.

    Returns
    -------
    dict
        ``triangles``, their exact number, and for each method ``cycles``, ``pixels``, ``spans`` after
        cutting, ``uncut_spans`` and ``latency``.
    """
    scene, raster = _rastered(triangles, *size)
    found: dict[str, Any] = {"triangles": len(scene.mesh.faces)}
    for method in methods:
        design = preset(method, MODEL)
        unit = cycle_model.unit_of(design)
        cut, _ = cut_spans(scene, raster, design)
        writes = sum(len(of.writes()["data"]) for of in constants_of(scene, design))
        found[method] = {
            "cycles": cycle_model.frame_cycles(unit, spans_for(scene, cut, design), writes),
            "pixels": int(np.sum(cut.length)),
            "spans": len(cut.length),
            "uncut_spans": len(raster.length),
            "latency": unit.latency,
        }
    return found


def simulated(method: str) -> dict[str, int]:
    """Cycles of a simulated frame of ``method`` with `model_of` it, and those of the cycle model."""
    simulated, modelled = cycle_model.compare(preset(method, model_of(method)), 992, (160, 120))
    return {"simulated": simulated, "modelled": modelled}


def resources(lights: int) -> dict[str, int]:
    """Resources of the default pipeline with a number of lights, before synthesis; see `Cost.totals`."""
    return cost_of(cycle_model.unit_of(preset(METHOD, MODEL, lights=lights))).totals


def refused() -> list[dict[str, Any]]:
    """Response of the command line to each of `BAD_INPUT`: ``what``, ``status``, ``lines``, ``traceback``."""
    found = []
    for what, arguments in BAD_INPUT:
        said = io.StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            try:
                status = main(list(arguments))
            except SystemExit as error:
                status = error.code
        lines = said.getvalue().strip().split("\n")
        of = {"what": what, "command": " ".join(("blysk", *arguments)), "status": status}
        found.append(
            of | {"lines": len(lines), "says": lines[-1], "traceback": "Traceback" in said.getvalue()}
        )
    return found
