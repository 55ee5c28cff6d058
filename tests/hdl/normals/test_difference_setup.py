# amaranth: UnusedElaboratable=no
"""Difference setup: orders, and tables of shorter spans. `tests.test_units` checks its results."""

import pytest

from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit

from ..variants import mostly_long


@pytest.mark.parametrize("order", [1, 2])
def test_lines_have_no_second_difference(order):
    assert ("g" in DifferenceSetupUnit(order=order).i.payload.shape().members) == (order == 2)


@pytest.mark.parametrize("bits", mostly_long([2, 3, 7, 10], 7))
def test_shorter_spans_need_a_smaller_table(bits):
    assert cost_of(DifferenceSetupUnit(length_bits=bits)).rom_bits == 17 << (bits - 1)


@pytest.mark.parametrize("order", [0, 3])
def test_refuses_an_order(order):
    with pytest.raises(ValueError, match=rf"^order must be 1 or 2, not {order}$"):
        DifferenceSetupUnit(order=order)
