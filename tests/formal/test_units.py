# amaranth: UnusedElaboratable=no
"""Proofs about every unit of the records: a beat that waits does not change, beats are not lost, and none is
stuck."""

from functools import partial

import pytest
from amaranth.hdl import Cat, Mux, Signal

import blysk.hdl.core.pipelined_unit
from blysk.bench.units.registry import RECORDS
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.renormalise_interpolator import RenormaliseInterpolator
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.geometry.gradient_setup import GradientSetupUnit
from blysk.hdl.methods.chord_spans import ChordAccumulatorUnit
from blysk.hdl.methods.renormalise_interpolator import LineAccumulatorUnit
from blysk.hdl.normals.dot_product import DotProductUnit

from ..lists import OF_DOCUMENTS
from .prover import Harness
from .rules import answers, stays, taken

pytestmark = pytest.mark.prove

# Of each record the default variant, and other variants whose control differs.
FURTHER = {
    "arccos": ("refitted, sequential",),
    "attributes": ("both, interval 3",),
    "intensity": ("2 lights, compact", "albedo, compact"),
    "light": ("cosquad, interval 3",),
    "light_products": ("cosines, 2 lights, interval 3",),
    "pipeline": ("linear, cosquad", "compact", "gate"),
    "power": ("sequential",),
    "quadratic_evaluator": ("horner",),
    "quotient": ("interval 3",),
    "quotient_lanes": ("N.H, no pairs",),
    "recurrence": ("direct", "reinsch, interleaved"),
    "specular": ("cosquad, interval 3",),
}
UNITS = {
    f"{name}-{variant}" if variant else name: record.variants[variant].unit
    for name, record in RECORDS.items()
    for variant in (record.default, *FURTHER.get(name, ()))
} | {
    "chord_accumulator": partial(ChordAccumulatorUnit, LocalChordInterpolator(), 1),
    "line_accumulator": partial(LineAccumulatorUnit, RenormaliseInterpolator()),
}
KINDS = {name: getattr(make, "func", make) for name, make in UNITS.items()}
SELDOM = ("geometry", "render", "pixel_pipelines", "motion", "serial_vertex_sort")
"""Units whose proofs take minutes. Their parts are proved, and other tests run them."""
SELDOM += OF_DOCUMENTS


def of_units(names):
    """Parameters of tests: names of units. Those of `SELDOM` have their mark."""
    return [pytest.param(name, marks=[pytest.mark.seldom] * name.startswith(SELDOM)) for name in names]


PIPELINED = [
    name for name, kind in KINDS.items() if isinstance(kind, type) and issubclass(kind, PipelinedUnit)
]

SLOW = "specular-" + FURTHER["specular"][0]
"""A unit with an initiation interval of more than 1."""

# The other units have files of their own, which prove that they lose nothing and keep the order.
COUNTED = [
    name
    for name in UNITS
    if name.partition("-")[0]
    in ("attribute_spans", "chord_accumulator", "difference_accumulator", "line_accumulator", "recurrence")
]


@pytest.fixture(autouse=True)
def short_fifos(monkeypatch):
    """Memories of geometry hold 5, 8 or 32 words in place of 512, because each of their bits is a register of
    the proof."""
    monkeypatch.setattr("blysk.hdl.geometry.vertex_sort.WAITING_TRIANGLES", 8)
    monkeypatch.setattr("blysk.hdl.geometry.geometry.BLOCK_WORDS", 5)
    monkeypatch.setattr("blysk.hdl.render.WAITING_SPANS", 5)
    monkeypatch.setattr("blysk.hdl.render.WAITING_WORDS", 32)


def of_waiting(unit):
    """Claim that a valid beat stays.

    A result that stands is safe because beats keep a distance, which the turn tells.
    """
    h = Harness(unit)
    stays(h, unit.o)
    if getattr(unit, "stands", False):
        turn = h.register("turn")
        h.claim(~h.register("ready") | ~turn.any())
        for stage in range(1, unit.latency + 1):
            h.claim(~unit.at(stage) | (turn == stage % unit.initiation_interval))
    return h


