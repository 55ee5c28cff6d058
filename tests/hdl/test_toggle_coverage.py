"""Toggle coverage: under the tests' vectors every bit of every device's registers rises and falls."""

import re

import numpy as np
import pytest
from amaranth.hdl import Fragment, Signal
from amaranth.lib import data
from amaranth.lib.wiring import Out

from bench.mutants import DEVICES, Wrapped, vectors_of
from sim.cxxrtl import Model
from sim.toggles import _registers, _words

# Bits that cannot toggle, by device and reason: registers with their bits. The list is exact.
SQUARE = "the second bit of a square is 0"
STILL = {
    "chord": {
        SQUARE: "datapath.multiplier_{0,1,2}_product{_0,}[1] datapath.u_square_2_8[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.multiplier_{0,1,2}_product{_0,}[35] datapath.u_square_2_8[35] "
            "datapath.u_square_partial[36] datapath.u_square_total[36-37] datapath.u_aligned[38-39]"
        ),
    },
    "half_chord": {
        "operands are not negative, and less than 1": (
            "datapath.multiplier_0_{a,b}_{0,1}[17] datapath.multiplier_0_{0,1}[17] "
            "datapath.multiplier_0_product{_0,}[34-35]"
        ),
        "from 0 to 90 degrees the factor is 0.636 to 0.708": "datapath.total[14-18] datapath.factor[14-16]",
        "inner sums of its polynomial are smaller still": "datapath.total_3[15-16] datapath.total_2[16]",
        "a root is 1 at most, and that only by rounding": "datapath.root_sum[21] datapath.root_rounded[18]",
    },
    "renormaliser": {
        "a vector comes on every clock, and is taken": (
            "datapath.dot_product.ages[0-2] datapath.dot_product.held[0]"
        ),
        SQUARE: "datapath.dot_product.datapath.{product_0,product_1,product_2,last_product}[1]",
        "a sum of three squares, each up to 2^34, is not negative, and less than 2^36": (
            "datapath.dot_product.datapath.{product_0,product_1,product_2,last_product}[35] "
            "datapath.dot_product.datapath.partial_sum[36] "
            "datapath.dot_product.{datapath.sum,spare}[36-37]"
        ),
    },
    "highlight_cosine": {
        "the table's last value with all of its rise is a step less than 1": "wave.v_6[22]",
        "a product of a number less than 1 and one up to 1 is less than 2": "wave.term_10[26]",
    },
    "power": {
        SQUARE: "datapath.x_{0-8}_product[1]",
        "twice a number is even": "datapath.x_{0-8}_sum[0]",
        "p + q - pq is not negative where p and q are 0 to 1": (
            "datapath.x_{0-8}_difference[35] datapath.s_{1-9}_difference[35]"
        ),
    },
    "intensity": {
        "three terms of 8 times the full channel are 6120, less than 2^13": "datapath.rounded_{r,g,b}[13]"
    },
    "quadratic_evaluator": {
        SQUARE: "polynomial.datapath.square[1]",
        "a square is not negative": "polynomial.datapath.square[35]",
        "a reciprocal is normalised, so that its first bit is 1": (
            "step.datapath.reciprocal{,s.port__data}[17]"
        ),
        "a length of 12 bits takes shifts up to 12": "step.datapath.shift[4]",
    },
}

DEVICES_COVERED = ("diffuse", "dot_product", "gpq", "difference_accumulator", "recurrence", *STILL)


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


def expanded(text):
    """Names that a text with ``{a,b}``, ``{0-8}`` and ``[14-18]`` stands for."""
    if found := re.search(r"\{([^{}]*)\}", text):
        parts = [part for choice in found[1].split(",") for part in spread(choice)]
        return [n for part in parts for n in expanded(text[: found.start()] + part + text[found.end() :])]
    word, bits = re.fullmatch(r"(.*)\[(.*)\]", text).groups()
    return [f"{word}[{bit}]" for bit in spread(bits)]


def spread(text):
    """Numbers of a range, ``0-8``; else the text itself."""
    found = re.fullmatch(r"(\d+)-(\d+)", text)
    return [str(n) for n in range(int(found[1]), int(found[2]) + 1)] if found else [text]


@pytest.mark.long
@pytest.mark.parametrize("name", DEVICES_COVERED)
def test_every_register_bit_rises_and_falls(name):
    device = DEVICES[name]
    argued = [n for words in STILL.get(name, {}).values() for word in words.split() for n in expanded(word)]
    assert set(still_bits(device.unit(), vectors_of(name), device.within)) == set(argued)
