"""Test of the shading pipeline beside this file against expected pixels; README.md describes the files."""

import csv
import random
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, ReadOnly

VECTORS = Path(__file__).resolve().parent / "vectors"
PATIENCE = 10_000
"""Cycles without a transfer after which the pipeline counts as stuck."""

SETTLE = 64
"""Cycles after the last pixel in which no further pixel may come."""


def read(name):
    """Rows of a file of test vectors, each a mapping of ports to codes."""
    with open(VECTORS / f"{name}.csv", newline="") as file:
        return [{port: int(code) for port, code in row.items()} for row in csv.DictReader(file)]


def sample(dut, ports):
    """Codes on some ports. All their bits must be defined."""
    codes = {}
    for port in ports:
        value = getattr(dut, port).value
        assert value.is_resolvable, f"{port} is undefined: {value}"
        codes[port] = int(value)
    return codes


class Source:
    """Source of a stream: offers rows in turn, with pauses; an offered row stays until it is taken.

    The first row is offered after all rows of the source ``after`` have been taken.
    """

    def __init__(self, dut, stream, rows, pauses, after=None):
        self.dut, self.rows, self.pauses, self.after = dut, list(reversed(rows)), pauses, after
        self.valid, self.ready = getattr(dut, f"{stream}_valid"), getattr(dut, f"{stream}_ready")
        self.offered = False

    def drive(self):
        """Offer the next row, or pause. Called half a cycle before the rising edge."""
        if not self.offered:
            free = self.rows and (self.after is None or self.after.done)
            self.offered = bool(free) and random.random() >= self.pauses
            self.valid.value = int(self.offered)
            if self.offered:
                for port, code in self.rows[-1].items():
                    getattr(self.dut, port).value = code

    def observe(self):
        """Note whether the row is taken at the edge. Called when the outputs have settled."""
        taken = self.offered and self.ready.value == 1
        if taken:
            self.rows.pop()
            self.offered = False
        return taken

    @property
    def done(self):
        """Whether every row has been taken."""
        return not self.rows


class Sink:
    """Sink of a stream: takes pixels, with pauses, and compares each pixel with the expected pixel."""

    def __init__(self, dut, expected, pauses):
        self.dut, self.expected, self.pauses = dut, expected, pauses
        self.taken, self.held, self.ready = 0, None, False

    def drive(self):
        """Be ready, or pause. Called half a cycle before the rising edge."""
        self.ready = random.random() >= self.pauses
        self.dut.o_ready.value = int(self.ready)

    def observe(self):
        """Check the offered pixel, and note whether it is taken at the edge.

        Called when the outputs have settled.
        """
        valid = sample(self.dut, ["o_valid"])["o_valid"]
        pixel = sample(self.dut, self.expected[0]) if valid else None
        where = f"pixel {self.taken}"
        if self.held is not None:
            assert valid, f"{where}: o_valid went low while the pixel waited for o_ready"
            assert pixel == self.held, f"{where}: changed while it waited, from {self.held} to {pixel}"
        self.held = pixel if valid and not self.ready else None
        if not valid:
            return False
        assert not self.done, f"{where}: one more than the {len(self.expected)} expected: {pixel}"
        wanted = self.expected[self.taken]
        differences = [
            f"{port} is {code}, expected {wanted[port]}"
            for port, code in pixel.items()
            if code != wanted[port]
        ]
        assert not differences, f"{where}: {'; '.join(differences)}"
        self.taken += self.ready
        return self.ready

    @property
    def done(self):
        """Whether every expected pixel has been taken."""
        return self.taken == len(self.expected)


async def cycles(dut, parts, count=None):
    """Run the clock for ``count`` cycles, or until every part is done. Returns the number of cycles."""
    idle = clock = 0
    while clock != count and not (count is None and all(part.done for part in parts)):
        await FallingEdge(dut.clk)
        for part in parts:
            part.drive()
        await ReadOnly()
        moved = [part.observe() for part in parts]
        idle, clock = 0 if any(moved) else idle + 1, clock + 1
        assert idle < PATIENCE or count is not None, f"stuck: nothing moved for {PATIENCE} cycles"
    return clock


@cocotb.test()
@cocotb.parametrize(pauses=[(0.0, 0.0), (0.4, 0.4), (0.8, 0.1), (0.1, 0.8)])
async def every_pixel(dut, pauses):
    """Send constants, then spans, and check pixels; sources and sink pause in the given shares of cycles."""
    for port in ("i_valid", "write_valid", "o_ready"):
        getattr(dut, port).value = 0
    dut.rst.value = 1
    Clock(dut.clk, 10, unit="ns").start(start_high=False)
    await cycles(dut, [], 2)
    await FallingEdge(dut.clk)
    dut.rst.value = 0

    of_sources, of_sink = pauses
    writes = Source(dut, "write", read("writes"), of_sources)
    spans = Source(dut, "i", read("spans"), of_sources, after=writes)
    sink = Sink(dut, read("pixels"), of_sink)
    taken = await cycles(dut, [writes, spans, sink])
    await cycles(dut, [sink], SETTLE)
    await FallingEdge(dut.clk)
    for port, code in read("status")[0].items():
        found = sample(dut, [port])[port]
        assert found == code, f"{port} is {found}, expected {code}"
    dut._log.info("%d pixels as expected, in %d cycles", sink.taken, taken)
