# amaranth: UnusedElaboratable=no
"""Proofs of the lobe unit: SAT proves argument, address, sum and writes; exhaustion proves that its term
never rises."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from amaranth.hdl import Cat, Const, Mux, Signal, Value
from amaranth.hdl._ast import Switch

import blysk.hdl.lighting.lobe
from blysk.golden.lighting.lobe import Lobe
from blysk.golden.number.unit_vector import ONE_SQUARED
from blysk.golden.reference.lobes import BECKMANN, COPLANAR_PHONG, GGX
from blysk.golden.reference.reflection import BLINN
from blysk.hdl.lighting.lobe import LobeMemory, LobeUnit
from blysk.sim.engines.simulate import simulate

from .prover import Harness
from .rules import stays
from .test_units import of_beats

pytestmark = pytest.mark.prove

OPERANDS = ("cosine", "one_minus_cosine")
CHORD = "one_minus_cosine"
SIZES = ((20, 16, 25), (15, 32, 25), (3, 256, 25), (1, 2, 20), (30, 16, 34))
LOBE = Lobe(operand=CHORD)
SMALL = replace(LOBE, octaves=1, steps=2, banks=2)


def registers_of(harness):
    """Registers of the unit's data path, by name."""

    def targets(statements):
        for statement in statements:
            if isinstance(statement, Switch):
                for _, inner, _ in statement.cases:
                    yield from targets(inner)
            else:
                yield from statement.lhs._lhs_signals()

    (path,) = (inner for inner, name, _ in harness._fragment.subfragments if name == "datapath")
    return {signal.name: signal for part in path.statements.values() for signal in targets(part)}


class OfUnit:
    """A harness of a unit with an outside memory, which gives values of earlier enabled cycles."""

    def __init__(self, model):
        self.unit = LobeUnit(model, shares_memory=True)
        self.harness = Harness(self.unit)
        self.m, self.words = self.harness.m, registers_of(self.harness)
        self.moves = self.unit.advance
        self.age = Signal(4, name="age")
        with self.m.If(self.moves):
            self.m.d.sync += self.age.eq(Mux(self.age == 15, 15, self.age + 1))

    def before(self, value, cycles=1):
        """The value of some enabled cycles ago. It has a meaning only from this age on."""
        value = Value.cast(value)
        for _ in range(cycles):
            past = Signal(value.shape(), name="past", reset_less=True)
            with self.m.If(self.moves):
                self.m.d.sync += past.eq(value)
            value = past
        return value

    def claim(self, condition, cycles):
        """Claim a condition from this age on."""
        self.harness.claim((self.age < cycles) | condition)


def of_argument(model):
    """Claim that the argument is 1 - N·H two cycles later, cut and at least 0; 0 for a beat that is dark or
    not in front."""
    h = OfUnit(model)
    bits, beat = model.fraction_bits, h.unit.i.payload
    operand = Value.cast(beat.operand)
    behind, exact = operand >= 1 << bits, operand
    if model.operand == "cosine":
        behind, exact = operand <= 0, (ONE_SQUARED.codes.item() - operand) >> 34 - bits
    lit = h.before(~(behind | beat.dark))
    h.claim(h.words["lit"] == lit, 1)
    limited = Mux(exact < 0, 0, exact)
    h.claim(h.words["argument"] == Mux(h.before(lit), h.before(limited, 2), 0), 2)
    return h.harness


