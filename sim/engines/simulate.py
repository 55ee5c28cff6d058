"""Send beats through a component, by one of the engines, and collect its output."""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from warnings import warn
from weakref import WeakKeyDictionary

import numpy as np
from amaranth.lib.wiring import Component

from blysk.sim.engines import cxxrtl, pysim
from blysk.sim.engines.beats import dtype_of, pack, unpack
from blysk.sim.engines.engine import (
    CompilerMissing,
    Drive,
    Ports,
    Prepared,
    SimulationError,
    StopReason,
    Trace,
)

__all__ = ["Run", "simulate", "stimulus_of"]

_PIECE = 1 << 15
"""Number of beats unpacked in one step."""


@dataclass(frozen=True)
class Run:
    """Result of a simulation.

    Parameters
    ----------
    beats : array, shape (count,)
        Output beats, of type ``dtype_of(payload shape)``.
    cycles : int64 array, shape (count,)
        Clock at whose end each output beat was taken; clock 0 is the first after power-up.
    input_cycles : int64 array, shape (input beats,)
        Clock at whose end each input beat was taken.
    total_cycles : int
        Number of cycles from clock 0 up to and including the last transfer (of an input, an output or a
        write).
    status : scalar of the status layout's type, or None
        The component's ``status`` at the end of the run.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``.
    """

    beats: np.ndarray
    cycles: np.ndarray
    input_cycles: np.ndarray
    total_cycles: int
    status: np.void | None
    engine: str


_models: WeakKeyDictionary[Component, Prepared] = WeakKeyDictionary()


def _compiled(component: Component, origin: Any) -> Prepared:
    if component not in _models:
        _models[component] = cxxrtl.Compiled(component, origin)
    return _models[component]


def _interpreted(component: Component, vcd: str | None) -> Prepared:
    return pysim.Interpreted(component, vcd)


def _pattern(name: str, stalls) -> np.ndarray:
    if stalls is None:
        return np.zeros(1, dtype=bool)
    stalls = np.ascontiguousarray(stalls)
    if stalls.dtype != bool or stalls.ndim != 1:
        raise ValueError(f"{name} must be a bool array of one dimension, not {stalls.dtype} {stalls.shape}")
    if stalls.all():
        raise ValueError(f"{name} must leave at least one clock free")
    return stalls


def _whole(name: str, value, least: int) -> int:
    value = operator.index(value)
    if value < least:
        raise ValueError(f"{name} must be at least {least}, not {value}")
    return value


def _single(beat):
    if isinstance(beat, Mapping):
        return {name: _single(value) for name, value in beat.items()}
    return np.asarray(beat)[np.newaxis]


def _constants(shape, constants) -> np.ndarray:
    if shape is None and constants is not None:
        raise ValueError("the component has no constants")
    if shape is not None and constants is None:
        raise ValueError("the component has constants, and none are given")
    return np.zeros((0, 0), dtype=np.uint32) if shape is None else pack(shape, _single(constants))


def _writes(shape, write) -> np.ndarray:
    if shape is None and write is not None:
        raise ValueError("the component has no stream write")
    return np.zeros((0, 0), dtype=np.uint32) if write is None else pack(shape, write)


def _places(write_after, writes: int, beats: int) -> np.ndarray:
    after = np.ascontiguousarray(write_after)
    if after.dtype.kind not in "iu" or after.shape != (writes,):
        raise ValueError(f"write_after must be {writes} integers, not {after.dtype} {after.shape}")
    after = after.astype(np.int64)
    if writes and (after[0] < 0 or after[-1] > beats or np.any(np.diff(after) < 0)):
        raise ValueError(f"write_after must not decrease, and be 0 to {beats}, the number of beats")
    return after


def stimulus_of(
    component: Component,
    beats: np.ndarray | Mapping,
    *,
    count: int | None,
    constants: np.ndarray | Mapping | None = None,
    write: np.ndarray | Mapping | None = None,
    write_after: np.ndarray | None = None,
    input_stalls: np.ndarray | None = None,
    output_stalls: np.ndarray | None = None,
    idle_timeout: int = 10_000,
    settle: int = 64,
) -> Drive:
    """Drive for an engine, packed and checked; the arguments are those of `simulate`.

    Raises
    ------
    ValueError, TypeError
        If a member of the component or an argument has a wrong type, shape or value.
    """
    ports = Ports(component)
    idle_timeout, settle = _whole("idle_timeout", idle_timeout, 1), _whole("settle", settle, 0)
    if count is not None and settle > idle_timeout:
        raise ValueError(f"settle must be at most idle_timeout, {idle_timeout}, not {settle}")
    packed, writes = pack(ports.i, beats), _writes(ports.write, write)
    return Drive(
        input=packed,
        write=writes,
        write_after=None if write_after is None else _places(write_after, len(writes), len(packed)),
        constants=_constants(ports.constants, constants),
        input_stalls=_pattern("input_stalls", input_stalls),
        output_stalls=_pattern("output_stalls", output_stalls),
        count=None if count is None else _whole("count", count, 0),
        idle_timeout=idle_timeout,
        settle=settle,
    )


