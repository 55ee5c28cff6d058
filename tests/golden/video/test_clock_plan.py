"""Dividers of the PLL: rates by the formula of its manual, and within its limits."""

from fractions import Fraction

import pytest

from blysk.golden.video.clock_plan import ClockPlan, NoClockPlan, clock_plan


@pytest.mark.parametrize("reference", [12_000_000, 25_000_000, 48_000_000, 50_000_000, 100_000_000])
@pytest.mark.parametrize("draw", [40e6, 63e6, 70e6, 100e6])
def test_rates_and_limits(reference, draw):
    plan = clock_plan(reference, 25.2e6, draw)
    detector = Fraction(reference, plan.input_divider)
    vco = detector * plan.feedback_divider * plan.loop
    assert plan.vco == vco
    assert 400e6 <= vco <= 800e6
    assert detector >= 3.125e6
    assert 1 <= plan.feedback_divider <= 80
    assert max(plan.loop, plan.serial, plan.pixel, plan.draw) <= 128
    assert vco / plan.loop <= 200e6
    rates = plan.rates
    assert rates["serial"] == 5 * rates["pixel"]
    assert abs(rates["pixel"] / 25.2e6 - 1) < 0.005
    assert 0.85 * draw < rates["sync"] <= draw


def test_exact_of_the_boards_clocks():
    """25 and 50 MHz give exactly 25.2 and 126 MHz."""
    for reference in (25_000_000, 50_000_000):
        rates = clock_plan(reference, 25.2e6, 63e6).rates
        assert (rates["pixel"], rates["serial"], rates["sync"]) == (25_200_000, 126_000_000, 63_000_000)


def test_what_no_dividers_make_is_refused():
    with pytest.raises(NoClockPlan, match="no dividers"):
        clock_plan(25_000_000, 25.2e6, 2e6)


def test_plan_states_its_rates():
    assert ClockPlan(25_000_000, 5, 21, 6, 5, 25, 10).vco == 630_000_000
