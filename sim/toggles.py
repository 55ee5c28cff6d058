"""Switching activity: how many register bits change, by submodule, while a component runs."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from amaranth.hdl import Cat, Const, Fragment, Module, Signal, Value
from amaranth.lib import data
from amaranth.lib.wiring import Component, Out

from .engine import Run, simulate

__all__ = ["ToggleCounter", "count_toggles"]

_BITS = 48


class ToggleCounter(Component):
    """A component with a counter beside each of its submodules: register bits that have changed since reset.

    Counted are registers and the words that memories give on a clock, each bit on each clock on which it
    differs from the clock before; not the bits inside a memory, and no wires. A change is in the count two
    clocks later. Counters have 48 bits: 2^48 toggles are more than 1000 registers of 18 bits make in
    10^10 clocks.

    Parameters
    ----------
    component : Component
        Component to be watched.

    Members
    -------
    i, o, constants, write
        Those of the component.
    status : :py:`Out(StructLayout({path: 48, ...}))`
        Counts, by the submodules' names with dots between; ``top`` for the component's own registers.
    """

    def __init__(self, component: Component):
        self._component = component
        members = {name: member for name, member in component.signature.members.items() if name != "status"}
        paths = _registers(Fragment.get(component, None))
        counts = data.StructLayout(dict.fromkeys(paths, _BITS))
        super().__init__(members | {"status": Out(counts)})

    def elaborate(self, platform):
        """The component, what its registers were, and sums."""
        m = Module()
        # Elaborated here, so that it is known which signals are registers.
        m.submodules.component = fragment = Fragment.get(self._component, platform)
        for name in self.signature.members:
            inner, outer = getattr(self._component, name, None), getattr(self, name)
            if name == "status":
                continue
            if hasattr(outer, "payload"):
                source, sink = (inner, outer) if name == "o" else (outer, inner)
                m.d.comb += [
                    Value.cast(sink.payload).eq(Value.cast(source.payload)),
                    sink.valid.eq(source.valid),
                    source.ready.eq(sink.ready),
                ]
            else:
                m.d.comb += Value.cast(inner).eq(Value.cast(outer))
        for path, registers in _registers(fragment).items():
            now = Cat(registers)
            init = Cat(_init(register) for register in registers)
            before = Signal(len(now), init=Const.cast(init).value, name="before")
            total = Signal(_BITS, name="total")
            m.d.sync += [before.eq(now), total.eq(total + _ones(m, now ^ before))]
            m.d.comb += self.status[path].eq(total)
        return m


def count_toggles(
    component: Component, beats: np.ndarray | Mapping, *, engine: str = "pysim", **options: Any
) -> tuple[Run, dict[str, int]]:
    """Run a component, and count the toggled bits of its registers.

    Parameters
    ----------
    component : Component
        As for `simulate`.
    beats, **options
        Those of `simulate`.
    engine : str
        As for `simulate`. The sums take the compiled engine over a minute to build; for a small frame the
        interpreted one is done before.

    Returns
    -------
    run : Run
        What `simulate` gives, but for the status.
    toggles : dict of str to int
        Toggled bits of each submodule, without those inside it: "top", "datapath", "light_0.specular", ...
    """
    counter = ToggleCounter(component)
    run = simulate(counter, beats, engine=engine, **options)
    return run, {path: int(run.status[path]) for path in run.status.dtype.names}


def _registers(fragment: Fragment, path: str = "top") -> dict[str, list[Value]]:
    """What a fragment and those inside drive on a clock, by path."""
    registers: list[Value] = []
    for domain, statements in fragment.statements.items():
        if domain != "comb":
            registers += statements._lhs_signals()
    for port in getattr(fragment, "_read_ports", ()):
        if port._domain != "comb":
            registers.append(port._data)
    found = {path: registers} if registers else {}
    for index, (inner, name, *_) in enumerate(fragment.subfragments):
        name = name or f"unnamed_{index}"
        found |= _registers(inner, name if path == "top" else f"{path}.{name}")
    return found


def _init(register: Value) -> Const:
    return Const(getattr(register, "init", 0), len(register))


def _ones(m: Module, bits: Value) -> Value:
    """Number of ones: sums of neighbours in fields of 2, 4, 8, ... bits, all of a size at once."""
    width, field = 1 << (len(bits) - 1).bit_length(), 1
    while field < width:
        fields = Signal(width)
        m.d.comb += fields.eq(bits)
        # Every other field of all.
        mask = ((1 << width) - 1) // ((1 << 2 * field) - 1) * ((1 << field) - 1)
        bits = ((fields & mask) + (fields[field:] & mask))[:width]
        field *= 2
    return bits