def simulate(
    component: Component,
    beats: np.ndarray | Mapping,
    *,
    count: int | None,
    constants: np.ndarray | Mapping | None = None,
    write: np.ndarray | Mapping | None = None,
    write_after: np.ndarray | None = None,
    engine: str = "cxxrtl",
    origin: Any = None,
    input_stalls: np.ndarray | None = None,
    output_stalls: np.ndarray | None = None,
    idle_timeout: int = 10_000,
    settle: int = 64,
    progress: Callable[[int], object] | None = None,
    vcd: str | None = None,
) -> Run:
    """Send beats through a component, and collect its output.

    A compiled model is kept with its component, and between processes in the cache folder. So the second run
    of the same component starts at once.

    Parameters
    ----------
    component : Component
        Component with the members that the module `blysk.sim.engines.engine` describes.
    beats : structured array or mapping
        Input beats, as `beats.pack` takes them.
    count : int or None
        Expected number of output beats. The run ends ``settle`` cycles after the last transfer of these
        beats, all writes and all input beats. ``None`` takes any number, until all input is taken and
        ``idle_timeout`` cycles have passed without a transfer.
    constants : scalar of the constants' type, or mapping of names to codes
        Values for the whole run. Needed if the component has ``constants``.
    write : structured array or mapping, optional
        Beats for the ``write`` stream, delivered before the first input beat.
    write_after : int array, optional
        Number of input beats that are taken before each write is offered, in ascending order. A write that
        comes after the first beat is offered at the same time as the next input beats. If these beats depend
        on the write, the component has to take the write first.
    engine : str
        ``"cxxrtl"``, ``"pysim"``, or ``"auto"``. ``"auto"`` takes the compiled engine. If no compiler works,
        it takes pysim with a warning.
    origin : optional
        Values from which the component is made, as for `cxxrtl.Compiled`. With them the component is found
        faster in the cache.
    input_stalls, output_stalls : bool array, optional
        One value a cycle, repeated for ever. ``True`` keeps the source from offering a new beat, or the sink
        from being ready. At least one value must be ``False``.
    idle_timeout : int
        Cycles without a transfer, at least 1, after which the component counts as stuck. If ``count`` is
        ``None`` and all input is taken, the run ends then, without an error.
    settle : int
        Cycles after the last transfer in which a surplus output beat is an error. At most ``idle_timeout``,
        unless ``count`` is ``None``.
    progress : callable, optional
        Called with the number of output beats so far, once a batch: a million cycles of ``cxxrtl``, 1000 of
        ``pysim``.
    vcd : str, optional
        VCD file for the waveforms. Only for ``pysim``.

    Returns
    -------
    Run

    Raises
    ------
    SimulationError
        - The component withdraws or changes a beat that waits for ready, gives a surplus output beat, or gets
          stuck. The message names the clock.
        - The engines differ in the first cycles of a newly built model.
        - The compiled engine cannot translate the component.
    CompilerMissing
        If there is no working C++ compiler for ``"cxxrtl"``.
    ValueError, TypeError
        If a member of the component or an argument has a wrong type, shape or value.
    """
    if engine not in ("cxxrtl", "pysim", "auto"):
        raise ValueError(f"engine must be 'cxxrtl', 'pysim' or 'auto', not {engine!r}")
    if vcd is not None and engine != "pysim":
        raise ValueError(f"waveforms need engine 'pysim', not {engine!r}")
    ports = Ports(component)
    drive = stimulus_of(
        component,
        beats,
        count=count,
        constants=constants,
        write=write,
        write_after=write_after,
        input_stalls=input_stalls,
        output_stalls=output_stalls,
        idle_timeout=idle_timeout,
        settle=settle,
    )
    model, engine = _model_of(component, engine, origin, vcd)
    trace = model.run(drive, progress)
    _judge(drive, trace)
    return Run(
        beats=_unpacked(ports.o, trace.output),
        cycles=trace.cycles,
        input_cycles=trace.input_cycles,
        total_cycles=trace.total_cycles,
        status=None if ports.status is None else unpack(ports.status, trace.status)[0],
        engine=engine,
    )


def _model_of(component: Component, engine: str, origin: Any, vcd: str | None) -> tuple[Prepared, str]:
    """A component's model in an engine, and the engine's name.

    ``auto`` takes pysim if there is no compiler.
    """
    if engine != "pysim":
        try:
            return _compiled(component, origin), "cxxrtl"
        except CompilerMissing as error:
            if engine == "cxxrtl":
                raise
            warn(f"{error}; using pysim, about a hundred times slower", RuntimeWarning, stacklevel=3)
    return _interpreted(component, vcd), "pysim"


def _unpacked(shape, words: np.ndarray) -> np.ndarray:
    """`beats.unpack` by small pieces, so that the intermediate words stay in the processor's cache."""
    beats = np.empty(len(words), dtype=dtype_of(shape))
    for start in range(0, len(words), _PIECE):
        piece = words[start : start + _PIECE]
        beats[start : start + len(piece)] = unpack(shape, piece)
    return beats


def _judge(drive: Drive, trace: Trace) -> None:
    """Raise `SimulationError` unless the run is complete or ended at its limit."""
    where = f"at clock {trace.clock}, output beat {len(trace.output)}"
    if trace.end == StopReason.DROPPED:
        raise SimulationError(f"{where}: valid went low while the beat waited for ready")
    if trace.end == StopReason.CHANGED:
        raise SimulationError(f"{where}: the payload changed while the beat waited for ready")
    if trace.end == StopReason.EXTRA:
        raise SimulationError(f"{where}: a beat more than the {drive.count} expected")
    if trace.end == StopReason.STUCK:
        expected = "" if drive.count is None else f" of {drive.count}"
        raise SimulationError(
            f"nothing moved for {drive.idle_timeout} cycles up to clock {trace.clock}: "
            f"{len(trace.output)}{expected} output beats came, "
            f"{len(trace.input_cycles)} of {len(drive.input)} input beats and "
            f"{trace.write_count} of {len(drive.write)} writes were taken"
        )
