"""Clocks a second of both engines, on the same component and beats, in one run."""

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from amaranth.lib.wiring import Component

from sim.engine import Run, simulate

__all__ = ["Speed", "measure"]

_WAIT = 1000


@dataclass(frozen=True)
class Speed:
    """Speed of the two engines, both with all of their overhead but the building of the model.

    Parameters
    ----------
    cxxrtl, pysim : float
        Clocks a second.
    build : float
        Seconds from the component to its compiled model and its first, short run; less with a warm cache.
    clocks : int
        Clocks of the compiled run, up to the last transfer.
    """

    cxxrtl: float
    pysim: float
    build: float
    clocks: int

    @property
    def ratio(self) -> float:
        """Speed of the compiled engine in terms of the interpreted one."""
        return self.cxxrtl / self.pysim

    def __str__(self) -> str:
        return (
            f"cxxrtl {self.cxxrtl / 1e6:.2f} million clocks a second, pysim {self.pysim / 1e6:.4f}: "
            f"{self.ratio:.0f} times as fast; model built and loaded in {self.build:.2f} s"
        )


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
        If the engines differ in a beat or a clock.
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
    clocks = runs[0].total_clocks
    return Speed(
        cxxrtl=(clocks + _WAIT) / min(times),
        pysim=(interpreted.total_clocks + _WAIT) / pysim_time,
        build=build,
        clocks=clocks,
    )
