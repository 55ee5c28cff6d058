"""Speed of the engines and of their baseline, on the same component and beats, in one run.

``python -m blysk.bench.speed.engines`` sends the longer spans of a teapot at 4000x3000 through the
quotient pipeline of one light in both engines and in Verilator's model of the emitted Verilog, and through
the quadratic pipeline with a highlight gate in the compiled engine. It prints cycles and pixels a second of
each, and the seconds of ``blysk render`` for a teapot of 50,000 triangles with its model in the cache. The
exit status is 1 if the compiled engine makes less than 5 million pixels a second on one core, is less than
200 times as fast as pysim, or is slower than Verilator, or if the picture takes 2 s or more.

Seconds are processor time of this process, which has one thread: other work on the machine does not count. A
run of an engine is the whole call, with packing and unpacking of beats; a run of Verilator is only the loop
over the cycles, from packed beats to packed beats.
"""

import hashlib
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from amaranth.lib.wiring import Component

from blysk.bench.accuracy import scene_for
from blysk.bench.speed.verilator import Verilated, free_stimulus
from blysk.golden.frame_constants import FrameConstants
from blysk.golden.frames.prepare import prepare
from blysk.golden.pipeline import ShadingPipeline, Spans
from blysk.golden.presets import preset
from blysk.hdl.emit.processes import run_program
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.beats import pack
from blysk.sim.engines.simulate import Run, simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.testbench import pixel_beats
from blysk.sim.meshes.mesh import load_mesh

__all__ = ["LEAST_LENGTH", "LEAST_PIXELS", "LEAST_RATIO", "LEAST_RIVAL", "LONGEST_SECONDS", "Speed"]
__all__ += ["main", "measure", "picture_seconds", "teapot_spans"]

LEAST_PIXELS = 5e6
"""Target: least pixels a second of the compiled engine."""

LEAST_RATIO = 200
"""Target: least ratio of the speeds of the compiled engine and pysim."""

LEAST_RIVAL = 1
"""Target: least ratio of the speeds of the compiled engine and Verilator."""

LONGEST_SECONDS = 2.0
"""Target: seconds from a teapot of 50,000 triangles to its picture of 640x480."""

LEAST_LENGTH = 16
"""Least length in pixels of the spans with which the speed is measured."""

# The command, and the processor's seconds at its end.
_TIMED_COMMAND = """
import sys, time
from blysk.sim.cli.main import main
start = time.process_time()
status = main()
print(time.process_time() - start)
sys.exit(status)
"""

_WAIT = 1000


@dataclass(frozen=True)
class Speed:
    """Speed of both engines, with all overhead except building the model, and of Verilator as baseline.

    Parameters
    ----------
    cxxrtl, pysim : float
        Cycles a second.
    cxxrtl_beats, pysim_beats : float
        Output beats a second.
    build : float
        Wall-clock seconds to build the compiled model and for its first, short run; less with a warm cache.
    cycles : int
        Cycles of the compiled run, up to the last transfer.
    verilator_beats : float or None
        Output beats a second of Verilator's model; ``None`` if it did not run.
    """

    cxxrtl: float
    pysim: float
    cxxrtl_beats: float
    pysim_beats: float
    build: float
    cycles: int
    verilator_beats: float | None = None

    @property
    def ratio(self) -> float:
        """Ratio of the speeds of the compiled and the interpreted engine."""
        return self.cxxrtl / self.pysim


def _take(beats: np.ndarray | Mapping, count: int) -> np.ndarray | dict:
    if isinstance(beats, Mapping):
        return {name: _take(value, count) for name, value in beats.items()}
    return np.asarray(beats)[:count]


def _digest(words: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(words)).hexdigest()


