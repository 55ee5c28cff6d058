"""Pixels a second of the engines and of Verilator's model, on the same pipeline and beats."""

import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.speed.verilator import Verilated, free_stimulus
from blysk.golden.frames.prepare import prepare
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.mesh import load_mesh

__all__ = ["LEAST_LENGTH", "beats_of_teapot", "measure"]

LEAST_LENGTH = 16
"""Least length of the spans for measurements of speed, in pixels."""

_WAIT = 1000


def measure(
    unit: ShadingPipelineUnit,
    beats: Mapping[str, np.ndarray],
    write: Mapping[str, np.ndarray],
    repeats: int = 3,
    few: int = 50,
    step: Callable[[str], None] = lambda name: None,
) -> dict[str, float]:
    """Pixels a second of ``cxxrtl``, ``verilator`` and ``pysim``.

    The compiled engine and Verilator's model run in turn, and the fastest run of each counts. The interpreted
    engine gets the first beats only, since it is much slower.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline.
    beats, write : mapping of field names to arrays
        As in `simulate`. For a fair measure the beats should take some million cycles.
    repeats : int
        Runs of the compiled engine and of Verilator's model.
    few : int
        Beats for the interpreted engine.
    step : callable
        Takes the name of each step before it begins.

    Raises
    ------
    ValueError
        If an engine or Verilator's model gives other beats or cycles than the compiled engine.
    SimulationError
        If there is no Verilator, or it fails.
    """

    def run(engine: str, some: Mapping[str, np.ndarray]) -> tuple[float, Run]:
        options = {"count": None, "write": write, "engine": engine, "idle_timeout": _WAIT}
        return _timed(lambda: simulate(unit, some, **options))

    step("compile the model, and simulate in pysim")
    first = {name: column[:few] for name, column in beats.items()}
    _, compiled = run("cxxrtl", first)
    slow, interpreted = run("pysim", first)
    for name in ("beats", "cycles", "input_cycles", "total_cycles", "status"):
        if not np.array_equal(getattr(compiled, name), getattr(interpreted, name)):
            raise ValueError(f"the engines differ in {name}")
    seconds, rival = [], []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        step("compile Verilator's model")
        model = Verilated(unit, Path(folder))
        for k in range(repeats):
            step(f"run {k + 1} of {repeats}")
            spent, found = run("cxxrtl", beats)
            seconds.append(spent)
            drive = free_stimulus(model.ports, beats, write, len(found.beats), _WAIT)
            spent, (output, cycles) = _timed(lambda drive=drive: model.run(drive))
            rival.append(spent)
            same = np.array_equal(output, pack(model.ports.o, found.beats))
            if not same or not np.array_equal(cycles, found.cycles):
                raise ValueError("Verilator's model and the compiled engine differ")
    pixels = len(found.beats)
    return {
        "cxxrtl": pixels / min(seconds),
        "verilator": pixels / min(rival),
        "pysim": len(interpreted.beats) / slow,
    }


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor seconds of a call, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def beats_of_teapot(unit: ShadingPipelineUnit, width: int, height: int) -> tuple[Any, Any]:
    """Beats of the spans of at least `LEAST_LENGTH` pixels of a teapot, and the writes of its constants.

    The order is random, from a fixed seed. So the lengths of the first spans are like the lengths of all
    spans. A short run then has about as many pixels a second as a long run.
    """
    scene = scene_for(load_mesh("teapot").mesh, 20, width, height)
    prepared = prepare(scene, unit.model)
    spans, (constants,) = prepared.spans, prepared.constants
    order = np.random.default_rng(20).permutation(np.flatnonzero(spans.length >= LEAST_LENGTH))
    return beats_of(unit, spans[order]), constants.writes()
