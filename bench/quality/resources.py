"""Resources of each unit and pipeline, and cycles of a fixed set of frames: the entries of the baselines."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from blysk.bench.accuracy import model_of, scene_for
from blysk.bench.tools.blocks import ENTRIES as UNITS
from blysk.bench.tools.blocks import Entry, entries_of
from blysk.bench.units.registry import RECORDS
from blysk.golden.build import STYLES
from blysk.golden.pipeline import ShadingPipeline
from blysk.golden.presets import METHODS, MODELS, preset
from blysk.golden.reference.geometry import Mesh, normalise
from blysk.golden.reference.scene import Scene
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.frames.frame import FrameSimulator
from blysk.sim.meshes.teapot import teapot

__all__ = ["ENTRIES", "cycles_of", "measure", "scenes"]

_EXPONENT = 50


@cache
def scenes() -> dict[str, Scene]:
    """A teapot with short spans, and a square with bent normals and long spans."""
    corners = np.array([(x, y, 0.0) for y in (-1, 1) for x in (-1, 1)])
    normals = normalise(corners * 0.1 + (0, 0, 1))
    square = Mesh(corners, np.array([(0, 1, 3), (0, 3, 2)]), normals)
    return {
        "teapot": scene_for(teapot(256), _EXPONENT, 48, 36),
        "square": scene_for(square, _EXPONENT, 32, 24),
    }


def cycles_of(design: ShadingPipeline) -> dict[str, int]:
    """Cycles of a pipeline from the first write of a constant to the last pixel.

    Parameters
    ----------
    design : ShadingPipeline
        The pipeline.

    Returns
    -------
    dict
        ``teapot_cycles`` of a teapot of 256 triangles at 48x36, and ``square_cycles`` of a square with bent
        normals at 32x24.
    """
    simulator = FrameSimulator(design)
    return {f"{name}_cycles": simulator.render(scene).cycles for name, scene in scenes().items()}


@dataclass(frozen=True)
class _Pipeline:
    """A pipeline of one light."""

    method: str = "renormalise"
    model: str = "cosquad"
    style: str = "throughput"
    gate: bool = False

    @property
    def name(self) -> str:
        return f"pipeline {self.method}, {self.model}, {self.style}" + ", gate" * self.gate

    @property
    def design(self) -> ShadingPipeline:
        return preset(self.method, self.model, gate=self.gate, style=self.style)

    def parts(self) -> dict[str, int]:
        return cost_of(ShadingPipelineUnit(self.design)).totals

    def cycles(self) -> dict[str, int]:
        return cycles_of(self.design)


def _parts_of_unit(entry: Entry) -> dict[str, int]:
    return cost_of(entry.variant.unit()).totals


def _entries() -> dict[str, Callable[[], dict[str, int]]]:
    pipelines = [_Pipeline(method, model_of(method), style) for style in STYLES for method in METHODS]
    pipelines += [_Pipeline(method, gate=True) for method in ("quadratic", "linear")]
    pipelines += [_Pipeline("quadratic", "blinn_product", "compact", gate) for gate in (False, True)]
    entries = {f"frames: {pipeline.name}": pipeline.cycles for pipeline in pipelines}
    # In the throughput style the model changes only the latency, so the cycles differ only by the latency.
    pipelines += [_Pipeline(model=model) for model in MODELS if model != "cosquad"]
    pipelines += [_Pipeline("quotient", "phong")]
    entries |= {f"parts: {pipeline.name}": pipeline.parts for pipeline in pipelines}
    # Pipelines already have their entries, with styles and gates.
    of_units = [entry for entry in UNITS if entry.record.kind is not ShadingPipelineUnit]
    # Units whose errors are in no table, such as the units of geometry.
    of_units += [Entry(record, record.default) for record in RECORDS.values() if not entries_of(record)]
    entries |= {f"parts: {entry.title}": partial(_parts_of_unit, entry) for entry in of_units}
    return entries


ENTRIES: dict[str, Callable[[], dict[str, int]]] = _entries()
"""Entries to measure, each with a function that returns its figures.

Entries ``frames`` have `cycles_of` a pipeline. There are the pipelines of each method in both styles, and
some with a gate. Entries ``parts`` have `Cost.totals` of these pipelines, of a pipeline of each model, of
``quotient`` with ``phong``, and of every measured variant of every other unit.
"""


def measure(name: str) -> dict[str, int]:
    """Measure the figures of an entry."""
    return ENTRIES[name]()
