"""Features of the interpreted engine alone: waveforms, progress, errors of the component."""

import numpy as np
import pytest
from amaranth.hdl import Module
from amaranth.lib import stream
from amaranth.lib.wiring import Component, In, Out

from blysk.hdl.core.fixed import SQ
from blysk.sim.engines.simulate import simulate


class Negate(Component):
    """``-x`` in fixed point, through one register."""

    i: In(stream.Signature(SQ(2, 6)))
    o: Out(stream.Signature(SQ(3, 6)))

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.i.ready.eq(~self.o.valid | self.o.ready)
        with m.If(self.i.ready):
            m.d.sync += [
                self.o.valid.eq(self.i.valid),
                self.o.payload.as_value().eq(-self.i.payload.as_value()),
            ]
        return m


def test_fixed_point_payloads_are_codes():
    codes = np.arange(-128, 128)
    run = simulate(Negate(), codes, count=256, engine="pysim")
    assert run.beats.dtype == np.int16
    np.testing.assert_array_equal(run.beats, -codes)


def test_waveforms(tmp_path):
    file = tmp_path / "negate.vcd"
    simulate(Negate(), np.array([3, -5]), count=2, engine="pysim", vcd=str(file))
    text = file.read_text()
    assert "$enddefinitions" in text
    assert "i__payload" in text
    # The first input beat, and its negative in nine bits.
    assert "b11 " in text
    assert "b111111101 " in text


def test_progress():
    seen = []
    run = simulate(Negate(), np.zeros(2500, dtype=int), count=2500, engine="pysim", progress=seen.append)
    # Every 1000 cycles. The first beat leaves at cycle 1.
    assert seen == [999, 1999]
    assert run.total_cycles == 2501
    with pytest.raises(KeyboardInterrupt):
        simulate(Negate(), np.zeros(2500, dtype=int), count=2500, engine="pysim", progress=_interrupt)


def _interrupt(done):
    raise KeyboardInterrupt


def test_an_error_of_the_component_is_not_hidden():
    class Broken(Negate):
        def elaborate(self, platform):
            raise RuntimeError("cannot be elaborated")

    with pytest.raises(RuntimeError, match=r"^cannot be elaborated$"):
        simulate(Broken(), np.arange(2), count=2, engine="pysim")
