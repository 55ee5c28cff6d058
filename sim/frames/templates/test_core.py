"""Test of the core beside this file against expected output; README.md describes the files."""

import csv
import json
import random
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, ReadOnly

VECTORS = Path(__file__).resolve().parent / "vectors"
PLAN = json.loads((VECTORS / "plan.json").read_text())
PATIENCE = 10_000
"""Cycles without a transfer after which the core counts as stuck."""

SETTLE = PLAN["settle"]
"""Cycles after the last beat in which no further beat may come."""


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
    """Source of a stream: offers rows in turn, with pauses; an offered row stays until it is taken."""

    def __init__(self, dut, name, plan, pauses):
        self.dut, self.rows, self.pauses = dut, list(reversed(read(name))), pauses[0]
        self.valid, self.ready = getattr(dut, plan["valid"]), getattr(dut, plan["ready"])
        self.offered = False

    def rest(self):
        """Offer nothing."""
        self.valid.value = 0

    def drive(self):
        """Offer the next row, or pause. Called half a cycle before the rising edge."""
        if not self.offered:
            self.offered = bool(self.rows) and random.random() >= self.pauses
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
    """Sink of a stream: takes beats, with pauses, and compares each beat with the expected beat."""

    def __init__(self, dut, name, plan, pauses):
        self.dut, self.name, self.expected, self.pauses = dut, name, read(name), pauses[1]
        self.valid, self.ready_port = plan["valid"], getattr(dut, plan["ready"])
        self.ports = plan["ports"]
        self.taken, self.held, self.ready = 0, None, False

    def rest(self):
        """Take nothing."""
        self.ready_port.value = 0

    def drive(self):
        """Be ready, or pause. Called half a cycle before the rising edge."""
        self.ready = random.random() >= self.pauses
        self.ready_port.value = int(self.ready)

    def observe(self):
        """Check the offered beat, and note whether it is taken at the edge.

        Called when the outputs have settled.
        """
        valid = sample(self.dut, [self.valid])[self.valid]
        beat = sample(self.dut, self.ports) if valid else None
        where = f"{self.name} {self.taken}"
        if self.held is not None:
            assert valid, f"{where}: {self.valid} went low while the beat waited"
            assert beat == self.held, f"{where}: changed while it waited, from {self.held} to {beat}"
        self.held = beat if valid and not self.ready else None
        if not valid:
            return False
        assert not self.done, f"{where}: one more than the {len(self.expected)} expected: {beat}"
        wanted = self.expected[self.taken]
        differences = [
            f"{port} is {code}, expected {wanted[port]}"
            for port, code in beat.items()
            if code != wanted[port]
        ]
        assert not differences, f"{where}: {'; '.join(differences)}"
        self.taken += self.ready
        return self.ready

    @property
    def done(self):
        """Whether every expected beat has been taken."""
        return self.taken == len(self.expected)


class Access:
    """Initiator of classic Wishbone cycles: one row after the other, with pauses between them."""

    def __init__(self, dut, name, plan, pauses):
        self.dut, self.name, self.pauses = dut, name, pauses[0]
        self.rows, self.taken, self.asked = read(name), 0, False

    def rest(self):
        """Ask for nothing."""
        self.dut.wb_cyc.value = self.dut.wb_stb.value = 0

    def drive(self):
        """Keep the request, make the next one, or pause. Called half a cycle before the rising edge."""
        if not self.asked:
            self.asked = not self.done and random.random() >= self.pauses
            self.dut.wb_cyc.value = self.dut.wb_stb.value = int(self.asked)
            if self.asked:
                for port, code in self.rows[self.taken].items():
                    if port != "wb_dat_r":
                        getattr(self.dut, port).value = code

    def observe(self):
        """Check the answer, if there is one. Called when the outputs have settled."""
        answer = sample(self.dut, ["wb_ack", "wb_err"])
        if not self.asked:
            return False
        where = f"{self.name} {self.taken}"
        assert not answer["wb_err"], f"{where}: refused"
        if not answer["wb_ack"]:
            return False
        wanted = self.rows[self.taken].get("wb_dat_r")
        if wanted is not None:
            found = sample(self.dut, ["wb_dat_r"])["wb_dat_r"]
            assert found == wanted, f"{where}: wb_dat_r is {found}, expected {wanted}"
        self.taken += 1
        self.asked = False
        return True

    @property
    def done(self):
        """Whether every row has been answered."""
        return self.taken == len(self.rows)


