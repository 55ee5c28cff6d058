# amaranth: UnusedElaboratable=no
"""Chord setup: RTL against its twin, clock by clock, at many intervals."""

import numpy as np
import pytest

from blysk.golden.cosines.chord_setup import ChordSetup
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.hdl.cosines.chord_setup import ChordSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.simulate import simulate

VARIANTS = [*((1, interval) for interval in (1, 2, 3, 4, 5, 7, 13, 26)), (2, 4)]


def spans(rng, normal_pairs, count=500):
    """Spans of every angle, some far over the widest, some of the largest and smallest codes."""
    angles = np.r_[np.zeros(20), 10.0 ** rng.uniform(-4, 0, 80), rng.uniform(0, 22.4, count - 160)]
    angles = np.r_[angles, rng.uniform(22.6, 180, 59), 180]
    left, right = (quantise(v) for v in normal_pairs(rng, count, angles))
    ends = rng.choice([COMPONENT.min_code, COMPONENT.max_code, 0, 1, -1], (40, 6))
    left, right = np.vstack([left, ends[:, :3]]), np.vstack([right, ends[:, 3:]])
    length = rng.integers(1, 4096, len(left))
    length[:12] = [1, 2, 3, 4, 5, 16, 17, 2048, 2049, 2050, 4094, 4095]
    order = rng.permutation(len(left))
    return {"normal_left": left[order], "normal_right": right[order], "length": length[order]}


def constants_of(unit, vectors):
    constants = np.zeros(unit.lights, dtype_of(unit.constants.shape().elem_shape))
    constants["direction"], constants["halfway"] = vectors
    return constants


def expected_of(unit, beats, vectors):
    """Beats of the output."""
    left, right, *vectors = (
        Fixed(COMPONENT, codes) for codes in (beats["normal_left"], beats["normal_right"], *vectors)
    )
    diffuse, highlight, out_of_range = unit.parameters.compute(left, right, *vectors, beats["length"])
    expected = np.zeros(len(out_of_range), dtype_of(unit.o.payload.shape()))
    for name, differences in (("diffuse", diffuse), ("highlight", highlight)):
        for field in ("start", "first", "second"):
            expected["lights"][name][field] = getattr(differences, field).codes
    expected["length"], expected["out_of_range"] = beats["length"], out_of_range
    return expected


@pytest.mark.parametrize(
    ("lights", "interval"),
    [
        pytest.param(*variant, marks=() if variant in ((1, 4), (2, 4)) else pytest.mark.long)
        for variant in VARIANTS
    ],
)
def test_equals_twin(verify, normal_pairs, lights, interval):
    rng = np.random.default_rng(interval)
    unit = ChordSetupUnit(lights, interval)
    beats = spans(rng, normal_pairs)
    vectors = [quantise(normal_pairs(rng, lights, 0.0)[0]) for _ in range(2)]
    vectors[1] = np.abs(vectors[1])
    # Near the peak u and its differences are small.
    beats["normal_left"][:50] = vectors[1][0]
    # Components of N - H of -1, the most that is not halved.
    less = np.repeat(np.vstack([np.eye(3, dtype=np.int64), [1, 1, 1]]) << 17, 10, axis=0)
    beats["normal_left"][50:90] = beats["normal_right"][60:100] = vectors[1][0] - less
    expected = expected_of(unit, beats, vectors)
    assert 50 < np.count_nonzero(expected["out_of_range"]) < 200
    verify(unit, beats, expected, constants=constants_of(unit, vectors))


def test_every_bit_counts(normal_pairs):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    rng = np.random.default_rng(12)
    unit = ChordSetupUnit()
    for _ in range(4):
        beats = spans(rng, normal_pairs, 5000)
        vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
        expected, constants = expected_of(unit, beats, vectors), constants_of(unit, vectors)
        run = simulate(unit, beats, count=len(expected), constants=constants, engine="auto")
        np.testing.assert_array_equal(run.beats, expected)


