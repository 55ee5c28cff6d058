"""Timing diagrams of a unit's streams, from a simulation."""

from dataclasses import dataclass
from itertools import groupby
from string import ascii_uppercase

import numpy as np
from amaranth.hdl import Value
from amaranth.lib.wiring import Component
from amaranth.sim import Simulator
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from blysk.bench.units.record import Case, UnitRun
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.engine import Ports
from blysk.sim.engines.simulate import stimulus_of

__all__ = ["Waves", "draw_timing", "waves_of"]

_BEATS, _MOST_RESULTS, _MOST_COLUMNS = 3, 6, 44
"""Default number of input beats, largest number of results, and largest number of columns of a diagram."""

PIXELS = 3
"""Pixels of a span in a diagram, if the unit makes pixels of spans."""

_HANDSHAKES = ("i.valid", "i.ready", "o.valid", "o.ready")

_PERIOD = 1e-8
_IDLE_TIMEOUT = 5000

_CLOCK, _ROW = 22.0, 22.0
_MARGIN = 58.0
_INK, _FILLS = "#222222", ("#cfe0f3", "#f9dcc0", "#d5ecd5", "#eadcf2")
QUIET = 7
"""Largest number of cycles without a change that a diagram shows in full."""


@dataclass(frozen=True)
class Waves:
    """The handshakes of a simulation, cycle by cycle, with the levels before the rising edge.

    Parameters
    ----------
    levels : dict of str to bool array
        ``i.valid``, ``i.ready``, ``o.valid`` and ``o.ready``.
    inputs, outputs : list of (str or None)
        Name of the beat that each stream offers in a cycle. ``None``: no beat.
    """

    levels: dict[str, np.ndarray]
    inputs: list[str | None]
    outputs: list[str | None]

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.inputs)


def waves_of(unit: Component, beat: dict | None = None, example: UnitRun | None = None) -> Waves:
    """Simulate a unit with a pause of the source and a stall of the sink.

    The source pauses for two cycles before its last beat. The sink is not ready for two cycles at the first
    result, or at the second result if a beat has several. While no beat is offered, every bit of the payload
    is 1.

    Parameters
    ----------
    unit : Component
        Unit.
    beat : dict, optional
        Fields of three input beats. Other fields and the constants are 0. A field ``length`` is replaced by
        `PIXELS`. A beat is then a span with this number of results.
    example : UnitRun, optional
        Beats, constants and earlier writes, in place of ``beat``. The simulation ends with the first few
        results.

    Raises
    ------
    RuntimeError
        If results are missing.
    """
    case, results = _case_of(unit, beat or {}) if example is None else (example.case, example.count)
    sent = stimulus_of(unit, case.beats, count=None, **case.sent)
    codes, constants, writes = (_codes(words) for words in (sent.input, sent.constants, sent.write))
    several, shown = results > len(codes), min(results, _MOST_RESULTS if example else results)
    input_payload = Value.cast(unit.i.payload).as_unsigned()
    history: list[tuple[bool, ...]] = []

    async def bench(ctx):
        for code in constants:
            ctx.set(Value.cast(unit.constants).as_unsigned(), code)
        for code in writes:
            ctx.set(Value.cast(unit.write.payload).as_unsigned(), code)
            ctx.set(unit.write.valid, 1)
            await ctx.tick().until(unit.write.ready)
            ctx.set(unit.write.valid, 0)
        taken, given, pause, stall, after = 0, 0, 2, 2, 2
        ctx.set(input_payload, -1)
        while after:
            offered = taken < len(codes) and (taken < len(codes) - 1 or not pause)
            pause -= taken == len(codes) - 1 and pause > 0
            ctx.set(unit.i.valid, offered)
            ctx.set(input_payload, codes[taken] if offered else -1)
            stalled = stall > 0 and given == several and ctx.get(unit.o.valid)
            stall -= stalled
            ctx.set(unit.o.ready, not stalled)
            levels = tuple(bool(ctx.get(getattr(getattr(unit, n[0]), n[2:]))) for n in _HANDSHAKES)
            history.append(levels)
            taken += levels[0] and levels[1]
            given += levels[2] and levels[3]
            after -= given >= shown
            if len(history) > _IDLE_TIMEOUT:
                raise RuntimeError(f"{type(unit).__name__} gave {given} of {results} results")
            await ctx.tick()

    simulator = Simulator(unit)
    simulator.add_clock(_PERIOD)
    simulator.add_testbench(bench)
    simulator.run()
    levels = dict(zip(_HANDSHAKES, np.array(history).T, strict=True))
    beats = [_letter(k) for k in range(len(codes))]
    if results == len(codes):
        made = beats
    elif example is None:
        made = [f"{letter}{k}" for letter in beats for k in range(PIXELS)]
    else:
        made = [str(k + 1) for k in range(results)]
    return Waves(
        levels,
        _offered(levels["i.valid"], levels["i.ready"], beats),
        _offered(levels["o.valid"], levels["o.ready"], made),
    )


def _case_of(unit: Component, beat: dict) -> tuple[Case, int]:
    """Three beats of some fields, and the number of their results."""
    ports = Ports(unit)
    beats = np.zeros(_BEATS, dtype_of(ports.i))
    for name, value in beat.items():
        beats[name] = PIXELS if name == "length" else value
    constants = None if ports.constants is None else np.zeros((), dtype_of(ports.constants))
    return Case(beats, constants), _BEATS * (PIXELS if "length" in beat else 1)


