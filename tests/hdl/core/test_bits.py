"""Products with constants without a multiplier."""

import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

from blysk.hdl.core.bits import times_constant


@pytest.mark.parametrize(("bits", "factor"), [(1, 640), (3, 640), (4, 21), (5, 1), (5, 0)])
def test_products(bits, factor):
    """All values of a word."""
    m, value = Module(), Signal(bits)
    product = times_constant(value, factor)
    result = Signal(len(product))
    m.d.comb += result.eq(product)
    found = []

    async def read(context):
        for number in range(1 << bits):
            context.set(value, number)
            found.append(context.get(result))

    simulator = Simulator(m)
    simulator.add_testbench(read)
    simulator.run()
    assert found == [number * factor for number in range(1 << bits)]
