# amaranth: UnusedElaboratable=no
"""Times and parts of units at every interval, as their docstrings state them; defaults, and refusals.

`tests.test_units` compares the units with their models. Parts of their usual structures are baselines.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import pytest

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.quotient import Quotient
from blysk.golden.cosines.quotient_spans import QuotientSpans
from blysk.golden.methods.quadratic_interpolator import QuadraticInterpolator
from blysk.golden.normals.bisection import Bisection
from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.presets import preset
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.arccos import ArccosUnit
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.cosines.half_chord import HalfChordUnit
from blysk.hdl.cosines.quotient import QuotientUnit
from blysk.hdl.cosines.quotient_spans import QuotientSpansUnit
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.lighting.highlight_gate import HighlightGateUnit
from blysk.hdl.lighting.power import PowerUnit
from blysk.hdl.normals.bisection import BisectionUnit
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.hdl.normals.line_setup import LineSetupUnit
from blysk.hdl.normals.middle_normal import MiddleNormalUnit
from blysk.hdl.normals.renormaliser import RenormaliserUnit


class Stated(NamedTuple):
    """Statements of a unit's docstring: its default interval and its largest interval, ``None`` if there is
    none.

    ``multipliers`` and ``latencies`` are for the intervals 1, 2, ...; ``rom_bits`` is for its tables.
    """

    make: Callable
    default: int
    largest: int | None
    multipliers: list[int]
    latencies: list[int] | None = None
    rom_bits: int | None = None


GATE = QuadraticInterpolator().gate(preset("quadratic", "cosquad").specular)
TO_45, LINE_TO_45, PUBLISHED = Bisection(2, 45), Bisection(1, 45), DifferenceSetup(as_published=True)
STATED = {
    "angular setup, half chord": Stated(
        partial(AngularSetupUnit, AngularSetup("half_chord")),
        *(6, 26, [26, 13, 9, 7, 6, 5], [53, 54, 55, 58, 58, 59]),
    ),
    "angular setup, arccos": Stated(
        partial(AngularSetupUnit, AngularSetup("arccos")),
        *(6, 21, [23, 13, 9, 8, 7, 6], [53, 54, 56, 59, 59, 58]),
    ),
    "half chord": Stated(HalfChordUnit, 6, 6, [6, 3, 2, 2, 2, 1], [25, 28, 26, 27, 26, 32]),
    "middle normal": Stated(
        *(MiddleNormalUnit, 6, 9, [9, 5, 3, 3, 2, 2, 2, 2, 1], [26, 28, 29, 28, 30, 34, 30, 28, 39])
    ),
    "bisection": Stated(
        *(BisectionUnit, 6, 9, [9, 5, 3, 3, 2, 2, 2, 2, 1], [23, 25, 26, 24, 29, 27, 25, 25, 38])
    ),
    "bisection to 45 degrees": Stated(
        partial(BisectionUnit, TO_45), 5, 8, [8, 4, 3, 2, 2, 2, 2, 1], [20, 22, 23, 25, 24, 23, 23, 29]
    ),
    "bisection to 45 degrees by a line": Stated(
        partial(BisectionUnit, LINE_TO_45), 4, 7, [7, 4, 3, 2, 2, 2, 1], [17, 19, 20, 21, 19, 20, 25]
    ),
    "difference setup": Stated(
        DifferenceSetupUnit, 7, 7, [7, 4, 3, 2, 2, 2, 1], [17, 18, 18, 20, 21, 21, 24], 2048 * 17
    ),
    "difference setup as published": Stated(
        partial(DifferenceSetupUnit, PUBLISHED),
        *(9, 9, [9, 5, 3, 3, 2, 2, 2, 2, 1], [20, 21, 23, 22, 25, 23, 22, 22, 29], 2048 * 17),
    ),
    "difference setup of lines": Stated(
        partial(DifferenceSetupUnit, order=1), 3, 7, [3, 2, *[1] * 5], [11, 13, *[14] * 5], 2048 * 17
    ),
    "line setup": Stated(LineSetupUnit, 4, None, [9, 5, 3, 3, 2, 2, 2, 2, 1], None, 2048 * 24),
    "highlight gate": Stated(
        *(partial(HighlightGateUnit, GATE), 6, 15, [15, 8, 5, 4, 3, 3, 3, *[2] * 7, 1]),
        [19, 23, 23, 24, 20, 21, 23, 28, 30, 31, 27, 24, 25, 25, 47],
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("name", STATED)
def test_times_and_parts(name):
    """Times are checked at every interval, parts at the first, the default and the last.

    No multiplier has more than 18 bits.
    """
    stated = STATED[name]
    intervals = range(1, len(stated.multipliers) + 1)
    units = [stated.make(initiation_interval=interval) for interval in intervals]
    assert [unit.initiation_interval for unit in units] == list(intervals)
    assert stated.latencies in (None, [unit.latency for unit in units])
    for interval in {1, stated.default, len(units)}:
        cost = cost_of(units[interval - 1])
        assert cost.multiplier_count == stated.multipliers[interval - 1]
        assert all(max(pair) <= 18 for pair in cost.multipliers)
        assert stated.rom_bits in (None, cost.rom_bits)


@pytest.mark.parametrize("name", STATED)
def test_intervals(name):
    """The default, and values that are no interval."""
    make, default, largest, *_ = STATED[name]
    assert make().initiation_interval == default
    message, none = "interval must be at least 1", [0, -1]
    if largest is not None:
        message, none = f"initiation_interval must be 1 to {largest}", [*none, 1.5, 2.5, largest + 1]
    for interval in none:
        with pytest.raises(ValueError, match=f"^{message}, not {interval}$"):
            make(initiation_interval=interval)


OF_LIGHTS = {
    # There may be more multipliers than products divided by the interval. Beats may come at any distance, and
    # a multiplier serves only products less than an interval apart.
    ChordSetupUnit: {
        **{(1, 1): (6, 18), (1, 2): (3, 21), (1, 3): (2, 21), (1, 4): (2, 20), (1, 6): (2, 20)},
        **{(1, 9): (1, 21), (1, 18): (1, 21), (2, 3): (5, 21), (2, 9): (2, 24), (3, 18): (1, 31)},
    },
    RecurrenceSetupUnit: {
        **{(1, 1): (46, 112, 18), (1, 2): (23, 121, 9), (1, 4): (12, 126, 5)},
        **{(1, 8): (6, 138, 3), (1, 46): (1, 225, 1), (2, 4): (20, 130, 9)},
    },
}
"""Multipliers and latency, and shifters if there are any, for numbers of lights and intervals."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("make", "lights", "interval"), [(make, *key) for make, stated in OF_LIGHTS.items() for key in stated]
)
def test_times_and_parts_of_lights(make, lights, interval):
    """All multipliers have 18 bits, and no product is by a constant."""
    unit = make(None, lights, initiation_interval=interval)
    multipliers, latency, *shifters = OF_LIGHTS[make][lights, interval]
    cost = cost_of(unit)
    assert (unit.multipliers, unit.latency) == (multipliers, latency)
    assert not shifters or [unit.shifters] == shifters
    assert (cost.multipliers, cost.constant_multipliers) == ({(18, 18): multipliers}, 0)


