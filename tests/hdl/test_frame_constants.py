# amaranth: UnusedElaboratable=no
"""Write port: every address, hold, and no change under a span; reset of the whole pipeline in mid span."""

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
    FrameConstants,
    writes_of,
)
from blysk.golden.number.fixed import UQ
from blysk.golden.number.unit_vector import ONE
from blysk.golden.presets import preset
from blysk.hdl.frame_constants import FrameConstantsUnit
from blysk.hdl.pipeline import ShadingPipelineUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of
from blysk.sim.frames.testbench import pixel_beats

from ..checks import assert_beats_equal, words_of


def run_bench(m, bench):
    simulator = Simulator(m)
    simulator.add_clock(1e-8)
    simulator.add_testbench(bench)
    simulator.run()


# The registers alone.


def words_by_address(constants, lights):
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
    words = words_by_address(unit.constants, lights)
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


@pytest.mark.long
@pytest.mark.parametrize("lights", [1, pytest.param(3, marks=pytest.mark.long)])
def test_every_address_writes_its_materials_constant_and_no_other(lights):
    """All 512 addresses, and now and then another material, or one that there is not, in random order.

    A write is seen 3 cycles later where the word is of the material, and 2 where it is not; another
    material's constants are seen 1 cycle after its index is given.
    """
    rng = np.random.default_rng(10 + lights)
    materials = 3
    # Their low bits are those of a material in every case; writes for the last six are lost.
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
    """Of three banks; nor does it take the place of the material's threshold."""
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


ALL_ONES = (1 << 27) - 1
"""Address and data of a write that is not offered."""


