# amaranth: UnusedElaboratable=no
"""Proofs about every streaming unit: what is offered stays, beats are as many as came, none is stuck."""

from functools import partial

import pytest
from amaranth.hdl import Cat, Mux, Signal

import blysk.hdl.core.stream
from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.methods.bisection_interpolator import BisectionInterpolator
from blysk.golden.methods.chord_interpolator import ChordInterpolator
from blysk.golden.methods.linear_interpolator import LinearInterpolator
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.methods.recurrence_interpolator import RecurrenceInterpolator
from blysk.golden.normals.quadratic_evaluator import QuadraticEvaluator
from blysk.golden.presets import preset
from blysk.hdl.core.stream import PipelinedUnit
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.arccos import ArccosUnit, HalfChordUnit
from blysk.hdl.cosines.chord import ChordUnit
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.cosines.recurrence import RecurrenceUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.lighting.diffuse import DiffuseUnit
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.intensity import CompactIntensityUnit, IntensityUnit
from blysk.hdl.lighting.light import LightUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.lighting.specular import SpecularUnit
from blysk.hdl.methods.bisection_interpolator import BisectionInterpolatorUnit
from blysk.hdl.methods.chord_interpolator import ChordAccumulatorUnit, ChordInterpolatorUnit
from blysk.hdl.methods.light_products import LightProductsUnit
from blysk.hdl.methods.linear_interpolator import LinearInterpolatorUnit
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.hdl.methods.quadratic_interpolator import QuadraticInterpolatorUnit
from blysk.hdl.methods.recurrence_interpolator import RecurrenceInterpolatorUnit
from blysk.hdl.normals.adaptive_normaliser import AdaptiveNormaliserUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.bisection_chain import BisectionChainUnit
from blysk.hdl.normals.difference_accumulator import DifferenceAccumulatorUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.dot_product import DotProductUnit
from blysk.hdl.normals.gpq import GPQUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.quadratic_evaluator import QuadraticEvaluatorUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit
from blysk.hdl.pipeline import ShadingPipelineUnit

from .prover import Harness
from .rules import answers, stays, taken

pytestmark = pytest.mark.prove

PIPELINED = {
    "angular_setup": partial(AngularSetupUnit, initiation_interval=4),
    "arccos": ArccosUnit,
    "arccos-sequential": partial(ArccosUnit, form="sequential"),
    "half_chord": HalfChordUnit,
    "bisection": BisectionUnit,
    "chord": ChordUnit,
    "chord_setup": ChordSetupUnit,
    "difference_setup": DifferenceSetupUnit,
    "diffuse": DiffuseUnit,
    "dot_product": DotProductUnit,
    "gpq": GPQUnit,
    "highlight_gate": HighlightGateUnit,
    "intensity": IntensityUnit,
    "light_products": partial(LightProductsUnit, initiation_interval=3),
    "local_chord_setup": LocalChordSetupUnit,
    "middle_normal": MiddleNormalUnit,
    "power": PowerUnit,
    "power-sequential": partial(PowerUnit, form="sequential"),
    "recurrence_setup": RecurrenceSetupUnit,
    "renormaliser": RenormaliserUnit,
    "specular": SpecularUnit,
    "specular-3": partial(SpecularUnit, initiation_interval=3),
}

OTHERS = {
    "adaptive_normaliser": AdaptiveNormaliserUnit,
    "bisection_chain": BisectionChainUnit,
    "bisection_interpolator": partial(BisectionInterpolatorUnit, BisectionInterpolator(), 1),
    "chord_accumulator": partial(ChordAccumulatorUnit, 1),
    "chord_interpolator": partial(ChordInterpolatorUnit, ChordInterpolator(), 1),
    "difference_accumulator": DifferenceAccumulatorUnit,
    "highlight_cosine": HighlightCosineUnit,
    "intensity-compact": CompactIntensityUnit,
    "light": LightUnit,
    "light-3": partial(LightUnit, initiation_interval=3),
    "linear": partial(LinearInterpolatorUnit, LinearInterpolator(), 1),
    "local_chord_interpolator": partial(LocalChordInterpolatorUnit, LocalChordInterpolator(), 1),
    "quadratic": partial(QuadraticInterpolatorUnit, QuadraticInterpolator(), 1),
    "quadratic_evaluator": QuadraticEvaluatorUnit,
    "quadratic_evaluator-horner": partial(QuadraticEvaluatorUnit, QuadraticEvaluator("horner")),
    "recurrence": RecurrenceUnit,
    "recurrence-direct": partial(RecurrenceUnit, Recurrence("direct")),
    "recurrence-interleaved": partial(RecurrenceUnit, Recurrence(interleave=4)),
    "recurrence_interpolator": partial(RecurrenceInterpolatorUnit, RecurrenceInterpolator(), 1),
    "renormalise": partial(LinearInterpolatorUnit, LinearInterpolator(renormalised=True), 1),
    "pipeline": ShadingPipelineUnit,
    "pipeline-compact": partial(ShadingPipelineUnit, preset(method="chord"), style="compact"),
    "pipeline-gated": partial(ShadingPipelineUnit, preset(method="chord", gate=True)),
}
UNITS = PIPELINED | OTHERS