@pytest.mark.parametrize("make", [ChordSetupUnit, RecurrenceSetupUnit])
@pytest.mark.parametrize("interval", [0, -1])
def test_intervals_of_units_of_lights(make, interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        make(initiation_interval=interval)


@pytest.mark.parametrize("bits", [1, 13])
@pytest.mark.parametrize("make", [ChordSetupUnit, DifferenceSetupUnit, LineSetupUnit])
def test_lengths_that_no_table_is_made_for(make, bits):
    with pytest.raises(ValueError, match=rf"^length_bits must be 2 to 12, not {bits}$"):
        make(length_bits=bits)


@pytest.mark.parametrize(("make", "form"), [(ArccosUnit, "fast"), (PowerUnit, "drawn")])
def test_unknown_form(make, form):
    with pytest.raises(ValueError, match=rf"^form must be 'pipelined' or 'sequential', not '{form}'$"):
        make(form=form)


@pytest.mark.long
def test_times_and_parts_of_the_renormaliser():
    unit = RenormaliserUnit()
    cost = cost_of(unit)
    assert (unit.latency, unit.initiation_interval) == (25, 1)
    assert (cost.multiplier_count, cost.constant_multipliers, cost.rom_bits) == (8, 0, 64 * 48)
    assert all(max(pair) <= 18 for pair in cost.multipliers)


QUOTIENTS = {
    (1, True): ([4, 2, 2, 1, 1], [16, 22, 21, 24, 25]),
    (2, True): ([6, 3, 2, 2, 2], [16, 22, 22, 23, 21]),
    (1, False): ([2], [10]),
}
"""Multipliers and latencies at intervals 1, 2, ... for numbers of lights, with and without highlights."""


@pytest.mark.long
@pytest.mark.parametrize(("lights", "highlights"), QUOTIENTS)
def test_times_and_parts_of_quotients(lights, highlights):
    """No multiplier has more than 18 bits. The table of the root has 512 words of 30 bits."""
    model = Quotient(QuotientSpans(lights, highlights))
    for interval, stated in enumerate(zip(*QUOTIENTS[lights, highlights], strict=True), 1):
        cost = cost_of(unit := QuotientUnit(model, interval))
        assert (cost.multiplier_count, unit.latency) == stated
        assert (max(max(pair) for pair in cost.multipliers), cost.constant_multipliers) == (18, 0)
        assert cost.rom_bits == 512 * 30


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "multipliers"),
    [
        (QuotientSpans(), 5),
        (QuotientSpans(mirror=True), 6),
        (QuotientSpans(2), 9),
        (QuotientSpans(2, mirror=True), 10),
        (QuotientSpans(2, highlights=False), 3),
    ],
)
def test_parts_of_spans_of_quotients(model, multipliers):
    cost = cost_of(unit := QuotientSpansUnit(model))
    assert (cost.multipliers, cost.constant_multipliers) == ({(18, 18): multipliers}, 0)
    assert (unit.multipliers, unit.latency, unit.short_latency) == (multipliers, 7, 6)
