# amaranth: UnusedElaboratable=no
"""Memories that are written: each unit then gives the words of the other memory."""

import numpy as np
from amaranth.hdl import Value
from amaranth.sim import Simulator

from blysk.bench.units.video.meshes import any_memory
from blysk.golden.video.draw_commands import COMMAND_BITS, DrawCommands
from blysk.golden.video.motion import ENTRIES, Motion
from blysk.hdl.video.draw_commands import DrawCommandsUnit
from blysk.hdl.video.mesh_memory import MeshMemoryUnit
from blysk.hdl.video.motion import MotionUnit
from blysk.sim.engines.simulate import simulate


def writes(words, width):
    """Beats that write words from address 0 on."""
    size = -(-width // 8)
    data = np.frombuffer(b"".join(word.to_bytes(size, "little") for word in words), dtype=np.uint8)
    return {"address": np.arange(len(words)), "data": data.reshape(-1, size)}


def run(unit, beats, write, count):
    return simulate(unit, beats, write=write, count=count, engine="pysim").beats


def test_vertices():
    old, new = any_memory(9, 5), any_memory(9, 5, seed=1)
    write = writes(new.vertex_words, new.vertex_bits)
    found = run(MeshMemoryUnit(old, True), {"first": np.array([0]), "count": np.array([9])}, write, 9)
    np.testing.assert_array_equal(found["position"], new.position)
    np.testing.assert_array_equal(found["normal"], new.normal)


def test_writes_wait_while_a_range_is_read():
    """Ranges and writes are offered all the time. One word is written before each range, and none inside."""
    count = 5
    old, new = any_memory(count, 5), any_memory(count, 5, seed=1)
    unit, given = MeshMemoryUnit(old, True), writes(new.vertex_words, new.vertex_bits)
    found, written = [], []

    async def read(context):
        context.set(unit.i.payload, {"first": 0, "count": count})
        context.set(unit.i.valid, 1)
        context.set(unit.o.ready, 1)
        while len(found) < count * count:
            *_, valid, vertex = await context.tick().sample(unit.o.valid, Value.cast(unit.o.payload))
            if valid:
                found.append(vertex >> old.index_bits)

    async def write(context):
        context.set(unit.write.valid, 1)
        for address, data in zip(given["address"].tolist(), given["data"].tolist(), strict=True):
            context.set(unit.write.payload, {"address": address, "data": data})
            await context.tick().until(unit.write.ready)
            written.append(len(found))
        context.set(unit.write.valid, 0)

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(read)
    simulator.add_testbench(write, background=True)
    simulator.run()
    ranges = [found[k : k + count] for k in range(0, len(found), count)]
    expected = [
        new.vertex_words[: number + 1] + old.vertex_words[number + 1 :] for number in range(len(ranges))
    ]
    assert ranges == expected
    assert len(written) == count


def test_commands():
    rng = np.random.default_rng(3)
    rows = [
        np.c_[rng.integers(1, 5, 8), rng.integers(0, 512, 8), rng.integers(0, 4096, (8, 2))] for _ in "ab"
    ]
    old, new = (DrawCommands(np.r_[each, [[0, 0, 0, 0]]], (0,)) for each in rows)
    write = writes(new.codes, COMMAND_BITS)
    found = run(DrawCommandsUnit(old, True), {"start": np.array([0]), "first_band": np.array([1])}, write, 9)
    np.testing.assert_array_equal(np.c_[[found[k] for k in ("kind", "index", "first", "count")]].T, new.words)


def test_matrices():
    rng = np.random.default_rng(4)
    old, new = (
        Motion(
            rng.integers(-(1 << 24), 1 << 24, (1, ENTRIES)),
            *rng.integers(-(1 << 17), 1 << 17, (2, 1, ENTRIES)),
        )
        for _ in "ab"
    )
    write = writes(new.words, Motion.WORD_BITS)
    beats = {"slot": np.array([0]), "angle": np.array([777])}
    found = run(MotionUnit(old, True), beats, write, ENTRIES)
    np.testing.assert_array_equal(found["value"], new.compute(np.array(0), np.array(777)))