# For `SpanHalverUnit` the claim about its whole beat is not decided. Another file proves it for the unit's
# registers. Other files prove the claim for `VertexSortUnit` and `MeshMemoryUnit` with few words.
APART = "span_halver", "vertex_sort", "mesh_memory"


@pytest.mark.parametrize("name", of_units(name for name in UNITS if name.partition("-")[0] not in APART))
def test_beats_that_wait_stay(prove, name):
    """By induction: a valid beat stays, with its payload, until it is accepted."""
    prove(of_waiting(UNITS[name]()))


def of_beats(unit):
    """Claims on beats.

    A model has a stage for each cycle of the latency, and each beat moves through the stages.
    """
    h = Harness(unit)
    m, waits, stages = h.m, Signal(), Signal(unit.latency)
    m.d.sync += waits.eq(unit.o.valid & ~unit.o.ready)
    with m.If(~waits):
        m.d.sync += stages.eq(Cat(taken(unit.i), stages))
    h.claim(unit._stages == stages)
    h.claim(unit.o.valid == (waits | stages[-1]))
    h.claim(~(waits & taken(unit.i)))
    answers(h, unit.i.valid, unit.i.ready, unit.initiation_interval, unit.o.ready)
    return h


@pytest.mark.parametrize("name", of_units(PIPELINED))
def test_beats_of_a_pipelined_unit(prove, name):
    """By induction: each beat leaves ``latency`` cycles after it came, not counting cycles in which it is
    stalled.

    A beat is stalled only in cycles after a beat was not accepted. So no beat is lost or invented, and all
    leave in order. While the output is ready, a beat is accepted within ``initiation_interval`` cycles.
    """
    prove(of_beats(UNITS[name]()))


def of_counts(unit, latency):
    """Claims on the number of pixels, for units that take spans. Spans have at most 3 pixels."""
    h = Harness(unit)
    length = unit.i.payload.length
    h.assume(length <= 3)
    owed = Signal(10)
    h.m.d.sync += owed.eq(owed + Mux(taken(unit.i), length, 0) - taken(unit.o))
    h.claim(~taken(unit.o) | owed.any())
    answers(h, owed.any(), taken(unit.o), latency, unit.o.ready)
    return h


@pytest.mark.parametrize("name", COUNTED)
def test_pixels_of_other_units(prove, name):
    """In 8 cycles more than the latency: only pixels of spans that came leave, and they leave in time.

    While the output is ready and a pixel is due, one leaves within the latency.
    """
    unit = UNITS[name]()
    prove(of_counts(unit, unit.latency), unit.latency + 8)


BUGS = {
    "a beat is lost": ("elaborate", "Cat(accept, self._stages[:-1])", "Cat(accept, self._stages[:-1]) & ~4"),
    "the control moves while it is stalled": ("elaborate", "m.If(advance)", "m.If(1)"),
}


@pytest.mark.parametrize("bug", BUGS)
@pytest.mark.parametrize("name", ["chord", SLOW])
def test_bugs_of_pipelined_units_are_found(refute, inject, name, bug):
    """Each bug, injected in `PipelinedUnit`, refutes a claim on the beats of a unit."""
    inject(PipelinedUnit, *BUGS[bug])
    refute(of_beats(UNITS[name]()))


def test_bug_of_a_skid_buffer_is_found(refute, inject):
    """A payload that is dropped while it waits, injected in `skid_buffer`, is found in a pipelined unit."""
    inject(blysk.hdl.core.pipelined_unit, "skid_buffer", "Mux(held, spare, Value.cast(payload))", "payload")
    harness = Harness(unit := DotProductUnit())
    stays(harness, unit.o)
    refute(harness, 10)


def test_bug_of_a_result_that_goes_is_found(refute, inject):
    """A word that the next beat replaces while the result waits is found."""
    inject(GradientSetupUnit, "datapath", "1 + self.stands", "1")
    refute(of_waiting(GradientSetupUnit()), 50)


def test_bug_of_a_counter_is_found(refute, inject):
    """A pixel too many, injected in the recurrence unit's counter, is found."""
    inject(RecurrenceUnit, "elaborate", "span.length - 1", "span.length")
    refute(of_counts(RecurrenceUnit(), 3), 16)
