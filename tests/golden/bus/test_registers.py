"""Registers as drivers use them: all ones, single bytes, reads of bytes, values past the end."""

from dataclasses import replace

import pytest

from blysk.golden.bus.registers import ERRORS, RegisterFile, RegisterMap, constant_registers, frame_registers
from blysk.golden.presets import preset

DESIGN = preset(model="ggx", materials=3)
DESIGN = replace(DESIGN, specular=replace(DESIGN.specular, banks=3))
MAP = RegisterMap("core", (), frame_registers(), constant_registers(DESIGN))
ONES = 0xFFFFFFFF
ALL = (1 << len(ERRORS)) - 1


@pytest.mark.parametrize(
    ("data", "strobe", "left"),
    [
        (ONES, 15, 0),
        (ONES & ~ALL, 15, ALL),
        (1 << 31 | 0b10, 15, ALL & ~0b10),
        (0, 15, ALL),
        (ONES, 0b0001, 0),
        (ONES, 0b1110, ALL),
        (ONES, 0, ALL),
    ],
)
def test_a_one_clears_its_bit_and_none_that_there_is_not(data, strobe, left):
    """Ones may be written to any byte of the register, also while a frame is inside."""
    for place in range(0x00C, 0x00C + (4 if strobe != 15 else 1)):
        file = RegisterFile(MAP, {"errors": ALL})
        assert file.access(place, data, strobe, busy=True) == (0, "")
        assert file.access(0x00C) == (left, "")


@pytest.mark.parametrize(
    ("name", "held", "refused"),
    [
        ("left", [-2048, -1, 0, 2048], [-4096, -2049, 2049, 4095, 1 << 13]),
        ("back_faces", [0, 1, 2], [3, 4, ONES]),
        ("material", [0, 1, 2], [3, 4, 5, 1 << 17, ONES]),
        ("bank", [0, 1, 2], [3, 4, 1 << 17, ONES]),
        ("exponent", [1, 1000], [1 << 10, ONES]),
    ],
)
def test_values_past_the_end_are_refused(name, held, refused):
    address = MAP[name].address
    for value in held:
        assert RegisterFile(MAP).access(address, value & ONES) == (0, "")
    for value in refused:
        assert RegisterFile(MAP).access(address, value & ONES) == (0, "value")


def test_accesses_of_bytes():
    """A read of a byte gives its word, as on a bus.

    A write of a byte is accepted only if no bit outside the byte counts.
    """
    file = RegisterFile(MAP, {"left": 0x123})
    for byte in range(4):
        assert file.access(0x040 + byte) == (0x123, "")
        assert file.access(0x040 + byte, 0x55, 1 << byte) == (0, "strobe")
        assert file.access(0x040 + byte, 0x55, 0) == (0, "")
        assert file.access(0x000 + byte, 0, 0) == (0, "")
        assert file.access(0x03C + byte, 0, 0) == (0, "unmapped")
    assert file.access(0x041, 0x55) == (0, "unmapped")
    assert file.access(0x000, 0x55, 1) == (0, "read_only")
    assert file.access(0x040) == (0x123, "")