class Driver:
    """A pipeline in pysim: offers spans and writes, each until it is taken, and collects the pixels."""

    PIXEL = ("x", "y", "r", "g", "b", "last")

    def __init__(self, design):
        self.unit, self.reset = ShadingPipelineUnit(design), Signal()
        self.module = ResetInserter(self.reset)(self.unit)

    async def restart(self, ctx):
        ctx.set(self.reset, 1)
        await ctx.tick()
        ctx.set(self.reset, 0)

    async def run(self, ctx, cycles, spans, writes, late=None, stalls=(False,)):
        """Writes, then spans; ``late = (cycle, writes)`` offers more writes from that cycle on.

        Returns the pixels with their cycles, the cycles of spans taken, and those of writes taken.
        """
        unit = self.unit
        words, queue = words_of(unit.i, beats_of(unit, spans)), words_of(unit.write, writes)
        first = len(queue)
        pixels, span_cycles, write_cycles = [], [], []
        for clock in range(cycles):
            if late and clock == late[0]:
                queue += words_of(unit.write, late[1])
                begun = unit._interpolator.has_begun
                self.begun = 0 if begun is None else ctx.get(begun)
            writing = len(write_cycles) < len(queue)
            ctx.set(unit.write.valid, writing)
            word = queue[len(write_cycles)] if writing else -1
            ctx.set(Value.cast(unit.write.payload).as_unsigned(), word & ALL_ONES)
            # The first frame's writes come before its spans; a late one beside them.
            offered = len(span_cycles) < len(words) and len(write_cycles) >= first
            if offered:
                ctx.set(Value.cast(unit.i.payload).as_unsigned(), words[len(span_cycles)])
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
        assert len(write_cycles) == len(queue) or cycles < 200
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
        pytest.param(80, 1, "quotient", marks=pytest.mark.long),
        pytest.param(150, 3, "quotient", marks=[pytest.mark.ci, pytest.mark.long]),
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
    spans = any_spans(rng, design, rng.integers(1, 12, 60))
    spans = replace(spans, material=np.arange(60) // 10 % materials)
    first, second = (any_constants(rng, design, spans) for _ in range(2))
    cycles = 960 if materials == 1 else 1700
    if design.loads_tables:
        tables = len(writes_of(first)["address"])
        late_cycle, cycles = late_cycle + tables, cycles + 2 * tables
    driver = Driver(design)
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
    expected = pixels_of(design, spans[:before], first)
    last_clock = pixels[len(expected) - 1][0]
    expected += pixels_of(design, spans[before:], second)
    assert [pixel for _, pixel in pixels] == expected
    # No span begins between the offer of the writes and the last of them, and no write before the last pixel.
    # A span with vectors stays at the port for some cycles: that which had begun is taken.
    taken = [clock for clock in span_cycles if late_cycle <= clock <= late_writes[-1]]
    assert len(taken) == driver.begun
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
        pytest.param(60, 1, "quotient", marks=pytest.mark.long),
        pytest.param(131, 2, "quotient", marks=[pytest.mark.ci, pytest.mark.long]),
    ],
)
def test_reset_in_mid_span_leaves_nothing_behind(reset_at, materials, method):
    """Spans in the setup, in the FIFOs and half shaded: after a reset the pipeline does as from power-up."""
    rng = np.random.default_rng(reset_at)
    design = preset(method, "cosquad", materials=materials)
    spans = any_spans(rng, design, np.r_[40, rng.integers(0, 12, 11)])
    spans = replace(spans, material=np.arange(12) // 4 % materials)
    other = any_spans(rng, design, rng.integers(0, 30, 40))
    other = replace(other, material=rng.permutation(np.arange(40) // 4 % materials))
    constants = any_constants(rng, design, spans)
    cycles = 330 if materials == 1 else 600
    if design.loads_tables:
        tables = len(writes_of(constants)["address"])
        reset_at, cycles = reset_at + tables, cycles + tables
    stalls = (rng.random(31) < 0.2).tolist()
    driver, runs, status = Driver(design), [], []

    async def bench(ctx):
        unit = driver.unit
        runs.append(await driver.run(ctx, cycles, spans, writes_of(constants), stalls=stalls))
        await driver.restart(ctx)
        await driver.run(ctx, reset_at, other, writes_of(any_constants(rng, design, other)))
        await driver.restart(ctx)
        status.append([ctx.get(unit.status[n]) for n in ("out_of_range_spans", "empty_spans", "overrun")])
        assert ctx.get(unit.o.valid) == 0
        runs.append(await driver.run(ctx, cycles, spans, writes_of(constants), stalls=stalls))
        status.append(ctx.get(unit.status.empty_spans))

    run_bench(driver.module, bench)
    fresh, again = runs
    assert again == fresh
    assert [pixel for _, pixel in again[0]] == pixels_of(design, spans, constants)
    assert status == [[0, 0, 0], np.count_nonzero(spans.length == 0)]


def test_reset_clears_the_constants():
    """Black light and no ambient: a span after a reset without writes is black."""
    design = preset(model="cosquad")
    driver, spans = Driver(design), any_spans(np.random.default_rng(1), design, np.array([3]))
    none = {"address": np.zeros(0, int), "data": np.zeros(0, int)}
    result = []

    async def bench(ctx):
        bright = FrameConstants(
            1, np.full(3, 2**17 - 1), *[np.array([[0, 0, ONE]])] * 2, *[np.full((1, 3), 999)] * 2
        )
        result.append(await driver.run(ctx, 150, spans, bright.writes()))
        await driver.restart(ctx)
        result.append(await driver.run(ctx, 150, spans, none))

    run_bench(driver.module, bench)
    (before, *_), (after, *_) = result
    assert len(before) == len(after) == 3
    assert {pixel[2:5] for _, pixel in before} == {(255, 255, 255)}
    assert {pixel[2:5] for _, pixel in after} == {(0, 0, 0)}


# Several materials in the pipeline.


def shade(unit, spans, constants, engine):
    """Pixels of the materials that there are equal the model's."""
    pixels = pixel_beats(unit.model.compute(spans, constants[: unit.model.materials]))
    options = {"count": len(pixels["x"]), "write": writes_of(constants), "engine": engine}
    run = simulate(unit, beats_of(unit, spans), **options)
    assert_beats_equal(run.beats, pixels)
    return run


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
    spans = replace(any_spans(rng, design, lengths), material=material)
    run = shade(unit, spans, any_constants(rng, design, spans), "pysim")
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
    """Writes for a material past the last one are taken and lost: 3 words have indices of 2 bits.

    Of the indices 3, 4 and 5 the low bits of two are those of materials.
    """
    rng = np.random.default_rng(35)
    design = preset(model="cosquad", method="linear", materials=3)
    unit = ShadingPipelineUnit(design)
    spans = any_spans(rng, design, rng.integers(1, 9, 12))
    spans = replace(spans, material=np.arange(12) // 4)
    constants = any_constants(rng, replace(design, materials=6), spans)
    for engine in ("auto", "pysim"):
        shade(unit, spans, constants, engine)
