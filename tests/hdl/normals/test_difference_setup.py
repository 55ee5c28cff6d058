# amaranth: UnusedElaboratable=no
"""Difference setup unit: RTL against its twin, clock by clock."""

import numpy as np
import pytest

from blysk.golden.normals.difference_setup import DifferenceSetup
from blysk.golden.normals.gpq import GPQ
from blysk.golden.number.fixed import Fixed
from blysk.golden.number.unit_vector import COMPONENT
from blysk.hdl.emit.cost import cost_of
from blysk.hdl.normals.difference_setup import DifferenceSetupUnit
from blysk.sim.engines.simulate import simulate

OWN, DOCUMENTED = DifferenceSetup(), DifferenceSetup(as_published=True)
# Latency and multipliers for the initiation intervals 1, 2, ..., as the unit's text states them.
STATED = {
    OWN: [(21, 7), (22, 4), (23, 3), (25, 2), (23, 2), (24, 2), (28, 1)],
    DOCUMENTED: [(24, 9), (25, 5), (25, 3), (25, 3), (28, 2), (29, 2), (26, 2), (26, 2), (28, 1)],
}
STRAIGHT = [(13, 3), (15, 2), *[(16, 1)] * 5]
VARIANTS = [
    (parameters, interval) for parameters in STATED for interval in range(1, len(STATED[parameters]) + 1)
]


@pytest.mark.parametrize(("parameters", "interval"), VARIANTS, ids=str)
def test_intervals_and_what_they_cost(parameters, interval):
    unit = DifferenceSetupUnit(parameters, interval)
    latency, multipliers = STATED[parameters][interval - 1]
    assert (unit.latency, unit.initiation_interval) == (latency, interval)
    cost = cost_of(unit)
    assert cost.multiplier_count == multipliers
    assert all(out_of_range <= 18 for out_of_range, _ in cost.multipliers)
    assert cost.rom_bits == 2048 * 17


@pytest.mark.parametrize("interval", range(1, 8))
def test_straight_lines_and_what_they_cost(interval):
    unit = DifferenceSetupUnit(initiation_interval=interval, order=1)
    latency, multipliers = STRAIGHT[interval - 1]
    assert (unit.latency, unit.initiation_interval) == (latency, interval)
    assert cost_of(unit).multiplier_count == multipliers
    assert "g" not in unit.i.payload.shape().members


def test_is_sequential_by_default():
    assert DifferenceSetupUnit(order=1).initiation_interval == 3
    for parameters, latency, interval in ((None, 28, 7), (DOCUMENTED, 28, 9)):
        unit = DifferenceSetupUnit(parameters)
        assert (unit.latency, unit.initiation_interval) == (latency, interval)


@pytest.mark.parametrize("interval", [0, 8, -1, 1.5])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^initiation_interval must be 1 to 7, not {interval}$"):
        DifferenceSetupUnit(initiation_interval=interval)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"order": 0}, "order must be 1 or 2, not 0"),
        ({"order": 3}, "order must be 1 or 2, not 3"),
        ({"length_bits": 1}, "length_bits must be 2 to 12, not 1"),
        ({"length_bits": 13}, "length_bits must be 2 to 12, not 13"),
    ],
)
def test_refuses_an_argument(arguments, message):
    with pytest.raises(ValueError, match=rf"^{message}$"):
        DifferenceSetupUnit(**arguments)


def operands(rng, length):
    """Coefficients of random spans, and of some at the ends of the words."""
    g, p, q = (
        rng.integers(format.min_code, format.max_code + 1, (len(length), 3))
        for format in (GPQ.G_FORMAT, GPQ.P_FORMAT, COMPONENT)
    )
    g[:30], p[:30] = GPQ.G_FORMAT.min_code, GPQ.P_FORMAT.min_code
    g[30:60], p[30:60] = GPQ.G_FORMAT.max_code, GPQ.P_FORMAT.max_code
    return {"g": g, "p": p, "q": q, "length": length}


def expected_of(parameters, beats):
    first, second = parameters.compute(
        Fixed(GPQ.G_FORMAT, beats["g"]), Fixed(GPQ.P_FORMAT, beats["p"]), beats["length"]
    )
    return {"start": beats["q"], "first": first.codes, "second": second.codes, "length": beats["length"]}


@pytest.mark.parametrize(("parameters", "interval"), [(OWN, 1), (OWN, 3), (OWN, 4), (DOCUMENTED, 2)], ids=str)
def test_straight_lines_equal_twin(verify, parameters, interval):
    beats = operands(np.random.default_rng(5), np.arange(1, 4096))
    beats["g"][:] = 0
    expected = expected_of(parameters, beats)
    assert not expected["second"].any()
    del beats["g"]
    verify(DifferenceSetupUnit(parameters, interval, order=1), beats, expected)


@pytest.mark.parametrize(("bits", "interval"), [(2, 7), (3, 1), (7, 3), (10, 4)])
def test_shorter_spans_need_a_smaller_table(verify, bits, interval):
    """The same results for every length that fits."""
    length = np.random.default_rng(bits).permutation(np.arange(1, 1 << bits).repeat(max(1, 400 >> bits)))
    beats = operands(np.random.default_rng(6), length)
    unit = DifferenceSetupUnit(OWN, interval, length_bits=bits)
    assert cost_of(unit).rom_bits == (17 << (bits - 1))
    verify(unit, beats, expected_of(OWN, beats))


@pytest.mark.parametrize(
    ("parameters", "interval"), [v for v in VARIANTS if v[0] == OWN or v[1] in (1, 3, 9)], ids=str
)
def test_equals_twin_for_every_length(verify, parameters, interval):
    rng = np.random.default_rng(4)
    beats = operands(rng, np.r_[np.arange(1, 4096), rng.integers(1, 40, 500)])
    verify(DifferenceSetupUnit(parameters, interval), beats, expected_of(parameters, beats))


def test_every_bit_counts():
    """What the last bits of the products and of the reciprocal give is mostly shifted out."""
    rng = np.random.default_rng(7)
    beats = operands(rng, np.r_[np.arange(1, 4096), np.trunc(2 ** rng.uniform(0, 12, 20_000)).astype(int)])
    expected = expected_of(OWN, beats)
    run = simulate(DifferenceSetupUnit(OWN), beats, count=len(beats["length"]), engine="auto")
    for name, codes in expected.items():
        np.testing.assert_array_equal(run.beats[name], codes)