def of_address(model):
    """Claim that three cycles later the memory is asked for the word of the argument's octave and step.

    The rest is f.

    Row r, from 1 on, has the arguments from ``2^(r-1-E)`` to twice this number.
    """
    p, h = model, OfUnit(model)
    bits, width = p.fraction_bits, p.fraction_bits - 1 - p.step_bits
    argument = h.before(h.words["argument"], 3)
    bank = Const(0)
    if p.banks > 1:
        bank = h.unit.constants.bank
        stood = Signal.like(bank, name="stood")
        first = Signal(init=1, name="first")
        h.m.d.sync += [stood.eq(bank), first.eq(0)]
        h.harness.assume((bank < p.banks) & (first | (bank == stood)))
    for row in range(p.rows):
        # The first bit of the step's address is one bit below the start of the octave.
        top = bits - 1 - p.octaves + max(row, 1)
        inside = argument[top:] == (1 if row else 0)
        step, rest = argument[top - p.step_bits : top], argument[: top - p.step_bits]
        address = Signal(range(p.banks * p.entries), name=f"address_{row}")
        for index in range(p.banks):
            with h.m.If(bank == index):
                h.m.d.comb += address.eq((index * p.rows + row << p.step_bits) + step)
        fraction = (rest << width - len(rest))[width - p.fraction_format.width : width]
        right = (h.unit.table.address == address) & (h.words["memory_0_1"] == fraction)
        h.claim(~inside | right, 5)
    return h.harness


def of_term(model):
    """Claim for any word with entries in range that the term is the exact sum, and does not wrap.

    The word in the unit's registers is claimed to be the word of the table. Two facts are assumed: the entry
    and the next entry are in range, and the cut product has an f of 0 or more and under 1.
    """
    h = OfUnit(model)
    word, kept = h.before(h.unit.table.word), h.words["value_9"]
    h.harness.claim(kept == h.before(word[:17]))
    step = h.before(word[17:]).as_signed()
    h.harness.assume((kept + step >= 0) & (kept + step < 1 << 17))
    product = h.words["product"].as_signed()
    least, most = Mux(step > 0, 0, step << 17), Mux(step > 0, step << 17, 0)
    h.harness.assume((product >= least) & (product <= most))
    way = product >> 17
    h.harness.claim((way >= Mux(step > 0, 0, step)) & (way <= Mux(step > 0, step, 0)))
    exact = kept + way
    h.harness.claim((exact >= 0) & (exact < 1 << 17))
    h.harness.claim(h.words["term"] == h.before(Mux(h.words["lit_9"], exact[:17], 0)))
    return h.harness


def written(h):
    """Whether there was a write in the cycle before, its value, and whether it began a bank."""
    offered = h.unit.write
    write, value, begins = (
        Signal(bits, name=name) for bits, name in ((1, "write"), (17, "came"), (1, "new"))
    )
    h.m.d.sync += [
        write.eq(offered.valid & offered.ready),
        value.eq(offered.payload.value),
        begins.eq(offered.payload.begins),
    ]
    h.claim(h.register("follows") == (write & ~begins))
    h.claim(h.register("begins") == (write & begins))
    h.claim(~write | (h.register("value") == value))
    return write, value, begins


def of_banks(model):
    """Claim that a written word belongs to the bank whose table began last."""
    p, unit = model, LobeMemory(model)
    h = Harness(unit)
    bank, (write, value, begins) = Signal(17, name="bank"), written(h)
    with h.m.If(write & begins):
        h.m.d.sync += bank.eq(value)
    address, last = h.register("address"), h.register("last")
    within = Const(0)
    for index in range(p.banks):
        of_bank = (address >= index * p.entries) & (address <= last)
        within = within | ((bank == index) & of_bank & (last == (index + 1) * p.entries - 1))
    h.claim(~h.register("active") | within)
    h.claim(unit.write.ready)
    return h


