# amaranth: UnusedElaboratable=no
"""Texture sampler with a memory outside that answers after any number of cycles, and refusals."""

import numpy as np
import pytest
from amaranth.hdl import Module, Signal
from amaranth.lib import wiring

from blysk.bench.units.albedo.texture_sampler import RECORD
from blysk.golden.albedo.texel_memory import TexelMemory
from blysk.golden.albedo.texture_sampler import TextureSampler
from blysk.hdl.albedo.texel_memory import TexelMemoryUnit
from blysk.hdl.albedo.texture_sampler import TextureSamplerUnit
from blysk.hdl.core.stream import connect, connect_fifo
from blysk.sim.engines.simulate import simulate

from ...checks import assert_equals_model

MEMORY = TexelMemory(104, external=True)


class OutsideMemory(wiring.Component):
    """A sampler with a memory outside. Each answer of the memory waits up to ``longest - 1`` cycles."""

    def __init__(self, longest, waiting=16):
        self.model = TextureSampler(MEMORY)
        self.longest, self.sampler = longest, TextureSamplerUnit(self.model, waiting=waiting)
        self.memory = TexelMemoryUnit(MEMORY)
        members = {name: self.sampler.signature.members[name] for name in ("i", "o", "constants")}
        super().__init__({**members, "write": self.memory.signature.members["write"]})

    def elaborate(self, platform):
        m = Module()
        m.submodules.sampler, m.submodules.memory = sampler, memory = self.sampler, self.memory
        connect(m, wiring.flipped(self.i), sampler.i)
        connect(m, sampler.o, wiring.flipped(self.o))
        connect(m, wiring.flipped(self.write), memory.write)
        m.d.comb += sampler.constants.eq(self.constants)
        connect_fifo(m, "requests", sampler.request, memory.i, 4)
        answers = memory.o.signature.flip().create(path=("answers",))
        connect_fifo(m, "responses", memory.o, answers, 8)
        random, left = Signal(16, init=1), Signal(range(self.longest + 1))
        m.d.sync += random.eq(
            random.rotate_left(1) ^ (random[15] << 5) ^ (random[15] << 3) ^ (random[15] << 2)
        )
        m.d.comb += [
            sampler.response.payload.eq(answers.payload),
            sampler.response.valid.eq(answers.valid & (left == 0)),
            answers.ready.eq(sampler.response.ready & (left == 0)),
        ]
        with m.If(left != 0):
            m.d.sync += left.eq(left - 1)
        with m.Elif(answers.valid & sampler.response.ready):
            m.d.sync += left.eq(random % self.longest)
        return m


@pytest.mark.parametrize(("longest", "waiting"), [(9, 16), pytest.param(3, 4, marks=pytest.mark.long)])
def test_any_latency(longest, waiting):
    """The colours and their order do not depend on the latency, under all stalls of the record."""
    unit = OutsideMemory(longest, waiting)
    runs = [run for run in RECORD.runs(unit, "places") if not run.settles]
    for run in runs[:8]:
        assert_equals_model(unit, run)


@pytest.mark.long
def test_keeps_its_rate_while_answers_are_on_their_way():
    """A memory with a latency gives a colour in every cycle: two FIFOs and the banks."""
    unit = OutsideMemory(1)
    case = next(iter(RECORD.runs(unit, "places"))).case
    found = simulate(unit, case.beats, count=len(case.beats["level"]), **case.sent)
    assert (np.diff(found.cycles) == 1).all()


def test_bad_options_are_refused():
    with pytest.raises(ValueError, match=r"^waiting must be at least 4, not 3$"):
        TextureSamplerUnit(waiting=3)
