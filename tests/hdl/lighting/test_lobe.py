# amaranth: UnusedElaboratable=no
"""Lobe unit: beats without a highlight, and refusals. `tests.formal` proves its writes and its terms."""

from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Fragment, Value
from amaranth.sim import Simulator

from blysk.bench.units.lighting.lobe import RECORD
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import Fixed
from blysk.hdl.lighting.lobe import LobeMemory, LobeUnit

OPERANDS = ("cosine", "one_minus_cosine")
CHORD = "one_minus_cosine"
LOBE = Lobe(operand=CHORD)


def beats_of(unit, table, seed=0):
    """Beats of the record at the ends of every step, a tenth of them dark, and the model's terms."""
    beats = RECORD.stimuli["highlights"].make(unit, np.random.default_rng(seed), 1300).beats
    operand = Fixed(unit.model.operand_format, beats["operand"])
    return beats, unit.model.compute(operand, beats["dark"], table).codes


@pytest.mark.parametrize("operand", OPERANDS)
def test_dark_beats_do_not_toggle(operand):
    """For beats that are dark or behind, only registers of the input and the first registers change."""
    model = Lobe(operand=operand)
    table = model.table(20)
    unit = LobeUnit(model, tables=[table])
    fragment = Fragment.get(unit, None)
    ((path, _, _),) = [part for part in fragment.subfragments if part[1] == "datapath"]
    registers = {
        signal.name: signal for statement in path.statements["sync"] for signal in statement._lhs_signals()
    }
    assert {"argument", "zeros", "memory_0_0", "memory_0_1", "memory_0_fraction", "product", "term"} < set(
        registers
    )
    # The first register holds the operand.
    del registers["one_minus_cosine"]
    seen = []
    rng = np.random.default_rng(3)
    codes = beats_of(unit, table)[0]["operand"]
    behind = codes[codes <= 0] if operand == "cosine" else codes[codes >= 1 << 25]
    lit = codes[codes > 0] if operand == "cosine" else codes[codes < 1 << 25]

    async def bench(context):
        context.set(unit.o.ready, 1)
        context.set(unit.i.valid, 1)
        for clock in range(140):
            dark = int(clock < 120 and rng.random() < 0.5)
            code = rng.choice(codes if dark else behind if clock < 120 else lit)
            context.set(Value.cast(unit.i.payload.operand), int(code))
            context.set(unit.i.payload.dark, dark)
            await context.tick()
            if clock > 20:
                seen.append({name: context.get(Value.cast(s)) for name, s in registers.items()})

    simulator = Simulator(fragment)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert len(behind) > 3
    *dark, _ = seen[:100]
    assert all(now == dark[0] for now in dark)
    # All of them change if there is light.
    assert all(any(now[name] != dark[0][name] for now in seen[99:]) for name in registers)


def test_bad_options_are_refused():
    table = LOBE.table(20)
    with pytest.raises(ValueError, match=r"^there must be a table for each of 2 banks, not 1$"):
        LobeUnit(replace(LOBE, banks=2), tables=[table])
    with pytest.raises(ValueError, match=r"^there must be a table for each of 1 banks, not 0$"):
        LobeMemory(LOBE, [])
    with pytest.raises(ValueError, match=r"^the table has 20 octaves of 16 steps, the unit 12 of 16$"):
        LobeUnit(replace(LOBE, octaves=12), tables=[table])
    with pytest.raises(ValueError, match=r"^a unit that shares a memory has no tables of its own$"):
        LobeUnit(LOBE, tables=[table], shares_memory=True)
    with pytest.raises(ValueError, match=r"^interval must be at least 1, not 0$"):
        LobeUnit(LOBE, 0)
