# amaranth: UnusedElaboratable=no
"""The local chord method: multipliers, latencies, and a pixel in every cycle for spans of any length.

`tests.test_units` compares the unit with its model under stalls.
"""

from functools import cache

import numpy as np
import pytest

from blysk.bench.units.methods.local_chord_interpolator import RECORD
from blysk.golden.methods.local_chord_interpolator import LocalChordInterpolator
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.methods.local_chord_interpolator import LocalChordInterpolatorUnit
from blysk.sim.engines.simulate import simulate

from ...checks import assert_beats_equal


def make(lights=1, **options):
    return LocalChordInterpolatorUnit(LocalChordInterpolator(), lights, **options)


CI = [pytest.mark.long, pytest.mark.ci]


@cache
def unit_of():
    """A unit with one light and the default options. All tests share it, so that it is compiled once."""
    return make()


def case_of(unit, length, seed=1):
    """Spans of these lengths, most of which fit."""
    case = RECORD.stimuli["last bits"].make(unit, np.random.default_rng(seed), len(length))
    case.beats["length"][:] = length
    return case


# Multipliers, latency and cycles.

FIGURES = {
    (1, 1): (6, None),
    (1, 3): (2, 25),
    (1, 6): (2, None),
    (2, 3): (5, None),
}
"""Multipliers and latency, for numbers of lights and setup intervals."""


@pytest.mark.long
@pytest.mark.parametrize(("lights", "interval"), FIGURES)
def test_multipliers_and_latency(lights, interval):
    """All multipliers have 18 bits, and none works for each pixel.

    The first pixel of a long span comes after the latency.
    """
    unit = make(lights, setup_interval=interval)
    multipliers, latency = FIGURES[lights, interval]
    assert unit.multipliers == multipliers
    assert cost_of(unit).multipliers == {(18, 18): multipliers}
    assert latency in (unit.latency, None)
    case = case_of(unit, [3, 1])
    run = simulate(unit, case.beats, count=4, constants=case.constants, engine="auto")
    assert run.cycles[0] == run.input_cycles[0] + unit.latency


def runs_of(lengths):
    """Lengths as the parameter of a test."""
    return [pytest.param(length, id=name) for name, length in lengths.items()]


RNG = np.random.default_rng(7)
LENGTHS = {
    "1": [1] * 90,
    "2": [2] * 90,
    "3": [3] * 90,
    "4": [4] * 90,
    "1 and 3": [1, 3] * 45,
    "3 and 2": [3, 2] * 45,
    "any short": RNG.integers(1, 5, 200).tolist(),
    "any": np.where(RNG.random(200) < 0.9, RNG.integers(1, 7, 200), RNG.integers(1, 40, 200)).tolist(),
    "after a long one": [70, *[1] * 90, 3, 4, 1, 2],
}


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("length", runs_of(LENGTHS))
def test_a_pixel_in_every_cycle(length):
    """Spans of any length are mixed. From the first pixel of a long span on, a pixel comes in every cycle."""
    unit = unit_of()
    # A span of three pixels comes first, and shorter spans wait for it. So no pixel comes before its turn.
    length = np.array([3, *length])
    case = case_of(unit, length)
    run = simulate(unit, case.beats, count=int(length.sum()), constants=case.constants, engine="auto")
    assert_beats_equal(run.beats, RECORD.expect(unit, case))
    np.testing.assert_array_equal(run.cycles, run.cycles[0] + np.arange(length.sum()))
    assert run.cycles[0] == run.input_cycles[0] + unit.latency


@pytest.mark.ci
@pytest.mark.long
@pytest.mark.parametrize("length", [1, 2])
def test_short_spans_come_sooner(length):
    """Short spans come sooner by the cycles of the setup, because they do not pass the setup."""
    unit = unit_of()
    case = case_of(unit, np.full(50, length))
    run = simulate(unit, case.beats, count=50 * length, constants=case.constants, engine="auto")
    np.testing.assert_array_equal(run.cycles, run.cycles[0] + np.arange(50 * length))
    setup = unit._spans
    assert unit.latency - (run.cycles[0] - run.input_cycles[0]) >= setup.latency - setup.short_latency


@pytest.mark.ci
@pytest.mark.long
def test_waiting_output_holds_the_input():
    """While no pixel is taken, spans enter until the unit is full. Afterwards all pixels leave in a row."""
    unit = unit_of()
    length = np.tile([4, 1, 3, 2], 40)
    case = case_of(unit, length)
    stalls = np.zeros(2000, dtype=bool)
    stalls[30:530] = True
    run = simulate(
        unit,
        case.beats,
        count=int(length.sum()),
        constants=case.constants,
        engine="auto",
        output_stalls=stalls,
    )
    assert_beats_equal(run.beats, RECORD.expect(unit, case))
    entered = np.count_nonzero((run.input_cycles >= 200) & (run.input_cycles < 530))
    assert entered == 0
    after = run.cycles[run.cycles >= 530]
    np.testing.assert_array_equal(after, 530 + np.arange(len(after)))