@pytest.mark.parametrize(("lights", "interval"), VARIANTS)
def test_multipliers(lights, interval):
    """7 products a span and 19 a light, as even as the interval allows; all of 18 bits."""
    unit = ChordSetupUnit(lights, interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): -(-(7 + 19 * lights) // interval)}
    assert unit.multipliers == cost.multiplier_count
    assert cost.constant_multipliers == 0
    # Nothing stands longer than the graph: the latency grows with the interval by what multipliers wait.
    assert unit.latency >= ChordSetupUnit(lights, 1).latency


def test_default_interval():
    unit = ChordSetupUnit()
    assert (unit.lights, unit.initiation_interval, unit.multipliers) == (1, 4, 7)


@pytest.mark.parametrize("interval", [0, -1])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        ChordSetupUnit(1, interval)


def test_beats_after_a_pause(normal_pairs, verify_pauses):
    """The results of a beat do not depend on what came before, or on how long ago it was."""
    rng = np.random.default_rng(3)
    unit = ChordSetupUnit(1, 4)
    beats = {name: codes[:40] for name, codes in spans(rng, normal_pairs).items()}
    vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
    verify_pauses(unit, beats, expected_of(unit, beats, vectors), 60, constants_of(unit, vectors))


@pytest.mark.parametrize("interval", [1, 4, 26])
def test_reset_leaves_nothing_behind(normal_pairs, verify_reset, interval):
    rng = np.random.default_rng(8)
    unit = ChordSetupUnit(1, interval)
    beats = {name: codes[:12] for name, codes in spans(rng, normal_pairs).items()}
    vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
    befores = 1, 2 * interval + 1, unit.latency + 2
    found = verify_reset(unit, beats, befores, unit.latency + 6 * interval, constants_of(unit, vectors))
    assert [clock for clock, _ in found] == [unit.latency + interval * k for k in range(6)]
    assert len({payload for _, payload in found}) == 6


@pytest.mark.long
def test_shorter_spans_need_a_smaller_table(verify, normal_pairs):
    """The same results for every length that fits."""
    rng = np.random.default_rng(9)
    unit = ChordSetupUnit(1, 4, length_bits=9)
    assert cost_of(unit).rom_bits == 17 << 8
    beats = spans(rng, normal_pairs, 600)
    beats["length"] = rng.permutation(
        np.r_[np.arange(1, 512), rng.integers(1, 512, len(beats["length"]) - 511)]
    )
    vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
    verify(unit, beats, expected_of(unit, beats, vectors), constants=constants_of(unit, vectors))


@pytest.mark.long
@pytest.mark.parametrize(
    ("terms", "fraction_bits", "interval"),
    [(1, 36, 4), *(pytest.param(*p, marks=pytest.mark.long) for p in ((2, 46, 5), (3, 40, 1)))],
)
def test_fewer_terms_and_bits(verify, normal_pairs, terms, fraction_bits, interval):
    """The twin's; each term is a product of a span."""
    rng = np.random.default_rng(terms)
    parameters = ChordSetup(terms, fraction_bits)
    unit = ChordSetupUnit(1, interval, parameters=parameters)
    beats = spans(rng, normal_pairs)
    vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
    verify(unit, beats, expected_of(unit, beats, vectors), constants=constants_of(unit, vectors))
    assert cost_of(unit).multiplier_count == -(-(4 + terms + 19) // interval)


def test_refuses_terms_and_bits():
    with pytest.raises(ValueError, match=r"^terms must be 1 to 3, not 4$"):
        ChordSetup(terms=4)
    for bits in (34, 37, 48):
        with pytest.raises(ValueError, match=rf"^fraction_bits must be even and 36 to 46, not {bits}$"):
            ChordSetup(fraction_bits=bits)


@pytest.mark.parametrize("bits", [1, 13])
def test_refuses_length_bits(bits):
    with pytest.raises(ValueError, match=rf"^length_bits must be 2 to 12, not {bits}$"):
        ChordSetupUnit(length_bits=bits)
