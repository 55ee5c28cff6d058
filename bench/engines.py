"""Clocks a second of both engines, on the same component and beats, in one run.

``python -m bench.engines`` sends the spans of a teapot at 3200x2400 through the pipeline of one light in both
engines, prints what they do in a second, and ends with status 1 when the compiled engine makes less than
5 million clocks a second on one core or is less than 200 times as fast as pysim.
"""

import os
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, fields
from unittest import mock

import numpy as np
from amaranth.lib.wiring import Component

from golden.frame_constants import FrameConstants
from golden.pipeline import ShadingPipeline, Spans
from golden.raster import rasterise
from hdl.pipeline import ShadingPipelineUnit
from sim.engine import Run, simulate
from sim.mesh import load_mesh
from sim.spans import cut_wide_spans, quantise_spans

from .accuracy import scene_for

__all__ = ["LEAST_CLOCKS", "LEAST_RATIO", "Speed", "main", "measure", "teapot_spans"]

LEAST_CLOCKS = 5e6
"""Target: clocks a second of the compiled engine."""

LEAST_RATIO = 200
"""Target: speed of the compiled engine in terms of pysim."""

_WAIT = 1000


@dataclass(frozen=True)
class Speed:
    """Speed of the two engines, both with all of their overhead but the building of the model.

    Parameters
    ----------
    cxxrtl, pysim : float
        Clocks a second.
    cxxrtl_beats, pysim_beats : float
        Output beats a second.
    build : float
        Seconds from the component to its compiled model and its first, short run; less with a warm cache.
    clocks : int
        Clocks of the compiled run, up to the last transfer.
    """

    cxxrtl: float
    pysim: float
    cxxrtl_beats: float
    pysim_beats: float
    build: float
    clocks: int

    @property
    def ratio(self) -> float:
        """Speed of the compiled engine in terms of the interpreted one."""
        return self.cxxrtl / self.pysim


def _take(beats: np.ndarray | Mapping, count: int) -> np.ndarray | dict:
    if isinstance(beats, Mapping):
        return {name: _take(value, count) for name, value in beats.items()}
    return np.asarray(beats)[:count]


def measure(
    component: Component,
    beats: np.ndarray | Mapping,
    *,
    constants: np.ndarray | Mapping | None = None,
    write: np.ndarray | Mapping | None = None,
    expected: Mapping[str, np.ndarray] | None = None,
    pysim_beats: int = 200,
    repeats: int = 3,
) -> Speed:
    """Run both engines, and compare what they give.

    The interpreted engine gets the first ``pysim_beats`` beats only, since it is the slower one by far. The
    compiled one runs those as well, for the comparison, and then all of them ``repeats`` times; the fastest
    counts. The clocks of waiting for the end are part of both times and both counts.

    Parameters
    ----------
    component : Component
        Component that `sim.engine.simulate` takes.
    beats : structured array or mapping
        Input beats; enough for some million clocks make a fair measure.
    constants, write
        As `sim.engine.simulate` takes them.
    expected : mapping of field names to arrays, optional
        What all the beats must give.
    pysim_beats : int
        Input beats for the interpreted engine.
    repeats : int
        Runs of the compiled engine.

    Returns
    -------
    Speed

    Raises
    ------
    ValueError
        If the engines differ in a beat or a clock, or the compiled one gives other than expected.
    """

    def timed(engine: str, some: np.ndarray | Mapping) -> tuple[float, Run]:
        start = time.perf_counter()
        run = simulate(
            component, some, count=None, constants=constants, write=write, engine=engine, patience=_WAIT
        )
        return time.perf_counter() - start, run

    few = _take(beats, pysim_beats)
    build, compiled = timed("cxxrtl", few)
    pysim_time, interpreted = timed("pysim", few)
    for name in ("beats", "clocks", "input_clocks", "total_clocks", "status"):
        if not np.array_equal(getattr(compiled, name), getattr(interpreted, name)):
            raise ValueError(f"the engines differ in {name}")
    times, runs = zip(*(timed("cxxrtl", beats) for _ in range(repeats)), strict=True)
    for name, values in (expected or {}).items():
        if not np.array_equal(runs[0].beats[name], values):
            raise ValueError(f"the compiled engine gives another {name} than expected")
    clocks = runs[0].total_clocks
    return Speed(
        cxxrtl=(clocks + _WAIT) / min(times),
        pysim=(interpreted.total_clocks + _WAIT) / pysim_time,
        cxxrtl_beats=len(runs[0].beats) / min(times),
        pysim_beats=len(interpreted.beats) / pysim_time,
        build=build,
        clocks=clocks,
    )


def teapot_spans(width: int, height: int) -> tuple[Spans, FrameConstants]:
    """Spans of a teapot in a picture of that size, and the constants of one light.

    The order is random, from a fixed seed: the first spans are then of the same lengths as all, which makes
    the pixels a second of a short run comparable with those of a long one.
    """
    scene = scene_for(load_mesh("teapot").mesh, 20, width, height)
    spans = quantise_spans(cut_wide_spans(rasterise(scene))[0])
    order = np.random.default_rng(20).permutation(len(spans))
    mixed = Spans(**{field.name: getattr(spans, field.name)[order] for field in fields(Spans)})
    return mixed, FrameConstants.of(scene, 1)


def main(width: int = 3200, height: int = 2400, repeats: int = 5) -> int:
    """Measure, print, and judge.

    Parameters
    ----------
    width, height : int
        Size of the picture.
    repeats : int
        Runs of the compiled engine; the fastest counts.

    Returns
    -------
    int
        0, or 1 when the compiled engine missed a target.
    """
    design = ShadingPipeline(model="cosquad", lights=1)
    spans, constants = teapot_spans(width, height)
    pixels = design.compute(spans, constants)
    expected = {"x": pixels.x, "y": pixels.y, "last": pixels.last}
    expected |= dict(zip("rgb", pixels.color.T, strict=True))
    # An empty cache: the build is a part of what is measured.
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        mock.patch.dict(os.environ, BLYSK_CACHE=folder),
    ):
        speed = measure(
            ShadingPipelineUnit(design),
            {field.name: getattr(spans, field.name) for field in fields(Spans)},
            write=constants.writes(),
            expected=expected,
            repeats=repeats,
        )
    print(
        f"teapot at {width}x{height}, {len(spans):,} spans: {len(pixels.x):,} pixels, {speed.clocks:,} clocks"
    )
    print(f"{'engine':<10}{'clocks/s':>14}{'pixels/s':>14}")
    print(f"{'cxxrtl':<10}{speed.cxxrtl:>14,.0f}{speed.cxxrtl_beats:>14,.0f}")
    print(f"{'pysim':<10}{speed.pysim:>14,.0f}{speed.pysim_beats:>14,.0f}")
    print(f"{'ratio':<10}{speed.ratio:>14,.0f}{speed.cxxrtl_beats / speed.pysim_beats:>14,.0f}")
    print(f"model built, checked and loaded in {speed.build:.1f} s")
    missed = [
        text
        for met, text in (
            (speed.cxxrtl >= LEAST_CLOCKS, f"{LEAST_CLOCKS:,.0f} clocks a second"),
            (speed.ratio >= LEAST_RATIO, f"{LEAST_RATIO} times pysim"),
        )
        if not met
    ]
    print(f"missed: {', '.join(missed)}" if missed else "every target met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
