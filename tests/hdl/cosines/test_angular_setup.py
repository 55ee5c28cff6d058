# amaranth: UnusedElaboratable=no
# Above: a component that is refused is never elaborated.
"""Angular setup: RTL against its twin, clock by clock, and with the highlight-cosine unit behind it."""

import numpy as np
import pytest
from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from blysk.golden.cosines.angular_setup import AngularSetup
from blysk.golden.cosines.arccos import Arccos
from blysk.golden.cosines.highlight_cosine import HighlightCosine
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.hdl.core.stream import connect
from blysk.hdl.cosines.angular_setup import AngularSetupUnit
from blysk.hdl.cosines.highlight_cosine import HighlightCosineUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.simulate import simulate

VARIANTS = {
    "half_chord": AngularSetup(),
    "arccos": AngularSetup("arccos"),
    "arccos_printed": AngularSetup("arccos", Arccos("as_published")),
}


def beats_of(left, right, vector, length, parameters=VARIANTS["half_chord"]):
    operands = (Fixed(COMPONENT, codes) for codes in (left, right, vector))
    angle, phase, step, cos_beta, out_of_range = parameters.compute(*operands, length)
    return (
        {"normal_left": left, "normal_right": right, "vector": vector, "length": length},
        {
            "angle": angle.codes,
            "phase": phase.codes,
            "step": step.codes,
            "cos_beta": cos_beta.codes,
            "length": length,
            "out_of_range": out_of_range,
        },
    )


@pytest.mark.parametrize(
    ("variant", "interval"),
    [
        ("half_chord", None),
        *(
            pytest.param(*variant, marks=pytest.mark.long)
            for variant in (("half_chord", 4), ("half_chord", 26), ("arccos", 4), ("arccos_printed", None))
        ),
    ],
)
def test_equals_twin(verify, normal_pairs, variant, interval):
    check(verify, normal_pairs, VARIANTS[variant], interval)


@pytest.mark.long
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("interval", [1, 2, 3, 5])
def test_equals_twin_with_every_interval(verify, normal_pairs, variant, interval):
    check(verify, normal_pairs, VARIANTS[variant], interval)


def check(verify, normal_pairs, parameters, interval):
    rng = np.random.default_rng(2)
    angles = [np.zeros(20), 10.0 ** rng.uniform(-5, 1, 500), rng.uniform(0, 180, 700), np.full(20, 90)]
    angles = np.concatenate([*angles, 180 - 10.0 ** rng.uniform(-5, 1, 100), np.full(20, 180)])
    rng.shuffle(angles)
    left, right = (quantise(normals) for normals in normal_pairs(rng, len(angles), angles))
    vector, near = normal_pairs(rng, len(angles), 180 * rng.random(len(angles)))
    vector = quantise(np.where(rng.random((len(angles), 1)) < 0.5, vector, near))
    vector[::3] = left[::3]
    # Not only unit vectors: every word at its ends must not upset what follows.
    corners = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (300, 9))
    left, right, vector = (
        np.vstack([unit, corners[:, k : k + 3]]) for k, unit in ((0, left), (3, right), (6, vector))
    )
    length = rng.integers(1, 4096, len(left))
    length[:40] = np.tile([1, 2, 3, 4, 5, 2048, 2049, 2050, 4094, 4095], 4)
    beats, expected = beats_of(left, right, vector, length, parameters)
    assert 100 < expected["out_of_range"].sum() < 500
    verify(AngularSetupUnit(parameters, interval), beats, expected)


@pytest.mark.long
def test_times_and_multipliers_as_stated():
    for variant, latencies, counts, longest in (
        ("half_chord", [59, 60, 62, 67, 71, 64], [26, 13, 9, 7, 6, 5], 26),
        ("arccos", [59, 60, 63, 63, 66, 66], [23, 13, 9, 8, 7, 6], 21),
    ):
        units = [AngularSetupUnit(VARIANTS[variant], interval) for interval in range(1, 7)]
        assert [unit.latency for unit in units] == latencies
        assert [cost_of(unit).multiplier_count for unit in units] == counts
        for interval in (0, longest + 1):
            message = rf"^initiation_interval must be 1 to {longest}, not {interval}$"
            with pytest.raises(ValueError, match=message):
                AngularSetupUnit(VARIANTS[variant], interval)
    assert AngularSetupUnit().initiation_interval == 6


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
def test_with_the_highlight_cosine_unit(normal_pairs):
    rng = np.random.default_rng(3)
    count = 120
    left, right = (quantise(n) for n in normal_pairs(rng, count, 10.0 ** rng.uniform(-3, 2, count)))
    vector, _ = normal_pairs(rng, count, 0)
    length = rng.integers(1, 60, count)
    length[3] = 4095
    beats, prepared = beats_of(left, right, quantise(vector), length)
    span = np.repeat(np.arange(count), length)
    index = np.arange(len(span)) - np.repeat(np.cumsum(length) - length, length)
    formats = {
        name: getattr(AngularSetup, f"{name.upper()}_FORMAT") for name in ("phase", "step", "cos_beta")
    }
    operands = (Fixed(format, prepared[name]) for name, format in formats.items())
    expected = HighlightCosine().compute(*operands, span, index).codes
    for output_share in (0, 0.4):
        stalls = rng.random(1009) < output_share
        run = simulate(Chain(), beats, count=len(expected), engine="auto", output_stalls=stalls)
        np.testing.assert_array_equal(run.beats, expected)
