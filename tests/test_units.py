# amaranth: UnusedElaboratable=no
"""Every unit, by its record: RTL equals the bit-accurate model under stalls, pauses and resets.

The quick run has all stimuli of the default variants and of the default design, compiled, without `SELDOM`
and `SELDOM_STIMULI`. The engine itself compares the first beats with Amaranth's simulator. CI has every
default variant. The long run has all variants, and compares their first beats in the same way.
`tests/simulators` runs the units under stalls in other simulators.
"""

import inspect
from functools import lru_cache

import numpy as np
import pytest

from blysk.bench.units.record import first
from blysk.bench.units.registry import RECORDS
from blysk.hdl.core.pipelined_unit import PipelinedUnit
from blysk.sim.engines import cxxrtl
from blysk.sim.engines.simulate import simulate

from .checks import assert_equals_model, assert_keeps_rate, known, resets
from .decided import digest_of
from .lists import OF_DOCUMENTS

FEW = 24
"""Beats in Amaranth's simulator. Spans are as short as for 200 pixels."""


SELDOM = (
    *OF_DOCUMENTS,
    *("difference_accumulator", "renormaliser", "renormalise_interpolator", "highlight_cosine"),
    *("chord_setup", "local_chord_interpolator", "light_products"),
    *("highlight_gate", "power", "specular", "render", "pixel_pipelines", "framing"),
    *("edge_setup", "edge_normals", "gradient_setup", "plane_setup", "plane_assembler", "span_attributes"),
    *("attribute_serialiser", "vertex_sort", "span_clip", "edge_walk", "vector_normaliser", "span_halver"),
    *("texture_address", "texel_memory", "texture_filter", "texture_sampler"),
    *("serial_vectors", "serial_vertex_sort"),
    *("attribute_spans", "attributes", "albedo"),
    *("vector_adapter", "halfway_vector", "mirror_adapter", "light_adapter", "coarse_depth"),
    *("depth_tester", "depth_lanes"),
    *("motion", "draw_commands", "mesh_memory", "vertex_unit", "triangle_assembly", "tmds_encoder"),
    *("packet_decoder", "uart_receiver", "quotient_lanes"),
)
"""Units that the default design does not have: other methods and models, renderer, buses and boards.

Of geometry the quick run has the whole, and not its parts.
"""

OF_NORMALS = ("pipeline", "renormalise, blinn")
"""This unit gets the stimuli of unit normals, which the default design does not take."""

SELDOM_STIMULI = ("ties", "terminator", "drawn", "dense", "large", "largest")
"""Stimuli that take longest: integers of any size, many spans, many or large triangles."""


CI = [pytest.mark.long, pytest.mark.ci]


def marks_of(name, variant, stimulus, usual):
    seldom = name in SELDOM or stimulus in SELDOM_STIMULI or (name, variant) == OF_NORMALS
    return CI[:1] if not usual else CI if seldom else []


@lru_cache(maxsize=1)
def default_of(name):
    return RECORDS[name].variants[RECORDS[name].default].unit()


@lru_cache(maxsize=1)
def other_of(name, variant):
    return RECORDS[name].variants[variant].unit()


def unit_of(name, variant):
    """A component, which all its stimuli share, so that it is translated once.

    Models of other components are dropped from memory.
    """
    return default_of(name) if variant == RECORDS[name].default else other_of(name, variant)


def _runs():
    for name, record in RECORDS.items():
        for variant, given in record.variants.items():
            stimuli = record.stimuli_of(variant)
            for stimulus, sent in stimuli.items():
                usual = variant == record.default or (name, variant) == OF_NORMALS
                usual = usual and not (given.long or sent.long)
                # The default variant gets every stimulus. Other variants get the first stimulus, and those
                # that name them.
                if variant == record.default or stimulus == next(iter(stimuli)) or variant in sent.variants:
                    yield pytest.param(
                        name,
                        variant,
                        stimulus,
                        marks=marks_of(name, variant, stimulus, usual),
                        id=f"{name}-{variant}-{stimulus}",
                    )


