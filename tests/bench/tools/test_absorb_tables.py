"""Look-up tables moved into adders: which move, which stay, and the same sums and carries for all values."""

import copy
import random
from itertools import product

import pytest

from blysk.bench.tools.absorb_registers import absorb_registers
from blysk.bench.tools.absorb_tables import absorb_tables
from blysk.bench.tools.place_and_route import tool_versions
from blysk.bench.units.registry import RECORDS

from ...simulators.mapped import map_component, same

CARRY, SUMS, END = 100, (101, 102), 103
"""Nets of an adder. Nets from 1 on are the inputs of a module, nets from 50 on the outputs of tables."""


def table(function, *pins):
    """A look-up table of a function of its inputs; inputs that are left out are 0."""
    rows = sum(
        bool(function(*(row >> k & 1 for k in range(len(pins))))) << row for row in range(1 << len(pins))
    )
    rows = sum((rows >> (row & ((1 << len(pins)) - 1)) & 1) << row for row in range(16))
    return f"{rows:016b}", [*pins, *"0000"][:4]


def netlist(tables, operands):
    """Cells of tables by their output, and of two bits that add pairs of nets, as Yosys makes them."""
    cells = {}
    for net, (rows, pins) in tables.items():
        nets = {pin: [bit] for pin, bit in zip("ABCD", pins, strict=True)} | {"Z": [net]}
        cells[f"t{net}"] = cell("LUT4", {"INIT": rows}, nets, "Z")
    nets = {"CIN": [CARRY], "COUT": [END], "S0": [SUMS[0]], "S1": [SUMS[1]]}
    for k, pair in enumerate(operands):
        nets |= {f"{pin}{k}": [bit] for pin, bit in zip("ABCD", (*pair, "0", "1"), strict=True)}
    parameters = dict.fromkeys(("INIT0", "INIT1"), "1001011010101010")
    parameters |= dict.fromkeys(("INJECT1_0", "INJECT1_1"), "NO")
    cells["adder"] = cell("CCU2C", parameters, nets, "COUT", "S0", "S1")
    return cells


def cell(kind, parameters, nets, *outputs):
    ways = {port: "output" if port in outputs else "input" for port in nets}
    return {"type": kind, "parameters": parameters, "connections": nets, "port_directions": ways}


def sums(cells, given):
    """Nets of the outputs, by Yosys's model of the cells."""
    known = {"0": 0, "1": 1, **given}

    def value(net):
        if net not in known:
            (found,) = [c for c in cells.values() if c["connections"].get("Z") == [net]]
            known[net] = row_of(found, "INIT", "")[0]
        return known[net]

    def row_of(of, name, suffix):
        row = sum(value(of["connections"][f"{pin}{suffix}"][0]) << k for k, pin in enumerate("ABCD"))
        rows = int(of["parameters"][name], 2)
        return rows >> row & 1, rows >> (row & 3) & 1

    carry, made = given[CARRY], []
    for k in range(2):
        passes, generated = row_of(cells["adder"], f"INIT{k}", str(k))
        made.append(passes ^ carry)
        carry = carry if passes else generated
    return *made, carry


def choice(s, a, b):
    return a if s else b


def inverted(s, a, b):
    return (not a) if s else b


CASES = {
    "a gate": ({50: table(lambda a, b: a & b, 1, 2)}, 1),
    "a negated gate": ({50: table(lambda a, b: not a & b, 1, 2)}, 1),
    "a choice": ({50: table(choice, 1, 2, 4)}, 1),
    "plus or minus": ({50: table(inverted, 1, 2, 4)}, 1),
    # C and D are 0 where A and B make a carry, and then the operand must be 0.
    "minus or plus": ({50: table(lambda s, a, b: inverted(not s, a, b), 1, 2, 4)}, 0),
    "a choice of three": ({50: table(lambda s, a, b, t: choice(s, a, b) & t, 1, 2, 4, 5)}, 0),
    "a table behind a table": (
        {50: table(lambda a, b: a & b, 1, 51), 51: table(lambda a, b: a ^ b, 2, 4)},
        2,
    ),
}


