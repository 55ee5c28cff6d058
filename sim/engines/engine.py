"""One interface to the simulation engines, from an array of beats to an array of beats and their cycles.

A component that can be simulated is an `amaranth.lib.wiring.Component` in the clock domain ``sync``. It has
the streams ``i`` (in) and ``o`` (out), and may have

- ``constants``, an input, driven for the whole run;
- ``write``, a stream in;
- ``status``, an output, read after the run.

Both engines do the same on every clock, so they give equal beats at equal cycles:

1. The writes are offered first, each until it is taken. From the clock after the last write on, the source
   offers the next input beat, unless ``input_stalls`` says otherwise on this clock. An offered beat stays
   until it is taken. A write that comes after a number of beats is offered when these beats are taken, at the
   same time as the next beats. While ``valid`` is low, every payload bit of an input is 1. So a component
   that uses a payload without ``valid`` gives wrong results.
2. The sink is ready unless ``output_stalls`` says otherwise on this clock.
3. ``ready``, ``valid`` and payloads are read as they stand just before the rising edge. A beat moves at the
   edge where its ``valid`` and ``ready`` are both high.
4. The rising edge ends the cycle. Cycles are numbered. Clock 0 is the first after power-up, when every
   register holds its initial value.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from amaranth.lib import stream
from amaranth.lib.wiring import Component, Flow

from blysk.sim.engines.beats import word_count
from blysk.sim.errors import CompilerMissing, SimulationError

__all__ = ["CompilerMissing", "Drive", "Ports", "Prepared", "SimulationError", "StopReason", "Trace"]


class Ports:
    """The payload shapes of a component's members.

    Parameters
    ----------
    component : Component
        Component to simulate.

    Attributes
    ----------
    i, o : shape
        Payload shapes of the input and of the output stream.
    constants, write, status : shape or None
        Shape of each member. ``None`` if the component does not have the member.

    Raises
    ------
    TypeError
        If ``component`` is not a `Component`.
    ValueError
        If stream ``i`` or ``o`` is missing, a member is of another kind, or a stream's payload has no bits.
        If there is another input, or another member with a signature. No engine drives these members.
    """

    def __init__(self, component: Component):
        if not isinstance(component, Component):
            raise TypeError(f"component must be a wiring.Component, not {type(component).__name__}")
        kinds = {
            "i": (Flow.In, True),
            "o": (Flow.Out, True),
            "constants": (Flow.In, False),
            "write": (Flow.In, True),
            "status": (Flow.Out, False),
        }
        members = dict(component.signature.members)
        for name, (flow, is_stream) in kinds.items():
            shape = None
            member = members.pop(name, None)
            if member is not None:
                right = member.flow == flow and not member.dimensions
                if is_stream and right and member.is_signature:
                    signature = member.signature
                    right = isinstance(signature, stream.Signature)
                    right = right and not (signature.always_ready or signature.always_valid)
                    shape = signature.members["payload"].shape if right else None
                elif not is_stream and right and member.is_port:
                    shape = member.shape
                if shape is None:
                    kind = "stream.Signature" if is_stream else "shape"
                    raise ValueError(f"member {name} must be {flow.name}({kind}), not {member!r}")
                if is_stream and not word_count(shape):
                    raise ValueError(f"the payload of stream {name} has no bits")
            elif name in ("i", "o"):
                raise ValueError(f"{type(component).__name__} has no stream {name}")
            setattr(self, name, shape)
        undriven = [name for name, member in members.items() if member.flow == Flow.In or member.is_signature]
        if undriven:
            raise ValueError(
                f"{type(component).__name__} has members that nothing drives: {', '.join(undriven)}"
            )


@dataclass(frozen=True)
class Drive:
    """All words that an engine drives, packed by `beats.pack`, and the conditions of its stop.

    Parameters
    ----------
    input, write : uint32 array, shape (beats, words)
        Input beats and writes.
    constants : uint32 array, shape (1, words)
        Constants.
    input_stalls, output_stalls : bool array
        Stall patterns, repeated; shape (1,) and ``False`` without stalls.
    count : int or None
        Expected number of output beats; ``None`` for any number.
    idle_timeout : int
        Cycles without a transfer after which the run ends. It ends as ``DONE`` if ``count`` is ``None`` and
        all input is taken, else as ``STUCK``.
    settle : int
        Cycles that a complete run goes on after its last transfer, at most ``idle_timeout``.
    limit : int or None
        Number of cycles after which every run ends (``LIMIT``).
    write_after : int64 array, shape (writes,), or None
        Number of input beats taken before each write is offered, in ascending order; ``None`` for 0.
    """

    input: np.ndarray
    write: np.ndarray
    constants: np.ndarray
    input_stalls: np.ndarray
    output_stalls: np.ndarray
    count: int | None
    idle_timeout: int
    settle: int
    limit: int | None = None
    write_after: np.ndarray | None = None


class StopReason(IntEnum):
    """Reasons for an engine's stop. The compiled driver has the same numbers."""

    LIMIT = 0
    DONE = 1
    DROPPED = 2
    CHANGED = 3
    EXTRA = 4
    STUCK = 5


@dataclass(frozen=True)
class Trace:
    """Record of an engine's run, with packed beats. `Run` is the same record with unpacked beats.

    Parameters
    ----------
    end : StopReason
        Reason for the stop.
    clock : int
        Clock of the stop.
    total_cycles : int
        Number of cycles up to and including the last transfer.
    write_count : int
        Number of writes taken.
    output : uint32 array, shape (count, words)
        Output beats.
    cycles, input_cycles : int64 array
        Clock of each output transfer, and of each input transfer.
    status : uint32 array, shape (1, words)
        Status at the end of the run; 0 unless ``end`` is ``DONE`` or ``LIMIT``.
    """

    end: StopReason
    clock: int
    total_cycles: int
    write_count: int
    output: np.ndarray
    cycles: np.ndarray
    input_cycles: np.ndarray
    status: np.ndarray

    def differs(self, other: "Trace") -> str | None:
        """Name of the first unequal field, or ``None``."""
        for name in self.__dataclass_fields__:
            if not np.array_equal(getattr(self, name), getattr(other, name)):
                return name
        return None


class Prepared(Protocol):
    """A component prepared for an engine, for any number of runs, each from power-up."""

    def run(self, drive: Drive, progress: Callable[[int], object] | None) -> Trace:
        """Run from power-up. After each batch of cycles ``progress`` gets the number of output beats."""