netlist_of = lru_cache(maxsize=2)(cxxrtl.netlist_of)
"""Text of a unit. It is kept beside the text of the component that counts its flags."""


@pytest.fixture(scope="module", autouse=True)
def one_netlist():
    """Let the engine compile the text that has the digest, so that a unit is translated once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cxxrtl, "netlist_of", netlist_of)
        yield


def digest_of_runs(unit, pace, runs):
    """Digest of all that `test_equals_model` checks of a unit."""
    times = [getattr(unit, name, None) for name in ("latency", "initiation_interval", "skid")]
    # If a latency depends on the beat, it is a method. The run does not check it.
    times = [None if callable(time) else time for time in times]
    said = [
        (run.case.beats, run.case.sent, run.expected, run.status, run.stalls, run.settles) for run in runs
    ]
    return digest_of(netlist_of(unit), isinstance(unit, PipelinedUnit), times, pace, said)


@pytest.mark.parametrize(("name", "variant", "stimulus"), list(_runs()))
def test_equals_model(name, variant, stimulus, decided, request):
    """Beats equal the model's under stalls, cycle by cycle if the unit states cycles, and keep their rate
    afterwards.

    Structures that CI leaves out are run again if they, their input or their expected output change.
    """
    unit, free = unit_of(name, variant), None
    pace = RECORDS[name].stimuli[stimulus].pace
    pace = None if pace is None else pace(unit)
    runs = list(RECORDS[name].runs(unit, stimulus))
    digest = None
    if request.node.get_closest_marker("long") and not request.node.get_closest_marker("ci"):
        digest = digest_of_runs(unit, pace, runs)
        if decided.knows(digest):
            return
    for run in runs:
        if run.settles:
            assert_keeps_rate(unit, run, free, pace)
            continue
        found = assert_equals_model(unit, run)
        if not run.stalls:
            free = found
    if digest:
        decided.add(digest)


def few_of(record, variant, unit):
    """Some beats of a variant's first stimulus."""
    make = next(iter(record.stimuli_of(variant).values())).make
    case = make(unit, np.random.default_rng(2026), 200)
    return case.first(FEW)


def _resets():
    """Parts share their resets with the pipeline, and pipelined units with each other.

    CI has the other units.
    """
    for name, record in RECORDS.items():
        if not record.remembers:
            yield pytest.param(name, marks=[] if name in ("chord", "pipeline") else CI)


@pytest.mark.parametrize("name", list(_resets()))
def test_reset_leaves_nothing_behind(name):
    """After a reset with beats inside the unit answers as after power-up, in the same cycles."""
    record = RECORDS[name]
    unit = unit_of(name, record.default)
    case, count = few_of(record, record.default, unit), 6
    if isinstance(unit, PipelinedUnit):
        interval = unit.initiation_interval
        cycles, befores = unit.latency + 6 * interval, (1, 2 * interval + 1, unit.latency + 2)
        expected = [unit.latency + interval * k for k in range(6)]
    else:
        beats = first(case.beats, count)
        run = simulate(known(unit), beats, count=None, engine="auto", idle_timeout=2000, **case.sent)
        cycles = run.total_cycles - int(run.input_cycles[0]) + 5
        befores = 1, cycles // 3, 2 * cycles // 3
        expected = [cycle - run.input_cycles[0] for cycle in run.cycles.tolist()]
    found = resets(unit, case, befores, cycles, count)
    assert [cycle for cycle, _ in found] == expected


@pytest.mark.parametrize("name", RECORDS)
def test_record_is_whole(name):
    """Every stimulus says what it covers, and every measured variant names its domain."""
    record = RECORDS[name]
    assert all(stimulus.covers for stimulus in record.stimuli.values())
    assert name in record.kind.__module__
    assert inspect.getdoc(record.kind)
    for variant in record.variants.values():
        assert variant.measure is None or variant.domain
