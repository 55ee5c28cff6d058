"""Starts of carry chains: the same sums and carries for every operand, whatever the carry before is."""

import copy
import random
from itertools import product

import pytest

from blysk.bench.tools.carry_starts import start_carries

OPERANDS, SUMS, CARRY = (2, 3, 4, 5), (6, 7), 8
"""Nets of an adder."""


def netlist(table, carry, constants, read):
    """An adder at the start of a chain, whose sums are read or not."""
    a0, b0, a1, b1 = OPERANDS
    inputs = {"A0": a0, "B0": b0, "C0": constants[0], "D0": constants[1], "A1": a1, "B1": b1}
    inputs |= {"C1": "0", "D1": "1", "CIN": carry}
    outputs = {"S0": SUMS[0], "S1": SUMS[1], "COUT": CARRY}
    adder = {
        "type": "CCU2C",
        "parameters": {"INIT0": table, "INIT1": "1001011010101010", "INJECT1_0": "NO", "INJECT1_1": "NO"},
        "port_directions": dict.fromkeys(inputs, "input") | dict.fromkeys(outputs, "output"),
        "connections": {pin: [net] for pin, net in (inputs | outputs).items()},
    }
    ports = {"sums": {"direction": "output", "bits": [*SUMS, CARRY] if read else [CARRY]}}
    return {"modules": {"top": {"cells": {"adder": adder}, "ports": ports}}}


def outputs(netlist, values, before):
    """Sums and carry by Yosys's model of the cells; ``before`` is the value of a carry that is open."""
    known = {"0": 0, "1": 1, "x": before, **dict(zip(OPERANDS, values, strict=True))}

    def bit(cell, table, pins):
        rows = int(cell["parameters"][table], 2)
        row = sum(known[cell["connections"][pin][0]] << k for k, pin in enumerate(pins))
        return rows >> row & 1, rows >> (row & 3) & 1

    cells = netlist["modules"]["top"]["cells"]
    adder = cells["adder"]
    carry, found = known[adder["connections"]["CIN"][0]], {}
    for k in range(2):
        passes, made = bit(adder, f"INIT{k}", [f"{pin}{k}" for pin in "ABCD"])
        found[adder["connections"][f"S{k}"][0]] = passes ^ carry
        carry = carry if passes else made
    found[CARRY] = carry
    found |= {c["connections"]["Z"][0]: bit(c, "INIT", "ABCD")[0] for n, c in cells.items() if n != "adder"}
    return [found.get(bit) for bit in netlist["modules"]["top"]["ports"]["sums"]["bits"]]


@pytest.mark.parametrize(("carry", "read"), [*product("01", (False, True))])
def test_sums_and_carries_stay(carry, read):
    """Adders of Yosys and adders with any table keep their sums and carry. The carry before has no effect."""
    rng = random.Random(2026)
    tables = ["1001011010101010", *(f"{rng.getrandbits(16):016b}" for _ in range(30))]
    for table, constants in product(tables, product("01", repeat=2)):
        old = netlist(table, carry, constants, read)
        new = copy.deepcopy(old)
        assert start_carries(new) == 1
        assert new["modules"]["top"]["cells"]["adder"]["connections"]["CIN"] == ["x"]
        assert len(new["modules"]["top"]["cells"]) == 1 + read
        for values, before in product(product((0, 1), repeat=4), (0, 1)):
            assert outputs(new, values, before) == outputs(old, values, before)


@pytest.mark.parametrize(("carry", "constants"), [(9, "01"), ("0", (9, "1")), ("1", ("0", 9))])
def test_others_stay(carry, constants):
    """A chain behind another adder stays, and so does an adder that adds or subtracts by a net."""
    old = netlist("1001011010101010", carry, constants, True)
    new = copy.deepcopy(old)
    assert start_carries(new) == 0
    assert new == old
