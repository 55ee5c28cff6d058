# amaranth: UnusedElaboratable=no
"""Recurrence setup: RTL against its twin, clock by clock, at several intervals."""

import numpy as np
import pytest

from blysk.golden.cosines.recurrence import Recurrence
from blysk.golden.cosines.recurrence_setup import RecurrenceSetup
from blysk.golden.number.fixed import SQ, Fixed
from blysk.golden.number.unit_vector import COMPONENT, quantise
from blysk.hdl.cosines.recurrence_setup import RecurrenceSetupUnit
from blysk.hdl.emit.cost import cost_of
from blysk.sim.engines.beats import dtype_of
from blysk.sim.engines.simulate import simulate

DIRECT = RecurrenceSetup(Recurrence("direct", interleave=4, result_format=SQ(2, 25)))
VARIANTS = [
    pytest.param(RecurrenceSetup(), 1, 1, marks=pytest.mark.long),
    (RecurrenceSetup(), 1, 4),
    pytest.param(RecurrenceSetup(), 1, 46, marks=pytest.mark.long),
    pytest.param(RecurrenceSetup(), 2, 4, marks=pytest.mark.long),
    pytest.param(DIRECT, 1, 3, marks=pytest.mark.long),
]
COPIES = ("diffuse", "highlight")


def spans(rng, setup_spans, count=400):
    return setup_spans(rng, count, 90, 90.1)


def expected_of(unit, beats, vectors):
    """Beats of the output."""
    left, right = (Fixed(COMPONENT, beats[name]) for name in ("normal_left", "normal_right"))
    expected = np.zeros(len(left.codes), dtype_of(unit.o.payload.shape()))
    for copy, of_lights in zip(COPIES, vectors, strict=True):
        for light, vector in enumerate(of_lights):
            first, second, coefficient, shift, out_of_range = unit.parameters.compute(
                left, right, Fixed(COMPONENT, vector), beats["length"]
            )
            expected["lights"][copy]["first"][:, light] = first.codes
            expected["lights"][copy]["second"][:, light] = second.codes
    expected["coefficient"], expected["length"], expected["out_of_range"] = (
        coefficient.codes,
        beats["length"],
        out_of_range,
    )
    if unit.parameters.recurrence.form == "reinsch":
        expected["shift"] = shift
    return expected


@pytest.mark.parametrize(("parameters", "lights", "interval"), VARIANTS)
def test_equals_twin(verify, normal_pairs, setup_spans, light_constants, parameters, lights, interval):
    rng = np.random.default_rng(interval)
    unit = RecurrenceSetupUnit(parameters, lights, interval)
    beats = spans(rng, setup_spans)
    vectors = [quantise(normal_pairs(rng, lights, 0.0)[0]) for _ in range(2)]
    # At the peak, and with no slope at all.
    beats["normal_left"][:50] = vectors[1][0]
    beats["normal_right"][:10] = vectors[1][0]
    expected = expected_of(unit, beats, vectors)
    assert 50 < np.count_nonzero(expected["out_of_range"]) < 200
    verify(unit, beats, expected, constants=light_constants(unit, *vectors))


@pytest.mark.parametrize(
    ("lights", "interval", "multipliers", "shifters", "latency"),
    [
        pytest.param(1, 1, 46, 18, 141, marks=pytest.mark.long),
        pytest.param(1, 2, 23, 9, 144, marks=pytest.mark.long),
        (1, 4, 12, 5, 156),
        (1, 8, 6, 3, 172),
        (1, 46, 1, 1, 282),
        pytest.param(2, 4, 20, 9, 156, marks=pytest.mark.long),
    ],
)
def test_multipliers(lights, interval, multipliers, shifters, latency):
    """14 products a span and 32 a light, as even as the interval allows; all of 18 bits."""
    unit = RecurrenceSetupUnit(lights=lights, initiation_interval=interval)
    cost = cost_of(unit)
    assert cost.multipliers == {(18, 18): multipliers}
    assert (unit.multipliers, unit.shifters) == (multipliers, shifters)
    assert cost.constant_multipliers == 0
    assert unit.latency == latency
    assert multipliers == -(-(14 + 32 * lights) // interval)


@pytest.mark.parametrize("interval", [0, -1])
def test_refuses_an_interval(interval):
    with pytest.raises(ValueError, match=rf"^interval must be at least 1, not {interval}$"):
        RecurrenceSetupUnit(initiation_interval=interval)


def test_beats_after_a_pause(normal_pairs, setup_spans, light_constants, verify_pauses):
    """The results of a beat do not depend on what came before, or on how long ago it was."""
    rng = np.random.default_rng(3)
    unit = RecurrenceSetupUnit()
    beats = {name: codes[:40] for name, codes in spans(rng, setup_spans).items()}
    vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
    expected = expected_of(unit, beats, vectors)
    verify_pauses(unit, beats, expected, 150, light_constants(unit, *vectors))


def test_every_bit_counts(normal_pairs, setup_spans, light_constants):
    """The last bits of the products and of the sums are rounded off: each decides once in thousands."""
    rng = np.random.default_rng(12)
    unit = RecurrenceSetupUnit()
    for _ in range(2):
        beats = spans(rng, setup_spans, 3000)
        vectors = [quantise(normal_pairs(rng, 1, 0.0)[0]) for _ in range(2)]
        expected, constants = expected_of(unit, beats, vectors), light_constants(unit, *vectors)
        run = simulate(unit, beats, count=len(expected), constants=constants, engine="auto")
        np.testing.assert_array_equal(run.beats, expected)
