"""Recurrence unit: cosines of equally spaced angles by a recurrence of second order ([T] 3.3)."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from blysk.golden.number.fixed import SQ, UQ, Fixed, Format
from blysk.golden.number.unit_vector import COMPONENT

__all__ = ["RECURRENCE_FORMS", "Recurrence", "shortcut_cosine"]

RECURRENCE_FORMS = ("reinsch", "direct")
"""Forms of the recurrence: Reinsch's form and the direct form."""


def shortcut_cosine(angle: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Cosine of one step by the shortcut of [T] 3.3, ``cos(psi/m) = (cos psi - 1)/m^2 + 1``.

    ``1 - cos(psi/m)`` is then too small by 0.3 % at psi = 10 degrees and by 8.8 % at 60.

    Parameters
    ----------
    angle : array
        psi in radians.
    steps : array
        Number of steps m.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.3.
    """
    found: np.ndarray = (np.cos(angle) - 1) / np.square(np.asarray(steps, dtype=np.float64)) + 1
    return found


@dataclass(frozen=True)
class Recurrence:
    """Cosines ``x(k) = A cos(phase - k d)`` for k = 0 ... m - 1, by one product a pixel.

    ``direct``, as published: ``x(k+1) = 2 cos(d) x(k) - x(k-1)``. The coefficient is near 2. So its rounding
    error is large compared with the curvature, the small number ``2 - 2 cos d``. The form is **unstable** in
    short words.

    ``reinsch``: ``D(k) = D(k-1) - K 2^(2-s) x(k)``, ``x(k+1) = x(k) + D(k)``, from ``D(0) = x(1) - x(0)``,
    with ``K 2^(2-s) = 4 sin^2(d/2)``. The small number has its own shift s. The state has guard bits, which
    cost only adders.

    F is ``fraction_bits`` and E ``guard_bits``; with the defaults multiplier operands have 18 bits:

    =============== ============================ ===========================================
    word            ``reinsch``                  ``direct``
    =============== ============================ ===========================================
    x               SQ(2, F + E), wraps          SQ(2, F), rounded, saturates
    D               SQ(2, F + E), wraps
    coefficient     K UQ(0, F + 1), s 6 bits     ``-2 cos d`` SQ(2, F), holds -2; cut
    operand         x rounded to SQ(2, F)        x
    product         cut to F + E fraction bits   rounded
    result          rounded, saturates           rounded, saturates
    =============== ============================ ===========================================

    The result has the format `result_format`.

    The error of the result is at most `error`. In ``reinsch`` it is at most ``psi^2/2 2^-F``, psi = (m - 1)
    d, **for any length**, plus 4.8e-7 by the bits dropped in 4095 pixels. In ``direct`` it is 0.05 after 64
    pixels. From 300 pixels on the range of the words gives the only bound, 3.
    docs/theory/bounds.md#recurrence derives the bounds.

    With d up to 90 degrees and ``|A| <= 1 - 2^-16`` no word of ``reinsch`` wraps, in spans of any length.
    This needs 16 or more fraction bits and 20 or more guard bits. With shorter words the errors of dropped
    bits add up: with 8 and 10 bits, spans of very small steps wrap after about 1300 pixels.

    **Interleaved**, for one pixel a cycle. The product in the loop takes several cycles, so four recurrences
    share the loop. Phase j has the pixels j, j + 4, j + 8, ...: ``x(k+4) = 2 cos(4d) x(k) - x(k-4)``. This is
    the same recurrence with a step of 4d and its own start values. A phase has ``ceil(m/4)`` pixels, 4d
    apart, and `error` bounds their error. 4d is limited to 90 degrees. In spans of up to 90 degrees this has
    no effect. In wider spans of more than 4 pixels d must be at most 22.5 degrees.

    A setup can compute the start values in two ways.

    - It takes x(0), D(0) and the coefficient of d, and seven steps of the recurrence with ``interleave`` 1
      (`prologue`). These steps add at most `prologue_error`. No part of it grows with the square of the
      length.
    - It takes 17-bit cosines and sines, for example from the highlight-cosine unit.
      ``D = 2 sin(2d) A sin(phase - (j+2) d)`` is a small number times a sine. So an error e of the sine
      becomes ``psi e`` at the end of the span.

    Parameters
    ----------
    form : str
        One of `RECURRENCE_FORMS`.
    fraction_bits : int
        F, 8 to 32. Up to 16 a multiplier of 18x18 bits is enough.
    guard_bits : int
        E, 10 to 28, in ``reinsch`` only.
    interleave : int
        Number of phases: 1, as published, or 4. With 1 a span has two start values for each cosine in place
        of eight, and there are registers for one phase only. With 4 there is a pixel a cycle.
    result_format : Format
        Format of the cosines. With 25 fraction bits the last rounding is negligible.

    Raises
    ------
    ValueError
        If the form or the number of phases is unknown, or a number of bits is out of range. If the result's
        format is unsigned, or has more fraction bits than the state of ``reinsch``.

    Source: docs/theory/interpolation.md#recurrence; [T] 3.3, figure 3.5; [Stoer02].
    """

    form: Literal["reinsch", "direct"] = "reinsch"
    fraction_bits: int = 16
    guard_bits: int = 28
    interleave: Literal[1, 4] = 1
    result_format: Format = COMPONENT

    SHIFT_BITS = 6
    LENGTH_BITS = 12
    MAX_STEP = np.pi / 2

    def __post_init__(self) -> None:
        if self.form not in RECURRENCE_FORMS:
            raise ValueError(f"form must be one of {', '.join(RECURRENCE_FORMS)}, not {self.form!r}")
        if not 8 <= self.fraction_bits <= 32:
            raise ValueError(f"fraction_bits must be 8 to 32, not {self.fraction_bits}")
        if not 10 <= self.guard_bits <= 28:
            raise ValueError(f"guard_bits must be 10 to 28, not {self.guard_bits}")
        if self.interleave not in (1, 4):
            raise ValueError(f"interleave must be 1 or 4, not {self.interleave!r}")
        most = self.fraction_bits + self.guard_bits
        if not self.result_format.signed or self.result_format.fraction_bits > most:
            raise ValueError(
                f"result_format must be signed, of at most {most} fraction bits, not {self.result_format}"
            )

    @property
    def state_format(self) -> Format:
        """Format of the state: x and, in ``reinsch``, D."""
        return SQ(2, self.fraction_bits + (self.guard_bits if self.form == "reinsch" else 0))

    @property
    def coefficient_format(self) -> Format:
        """Format of K, or of ``-2 cos d``."""
        return UQ(0, self.fraction_bits + 1) if self.form == "reinsch" else SQ(2, self.fraction_bits)

    @property
    def curvature_format(self) -> Format:
        """Format of ``4 sin^2(d/2) x`` in ``reinsch``, before and during the right shift."""
        state, product = self.state_format.fraction_bits, 2 * self.fraction_bits - 1
        return SQ(4, max(state, product))

    def error(self, length: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Bound of the error of every pixel, for ``|A| <= 1 - 2^-16`` and start values from `start`.

        Parameters
        ----------
        length : int array
            Pixels m.
        angle : array
            psi = (m - 1) d in radians.

        Returns
        -------
        float64 array
            3 if the range of the words is the only bound of ``direct``.
        """
        steps, angle = self._phase_span(length, angle)
        sums = steps * np.maximum(steps - 1, 0) / 2
        word, rounding = 2.0**-self.fraction_bits, self.result_format.step / 2
        if self.form == "reinsch":
            cut = self.state_format.step
            # The state is under 1.01. At the largest shift the coefficient is off by 2^-(F + 47).
            curvature = 1.01 * np.square(angle / np.maximum(steps, 1)) + 2.0**-47
            error: np.ndarray = sums * (curvature * word + cut) + (steps + 2) * cut / 2 + rounding
            return error
        growth = sums * word
        with np.errstate(divide="ignore"):
            grown = (1.5 * growth + np.maximum(steps, 0.5) * word) / np.maximum(1 - growth, 0) + rounding
        found: np.ndarray = np.minimum(grown, 3.0)
        return found

    def _phase_span(self, length: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Steps of the longest phase, and the angle that they cover together."""
        length = np.asarray(length, dtype=np.float64)
        steps = np.ceil(length / self.interleave) - 1
        return steps, np.asarray(angle, dtype=np.float64) * self.interleave * steps / np.maximum(
            length - 1, 1
        )

    def prologue_error(self, length: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """Bound of the error that start values from `prologue` add to `error`, for spans up to 90 degrees.

        The bound is for ``reinsch``. docs/theory/bounds.md#recurrence derives it.

        Parameters
        ----------
        length, angle
            As for `error`.
        """
        steps, _ = self._phase_span(length, angle)
        step = np.asarray(angle, dtype=np.float64) / np.maximum(np.asarray(length) - 1, 1)
        cut = self.state_format.step
        error = (1.01 * np.square(step) + 2.0**-47) * 2.0**-self.fraction_bits + cut
        # An error of the first value comes back up to 1/cos(2d) times as large, with d up to 11.25 degrees.
        found: np.ndarray = 1.09 * (3 * error + 2 * cut) + steps * (18 * error + 2 * cut)
        return found

    def coefficient(self, step: np.ndarray) -> tuple[Fixed, np.ndarray]:
        """Coefficient for a step d, in the format of the recurrence unit.

        Parameters
        ----------
        step : array, any shape
            d in radians, 0 to 90 degrees.

        Returns
        -------
        coefficient : Fixed, same shape, `coefficient_format`
            K, or ``-2 cos d``; if interleaved, for 4d, up to 90 degrees.
        shift : int array, same shape
            s, 0 to 47; 0 in ``direct``.

        Raises
        ------
        ValueError
            If a step is out of range.
        """
        step = np.asarray(step, dtype=np.float64)
        if not np.all((step >= 0) & (step <= self.MAX_STEP)):
            raise ValueError("steps must be 0 to 90 degrees")
        step = self._phase_step(step)
        format = self.coefficient_format
        if self.form == "direct":
            codes = np.ceil(np.ldexp(-2 * np.cos(step), format.fraction_bits))
            return Fixed(format, codes.astype(np.int64)), np.zeros(step.shape, dtype=np.int64)
        small = 4 * np.square(np.sin(step / 2))
        shift = np.minimum(2 - np.frexp(small)[1].astype(np.int64), (3 << (self.SHIFT_BITS - 2)) - 1)
        codes = np.floor(np.ldexp(small, format.fraction_bits + shift - 2) + 0.5).astype(np.int64)
        # A word that is rounded up to 1 becomes 1/2 with a shift of one less.
        full = codes > format.max_code
        return Fixed(format, codes >> full), shift - full

    def start(self, amplitude: np.ndarray, phase: np.ndarray, step: np.ndarray) -> tuple[Fixed, Fixed]:
        """First value, and second value or first difference, in the format of the recurrence unit.

        Parameters
        ----------
        amplitude, phase, step : arrays that broadcast
            A, -1 to 1; phase and d in radians.

        Returns
        -------
        first, second : Fixed, `state_format`
            First is ``x(0)``; second is ``x(1)`` in ``direct``, ``x(1) - x(0)`` in ``reinsch``. If
            interleaved, there is one more axis for the four phases: first is ``x(j)``, second ``x(j+4)`` or
            ``x(j+4) - x(j)``.
        """
        if self.interleave > 1:
            amplitude, phase, step = (np.asarray(x)[..., np.newaxis] for x in (amplitude, phase, step))
            phase, step = phase - np.arange(self.interleave) * step, self._phase_step(step)
        first = amplitude * np.cos(phase)
        if self.form == "direct":
            second = amplitude * np.cos(np.subtract(phase, step))
        else:
            second = 2 * amplitude * np.sin(np.divide(step, 2)) * np.sin(phase - np.divide(step, 2))
        return Fixed.round(self.state_format, first), Fixed.round(self.state_format, second)

    def _phase_step(self, step: np.ndarray) -> np.ndarray:
        """Step of one phase: d; if interleaved, 4d up to 90 degrees."""
        return step if self.interleave == 1 else np.minimum(self.interleave * step, self.MAX_STEP)

    def prologue(
        self, first: Fixed, second: Fixed, coefficient: Fixed, shift: np.ndarray
    ) -> tuple[Fixed, Fixed]:
        """Bit-accurate start values of the four phases, from start values without interleaving.

        Parameters
        ----------
        first, second, coefficient, shift
            As for `states` with ``interleave`` 1, shape (spans,). The coefficient is for a step d.

        Returns
        -------
        first, second : Fixed, shape (spans, 4), `state_format`
            In the form of `start`. Second values after the last pixel may have wrapped.
        """
        codes = replace(self, interleave=1).states(first, second, coefficient, shift, 8).codes.T
        start, following = codes[:, :4], codes[:, 4:]
        if self.form == "reinsch":
            # The register of x holds half a step of the operand, which start values do not have.
            start, following = (
                self.state_format.wrap(start - self._half_operand),
                self.state_format.wrap(following - start),
            )
        return Fixed(self.state_format, start), Fixed(self.state_format, following)

    @property
    def _half_operand(self) -> int:
        return 1 << (self.guard_bits - 1)

    def states(self, first: Fixed, second: Fixed, coefficient: Fixed, shift: np.ndarray, steps: int) -> Fixed:
        """Bit-accurate values of x in the format of the state.

        Parameters
        ----------
        first, second : Fixed, shape (spans,) or, if interleaved, (spans, 4), `state_format`
            Start values, see `start`.
        coefficient : Fixed, shape (spans,), `coefficient_format`
            See `coefficient`.
        shift : int array, shape (spans,)
            s, 0 to 63.
        steps : int
            Number of values of each span.

        Returns
        -------
        Fixed, shape (steps, spans), `state_format`
            In ``reinsch`` half a step of the operand, 2^-(F+1), is added, as in the register.

        Raises
        ------
        ValueError
            If an operand has another format or a shift is out of range.
        """
        formats = (self.state_format, self.state_format, self.coefficient_format)
        if (first.format, second.format, coefficient.format) != formats:
            raise ValueError(
                f"operands must be {', '.join(map(str, formats))}, "
                f"not {first.format}, {second.format}, {coefficient.format}"
            )
        shift = np.asarray(shift, dtype=np.int64)
        if shift.size and not 0 <= shift.min() <= shift.max() < 1 << self.SHIFT_BITS:
            raise ValueError(f"shifts must be 0 to {(1 << self.SHIFT_BITS) - 1}")
        # Products of more than 63 bits, which the defaults do not have, need Python's integers.
        kind = object if self.fraction_bits > 29 else np.int64
        x, y, factor = (word.codes.astype(kind) for word in (first, second, coefficient))
        if self.interleave > 1:
            factor, shift = factor[:, np.newaxis], shift[:, np.newaxis]
        found = np.empty((-(-steps // self.interleave), *x.shape), dtype=np.int64)
        step = self._reinsch if self.form == "reinsch" else self._direct
        if self.form == "reinsch":
            x = self.state_format.wrap(x + self._half_operand)
        # Every step rounds, so there is no closed form: a loop over pixels of all spans at once.
        for k in range(len(found)):
            found[k] = x
            x, y = step(x, y, factor, shift, k == 0)
        if self.interleave > 1:
            found = np.moveaxis(found, 2, 1).reshape(-1, found.shape[1])[:steps]
        return Fixed(self.state_format, found)

    def _reinsch(
        self, x: np.ndarray, difference: np.ndarray, factor: np.ndarray, shift: np.ndarray, is_first: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        if not is_first:
            bits = self.curvature_format.fraction_bits
            product = (x >> self.guard_bits) * factor << (bits - 2 * self.fraction_bits + 1)
            cut = bits - self.state_format.fraction_bits
            difference = self.state_format.wrap(difference - (product >> shift >> cut))
        return self.state_format.wrap(x + difference), difference

    def _direct(
        self, x: np.ndarray, other: np.ndarray, factor: np.ndarray, shift: np.ndarray, is_first: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        if is_first:
            return other, x
        bits = self.fraction_bits
        total = ((1 << (bits - 1)) - (other << bits) - x * factor) >> bits
        return np.clip(total, self.state_format.min_code, self.state_format.max_code), x

    def compute(
        self,
        first: Fixed,
        second: Fixed,
        coefficient: Fixed,
        shift: np.ndarray,
        span: np.ndarray,
        index: np.ndarray,
    ) -> Fixed:
        """Bit-accurate cosines of every pixel.

        Parameters
        ----------
        first, second, coefficient, shift
            As for `states`.
        span : int array, shape (pixels,)
            Span of each pixel.
        index : int array, shape (pixels,)
            Index of each pixel in its span, from 0 on.

        Returns
        -------
        Fixed, shape (pixels,), `result_format`

        Raises
        ------
        ValueError
            As for `states`.
        """
        index = np.asarray(index, dtype=np.int64)
        steps = int(index.max()) + 1 if index.size else 0
        states = self.states(first, second, coefficient, shift, steps)[index, span]
        return self.result(states)

    def result(self, states: Fixed) -> Fixed:
        """Bit-accurate cosines from values of `states`: rounded half up and saturated."""
        bits = self.result_format.fraction_bits
        if self.form == "reinsch":
            # Half a step of the result in place of half a step of the operand.
            states = states + self.exchange
            return states.truncate(bits).saturate(self.result_format)
        if states.format.fraction_bits < bits:
            states = states.extend(SQ(2, bits))
        return states.round_half_up(bits).saturate(self.result_format)

    @property
    def exchange(self) -> Fixed:
        """Half a step of the result minus half a step of the operand of ``reinsch``."""
        return Fixed.round(
            SQ(0, self.state_format.fraction_bits),
            (self.result_format.step - 2.0**-self.fraction_bits) / 2,
        )