def of_memory(model):
    """Claim on a word that is chosen freely.

    After its values were written it is made from them, and no other write changes it.
    """
    p, unit = model, LobeMemory(model)
    h = Harness(unit)
    m = h.m
    bank, entry = h.free(range(p.banks), "bank"), h.free(range(p.entries), "entry")
    chosen = Signal(init=0, name="chosen")
    own_bank, own_entry = Signal.like(bank, name="own_bank"), Signal.like(entry, name="own_entry")
    m.d.sync += chosen.eq(1)
    with m.If(~chosen):
        m.d.sync += [own_bank.eq(bank), own_entry.eq(entry)]
    h.assume((bank < p.banks) & (entry < p.entries))
    address = Signal(range(p.banks * p.entries), name="own_address")
    for index in range(p.banks):
        with m.If(own_bank == index):
            m.d.comb += address.eq(index * p.entries + own_entry)
    write, value, begins = written(h)
    to, count, previous = Signal(17, name="to"), Signal(range(p.entries + 2)), Signal(17, name="before")
    word, known, begun = Signal(35, name="own_word"), Signal(name="known"), Signal(name="begun")
    with m.If(write & begins):
        m.d.sync += [to.eq(value), count.eq(0), begun.eq(1)]
    with m.Elif(write):
        m.d.sync += [previous.eq(value), count.eq(Mux(count > p.entries, count, count + 1))]
        # Only a table that has begun is known. At power-up no table has begun.
        with m.If((to == own_bank) & (count == own_entry + 1) & begun & chosen):
            difference = (value - previous)[:18]
            m.d.sync += [word.eq(Cat(previous, difference)), known.eq(1)]
    # Two cycles with enable, without a write of a word in either.
    asked, answer = Signal(2, name="asked"), Signal(35, name="answer")
    read, wrote = unit.reads[0], Signal(name="wrote")
    moves = read.enable & ~write & ~wrote
    m.d.sync += [
        wrote.eq(write),
        asked.eq(Cat(moves & (read.address == address) & known, asked[0] & moves)),
        answer.eq(Mux(asked[0], answer, word)),
    ]
    h.claim(~asked[1] | (read.word == answer))
    return h


@pytest.mark.parametrize("interval", [1, 3])
def test_beats(prove, interval):
    """By induction: a beat that waits does not change, there is room for a beat a cycle, and no beat is
    stuck."""
    make = partial(LobeUnit, Lobe(), interval, shares_memory=True)
    unit = make()
    harness = Harness(unit)
    stays(harness, unit.o)
    # An answer of the memory stays while the memory does not read.
    kept, reads = Signal.like(unit.table.word, name="kept"), Signal(name="reads", init=1)
    harness.m.d.sync += [kept.eq(unit.table.word), reads.eq(unit.table.enable)]
    harness.assume(reads | (unit.table.word == kept))
    prove(harness)
    prove(of_beats(make()))


@pytest.mark.parametrize("operand", OPERANDS)
@pytest.mark.parametrize("fraction_bits", [25, 34])
def test_argument(prove, fraction_bits, operand):
    """By induction, for every operand: no word wraps, and a beat that is not in front is dark."""
    prove(of_argument(Lobe(operand=operand, fraction_bits=fraction_bits)))


@pytest.mark.parametrize("banks", [1, 3])
@pytest.mark.parametrize(("octaves", "steps", "fraction_bits"), SIZES)
def test_address(prove, octaves, steps, fraction_bits, banks):
    """By induction, for every argument: word and fraction are those of the definition, in the right bank."""
    prove(of_address(Lobe(BLINN, CHORD, octaves, steps, banks, fraction_bits)))


def test_term(prove):
    """By induction, for every word: the sum does not wrap, and no term passes the next entry."""
    prove(of_term(Lobe(operand=CHORD)))


@pytest.mark.parametrize("banks", [1, 3, 4])
def test_writes_stay_in_their_bank(prove, banks):
    """By induction, for every sequence of writes."""
    prove(of_banks(replace(LOBE, banks=banks)))


def test_loaded_words(prove):
    """By induction, for every sequence of writes: each word follows from the last values written to it."""
    prove(of_memory(SMALL))


