"""Frames of a display: simulation of a top module on one clock, and decoding of its four lanes."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from amaranth.hdl import Cat, DomainRenamer, EnableInserter, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.video.display import Display
from blysk.golden.video.display_timing import DisplayMode
from blysk.golden.video.serialiser import LANES
from blysk.hdl.video.output_cells import OutputCells
from blysk.hdl.video.word_crossing import WordCrossing
from blysk.sim.engines.simulate import simulate

__all__ = ["OneClock", "Shown", "show"]

CYCLES = 4
"""Cycles of the serial clock in one output beat of 32 bits."""


class OneClock(wiring.Component):
    """A top module with the clocks ``sync``, ``pixel`` and ``serial``, driven by one clock, for the engines.

    The one clock is the serial clock. The registers of ``pixel`` are enabled in every fifth cycle. The
    registers of ``sync`` are enabled in a share ``rate`` of the cycles, spread evenly. So each register
    behaves as with a clock of its own whose edges coincide with edges of the serial clock. The output cells
    are the models `OutputCells`.

    Parameters
    ----------
    top : Component
        The top module, with the members ``pairs`` and ``status``, and perhaps ``buttons`` and ``line``.
    rate : Fraction
        Rate of ``sync`` over the rate of ``serial``, at most 1.

    Members
    -------
    i : :py:`In(stream.Signature(buttons))`
        State of the buttons from this cycle on. A top module with ``line`` takes the level of its serial line
        in place of the buttons.
    o : :py:`Out(stream.Signature(32))`
        Bits of the lanes in four cycles: for each cycle two bits of lane 0, two of lane 1, and so on. The
        sink must be ready in every cycle.
    status : :py:`Out(...)`
        Counters of the top module.

    Raises
    ------
    ValueError
        If the rate is 0 or less, or ``sync`` is faster than the serial clock.
    """

    def __init__(self, top: wiring.Component, rate: Fraction):
        self.top, self.rate = top, Fraction(rate)
        if not 0 < self.rate <= 1:
            raise ValueError(
                "the rate of the drawing clock must be over 0, and at most the rate of the serial clock"
            )
        members = top.signature.members
        self._driven = next((name for name in ("line", "buttons") if name in members), None)
        buttons = members[self._driven].shape if self._driven else 1
        super().__init__(
            {
                "i": In(stream.Signature(buttons)),
                "o": Out(stream.Signature(2 * LANES * CYCLES)),
                "status": Out(members["status"].shape),
            }
        )

    def elaborate(self, platform):
        """The enables of the clocks, the top module that they drive, and a register that collects bits."""
        m = Module()
        inner, top = Module(), self.top
        cells = OutputCells(LANES)
        inner.submodules.top, inner.submodules.cells = top, cells
        inner.d.comb += cells.pairs.eq(top.pairs)
        draws, shows = Signal(name="draws"), Signal(name="shows")
        ratio, rate = WordCrossing.RATIO, self.rate
        turn, phase = Signal(range(ratio), name="turn"), Signal(range(rate.denominator), name="phase")
        m.d.sync += turn.eq(turn + 1)
        with m.If(shows):
            m.d.sync += turn.eq(0)
        m.d.comb += [shows.eq(turn == ratio - 1), draws.eq(phase >= rate.denominator - rate.numerator)]
        m.d.sync += phase.eq(phase + rate.numerator)
        with m.If(draws):
            m.d.sync += phase.eq(phase - (rate.denominator - rate.numerator))
        enabled = EnableInserter({"sync": draws, "pixel": shows})(inner)
        m.submodules.inner = DomainRenamer({"pixel": "sync", "serial": "sync"})(enabled)

        m.d.comb += self.i.ready.eq(1)
        if self._driven:
            driven = getattr(top, self._driven)
            buttons = Signal.like(driven, name="pressed")
            with m.If(self.i.valid):
                m.d.sync += buttons.eq(self.i.payload)
            m.d.comb += driven.eq(buttons)
        count, word = Signal(range(CYCLES), name="count"), Signal(2 * LANES * CYCLES, name="word")
        last = Signal(name="last")
        m.d.sync += [
            word.eq(Cat(word, cells.bits)[2 * LANES :]),
            count.eq(count + 1),
            last.eq(count == CYCLES - 1),
        ]
        m.d.comb += [self.o.payload.eq(word), self.o.valid.eq(last), self.status.eq(top.status)]
        return m


@dataclass(frozen=True)
class Shown:
    """The frames that a display shows, and the counters.

    Parameters
    ----------
    frames : uint8 array, shape (n, height, width, 3)
        Frames that a display decodes from the bits of the lanes.
    status : dict
        Counters of the top module after the run, by name.
    cycles : int
        Cycles of the serial clock.
    """

    frames: np.ndarray
    status: dict[str, int]
    cycles: int


def show(
    top: OneClock,
    mode: DisplayMode,
    count: int,
    buttons: np.ndarray | None = None,
    engine: str = "cxxrtl",
    progress: Callable[[int], object] | None = None,
) -> Shown:
    """Simulate a top module for some frames of its display, and decode the bits of its lanes.

    Parameters
    ----------
    top : OneClock
        The top module.
    mode : DisplayMode
        Mode of its display.
    count : int
        Frames, from the first after power-up.
    buttons : int array, optional
        State of the buttons, a value for each cycle from power-up on. After the last cycle the last value
        stays.
    engine : str
        ``"cxxrtl"`` or ``"pysim"``, see `simulate`.
    progress : callable, optional
        Called with the pixels sent so far.

    Raises
    ------
    LaneError
        If a display would not show the bits of the lanes.
    SimulationError
        If the simulation goes wrong.
    """
    # A few more pixels cover the latency of the encoders and of the crossing.
    pixels = count * mode.cycles + 16 * CYCLES
    beats = pixels * WordCrossing.RATIO // CYCLES
    run = simulate(
        top,
        np.zeros(0, dtype=np.int64) if buttons is None else buttons,
        count=beats,
        engine=engine,
        settle=0,
        progress=None if progress is None else lambda beat: progress(beat * CYCLES // WordCrossing.RATIO),
    )
    words = np.asarray(run.beats).astype(np.uint32)
    pairs = words[:, np.newaxis] >> 8 * np.arange(CYCLES, dtype=np.uint32) & 255
    pairs = pairs.reshape(-1, 1) >> 2 * np.arange(LANES, dtype=np.uint32) & 3
    bits = (pairs[:, np.newaxis] >> np.arange(2, dtype=np.uint32)[:, np.newaxis] & 1).astype(np.uint8)
    frames = Display(mode).decode(bits.reshape(-1, LANES))
    status = {name: int(run.status[name]) for name in run.status.dtype.names}
    return Shown(frames, status, run.total_cycles)
