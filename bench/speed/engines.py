"""Speed of the engines and of Verilator, on the same pipeline and beats, in one run.

``python -m blysk.bench.speed.engines`` measures both engines and Verilator's model of the emitted Verilog.
Each shades the longer spans of a teapot at 4000x3000 by the quotient pipeline of one light. The command
prints the pixels a second of each. The exit status is 1 if the compiled engine

- makes less than 5 million pixels a second on one core,
- is less than 200 times as fast as pysim, or
- is slower than Verilator.

Seconds are processor time of this process, which has one thread. So other work on the machine does not count.
A run of an engine is the whole call, with packing and unpacking of beats. A run of Verilator is only the loop
over the cycles, from packed beats to packed beats.
"""

import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from blysk.bench.accuracy import scene_for
from blysk.bench.speed.verilator import Verilated, free_stimulus
from blysk.golden.frames.prepare import prepare
from blysk.golden.presets import preset
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.meshes.mesh import load_mesh

__all__ = ["LEAST_LENGTH", "TARGETS", "beats_of_teapot", "main", "measure"]

TARGETS = {"": 5e6, "verilator": 1, "pysim": 200}
"""Targets of ``cxxrtl``. Key ``""`` has the least pixels a second.

The key of another engine has the least ratio of the speed of ``cxxrtl`` to the speed of this engine.
"""

LEAST_LENGTH = 16
"""Least length of the spans for measurements of speed, in pixels."""

_WAIT = 1000


def measure(
    unit: ShadingPipelineUnit,
    beats: Mapping[str, np.ndarray],
    write: Mapping[str, np.ndarray],
    repeats: int = 3,
    few: int = 50,
) -> dict[str, float]:
    """Pixels a second of ``cxxrtl``, ``verilator`` and ``pysim``.

    The compiled engine and Verilator's model run in turn, and the fastest run of each counts. The interpreted
    engine gets only the first beats, because it is much slower.

    Parameters
    ----------
    unit : ShadingPipelineUnit
        The pipeline.
    beats, write : mapping of field names to arrays
        As `simulate` takes them. For a fair measure give enough beats for some million cycles.
    repeats : int
        Number of runs of the compiled engine and of Verilator's model.
    few : int
        Number of beats for the interpreted engine.

    Raises
    ------
    ValueError
        If an engine or Verilator's model gives other beats or cycles than the compiled engine.
    SimulationError
        If Verilator is not installed or fails.
    """

    def run(engine: str, some: Mapping[str, np.ndarray]) -> tuple[float, Run]:
        options = {"count": None, "write": write, "engine": engine, "idle_timeout": _WAIT}
        return _timed(lambda: simulate(unit, some, **options))

    first = {name: column[:few] for name, column in beats.items()}
    _, compiled = run("cxxrtl", first)
    slow, interpreted = run("pysim", first)
    for name in ("beats", "cycles", "input_cycles", "total_cycles", "status"):
        if not np.array_equal(getattr(compiled, name), getattr(interpreted, name)):
            raise ValueError(f"the engines differ in {name}")
    seconds, rival = [], []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        model = Verilated(unit, Path(folder))
        for _ in range(repeats):
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


def main(width: int = 4000, height: int = 3000, repeats: int = 5) -> int:
    """Measure, print, and compare with the targets.

    Parameters
    ----------
    width, height : int
        Size of the picture whose spans the engines shade.
    repeats : int
        As in `measure`.

    Returns
    -------
    int
        0, or 1 when the compiled engine missed a target.
    """
    unit = ShadingPipelineUnit(preset("quotient", "blinn"))
    rates = measure(unit, *beats_of_teapot(unit, width, height), repeats)
    print(f"{'engine':<14}{'pixels/s':>14}{'cxxrtl is faster':>20}")
    for name, rate in rates.items():
        print(f"{name:<14}{rate:>14,.0f}{rates['cxxrtl'] / rate:>19,.2f}x")
    missed = [
        f"{least:,.0f} times {name}" if name else f"{least:,.0f} pixels a second"
        for name, least in TARGETS.items()
        if rates["cxxrtl"] < least * rates.get(name, 1)
    ]
    print(f"missed: {', '.join(missed)}" if missed else "every target met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
