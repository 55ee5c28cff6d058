# amaranth: UnusedElaboratable=no
"""Write port: every address, and the cost of a change of the material.

`tests/formal` proves how writes wait.
"""

from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.bench.units.pipeline_spans import any_constants, any_spans
from blysk.golden.frame_constants import (
    BANK_ADDRESS,
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    MATERIAL_ADDRESS,
    MAX_MATERIALS,
    writes_of,
)
from blysk.golden.number.fixed import UQ
from blysk.golden.presets import preset
from blysk.hdl.frame_constants import FrameConstantsUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.vectors import pixel_beats

from ..checks import assert_beats_equal


def run_bench(m, bench):
    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()


# The registers alone.


def words_by_address(constants, lights):
    """For each address, the position of its word in the output: (fields to the word, width, signed)."""
    words = {}
    for name, (first, count) in FIELDS_OF_A_FRAME.items():
        for k in range(count):
            words[first + k] = constants[name][k] if count > 1 else constants[name]
    for light in range(lights):
        for name, (first, count) in FIELDS_OF_A_LIGHT.items():
            for k in range(count):
                words[(light + 1) * LIGHT_STRIDE + first + k] = constants.lights[light][name][k]
    return {address: Value.cast(word) for address, word in words.items()}


async def write(ctx, unit, address, data):
    ctx.set(unit.write.payload, {"address": address, "data": data})
    ctx.set(unit.write.valid, 1)
    await ctx.tick()
    ctx.set(unit.write.valid, 0)
    ctx.set(unit.write.payload, {"address": 511, "data": 2**18 - 1})


@pytest.mark.parametrize("lights", [3, pytest.param(1, marks=pytest.mark.long)])
def test_every_address_writes_its_constant_and_no_other(lights):
    """All 512 addresses are written in random order, twice.

    A word changes two cycles later, and all other words stay.
    """
    rng = np.random.default_rng(lights)
    unit = FrameConstantsUnit(lights)
    words = words_by_address(unit.constants, lights)
    assert len(words) == 4 + 12 * lights
    # The words cover the output: an address writes each bit.
    assert sum(len(word) for word in words.values()) == len(Value.cast(unit.constants))

    async def bench(ctx):
        expected = dict.fromkeys(words, 0)
        for address in np.r_[rng.permutation(512), rng.permutation(512)].tolist():
            data = int(rng.integers(0, 2**18))
            assert ctx.get(unit.write.ready) == 1
            await write(ctx, unit, address, data)
            assert {a: ctx.get(word) for a, word in words.items()} == expected
            await ctx.tick()
            if address in words:
                shape = words[address].shape()
                code = data % 2**shape.width
                expected[address] = code - 2**shape.width * (shape.signed and code >= 2 ** (shape.width - 1))
            assert {a: ctx.get(word) for a, word in words.items()} == expected

    run_bench(unit, bench)


@pytest.mark.long
@pytest.mark.parametrize("lights", [1, pytest.param(3, marks=pytest.mark.long)])
def test_every_address_writes_its_materials_constant_and_no_other(lights):
    """All 512 addresses are written in random order, with changes to other materials and to materials that do
    not exist.

    A write is visible 3 cycles later if the word belongs to the material, otherwise 2 cycles later. Another
    material's constants are visible 1 cycle after its index.
    """
    rng = np.random.default_rng(10 + lights)
    materials = 3
    # Their low bits are those of a material in every case. Writes for the last six are lost.
    indices = [0, 1, 2] * 4 + [3, 4, 5, 6, 2**9 + 1, 2**17 + 2]
    unit = FrameConstantsUnit(lights, materials)
    words = words_by_address(unit.constants, lights)
    of_frame = [(light + 1) * LIGHT_STRIDE + k for light in range(lights) for k in range(6)]

    async def bench(ctx):
        expected = [dict.fromkeys(words, 0) for _ in range(materials)]
        index, material = 0, 0
        for address in np.r_[rng.permutation(512), rng.choice(list(words), 200)].tolist():
            if rng.random() < 0.3:
                index = int(rng.choice(indices))
                await write(ctx, unit, MATERIAL_ADDRESS, index)
            data = int(rng.integers(0, 2**18))
            if address == MATERIAL_ADDRESS:
                data = index = int(rng.choice(indices))
            await write(ctx, unit, address, data)
            assert {a: ctx.get(word) for a, word in words.items()} == expected[material]
            await ctx.tick()
            if address in words:
                shape = words[address].shape()
                code = data % 2**shape.width
                code -= 2**shape.width * (shape.signed and code >= 2 ** (shape.width - 1))
                before = expected[material][address]
                for k in range(materials):
                    if address in of_frame or k == index:
                        expected[k][address] = code
                now = expected[material][address] if address in of_frame else before
                assert ctx.get(words[address]) == now
                await ctx.tick()
                assert ctx.get(words[address]) == expected[material][address]
            else:
                await ctx.tick()
            assert {a: ctx.get(word) for a, word in words.items()} == expected[material]
            for material in rng.permutation(materials).tolist():
                ctx.set(unit.material, material)
                await ctx.tick()
                assert {a: ctx.get(word) for a, word in words.items()} == expected[material]

    run_bench(unit, bench)


