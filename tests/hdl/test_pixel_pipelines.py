"""Several pipelines: the pixels of each equal the model's under stalls; cycles, back-pressure, writes,
counters.

`tests.test_units` compares the merged stream with the model. This file has the separate outputs.
"""

from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.bench.units.pipeline_spans import any_constants, any_spans, ends_for
from blysk.bench.units.record import STALLS
from blysk.golden.frame_constants import writes_of
from blysk.golden.pixel_pipelines import PixelPipelines
from blysk.golden.presets import preset
from blysk.hdl.pixel_pipelines import MergedPipelinesUnit, PixelPipelinesUnit, WidePipelinesUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.frames.frame import beats_of

from ..checks import words_of

PLAIN = preset(model="cosquad", lights=0, x_bits=6, y_bits=4, length_bits=4)
"""The smallest pipelines: their pixels have the ambient colour."""


def shade(unit, spans, constants, **options):
    """Pixels of each lane, in the order in which they left, and the run."""
    spans = ends_for(unit.model.design, spans)
    beats = beats_of(unit, spans)
    options = {"count": None, "engine": "auto", "idle_timeout": 500, **options}
    run = simulate(unit, beats, write=writes_of(constants), **options)
    present = run.beats["present"][:, np.newaxis] >> np.arange(unit.model.pipes) & 1 == 1
    assert present.any(axis=1).all()
    pixels = run.beats["pixels"]
    return [pixels[:, k][present[:, k]] for k in range(present.shape[1])], run


def assert_lanes(lanes, expected):
    for lane, pixels in zip(lanes, expected, strict=True):
        for name, codes in {"x": pixels.x, "y": pixels.y, "last": pixels.last}.items():
            np.testing.assert_array_equal(lane[name], codes)
        np.testing.assert_array_equal(np.stack([lane[c] for c in "rgb"], axis=-1), pixels.color)


@pytest.fixture(scope="module")
def wide():
    """Two materials and two pipelines. FIFOs are so short that they become full."""
    return WidePipelinesUnit(PixelPipelines(preset("linear", "cosquad", materials=2).built(pipes=2)), 5)


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("shares", STALLS[::3])
def test_each_lane_equals_its_model_under_stalls(wide, shares):
    """Every pixel of every pipeline comes in order, while materials change. Counters are sums."""
    rng = np.random.default_rng([7, *(int(10 * share) for share in shares)])
    model = wide.model
    spans = any_spans(rng, model.design, rng.integers(0, 12, 400))
    constants = any_constants(rng, model.design, spans)
    patterns = [rng.random(period) < share for period, share in zip((997, 1009), shares, strict=True)]
    stalls = dict(zip(("input_stalls", "output_stalls"), patterns, strict=True))
    lanes, run = shade(wide, spans, constants, **stalls)
    sent = ends_for(model.design, spans)
    expected = model.compute_each(sent, constants)
    assert_lanes(lanes, expected)
    assert run.status["out_of_range_spans"] == sum(pixels.out_of_range_spans for pixels in expected) > 0
    assert run.status["empty_spans"] == np.count_nonzero(spans.length == 0)


