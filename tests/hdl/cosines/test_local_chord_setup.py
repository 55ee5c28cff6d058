# amaranth: UnusedElaboratable=no
"""Local chord setup: RTL against its twin, clock by clock, at many intervals."""

import numpy as np
import pytest

from blysk.golden.cosines.local_chord_setup import LocalChordSetup
from blysk.golden.number.fixed import Fixed
from blysk.hdl.cosines.local_chord_setup import LocalChordSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.simulate import simulate

VARIANTS = [*((1, interval) for interval in (1, 2, 3, 4, 5, 6)), (2, 4), (3, 16)]


def spans(rng, lights, count=500):
    """Curves that fit, some that bend or climb too much, and some of the largest and smallest codes."""
    p = LocalChordSetup
    values = {}
    for name, format in (("diffuse", p.DIFFUSE_FORMAT), ("highlight", p.HIGHLIGHT_FORMAT)):
        start = rng.uniform(format.min_code * 0.9, format.max_code * 0.9, (count, lights))
        size = 10.0 ** rng.uniform(-6, 0.1, (count, 1))
        slope = rng.uniform(-0.5, 0.5, (count, lights)) * size / format.step
        bend = rng.uniform(-0.125, 0.125, (count, lights)) * size / format.step
        slope[:40] = 0.5 / format.step + rng.integers(-200, 200, (40, lights))
        bend[40:80] = 0.125 / format.step + rng.integers(-200, 200, (40, lights))
        slope[20:60] *= -1
        bend[60:80] *= -1
        codes = np.stack([start + t * (slope + t * bend) for t in (0, 0.5, 1)], axis=2)
        codes = np.clip(np.rint(codes), format.min_code, format.max_code).astype(np.int64)
        codes[80:120] = rng.choice([format.min_code, format.max_code, 0, 1], (40, lights, 3))
        codes[120:160] = codes[120:160, :, :1]
        values[name] = codes
    length = rng.integers(1, 4096, count)
    length[160:172] = [1, 2, 3, 4, 5, 16, 17, 2048, 2049, 2050, 4094, 4095]
    order = rng.permutation(count)
    return {name: codes[order] for name, codes in values.items()}, length[order]


def beats_of(unit, values, length):
    beats = np.zeros(len(length), dtype_of(unit.i.payload.shape()))
    for name in unit.i.payload.shape().members["values"].elem_shape.members:
        beats["values"][name] = values[name]
    beats["length"] = length
    return beats


def expected_of(unit, values, length):
    """Beats of the output."""
    p = LocalChordSetup
    diffuse, highlight = (
        Fixed(format, values[name])
        for name, format in (("diffuse", p.DIFFUSE_FORMAT), ("highlight", p.HIGHLIGHT_FORMAT))
    )
    if not unit.highlights:
        highlight = Fixed(p.HIGHLIGHT_FORMAT, 0 * values["highlight"])
    diffuse, highlight, out_of_range = p().compute(diffuse, highlight, length)
    expected = np.zeros(len(out_of_range), dtype_of(unit.o.payload.shape()))
    for name, differences in (("diffuse", diffuse), ("highlight", highlight)):
        if name in expected["lights"].dtype.names:
            for field in ("start", "first", "second"):
                expected["lights"][name][field] = getattr(differences, field).codes
    expected["length"], expected["out_of_range"] = length, out_of_range
    return expected


@pytest.mark.parametrize(("lights", "interval"), VARIANTS)
def test_equals_twin(verify, lights, interval):
    unit = LocalChordSetupUnit(lights, interval)
    values, length = spans(np.random.default_rng(interval), lights)
    expected = expected_of(unit, values, length)
    assert 50 < np.count_nonzero(expected["out_of_range"]) < 300
    verify(unit, beats_of(unit, values, length), expected)


def test_every_bit_counts():
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    unit = LocalChordSetupUnit()
    values, length = spans(np.random.default_rng(12), 1, 30_000)
    expected = expected_of(unit, values, length)
    run = simulate(unit, beats_of(unit, values, length), count=len(expected), engine="auto")
    np.testing.assert_array_equal(run.beats, expected)


def test_without_highlights(verify):
    unit = LocalChordSetupUnit(2, 2, highlights=False)
    assert unit.multipliers == 3
    values, length = spans(np.random.default_rng(10), 2)
    verify(unit, beats_of(unit, values, length), expected_of(unit, values, length))


@pytest.mark.parametrize(("lights", "interval"), VARIANTS)
def test_multipliers(lights, interval):
    """1 product a span and 5 a light, as even as the interval allows; all of 18 bits."""
    unit = LocalChordSetupUnit(lights, interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): -(-(1 + 5 * lights) // interval)}
    assert unit.multipliers == cost.multiplier_count
    assert cost.constant_multipliers == 0
    assert unit.latency >= LocalChordSetupUnit(lights, 1).latency


def test_default_interval():
    unit = LocalChordSetupUnit()
    assert (unit.lights, unit.initiation_interval, unit.multipliers) == (1, 4, 2)


@pytest.mark.parametrize("interval", [0, -1])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        LocalChordSetupUnit(1, interval)


@pytest.mark.parametrize("bits", [1, 13])
def test_refuses_length_bits(bits):
    with pytest.raises(ValueError, match=rf"^length_bits must be 2 to 12, not {bits}$"):
        LocalChordSetupUnit(length_bits=bits)


def test_shorter_spans_need_a_smaller_table(verify):
    """The same results for every length that fits."""
    unit = LocalChordSetupUnit(1, 4, length_bits=9)
    assert cost_of(unit).rom_bits == 17 << 8
    rng = np.random.default_rng(9)
    values, _ = spans(rng, 1, 511)
    length = rng.permutation(np.arange(1, 512))
    verify(unit, beats_of(unit, values, length), expected_of(unit, values, length))


def test_beats_after_a_pause(verify_pauses):
    """The results of a beat do not depend on what came before, or on how long ago it was."""
    unit = LocalChordSetupUnit(1, 4)
    values, length = spans(np.random.default_rng(3), 1)
    beats, expected = beats_of(unit, values, length)[:40], expected_of(unit, values, length)[:40]
    verify_pauses(unit, beats, expected, 60)
    # Of each pair the first waits alone at the output: the second goes in on the clock after that has left.
    stalls = {"input_stalls": np.arange(60) != 0, "output_stalls": np.arange(120) < 65}
    run = simulate(unit, beats, count=len(beats), engine="auto", **stalls)
    np.testing.assert_array_equal(run.beats, expected)
    np.testing.assert_array_equal(run.input_cycles[1::2], run.cycles[::2] + 1)
    np.testing.assert_array_equal(run.cycles[1::2], run.input_cycles[1::2] + unit.latency)


@pytest.mark.parametrize("interval", [1, 4])
def test_reset_leaves_nothing_behind(verify_reset, interval):
    unit = LocalChordSetupUnit(1, interval)
    values, length = spans(np.random.default_rng(8), 1)
    befores = 1, 2 * interval + 1, unit.latency + 2
    beats = beats_of(unit, values, length)[:12]
    found = verify_reset(unit, beats, befores, unit.latency + 6 * interval)
    assert [clock for clock, _ in found] == [unit.latency + interval * k for k in range(6)]
    assert len({payload for _, payload in found}) == 6
