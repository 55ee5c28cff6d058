# amaranth: UnusedElaboratable=no
"""Lobe unit: lost writes, writes beside a unit that stands still, banks, a memory for two lights, cost."""

from dataclasses import replace

import numpy as np
import pytest
from amaranth.hdl import Fragment, Module, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.sim import Simulator

from blysk.bench.units.lighting.lobe import RECORD
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.fixed import Fixed
from blysk.golden.reference.lobes import BECKMANN, GGX
from blysk.golden.reference.reflection import BLINN
from blysk.hdl.core.fixed import FixedShape
from blysk.hdl.core.stream import connect_fifo
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.lobe import LobeMemory, LobeUnit, lobe_write_shape
from blysk.hdl.lighting.specular import highlight_shape
from blysk.sim.engines.simulate import simulate

OPERANDS = ("cosine", "one_minus_cosine")
CHORD = "one_minus_cosine"
LOBE = Lobe(operand=CHORD)
CASES = ((BLINN, 1), (BLINN, 20), (BLINN, 1000), (BECKMANN, 0.3), (BECKMANN, 1), (GGX, 0.05), (GGX, 1))


def beats_of(unit, table, seed=0):
    """Beats of the record, at the ends of every step, a tenth of them dark; and the model's terms."""
    beats = RECORD.stimuli["highlights"].make(unit, np.random.default_rng(seed), 1300).beats
    operand = Fixed(unit.model.operand_format, beats["operand"])
    return beats, unit.model.compute(operand, beats["dark"], table).codes


def writes_of(*writes):
    """Writes of several tables, one after the other."""
    return {name: np.concatenate([of_table[name] for of_table in writes]) for name in ("value", "begins")}


def check(unit, beats, expected, **options):
    run = simulate(unit, beats, count=len(expected), engine="auto", **options)
    np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.long
@pytest.mark.parametrize("interval", [3, pytest.param(1, marks=pytest.mark.long)])
@pytest.mark.parametrize("fixed", [False, pytest.param(True, marks=pytest.mark.long)])
def test_banks(fixed, interval):
    """Each bank has its own table, whatever order they are written in, and one may be written again."""
    model = replace(LOBE, banks=5)
    tables = [replace(model, reflection=reflection).table(parameter) for reflection, parameter in CASES[:5]]
    unit = LobeUnit(model, interval, tables=tables if fixed else None)
    write = None
    if not fixed:
        order = [3, 0, 4, 2, 1]
        write = writes_of(tables[0].writes(2), *(tables[bank].writes(bank) for bank in order))
    for bank, table in enumerate(tables):
        beats, expected = beats_of(unit, table, bank)
        check(unit, beats, expected, write=write, constants={"bank": bank})


def test_writes_that_are_lost():
    """Values past a table's end or of no bank change nothing; a table not completed keeps the rest."""
    model = replace(LOBE, banks=3)
    old, new, other = (model.table(exponent) for exponent in (7, 100, 1000))
    beyond = {"value": np.arange(1000) * 131 % 2**17, "begins": np.zeros(1000, dtype=np.int64)}
    no_bank = other.writes()
    unit = LobeUnit(model)
    for bank in (3, 4, 7, 64, 2**16, 2**17 - 1):
        no_bank["value"][0] = bank
        part = {name: column[:50] for name, column in new.writes(1).items()}
        write = writes_of(beyond, *(old.writes(k) for k in range(3)), beyond, no_bank, part, no_bank)
        half = replace(
            old, values=Fixed(old.values.format, np.r_[new.values.codes[:49], old.values.codes[49:]])
        )
        for k in range(3):
            beats, expected = beats_of(unit, half if k == 1 else old, k)
            if k == 1:
                # The last word written leads to the new table's value; that of the old one is behind it.
                entry, _ = model.address(Fixed(LOBE.argument_format, beats["operand"] & (2**25 - 1)))
                keep = entry != 48
                beats = {name: column[keep] for name, column in beats.items()}
                expected = expected[keep]
            check(unit, beats, expected, write=write, constants={"bank": k})


