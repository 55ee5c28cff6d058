"""Costs: counted right on a component made for it, and as every device states them."""

import re
from pathlib import Path

import pytest
from amaranth.hdl import Cat, Module, Signal, signed, unsigned
from amaranth.lib import memory, stream
from amaranth.lib.wiring import Component, In, Out

from blysk.golden.lighting.intensity import Intensity
from blysk.golden.lighting.specular import Specular
from blysk.golden.presets import METHODS, preset
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.hdl.emit.cost import Cost, cost_of
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.intensity import IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.pipeline import ShadingPipelineUnit


class Sample(Component):
    """Two multipliers, one of a sign-extended operand; one by a constant; 16 registers; two memories."""

    i: In(stream.Signature(signed(16)))
    o: Out(stream.Signature(unsigned(16)))

    def elaborate(self, platform):
        m = Module()
        m.submodules.table = table = memory.Memory(shape=4, depth=8, init=range(8))
        m.submodules.store = store = memory.Memory(shape=2, depth=4, init=[])
        read, look, write = table.read_port(domain="comb"), store.read_port(domain="comb"), store.write_port()
        low = Signal(signed(7))
        extended = Signal(signed(12))
        m.d.comb += [
            low.eq(self.i.payload),
            extended.eq(low),
            read.addr.eq(self.i.payload),
            look.addr.eq(self.i.payload),
            write.addr.eq(self.i.payload),
            write.data.eq(self.i.payload),
            write.en.eq(self.i.valid),
            self.i.ready.eq(1),
            self.o.valid.eq(1),
        ]
        out_of_range = Signal(16)
        product = Signal(80)
        m.d.comb += [
            product.eq(Cat(extended * self.i.payload, self.i.payload * low * 5, read.data, look.data)),
            out_of_range.eq(product.xor()),
        ]
        m.d.sync += self.o.payload.eq(Cat(product[:15], out_of_range[0]))
        return m


def test_counts():
    cost = cost_of(Sample())
    # Three multipliers, two memories, the register, the sum of bits, and the enable of the write port.
    assert cost == Cost(8, {(16, 7): 2}, 1, 16, rom_bits=32, ram_bits=8)
    assert cost.multiplier_count == 2


README = (Path(__file__).parents[3] / "README.md").read_text()

DEVICES = {
    "dot_product": (DotProductUnit, 3),
    "middle_normal": (MiddleNormalUnit, 2),
    "gpq": (GPQUnit, 0),
    "difference_setup": (DifferenceSetupUnit, 1),
    "difference_accumulator": (DifferenceAccumulatorUnit, 0),
    "specular": (SpecularUnit, 2),
    "diffuse": (DiffuseUnit, 0),
    "light": (LightUnit, 2),
    "intensity": (IntensityUnit, 6),
    "pipeline": (ShadingPipelineUnit, 19),
}


@pytest.mark.parametrize("name", DEVICES)
def test_devices_cost_what_the_readme_states(name):
    make, multipliers = DEVICES[name]
    unit = make()
    cost = cost_of(unit)
    assert cost.multiplier_count == multipliers
    assert all(out_of_range <= 18 for out_of_range, _ in cost.multipliers)
    row = re.search(rf"^\| `?{name}\b.*", README, re.MULTILINE)[0]
    latency, interval, stated = (int(re.search(r"\d+", cell)[0]) for cell in row.split("|")[3:6])
    assert (latency, stated) == (unit.latency, multipliers)
    assert interval == getattr(unit, "initiation_interval", 1)
    if name == "pipeline":
        assert f"at most `max(length, {unit.setup_interval})`" in README


@pytest.mark.parametrize(
    "method",
    [m if m in ("quadratic", "chord") else pytest.param(m, marks=pytest.mark.long) for m in METHODS],
)
def test_methods_cost_what_the_readme_states(method):
    unit = ShadingPipelineUnit(preset(method))
    cost = cost_of(unit)
    assert all(out_of_range <= 18 for out_of_range, _ in cost.multipliers)
    row = re.search(rf"^\| `{method}` .*", README, re.MULTILINE)[0]
    stated = [int(cell) for cell in row.split("|")[4:7]]
    assert stated == [unit.latency, unit.setup_interval, cost.multiplier_count]


@pytest.mark.parametrize("lights", [2, 3])
def test_lights_cost_fourteen_multipliers_each(lights):
    design = preset("quadratic", lights=lights)
    assert cost_of(ShadingPipelineUnit(design)).multiplier_count == 5 + 14 * lights
    assert cost_of(IntensityUnit(Intensity(lights))).multiplier_count == 6 * lights


def test_memories_are_as_stated():
    assert cost_of(DifferenceSetupUnit()).rom_bits == 2048 * 17
    for model, constant in (("cosquad", 0), ("cosquad7", 1), ("cosquad_lin", 1)):
        cost = cost_of(SpecularUnit(Specular(REFLECTION_MODELS[model])))
        assert (cost.rom_bits, cost.constant_multipliers) == (1024 * 17, constant)
