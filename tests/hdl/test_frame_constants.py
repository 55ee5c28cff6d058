# amaranth: UnusedElaboratable=no
"""Write port: every address, hold, and no change under a span; reset of the whole pipeline in mid span."""

from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Module, ResetInserter, Signal, Value
from amaranth.sim import Simulator

from blysk.golden.frame_constants import (
    FIELDS_OF_A_FRAME,
    FIELDS_OF_A_LIGHT,
    LIGHT_STRIDE,
    MATERIAL_ADDRESS,
    MAX_MATERIALS,
    FrameConstants,
    writes_of,
)
from blysk.golden.lighting.intensity import Intensity
from blysk.golden.number.unit_vector import ONE, quantise
from blysk.golden.pipeline import Spans
from blysk.golden.presets import preset
from blysk.golden.reference.geometry import normalise
from blysk.hdl.frame_constants import FrameConstantsUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.operands import pairs_at

from .pixels import assert_pixels


def run_bench(m, bench):
    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()


def random_constants(rng, lights):
    vectors = quantise(normalise(rng.normal(size=(2, lights, 3))))
    colors = Intensity.color(rng.uniform(0, 0.6, (2, lights, 3)))
    return FrameConstants(
        int(rng.integers(1, 30)), Intensity.color(rng.uniform(0, 0.2, 3)), *vectors, *colors
    )


# The registers alone.


def words_of(constants, lights):
    """Where each address's word is in the output: (fields to it, width, signed)."""
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
    """All 512 addresses, in random order, twice: a word is seen two cycles later, every other one stays."""
    rng = np.random.default_rng(lights)
    unit = FrameConstantsUnit(lights)
    words = words_of(unit.constants, lights)
    assert len(words) == 4 + 12 * lights
    # The words cover the output: nothing is left that no address writes.
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


@pytest.mark.parametrize("lights", [1, pytest.param(3, marks=pytest.mark.long)])
def test_every_address_writes_its_materials_constant_and_no_other(lights):
    """All 512 addresses, and now and then another material, in random order.

    A write is seen 3 cycles later where the word is of the material, and 2 where it is not; another
    material's constants are seen 1 cycle after its index is given.
    """
    rng = np.random.default_rng(10 + lights)
    materials = 3
    unit = FrameConstantsUnit(lights, materials)
    words = words_of(unit.constants, lights)
    of_frame = [(light + 1) * LIGHT_STRIDE + k for light in range(lights) for k in range(6)]

    async def bench(ctx):
        expected = [dict.fromkeys(words, 0) for _ in range(materials)]
        index, material = 0, 0
        for address in np.r_[rng.permutation(512), rng.choice(list(words), 200)].tolist():
            if rng.random() < 0.3:
                index = int(rng.integers(materials))
                await write(ctx, unit, MATERIAL_ADDRESS, index)
            data = int(rng.integers(0, 2**18))
            if address == MATERIAL_ADDRESS:
                data = index = int(rng.integers(materials))
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


@pytest.mark.parametrize("materials", [0, -1, MAX_MATERIALS + 1])
def test_numbers_of_materials_out_of_range(materials):
    with pytest.raises(ValueError, match=f"materials must be 1 to {MAX_MATERIALS}, not {materials}"):
        FrameConstantsUnit(1, materials)


def test_writes_of_a_frame_give_its_constants():
    """The beats of `FrameConstants.writes`, read back by name."""
    given = random_constants(np.random.default_rng(3), 2)
    unit = FrameConstantsUnit(2)
    writes = given.writes()

    async def bench(ctx):
        for address, data in zip(writes["address"].tolist(), writes["data"].tolist(), strict=True):
            await write(ctx, unit, address, data)
        await ctx.tick()
        constants = unit.constants
        assert ctx.get(constants.exponent) == given.exponent
        assert [ctx.get(Value.cast(constants.ambient[k])) for k in range(3)] == given.ambient.tolist()
        for name in FIELDS_OF_A_LIGHT:
            for light in range(2):
                codes = [ctx.get(Value.cast(constants.lights[light][name][k])) for k in range(3)]
                assert codes == getattr(given, name)[light].tolist()

    run_bench(unit, bench)


