"""Geometry and renderer say that they are empty only if they are. Units that draw in bands rely on this."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from amaranth.hdl import Signal, unsigned
from amaranth.lib import data
from amaranth.lib.wiring import Out

from blysk.bench.quality.mutation import Wrapped
from blysk.bench.units.record import length_of
from blysk.bench.units.registry import RECORDS
from blysk.golden.build import Build
from blysk.golden.geometry.triangles import GRID
from blysk.golden.presets import preset
from blysk.golden.render import Renderer
from blysk.hdl.geometry.geometry import GeometryUnit
from blysk.hdl.render import RendererUnit, waiting_spans
from blysk.sim.engines.simulate import simulate

from ..checks import assert_beats_equal

DESIGN = preset(x_bits=5, y_bits=5)
COMPACT = DESIGN.built(top="render", geometry_style="compact")
UNITS = {
    "geometry": ("geometry", GeometryUnit),
    "geometry, two lanes": ("geometry", partial(GeometryUnit, build=Build(top="geometry", setups=2))),
    "geometry, compact": ("geometry", partial(GeometryUnit, build=Build("compact"))),
    "render": ("render", partial(RendererUnit, Renderer(DESIGN), (32, 24))),
    "render, two lanes": (
        "render",
        partial(RendererUnit, Renderer(DESIGN.built(top="render", lanes=2)), (32, 24)),
    ),
    "render, compact": ("render", partial(RendererUnit, Renderer(COMPACT), (32, 24))),
}


class OneByOne(Wrapped):
    """A unit that gets a triangle only while it says that it is empty.

    ``status.wrong`` counts wrong cycles: a beat waits at the output of an empty unit, or the unit stops being
    empty without having taken a triangle.
    """

    def __init__(self, unit):
        super().__init__(unit, status=Out(data.StructLayout({"taken": unsigned(32), "wrong": unsigned(32)})))

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = unit = self.unit
        was_empty, took, goes = Signal(), Signal(), Signal()
        takes = unit.i.valid & unit.i.ready
        # In these four cycles a triangle that is still inside would show.
        rests = Signal(4)
        m.d.sync += [was_empty.eq(unit.idle), took.eq(takes), rests.eq((rests << 1) | unit.idle)]
        m.d.comb += [
            goes.eq(unit.idle & rests.all() & ~took),
            unit.i.valid.eq(self.i.valid & goes),
            self.i.ready.eq(unit.i.ready & goes),
        ]
        wrong = unit.idle & unit.o.valid | was_empty & ~unit.idle & ~took
        m.d.sync += [
            self.status.wrong.eq(self.status.wrong + wrong),
            self.status.taken.eq(self.status.taken + takes),
        ]
        return m


def _units():
    """CI has the default structures and the smallest structure, and the long run has all."""
    for name in UNITS:
        often = name in RECORDS or name == "geometry, compact"
        yield pytest.param(name, marks=[pytest.mark.long, *[pytest.mark.ci] * often])


@pytest.mark.parametrize("name", list(_units()))
def test_empty_is_empty(name):
    record, make = RECORDS[UNITS[name][0]], UNITS[name][1]
    unit, rng = make(), np.random.default_rng(2026)
    case = next(iter(record.stimuli.values())).make(unit, rng, 100)
    expected, alone = record.expect(unit, case), OneByOne(unit)
    for stalled in (0.0, 0.6):
        found = simulate(
            alone,
            case.beats,
            count=length_of(expected),
            **case.sent,
            output_stalls=rng.random(1009) < stalled,
            idle_timeout=50_000,
            engine="auto",
        )
        assert_beats_equal(found.beats, expected)
        assert found.status["taken"] == 100
        assert found.status["wrong"] == 0


class Owing(Wrapped):
    """A unit whose triangles have a pixel each.

    ``status.wrong`` counts the cycles in which the unit says that it is empty, and a pixel is due.
    """

    def __init__(self, unit):
        super().__init__(unit, status=Out(data.StructLayout({"wrong": unsigned(32), "most": unsigned(32)})))

    def elaborate(self, platform):
        m = super().elaborate(platform)
        m.submodules.unit = unit = self.unit
        owed = Signal(32)
        enters, leaves = unit.i.valid & unit.i.ready, unit.o.valid & unit.o.ready
        m.d.sync += [
            owed.eq(owed + enters - leaves),
            self.status.wrong.eq(self.status.wrong + (unit.idle & owed.any())),
        ]
        with m.If(owed > self.status.most):
            m.d.sync += self.status.most.eq(owed)
        return m


@pytest.mark.long
def test_full_is_not_empty():
    """While the FIFO of spans fills, one triangle of a pixel after the other, the unit is never empty.

    Geometry is empty before each triangle, so only the count of spans tells.
    """
    unit = RendererUnit(Renderer(DESIGN.built(top="render", setups=2)), (32, 24))
    record, room = RECORDS["render"], waiting_spans(unit.model.design.build)
    assert room == 2048
    number, pace = np.arange(room + 100), 300
    case = next(iter(record.stimuli.values())).make(unit, np.random.default_rng(2026), len(number))
    place = np.array([case.constants[name] for name in ("left", "top")])
    x, y = ((place + np.stack((number % 32, number // 32 % 24), axis=1)) * GRID.steps + GRID.steps // 2).T
    # Later triangles are nearer, so that every pixel is written.
    corners = {
        "x": x[:, np.newaxis] + np.array([-90, 90, 0]),
        "y": y[:, np.newaxis] + np.array([-90, -90, 90]),
        "depth": np.repeat(1 << 22, 3) - 100 * number[:, np.newaxis],
    }
    case = replace(case, beats=case.beats | corners, constants=case.constants | {"back_faces": 0})
    expected, owing = record.expect(unit, case), Owing(unit)
    assert length_of(expected) == len(number)
    # The triangles come while the output waits.
    found = simulate(
        owing,
        case.beats,
        count=len(number),
        **case.sent,
        input_stalls=np.arange(pace) > 0,
        output_stalls=np.arange(2 * pace * len(number)) < pace * (len(number) + 1),
        idle_timeout=50_000 + pace * 200,
        engine="auto",
    )
    assert_beats_equal(found.beats, expected)
    assert found.status["most"] > room
    assert found.status["wrong"] == 0
