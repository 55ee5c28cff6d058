"""Clock plan: dividers of one PLL for the clocks of a display and of the drawing logic."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil

__all__ = ["ClockPlan", "NoClockPlan", "clock_plan"]

VCO = (400_000_000, 800_000_000)
"""Lowest and highest rate of the oscillator of an ECP5's PLL, Hz."""

PHASE_DETECTOR = 3_125_000
"""Lowest rate of the PLL's phase detector, Hz."""

DIVIDERS, FEEDBACK_DIVIDERS = 128, 80
"""Largest divider of the PLL's reference and outputs, and largest divider of its feedback."""

FEEDBACK = 200_000_000
"""Highest rate of the fed-back output, Hz. Other outputs of the PLL go to 400 MHz."""

SERIAL = 5
"""Rate of the serial clock over the rate of the pixel clock."""

TOLERANCE = Fraction(1, 200)
"""Largest relative error of a display's pixel clock."""


class NoClockPlan(ValueError):
    """Raised if no dividers give the wanted clocks."""


@dataclass(frozen=True)
class ClockPlan:
    """Dividers of a PLL: the oscillator runs at ``reference / input * feedback * loop``.

    Each output is the oscillator over a divider: the fed-back output, the serial clock, the pixel clock and
    the drawing clock.

    Parameters
    ----------
    reference : int
        Rate of the board's clock, Hz.
    input_divider, feedback_divider : int
        Dividers of the reference, and of the fed-back output.
    loop, serial, pixel, draw : int
        Dividers of the outputs; ``loop`` belongs to the fed-back output.

    Source: docs/theory/video.md#display.
    """

    reference: int
    input_divider: int
    feedback_divider: int
    loop: int
    serial: int
    pixel: int
    draw: int

    @property
    def vco(self) -> Fraction:
        """Rate of the oscillator, Hz."""
        return Fraction(self.reference, self.input_divider) * self.feedback_divider * self.loop

    @property
    def rates(self) -> dict[str, Fraction]:
        """Rate of each clock domain, Hz."""
        dividers = {"sync": self.draw, "pixel": self.pixel, "serial": self.serial}
        return {name: self.vco / divider for name, divider in dividers.items()}


def clock_plan(reference: int, pixel_rate: float, draw_rate: float) -> ClockPlan:
    """The plan with the nearest pixel clock, and among equal plans the fastest drawing clock.

    Parameters
    ----------
    reference : int
        Rate of the board's clock, Hz.
    pixel_rate : float
        Wanted pixel clock, Hz. The plan's pixel clock is within `TOLERANCE`.
    draw_rate : float
        Largest rate of the drawing clock, Hz.

    Raises
    ------
    NoClockPlan
        If there is no plan.

    Source: docs/theory/video.md#display.
    """
    asked, plans = Fraction(pixel_rate), []
    for input_divider in range(1, min(DIVIDERS, reference // PHASE_DETECTOR) + 1):
        step = Fraction(reference, input_divider)
        for serial in range(1, DIVIDERS // SERIAL + 1):
            # The rate of the oscillator is the whole number of steps that is nearest to the rate asked for.
            steps = round(asked * SERIAL * serial / step)
            vco = steps * step
            if not VCO[0] <= vco <= VCO[1]:
                continue
            error = abs(vco / (SERIAL * serial) / asked - 1)
            draw = ceil(vco / Fraction(draw_rate))
            loops = [
                d
                for d in range(ceil(vco / FEEDBACK), DIVIDERS + 1)
                if steps % d == 0 and steps // d <= FEEDBACK_DIVIDERS
            ]
            if error <= TOLERANCE and draw <= DIVIDERS and loops:
                loop = loops[0]
                plan = ClockPlan(reference, input_divider, steps // loop, loop, serial, SERIAL * serial, draw)
                plans.append((error, -vco / draw, input_divider, serial, plan))
    if not plans:
        raise NoClockPlan(
            f"no dividers make {pixel_rate / 1e6:g} MHz for pixels, and {draw_rate / 1e6:g} MHz or a little "
            f"less for drawing, of {reference / 1e6:g} MHz"
        )
    return min(plans, key=lambda entry: entry[:-1])[-1]
