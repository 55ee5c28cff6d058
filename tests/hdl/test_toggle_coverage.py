"""Toggle coverage: with the vectors of its record every register bit of a unit rises and falls, or is waived.

Parts of a unit that have a record are covered by the vectors of this record.
"""

import re
import sys
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np
import pytest
from amaranth.hdl import Fragment, Signal
from amaranth.lib import data
from amaranth.lib.wiring import Out

from blysk.bench.quality.mutation import Wrapped, stimuli_of, units_inside
from blysk.bench.units.registry import RECORDS
from blysk.sim.engines.cxxrtl import Compiled
from blysk.sim.engines.cxxrtl_source import netlist_of
from blysk.sim.engines.toggles import _registers, _words

from ..decided import digest_of


class Edges(Wrapped):
    """A unit that counts, for each bit of its registers, whether it has risen and fallen.

    Registers are joined into words of 32 bits, as for `ToggleCounter`.
    """

    def __init__(self, unit):
        registers = self.registers(Fragment.get(unit, None))
        self.names = [f"{path}[{bit}]" for path, signal in registers for bit in range(len(signal))]
        edges = data.ArrayLayout(32, -(-len(self.names) // 32))
        super().__init__(unit, status=Out(data.StructLayout({"toggled": edges})))

    def registers(self, fragment):
        """Path and signal of each register, in a fixed order."""
        others = tuple(f"{path}." for path in units_inside(fragment))
        return [
            (f"{path}.{getattr(signal, 'name', 'data')}", signal)
            for path, signals in _registers(fragment).items()
            if not f"{path}.".startswith(others)
            for signal in signals
        ]

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = fragment = Fragment.get(self.unit, platform)
        for index, (now, init) in enumerate(_words([signal for _, signal in self.registers(fragment)])):
            before = Signal(len(now), init=init)
            rose, fell = Signal(len(now), name="rose"), Signal(len(now), name="fell")
            m.d.sync += [before.eq(now), rose.eq(rose | now & ~before), fell.eq(fell | before & ~now)]
            m.d.comb += self.status.toggled[index].eq(rose & fell)
        return m


def still_bits(edges, stimuli):
    """Names of the register bits of a record's default variant that do not rise, or do not fall."""
    model = Compiled(edges)
    seen = np.bitwise_or.reduce([model.run(stimulus, None).status[0] for stimulus in stimuli])
    toggled = np.unpackbits(seen.astype("<u4").view(np.uint8), bitorder="little")
    return [name for name, both in zip(edges.names, toggled, strict=False) if not both]


def expanded(text):
    """Names that a text with ``{a,b}``, ``{0-8}`` and ``[14-18]`` stands for."""
    if found := re.search(r"\{([^{}]*)\}", text):
        parts = [part for choice in found[1].split(",") for part in spread(choice)]
        return [n for part in parts for n in expanded(text[: found.start()] + part + text[found.end() :])]
    word, bits = re.fullmatch(r"(.*)\[(.*)\]", text).groups()
    return [f"{word}[{bit}]" for bit in spread(bits)]


def spread(text):
    """Numbers of a range such as ``0-8``; otherwise the text itself."""
    found = re.fullmatch(r"(\d+)-(\d+)", text)
    return [str(n) for n in range(int(found[1]), int(found[2]) + 1)] if found else [text]


@pytest.fixture
def long_numbers():
    """Python is allowed long numbers, because Amaranth writes a mask of all registers as a decimal number."""
    digits = sys.get_int_max_str_digits()
    sys.set_int_max_str_digits(0)
    yield
    sys.set_int_max_str_digits(digits)


def pattern_of(word, bit):
    """A waived bit as a pattern, in which brackets stand for themselves."""
    return f"*{word}[[]{bit}]"


def with_variant(name, variant, still):
    """A record with one of its variants alone, and further bits that stay the same."""
    record = RECORDS[name]
    return replace(record, variants={variant: record.variants[variant]}, still={**record.still, **still})


OTHERS = {
    "quotient_lanes, 4 lanes": with_variant(
        "quotient_lanes",
        "N.H, 4 lanes",
        {
            "words of the first lane change by four times a step": "line_0[1] line_0_base[1] line_0_of_0[1] "
            "line_0_of_2[0] height_0[1]",
            "a step from beat to beat is even": "step_{0,1}[0] square_{0,1}[0] square_{0,1}_base[0] "
            "square_{0,1}_of_0[0]",
            "the second difference of w is less than 2": "kept_1[48]",
        },
    ),
}
"""Further structures, by name, besides the default variants."""


@pytest.mark.long
@pytest.mark.usefixtures("long_numbers")
@pytest.mark.parametrize("name", [*RECORDS, *OTHERS])
def test_every_register_bit_rises_and_falls(name, decided):
    """Every waiver is needed: each matches a bit that does not rise and fall.

    Units are run again if their netlist, their stimuli or their waivers change.
    """
    record = RECORDS[name] if name in RECORDS else OTHERS[name]
    unit = record.variants[record.default].unit()
    edges = Edges(unit)
    if not edges.names:
        pytest.skip("all its registers are in parts that have a record")
    stimuli = stimuli_of(record, unit)
    digest = digest_of("toggles", netlist_of(edges), record.still, [vars(of) for of in stimuli])
    if decided.knows(digest):
        return
    still = still_bits(edges, stimuli)
    waived = [n for words in record.still.values() for word in words.split() for n in expanded(word)]
    patterns = [pattern_of(*re.fullmatch(r"(.*)\[(.*)\]", bit).groups()) for bit in waived]
    # A copy of a signal for a later stage has the name of the signal and a number.
    names = {bit: (bit, re.sub(r"_\d+(?=\[\d+\]$)", "", bit)) for bit in still}
    open_bits = [
        bit for bit, known in names.items() if not any(fnmatchcase(n, p) for n in known for p in patterns)
    ]
    assert open_bits == []
    unused = [
        bit
        for bit, pattern in zip(waived, patterns, strict=True)
        if not any(fnmatchcase(n, pattern) for known in names.values() for n in known)
    ]
    assert unused == []
    decided.add(digest)
