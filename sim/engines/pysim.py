"""The interpreted engine, Amaranth's own simulator.

It needs no compiler, is slow, and can write waveforms.
"""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

import numpy as np
from amaranth.hdl import Value
from amaranth.lib.wiring import Component
from amaranth.sim import Simulator

from blysk.sim.engines.beats import word_count
from blysk.sim.engines.engine import Drive, Ports, StopReason, Trace

__all__ = ["Interpreted"]

_BATCH = 1000
_PERIOD = 1e-8

_RECURSION = 20_000
"""Python's recursion limit while the simulator compiles: a memory's enable becomes a nested expression with a
term for every bit."""


def _codes(words: np.ndarray) -> list[int]:
    """Beats of any width, each as one Python integer."""
    return [int.from_bytes(row.tobytes(), "little") for row in words.astype("<u4")]


def _words(codes: list[int], width: int) -> np.ndarray:
    raw = b"".join(code.to_bytes(4 * width, "little") for code in codes)
    return np.frombuffer(raw, dtype="<u4").astype(np.uint32).reshape(len(codes), width)


@contextmanager
def _deep_expressions() -> Iterator[None]:
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, _RECURSION))
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)


class Interpreted:
    """A component for Amaranth's simulator.

    Parameters
    ----------
    component : Component
        Component to simulate.
    vcd : str, optional
        VCD file for the waveforms. Each run overwrites it.
    """

    def __init__(self, component: Component, vcd: str | None = None):
        self.component = component
        self.ports = Ports(component)
        self.vcd = vcd

    def run(self, drive: Drive, progress: Callable[[int], object] | None = None) -> Trace:
        """Run from power-up; see `engine.Prepared`.

        Raises
        ------
        ValueError
            If the component has nothing in the clock domain ``sync``.
        """
        result: list[Trace] = []

        async def bench(ctx):
            result.append(await self._drive(ctx, drive, progress))

        with _deep_expressions():
            simulator = Simulator(self.component)
        try:
            simulator.add_clock(_PERIOD)
        except NameError:
            raise ValueError(
                f"{type(self.component).__name__} has nothing in the clock domain sync"
            ) from None
        simulator.add_testbench(bench)
        with simulator.write_vcd(self.vcd) if self.vcd else nullcontext():
            simulator.run()
        return result[0]

    async def _drive(self, ctx, drive: Drive, progress) -> Trace:
        component, ports = self.component, self.ports
        # Raw bits, whatever the payload's shape.
        input_payload = Value.cast(component.i.payload).as_unsigned()
        output_payload = Value.cast(component.o.payload).as_unsigned()
        inputs, writes = _codes(drive.input), _codes(drive.write)
        after = [0] * len(writes) if drive.write_after is None else drive.write_after.tolist()
        input_stalls, output_stalls = drive.input_stalls.tolist(), drive.output_stalls.tolist()
        count = drive.count
        if drive.constants.size:
            ctx.set(Value.cast(component.constants).as_unsigned(), _codes(drive.constants)[0])
        if ports.write is not None:
            write_payload = Value.cast(component.write.payload).as_unsigned()
            ctx.set(write_payload, -1)

        output: list[int] = []
        cycles: list[int] = []
        input_cycles: list[int] = []
        written, offered, held = 0, False, None
        clock, last, end = 0, -1, StopReason.LIMIT
        ctx.set(input_payload, -1)
        while clock != drive.limit:
            complete = count is not None and len(input_cycles) == len(inputs) and len(output) == count
            if complete and written == len(writes) and clock - last > drive.settle:
                end = StopReason.DONE
                break
            if clock - last > drive.idle_timeout:
                end = (
                    StopReason.DONE
                    if count is None and len(input_cycles) == len(inputs)
                    else StopReason.STUCK
                )
                break

            writing = written < len(writes) and len(input_cycles) >= after[written]
            if writing:
                ctx.set(component.write.valid, 1)
                ctx.set(write_payload, writes[written])
            if (
                not (offered or (writing and after[written] == 0))
                and len(input_cycles) < len(inputs)
                and not input_stalls[clock % len(input_stalls)]
            ):
                offered = True
                ctx.set(component.i.valid, 1)
                ctx.set(input_payload, inputs[len(input_cycles)])
            ready = not output_stalls[clock % len(output_stalls)]
            ctx.set(component.o.ready, ready)

            valid = ctx.get(component.o.valid)
            payload = ctx.get(output_payload) if valid else None
            if held is not None and payload != held:
                end = StopReason.CHANGED if valid else StopReason.DROPPED
                break
            if valid and len(output) == count:
                end = StopReason.EXTRA
                break
            held = payload if valid and not ready else None
            write_moves = writing and ctx.get(component.write.ready)
            input_moves = offered and ctx.get(component.i.ready)
            if valid and ready:
                output.append(payload)
                cycles.append(clock)
                last = clock
            if write_moves:
                written += 1
                last = clock
            if input_moves:
                input_cycles.append(clock)
                offered = False
                last = clock

            await ctx.tick()
            clock += 1
            if write_moves:
                ctx.set(component.write.valid, 0)
                ctx.set(write_payload, -1)
            if input_moves:
                ctx.set(component.i.valid, 0)
                ctx.set(input_payload, -1)
            if progress and clock % _BATCH == 0:
                progress(len(output))

        status = np.zeros((1, 0), dtype=np.uint32)
        if ports.status is not None:
            whole = end in (StopReason.DONE, StopReason.LIMIT)
            code = ctx.get(Value.cast(component.status).as_unsigned()) if whole else 0
            status = _words([code], word_count(ports.status))
        return Trace(
            end=end,
            clock=clock,
            total_cycles=last + 1,
            write_count=written,
            output=_words(output, word_count(ports.o)),
            cycles=np.array(cycles, dtype=np.int64),
            input_cycles=np.array(input_cycles, dtype=np.int64),
            status=status,
        )