def test_hold_keeps_a_write_waiting():
    unit = FrameConstantsUnit(1)

    async def bench(ctx):
        ctx.set(unit.hold, 1)
        ctx.set(unit.write.payload, {"address": 0, "data": 77})
        ctx.set(unit.write.valid, 1)
        for _ in range(5):
            assert ctx.get(unit.write.ready) == 0
            await ctx.tick()
            assert ctx.get(unit.constants.exponent) == 0
        ctx.set(unit.hold, 0)
        assert ctx.get(unit.write.ready) == 1
        assert ctx.get(unit.constants.exponent) == 0
        await ctx.tick()
        # No write without valid.
        ctx.set(unit.write.valid, 0)
        ctx.set(unit.write.payload, {"address": 0, "data": 5})
        for _ in range(3):
            await ctx.tick()
            assert ctx.get(unit.constants.exponent) == 77

    run_bench(unit, bench)


# Behind the pipeline's write port.


def random_spans(rng, lengths):
    lengths = np.asarray(lengths)
    left, right = pairs_at(rng, len(lengths), rng.uniform(0, 40, len(lengths)))
    x, y = rng.integers(0, 4000, len(lengths)), rng.integers(0, 4096, len(lengths))
    return Spans(x, y, lengths, quantise(left), quantise(right))


def part(spans, start, stop):
    fields = ("x", "y", "length", "normal_left", "normal_right", "material")
    return Spans(*(getattr(spans, f)[start:stop] for f in fields))


def random_materials(rng, lights, materials):
    """Constants of several materials under the same lights, the exponents and colours far apart."""
    first = random_constants(rng, lights)
    return [
        replace(
            random_constants(rng, lights),
            exponent=1 + 40 * index,
            direction=first.direction,
            halfway=first.halfway,
        )
        for index in range(materials)
    ]


class Driver:
    """A pipeline in pysim: offers spans and writes, each until it is taken, and collects the pixels."""

    PIXEL = ("x", "y", "r", "g", "b", "last")

    def __init__(self, unit):
        self.unit = unit
        self.several = unit.parameters.materials > 1
        self.module = Module()
        self.reset = Signal()
        self.module.submodules.unit = ResetInserter(self.reset)(unit)

    def normals(self, spans):
        """Of both ends, and of the middle where the method takes one."""
        middle = self.unit.parameters.interpolator.TAKES_MIDDLE
        ends = {"left": spans.normal_left, "right": spans.normal_right}
        return ends | ({"middle": spans.middle} if middle else {})

    async def run(self, ctx, cycles, spans, writes, late=None, stalls=(False,)):
        """Writes, then spans; ``late = (cycle, writes)`` offers more writes from that cycle on.

        Returns the pixels with their cycles, the cycles of spans taken, and those of writes taken.
        """
        unit = self.unit
        queue = list(zip(writes["address"].tolist(), writes["data"].tolist(), strict=True))
        pixels, span_cycles, write_cycles = [], [], []
        total = len(queue)
        for clock in range(cycles):
            if late and clock == late[0]:
                queue += zip(late[1]["address"].tolist(), late[1]["data"].tolist(), strict=True)
                total = len(queue)
            writing = len(write_cycles) < len(queue)
            address, data = queue[len(write_cycles)] if writing else (511, 2**18 - 1)
            ctx.set(unit.write.valid, writing)
            ctx.set(unit.write.payload, {"address": address, "data": data})
            # The first frame's writes come before its spans; a late one beside them.
            offered = len(span_cycles) < len(spans) and (len(write_cycles) >= len(writes["address"]))
            index = len(span_cycles)
            if offered:
                ctx.set(
                    unit.i.payload,
                    {
                        **{name: int(getattr(spans, name)[index]) for name in ("x", "y", "length")},
                        **{
                            f"normal_{place}": [c * 2.0**-17 for c in normals[index].tolist()]
                            for place, normals in self.normals(spans).items()
                        },
                        **({"material": int(spans.material[index])} if self.several else {}),
                    },
                )
            ctx.set(unit.i.valid, offered)
            stalled = stalls[clock % len(stalls)]
            ctx.set(unit.o.ready, not stalled)
            if ctx.get(unit.o.valid) and not stalled:
                pixels.append((clock, tuple(ctx.get(unit.o.payload[name]) for name in self.PIXEL)))
            if writing and ctx.get(unit.write.ready):
                write_cycles.append(clock)
            if offered and ctx.get(unit.i.ready):
                span_cycles.append(clock)
            await ctx.tick()
        ctx.set(unit.write.valid, 0)
        ctx.set(unit.i.valid, 0)
        assert len(write_cycles) == total or cycles < 200
        return pixels, span_cycles, write_cycles


