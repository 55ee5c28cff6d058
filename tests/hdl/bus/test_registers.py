"""Frame constants that the registers pass on: each accepted write once, and no other write."""

from amaranth.sim import Simulator

from blysk.golden.bus.registers import CONSTANTS, RegisterMap, constant_registers, frame_registers
from blysk.golden.presets import preset
from blysk.hdl.bus.registers import RegistersUnit


def test_loads():
    """The loads have every constant in the order of the writes.

    They have no refused write, no read, and no write to another register.
    """
    map = RegisterMap("core", (), frame_registers(), constant_registers(preset(model="cosquad", lights=2)))
    unit = RegistersUnit(map)
    accesses, expected = [], []
    for index, register in enumerate(map.registers):
        code = register.extended(index * 77 & (1 << register.width) - 1)
        accesses += [(register.address, 1, code, 15), (register.address, 0, code, 15)]
        accesses += [(register.address, 1, code, 7), (register.address | 2, 1, code, 15)]
        if register.address >= CONSTANTS:
            expected.append(((register.address - CONSTANTS) // 4, code & 0x3FFFF))
    simulator, found = Simulator(unit), []
    simulator.add_clock(1e-8)

    async def run(context):
        context.set(unit.o.ready, 1)
        for address, write, data, strobe in accesses:
            given = {"address": address, "write": write, "data": data, "strobe": strobe}
            context.set(unit.i.payload, given)
            context.set(unit.i.valid, 1)
            while not context.get(unit.i.ready):
                await watch(context)
            await watch(context)
            context.set(unit.i.valid, 0)
        for _ in range(4):
            await watch(context)

    async def watch(context):
        if context.get(unit.load.valid):
            found.append((context.get(unit.load.address), context.get(unit.load.data)))
        await context.tick()

    simulator.add_testbench(run)
    simulator.run()
    assert len(expected) > 24
    assert found == expected
