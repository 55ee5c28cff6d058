"""Record of the registers behind a bus."""

from functools import partial

import numpy as np

from blysk.bench.units.record import Case, Record, Stimulus, Variant
from blysk.golden.bus.registers import (
    RegisterFile,
    RegisterMap,
    constant_registers,
    frame_registers,
)
from blysk.golden.presets import preset
from blysk.hdl.bus.registers import RegistersUnit

__all__ = ["RECORD"]

_COUNTERS = (
    ("pixels", 32, "pixels"),
    ("empty", 16, "empty spans"),
    ("overrun", 1, "past the last column"),
)


def _expect(unit, case):
    busy = bool(case.constants["busy"])
    file = RegisterFile(unit.model, {name: case.constants[name] for name, *_ in _COUNTERS})
    beats = (case.beats[name].tolist() for name in ("address", "data", "write", "strobe"))
    answers = [
        file.access(address, data if write else None, strobe, busy)
        for address, data, write, strobe in zip(*beats, strict=True)
    ]
    data, causes = zip(*answers, strict=True)
    return {"data": np.array(data), "error": np.array([bool(cause) for cause in causes]).astype(int)}


def _accesses(unit, rng, count, busy=0):
    """Reads and writes at addresses of registers and at others. Most values fit. Values are read back."""
    registers = unit.model.registers
    chosen = rng.integers(0, len(registers), count)
    address = np.array([register.address for register in registers])[chosen]
    width = np.array([register.width for register in registers])[chosen]
    code = rng.integers(0, 1 << 32, count) >> (32 - width)
    signed = np.array([register.signed for register in registers])[chosen]
    negative = signed & (code >> (width - 1) & 1 == 1)
    data = code | np.where(negative, (1 << 32) - (1 << width), 0)
    kind = rng.random(count)
    data ^= np.where(kind < 0.1, 1 << rng.integers(0, 32, count), 0)
    address = np.where((kind > 0.1) & (kind < 0.15), address ^ 1 << rng.integers(0, 12, count), address)
    strobe = np.where((kind > 0.15) & (kind < 0.2), rng.integers(0, 15, count), 15)
    data = np.where((kind > 0.2) & (kind < 0.25), rng.choice([0, (1 << 32) - 1], count), data)
    named = [registers.index(unit.model[name]) for name in ("errors", "refused")]
    named += [registers.index(register) for register in unit.model.picture]
    # Every third access reads a register that an earlier access may have changed.
    back = np.arange(count) % 3 == 2
    again = np.array([registers[k].address for k in named])[rng.integers(0, len(named), count)]
    counters = {name: int(rng.integers(0, 1 << width)) for name, width, _ in _COUNTERS}
    beats = {
        "address": np.where(back, again, address),
        "write": np.where(back, 0, rng.integers(0, 2, count)),
        "data": data,
        "strobe": strobe,
    }
    return Case(beats, {"busy": busy} | counters)


def _busy(unit, rng, count):
    """Reads and writes at addresses of registers and at other addresses, while a frame is inside."""
    return _accesses(unit, rng, count, 1)


def _borders(unit, rng, count):
    """Least and largest values of each register, and the values next to them. Then each register is read."""
    accesses = []
    for register in unit.model.registers:
        half, whole = 1 << register.width - 1, 1 << register.width
        ends = {end + step for end in (0, half - 1, half, whole - 1) for step in (-1, 0, 1)}
        ends |= {end + step for end in register.range or () for step in (-1, 0, 1)}
        words = {word & 0xFFFFFFFF for end in ends for word in (end, register.extended(end), end | 1 << 31)}
        for word in sorted(words):
            accesses += [(register.address, 1, word, 15), (register.address, 0, 0, 15)]
        # Writes of bytes, of halves and of no byte, at their own addresses and at the word's address.
        for strobe in range(16):
            first = register.address + max((strobe & -strobe).bit_length() - 1, 0)
            accesses += [(place, 1, 0xFFFFFFFF, strobe) for place in (register.address, first)]
            accesses += [(register.address | strobe & 3, 0, 0, strobe)]
    names = "address", "write", "data", "strobe"
    beats = dict(zip(names, np.array(accesses).T, strict=True))
    counters = {name: (1 << width) - 1 for name, width, _ in _COUNTERS}
    return Case(beats, {"busy": 0} | counters)


def _decoding(unit, rng, count):
    """Reads and writes, some of no byte, at addresses that differ in one bit from a register's address."""
    address = np.array([register.address for register in unit.model.registers])
    address = (address[:, np.newaxis] ^ 1 << np.arange(12)).ravel()
    thrice = np.tile(address, 3)
    kind = np.arange(len(thrice)) // len(address)
    beats = {"address": thrice, "write": (kind > 0).astype(int), "data": np.zeros_like(thrice)}
    counters = {name: (1 << width) - 1 for name, width, _ in _COUNTERS}
    return Case(beats | {"strobe": np.where(kind == 2, 0, 15)}, {"busy": 0} | counters)


def _map(lights, materials=1):
    design = preset(model="cosquad", lights=lights, materials=materials)
    return RegisterMap("core", _COUNTERS, frame_registers(), constant_registers(design))


RECORD = Record(
    name="registers",
    title="Registers behind a bus",
    source="docs/theory/bus.md#registers",
    variants={
        "": Variant(partial(RegistersUnit, _map(1))),
        "4 lights, 3 materials": Variant(partial(RegistersUnit, _map(4, 3))),
    },
    expect=_expect,
    stimuli={
        "accesses": Stimulus(_accesses, 2000),
        "busy": Stimulus(_busy, 500),
        "borders": Stimulus(_borders, stalled=False),
        "decoding": Stimulus(_decoding, stalled=False),
    },
    axis="",
)