def measure(
    component: Component,
    beats: np.ndarray | Mapping,
    *,
    constants: np.ndarray | Mapping | None = None,
    write: np.ndarray | Mapping | None = None,
    expected: Mapping[str, np.ndarray] | None = None,
    pysim_beats: int = 200,
    repeats: int = 3,
    baseline: bool = False,
) -> Speed:
    """Run both engines, compare their outputs, and measure their speeds.

    The interpreted engine gets the first ``pysim_beats`` beats only, since it is much slower. The compiled
    one runs those too, for the comparison, and then all beats ``repeats`` times, in turn with Verilator's
    model; the fastest run of each counts. The cycles of the idle timeout at the end are part of both engines'
    times and counts.

    Parameters
    ----------
    component : Component
        Component that `simulate` takes.
    beats : structured array or mapping
        Input beats; enough for some million cycles make a fair measure.
    constants, write
        As `simulate` takes them.
    expected : mapping of field names to arrays, optional
        Expected output of all the beats.
    pysim_beats : int
        Input beats for the interpreted engine.
    repeats : int
        Runs of the compiled engine.
    baseline : bool
        Whether to run Verilator's model too; not for a component with ``constants``.

    Returns
    -------
    Speed

    Raises
    ------
    ValueError
        If the engines differ in a beat or a cycle, the compiled engine's output is not as expected, or
        Verilator's model gives other beats or cycles than the compiled engine.
    SimulationError
        If there is no Verilator, or it fails.
    """

    def timed(engine: str, some: np.ndarray | Mapping) -> tuple[float, Run]:
        return _timed(
            lambda: simulate(
                component,
                some,
                count=None,
                constants=constants,
                write=write,
                engine=engine,
                idle_timeout=_WAIT,
            )
        )

    few = _take(beats, pysim_beats)
    start = time.perf_counter()
    _, compiled = timed("cxxrtl", few)
    build = time.perf_counter() - start
    pysim_time, interpreted = timed("pysim", few)
    for name in ("beats", "cycles", "input_cycles", "total_cycles", "status"):
        if not np.array_equal(getattr(compiled, name), getattr(interpreted, name)):
            raise ValueError(f"the engines differ in {name}")
    times, runs, baseline_times = [], [], []
    with ExitStack() as stack:
        model = None
        if baseline:
            folder = stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
            model = Verilated(component, Path(folder))
        for _ in range(repeats):
            seconds, run = timed("cxxrtl", beats)
            times.append(seconds)
            runs.append(run)
            if model is not None:
                stimulus = free_stimulus(model.ports, beats, write, len(run.beats), _WAIT)
                seconds, (output, cycles) = _timed(lambda stimulus=stimulus: model.run(stimulus))
                baseline_times.append(seconds)
                same = _digest(output) == _digest(pack(model.ports.o, run.beats))
                if not same or not np.array_equal(cycles, run.cycles):
                    raise ValueError("Verilator's model and the compiled engine differ")
    for name, values in (expected or {}).items():
        if not np.array_equal(runs[0].beats[name], values):
            raise ValueError(f"the compiled engine gives another {name} than expected")
    cycles = runs[0].total_cycles
    return Speed(
        cxxrtl=(cycles + _WAIT) / min(times),
        pysim=(interpreted.total_cycles + _WAIT) / pysim_time,
        cxxrtl_beats=len(runs[0].beats) / min(times),
        pysim_beats=len(interpreted.beats) / pysim_time,
        build=build,
        cycles=cycles,
        verilator_beats=len(runs[0].beats) / min(baseline_times) if baseline_times else None,
    )


def _timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor seconds of a call, and its result."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def teapot_spans(
    design: ShadingPipeline, width: int, height: int, least: int = 1
) -> tuple[Spans, FrameConstants]:
    """Spans of at least ``least`` pixels of a teapot's picture, and frame constants with one light.

    The order is random, from a fixed seed: the first spans then have lengths like all spans, so that the
    pixels a second of a short run compare with those of a long run.
    """
    scene = scene_for(load_mesh("teapot").mesh, 20, width, height)
    prepared = prepare(scene, design)
    spans = prepared.spans
    order = np.random.default_rng(20).permutation(np.flatnonzero(spans.length >= least))
    mixed = spans[order]
    return mixed, prepared.constants[0]