@pytest.mark.long
@pytest.mark.parametrize("pipes", [1, 2, 4, 8])
def test_so_many_pixels_a_cycle(pipes):
    """Spans have as many pixels as there are pipelines, from scanline to scanline.

    So no pipeline ever waits.
    """
    unit = WidePipelinesUnit(PixelPipelines(PLAIN.built(pipes=pipes)), 33)
    rng, count = np.random.default_rng(5), 240
    spans = replace(any_spans(rng, PLAIN, np.full(count, 9)), y=np.arange(count) % 16)
    lanes, run = shade(unit, spans, any_constants(rng, PLAIN, spans))
    # The first span of each pipeline comes a cycle after that of the pipeline before.
    assert run.cycles[-1] - run.cycles[0] == 9 * count // pipes + pipes - 2
    # Two FIFOs pause for a word that is written to the address that they read. This happens if words come in
    # every second cycle.
    assert run.cycles[0] == run.input_cycles[0] + unit.latency + (2 if pipes == 2 else 0)
    assert [len(lane) for lane in lanes] == [9 * count // pipes] * pipes


@pytest.mark.long
def test_counters_are_sums_that_stop():
    unit = WidePipelinesUnit(PixelPipelines(PLAIN.built(pipes=2)), 4)
    rng, few = np.random.default_rng(8), 300
    spans = any_spans(rng, PLAIN, np.r_[np.zeros(few, dtype=int), 1])
    for repeats, expected in ((1, few), (1 << 16, 65535)):
        sent = spans[np.r_[np.zeros(repeats, dtype=int), : len(spans)]] if repeats > 1 else spans
        sent = replace(sent, y=np.arange(len(sent)) % 16)
        _, run = shade(unit, sent, any_constants(rng, PLAIN, spans))
        assert run.status["empty_spans"] == expected


def bench(unit, process):
    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(process)
    simulator.run()


def test_a_port_that_waits_stops_its_pipeline_alone():
    """The pipeline stops until its FIFO is full. Its pixel does not change meanwhile, and nothing is lost."""
    unit, found = PixelPipelinesUnit(PixelPipelines(PLAIN.built(pipes=2)), 4), ([], [])
    rng = np.random.default_rng(9)
    spans = any_spans(rng, PLAIN, np.full(60, 2))
    # Three spans in a row go to the first pipeline, whose port waits. The rest go to the other pipeline.
    spans = replace(spans, y=np.r_[0, 2, 4, np.ones(57, dtype=int)])
    words = words_of(unit.i, beats_of(unit, spans))

    async def process(context):
        sent, waiting = 0, set()
        for _ in range(400):
            open_again = len(found[1]) == 114
            context.set(unit.o[0].ready, open_again)
            context.set(unit.o[1].ready, 1)
            context.set(unit.i.valid, sent < len(words))
            context.set(Value.cast(unit.i.payload).as_unsigned(), words[min(sent, len(words) - 1)])
            for lane, port in zip(found, unit.o, strict=True):
                if context.get(port.valid & port.ready):
                    lane.append((context.get(port.payload.x), context.get(port.payload.y)))
            if context.get(unit.o[0].valid) and not open_again:
                waiting.add(context.get(Value.cast(unit.o[0].payload).as_unsigned()))
            sent += context.get(unit.i.valid & unit.i.ready)
            await context.tick()
            if len(found[0]) == 6 and len(found[1]) == 114:
                break
        assert len(waiting) == 1
        assert len(found[0]) == 6

    bench(unit, process)
    for lane, pipe in zip(found, (0, 1), strict=True):
        mine = spans[spans.y % 2 == pipe]
        starts = zip(mine.x.tolist(), mine.y.tolist(), strict=True)
        assert lane == [(x + k, y) for x, y in starts for k in (0, 1)]


def test_writes_between_frames():
    """If a write comes while spans wait, it is accepted after their pixels, and before any new span."""
    unit = MergedPipelinesUnit(PixelPipelines(PLAIN.built(pipes=4)), 5)
    rng = np.random.default_rng(10)
    frames = []
    # At first only its FIFO tells that a single span is inside.
    for count in (25, 1, 1, 25):
        spans = any_spans(rng, PLAIN, rng.integers(1, 6, count))
        frames.append((spans, any_constants(rng, PLAIN, spans)))
    expected = [unit.model.compute(spans, constants) for spans, constants in frames]
    events, found = [], []

    async def send(context, port, words, name):
        """Send each word until it is accepted. Meanwhile pixels are taken in most cycles."""
        sent = 0
        while sent < len(words):
            context.set(port.valid, 1)
            context.set(Value.cast(port.payload).as_unsigned(), words[sent])
            if await step(context, port):
                events.append((name, len(found)))
                sent += 1
        context.set(port.valid, 0)

    async def step(context, port):
        context.set(unit.o.ready, rng.random() < 0.6)
        accepted = context.get(port.valid & port.ready)
        if context.get(unit.o.valid & unit.o.ready):
            found.append([context.get(unit.o.payload[name]) for name in ("x", "y", *"rgb")])
        # No span is accepted while a write waits.
        assert not context.get(unit.write.valid & unit.i.ready)
        await context.tick()
        return accepted

    async def process(context):
        for spans, constants in frames:
            await send(context, unit.write, words_of(unit.write, writes_of(constants)), "write")
            await send(context, unit.i, words_of(unit.i, beats_of(unit, spans)), "span")
        for _ in range(400):
            await step(context, unit.i)

    bench(unit, process)
    np.testing.assert_array_equal(
        found, np.concatenate([np.column_stack([p.x, p.y, p.color]) for p in expected])
    )
    # Writes of the second frame came when all earlier pixels had left the pipelines. A few pixels may still
    # be in the merger and its register.
    totals = np.cumsum([0] + [len(p.x) for p in expected])
    index, before = -1, "span"
    for name, taken in events:
        index += name == "write" and before == "span"
        before = name
        if name == "write":
            assert totals[index] - 3 <= taken <= totals[index]
    assert index == 3
