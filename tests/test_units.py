# amaranth: UnusedElaboratable=no
"""Every unit, by its record: RTL equal to the bit-accurate model under stalls, pauses and resets."""

import inspect

import pytest

from blysk.hdl.core.stream import PipelinedUnit
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.record import Case, first
from blysk.sim.units.registry import RECORDS

from .checks import assert_equals_model, resets


def _runs():
    for name, record in RECORDS.items():
        for variant, given in record.variants.items():
            for stimulus, sent in record.stimuli_of(variant).items():
                marks = [pytest.mark.long] if given.long or sent.long else []
                # The default variant gets every stimulus, the others the first and those that name them.
                is_first = stimulus == next(iter(record.stimuli_of(variant)))
                if not (variant == record.default or is_first or variant in sent.variants):
                    continue
                yield pytest.param(name, variant, stimulus, marks=marks, id=f"{name}-{variant}-{stimulus}")


@pytest.mark.parametrize(("name", "variant", "stimulus"), list(_runs()))
def test_equals_model(name, variant, stimulus):
    """Beat by beat, and where the unit states them cycle by cycle, under every pattern of stalls."""
    record = RECORDS[name]
    unit = record.variants[variant].unit()
    for run in record.runs(unit, stimulus):
        assert_equals_model(unit, run)


def first_case(record, unit, count):
    """The first beats of a unit's first stimulus."""
    stimulus = next(iter(record.stimuli_of(record.default)))
    run = next(record.runs(unit, stimulus))
    return Case(first(run.case.beats, count), run.case.constants, run.case.write)


@pytest.mark.parametrize("name", RECORDS)
def test_reset_leaves_nothing_behind(name):
    """Reset with beats inside: the unit then answers as from power-up, on the same cycles."""
    record = RECORDS[name]
    unit = record.variants[record.default].unit()
    case, count = first_case(record, unit, 24), 12
    if isinstance(unit, PipelinedUnit):
        interval, count = unit.initiation_interval, 6
        cycles, befores = unit.latency + 6 * interval, (1, 2 * interval + 1, unit.latency + 2)
        expected = [unit.latency + interval * k for k in range(6)]
    else:
        beats = first(case.beats, count)
        run = simulate(
            unit,
            beats,
            count=None,
            constants=case.constants,
            write=case.write,
            engine="auto",
            idle_timeout=2000,
        )
        cycles = run.total_cycles - int(run.input_cycles[0]) + 5
        befores = 1, cycles // 4, cycles // 2, 3 * cycles // 4
        expected = [cycle - run.input_cycles[0] for cycle in run.cycles.tolist()]
    found, *others = resets(unit, case, befores, cycles, count)
    assert [cycle for cycle, _ in found] == expected
    assert all(other == found for other in others)


@pytest.mark.parametrize("name", RECORDS)
def test_record_is_whole(name):
    """Every stimulus says what it covers, every measured variant over which domain."""
    record = RECORDS[name]
    assert all(stimulus.covers for stimulus in record.stimuli.values())
    assert record.kind.__module__.rsplit(".", 1)[1] == name or name in record.kind.__module__
    assert inspect.getdoc(record.kind)
    for variant in record.variants.values():
        assert variant.measure is None or variant.domain