class Memory:
    """Memory of depths at the ports with a name in front. The word of a read comes a cycle later.

    A place that the core has not written has a random depth.
    """

    done = True

    def __init__(self, dut, name):
        self.dut, self.name, self.words, self.read = dut, name, {}, 0
        self.given = getattr(dut, f"{name}_read_data")

    def rest(self):
        """Give any word."""
        self.given.value = 0

    def drive(self):
        """Give the word of the last read. Called half a cycle before the rising edge."""
        self.given.value = self.read

    def observe(self):
        """Read and write at the edge. Called when the outputs have settled."""
        ports = "read_enable", "write_enable", "write_data"
        reads, writes, data = (f"{self.name}_{port}" for port in ports)
        enables = sample(self.dut, [reads, writes])
        if enables[reads]:
            self.read = self.words.get(self.place("read"), random.getrandbits(24))
        if enables[writes]:
            place = self.place("write")
            self.words[place] = sample(self.dut, [data])[data]
            assert None not in place, f"{self.name}_write_place is undefined"
        return bool(enables[writes])

    def place(self, side):
        """Column and row. ``None`` if undefined: then the word of a read does not count."""
        values = [getattr(self.dut, f"{self.name}_{side}_place_{axis}").value for axis in "xy"]
        return tuple(int(value) if value.is_resolvable else None for value in values)


PAUSES = [(0.0, 0.0), (0.4, 0.4), (0.8, 0.1), (0.1, 0.8)]
"""Shares of cycles in which the sources and the sinks pause, for each run."""

PASSED = []
"""Runs that found no fault."""

KINDS = {"source": Source, "sink": Sink, "access": Access}


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
@cocotb.parametrize(pauses=PAUSES)
async def every_beat(dut, pauses):
    """Send constants and input, and check the output. Both sides pause in the given shares of cycles."""
    if "pauses" in cocotb.plusargs:
        random.seed(int(cocotb.plusargs["pauses"]))
    phases = {}
    for name, plan in PLAN["tables"].items():
        if plan["kind"] in KINDS:
            phases.setdefault(plan["phase"], []).append(KINDS[plan["kind"]](dut, name, plan, pauses))
        elif plan["kind"] == "set":
            for port, code in read(name)[0].items():
                getattr(dut, port).value = code
    memories = [Memory(dut, name) for name in PLAN["memories"]]
    for part in [*(part for parts in phases.values() for part in parts), *memories]:
        part.rest()
    dut.rst.value = 1
    Clock(dut.clk, 10, unit="ns").start(start_high=False)
    await cycles(dut, [], 2)
    await FallingEdge(dut.clk)
    dut.rst.value = 0

    for _, parts in sorted(phases.items()):
        taken = await cycles(dut, [*parts, *memories])
        await cycles(dut, [*parts, *memories], SETTLE)
        for part in parts:
            if isinstance(part, Sink):
                dut._log.info("%d %s as expected, in %d cycles", part.taken, part.name, taken)
        await FallingEdge(dut.clk)
        for part in parts:
            part.rest()
    for name, plan in PLAN["tables"].items():
        if plan["kind"] == "read":
            for port, code in read(name)[0].items():
                found = sample(dut, [port])[port]
                assert found == code, f"{port} is {found}, expected {code}"
    PASSED.append(pauses)