@pytest.mark.parametrize("operand", OPERANDS)
@pytest.mark.parametrize(
    ("model", "parameter"),
    [*((BLINN, n) for n in (1, 2, 37, 1000)), (BECKMANN, 0.3), (GGX, 0.05), (GGX, 1), (COPLANAR_PHONG, 30)],
)
def test_term_never_rises(model, parameter, operand):
    """Arguments: both ends of every word, a thousand fractions of every tenth word, and some past the end,
    where the term is 0."""
    p = Lobe(model, operand)
    table = p.table(parameter)
    unit = LobeUnit(p, tables=[table])
    start, end = (np.ldexp(knots, 25).astype(np.int64) for knots in (p.knots[:-1], p.knots[1:]))
    dense = [
        np.linspace(a, b - 1, 1000).astype(np.int64) for a, b in zip(start[::10], end[::10], strict=True)
    ]
    arguments = np.unique(np.concatenate([start, end - 1, *dense]))
    if operand == "cosine":
        codes = ONE_SQUARED.codes - 512 * arguments[:, np.newaxis] - [0, 511]
        codes = np.r_[p.operand_format.max_code, codes.ravel(), 0, -1, p.operand_format.min_code]
        behind = codes <= 0
    else:
        codes = np.r_[arguments, 1 << 25, p.operand_format.max_code]
        behind = codes >= 1 << 25
    terms = simulate(unit, {"operand": codes, "dark": np.zeros_like(codes)}, count=len(codes)).beats.astype(
        int
    )
    assert (np.diff(terms) <= 0).all(), "a term rises"
    assert not terms[behind].any(), "a term goes on"
    assert terms[0] == table.values.codes[0], "no peak"
    entry = np.isin(codes, start) if operand == CHORD else np.zeros(len(codes), dtype=bool)
    np.testing.assert_array_equal(terms[entry], table.values.codes[:-1][: entry.sum()])


BUGS = {
    "1 is not that of unit vectors": (
        of_argument,
        blysk.hdl.lighting.lobe,
        "one_minus",
        "ONE_SQUARED.values.item()",
        "1",
    ),
    "a negative argument wraps": (
        of_argument,
        LobeUnit,
        "_addressed",
        "wide.saturate(p.argument_format)",
        "wide",
    ),
    "a dark beat is lit": (of_argument, LobeUnit, "_describe", "(dark | code[-1]", "(code[-1]"),
    "a right angle is lit": (of_argument, LobeUnit, "_describe", "~code.any()", "0"),
    "what is behind is lit": (of_argument, LobeUnit, "_describe", "code[-1] | (", "("),
    "row 0 has the steps of row 2": (
        of_address,
        LobeUnit,
        "_addressed",
        "Mux(zeros == p.octaves, p.octaves - 1, zeros)",
        "zeros",
    ),
    "the steps are one bit low": (
        of_address,
        LobeUnit,
        "_addressed",
        "normal[top - p.step_bits :]",
        "normal[top - p.step_bits - 1 : top - 1]",
    ),
    "the fraction is one bit low": (
        of_address,
        LobeUnit,
        "_addressed",
        "rest[len(rest) - p.fraction_format.width :]",
        "rest[len(rest) - p.fraction_format.width - 1 : len(rest) - 1]",
    ),
    "a leading one is missed": (
        of_address,
        blysk.hdl.lighting.lobe,
        "leading_zeros",
        "high.any()",
        "high[1:].any()",
    ),
    "every bank is the first": (of_address, LobeUnit, "datapath", "bank * p.rows", "0"),
    "the product is rounded up": (
        of_term,
        LobeUnit,
        "_interpolate",
        "product.truncate(17)",
        "product.round_half_up(17)",
    ),
    "a dark term shows": (
        of_term,
        LobeUnit,
        "_interpolate",
        "Mux(lit, Value.cast(total), 0)",
        "Value.cast(total)",
    ),
    "a table goes on into the next bank": (
        of_banks,
        LobeMemory,
        "_write",
        "active & (address != last)",
        "active",
    ),
    "any bank is the first": (
        of_banks,
        LobeMemory,
        "_write",
        "m.Case(bank)",
        "m.Case(bank, bank + p.banks)",
    ),
    "a table begins with the one before": (of_memory, LobeMemory, "_write", "holds.eq(0), ", ""),
    "values come while none do": (
        of_memory,
        LobeMemory,
        "_write",
        "self.write.valid & ~write.begins",
        "~write.begins",
    ),
    "the difference is the other way": (
        of_memory,
        LobeMemory,
        "_write",
        "(value - previous)",
        "(previous - value)",
    ),
}


@pytest.mark.parametrize("bug", BUGS)
def test_bugs_are_found(refute, inject, bug):
    """Each bug, injected in the unit, refutes a claim."""
    claim, *change = BUGS[bug]
    inject(*change)
    model = Lobe(operand="cosine", banks=3, octaves=6, steps=4)
    refute(claim(SMALL if claim in (of_banks, of_memory) else model), 20)