def _codes(words: np.ndarray) -> list[int]:
    """Beats as whole numbers, for the simulator."""
    return [int.from_bytes(row.astype("<u4").tobytes(), "little") for row in words]


def _letter(k: int) -> str:
    return ascii_uppercase[k % 26] + str(k // 26) * (k >= 26)


def _offered(valid: np.ndarray, ready: np.ndarray, names: list[str]) -> list[str | None]:
    """Name of the offered beat in each cycle. This is the next beat after the moved beats."""
    moved = np.cumsum(valid & ready) - (valid & ready)
    return [names[k] if is_valid else None for k, is_valid in zip(moved, valid, strict=True)]


def _shown(waves: Waves) -> list[int | None]:
    """Cycles of the diagram. ``None`` stands for cycles that are left out."""
    states = [
        (
            waves.levels["i.valid"][k],
            # While no beat is offered, ready has no effect.
            waves.levels["i.valid"][k] and waves.levels["i.ready"][k],
            waves.levels["o.valid"][k],
            waves.levels["o.ready"][k],
            waves.inputs[k],
            waves.outputs[k],
        )
        for k in range(waves.cycles)
    ]
    shown: list[int | None] = []
    start = 0
    for _, run in groupby(states):
        length = len(list(run))
        cycles = list(range(start, start + length))
        shown += [*cycles[:2], None, *cycles[-2:]] if length > QUIET else cycles
        start += length
    return shown if len(shown) <= _MOST_COLUMNS else [*shown[:_MOST_COLUMNS], None]


def draw_timing(waves: Waves) -> Figure:
    """Draw the handshakes cycle by cycle.

    A beat moves at the end of a cycle, the rising edge of ``clk``, when valid and ready are both high.
    """
    shown = _shown(waves)
    rows = ["clk", "i.valid", "i.ready", "i.payload", "o.valid", "o.ready", "o.payload"]
    width, height = _MARGIN + _CLOCK * len(shown) + 8, _ROW * len(rows) + 20
    figure = Figure(figsize=(width / 72, height / 72), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_xlim(-_MARGIN, width - _MARGIN)
    axes.set_ylim(height - 14, -6)
    letters: dict[str, int] = {}
    for row, name in enumerate(rows):
        low, high = row * _ROW + 17, row * _ROW + 4
        axes.text(-6, (low + high) / 2, name, ha="right", va="center", fontsize=8, color="black")
        xs, ys = [], []
        for place, clock in enumerate(shown):
            x = place * _CLOCK
            if clock is None:
                continue
            if name == "clk":
                xs += [x, x + _CLOCK / 2, x + _CLOCK / 2, x + _CLOCK]
                ys += [high, high, low, low]
            elif name in waves.levels:
                y = high if waves.levels[name][clock] else low
                xs += [x, x + _CLOCK]
                ys += [y, y]
            if place + 1 < len(shown) and shown[place + 1] is None:
                xs += [x + _CLOCK, x + 2 * _CLOCK]
                ys += [ys[-1], ys[-1]] if ys else []
        if ys:
            axes.plot(xs, ys, color=_INK, linewidth=1.1, solid_joinstyle="miter")
        else:
            beats = waves.inputs if name[0] == "i" else waves.outputs
            _draw_beats(axes, shown, beats, (low, high), letters)
    bottom = len(rows) * _ROW
    for place, clock in enumerate(shown):
        x = place * _CLOCK
        if clock is None:
            axes.fill_between([x + 6, x + _CLOCK - 6], 0, bottom - 2, color="white", linewidth=0, zorder=4)
            axes.text(x + _CLOCK / 2, bottom / 2, "⋯", ha="center", va="center", fontsize=11, zorder=5)
        else:
            axes.plot([x, x], [0, bottom], color="#bbbbbb", linewidth=0.5, linestyle=(0, (1, 2)), zorder=0)
            axes.text(
                x + _CLOCK / 2,
                bottom + 2,
                str(clock),
                ha="center",
                va="center",
                fontsize=6.5,
                color="#666666",
            )
    return figure


def _draw_beats(axes, shown, beats, span, letters) -> None:
    """Draw boxes with the names of the beats that a stream offers."""
    low, high = span
    names = [None if clock is None else beats[clock] for clock in shown]
    # Cycles that are left out have the same levels as the cycles before and after them.
    names = [
        names[k - 1] if clock is None else name
        for k, (name, clock) in enumerate(zip(names, shown, strict=True))
    ]
    start = 0
    for name, run in groupby(names):
        end = start + len(list(run))
        if name is None:
            axes.plot([start * _CLOCK, end * _CLOCK], [(low + high) / 2] * 2, color="#999999", linewidth=0.9)
        else:
            fill = _FILLS[letters.setdefault(name[0], len(letters)) % len(_FILLS)]
            left, right, middle = start * _CLOCK, end * _CLOCK, (low + high) / 2
            axes.fill(
                [left, left + 3, right - 3, right, right - 3, left + 3],
                [middle, high, high, middle, low, low],
                facecolor=fill,
                edgecolor=_INK,
                linewidth=0.9,
            )
            axes.text((left + right) / 2, middle, name, ha="center", va="center", fontsize=7.5, zorder=6)
        start = end
