"""Shared addresses of memory cells: each word that is read is the word that was written."""

import copy
from itertools import product

import pytest

from blysk.bench.tools.shared_addresses import share_addresses

ZEROS = "0" * 64


def netlist(written, read, words=ZEROS):
    """A memory cell with these address bits, from nets or constants."""
    connections = {"WAD": list(written), "RAD": list(read)}
    cell = {"type": "TRELLIS_DPR16X4", "parameters": {"INITVAL": words}, "connections": connections}
    return {"modules": {"top": {"cells": {"memory": cell, "other": {"type": "LUT4"}}}}}


def places(netlist, port, nets):
    """Addresses in the cell, by the values of nets."""
    bits = netlist["modules"]["top"]["cells"]["memory"]["connections"][port]
    values = product((0, 1), repeat=len(nets))
    known = [{"0": 0, "1": 1, **dict(zip(nets, each, strict=True))} for each in values]
    return [sum(of[bit] << k for k, bit in enumerate(bits)) for of in known]


@pytest.mark.parametrize("constants", [*product("01"), *product("01", repeat=2), *product("01", repeat=3)])
@pytest.mark.parametrize("last", [True, False])
def test_words_are_found_again(constants, last):
    """Reading and writing have the same places, a different place for each address, before and after."""
    used = 4 - len(constants)
    written, read = [*range(10, 10 + used)], [*range(20, 20 + used)]
    mixed = (lambda nets: [*nets, *constants]) if last else (lambda nets: [nets[0], *constants, *nets[1:]])
    old = netlist(mixed(written), mixed(read))
    new = copy.deepcopy(old)
    assert share_addresses(new) == len(constants)
    for design in (old, new):
        assert len(set(places(design, "WAD", written))) == 1 << used
        assert places(design, "WAD", written) == places(design, "RAD", read)
    bits = new["modules"]["top"]["cells"]["memory"]["connections"]
    assert not {*bits["WAD"], *bits["RAD"]} & {"0", "1"}


@pytest.mark.parametrize(
    ("written", "read", "words"),
    [
        ([10, 11, "0", "0"], [20, 21, "1", "1"], ZEROS),
        ([10, 11, "0", "0"], [20, 21, 22, 23], ZEROS),
        (["0", 11, "0", "0"], ["0", 21, "0", "0"], ZEROS),
        ([10, 11, "0", "0"], [20, 21, "0", "0"], f"1{ZEROS[1:]}"),
    ],
)
def test_others_stay(written, read, words):
    """Bits that differ, a constant first bit, and a 1 in the initial words."""
    old = netlist(written, read, words)
    new = copy.deepcopy(old)
    assert share_addresses(new) == 0
    assert new == old