def picture_seconds(triangles: int = 50_000, size: str = "640x480", repeats: int = 3) -> tuple[float, float]:
    """Seconds that ``blysk render`` takes for a teapot by the method quotient, its model in the cache.

    Parameters
    ----------
    triangles : int
        Number of triangles of the teapot, about.
    size : str
        Size of the picture.
    repeats : int
        Number of pictures after the first, which fills the cache; the fastest counts.

    Returns
    -------
    wall : float
        Wall-clock seconds from loading to the picture file, as the command reports them.
    processor : float
        Processor seconds of all threads of the process, from the call of the command line to its end.
    """
    wall, processor = [], []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        figures = Path(folder) / "figures.json"
        command = [sys.executable, "-c", _TIMED_COMMAND, "render", "teapot"]
        command += ["--triangles", str(triangles), "--size", size, "--method", "quotient"]
        command += ["--json", str(figures), "-o", str(Path(folder) / "picture.png")]
        for _ in range(1 + repeats):
            done = run_program(command, check=True, capture_output=True, text=True)
            processor.append(float(done.stdout.splitlines()[-1]))
            wall.append(json.loads(figures.read_text())["seconds"]["total"])
    return min(wall[1:]), min(processor[1:])


def main(width: int = 4000, height: int = 3000, repeats: int = 5) -> int:
    """Measure, print, and compare with the targets.

    The picture meets its target by wall-clock or by processor seconds: on a machine without other work both
    are alike.

    Parameters
    ----------
    width, height : int
        Size of the picture whose spans the engines shade.
    repeats : int
        Runs of the compiled engine and of Verilator's model; the fastest of each counts.

    Returns
    -------
    int
        0, or 1 when the compiled engine missed a target.
    """
    designs = preset("quotient", "blinn"), preset("quadratic", "cosquad", gate=True)
    given = [teapot_spans(design, width, height, LEAST_LENGTH) for design in designs]
    shaded = [design.compute(*of) for design, of in zip(designs, given, strict=True)]
    # An empty cache: the build is a part of what is measured.
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        mock.patch.dict(os.environ, BLYSK_CACHE=folder),
    ):
        speed, gated = (
            measure(
                unit,
                beats_of(unit, spans),
                write=constants.writes(),
                expected=pixel_beats(pixels),
                pysim_beats=50,
                repeats=repeats,
                baseline=not design.gate,
            )
            for design, unit, (spans, constants), pixels in zip(
                designs, map(ShadingPipelineUnit, designs), given, shaded, strict=True
            )
        )
        wall, processor = picture_seconds()
    print(
        f"teapot at {width}x{height}, {len(given[0][0]):,} spans: {len(shaded[0].x):,} pixels, "
        f"{speed.cycles:,} cycles"
    )
    print(f"{'engine':<14}{'pixels/s':>14}{'cxxrtl is faster':>20}")
    rates = {
        "cxxrtl": speed.cxxrtl_beats,
        "verilator": speed.verilator_beats,
        "pysim": speed.pysim_beats,
        "cxxrtl, gate": gated.cxxrtl_beats,
    }
    for name, rate in rates.items():
        print(f"{name:<14}{rate:>14,.0f}{speed.cxxrtl_beats / rate:>19,.2f}x")
    print(f"model built, checked and loaded in {speed.build:.1f} s")
    print(
        f"teapot of 50,000 triangles to its picture of 640x480, model in the cache: {wall:.2f} s by the "
        f"clock, {processor:.2f} s of the processor"
    )
    missed = [
        text
        for met, text in (
            (speed.cxxrtl_beats >= LEAST_PIXELS, f"{LEAST_PIXELS:,.0f} pixels a second"),
            (speed.ratio >= LEAST_RATIO, f"{LEAST_RATIO} times pysim"),
            (speed.cxxrtl_beats >= LEAST_RIVAL * speed.verilator_beats, f"{LEAST_RIVAL} times Verilator"),
            (min(wall, processor) < LONGEST_SECONDS, f"a picture in {LONGEST_SECONDS:g} s"),
        )
        if not met
    ]
    print(f"missed: {', '.join(missed)}" if missed else "every target met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