# The others are proved, in files of their own, to lose nothing and to keep the order.
COUNTED = [
    "chord_accumulator",
    "difference_accumulator",
    "recurrence",
    "recurrence-direct",
    "recurrence-interleaved",
]


@pytest.mark.parametrize("name", UNITS)
def test_what_waits_stays(prove, name):
    """Inductive: a beat once offered stays, with its payload, until it is taken."""
    unit = UNITS[name]()
    harness = Harness(unit)
    stays(harness, unit.o)
    prove(harness)


def of_beats(unit):
    """A model has a place for every clock of the latency, in which each beat that comes moves on."""
    h = Harness(unit)
    m, waits, places = h.m, Signal(), Signal(unit.latency)
    m.d.sync += waits.eq(unit.o.valid & ~unit.o.ready)
    with m.If(~waits):
        m.d.sync += places.eq(Cat(taken(unit.i), places))
    h.claim(unit._stages == places)
    h.claim(unit.o.valid == (waits | places[-1]))
    h.claim(~(waits & taken(unit.i)))
    answers(h, unit.i.valid, unit.i.ready, unit.initiation_interval, unit.o.ready)
    return h


@pytest.mark.parametrize("name", PIPELINED)
def test_beats_of_a_pipelined_unit(prove, name):
    """Inductive: each beat that comes leaves ``latency`` cycles after, not counting those on which it stands.

    It stands on those alone that follow one on which a beat was not taken. So none is lost or invented, and
    all leave in order. While the output is ready, one is taken in ``initiation_interval`` cycles.
    """
    prove(of_beats(PIPELINED[name]()))


def of_counts(unit, latency):
    """Pixels are counted where spans come, of 3 at most."""
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
    """In 8 cycles more than the latency: what leaves has come; as long as a pixel is to come and the output
    is ready, one leaves in as many cycles as the latency."""
    unit = OTHERS[name]()
    prove(of_counts(unit, unit.latency), unit.latency + 8)


BUGS = {
    "an age is lost": ("elaborate", "Cat(accept, self._ages[:-1])", "Cat(accept, self._ages[:-1]) & ~4"),
    "the control moves while it stands": ("elaborate", "m.If(advance)", "m.If(1)"),
}


@pytest.mark.parametrize("bug", BUGS)
@pytest.mark.parametrize("name", ["chord", "specular-3"])
def test_bugs_of_pipelined_units_are_found(refute, plant, name, bug):
    """Planted in `PipelinedUnit`, each refutes the claims on the beats of a unit."""
    plant(PipelinedUnit, *BUGS[bug])
    refute(of_beats(PIPELINED[name]()))


def test_bug_of_an_offered_output_is_found(refute, plant):
    """A payload that is dropped while it waits, planted in `offer`: of a pipelined unit."""
    plant(blysk.hdl.core.stream, "offer", "Mux(held, spare, Value.cast(payload))", "payload")
    harness = Harness(unit := DotProductUnit())
    stays(harness, unit.o)
    refute(harness, 10)


def test_bug_of_a_counter_is_found(refute, plant):
    """A pixel too many, planted in the recurrence unit's counter."""
    plant(RecurrenceUnit, "elaborate", "span.length - 1", "span.length")
    refute(of_counts(RecurrenceUnit(), 3), 16)