def test_a_bank_past_the_last_is_lost():
    """There are three banks. The bank past the last does not replace the threshold of the material either."""
    unit = FrameConstantsUnit(1, 2, UQ(3, 15), banks=3)

    async def bench(ctx):
        for given, bank in ((1, 1), (3, 1), (2, 2), (4, 2), (2**17, 2), (2**16 + 1, 2), (0, 0)):
            await write(ctx, unit, BANK_ADDRESS, given)
            await ctx.tick().repeat(2)
            assert ctx.get(unit.constants.bank) == bank
            assert ctx.get(unit.constants.threshold) == 0

    run_bench(unit, bench)


@pytest.mark.parametrize("materials", [0, -1, MAX_MATERIALS + 1])
def test_numbers_of_materials_out_of_range(materials):
    with pytest.raises(ValueError, match=f"materials must be 1 to {MAX_MATERIALS}, not {materials}"):
        FrameConstantsUnit(1, materials)


def test_reset_clears_the_constants():
    """After a reset all lights are black, and there is no ambient light."""
    unit, reset = FrameConstantsUnit(1), Signal()

    async def bench(ctx):
        for address in words_by_address(unit.constants, 1):
            await write(ctx, unit, address, 1)
        await ctx.tick()
        assert ctx.get(Value.cast(unit.constants)).bit_count() == 4 + 12
        ctx.set(reset, 1)
        await ctx.tick()
        assert ctx.get(Value.cast(unit.constants)) == 0

    run_bench(ResetInserter(reset)(unit), bench)


# Several materials in the pipeline.


def shade(unit, spans, constants, engine):
    """Check that pixels of the existing materials equal the model's."""
    pixels = pixel_beats(unit.model.compute(spans, constants[: unit.model.materials]))
    options = {"count": len(pixels["x"]), "write": writes_of(constants), "engine": engine}
    run = simulate(unit, beats_of(unit, spans), **options)
    assert_beats_equal(run.beats, pixels)
    return run


def test_cost_of_a_material_change():
    """A span of another material is taken 5 cycles after the last pixel of the span before has left.

    Its first pixel comes `latency` cycles later, against 1 cycle without the change. An empty span of a third
    material takes 5 cycles, an empty span of the same material 1 cycle.
    """
    rng = np.random.default_rng(34)
    design = preset(model="cosquad", method="linear", materials=3)
    unit = ShadingPipelineUnit(design)
    lengths = np.array([20, 20, 20, 20, 0, 20, 0, 20, 20, 0, 0, 20])
    material = np.array([0, 0, 1, 2, 2, 1, 2, 1, 0, 1, 2, 0])
    spans = replace(any_spans(rng, design, lengths), material=material)
    run = shade(unit, spans, any_constants(rng, design, spans), "pysim")
    first = np.cumsum(lengths) - lengths
    # Cycles from the last pixel of the span before: to the next span taken, and to its first pixel.
    waits = {
        2: 5,
        3: 5,
        5: 5,
        # An empty span of material 2 comes before it.
        7: 5 + 5,
        8: 5,
        # Two empty spans of other materials come before it.
        11: 5 + 5 + 5,
    }
    for span, cycles in waits.items():
        gone = run.cycles[first[span] - 1]
        assert run.input_cycles[span] - gone == cycles, span
        assert run.cycles[first[span]] - gone == cycles + unit.latency, span
    assert run.cycles[first[1]] - run.cycles[first[1] - 1] == 1


@pytest.mark.long
def test_indices_of_no_material_change_nothing():
    """Writes for a material past the last are taken and lost: 3 materials have indices of 2 bits.

    Of the indices 3, 4 and 5, two have the low bits of existing materials.
    """
    rng = np.random.default_rng(35)
    design = preset(model="cosquad", method="linear", materials=3)
    unit = ShadingPipelineUnit(design)
    spans = any_spans(rng, design, rng.integers(1, 9, 12))
    spans = replace(spans, material=np.arange(12) // 4)
    constants = any_constants(rng, replace(design, materials=6), spans)
    for engine in ("auto", "pysim"):
        shade(unit, spans, constants, engine)
