"""Toggle coverage: under the tests' vectors every bit of every device's registers rises and falls."""

import numpy as np
import pytest
from amaranth.hdl import Fragment, Signal
from amaranth.lib import data
from amaranth.lib.wiring import Out

from bench.mutants import DEVICES, Wrapped, vectors_of
from sim.cxxrtl import Model
from sim.toggles import _registers, _words

# Bits that cannot toggle, or that only spans or angles outside of a device's domain would toggle.


class Edges(Wrapped):
    """A unit, and of each bit of its registers whether it has risen, and whether it has fallen.

    Registers are put together in words of 32 bits, as for `sim.toggles.ToggleCounter`.
    """

    def __init__(self, unit, within=""):
        self.within = within
        registers = self.registers(Fragment.get(unit, None))
        self.names = [f"{path}[{bit}]" for path, signal in registers for bit in range(len(signal))]
        edges = data.ArrayLayout(32, -(-len(self.names) // 32))
        super().__init__(unit, status=Out(data.StructLayout({"rose": edges, "fell": edges})))

    def registers(self, fragment):
        """Path and signal of each, in a fixed order."""
        return [
            (f"{path}.{getattr(signal, 'name', 'data')}", signal)
            for path, signals in _registers(fragment).items()
            if path == self.within or path.startswith(f"{self.within}." if self.within else "")
            for signal in signals
        ]

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = fragment = Fragment.get(self.unit, platform)
        for index, (now, init) in enumerate(_words([signal for _, signal in self.registers(fragment)])):
            before = Signal(len(now), init=init)
            rose, fell = Signal(len(now), name="rose"), Signal(len(now), name="fell")
            m.d.sync += [before.eq(now), rose.eq(rose | now & ~before), fell.eq(fell | before & ~now)]
            m.d.comb += [self.status.rose[index].eq(rose), self.status.fell[index].eq(fell)]
        return m


def still_bits(unit, vectors, within=""):
    """Names of the register bits that do not rise, or do not fall."""
    edges = Edges(unit, within)
    model = Model(edges)
    seen = np.bitwise_or.reduce([model.run(stimulus, None).status[0] for stimulus, _ in vectors])
    rose, fell = np.unpackbits(seen.astype("<u4").view(np.uint8), bitorder="little").reshape(2, -1)
    return [name for name, up, down in zip(edges.names, rose, fell, strict=False) if not (up and down)]


@pytest.mark.long
@pytest.mark.parametrize("name", ["diffuse", "dot_product", "gpq", "difference_accumulator"])
def test_every_register_bit_rises_and_falls(name):
    device = DEVICES[name]
    assert still_bits(device.unit(), vectors_of(name), device.within) == []
