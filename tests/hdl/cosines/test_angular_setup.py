# amaranth: UnusedElaboratable=no
"""Angular setup: its times and parts, and the highlight-cosine unit behind it."""

import numpy as np
import pytest
from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.hdl.core.stream import connect
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate
from blysk.sim.units.operands import any_pairs, unit_codes
from blysk.sim.units.record import Case
from blysk.sim.units.registry import RECORDS


@pytest.mark.long
@pytest.mark.parametrize(
    ("angle", "latencies", "counts", "longest"),
    [
        ("half_chord", [53, 54, 55, 58, 58, 59], [26, 13, 9, 7, 6, 5], 26),
        ("arccos", [53, 54, 56, 59, 59, 58], [23, 13, 9, 8, 7, 6], 21),
    ],
)
def test_times_and_parts(angle, latencies, counts, longest):
    parameters = AngularSetup(angle)
    units = [AngularSetupUnit(parameters, initiation_interval=interval) for interval in range(1, 7)]
    assert [unit.latency for unit in units] == latencies
    assert [cost_of(unit).multiplier_count for unit in units] == counts
    for interval in (0, longest + 1):
        message = rf"^initiation_interval must be 1 to {longest}, not {interval}$"
        with pytest.raises(ValueError, match=message):
            AngularSetupUnit(parameters, initiation_interval=interval)
    assert AngularSetupUnit(parameters).initiation_interval == 6


class Chain(wiring.Component):
    """Setup and highlight-cosine unit: spans in, ``1 - cos gamma`` of every pixel out."""

    def __init__(self):
        self.setup, self.wave = AngularSetupUnit(), HighlightCosineUnit()
        shapes = self.setup.i.payload.shape(), self.wave.o.payload.shape()
        super().__init__({"i": In(stream.Signature(shapes[0])), "o": Out(stream.Signature(shapes[1]))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.setup, m.submodules.wave = setup, wave = self.setup, self.wave
        connect(m, wiring.flipped(self.i), setup.i)
        connect(m, wave.o, wiring.flipped(self.o))
        m.d.comb += [wave.i.valid.eq(setup.o.valid), setup.o.ready.eq(wave.i.ready)]
        for name in ("phase", "step", "cos_beta", "length"):
            m.d.comb += wave.i.payload[name].eq(setup.o.payload[name])
        return m


@pytest.mark.long
def test_with_the_highlight_cosine_unit():
    rng, chain = np.random.default_rng(3), Chain()
    left, right = any_pairs(rng, 120)
    length = np.r_[4095, rng.integers(1, 60, 119)]
    beats = {"normal_left": left, "normal_right": right, "vector": unit_codes(rng, 120), "length": length}
    prepared = RECORDS["angular_setup"].expect(chain.setup, Case(beats))
    expected = RECORDS["highlight_cosine"].expect(chain.wave, Case(prepared))
    for share in (0, 0.4):
        stalls = rng.random(1009) < share
        run = simulate(chain, beats, count=len(expected), engine="auto", output_stalls=stalls)
        np.testing.assert_array_equal(run.beats, expected)
