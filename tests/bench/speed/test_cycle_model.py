"""The cycle model: its recurrence against a loop, and its frames against simulation."""

import numpy as np
import pytest

from blysk.bench.accuracy import model_of
from blysk.bench.speed.cycle_model import (
    WAITING,
    beat_cycles,
    compare,
    frame_cycles,
    span_cycles,
    steady_cycles,
    unit_of,
)
from blysk.bench.units.cosines.quotient_lanes import vectors_with_pairs
from blysk.bench.units.cosines.quotient_spans import line_directions, vector_case
from blysk.golden.beats import Spans
from blysk.golden.cosines.quotient_lanes import QuotientLanes
from blysk.golden.presets import preset
from blysk.hdl.cosines.quotient_lanes import QuotientLanesUnit
from blysk.sim.engines.simulate import simulate


def looped(length, interval, waiting):
    """The recurrence, span by span."""
    starts, ready, end = [], None, 0
    for k, (own, least) in enumerate(zip(length, interval, strict=True)):
        free = starts[k - 2] + waiting if k >= 2 else 0
        ready = 0 if ready is None else max(ready + least, free)
        starts.append(max(end, ready))
        end = starts[-1] + own
    return end


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 300])
@pytest.mark.parametrize("waiting", [0, WAITING])
def test_recurrence(count, waiting):
    rng = np.random.default_rng(count)
    length, interval = rng.integers(1, 12, count), rng.integers(1, 7, count)
    assert span_cycles(length, interval, waiting) == looped(length.tolist(), interval.tolist(), waiting)


def test_a_pixel_in_each_cycle_whatever_the_length():
    """`quotient` loses cycles only before a frame's second span. `renormalise` waits for short spans."""
    rng = np.random.default_rng(50)
    units = [unit_of(preset(method, "blinn")) for method in ("quotient", "renormalise")]
    for longest in (1, 2, 3, 4, 40):
        for _ in range(20):
            length = rng.integers(1, longest + 1, rng.integers(2, 200))
            place, ends = np.zeros_like(length), np.zeros((len(length), 3), dtype=np.int64)
            spans = Spans(place, place, length, ends, ends)
            own, other = (steady_cycles(unit, spans) for unit in units)
            assert own == length.sum()
            assert other > own or longest > 2
            filling = frame_cycles(units[0], spans, 0) - units[0].latency - 1 - own
            assert 0 <= filling <= 2


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "share"),
    [("linear", 0), ("renormalise", 0), ("quadratic", 0), ("chord-local", 0.03), ("quotient", 0)],
)
def test_frames(method, share):
    simulated, modelled = compare(preset(method, model_of(method)), 400, (64, 48))
    assert abs(modelled - simulated) <= share * simulated


@pytest.mark.long
@pytest.mark.parametrize("lanes", [2, 4])
@pytest.mark.parametrize("triangles", [400, 20_000])
def test_frames_of_several_lanes(triangles, lanes):
    """The recurrence of several lanes, for long and for short spans."""
    simulated, modelled = compare(preset().built(lanes=lanes), triangles, (160, 120))
    assert abs(modelled - simulated) <= 0.002 * simulated


@pytest.mark.long
def test_spans_without_pairs():
    """Short spans of geometry, at the pace of the setup and at that of the beats."""
    rng, unit = np.random.default_rng(4), QuotientLanesUnit(QuotientLanes(pairs=False))
    for longest in (2, 3, 9):
        length = rng.integers(1, longest + 1, 1000)
        vectors = vectors_with_pairs(rng, unit.model, length)
        case = vector_case(unit, vectors, length, line_directions(rng, 1))
        count = int((-(-length // 2)).sum())
        run = simulate(unit, case.beats, count=count, engine="auto", **case.sent)
        cycles = int(run.cycles[-1] - run.cycles[0]) + 1
        assert abs(beat_cycles(length, 2, pairs=False) - cycles) <= 2