def pixels_of(design, spans, constants):
    """By the model."""
    pixels = design.compute(spans, constants)
    columns = (pixels.x, pixels.y, *pixels.color.T, pixels.last)
    return list(zip(*(column.astype(int).tolist() for column in columns), strict=True))


@pytest.mark.parametrize(
    ("late_cycle", "materials", "method"),
    [
        pytest.param(18, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(80, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(150, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(150, 3, "quadratic", marks=pytest.mark.long),
        pytest.param(220, 3, "quadratic", marks=pytest.mark.long),
        pytest.param(80, 1, "chord", marks=pytest.mark.long),
        (150, 3, "chord"),
    ],
)
def test_constants_never_change_under_a_span(late_cycle, materials, method):
    """A second frame is written while spans of the first are inside, and while more are offered.

    What was taken before keeps the first frame's constants to its last pixel; what is taken after has the
    second's. The write waits until the last pixel is gone, and the spans wait for the write. Of three
    materials the second frame writes all, and the spans come in six runs of one.
    """
    rng = np.random.default_rng(late_cycle)
    design = preset(method, "cosquad", materials=materials)
    first, second = random_materials(rng, 1, materials), random_materials(rng, 1, materials)
    spans = random_spans(rng, rng.integers(1, 12, 60))
    spans = replace(spans, material=np.arange(60) // 10 % materials)
    cycles = 960 if materials == 1 else 1700
    driver = Driver(ShadingPipelineUnit(design))
    result = []

    async def bench(ctx):
        stalls = (rng.random(31) < 0.3).tolist()
        result.append(
            await driver.run(ctx, cycles, spans, writes_of(first), (late_cycle, writes_of(second)), stalls)
        )

    run_bench(driver.module, bench)
    pixels, span_cycles, write_cycles = result[0]
    late_writes = write_cycles[len(writes_of(first)["address"]) :]
    before = sum(clock < late_writes[0] for clock in span_cycles)
    assert 0 < before < len(spans) == len(span_cycles)
    expected = pixels_of(design, part(spans, 0, before), first)
    last_clock = pixels[len(expected) - 1][0]
    expected += pixels_of(design, part(spans, before, None), second)
    assert [pixel for _, pixel in pixels] == expected
    # No span comes between the offer of the writes and the last of them, and no write before the last pixel.
    assert not any(late_cycle <= clock <= late_writes[-1] for clock in span_cycles)
    assert late_writes[0] == last_clock + 1
    assert np.all(np.diff(late_writes) == 1)


@pytest.mark.parametrize(
    ("reset_at", "materials", "method"),
    [
        pytest.param(25, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(90, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(131, 1, "quadratic", marks=pytest.mark.long),
        pytest.param(131, 2, "quadratic", marks=pytest.mark.long),
        pytest.param(180, 2, "quadratic", marks=pytest.mark.long),
        pytest.param(60, 1, "chord", marks=pytest.mark.long),
        (131, 2, "chord"),
    ],
)
def test_reset_in_mid_span_leaves_nothing_behind(reset_at, materials, method):
    """Spans in the setup, in the FIFOs and half shaded: after a reset the pipeline does as from power-up."""
    rng = np.random.default_rng(reset_at)
    design = preset(method, "cosquad", materials=materials)
    spans = random_spans(rng, np.r_[40, rng.integers(0, 12, 11)])
    spans = replace(spans, material=np.arange(12) // 4 % materials)
    constants = random_materials(rng, 1, materials)
    writes = writes_of(constants)
    cycles = 330 if materials == 1 else 600
    stalls = (rng.random(31) < 0.2).tolist()
    fresh, again, status = [], [], []

    async def from_power_up(ctx):
        fresh.append(await fresh_driver.run(ctx, cycles, spans, writes, stalls=stalls))

    async def after_reset(ctx):
        other = random_spans(rng, rng.integers(0, 30, 40))
        other = replace(other, material=rng.permutation(np.arange(40) // 4 % materials))
        unit = driver.unit
        await driver.run(ctx, reset_at, other, writes_of(random_materials(rng, 1, materials)))
        ctx.set(driver.reset, 1)
        await ctx.tick()
        ctx.set(driver.reset, 0)
        status.append([ctx.get(unit.status[n]) for n in ("out_of_range_spans", "empty_spans", "overrun")])
        assert ctx.get(unit.o.valid) == 0
        again.append(await driver.run(ctx, cycles, spans, writes, stalls=stalls))
        status.append(ctx.get(unit.status.empty_spans))

    fresh_driver, driver = Driver(ShadingPipelineUnit(design)), Driver(ShadingPipelineUnit(design))
    run_bench(fresh_driver.module, from_power_up)
    run_bench(driver.module, after_reset)
    assert again == fresh
    assert [pixel for _, pixel in again[0][0]] == pixels_of(design, spans, constants)
    assert status == [[0, 0, 0], np.count_nonzero(spans.length == 0)]


def test_reset_clears_the_constants():
    """Black light and no ambient: a span after a reset without writes is black."""
    rng = np.random.default_rng(1)
    driver = Driver(ShadingPipelineUnit())
    spans = random_spans(rng, [3])
    none = {"address": np.zeros(0, int), "data": np.zeros(0, int)}
    result = []

    async def bench(ctx):
        bright = FrameConstants(
            1, np.full(3, 2**17 - 1), *[np.array([[0, 0, ONE]])] * 2, *[np.full((1, 3), 999)] * 2
        )
        result.append(await driver.run(ctx, 150, spans, bright.writes()))
        ctx.set(driver.reset, 1)
        await ctx.tick()
        ctx.set(driver.reset, 0)
        result.append(await driver.run(ctx, 150, spans, none))

    run_bench(driver.module, bench)
    (before, *_), (after, *_) = result
    assert len(before) == len(after) == 3
    assert {pixel[2:5] for _, pixel in before} == {(255, 255, 255)}
    assert {pixel[2:5] for _, pixel in after} == {(0, 0, 0)}


# Several materials in the pipeline.


def run_pipeline(unit, spans, constants, count, **options):
    fields = ("x", "y", "length", "normal_left", "normal_right", "material")
    beats = {name: getattr(spans, name) for name in fields}
    return simulate(unit, beats, count=count, write=writes_of(constants), **options)


def test_cost_of_a_material_change():
    """A span of another material is taken 5 cycles after the last pixel of the span before it has left.

    Its first pixel comes `latency` cycles later, against 1 cycle without the change. An empty span of yet
    another material takes 5 cycles; one of the same takes 1.
    """
    rng = np.random.default_rng(34)
    design = preset(model="cosquad", method="linear", materials=3)
    unit = ShadingPipelineUnit(design)
    lengths = np.array([20, 20, 20, 20, 0, 20, 0, 20, 20, 0, 0, 20])
    material = np.array([0, 0, 1, 2, 2, 1, 2, 1, 0, 1, 2, 0])
    spans = replace(random_spans(rng, lengths), material=material)
    constants = random_materials(rng, 1, 3)
    pixels = design.compute(spans, constants)
    run = run_pipeline(unit, spans, constants, len(pixels.x), engine="pysim")
    assert_pixels(run, pixels)
    first = np.cumsum(lengths) - lengths
    # Clocks from the last pixel of the span before: to the next span taken, to its first pixel.
    waits = {
        2: 5,
        3: 5,
        5: 5,
        # An empty span of material 2 before it.
        7: 5 + 5,
        8: 5,
        # Two empty spans of other materials before it.
        11: 5 + 5 + 5,
    }
    for span, cycles in waits.items():
        gone = run.cycles[first[span] - 1]
        assert run.input_cycles[span] - gone == cycles, span
        assert run.cycles[first[span]] - gone == cycles + unit.latency, span
    assert run.cycles[first[1]] - run.cycles[first[1] - 1] == 1


@pytest.mark.long
def test_indices_of_no_material_change_nothing():
    """Writes for a material past the last one are taken and lost: 3 words have indices of 2 bits."""
    rng = np.random.default_rng(35)
    design = preset(model="cosquad", method="linear", materials=3)
    unit = ShadingPipelineUnit(design)
    spans = random_spans(rng, rng.integers(1, 9, 12))
    spans = replace(spans, material=np.arange(12) // 4)
    constants = random_materials(rng, 1, 4)
    pixels = design.compute(spans, constants[:3])
    for engine in ("auto", "pysim"):
        assert_pixels(run_pipeline(unit, spans, constants, len(pixels.x), engine=engine), pixels)