def test_writes_go_on_while_the_unit_stands_still():
    """Beats wait inside while the other bank is written: their terms are of their own bank."""
    model = replace(LOBE, banks=2)
    first, second = model.table(20), replace(model, reflection=GGX).table(0.2)
    unit = LobeUnit(model)
    codes = beats_of(unit, first)[0]["operand"][:40]
    writes = second.writes(1)
    found = []

    async def write(context, table, bank):
        beats = table.writes(bank)
        for value, begins in zip(beats["value"].tolist(), beats["begins"].tolist(), strict=True):
            context.set(unit.write.valid, 1)
            context.set(unit.write.payload, {"value": value, "begins": begins})
            assert context.get(unit.write.ready)
            await context.tick()
            # What is in a gap between two values is no value.
            context.set(unit.write.valid, 0)
            context.set(unit.write.payload, {"value": ~value & 0x1FFFF, "begins": value % 5 == 0})
            for _ in range(value % 3):
                await context.tick()

    async def send(context, codes, ready):
        """Beats, one a cycle while the unit takes them; the terms that come."""
        sent = 0
        for step in range(4 * len(codes)):
            context.set(unit.i.valid, sent < len(codes))
            context.set(Value.cast(unit.i.payload.operand), int(codes[min(sent, len(codes) - 1)]))
            context.set(unit.o.ready, ready)
            if context.get(unit.o.valid) and ready:
                found.append(context.get(Value.cast(unit.o.payload)))
            sent += context.get(unit.i.valid & unit.i.ready)
            await context.tick()
            if not ready and step > 12:
                break
        context.set(unit.i.valid, 0)
        return sent

    async def bench(context):
        context.set(unit.constants.bank, 0)
        await write(context, first, 0)
        sent = await send(context, codes, 0)
        assert 0 < sent < 12
        assert context.get(unit.o.valid)
        await write(context, second, 1)
        await send(context, codes[sent:], 1)
        assert len(found) == len(codes)
        context.set(unit.constants.bank, 1)
        await send(context, codes, 1)

    simulator = Simulator(unit)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert len(writes["value"]) == 338
    lit = np.zeros(len(codes), dtype=bool)
    expected = [
        model.compute(Fixed(LOBE.operand_format, codes), lit, table).codes for table in (first, second)
    ]
    np.testing.assert_array_equal(found, np.concatenate(expected))


class TwoLights(wiring.Component):
    """Two units at one memory; the second's terms wait in a FIFO: it need not stand still with the first."""

    def __init__(self, model, tables, intervals):
        self.memory = LobeMemory(model, tables, 2)
        self.units = [LobeUnit(model, interval, shares_memory=True) for interval in intervals]
        operands = {name: highlight_shape(model) for name in ("first", "second")}
        terms = dict.fromkeys(operands, FixedShape(model.RESULT_FORMAT))
        members = {
            "i": In(stream.Signature(data.StructLayout(operands))),
            "o": Out(stream.Signature(data.StructLayout(terms))),
        }
        if tables is None:
            members["write"] = In(stream.Signature(lobe_write_shape()))
        super().__init__(members)

    def elaborate(self, platform):
        m = Module()
        m.submodules.memory = memory = self.memory
        if memory.tables is None:
            wiring.connect(m, wiring.flipped(self.write), memory.write)
        m.submodules.first, m.submodules.second = first, second = self.units
        for read, unit in zip(memory.reads, self.units, strict=True):
            wiring.connect(m, unit.table, read)
        waiting = second.o.signature.create(path=("waiting",))
        connect_fifo(m, "fifo", second.o, waiting, 20)
        gives = Signal()
        m.d.comb += [
            self.i.ready.eq(first.i.ready & second.i.ready),
            first.i.valid.eq(self.i.valid & second.i.ready),
            second.i.valid.eq(self.i.valid & first.i.ready),
            Value.cast(first.i.payload).eq(Value.cast(self.i.payload.first)),
            Value.cast(second.i.payload).eq(Value.cast(self.i.payload.second)),
            self.o.valid.eq(first.o.valid & waiting.valid),
            gives.eq(self.o.valid & self.o.ready),
            first.o.ready.eq(gives),
            waiting.ready.eq(gives),
            Value.cast(self.o.payload.first).eq(Value.cast(first.o.payload)),
            Value.cast(self.o.payload.second).eq(Value.cast(waiting.payload)),
        ]
        return m


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("fixed", [False, pytest.param(True, marks=pytest.mark.long)])
@pytest.mark.parametrize("intervals", [(3, 1), pytest.param((1, 1), marks=pytest.mark.long)])
def test_two_units_share_a_memory(intervals, fixed):
    table = replace(LOBE, reflection=GGX).table(0.4)
    tables = [table] if fixed else None
    both = TwoLights(LOBE, tables, intervals)
    rng = np.random.default_rng(8)
    beats, expected = {}, {}
    for name, seed in (("first", 1), ("second", 2)):
        beats[name], expected[name] = beats_of(both.units[0], table, seed)
    count = len(expected["first"])
    for share in (0.0, 0.5, 0.9):
        stalls = {"output_stalls": rng.random(1009) < share, "input_stalls": rng.random(997) < 0.2}
        write = None if fixed else table.writes()
        run = simulate(both, beats, count=count, engine="auto", write=write, **stalls)
        for name, terms in expected.items():
            np.testing.assert_array_equal(run.beats[name], terms)
    unit = LobeUnit(LOBE, shares_memory=True)
    assert unit.latency == 10
    assert cost_of(unit).totals["memory_bits"] == 0
    assert cost_of(both.memory).totals["memory_bits"] == 336 * 35


@pytest.mark.parametrize("operand", OPERANDS)
def test_dark_beats_do_not_toggle(operand):
    """Of beats that are dark or behind, only the input's and the first registers change."""
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
    # The first register is of the operand.
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
    # All of them move once there is light.
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
