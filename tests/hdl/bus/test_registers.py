"""Frame constants that the registers pass on: each accepted write once, and no other write."""

from dataclasses import replace

from amaranth.sim import Simulator

from blysk.golden.albedo.albedo import Albedo
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.golden.bus.registers import CONSTANTS, RegisterMap, constant_registers, frame_registers
from blysk.golden.frame_constants import writes_of
from blysk.golden.presets import preset
from blysk.hdl.bus.registers import RegistersUnit
from blysk.sim.frames.frame import sample_constants


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


def test_every_constant_of_an_albedo_has_a_register():
    """Emission, tints, textures and texels: each write of a frame goes to a register that holds its word."""
    design = preset(model="cosquad", materials=2)
    design = replace(design, albedo=Albedo(tints=True, texture=TextureSampler(TexelMemory(104))))
    map = RegisterMap("core", (), (), constant_registers(design))
    writes = writes_of(sample_constants(design))
    addresses = set(writes["address"].tolist())
    assert addresses >= {8, 9, 10, 11, 12, 13, 14, 15}
    for address, code in zip(writes["address"].tolist(), writes["data"].tolist(), strict=True):
        register = map.by_address[CONSTANTS + 4 * address]
        assert register.holds(register.extended(code))
        assert register.width == 18 or code < 1 << register.width
