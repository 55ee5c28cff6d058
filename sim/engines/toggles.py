"""Switching activity: the number of register bits that change, by submodule, while a component runs."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from amaranth.hdl import Cat, Const, Elaboratable, Fragment, Module, Signal, Value
from amaranth.lib import data
from amaranth.lib.wiring import Component, Out

from blysk.hdl.core.views import copy
from blysk.sim.engines.simulate import Run, simulate

__all__ = ["ToggleCounter", "count_toggles"]

_BITS = 48
_WORD = 32


class ToggleCounter(Component):
    """A component that counts the toggles of its register bits since reset. Each submodule has a counter.

    A toggle is one bit that differs from its value in the cycle before. The counters count the bits of
    registers, and the bits of memories' registered read data. Bits stored in a memory, and bits of
    combinational signals, are left out. A register that changes at one clock edge is in the count after the
    next edge. Counters have 48 bits, because 1000 registers of 18 bits make fewer than 2^48 toggles in 10^10
    cycles.

    Parameters
    ----------
    component : Component
        Component to watch.

    Members
    -------
    i, o, constants, write
        Members of the component.
    status : :py:`Out(StructLayout({path: 48, ...}))`
        Counts, by the path of the submodule: names with dots between them. ``top`` counts the component's own
        registers. Submodules without registers have no count.
    """

    def __init__(self, component: Component):
        self._component = component
        members = {name: member for name, member in component.signature.members.items() if name != "status"}
        paths = _registers(Fragment.get(component, None))
        counts = data.StructLayout(dict.fromkeys(paths, _BITS))
        super().__init__(members | {"status": Out(counts)})

    def elaborate(self, platform):
        """The component, the previous values of its registers, and the counters."""
        m = Module()
        # The component is elaborated here, so that its registers can be found.
        m.submodules.component = fragment = Fragment.get(self._component, platform)
        for name in self.signature.members:
            inner, outer = getattr(self._component, name, None), getattr(self, name)
            if name == "status":
                continue
            if hasattr(outer, "payload"):
                source, sink = (inner, outer) if name == "o" else (outer, inner)
                m.d.comb += [
                    copy(sink.payload, source.payload),
                    sink.valid.eq(source.valid),
                    source.ready.eq(sink.ready),
                ]
            else:
                m.d.comb += copy(inner, outer)
        # The masks are registers that never change. An AND with a constant would become a statement for each
        # bit, which takes minutes to compile.
        masks = [Signal(_WORD, init=mask, name=f"mask_{step}") for step, mask in enumerate(_Ones.MASKS)]
        m.d.sync += [mask.eq(mask) for mask in masks]
        for number, (path, registers) in enumerate(_registers(fragment).items()):
            counts = [_Ones(*word, masks) for word in _words(registers)]
            for index, count in enumerate(counts):
                m.submodules[f"ones_{number}_{index}"] = count
            total = Signal(_BITS, name="total")
            m.d.sync += total.eq(total + _total(counts))
            m.d.comb += self.status[path].eq(total)
        return m


def count_toggles(
    component: Component, beats: np.ndarray | Mapping, *, engine: str = "pysim", **options: Any
) -> tuple[Run, dict[str, int]]:
    """Run a component, and count the toggles of its register bits.

    Parameters
    ----------
    component : Component
        As for `simulate`.
    beats, **options
        Those of `simulate`.
    engine : str
        As for `simulate`. The counters make a build of the compiled engine three times as long, half a minute
        for a pipeline. For a few hundred cycles ``pysim`` is faster.

    Returns
    -------
    run : Run
        Result of `simulate`, with the counts as status.
    toggles : dict of str to int
        Toggles in each submodule by its path, without its own submodules: "top", "datapath",
        "light_0.specular", ...
    """
    counter = ToggleCounter(component)
    run = simulate(counter, beats, engine=engine, **options)
    return run, {path: int(run.status[path]) for path in run.status.dtype.names}


def _registers(fragment: Fragment, path: str = "top") -> dict[str, list[Value]]:
    """Registers of a fragment and its submodules, by path. Registered read data of a memory is a register."""
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


def _init(register: Value) -> int:
    return Const(getattr(register, "init", 0), len(register)).value


def _words(registers: Sequence[Value]) -> Iterator[tuple[Value, int]]:
    """Words of 32 register bits, fewer in the last word, and their values after reset.

    An engine handles such a word in one operation. A single word of all bits would take minutes to compile.
    """
    parts, initial, width = [], 0, 0
    for register in registers:
        start, init = 0, _init(register)
        while start < len(register):
            part = register[start : start + _WORD - width]
            parts.append(part)
            initial |= (init >> start & (1 << len(part)) - 1) << width
            start, width = start + len(part), width + len(part)
            if width == _WORD:
                yield Cat(parts), initial
                parts, initial, width = [], 0, 0
    if parts:
        yield Cat(parts), initial


class _Ones(Elaboratable):
    """Counter of the bits of a word that changed since the cycle before, for each byte.

    Each byte of ``bytes`` counts the bits that differ in the same byte of the word. The counter is a module
    of its own, so that an event-driven engine evaluates little again after a change.
    """

    # Neighbouring fields of 1, then 2, then 4 bits are added.
    MASKS = tuple(((1 << _WORD) - 1) // ((1 << 2 * field) - 1) * ((1 << field) - 1) for field in (1, 2, 4))

    def __init__(self, now: Value, init: int, masks: Sequence[Value]):
        self._now, self._init, self._masks = now, init, masks
        self.bytes = Signal(_WORD)

    def elaborate(self, platform):
        m = Module()
        before = Signal(len(self._now), init=self._init)
        m.d.sync += before.eq(self._now)
        ones = self._now ^ before
        for step, mask in enumerate(self._masks):
            fields = Signal(_WORD, name=f"fields_{step}")
            m.d.comb += fields.eq((ones & mask) + ((ones >> (1 << step)) & mask))
            ones = fields
        m.d.comb += self.bytes.eq(ones)
        return m


def _total(counts: Sequence[_Ones]) -> Value:
    """Sum of all bytes. Each is at most 8, so that the sum of one byte over 31 words is less than 256."""
    total = Const(0)
    for start in range(0, len(counts), 31):
        bytes_ = sum((count.bytes for count in counts[start : start + 31]), Const(0, _WORD))[:_WORD]
        total = total + sum((bytes_.word_select(k, 8) for k in range(_WORD // 8)), Const(0))
    return total
