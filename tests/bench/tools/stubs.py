# amaranth: UnusedElaboratable=no
"""Components, netlists and reports in place of those of Yosys and nextpnr."""

from amaranth.hdl import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Product(wiring.Component):
    """A product of 18x18 bits between two registers, one multiplier, with gates before and behind it."""

    def __init__(self, gates=False):
        super().__init__({name: In(signed(18)) for name in "abcd"} | {"e": In(signed(36)), "o": Out(36)})
        self._gates = gates

    def elaborate(self, platform):
        m = Module()
        if self._gates:
            m.d.comb += self.o.eq((self.a ^ self.c) * (self.b ^ self.d) ^ self.e)
        else:
            m.d.comb += self.o.eq(self.a * self.b)
        return m


class Stages(wiring.Component):
    """A product of 18x18 bits with rows of registers for its operands, and rows for the product."""

    a: In(signed(18))
    b: In(signed(18))
    o: Out(36)

    def __init__(self, before, behind):
        super().__init__()
        self._before, self._behind = before, behind

    def elaborate(self, platform):
        m = Module()

        def registered(value, count):
            for _ in range(count):
                register = Signal(signed(len(value)), reset_less=True)
                m.d.sync += register.eq(value)
                value = register
            return value

        a, b = (registered(value, self._before) for value in (self.a, self.b))
        m.d.comb += self.o.eq(registered(a * b, self._behind))
        return m


class MultiplyAdd(wiring.Component):
    """A product and a sum between two registers."""

    def __init__(self):
        super().__init__({"a": In(signed(18)), "b": In(signed(18)), "c": In(signed(36)), "o": Out(36)})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.o.eq(self.a * self.b + self.c)
        return m


class Counter(wiring.Component):
    """A counter, 24 flip-flops."""

    def __init__(self, width=24):
        super().__init__({"o": Out(width)})

    def elaborate(self, platform):
        m = Module()
        count = Signal(len(self.o))
        m.d.sync += count.eq(count + 1)
        m.d.comb += self.o.eq(count)
        return m


def step(kind, delay, cell, port, to=None):
    return {
        "type": kind,
        "delay": delay,
        "from": {"cell": cell, "port": "Q"},
        "to": {"cell": to or cell, "port": port},
    }


MULTIPLIER = "unit.datapath.product_TRELLIS_FF_Q_3_DI_MULT18X18D_P33"

LUT = "unit.sum_TRELLIS_FF_Q_2_DI_LUT4_Z"

# As nextpnr writes it: a path through a multiplier, a carry and a look-up table, and a path from a port.
REPORT = {
    "fmax": {"clk": {"achieved": 123.4, "constraint": 150}},
    "utilization": {"TRELLIS_COMB": {"used": 77, "available": 24288}},
    "critical_paths": [
        {"from": "<async>", "to": "posedge clk", "path": [step("routing", 9.0, "i", "DI")]},
        {
            "from": "posedge clk",
            "to": "posedge clk",
            "path": [
                step("clk-to-q", 0.5, "i__payload$17_TRELLIS_FF_Q_1", "Q"),
                step("routing", 1.0, "i__payload$17_TRELLIS_FF_Q_1", "A3", MULTIPLIER),
                step("logic", 3.5, MULTIPLIER, "P4"),
                step("routing", 0.25, MULTIPLIER, "A", "unit.sum_CCU2C_S0$CCU2_COMB1"),
                step("logic", 0.5, "unit.sum_CCU2C_S0$CCU2_COMB1", "F"),
                step("routing", 0.25, "unit.sum_CCU2C_S0$CCU2_COMB1", "A", LUT),
                step("logic", 0.125, LUT, "F"),
                step("routing", 0.5, LUT, "DI", "unit.sum_TRELLIS_FF_Q_2"),
                step("setup", 0.0, "unit.sum_TRELLIS_FF_Q_2", "DI"),
            ],
        },
    ],
}

# The same for Nexus: from registers inside a multiplier, through its stages, a carry and a look-up table to a
# memory.
STAGES = "unit.product_MULT18X18_Z/"

WIDE = "unit.sum_FD1P3IX_Q_2_D_WIDEFN9_Z$widefn_comb[0]$"

NEXUS_REPORT = {
    "fmax": {"clk": {"achieved": 123.4, "constraint": 150}},
    "utilization": {"OXIDE_COMB": {"used": 77, "available": 32256}},
    "critical_paths": [
        {
            "from": "posedge clk",
            "to": "posedge clk",
            "path": [
                step("clk-to-q", 0.75, f"{STAGES}PREADD9_CORE_x0_z0", "BR0"),
                step("routing", 0.0, f"{STAGES}PREADD9_CORE_x0_z0", "BR0", f"{STAGES}MULT9_CORE_x0_z2"),
                step("logic", 1.5, f"{STAGES}MULT9_CORE_x0_z2", "P18"),
                step("routing", 0.5, f"{STAGES}MULT9_CORE_x0_z2", "P18", f"{STAGES}MULT18_CORE_x0_z4"),
                step("logic", 1.25, f"{STAGES}MULT18_CORE_x0_z4", "P36"),
                step("routing", 1.0, f"{STAGES}MULT18_CORE_x0_z4", "A", "unit.sum_CCU2_S0$ccu2_comb[1]$"),
                step("logic", 0.5, "unit.sum_CCU2_S0$ccu2_comb[1]$", "F"),
                step("routing", 0.25, "unit.sum_CCU2_S0$ccu2_comb[1]$", "A", WIDE),
                step("logic", 0.25, WIDE, "OFX"),
                step("routing", 0.25, WIDE, "WCK0", "unit.places$3.storage.0.1$lutram_ramw$"),
                step("setup", 0.25, "unit.places$3.storage.0.1$lutram_ramw$", "D0"),
            ],
        }
    ],
}


def netlist(*cells):
    """Yosys's JSON of some cells: kind, parameters, and the nets of D and Q."""
    ports = {"i": {"direction": "input", "bits": [2]}, "o": {"direction": "output", "bits": [5, "0"]}}
    cells = {
        str(k): {"type": kind, "parameters": parameters, "connections": {"DI": [d], "Q": [q]}}
        for k, (kind, parameters, d, q) in enumerate(cells)
    }
    return {"modules": {"top": {"ports": ports, "cells": cells}}}