def checked(cells, ports=()):
    """Number of removed tables, after a comparison of all values before and after."""
    before = copy.deepcopy(cells)
    removed = absorb_tables(cells, set(ports))
    assert len(before) - len(cells) == removed
    nets = [*range(1, 8), CARRY]
    for values in product((0, 1), repeat=len(nets)):
        given = dict(zip(nets, values, strict=True))
        assert sums(before, given) == sums(cells, given)
    return removed


@pytest.mark.parametrize("name", CASES)
def test_table(name):
    tables, moves = CASES[name]
    assert checked(netlist(tables, [(3, 50), (6, 7)])) == moves
    assert checked(netlist(tables, [(50, 3), (6, 7)])) == moves


def test_tables_in_front_of_both_operands():
    gates = {50: table(lambda a, b: a & b, 1, 2), 51: table(lambda a, b: a & b, 4, 5)}
    assert checked(netlist(gates, [(50, 51), (6, 7)])) == 2


def test_tables_with_other_readers_stay():
    """Readers are an output, a further table, a carry, and more bits than a table may go into."""
    gate = {50: table(lambda a, b: a & b, 1, 2)}
    assert checked(netlist(gate, [(3, 50), (6, 50)])) == 1
    assert checked(netlist(gate, [(3, 50), (6, 7)]), [50]) == 0
    kept = gate | {60: table(lambda a: a, 50)}
    assert checked(netlist(kept, [(3, 50), (6, 7)])) == 0
    cells = netlist(gate, [(3, 50), (6, 50)])
    cells["adder"]["connections"]["CIN"] = [50]
    assert absorb_tables(cells, set()) == 0
    cells = netlist(gate, [(3, 50), (6, 50)])
    cells["other"] = copy.deepcopy(cells["adder"])
    assert absorb_tables(cells, set()) == 0


def test_open_inputs_and_kept_tables_stay():
    for change in (
        lambda cells: cells["t50"]["connections"].update(D=["x"]),
        lambda cells: cells["t50"].update(attributes={"keep": "1"}),
        lambda cells: cells["adder"]["connections"].update(C0=["x"]),
        lambda cells: cells["adder"]["parameters"].update(INJECT1_0="YES"),
    ):
        cells = netlist({50: table(lambda a, b: a & b, 1, 2)}, [(3, 50), (6, 7)])
        change(cells)
        assert absorb_tables(cells, set()) == 0


def test_random_tables():
    rng, moved = random.Random(2026), 0
    for _ in range(60):
        pins = [rng.choices([1, 2, 3, 4, "0", "1"], k=4) for _ in range(3)]
        tables = {50 + k: (f"{rng.getrandbits(16):016b}", of) for k, of in enumerate(pins)}
        moved += checked(netlist(tables, [(50, 51), (52, rng.choice([1, 5]))]))
    assert moved > 20


@pytest.mark.long
@pytest.mark.ci
@pytest.mark.skipif(tool_versions()["pyosys"] is None, reason="pyosys is not installed")
def test_a_unit(tmp_path):
    """A proof shows that the netlist of a unit does the same, and finds a changed row."""
    before = map_component(RECORDS["edge_walk"].variants[""].unit(), tmp_path)
    after, found = absorb_registers(before)
    assert found.tables > 20
    assert same(before, after, tmp_path) == ""
    cells, old = after["modules"]["top"]["cells"], before["modules"]["top"]["cells"]
    changed = next(name for name, of in cells.items() if of["type"] == "CCU2C" and of != old[name])
    rows = cells[changed]["parameters"]
    rows["INIT0"] = f"{int(rows['INIT0'], 2) ^ 0xFFFF:016b}"
    assert same(before, after, tmp_path) == f"{changed} is changed"
