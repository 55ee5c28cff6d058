"""Rings of words in registers and in memories."""

import numpy as np
import pytest
from amaranth.hdl import Module, Signal
from amaranth.sim import Simulator

from blysk.hdl.core.memory import clocked_reads
from blysk.hdl.core.ring import RING_REGISTERS, Ring, next_turn

BITS = 7


def first_words(count, late, turns, words):
    """First words of a ring over the cycles, ``None`` where the word did not come in yet."""
    ring, given, found = [None] * (count - late), None, []
    for turn, word in zip(turns, words, strict=True):
        found.append((ring[0], given))
        if turn:
            ring, given = [*ring[1:], word], word
    return found


@pytest.mark.parametrize("clocked", [False, True])
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("count", range(RING_REGISTERS - 1, 2 * RING_REGISTERS + 1))
def test_words_take_turns(count, late, clocked):
    """A word leaves as many turns after it came as there are words, or one turn less if it comes late."""
    rng = np.random.default_rng(count)
    turns, words = rng.random(300) < 0.7, rng.integers(0, 1 << BITS, 300)
    m, turn, word, place = Module(), Signal(), Signal(BITS), Signal(range(count))
    ring = Ring(m, "ring", BITS, count, turn, place, late)
    ring.takes(word)
    with m.If(turn):
        m.d.sync += place.eq(next_turn(place, count))
    found = []

    async def testbench(ctx):
        for given in zip(turns.tolist(), words.tolist(), strict=True):
            ctx.set(turn, given[0])
            ctx.set(word, given[1])
            found.append((ctx.get(ring.first), ctx.get(ring.newest)))
            await ctx.tick()

    with clocked_reads(clocked):
        simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(testbench)
    simulator.run()
    expected = first_words(count, late, turns, words)
    known = [(f, e) for f, e in zip(found, expected, strict=True) if e[0] is not None]
    assert len(known) > 250
    assert all(first == word for (first, _), (word, _) in known)
    if not late:
        assert all(newest == word for (_, newest), (_, word) in known)
